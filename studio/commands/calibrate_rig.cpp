// platelight calibrate rig: where several cameras stand to each other, from a board that they see.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/angles.h"
#include "calibrate/board_detector.h"
#include "calibrate/corner_refinement.h"
#include "calibrate/rig.h"
#include "calibrate/rig_file.h"
#include "calibrate/text_file.h"
#include "capture/camera.h"
#include "capture/parallel_loop.h"
#include "studio/commands/board_options.h"
#include "studio/commands/board_places.h"
#include "studio/commands/commands.h"
#include "studio/commands/pose_report.h"
#include "studio/json_text.h"
#include "studio/set_files.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

using calibrate::degree;
constexpr std::size_t most_camera_pictures = 500;

struct RigOptions {
  std::vector<std::string> sources;    // NAME=DIRECTORY or NAME=VIDEO
  std::vector<std::string> lenses;     // NAME=FILE
  std::vector<std::string> offsets;    // NAME=SECONDS
  std::vector<std::string> responses;  // NAME=FILE
  BoardOptions board;
  std::string out;
  std::optional<std::int64_t> every;
};

// One camera, as the command line has it.
struct Source {
  std::string name;
  std::string pictures;
  std::string lens_file;
  double time_offset_s = 0;
  std::string response;
};

std::pair<std::string, std::string> named(const std::string& word,
                                          const std::string& option,
                                          std::string_view what = "FILE") {
  const std::size_t equals = word.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == word.size()) {
    throw UsageError(fmt::format("{} is NAME={}, not {}", option, what, word));
  }
  return {word.substr(0, equals), word.substr(equals + 1)};
}

using ByName = std::map<std::string, std::string>;

// What an option says of each camera.
ByName by_name(const std::vector<std::string>& words,
               const std::string& option,
               std::string_view what = "FILE") {
  ByName all;
  for (const std::string& word : words) {
    const auto [name, value] = named(word, option, what);
    if (!all.emplace(name, value).second) {
      throw UsageError(fmt::format("camera {} has {} twice", name, option));
    }
  }
  return all;
}

// The value of a camera, which is taken out; "" = it has none.
std::string take(ByName& all, const std::string& name) {
  const auto node = all.extract(name);
  return node.empty() ? "" : node.mapped();
}

void expect_none_left(const ByName& all, const std::string& option) {
  if (all.empty()) return;
  throw UsageError(fmt::format("{} {} is of no camera", option, all.begin()->first));
}

double offset_of(const std::string& name, const std::string& text) {
  double offset_s = 0;
  if (text.empty()) return 0;
  if (!calibrate::parse_number(text, offset_s) || !(std::abs(offset_s) <= 60)) {
    throw UsageError(fmt::format("--offset {}={} must be seconds from -60 to 60", name, text));
  }
  return offset_s;
}

std::vector<Source> sources_of(const RigOptions& options) {
  ByName lenses = by_name(options.lenses, "--lens");
  ByName offsets = by_name(options.offsets, "--offset", "SECONDS");
  ByName responses = by_name(options.responses, "--response");
  std::vector<Source> sources;
  for (const std::string& word : options.sources) {
    const auto [name, pictures] = named(word, "a camera");
    if (std::ranges::find(sources, name, &Source::name) != sources.end()) {
      throw UsageError(fmt::format("camera {} is there twice", name));
    }
    const std::string lens = take(lenses, name);
    if (lens.empty()) {
      throw UsageError(fmt::format("camera {0} has no lens: add --lens {0}=FILE", name));
    }
    sources.push_back(
        {name, pictures, lens, offset_of(name, take(offsets, name)), take(responses, name)});
    if (const std::string& response = sources.back().response;
        !response.empty() && !fs::is_regular_file(response)) {
      throw std::runtime_error(response + ": there is no such response file");
    }
  }
  expect_none_left(lenses, "--lens");
  expect_none_left(offsets, "--offset");
  expect_none_left(responses, "--response");
  if (sources.size() < 2) throw UsageError("a rig has two cameras or more");
  return sources;
}

// Boards that one camera saw, by the word that its instant goes by: a picture's name without its
// ending; of a video, the number of the frame of the rig's clock.
using Instants = std::map<std::string, calibrate::BoardView>;

struct Pictures {
  std::vector<std::string> instants;
  std::vector<calibrate::GreyPicture> grey;
};

// A video's frames are of the rig's clock by their number, less how much later they are stamped: to
// half a frame at most.
std::int64_t frames_later(const Source& source, capture::Rational rate) {
  if (source.time_offset_s == 0) return 0;
  if (rate.num <= 0) {
    throw std::runtime_error(fmt::format(
        "{}: does not tell its frame rate, so --offset {}={} says no frame: cut the videos to one "
        "start, or take pictures of one name each instant",
        source.pictures, source.name, source.time_offset_s));
  }
  return std::llround(source.time_offset_s * rate.value());
}

// The frames of videos are paired by number, which is their instant at one rate only.
void check_rates(const std::vector<Source>& sources) {
  constexpr double same = 1e-4;
  const Source* first = nullptr;
  capture::Rational rate;
  for (const Source& source : sources) {
    if (fs::is_directory(source.pictures)) continue;
    const capture::Rational its = open_recorded(source.pictures)->info().rate;
    if (its.num <= 0) continue;
    if (first == nullptr) {
      first = &source;
      rate = its;
    } else if (std::abs(its.value() / rate.value() - 1) > same) {
      throw std::runtime_error(fmt::format(
          "{} has {:.6g} frames a second and {} has {:.6g}: of two rates, frames of one number are "
          "not of one instant; convert one of them, or take pictures of one name each instant",
          first->pictures, rate.value(), source.pictures, its.value()));
    }
  }
}

Pictures read_pictures(const Source& source, std::int64_t every) {
  Pictures pictures;
  const auto add = [&](std::string instant, const capture::Image& image) {
    if (pictures.grey.size() == most_camera_pictures) {
      throw std::runtime_error(fmt::format("{}: more than {} pictures; take fewer", source.pictures,
                                           most_camera_pictures));
    }
    pictures.instants.push_back(std::move(instant));
    pictures.grey.push_back(calibrate::grey_picture(image));
  };
  if (!fs::is_directory(source.pictures)) {
    const auto camera = open_recorded(source.pictures);
    const std::int64_t later = frames_later(source, camera->info().rate);
    for (std::int64_t number = -later; const auto frame = camera->next(); ++number) {
      // In place of a lost one comes the one before.
      if (frame->image == nullptr || frame->status == capture::FrameStatus::lost) continue;
      if (number >= 0 && number % every == 0) {
        add(fmt::format("frame {:09}", number), *frame->image);
      }
    }
    return pictures;
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(source.pictures)) {
    const bool hidden = entry.path().filename().string().starts_with('.');
    if (entry.is_regular_file() && !hidden) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  for (const fs::path& file : files) {
    const auto frame = capture::open_camera(file.string(), {})->next();
    if (frame && frame->image != nullptr) add(file.stem().string(), *frame->image);
  }
  return pictures;
}

Instants find_boards(const Source& source,
                     const calibrate::Lens& lens,
                     const calibrate::Board& board,
                     std::int64_t every,
                     Console& console) {
  const Pictures pictures = read_pictures(source, every);
  std::vector<std::optional<calibrate::BoardView>> views(pictures.grey.size());
  std::atomic<std::size_t> done = 0;
  std::mutex speaking;
  capture::parallel_for(std::size_t{0}, views.size(), [&](std::size_t i) {
    const calibrate::GreyPicture& grey = pictures.grey[i];
    if (grey.width != lens.width || grey.height != lens.height) {
      throw std::runtime_error(fmt::format("{}: {} is {}x{}, but its lens is for {}x{}",
                                           source.pictures, pictures.instants[i], grey.width,
                                           grey.height, lens.width, lens.height));
    }
    calibrate::DetectionOptions detection;
    detection.lens = lens;
    const auto found = calibrate::detect_board(grey, board, detection);
    if (found.view) {
      views[i] = calibrate::refine_corners(grey, *found.view, board, lens);
      views[i]->name = pictures.instants[i];
    }
    const std::lock_guard lock(speaking);
    console.progress(static_cast<double>(++done) / static_cast<double>(views.size()),
                     "looking for the board of " + source.name);
  });
  Instants instants;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!views[i]) continue;
    if (!instants.emplace(pictures.instants[i], *views[i]).second) {
      throw std::runtime_error(
          fmt::format("{}: two pictures are called {}", source.pictures, pictures.instants[i]));
    }
  }
  if (instants.empty()) {
    throw std::runtime_error(
        fmt::format("{}: no board in any of {} pictures", source.pictures, views.size()));
  }
  return instants;
}

calibrate::RigProblem problem_of(const std::vector<Source>& sources,
                                 const calibrate::Board& board,
                                 const std::vector<calibrate::Lens>& lenses,
                                 const std::vector<Instants>& seen) {
  std::map<std::string, int> all;
  for (const Instants& instants : seen) {
    for (const auto& [word, view] : instants) ++all[word];
  }
  calibrate::RigProblem problem{board, {}};
  for (std::size_t c = 0; c < sources.size(); ++c) {
    problem.cameras.push_back({sources[c].name, lenses[c], {}});
    for (const auto& [word, count] : all) {
      const auto view = seen[c].find(word);
      problem.cameras[c].views.push_back(view == seen[c].end() ? calibrate::BoardView{word, {}}
                                                               : view->second);
    }
  }
  return problem;
}

void calibrate_rig(const RigOptions& options, Console& console) {
  if (!options.out.ends_with(".toml")) throw UsageError("--out must end in .toml");
  const std::vector<Source> sources = sources_of(options);
  std::vector<ReadFile> read;
  for (const Source& source : sources) {
    read.push_back({"the lens of camera " + source.name, source.lens_file});
    read.push_back({"the response of camera " + source.name, source.response});
  }
  spare_files(read, options.out);
  check_directory_of(options.out);
  const calibrate::Board board = board_of(options.board);
  check_rates(sources);
  std::vector<calibrate::Lens> lenses;
  for (const Source& source : sources) lenses.push_back(calibrate::read_lens(source.lens_file));
  std::vector<Instants> seen;
  constexpr std::int64_t usual_step = 25;
  for (std::size_t c = 0; c < sources.size(); ++c) {
    seen.push_back(
        find_boards(sources[c], lenses[c], board, options.every.value_or(usual_step), console));
  }
  const calibrate::RigFit fit = calibrate::fit_rig(problem_of(sources, board, lenses, seen));

  std::vector<calibrate::RigMember> members;
  Json cameras = Json::array();
  console.say("camera                    views  corners  left out  off, px   +- deg     +- mm");
  for (std::size_t c = 0; c < sources.size(); ++c) {
    const calibrate::RigCameraFit& camera = fit.cameras[c];
    members.push_back({sources[c].name, sources[c].lens_file, camera.cam_from_rig,
                       sources[c].time_offset_s, sources[c].response});
    const double sigma_deg = camera.turn_sigma_rad / degree;
    const double sigma_mm = 1000 * camera.position_sigma_m;
    const calibrate::Vec3 p = position_of(camera.cam_from_rig);
    cameras.push_back({{"name", sources[c].name},
                       {"position_m", {p.x, p.y, p.z}},
                       {"rotation", camera.cam_from_rig.R.m},
                       {"sigma_deg", sigma_deg},
                       {"sigma_mm", sigma_mm},
                       {"rms_px", camera.rms_px},
                       {"views", camera.views},
                       {"corners", camera.corners},
                       {"left_out", camera.left_out}});
    console.say(fmt::format("{:<25} {:>5} {:>8} {:>9} {:>8.2f} {:>8.3f} {:>9.2f}", sources[c].name,
                            camera.views, camera.corners, camera.left_out, camera.rms_px, sigma_deg,
                            sigma_mm));
  }
  calibrate::write_rig(options.out, members,
                       fmt::format("by platelight calibrate rig, {:.2f} px off", fit.rms_px));
  console.figures(json_text(Json{{"rms_px", fit.rms_px},
                                 {"chi_squared", fit.chi_squared ? Json(*fit.chi_squared) : Json()},
                                 {"cameras", cameras},
                                 {"warnings", fit.warnings}}));
  for (std::size_t c = 0; c < sources.size(); ++c) {
    warn_of_unknown_error(lenses[c], sources[c].lens_file, console);
  }
  for (const std::string& warning : fit.warnings) console.warn(warning);
  console.say(
      fmt::format("{}: {} cameras, {:.2f} px off", options.out, sources.size(), fit.rms_px));
}

}  // namespace

Command calibrate_rig_command() {
  return {"calibrate rig", "Find where several cameras stand to each other from a board they see",
          "platelight calibrate rig plate=plate/ probe=probe/ --lens plate=plate.cameramodel "
          "--lens probe=probe.toml --board 9x6 --square 0.04 -o rig.toml",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<RigOptions>();
            arguments.positionals("CAMERAS", o->sources,
                                  "NAME=DIRECTORY of pictures, those of one name taken at one "
                                  "instant, or NAME=VIDEO, all of one rate and, but for "
                                  "--offset, of one start");
            arguments.repeated("--lens", o->lenses, "NAME=FILE: a camera's lens; once for each");
            arguments.required("--lens");
            arguments.repeated("--offset", o->offsets,
                               "NAME=SECONDS that a camera stamps its frames later than the first "
                               "one does, as calibrate offset FIRST CAMERA tells; 0 if not said. "
                               "Videos' frames are paired by it, to the nearest");
            arguments.repeated("--response", o->responses,
                               "NAME=FILE of calibrate response, where there is one");
            declare(arguments, o->board);
            arguments.option("--every", o->every, 1, 100000,
                             "of a video, every so many frames (25)");
            arguments.option("-o,--out", o->out, "the rig: a .toml file");
            arguments.required("--out");
            return [o](Console& console) { calibrate_rig(*o, console); };
          }};
}

}  // namespace studio
