// Persons whose videos have alpha of their own, and videos whose pixels are not square.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "calibrate/lens.h"
#include "capture/png.h"
#include "studio/show.h"
#include "tests/studio/made_show.h"

namespace studio::person_alpha_test {
namespace {

using testing::HasSubstr;

// Before all of the show's picture.
constexpr const char* wall =
    "[[billboard]]\nposition = [0, -6, -10]\nheight = 30\nsource = \"file:wall.png\"\n";

// A person of cloth, who stands at (0.3, -1.5, 0): legs and body, cut out if alpha is asked for.
class CutOut final : public capture::Camera {
 public:
  explicit CutOut(bool alpha) : alpha_(alpha) {
    info_.width = 240;
    info_.height = 180;
    info_.rate = {25, 1};
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::Frame> next() override {
    const calibrate::Lens lens{"pinhole", 240, 180, {250, 250, 119.5, 89.5}};
    const calibrate::Vec3 from{0, -6, 1.5};
    const calibrate::Pose set_from_cam = inverse(calibrate::look_at(from, {0, 0, 1}, 0));
    auto image = std::make_shared<capture::Image>(capture::make_image(180, 240, alpha_ ? 4 : 3));
    for (int y = 0; y < 180; ++y) {
      for (int x = 0; x < 240; ++x) {
        const calibrate::Vec3 d =
            set_from_cam.R * *calibrate::unproject(lens, {double(x), double(y)});
        const double k = (-1.5 - from.y) / d.y;
        const double aside = std::abs(from.x + k * d.x - 0.3), up = from.z + k * d.z;
        const bool met = up > 0 && (up < 0.8    ? aside > 0.03 && aside < 0.18
                                    : up < 1.42 ? aside < 0.23
                                                : up < 1.7 && aside < 0.1);
        if (!met) continue;
        image->at(y, x, 0) = 0.6F;
        if (alpha_) image->at(y, x, 3) = 1;
      }
    }
    capture::Frame frame;
    frame.number = number_;
    frame.time = capture::time_of_frame(number_++, info_.rate);
    frame.image = std::move(image);
    return frame;
  }

 private:
  capture::CameraInfo info_;
  bool alpha_;
  std::int64_t number_ = 0;
};

// White frames whose pixels are as wide as the number says.
class WideCamera final : public GreyCamera {
 public:
  explicit WideCamera(capture::Rational aspect) : GreyCamera(100, {25, 1}, 0) {
    info_.pixel_aspect = aspect;
  }
};

class PersonAlpha : public MadeShowTest {
 protected:
  static void SetUpTestSuite() {
    MadeShowTest::SetUpTestSuite();
    capture::register_camera("cut_out",
                             [](std::string_view, const capture::CameraOptions& options) {
                               return std::make_unique<CutOut>(options.alpha);
                             });
    capture::register_camera("wide", [](std::string_view rest, const capture::CameraOptions&) {
      return std::make_unique<WideCamera>(capture::Rational{std::stol(std::string(rest)), 1});
    });
  }
  // The show's first picture of one frame.
  capture::Image picture_with(const std::string& section) const {
    Show show(made_set("grey:1,25,0", section));
    capture::Image picture;
    show.run([&](const ShownFrame& shown) { picture = capture::to_float(shown.result->rgba); });
    EXPECT_FALSE(picture.empty());
    return picture;
  }
  void write_wall(int channels, std::array<std::uint8_t, 4> rgba) const {
    std::vector<std::uint8_t> texels;
    for (int i = 0; i < 15; ++i) texels.insert(texels.end(), rgba.begin(), rgba.begin() + channels);
    capture::write_png(dir_ / "wall.png", 5, 3, channels, texels);
  }
};

TEST_F(PersonAlpha, ShowsWhatIsBehindThroughIt) {
  const capture::Image without = picture_with("");
  write_wall(3, {255, 188, 0, 0});
  const capture::Image opaque = picture_with(wall);
  write_wall(4, {255, 188, 0, 255});
  EXPECT_EQ(picture_with(wall).pixels, opaque.pixels) << "opaque everywhere";
  write_wall(4, {255, 188, 0, 128});
  const capture::Image half = picture_with(wall);
  // Beyond the ground, where the wall's shadow does not fall.
  constexpr float share = 128.0F / 255;
  for (int y = 1; y < 4; ++y) {
    for (int x = 4; x < 60; ++x) {
      EXPECT_GT(opaque.at(y, x, 0), without.at(y, x, 0) + 0.5F);
      for (int c = 0; c < 4; ++c) {
        const float wanted = share * opaque.at(y, x, c) + (1 - share) * without.at(y, x, c);
        ASSERT_NEAR(half.at(y, x, c), wanted, 2e-3) << x << " " << y << " " << c;
      }
    }
  }
  write_wall(4, {255, 188, 0, 0});
  const capture::Image clear = picture_with(wall);
  for (std::size_t i = 0; i < clear.index(4, 0); ++i) {
    ASSERT_NEAR(clear.pixels[i], without.pixels[i], 2e-3) << i;
  }
}

// As much of it as there is, however faint.
TEST_F(PersonAlpha, KeepsWhatIsFaint) {
  const capture::Image without = picture_with("");
  std::vector<std::uint8_t> texels(std::size_t{4} * 64 * 64, 255);
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    texels[4 * i + 3] = i % 64 < 8 ? 255 : 20;  // whole at its left edge only
  }
  capture::write_png(dir_ / "wall.png", 64, 64, 4, texels);
  const capture::Image faint = picture_with(wall);
  for (int x = 4; x < 60; ++x) EXPECT_GT(faint.at(2, x, 0), without.at(2, x, 0) + 0.02F) << x;
}

TEST_F(PersonAlpha, TellsTheFeetWithoutAKey) {
  const std::string section =
      "[[billboard]]\nsource = \"cut_out:\"\nfeet = \"auto\"\n"
      "lens = { model = \"pinhole\", focal_px = 250, size = [240, 180] }\n"
      "pose = { position = [0, -6, 1.5], look_at = [0, 0, 1] }\n";
  Show show(made_set("grey:3,25,0", section));
  show.run([&](const ShownFrame& shown) {
    const PersonStatus& person = shown.prepared.persons.at(0);
    EXPECT_EQ(person.feet, "seen");
    EXPECT_NEAR(person.position.x, 0.3, 0.18);
    EXPECT_NEAR(person.position.y, -1.5, 0.06);
    const auto q = calibrate::project(
        *shown.prepared.lens, shown.prepared.job.cam_from_set * calibrate::Vec3{0.3, -1.5, 1.0});
    ASSERT_TRUE(q);
    const auto at = shown.result->rgba.index(static_cast<int>(std::lround(q->y)),
                                             static_cast<int>(std::lround(q->x)));
    EXPECT_NEAR(capture::float_from_half(shown.result->rgba.pixels[at]), 0.6, 0.03);
  });
  std::string without = section;
  without.replace(without.find("cut_out:"), 8, "grey:9,25,0");
  without.replace(without.find("[240, 180]"), 10, "[64, 48]");
  try {
    Show refused(made_set("grey:3,25,0", without));
    ADD_FAILURE() << "it has no alpha";
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("the video has no alpha"));
  }
}

TEST_F(PersonAlpha, IsAsWideAsItsVideosPixelsSay) {
  const capture::Image without = picture_with("");
  const auto columns_of = [&](const std::string& aspect) {
    const capture::Image picture = picture_with(
        "[[billboard]]\nposition = [0, -4, 2.2]\nheight = 0.6\ngain = 20\nturn = 0\n"
        "source = \"wide:" +
        aspect + "\"\n");
    int most = 0;
    for (int y = 0; y < 48; ++y) {
      int columns = 0;
      for (int x = 0; x < 64; ++x) columns += picture.at(y, x, 0) > without.at(y, x, 0) + 1;
      most = std::max(most, columns);
    }
    return most;
  };
  const int square = columns_of("1"), wide = columns_of("2");
  EXPECT_GE(square, 8);
  EXPECT_NEAR(wide, 2 * square, 2);
}

}  // namespace
}  // namespace studio::person_alpha_test
