// platelight calibrate probe: how a lightprobe is turned, from markers or from bright sources.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/angles.h"
#include "calibrate/markers.h"
#include "calibrate/pose_file.h"
#include "calibrate/registration.h"
#include "calibrate/rotation_fit.h"
#include "calibrate/source_match.h"
#include "calibrate/text_file.h"
#include "capture/camera.h"
#include "studio/commands/commands.h"
#include "studio/commands/pose_report.h"
#include "studio/json_text.h"
#include "studio/set_files.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

using calibrate::degree;

struct ProbeOptions {
  std::string lens;
  std::string out;
  std::string position;
  // By markers
  std::string markers;
  std::string picture;
  std::optional<double> noise_px;
  // By bright sources
  std::string light;
  std::string response;
  std::string plate;
  std::string plate_response;
  std::string plate_lens;
  std::string plate_pose;
  std::optional<double> tolerance_deg;
  std::optional<double> lamp_distance_m;
};

struct Found {
  calibrate::Pose probe_from_set;
  double sigma_deg = 0;
  double sigma_mm = 0;  // 0 = the position was given
  Json details;
  std::vector<std::string> warnings;
  std::string from;  // in words
};

std::optional<calibrate::Vec3> position_given(const ProbeOptions& options) {
  if (options.position.empty()) return std::nullopt;
  std::array<double, 3> numbers{};
  std::string_view rest = options.position;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::size_t end = i + 1 < numbers.size() ? rest.find(',') : rest.size();
    if (end == rest.npos || !calibrate::parse_number(rest.substr(0, end), numbers[i]) ||
        !std::isfinite(numbers[i])) {
      throw UsageError(fmt::format("--position is x,y,z in metres, not \"{}\"", options.position));
    }
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return calibrate::Vec3{numbers[0], numbers[1], numbers[2]};
}

// Where the probe stands is known: only how it is turned is asked for.
Found turn_by_markers(const std::vector<calibrate::Marker>& markers,
                      const std::vector<calibrate::Sight>& sights,
                      const calibrate::Lens& lens,
                      calibrate::Vec3 position,
                      double noise_px) {
  auto fit = calibrate::fit_rotation(calibrate::directions_from(sights, position, noise_px));
  add_lens_error(fit, sights, position, calibrate::error_of(lens));
  Found found;
  constexpr double far_above = 5;
  if (fit.excess > far_above) {
    found.warnings.emplace_back(
        "the residuals are far above the noise to be expected: a marker or the position is wrong, "
        "or the lens is off");
  }
  if (std::ranges::count(fit.agrees, true) == 2) {
    found.warnings.emplace_back(
        "the turn rests on two markers, which would agree swapped or mirrored as well: a third "
        "would confirm them");
  }
  found.probe_from_set = calibrate::pose_from_rotation(fit.cam_from_set, position);
  found.sigma_deg = fit.turn_sigma_rad / degree;
  Json list = Json::array();
  for (std::size_t i = 0; i < markers.size(); ++i) {
    list.push_back({{"name", markers[i].name},
                    {"residual_deg", fit.residuals_rad[i] / degree},
                    {"agrees", static_cast<bool>(fit.agrees[i])}});
    if (!fit.agrees[i]) {
      found.warnings.push_back(
          fmt::format("marker \"{}\" does not agree and was left out", markers[i].name));
    }
  }
  found.details = {{"rms_deg", fit.rms_rad / degree}, {"markers", list}};
  return found;
}

Found place_by_markers(const std::vector<calibrate::Marker>& markers,
                       const std::vector<calibrate::Sight>& sights,
                       const calibrate::Lens& lens,
                       double noise_px) {
  const calibrate::Registration fit =
      calibrate::register_camera(sights, {noise_px, calibrate::error_of(lens)});
  Found found;
  found.probe_from_set = fit.cam_from_set;
  found.sigma_deg = fit.turn_sigma_rad / degree;
  found.sigma_mm = 1000 * fit.position_sigma_m;
  found.warnings = fit.warnings;
  Json list = Json::array();
  for (std::size_t i = 0; i < markers.size(); ++i) {
    const calibrate::Vec2 r = fit.residuals_px[i];
    list.push_back({{"name", markers[i].name},
                    {"residual_px", {r.x, r.y}},
                    {"agrees", static_cast<bool>(fit.agrees[i])}});
  }
  found.details = {{"rms_px", fit.rms_px}, {"ambiguous", fit.ambiguous}, {"markers", list}};
  return found;
}

Found find_by_markers(const ProbeOptions& options, const calibrate::Lens& lens) {
  const auto markers = read_markers_of(options.markers, options.picture);
  const auto position = position_given(options);
  const double noise_px = options.noise_px.value_or(0.5);
  try {
    const auto sights = calibrate::sights_of(lens, markers);
    Found found = position ? turn_by_markers(markers, sights, lens, *position, noise_px)
                           : place_by_markers(markers, sights, lens, noise_px);
    found.from = fmt::format("{} markers", markers.size());
    return found;
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format(
        "{}: {}{}", options.markers, error.what(),
        position ? "" : "; where the probe's position is known, --position needs only two"));
  }
}

std::shared_ptr<const capture::Image> read_picture(const std::string& source,
                                                   const std::string& response,
                                                   const calibrate::Lens& lens,
                                                   const std::string& lens_file) {
  capture::CameraOptions reading;
  reading.response = response;
  const auto camera = capture::open_camera(source, reading);
  const std::optional<capture::Frame> frame = camera->next();
  if (!frame || frame->image == nullptr) throw std::runtime_error(source + ": has no picture");
  if (frame->image->width != lens.width || frame->image->height != lens.height) {
    throw std::runtime_error(fmt::format("{}: is {}x{}, but {} is of {}x{}", source,
                                         frame->image->width, frame->image->height, lens_file,
                                         lens.width, lens.height));
  }
  return frame->image;
}

Found find_by_sources(const ProbeOptions& options, const calibrate::Lens& lens) {
  const calibrate::Lens plate_lens = calibrate::read_lens(options.plate_lens);
  const calibrate::Pose plate_pose = calibrate::read_pose(options.plate_pose);
  const auto light = read_picture(options.light, options.response, lens, options.lens);
  const auto plate =
      read_picture(options.plate, options.plate_response, plate_lens, options.plate_lens);
  const calibrate::SourceMatch match =
      calibrate::match_sources({plate.get(), &plate_lens}, plate_pose.R, {light.get(), &lens},
                               options.tolerance_deg.value_or(2) * degree);
  Found found;
  const auto position = position_given(options);
  found.probe_from_set = calibrate::pose_from_rotation(match.fit.cam_from_set,
                                                       position.value_or(position_of(plate_pose)));
  if (!position) {
    found.warnings.emplace_back(
        "the probe is put where the scene camera stands: bright sources only tell how it is "
        "turned, and both are taken to see them from one place; --position says otherwise, and by "
        "how much +- grows");
  }
  const double apart_m = position ? length(*position - position_of(plate_pose)) : 0;
  const double lamp_distance_m = options.lamp_distance_m.value_or(5);
  const double parallax_deg = std::atan2(apart_m, lamp_distance_m) / degree;
  const double matched_deg = match.fit.turn_sigma_rad / degree;
  found.sigma_deg = std::hypot(matched_deg, parallax_deg);
  if (constexpr double clear_deg = 0.1; parallax_deg > std::max(clear_deg, matched_deg)) {
    found.warnings.push_back(fmt::format(
        "the probe stands {:.2f} m from the plate's camera: lamps {:.3g} m away are seen up to "
        "{:.1f} degrees apart, which +- counts; put them farther off and say --lamp-distance, or "
        "use markers",
        apart_m, lamp_distance_m, parallax_deg));
  }
  found.warnings.insert(found.warnings.end(), match.warnings.begin(), match.warnings.end());
  Json list = Json::array();
  for (std::size_t i = 0; i < match.probe_sources.size(); ++i) {
    const calibrate::Vec2 a = match.camera_sources[i].q;
    const calibrate::Vec2 b = match.probe_sources[i].q;
    list.push_back({{"plate_px", {a.x, a.y}},
                    {"light_px", {b.x, b.y}},
                    {"residual_deg", match.fit.residuals_rad[i] / degree}});
  }
  found.details = {{"rms_deg", match.fit.rms_rad / degree},
                   {"parallax_deg", position ? Json(parallax_deg) : Json()},
                   {"likeness", match.likeness},
                   {"sources", list}};
  found.from = fmt::format("{} bright sources", match.probe_sources.size());
  return found;
}

void calibrate_probe(const ProbeOptions& options, Console& console) {
  check_pose_file_name(options.out);
  const bool by_sources = !options.light.empty() || !options.plate.empty();
  if (by_sources == !options.markers.empty()) {
    throw UsageError("give --markers, or --light and --plate");
  }
  if (by_sources && (options.light.empty() || options.plate.empty() || options.plate_lens.empty() ||
                     options.plate_pose.empty())) {
    throw UsageError("bright sources need --light, --plate, --plate-lens and --plate-pose");
  }
  spare_files(
      std::array{ReadFile{"the lens", options.lens},
                 ReadFile{"what the pose is found by", options.markers},
                 ReadFile{"the probe's picture", options.light},
                 ReadFile{"its response", options.response}, ReadFile{"the plate", options.plate},
                 ReadFile{"the plate's response", options.plate_response},
                 ReadFile{"the plate's lens", options.plate_lens},
                 ReadFile{"the plate's pose", options.plate_pose}},
      options.out);
  check_directory_of(options.out);
  const calibrate::Lens lens = calibrate::read_lens(options.lens);
  check_pose_file_takes(options.out, lens);
  const Found found = by_sources ? find_by_sources(options, lens) : find_by_markers(options, lens);
  write_pose_file(options.out, found.probe_from_set, lens,
                  fmt::format("by platelight calibrate probe, from {}: +- {:.2g} degrees",
                              found.from, found.sigma_deg));
  Json figures = pose_json(found.probe_from_set);
  figures["sigma_deg"] = found.sigma_deg;
  if (found.sigma_mm > 0) figures["sigma_mm"] = found.sigma_mm;
  figures.update(found.details);
  figures["warnings"] = found.warnings;
  say_pose(found.probe_from_set, found.sigma_deg, found.sigma_mm, console);
  console.figures(json_text(figures));
  if (!by_sources) warn_of_unknown_error(lens, options.lens, console);
  for (const std::string& warning : found.warnings) console.warn(warning);
  console.say(fmt::format("{}: from {}", options.out, found.from));
}

}  // namespace

Command calibrate_probe_command() {
  return {
      "calibrate probe", "Find how a lightprobe is turned, from markers or bright sources",
      "platelight calibrate probe --lens probe.toml --light probe.exr --plate plate.png "
      "--plate-lens scene.cameramodel --plate-pose pose.toml -o probe_pose.toml",
      [](Arguments& arguments) -> std::function<void(Console&)> {
        auto o = std::make_shared<ProbeOptions>();
        arguments.option("--lens", o->lens, "the probe's lens: a .toml or .cameramodel file");
        arguments.required("--lens");
        arguments.option("-o,--out", o->out,
                         ".toml file with the line for a set, or .cameramodel with extrinsics");
        arguments.required("--out");
        arguments.option("--position", o->position,
                         "where the probe stands, x,y,z in metres: then two markers are enough");
        arguments.option("--markers", o->markers,
                         ".toml file of points in the set and their pixels");
        arguments.option("--picture", o->picture, "only the markers of this picture");
        arguments.option("--noise", o->noise_px, 1e-3, 100,
                         "expected error of a marker's pixel along each axis; 0.5 if not said");
        arguments.option("--light", o->light, "the probe's picture, best in high dynamic range");
        arguments.option("--response", o->response, "its .rsp or .toml file, if it is of codes");
        arguments.option("--plate", o->plate, "the scene camera's picture");
        arguments.option("--plate-response", o->plate_response, "its .rsp or .toml file");
        arguments.option("--plate-lens", o->plate_lens, "the scene camera's lens");
        arguments.option("--plate-pose", o->plate_pose,
                         "its pose: a .toml or .cameramodel file of calibrate pose");
        arguments.option("--tolerance", o->tolerance_deg, 0.01, 30,
                         "degrees that directions to one source may differ by; 2 if not said");
        arguments.option("--lamp-distance", o->lamp_distance_m, 0.1, 1e9,
                         "metres to the nearest of the bright sources: what a probe at --position "
                         "sees otherwise than the plate's camera goes into +-; 5 if not said");
        return [o](Console& console) { calibrate_probe(*o, console); };
      }};
}

}  // namespace studio
