// Shows whose match is given: a matrix between the cameras' colours, a plate that changes its
// exposure.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string>

#include "capture/exr.h"
#include "capture/half.h"
#include "render/colour_matrix.h"
#include "studio/frame_maker.h"
#include "studio/set.h"
#include "studio/start.h"
#include "tests/calibrate/made_lamps.h"
#include "tests/studio/command_line.h"

namespace studio::light_match_test {
namespace {

using calibrate::Vec3;
using testing::HasSubstr;

constexpr int frames = 10;
constexpr int first_of_step = 4;
constexpr double step = 1.4;

// The plate's light: coloured by where it comes from.
std::array<float, 3> light_from(const Vec3& v) {
  const double x = 0.3 + 0.1 * std::sin(6 * v.x) * std::cos(5 * v.z);
  return {static_cast<float>(x), static_cast<float>(0.3 + 0.12 * std::sin(7 * v.x + 4 * v.z)),
          static_cast<float>(0.6 - x)};
}

// From the probe's colours to the plate's, and back.
constexpr render::ColourMatrix to_plate{1.3F, -0.4F, 0.1F, -0.1F, 1.2F, -0.2F, 0, 0.3F, 0.8F};
constexpr render::ColourMatrix to_probe{0.790085F, 0.271108F,  -0.030984F, 0.061967F, 0.805577F,
                                        0.193648F, -0.023238F, -0.302091F, 1.177382F};

// What a lens that looks ahead sees.
capture::Image made_plate(double exposure) {
  const calibrate::Lens lens = made::scene_lens();
  const calibrate::Mat3 set_from_cam = calibrate::look_at({0, 0, 1}, {0, 1, 1}, 0).R.transposed();
  capture::Image plate = capture::make_image(lens.height, lens.width);
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const auto v = unproject(lens, {static_cast<double>(x), static_cast<double>(y)});
      const auto light = light_from(normalize(set_from_cam * *v));
      for (int c = 0; c < 3; ++c) {
        plate.at(y, x, c) = light[static_cast<std::size_t>(c)] * static_cast<float>(exposure);
      }
    }
  }
  return plate;
}

// A recording of it whose exposure goes up by a step, and is told or not.
void write_plate(const fs::path& folder, bool told) {
  fs::create_directories(folder);
  capture::write_exr((folder / "before.exr").string(), made_plate(1));
  capture::write_exr((folder / "after.exr").string(), made_plate(step));
  std::ofstream list(folder / "frames.csv");
  list << "file,time_s,exposure_s,status\n";
  for (int n = 0; n < frames; ++n) {
    list << (n < first_of_step ? "before.exr," : "after.exr,") << 0.04 * n << ','
         << (told ? 0.005 * (n < first_of_step ? 1 : step) : 0) << ",good\n";
  }
}

class LightMatch : public CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    start();
    write_plate(dir_ / "told", true);
    write_plate(dir_ / "untold", false);
    capture::Image plate_sees = capture::make_image(128, 256);
    capture::Image probe_sees = plate_sees;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 256; ++x) {
        const Vec3 v = calibrate::to_double(
            render::direction_of_texel(static_cast<float>(x), static_cast<float>(y), 256, 128));
        std::array<float, 3> light = light_from(v);
        // A red lamp behind the camera.
        if (dot(v, normalize(Vec3{-0.3, -1, 0.8})) > 0.995) light = {60, 20, 15};
        const auto seen = render::recolour(to_probe, light).radiance;
        for (int c = 0; c < 3; ++c) {
          plate_sees.at(y, x, c) = light[static_cast<std::size_t>(c)];
          probe_sees.at(y, x, c) = seen[static_cast<std::size_t>(c)];
        }
      }
    }
    capture::write_exr((dir_ / "plate_sees.exr").string(), plate_sees);
    capture::write_exr((dir_ / "probe_sees.exr").string(), probe_sees);
    std::ofstream(dir_ / "cube.obj") << "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\n"
                                        "v -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n"
                                        "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\n"
                                        "f 3 7 8 4\nf 4 8 5 1\n";
  }
  Set set_of(const std::string& plate, const std::string& map, const std::string& match) const {
    const std::string path = (dir_ / "set.toml").string();
    std::ofstream(path) << "[show]\nwidth = 320\nheight = 240\n[camera]\nsource = \"" << plate
                        << "\"\nmodel = \"pinhole\"\nfocal_px = 215\n"
                        << "pose = { position = [0, 0, 1], look_at = [0, 1, 1] }\n"
                        << "[probe]\nsource = \"" << map << "\"\nmatch = " << match
                        << "\n[[object]]\nmesh = \"cube.obj\"\n"
                        << "pose = { position = [0, 5, 0], yaw = 30 }\n"
                        << "[effort]\nlight_samples = 64\naa_samples = 4\n";
    return read_set(path);
  }

  // The mean of what is wholly virtual in the first frame.
  std::array<double, 3> colour_of_cube(const std::string& map, const std::string& match) const {
    const PreparedFrame frame = FrameMaker(set_of("replay:untold", map, match)).make(0).value();
    render::FrameResult result;
    render_frame(frame.inputs(), frame.job, *frame.plate, result);
    EXPECT_EQ(render::parse_frame_job(render::serialize(frame.job)), frame.job);
    const capture::Image rgba = capture::to_float(result.rgba);
    std::array<double, 3> sum{};
    int pixels = 0;
    for (int y = 0; y < rgba.height; ++y) {
      for (int x = 0; x < rgba.width; ++x) {
        if (rgba.at(y, x, 3) < 1) continue;
        ++pixels;
        for (int c = 0; c < 3; ++c) sum[static_cast<std::size_t>(c)] += rgba.at(y, x, c);
      }
    }
    EXPECT_GT(pixels, 1000);
    for (double& value : sum) value /= pixels;
    return sum;
  }
};

const std::string matrix_text = "[1.3, -0.4, 0.1, -0.1, 1.2, -0.2, 0, 0.3, 0.8]";

// A gain by a patch is too large by as much of its light as the probe does not see.
TEST_F(LightMatch, IsDoubtfulByAPatchWhoseLightTheProbeDoesNotSee) {
  capture::Image even = capture::make_image(128, 128);
  std::ranges::fill(even.pixels, 0.5F);
  capture::write_exr((dir_ / "fish_eye.exr").string(), even);
  const auto notes = [&](const std::string& axis) {
    const std::string path = (dir_ / "set.toml").string();
    std::ofstream(path)
        << "[show]\nwidth = 320\nheight = 240\n[camera]\nsource = \"replay:untold\"\n"
        << "model = \"pinhole\"\nfocal_px = 215\n"
        << "pose = { position = [0, 0, 1], look_at = [0, 1, 1] }\n"
        << "[probe]\nsource = \"fish_eye.exr\"\nlens = { model = \"equisolid\", size = "
           "[128, 128], focal_px = 42, max_angle = 88 }\npose = { axis = "
        << axis << ", roll = 0 }\nmatch = { patch = [10, 10, 20, 20], albedo = 0.4 }\n";
    return FrameMaker(read_set(path)).make(0).value().notes;
  };
  EXPECT_THAT(notes("[0, 0, 1]"), testing::IsEmpty());
  EXPECT_THAT(notes("[0, 0.3, -1]"),
              testing::ElementsAre(HasSubstr("doubtful: the probe sees only ")));
  EXPECT_THAT(notes("[0, 0, -1]"),
              testing::ElementsAre(HasSubstr("puts no light on the patch: gain left at 1")));
}

TEST_F(LightMatch, RendersTheRightColourByAMatrix) {
  const auto truth = colour_of_cube("plate_sees.exr", "[1, 1, 1]");
  const auto by_matrix = colour_of_cube("probe_sees.exr", matrix_text);
  const auto by_gain = colour_of_cube("probe_sees.exr", "[1, 0.9, 1.1]");
  double worst = 0;
  double worst_by_gain = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(by_matrix[c] / truth[c], 1, 0.02) << "channel " << c;
    worst = std::max(worst, std::abs(by_matrix[c] / truth[c] - 1));
    worst_by_gain = std::max(worst_by_gain, std::abs(by_gain[c] / truth[c] - 1));
  }
  EXPECT_GT(worst_by_gain, 0.05) << "gains would do: the test tells nothing";
  RecordProperty("error", std::to_string(worst));
  RecordProperty("error_by_gain", std::to_string(worst_by_gain));
}

TEST_F(LightMatch, FollowsThePlatesExposureWithAGivenMatch) {
  const std::string match = "{ matrix = " + matrix_text + ", follow = true }";
  FrameMaker maker(set_of("replay:untold", "probe_sees.exr", match));
  double light_before = 0;
  double worst = 0;
  for (int n = 0; n < frames; ++n) {
    const PreparedFrame frame = maker.make(n).value();
    const double truth = n < first_of_step ? 1 : step;
    EXPECT_NEAR(frame.match.exposure / truth, 1, 0.02) << n;
    worst = std::max(worst, std::abs(frame.match.exposure / truth - 1));
    EXPECT_NEAR(frame.job.match[0], 1.3 * truth, 0.02 * 1.3 * truth) << n;
    double light = 0;
    for (const render::DirectionalLight& one : frame.job.lights.lights) light += one.irradiance.y;
    if (n == 0) light_before = light;
    EXPECT_NEAR(light / light_before, truth, 0.02 * truth) << n;
    EXPECT_THAT(frame.match.note, HasSubstr("directions that both cameras see"));
  }
  RecordProperty("error", std::to_string(worst));
}

// What the command prints is pasted as it stands.
TEST_F(LightMatch, IsFoundAndFollowedAsCalibrated) {
  const std::string set = set_of("replay:told", "probe_sees.exr", "[1, 1, 1]").path;
  const Outcome outcome = run("calibrate light " + set);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, HasSubstr("follow = true, exposure_s = 0.005 }"));
  const std::string line = outcome.out.substr(outcome.out.find("match = ") + 8);
  FrameMaker maker(set_of("replay:told", "probe_sees.exr", line));
  for (int n = 0; n < frames; ++n) {
    const PreparedFrame frame = maker.make(n).value();
    ASSERT_TRUE(frame.match.matrix);
    const double truth = n < first_of_step ? 1 : step;
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_NEAR(frame.job.match[i], truth * to_plate[i], 0.02) << i;
    }
  }
}

TEST_F(LightMatch, StaysWhereItIsNotToldToFollow) {
  FrameMaker maker(set_of("replay:told", "probe_sees.exr", matrix_text));
  for (int n = 0; n < frames; ++n) EXPECT_EQ(maker.make(n).value().match.exposure, 1);
}

TEST_F(LightMatch, TakesAnExposureThatThePlateTells) {
  const std::string match = "{ gain = [1, 1, 1], follow = true, exposure_s = 0.005 }";
  FrameMaker maker(set_of("replay:told", "probe_sees.exr", match));
  for (int n = 0; n < frames; ++n) {
    const double truth = n < first_of_step ? 1 : step;
    EXPECT_DOUBLE_EQ(maker.make(n).value().match.exposure, truth) << n;
  }
}

TEST_F(LightMatch, SaysThatNothingIsSeenByBoth) {
  // A plate that is clipped tells nothing.
  const std::string match = "{ gain = [1, 1, 1], follow = true }";
  Set set = set_of("replay:untold", "probe_sees.exr", match);
  capture::Image white = capture::make_image(240, 320);
  for (float& value : white.pixels) value = 1;
  capture::write_exr((dir_ / "white.exr").string(), white);
  set.camera.source = "file:" + (dir_ / "white.exr").string();
  const PreparedFrame frame = FrameMaker(set).make(0).value();
  EXPECT_EQ(frame.match.exposure, 1);
  EXPECT_THAT(frame.match.note, HasSubstr("held at 1.000"));
}

}  // namespace
}  // namespace studio::light_match_test
