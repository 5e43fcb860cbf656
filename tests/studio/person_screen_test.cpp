// What a show tells of a person's screen and camera: pushed, or too bright.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "studio/show.h"
#include "tests/studio/made_show.h"

namespace studio::person_screen_test {
namespace {

using testing::HasSubstr;

constexpr std::array screen{0.05F, 0.45F, 0.08F};

// Nobody before a green cloth between grey panels; a picture that is pushed from frame 8 on.
class PushedCamera final : public capture::Camera {
 public:
  static constexpr int width = 240, height = 160;
  PushedCamera() {
    info_.width = width;
    info_.height = height;
    info_.rate = {25, 1};
    info_.frames = 40;
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }

  static capture::Image picture(int right) {
    capture::Image image = capture::make_image(height, width);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int u = x - right;
        const bool cloth = u > 60 && u < 180;
        const float panel = 0.1F + 0.07F * static_cast<float>((u / 14 * 3 + y / 11 * 5) % 7);
        for (int c = 0; c < 3; ++c)
          image.at(y, x, c) = cloth ? screen[static_cast<std::size_t>(c)] : panel;
      }
    }
    return image;
  }
  std::optional<capture::Frame> next() override {
    if (number_ == info_.frames) return std::nullopt;
    capture::Frame frame;
    frame.number = number_;
    frame.time = capture::time_of_frame(number_, info_.rate);
    frame.image = std::make_shared<capture::Image>(picture(number_ < 8 ? 0 : 3));
    ++number_;
    return frame;
  }

 private:
  capture::CameraInfo info_;
  std::int64_t number_ = 0;
};

// Nobody before a screen that is at the camera's limit in every other four frames.
class BrightScreen final : public capture::Camera {
 public:
  BrightScreen() {
    info_.width = info_.height = 64;
    info_.rate = {25, 1};
    info_.frames = 40;
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }

  static capture::Image picture(float light) {
    capture::Image image = capture::make_image(64, 64);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
      image.pixels[i] = light * screen[i % 3] / screen[1];
    return image;
  }
  std::optional<capture::Frame> next() override {
    if (number_ == info_.frames) return std::nullopt;
    capture::Frame frame;
    frame.number = number_;
    frame.time = capture::time_of_frame(number_, info_.rate);
    frame.image = std::make_shared<capture::Image>(picture(number_ / 4 % 2 == 0 ? 0.8F : 1.0F));
    ++number_;
    return frame;
  }

 private:
  capture::CameraInfo info_;
  std::int64_t number_ = 0;
};

class PersonScreenTest : public MadeShowTest {
 protected:
  static void SetUpTestSuite() {
    MadeShowTest::SetUpTestSuite();
    capture::register_camera("pushed", [](std::string_view, const capture::CameraOptions&) {
      return std::make_unique<PushedCamera>();
    });
    capture::register_camera("bright", [](std::string_view, const capture::CameraOptions&) {
      return std::make_unique<BrightScreen>();
    });
  }
};

TEST_F(PersonScreenTest, SaysOnceThatACameraWasPushedAndHowFar) {
  capture::write_exr((dir_ / "room.exr").string(), PushedCamera::picture(0));
  Show show(made_set("grey:24,25,0",
                     "[[billboard]]\nname = \"guest\"\nsource = \"pushed:\"\nheight = 2\n"
                     "position = [0, 0, 0]\nkey = { plate = \"room.exr\" }\n"));
  std::vector<std::int64_t> told;
  std::string note;
  show.run([&](const ShownFrame& shown) {
    for (const std::string& line : shown.prepared.notes) {
      if (line.find("was moved") == std::string::npos) continue;
      told.push_back(static_cast<std::int64_t>(shown.prepared.job.frame));
      note = line;
    }
  });
  ASSERT_EQ(told.size(), 1U);
  EXPECT_GE(told[0], 8);
  EXPECT_LE(told[0], 17);
  EXPECT_THAT(note, HasSubstr("guest"));
  EXPECT_THAT(note,
              testing::ContainsRegex("the picture is (2.9|3.0|3.1) px further right and 0.0 px"));
}

// How a screen is exposed is no news each time that more of it is in sight.
TEST_F(PersonScreenTest, SaysOnceThatAScreenIsAtTheCamerasLimit) {
  capture::write_exr((dir_ / "bright.exr").string(), BrightScreen::picture(1));
  Show show(made_set("grey:40,25,0",
                     "[[billboard]]\nname = \"guest\"\nsource = \"bright:\"\nheight = 2\n"
                     "position = [0, 0, 0]\nkey = { plate = \"bright.exr\" }\n"));
  std::vector<std::string> told;
  int clipped = 0;
  show.run([&](const ShownFrame& shown) {
    clipped += shown.prepared.persons[0].key == "clipped";
    for (const std::string& line : shown.prepared.notes) {
      if (line.find("unsure") != std::string::npos) told.push_back(line);
    }
  });
  EXPECT_GT(clipped, 12);
  EXPECT_LT(clipped, 28);
  EXPECT_THAT(told, testing::ElementsAre("guest: the key is unsure (clipped)"));
}

}  // namespace
}  // namespace studio::person_screen_test
