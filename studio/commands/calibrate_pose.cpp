// platelight calibrate pose: where a camera stands and looks, from surveyed markers.
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/markers.h"
#include "calibrate/pose_file.h"
#include "calibrate/registration.h"
#include "studio/commands/commands.h"
#include "studio/commands/pose_report.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

constexpr double degree = std::numbers::pi / 180;

struct PoseOptions {
  std::string lens;
  std::string markers;
  std::string picture;
  std::string out;
  std::optional<double> noise_px;
};

Json markers_json(const std::vector<calibrate::Marker>& markers,
                  const calibrate::Registration& found) {
  Json list = Json::array();
  for (std::size_t i = 0; i < markers.size(); ++i) {
    const calibrate::Vec2 r = found.residuals_px[i];
    list.push_back({{"name", markers[i].name},
                    {"residual_px", {r.x, r.y}},
                    {"agrees", static_cast<bool>(found.agrees[i])}});
  }
  return list;
}

void say_markers(const std::vector<calibrate::Marker>& markers,
                 const calibrate::Registration& found,
                 Console& console) {
  console.say("marker                    off by, px");
  for (std::size_t i = 0; i < markers.size(); ++i) {
    const calibrate::Vec2 r = found.residuals_px[i];
    console.say(fmt::format("{:<25} {:>10.2f}{}", markers[i].name, std::hypot(r.x, r.y),
                            found.agrees[i] ? "" : "  left out"));
  }
}

void calibrate_pose(const PoseOptions& options, Console& console) {
  check_pose_file_name(options.out);
  const calibrate::Lens lens = calibrate::read_lens(options.lens);
  const std::vector<calibrate::Marker> markers = read_markers_of(options.markers, options.picture);
  const calibrate::Registration found = [&] {
    try {
      return calibrate::register_camera(calibrate::sights_of(lens, markers),
                                        {options.noise_px.value_or(0.5)});
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: {}", options.markers, error.what()));
    }
  }();
  const double sigma_deg = found.turn_sigma_rad / degree;
  const double sigma_mm = 1000 * found.position_sigma_m;
  Json figures = pose_json(found.cam_from_set);
  figures.update(Json{{"sigma_deg", sigma_deg},
                      {"sigma_mm", sigma_mm},
                      {"rms_px", found.rms_px},
                      {"ambiguous", found.ambiguous}});
  if (found.rival) {
    figures["rival"] = pose_json(*found.rival);
    figures["rival"]["rms_px"] = found.rival_rms_px;
  }
  figures["covariance"] = found.covariance;
  figures["markers"] = markers_json(markers, found);
  figures["warnings"] = found.warnings;
  write_pose_file(options.out, found.cam_from_set, lens,
                  fmt::format("by platelight calibrate pose, from {} markers: +- {:.2g} degrees, "
                              "+- {:.2g} mm",
                              markers.size(), sigma_deg, sigma_mm));
  say_markers(markers, found, console);
  say_pose(found.cam_from_set, sigma_deg, sigma_mm, console);
  console.figures(figures.dump(2));
  for (const std::string& warning : found.warnings) console.warn(warning);
  console.say(
      fmt::format("{}: from {} markers, {:.2f} px off", options.out, markers.size(), found.rms_px));
}

}  // namespace

Command calibrate_pose_command() {
  return {"calibrate pose", "Find where a camera stands and looks from surveyed markers",
          "platelight calibrate pose --lens scene.cameramodel --markers markers.toml -o pose.toml",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<PoseOptions>();
            arguments.option("--lens", o->lens, "the lens: a .toml or .cameramodel file");
            arguments.required("--lens");
            arguments.option("--markers", o->markers,
                             ".toml file of points in the set and their pixels");
            arguments.required("--markers");
            arguments.option("--picture", o->picture, "only the markers of this picture");
            arguments.option("-o,--out", o->out,
                             ".toml file with the line for a set, or .cameramodel with extrinsics");
            arguments.required("--out");
            arguments.option("--noise", o->noise_px, 1e-3, 100,
                             "expected error of a marker's pixel along each axis; 0.5 if not said");
            return [o](Console& console) { calibrate_pose(*o, console); };
          }};
}

}  // namespace studio
