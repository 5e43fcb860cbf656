// platelight calibrate pose: where a camera stands and looks, from surveyed markers or a board.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/angles.h"
#include "calibrate/board_detector.h"
#include "calibrate/corner_refinement.h"
#include "calibrate/markers.h"
#include "calibrate/pose_file.h"
#include "calibrate/registration.h"
#include "capture/camera.h"
#include "studio/commands/board_options.h"
#include "studio/commands/commands.h"
#include "studio/commands/pose_report.h"
#include "studio/json_text.h"
#include "studio/set_files.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

using calibrate::degree;

struct PoseOptions {
  std::string lens;
  std::string out;
  std::optional<double> noise_px;
  // By markers
  std::string markers;
  std::string picture;
  // By a board
  std::string board_picture;
  BoardOptions board;
  std::string board_pose;
};

// board_from_set of a board that lies on the ground at the origin: the set's x runs along its rows,
// y up its columns, and z is up.
const calibrate::Pose lying{{{1, 0, 0, 0, -1, 0, 0, 0, -1}}, {}};

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

// The corners of a board whose place in the set is known.
std::vector<calibrate::Marker> find_board(const PoseOptions& options, const calibrate::Lens& lens) {
  const calibrate::Board board = board_of(options.board);
  const calibrate::Pose board_from_set =
      options.board_pose.empty() ? lying : calibrate::read_pose(options.board_pose);
  const auto frame = capture::open_camera(options.board_picture)->next();
  if (!frame || frame->image == nullptr) {
    throw std::runtime_error(options.board_picture + ": has no picture");
  }
  if (frame->image->width != lens.width || frame->image->height != lens.height) {
    throw std::runtime_error(fmt::format("{}: is {}x{}, but {} is of {}x{}", options.board_picture,
                                         frame->image->width, frame->image->height, options.lens,
                                         lens.width, lens.height));
  }
  const calibrate::GreyPicture grey = calibrate::grey_picture(*frame->image);
  calibrate::DetectionOptions detection;
  detection.lens = lens;
  const calibrate::BoardDetection found = calibrate::detect_board(grey, board, detection);
  if (!found.view) throw std::runtime_error(options.board_picture + ": " + found.reason);
  const calibrate::BoardView refined = calibrate::refine_corners(grey, *found.view, board, lens);
  const bool better = count_corners(refined) > count_corners(*found.view) / 2;
  return markers_of(board, better ? refined : *found.view, inverse(board_from_set));
}

void warn_of_turned_board(const BoardOptions& options, calibrate::Registration& found) {
  const int quarters = quarters_alike(board_of(options));
  if (quarters == 0) return;
  found.warnings.push_back(fmt::format(
      "a chessboard of {} corners looks alike after {}: the pose may be turned about it by as "
      "much; "
      "check its position, or lay a board of an odd and an even number of corners, or a ChArUco "
      "board",
      options.corners, quarters == 1 ? "a quarter of a turn" : "half a turn"));
}

// What the residuals do not show: a plane of markers that is mirrored has an exact pose, too, from
// its other side. A set is right-handed, in metres, with z up, and pixels count downwards.
void warn_of_place(const std::vector<calibrate::Marker>& markers,
                   const std::vector<calibrate::Sight>& sights,
                   const calibrate::RegistrationOptions& options,
                   calibrate::Registration& found) {
  const calibrate::Vec3 at = position_of(found.cam_from_set);
  double lowest_m = HUGE_VAL, nearest_m = HUGE_VAL;
  for (const calibrate::Marker& marker : markers) {
    lowest_m = std::min(lowest_m, marker.p_set.z);
    nearest_m = std::min(nearest_m, length(marker.p_set - at));
  }
  constexpr double far_m = 500, downwards = 0.5, clear_m = 0.05;
  if (at.z < std::min(0.0, lowest_m) - clear_m) {
    found.warnings.push_back(
        fmt::format("the camera comes out {:.2f} m below all that it is found by: a set is "
                    "right-handed with z up, and pixels count downwards; is an axis mirrored?",
                    lowest_m - at.z));
  }
  if ((found.cam_from_set.R * calibrate::Vec3{0, 0, 1}).y > downwards) {
    found.warnings.emplace_back(
        "z points down in the picture: are the positions of a set with y up, or does the camera "
        "hang "
        "upside down?");
  }
  if (nearest_m > far_m) {
    found.warnings.push_back(fmt::format(
        "the camera comes out {:.0f} m from all that it is found by: are the positions in metres?",
        nearest_m));
  }
  const auto agreeing = std::ranges::count(found.agrees, true);
  if (agreeing == std::ssize(found.agrees)) return;
  std::vector<calibrate::Sight> turned_over = sights;
  for (calibrate::Sight& sight : turned_over) sight.p_set.y = -sight.p_set.y;
  try {
    const auto other = calibrate::register_camera(turned_over, options);
    if (std::ranges::count(other.agrees, true) <= agreeing) return;
    found.warnings.emplace_back(
        "with their y of the other sign more of them agree: is an axis of the positions mirrored?");
  } catch (const std::runtime_error&) {
    return;  // nor do these
  }
}

void say_markers(const std::vector<calibrate::Marker>& markers,
                 const calibrate::Registration& found,
                 bool all,
                 Console& console) {
  if (all) console.say("marker                    off by, px");
  for (std::size_t i = 0; i < markers.size(); ++i) {
    if (!all && found.agrees[i]) continue;
    const calibrate::Vec2 r = found.residuals_px[i];
    console.say(fmt::format("{:<25} {:>10.2f}{}", markers[i].name, std::hypot(r.x, r.y),
                            found.agrees[i] ? "" : "  left out"));
  }
}

void calibrate_pose(const PoseOptions& options, Console& console) {
  check_pose_file_name(options.out);
  const bool by_board = !options.board_picture.empty();
  if (by_board == !options.markers.empty()) {
    throw UsageError("give --markers, or the PICTURE of a board");
  }
  const std::string& source = by_board ? options.board_picture : options.markers;
  const std::string what = by_board ? "corners" : "markers";
  spare_files(
      std::array{ReadFile{"what the pose is found by", source}, ReadFile{"the lens", options.lens},
                 ReadFile{"the board's pose", options.board_pose}},
      options.out);
  const double usual_noise_px = by_board ? 0.2 : 0.5;
  check_directory_of(options.out);
  const calibrate::Lens lens = calibrate::read_lens(options.lens);
  check_pose_file_takes(options.out, lens);
  const std::vector<calibrate::Marker> markers =
      by_board ? find_board(options, lens) : read_markers_of(options.markers, options.picture);
  const calibrate::RegistrationOptions fitting{options.noise_px.value_or(usual_noise_px),
                                               error_of(lens)};
  std::vector<calibrate::Sight> sights;
  calibrate::Registration found = [&] {
    try {
      sights = calibrate::sights_of(lens, markers);
      return calibrate::register_camera(sights, fitting);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: {}", source, error.what()));
    }
  }();
  if (by_board) warn_of_turned_board(options.board, found);
  warn_of_place(markers, sights, fitting, found);
  const double sigma_deg = found.turn_sigma_rad / degree;
  const double sigma_mm = 1000 * found.position_sigma_m;
  Json figures = pose_json(found.cam_from_set);
  figures.update(Json{{"sigma_deg", sigma_deg},
                      {"sigma_mm", sigma_mm},
                      {"rms_px", found.rms_px},
                      {"lens_error_px", lens.error_px},
                      {"ambiguous", found.ambiguous}});
  if (found.rival) {
    figures["rival"] = pose_json(*found.rival);
    figures["rival"]["rms_px"] = found.rival_rms_px;
  }
  figures["covariance"] = found.covariance;
  figures["markers"] = markers_json(markers, found);
  figures["warnings"] = found.warnings;
  write_pose_file(options.out, found.cam_from_set, lens,
                  fmt::format("by platelight calibrate pose, from {} {}: +- {:.2g} degrees, "
                              "+- {:.2g} mm",
                              markers.size(), what, sigma_deg, sigma_mm));
  say_markers(markers, found, !by_board, console);
  say_pose(found.cam_from_set, sigma_deg, sigma_mm, console);
  console.figures(json_text(figures));
  warn_of_unknown_error(lens, options.lens, console);
  for (const std::string& warning : found.warnings) console.warn(warning);
  console.say(fmt::format("{}: from {} {}, {:.2f} px off", options.out, markers.size(), what,
                          found.rms_px));
}

}  // namespace

Command calibrate_pose_command() {
  return {"calibrate pose", "Find where a camera stands and looks, from markers or a board",
          "platelight calibrate pose --lens scene.cameramodel --markers markers.toml -o pose.toml",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<PoseOptions>();
            arguments.option("--lens", o->lens, "the lens: a .toml or .cameramodel file");
            arguments.required("--lens");
            arguments.optional_positional("PICTURE", o->board_picture,
                                          "of a board that lies in the set");
            declare(arguments, o->board);
            arguments.option("--board-pose", o->board_pose,
                             "where the board is, a file of its pose; else it lies on the ground, "
                             "its first corner at the origin, x along its rows");
            arguments.option("--markers", o->markers,
                             ".toml file of points in the set and their pixels");
            arguments.option("--picture", o->picture, "only the markers of this picture");
            arguments.option("-o,--out", o->out,
                             ".toml file with the line for a set, or .cameramodel with extrinsics");
            arguments.required("--out");
            arguments.option("--noise", o->noise_px, 1e-3, 100,
                             "expected error of a marker's pixel along each axis; 0.5 if not said, "
                             "0.2 of a board's corners");
            return [o](Console& console) { calibrate_pose(*o, console); };
          }};
}

}  // namespace studio
