// Sets that are edited on air: what the edit does not concern runs on, cameras that can be opened
// only once above all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>

#include "studio/show.h"
#include "tests/studio/made_show.h"

namespace studio::set_change_test {
namespace {

using testing::ElementsAre;
using testing::Gt;
using testing::HasSubstr;
using testing::IsEmpty;

// Of "sole:", which can be opened only once at a time, as devices can.
std::atomic<int> open_now = 0, opened = 0;

// Frame n is grey by .1 + (n % 50) / 100; 64x32. Of no frames, it is endless.
class SoleCamera final : public capture::Camera {
 public:
  SoleCamera(std::int64_t frames, bool live, const capture::CameraOptions& options)
      : frames_(frames),
        number_(options.frame.value_or(0)),
        begin_(live ? capture::monotonic_now() : capture::Time{}) {
    if (++open_now > 1) {
      --open_now;
      throw std::runtime_error("cannot open sole: it is busy");
    }
    ++opened;
    info_.width = 64;
    info_.height = 32;
    info_.rate = {25, 1};
    info_.frames = frames;
    info_.live = live;
  }
  ~SoleCamera() override { --open_now; }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    if (frames_ > 0 && number_ == frames_) return std::nullopt;
    capture::Frame frame;
    frame.number = number_;
    frame.time = begin_ + capture::time_of_frame(number_, info_.rate);
    auto image = std::make_shared<capture::Image>(capture::make_image(32, 64));
    std::ranges::fill(image->pixels, 0.1F + static_cast<float>(number_++ % 50) / 100);
    frame.image = std::move(image);
    if (info_.live) std::this_thread::sleep_for(frame.time - capture::monotonic_now());
    return frame;
  }

 private:
  capture::CameraInfo info_;
  std::int64_t frames_, number_;
  capture::Time begin_;
};

// Opens "sole:FRAMES" and "live_sole:FRAMES".
void register_sole_camera() {
  for (const bool live : {false, true}) {
    capture::register_camera(live ? "live_sole" : "sole", [live](std::string_view rest,
                                                                 const capture::CameraOptions& o) {
      return std::make_unique<SoleCamera>(std::stol(std::string(rest)), live, o);
    });
  }
}

class SetChangeTest : public MadeShowTest {
 protected:
  static void SetUpTestSuite() {
    MadeShowTest::SetUpTestSuite();
    register_sole_camera();
  }
  void SetUp() override {
    MadeShowTest::SetUp();
    opened = 0;
  }

  // A person whom a camera shows, before grey; what stands first moves it down in the file.
  Set person_set(const std::string& source,
                 const std::string& more = "height = 2\nposition = [0, 0, 0]\n",
                 const std::string& first = "") {
    return made_set("grey:1,25,0", first + "[[billboard]]\nsource = \"" + source +
                                       "\"\ncolour = \"linear\"\n" + more);
  }
  // A set with a probe that is a camera.
  Set probe_set(const std::string& source, const std::string& probe, const std::string& more = "") {
    const std::string path = write_made_set(dir_, "grey:1,25,0", more);
    std::string text = text_of(path);
    const std::string sky = "source = \"sky.exr\"\nmatch = [1, 1, 1]\n";
    text.replace(text.find(sky), sky.size(), fmt::format("source = \"{}\"\n{}", source, probe));
    std::ofstream(path) << text;
    return read_set(path);
  }
  static std::string text_of(const std::string& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

// The number of the frame that the set's only person shows.
int shown_number(const PreparedFrame& frame) {
  const float grey = frame.scene->pictures().at(0)->look_up(0.5F, 0.5F, 0)[0];
  return static_cast<int>(std::lround((grey - 0.1F) * 100));
}

// Shows a frame of the first set, then one of each edit; the numbers that its person shows.
std::vector<int> numbers_over(FrameMaker& maker, const std::vector<Set>& edits) {
  std::vector<int> numbers{shown_number(maker.make(0).value())};
  for (const Set& edit : edits) {
    maker.change_set(edit);
    numbers.push_back(shown_number(maker.make(static_cast<std::int64_t>(numbers.size())).value()));
  }
  return numbers;
}

TEST_F(SetChangeTest, PersonsRunOnWhateverElseIsEdited) {
  FrameMaker maker(person_set("sole:0"));
  const std::vector<Set> edits{
      person_set("sole:0", "height = 2\nposition = [0, 0, 0]\nname = \"she\"\n", "# a line more\n"),
      person_set("sole:0", "height = 1.8\nposition = [1, 2, 0]\nyaw = 20\n"),
      person_set("sole:0", "height = 2\nposition = [0, 0, 0]\n",
                 "[[stand_in]]\nname = \"more\"\nsize = [2, 2]\n"),
  };
  EXPECT_THAT(numbers_over(maker, edits), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(opened, 1);
}

TEST_F(SetChangeTest, AnotherFirstFrameOpensAPersonsFileAnew) {
  FrameMaker maker(person_set("grey:100,25,0"));
  const Set later = person_set("grey:100,25,0", "height = 2\nposition = [0, 0, 0]\nloop = true\n");
  EXPECT_THAT(numbers_over(maker, {later, later}), ElementsAre(0, 0, 1));
}

TEST_F(SetChangeTest, AnEndedVideoKeepsItsLastPicture) {
  capture::Image plate = capture::make_image(32, 64);
  for (std::size_t i = 0; i < plate.pixels.size(); i += 3) plate.pixels[i + 1] = 0.5F;
  capture::write_exr((dir_ / "plate.exr").string(), plate);
  std::vector<Set> edits;
  for (const char* key : {"", "key = { plate = \"plate.exr\" }\n"}) {
    edits.push_back(person_set("sole:3", std::string("height = 2\nposition = [0, 0, 0]\n") + key));
  }
  FrameMaker maker(edits.front());
  for (std::int64_t n = 0; n < 10; ++n) ASSERT_TRUE(maker.make(n));
  maker.change_set(edits.front());
  EXPECT_EQ(shown_number(maker.make(10).value()), 2);
  maker.change_set(edits.back());  // keyed now: nothing of it is green
  EXPECT_EQ(shown_number(maker.make(11).value()), 2);
  EXPECT_EQ(opened, 1);
}

// As an operator does who sees that the camera was bumped.
TEST_F(SetChangeTest, APlateThatWasTakenAnewIsReadAnew) {
  const std::string plate = (dir_ / "plate.exr").string();
  const auto write = [&](int width) {
    capture::Image green = capture::make_image(32, width);
    for (std::size_t i = 0; i < green.pixels.size(); i += 3) green.pixels[i + 1] = 0.5F;
    capture::write_exr(plate, green);
  };
  write(64);
  const std::string keyed = "height = 2\nposition = [0, 0, 0]\nkey = { plate = \"plate.exr\" }\n";
  FrameMaker maker(person_set("sole:0", keyed));
  ASSERT_TRUE(maker.make(0));
  const auto written = std::filesystem::last_write_time(plate);
  write(62);
  std::filesystem::last_write_time(plate, written + std::chrono::seconds(1));
  EXPECT_THROW(maker.change_set(person_set("sole:0", keyed)), SetError);
  EXPECT_EQ(shown_number(maker.make(1).value()), 1) << "the show goes on as it was";
  write(64);
  maker.change_set(person_set("sole:0", keyed));
  EXPECT_EQ(shown_number(maker.make(2).value()), 2);
  EXPECT_EQ(opened, 1);
}

// Its feet are followed on while the dials of its key are turned.
TEST_F(SetChangeTest, AWalkerStandsWhereItWouldHaveStood) {
  const auto walker = [&](const std::string& key) {
    return person_set("made_walker:width=160&height=200",
                      "lens = { model = \"pinhole\", focal_px = 300, size = [160, 200] }\n"
                      "pose = { position = [0, -4, 1.4], look_at = [0, 0, 0.9] }\n"
                      "feet = \"auto\"\nframe = 16\nkey = { footage = [0, 7]" +
                          key + " }\n");
  };
  FrameMaker alone(walker("")), edited(walker(""));
  std::vector<std::string> notes;
  for (std::int64_t n = 0; n < 8; ++n) {
    if (n == 3) edited.change_set(walker(", despill = 0.5"));
    if (n == 5) edited.change_set(walker(", despill = 0.5"));
    const PreparedFrame one = alone.make(n).value(), other = edited.make(n).value();
    notes.insert(notes.end(), other.notes.begin(), other.notes.end());
    const PersonStatus &a = one.persons.at(0), &b = other.persons.at(0);
    EXPECT_EQ(a.feet, b.feet) << n;
    EXPECT_LT(calibrate::length(a.position - b.position), 0.003) << n;  // alpha is smoothed anew
  }
  EXPECT_THAT(notes, IsEmpty());
}

// Two persons of one video have one each, before and after.
TEST_F(SetChangeTest, EveryPersonGoesOnWithAVideoOfItsOwn) {
  const std::string two =
      "height = 2\nposition = [0, 0, 0]\n[[billboard]]\nsource = \"grey:9,25,0\"\n"
      "colour = \"linear\"\nheight = 1\nposition = [1, 0, 0]\n";
  FrameMaker maker(person_set("grey:9,25,0", two));
  for (std::int64_t n = 0; n < 4; ++n) {
    if (n == 1) maker.change_set(person_set("grey:9,25,0", two + "name = \"second\"\n"));
    if (n == 2) maker.change_set(person_set("grey:9,25,0"));
    if (n == 3) maker.change_set(person_set("grey:9,25,0", two));
    EXPECT_EQ(shown_number(maker.make(n).value()), n);
  }
}

TEST_F(SetChangeTest, TheProbesCameraRunsOn) {
  const std::string given = "match = [1, 1, 1]\nlens = \"latlong\"\n";
  FrameMaker maker(probe_set("sole:0", given));
  const auto frames_at = [&](std::int64_t n) { return maker.make(n).value().probe.frames; };
  frames_at(0);
  const std::int64_t first = frames_at(20);
  maker.change_set(
      probe_set("sole:0", given, "# an edit\n[[stand_in]]\nname = \"more\"\nsize = [2, 2]\n"));
  EXPECT_GT(frames_at(21), first);
  // The light itself is another one now.
  maker.change_set(probe_set("sole:0", "match = [2, 2, 2]\nyaw = 30\nlens = \"latlong\"\n"));
  const PreparedFrame after = maker.make(22).value();
  EXPECT_GT(after.probe.frames, first + 1);
  EXPECT_EQ(after.match.gain[0], 2);
  EXPECT_EQ(opened, 1);
  // Of another one it is said why it cannot be had.
  try {
    maker.change_set(probe_set("sole:0", given + "colour = \"sRGB\"\n"));
    ADD_FAILURE() << "two of it are open";
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("busy"));
  }
  EXPECT_GT(maker.make(23).value().probe.frames, after.probe.frames);
}

// Who would never be seen.
TEST_F(SetChangeTest, APersonByItsFeetNeedsAMatte) {
  try {
    FrameMaker maker(person_set("sole:0",
                                "lens = { model = \"pinhole\", focal_px = 60, size = [64, 32] }\n"
                                "pose = { position = [0, -4, 1.4], look_at = [0, 0, 0.9] }\n"
                                "feet = \"auto\"\n"));
    ADD_FAILURE();
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("needs a key"));
  }
}

// Of shows, beside whose frames the edit is made.
TEST_F(SetChangeTest, LiveCamerasAreOpenedOnceInAShowThatIsEditedAgainAndAgain) {
  const auto set = [&](int edit, const std::string& probe = "") {
    return probe_set("live_sole:0", "match = [1, 1, 1]\nlens = \"latlong\"\n" + probe,
                     fmt::format("[[billboard]]\nsource = \"grey:100,25,0\"\ncolour = \"linear\"\n"
                                 "position = [0, 0, 0]\nheight = {}\n",
                                 2 + edit));
  };
  std::vector<Set> edits;
  for (int n = 4; n < 30; n += 5) edits.push_back(set(n));
  edits.push_back(set(0, "colour = \"sRGB\"\n"));
  ShowOptions options;
  options.live = true;
  options.frames = 40;
  Show show(set(0), options);
  std::vector<int> numbers;
  show.run([&](const ShownFrame& shown) {
    const auto n = static_cast<int>(numbers.size());
    numbers.push_back(shown_number(shown.prepared));
    if (n % 5 == 4 && n < 35) show.post(ChangeSet{edits[static_cast<std::size_t>(n / 5)]});
  });
  EXPECT_TRUE(std::ranges::is_sorted(numbers)) << testing::PrintToString(numbers);
  EXPECT_THAT(numbers.back(), Gt(30));
  EXPECT_EQ(opened, 1);
  EXPECT_THAT(show.status()->notes, ElementsAre(HasSubstr("It is on air")));
}

}  // namespace
}  // namespace studio::set_change_test
