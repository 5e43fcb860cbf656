// Plates that a show takes of its persons' cameras itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "studio/person_feed.h"
#include "studio/plate_taking.h"
#include "studio/set.h"
#include "tests/made_files.h"
#include "tests/studio/made_show.h"

namespace studio::taken_plate_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// A green screen of 64x48 with a little noise, whose light is `light`. From frame 60 to 89 a red
// thing stands before it; from frame 100 on the light is half, and from 170 on the thing is back.
class Stage final : public capture::Camera {
 public:
  Stage() {
    info_.width = 64;
    info_.height = 48;
    info_.rate = {25, 1};
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    auto image = std::make_shared<capture::Image>(capture::make_image(48, 64));
    const bool there = (number_ >= 60 && number_ < 90) || number_ >= 170;
    const float light = number_ < 100 ? 1.0F : 0.5F;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const bool red = there && x > 20 && x < 40 && y > 10;
        const std::array colour =
            red ? std::array{0.4F, 0.05F, 0.05F} : std::array{0.05F, 0.4F, 0.08F};
        for (int c = 0; c < 3; ++c) {
          image->at(y, x, c) = light * colour[static_cast<std::size_t>(c)] + noise_(random_);
        }
      }
    }
    capture::Frame frame;
    frame.image = std::move(image);
    frame.number = number_;
    frame.time = capture::time_of_frame(number_++, info_.rate);
    return frame;
  }

 private:
  capture::CameraInfo info_;
  std::mt19937 random_{3};
  std::uniform_real_distribution<float> noise_{0, 0.002F};
  std::int64_t number_ = 0;
};

class TakenPlate : public MadeShowTest {
 protected:
  static void SetUpTestSuite() {
    MadeShowTest::SetUpTestSuite();
    capture::register_camera("stage", [](std::string_view, const capture::CameraOptions&) {
      return std::make_unique<Stage>();
    });
  }
  Set set_with(const std::string& key) const {
    return made_set("grey:500,25,0",
                    "[[billboard]]\nname = \"she\"\nposition = [0, -1, 0]\nheight = 1.7\n"
                    "source = \"stage:\"\n[billboard.key]\nplate = \"take\"\n" +
                        key);
  }
};

// Pictures up to one frame; how it is keyed then.
PersonStatus show_until(PersonFeed& feed, const Set& set, int& from, int to) {
  PersonStatus status;
  for (; from <= to; ++from) {
    status =
        feed.at(capture::time_of_frame(from, {25, 1}), set.camera.pose.cam_from_set).front().status;
  }
  return status;
}

TEST_F(TakenPlate, IsOfTheFirstFramesAndThenKeys) {
  const Set set = set_with("");
  PersonFeed feed(set, std::nullopt, false);
  int at = 0;
  PersonStatus status = show_until(feed, set, at, 20);
  EXPECT_EQ(status.key, "its plate is being taken");
  EXPECT_EQ(status.confidence, 0);
  EXPECT_THAT(
      feed.take_notes(),
      ElementsAre("she takes its plate of the next 50 frames: nobody may be in the picture"));
  status = show_until(feed, set, at, 75);
  EXPECT_EQ(status.key, "good");
  EXPECT_GT(status.confidence, 0.9F);
  EXPECT_THAT(feed.take_notes(), ElementsAre("she has its plate"));
}

// The screen's light is another, for good: the plate is taken anew while the show runs.
TEST_F(TakenPlate, IsTakenAnewForAnotherNumberAndElseStays) {
  const Set set = set_with("");
  PersonFeed feed(set, std::nullopt, false);
  int at = 0;
  show_until(feed, set, at, 75);
  feed.take_notes();

  const Set despilled = set_with("despill = 2\n");
  PersonFeed goes_on(despilled, std::nullopt, false, &feed);
  goes_on.take_over();
  EXPECT_EQ(show_until(goes_on, despilled, at, 80).key, "good");
  EXPECT_THAT(goes_on.take_notes(), IsEmpty());

  show_until(goes_on, despilled, at, 105);
  const Set anew = set_with("take = 1\n");
  PersonFeed again(anew, std::nullopt, false, &goes_on);
  again.take_over();
  EXPECT_EQ(show_until(again, anew, at, 150).key, "its plate is being taken");
  EXPECT_EQ(show_until(again, anew, at, 180).key, "good");
  EXPECT_THAT(again.take_notes(), ElementsAre(HasSubstr("of the next 50"), "she has its plate"));
}

// What was taken counts, whether it is whole when the edit is read, when it comes, or later.
TEST_F(TakenPlate, GoesOnWhileSetsAreEdited) {
  for (const int edited : {20, 45}) {
    const Set set = set_with(""), despilled = set_with("despill = 2\n");
    PersonFeed feed(set, std::nullopt, false);
    int at = 0;
    show_until(feed, set, at, edited);
    PersonFeed next(despilled, std::nullopt, false, &feed);  // read beside the show
    show_until(feed, set, at, edited + 10);
    next.take_over();
    const PersonStatus status = show_until(next, despilled, at, 75);
    EXPECT_EQ(status.key, "good") << edited;
    std::vector<std::string> notes = feed.take_notes();
    const std::vector<std::string> more = next.take_notes();
    notes.insert(notes.end(), more.begin(), more.end());
    EXPECT_THAT(notes, ElementsAre(HasSubstr("of the next 50"), "she has its plate")) << edited;
  }
}

TEST_F(TakenPlate, TellsThatSomebodyMayHaveBeenInThePicture) {
  for (const int from : {170, 45}) {  // all the time, and some of it
    const Set set = set_with("");
    PersonFeed feed(set, capture::Time{0}, false);
    int at = from;
    show_until(feed, set, at, from + 60);
    EXPECT_THAT(feed.take_notes(), Contains(HasSubstr("she has its plate, but"))) << from;
  }
}

TEST_F(TakenPlate, OfTooShortAVideoIsRefused) {
  const Set set = made_set("grey:500,25,0",
                           "[[billboard]]\nposition = [0, -1, 0]\nheight = 1.7\n"
                           "source = \"grey:49,25,0\"\n[billboard.key]\nplate = \"take\"\n");
  try {
    PersonFeed feed(set, std::nullopt, false);
    FAIL();
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a plate is taken of 50 frames, but grey:49,25,0 has 49"));
  }
}

// As Stage, but it ends, or is one picture again and again; nothing tells before.
class ShortStage final : public capture::Camera {
 public:
  ShortStage(int frames, bool stands) : left_(frames), stands_(stands) {}
  const capture::CameraInfo& info() const override { return stage_.info(); }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    if (left_-- == 0) return std::nullopt;
    auto frame = stage_.next();
    if (stands_ && picture_) frame->image = picture_;
    picture_ = frame->image;
    return frame;
  }

 private:
  Stage stage_;
  int left_;
  bool stands_;
  std::shared_ptr<const capture::Image> picture_;
};

TEST_F(TakenPlate, TellsThatTooFewPicturesCame) {
  capture::register_camera("brief", [](std::string_view rest, const capture::CameraOptions&) {
    return std::make_unique<ShortStage>(std::stoi(std::string(rest)), false);
  });
  capture::register_camera("stands", [](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<ShortStage>(500, true);
  });
  const auto set_of = [&](const std::string& source, const std::string& key) {
    return made_set("grey:500,25,0",
                    "[[billboard]]\nname = \"she\"\nposition = [0, -1, 0]\nheight = 1.7\nsource = "
                    "\"" +
                        source + "\"\n[billboard.key]\nplate = \"take\"\n" + key);
  };
  for (const auto& [source, note] :
       {std::pair("brief:30", "has no plate: its video has ended after 30 of 50 pictures"),
        std::pair("stands:", "has no plate: its video stands still after 1 of 50 pictures")}) {
    const Set set = set_of(source, "");
    PersonFeed feed(set, std::nullopt, false);
    int at = 0;
    show_until(feed, set, at, 80);
    EXPECT_THAT(feed.take_notes(), Contains(HasSubstr(note))) << source;
  }
  // Taken anew when the video is nearly over: the plate before goes on.
  const Set set = set_of("brief:90", ""), anew = set_of("brief:90", "take = 1\n");
  PersonFeed feed(set, std::nullopt, false);
  int at = 0;
  EXPECT_EQ(show_until(feed, set, at, 75).key, "good");
  PersonFeed again(anew, std::nullopt, false, &feed);
  again.take_over();
  EXPECT_EQ(show_until(again, anew, at, 110).key, "good");
  EXPECT_THAT(again.take_notes(),
              Contains(HasSubstr("has no new plate: its video has ended after")));
}

// A lamp that flickers is nobody who moves, and what a garbage mask cuts away is no doubt.
TEST(PlateTaking, DoubtsWhatMovesAndWhatIsNoScreen) {
  const auto shot = [](float light, int thing_at) {
    auto image = std::make_shared<capture::Image>(capture::make_image(96, 128));
    for (int y = 0; y < 96; ++y) {
      for (int x = 0; x < 128; ++x) {
        const bool thing = thing_at >= 0 && std::abs(x - thing_at) < 12;
        image->at(y, x, 0) = light * (thing ? 0.4F : 0.05F);
        image->at(y, x, 1) = light * (thing ? 0.1F : 0.4F);
        image->at(y, x, 2) = light * 0.08F;
      }
    }
    return image;
  };
  const auto doubts = [&](std::vector<std::uint8_t> garbage, auto&& thing_at) {
    PlateTaking taking(std::move(garbage), true, true);
    for (int i = 0; i < static_cast<int>(shots_of_plate); ++i) {
      EXPECT_EQ(taking.plate(), nullptr);
      taking.add(shot(i % 2 == 0 ? 1.0F : 0.8F, thing_at(i)));
    }
    EXPECT_NE(taking.plate(), nullptr);
    const auto told = taking.take_doubts();
    EXPECT_EQ(taking.take_doubts(), std::nullopt);
    return told.value_or("nothing told");
  };
  EXPECT_EQ(doubts({}, [](int) { return -1; }), "");
  EXPECT_THAT(doubts({}, [](int i) { return 2 * i; }), HasSubstr("something moved in"));
  EXPECT_THAT(doubts({}, [](int) { return 60; }), HasSubstr("% of the plate is not screen"));
  std::vector<std::uint8_t> garbage(std::size_t{96} * 128, 0);
  for (std::size_t i = 0; i < garbage.size(); ++i)
    garbage[i] = i % 128 > 40 && i % 128 < 80 ? 255 : 0;
  EXPECT_EQ(doubts(garbage, [](int) { return 60; }), "");
}

TEST_F(TakenPlate, IsReadFromTheSet) {
  const Set set = set_with("take = 7\n");
  const KeyChoice& key = *set.persons.front().cameras.front().key;
  EXPECT_TRUE(key.takes_plate);
  EXPECT_EQ(key.take, 7);
  EXPECT_THAT(key.plate, IsEmpty());
  try {
    made_set("grey:500,25,0",
             "[[billboard]]\nposition = [0, -1, 0]\nheight = 1.7\nsource = \"stage:\"\n"
             "[billboard.key]\ntake = 7\n");
    FAIL();
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("take"));
  }
}

// Pictures of a live camera that come while one is being added are not waited for.
TEST(PlateTaking, TakesWhatItCanOfPicturesThatDoNotWait) {
  const auto shot = std::make_shared<capture::Image>(capture::make_image(480, 640));
  for (std::size_t i = 0; i < shot->pixels.size(); ++i) shot->pixels[i] = i % 3 == 1 ? 0.4F : 0.05F;
  PlateTaking taking({}, true, false);
  std::size_t given = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!taking.plate() && std::chrono::steady_clock::now() < end) {
    taking.add(shot);
    ++given;
  }
  ASSERT_NE(taking.plate(), nullptr);
  EXPECT_GT(given, shots_of_plate);
  EXPECT_NEAR(taking.plate()->light.at(240, 320, 1), 0.4F, 1e-4);
  EXPECT_EQ(taking.take_doubts(), "");
}

}  // namespace
}  // namespace studio::taken_plate_test
