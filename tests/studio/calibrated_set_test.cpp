// The whole way of an operator: footage, calibrations, a set of what they found, the car in its
// place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calibrate/pose_file.h"
#include "calibrate/registration.h"
#include "capture/half.h"
#include "render/made_car.h"
#include "render/transform.h"
#include "studio/demo.h"
#include "studio/demo_calibration.h"
#include "studio/frame_maker.h"
#include "studio/set.h"
#include "studio/start.h"
#include "tests/calibrate/made_markers.h"
#include "tests/studio/command_line.h"

namespace studio::calibrated_set_test {
namespace {

using calibrate::Vec2;
using calibrate::Vec3;
using Json = nlohmann::json;

// Another text in the place of what stands behind `key` in a section of a set file.
std::string with_line(std::string text,
                      const std::string& section,
                      const std::string& key,
                      const std::string& line) {
  const std::size_t from = text.find("\n" + key + " = ", text.find("[" + section + "]"));
  EXPECT_NE(from, text.npos) << section << "." << key;
  return text.replace(from + 1, text.find('\n', from + 1) - from - 1, line);
}

// The line of a pose file that goes into a set.
std::string pose_line(const fs::path& file) {
  const std::string text = content_of(file);
  const std::size_t from = text.find("pose = ");
  return text.substr(from, text.find('\n', from) - from);
}

// How far the car's vertices lie from where they should be seen, of those in the picture.
struct Shift {
  std::size_t count = 0;
  double rms_px = 0;
  double max_px = 0;
};

Shift shift_of_car(const CameraSettings& truth, const CameraSettings& found, double yaw_deg) {
  const render::SceneDescription car = render::made_car();
  const double c = std::cos(yaw_deg * made::degree);
  const double s = std::sin(yaw_deg * made::degree);
  std::vector<Vec3> in_truth;
  std::vector<Vec3> in_found;
  for (const render::Instance& instance : car.instances) {
    for (const calibrate::Vec3f& vertex : car.meshes[instance.mesh]->positions) {
      const Vec3 p = to_double(render::transform_point(instance.set_from_object, vertex));
      const Vec3 p_set{c * p.x - s * p.y, s * p.x + c * p.y, p.z};
      in_truth.push_back(truth.pose.cam_from_set * p_set);
      in_found.push_back(found.pose.cam_from_set * p_set);
    }
  }
  const auto q_truth = project_all(truth.lens, in_truth);
  const auto q_found = project_all(found.lens, in_found);
  Shift shift;
  double squares = 0;
  for (std::size_t i = 0; i < q_truth.size(); ++i) {
    const auto& q = q_truth[i];
    if (!q || q->x < 0 || q->y < 0 || q->x >= truth.lens.width || q->y >= truth.lens.height) {
      continue;
    }
    const double apart =
        q_found[i] ? std::hypot(q_found[i]->x - q->x, q_found[i]->y - q->y) : HUGE_VAL;
    ++shift.count;
    squares += apart * apart;
    shift.max_px = std::max(shift.max_px, apart);
  }
  shift.rms_px = std::sqrt(squares / static_cast<double>(shift.count));
  return shift;
}

// What of each pixel is virtual, (height, width, 1).
capture::Image coverage_of(const Set& set) {
  const PreparedFrame frame = FrameMaker(set).make(0).value();
  render::FrameResult result;
  render_frame(frame.inputs(), frame.job, *frame.plate, result);
  const capture::Image rgba = capture::to_float(result.rgba);
  capture::Image coverage = capture::make_image(rgba.height, rgba.width, 1);
  for (int y = 0; y < rgba.height; ++y) {
    for (int x = 0; x < rgba.width; ++x) coverage.at(y, x) = rgba.at(y, x, 3);
  }
  return coverage;
}

// How far outlines are apart: in the mean, by the area between them; and in how many pixels one is
// beyond what the other has within a pixel.
struct OutlineShift {
  double mean_px = 0;
  int beyond_a_pixel = 0;
};

OutlineShift outline_shift(const capture::Image& a, const capture::Image& b) {
  OutlineShift shift;
  double area = 0;
  double outline = 0;
  for (int y = 1; y + 1 < a.height; ++y) {
    for (int x = 1; x + 1 < a.width; ++x) {
      area += std::abs(a.at(y, x) - b.at(y, x));
      outline += std::hypot(a.at(y, x + 1) - a.at(y, x), a.at(y + 1, x) - a.at(y, x));
      float least = 1;
      float most = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          least = std::min(least, a.at(y + dy, x + dx));
          most = std::max(most, a.at(y + dy, x + dx));
        }
      }
      constexpr float tolerance = 0.1F;  // of edges with few samples
      shift.beyond_a_pixel += b.at(y, x) < least - tolerance || b.at(y, x) > most + tolerance;
    }
  }
  shift.mean_px = area / outline;
  return shift;
}

class CalibratedSet : public CommandLine {
 protected:
  std::string in(const std::string& name) const { return (dir_ / "calibration" / name).string(); }
  // Runs a command of which everything is expected to work, and returns its figures.
  Json calibrate(const std::string& words) const {
    const std::string json = (dir_ / "figures.json").string();
    const Outcome outcome = run("calibrate " + words + " --json " + json);
    EXPECT_EQ(outcome.status, 0) << words << "\n" << outcome.err;
    return outcome.status == 0 ? Json::parse(content_of(json)) : Json();
  }
};

TEST_F(CalibratedSet, PutsTheCarWhereTheTruthHasIt) {
  start();
  DemoSettings settings;
  settings.dir = dir_;
  settings.studio.sky_height = 128;
  settings.studio.texture_size = 512;
  settings.studio.frames = 1;
  settings.samples = 1;
  const DemoFigures demo = write_demo(settings, [](double, std::string_view) {});
  const render::MadeStudio studio = make_demo_studio(settings);

  const std::string board = " --board 9x6 --square 0.05 -o ";
  const Json plate_lens = calibrate("lens " + in("plate/*.png") + board + in("plate.cameramodel"));
  EXPECT_LT(plate_lens["heldout_rms_px"], 0.1);
  const Json probe_lens =
      calibrate("lens " + in("probe/*.png") + " --model fisheye" + board + in("probe.toml"));
  EXPECT_LT(probe_lens["heldout_rms_px"], 0.15);
  EXPECT_GT(probe_lens["coverage_deg"], 75);
  const Json pose = calibrate("pose --lens " + in("plate.cameramodel") + " --markers " +
                              in("plate_markers.toml") + " --noise 0.25 -o " + in("pose.toml"));
  const Json probe =
      calibrate("probe --lens " + in("probe.toml") + " --markers " + in("probe_markers.toml") +
                " --noise 0.25 -o " + in("probe_pose.toml"));
  const Json offset = calibrate("offset " + in("plate_lamp.mkv") + " " + in("probe_lamp.mkv") +
                                " --exposure-a 0.02 --exposure-b 0.02");

  const auto error =
      made::error_of(calibrate::read_pose(in("probe_pose.toml")), studio.probe.cam_from_set);
  const double probe_error_deg = error.turn_rad / made::degree;
  EXPECT_LT(probe_error_deg, 0.2);
  EXPECT_LT(probe_error_deg, 2.5 * double{probe["sigma_deg"]});
  EXPECT_NEAR(offset["offset_ms"], 1000 * demo_offset_s(studio), 1);
  EXPECT_LT(offset["sigma_ms"], 1);

  std::string text = content_of(demo.set);
  text = with_line(text, "camera", "lens", "lens = \"calibration/plate.cameramodel\"");
  text = with_line(text, "camera", "pose", pose_line(in("pose.toml")));
  text = with_line(text, "probe", "lens", "lens = \"calibration/probe.toml\"");
  text = with_line(text, "probe", "pose", pose_line(in("probe_pose.toml")));
  text = with_line(text, "probe", "offset_s",
                   "offset_s = " + std::to_string(1e-3 * double{offset["offset_ms"]}));
  const std::string file = write("calibrated.toml", text);
  const Outcome check = run("check " + file);
  ASSERT_EQ(check.status, 0) << check.err;

  const Set truth = read_set(demo.set.string());
  const Set found = read_set(file);
  const Shift shift = shift_of_car(truth.camera, found.camera, studio.car_yaw_deg);
  EXPECT_GT(shift.count, 100'000U);
  EXPECT_LT(shift.max_px, 1);
  EXPECT_LT(shift.rms_px, 0.5);
  const OutlineShift outlines = outline_shift(coverage_of(truth), coverage_of(found));
  EXPECT_LT(outlines.mean_px, 0.5);
  EXPECT_EQ(outlines.beyond_a_pixel, 0);
  const auto record = [](const char* name, double value) {
    RecordProperty(name, std::to_string(value));
  };
  record("car_rms_px", shift.rms_px);
  record("car_max_px", shift.max_px);
  record("outline_mean_px", outlines.mean_px);
  record("probe_error_deg", probe_error_deg);
  record("offset_error_ms", double{offset["offset_ms"]} - 1000 * demo_offset_s(studio));
  record("pose_sigma_deg", pose["sigma_deg"]);
}

}  // namespace
}  // namespace studio::calibrated_set_test
