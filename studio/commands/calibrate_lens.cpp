// platelight calibrate lens: a camera's lens, from pictures of a board.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/board_detector.h"
#include "calibrate/corner_refinement.h"
#include "calibrate/lens_calibration.h"
#include "calibrate/text_file.h"
#include "capture/camera.h"
#include "capture/parallel_loop.h"
#include "studio/calibration_report.h"
#include "studio/commands/board_options.h"
#include "studio/commands/board_places.h"
#include "studio/commands/commands.h"
#include "studio/commands/pose_report.h"
#include "studio/json_text.h"
#include "studio/set_files.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;
using calibrate::LensCalibration;
using calibrate::LensCalibrationOptions;

struct LensOptions {
  std::vector<std::string> images;
  BoardOptions board;
  std::string out;
  std::string report;
  std::string model = "auto";
  std::optional<std::int64_t> every;
  std::optional<double> limit_s;
  bool fisheye = false;
};

struct Picture {
  std::string name;
  calibrate::GreyPicture grey;
};

// A video gives every so many frames, a picture itself.
std::vector<Picture> read_pictures(const LensOptions& options, Console& console) {
  constexpr std::size_t most_pictures = 500;
  constexpr std::int64_t few = 50;  // a folder of single pictures, rather than a video
  std::vector<Picture> pictures;
  for (std::size_t i = 0; i < options.images.size(); ++i) {
    const std::string& source = options.images[i];
    console.progress(static_cast<double>(i) / static_cast<double>(options.images.size()),
                     "reading");
    const auto camera = open_recorded(source);
    const std::int64_t frames = camera->info().frames;
    const std::int64_t every = options.every.value_or(frames > 0 && frames <= few ? 1 : 25);
    std::int64_t frame_number = 0;
    while (const auto frame = camera->next()) {
      if (frame->image != nullptr && frame_number % every == 0) {
        if (pictures.size() == most_pictures) {
          throw std::runtime_error(fmt::format("{}: more than {} pictures; take fewer with --every",
                                               source, most_pictures));
        }
        pictures.push_back(
            {frame_number == 0 ? source : fmt::format("{} frame {}", source, frame_number),
             calibrate::grey_picture(*frame->image)});
      }
      ++frame_number;
    }
  }
  if (pictures.empty()) throw std::runtime_error("there is no picture to look for a board in");
  for (const Picture& picture : pictures) {
    if (picture.grey.width != pictures[0].grey.width ||
        picture.grey.height != pictures[0].grey.height) {
      throw std::runtime_error(
          fmt::format("{} is {}x{}, but {} is {}x{}: a lens is calibrated for pictures of one size",
                      picture.name, picture.grey.width, picture.grey.height, pictures[0].name,
                      pictures[0].grey.width, pictures[0].grey.height));
    }
  }
  return pictures;
}

// What the finders said of each picture.
struct Found {
  std::vector<calibrate::BoardDetection> detections;
  std::size_t count() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        detections, [](const calibrate::BoardDetection& d) { return d.view.has_value(); }));
  }
};

calibrate::DetectionOptions detection_options(const LensOptions& options) {
  calibrate::DetectionOptions detection;
  if (options.limit_s) {
    detection.time_limit = std::chrono::milliseconds(static_cast<int>(*options.limit_s * 1000));
  }
  detection.fisheye = options.fisheye;
  return detection;
}

// Looks in those pictures that have no board yet.
void find_boards(const std::vector<Picture>& pictures,
                 const calibrate::Board& board,
                 const calibrate::DetectionOptions& options,
                 Found& found,
                 Console& console) {
  found.detections.resize(pictures.size());
  std::atomic<std::size_t> done = 0;
  std::mutex speaking;
  capture::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t i) {
    if (!found.detections[i].view) {
      found.detections[i] = calibrate::detect_board(pictures[i].grey, board, options);
    }
    const std::lock_guard lock(speaking);
    console.progress(static_cast<double>(++done) / static_cast<double>(pictures.size()),
                     "looking for the board");
  });
}

calibrate::LensProblem problem_of(const std::vector<Picture>& pictures,
                                  const calibrate::Board& board,
                                  const Found& found) {
  calibrate::LensProblem problem{board, pictures[0].grey.width, pictures[0].grey.height, {}};
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (!found.detections[i].view) continue;
    problem.views.push_back(*found.detections[i].view);
    problem.views.back().name = pictures[i].name;
  }
  return problem;
}

struct Result {
  calibrate::LensProblem problem;
  LensCalibration calibration;
};

// Once more with what the first lens tells: boards that are too bent for the finders without it,
// and corners refined in the plane across their rays.
Result calibrate_again(const std::vector<Picture>& pictures,
                       const calibrate::Board& board,
                       const LensOptions& options,
                       const LensCalibrationOptions& models,
                       Found& found,
                       Result first,
                       Console& console) {
  calibrate::DetectionOptions detection = detection_options(options);
  detection.lens = first.calibration.lens;
  Found again = found;
  find_boards(pictures, board, detection, again, console);
  capture::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t i) {
    auto& view = again.detections[i].view;
    if (!view) return;
    auto refined =
        calibrate::refine_corners(pictures[i].grey, *view, board, first.calibration.lens);
    if (calibrate::count_corners(refined) > calibrate::count_corners(*view) / 2) view = refined;
  });
  Result second{problem_of(pictures, board, again), {}};
  second.calibration = calibrate::calibrate_lens(second.problem, models);
  const bool better = again.count() > found.count() ||
                      second.calibration.sigma_px <= 1.02 * first.calibration.sigma_px;
  if (!better) return first;
  found = std::move(again);
  return second;
}

Json candidates_json(const LensCalibration& c) {
  Json list = Json::array();
  for (const auto& candidate : c.selection.candidates) {
    Json entry{{"model", name_of(candidate.form)}, {"parameters", candidate.parameters}};
    // Infinite and missing numbers become null.
    entry["train_rms_px"] = candidate.solve ? Json(candidate.solve->rms_px) : Json();
    entry["heldout_rms_px"] = candidate.heldout_rms_px;
    entry["time_ms"] = candidate.time_ms;
    list.push_back(std::move(entry));
  }
  return list;
}

Json figures_of(const Result& result,
                const std::vector<Picture>& pictures,
                const Found& found,
                double detection_ms) {
  const LensCalibration& c = result.calibration;
  Json views = Json::array();
  for (std::size_t i = 0; i < c.views.size(); ++i) {
    const calibrate::ViewReport& view = c.views[i];
    const auto& focal = c.focal.views[i];
    views.push_back({{"name", view.name},
                     {"corners", view.seen},
                     {"used", view.used},
                     {"rms_px", view.rms_px},
                     {"focal_factor", focal ? Json(focal->factor) : Json()},
                     {"rejected", view.rejected}});
  }
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (found.detections[i].view) continue;
    views.push_back({{"name", pictures[i].name},
                     {"corners", 0},
                     {"used", 0},
                     {"rms_px", nullptr},
                     {"focal_factor", nullptr},
                     {"rejected", found.detections[i].reason}});
  }
  return {{"model", c.lens.model},
          {"parameters", c.selection.candidates[c.selection.chosen].parameters},
          {"train_rms_px", c.train_rms_px},
          {"heldout_rms_px", c.heldout_rms_px},
          {"sigma_px", c.sigma_px},
          {"board_warp_mm", {1000 * c.warp_m.x, 1000 * c.warp_m.y}},
          {"focal_agreement", c.focal.chi_squared ? Json(*c.focal.chi_squared) : Json()},
          {"error_factor", c.focal.error_factor()},
          {"places", c.places},
          {"twin_factor", c.twin_factor},
          {"candidates", candidates_json(c)},
          {"coverage_deg", c.coverage_deg},
          {"views", views},
          {"warnings", c.warnings},
          {"detection_ms", detection_ms},
          {"time_ms", c.time_ms}};
}

void say(const LensCalibration& c, Console& console) {
  console.say("model                                parameters  training   held out       ms");
  for (std::size_t i = 0; i < c.selection.candidates.size(); ++i) {
    const auto& candidate = c.selection.candidates[i];
    const std::string mark = i == c.selection.chosen ? " *" : "";
    if (!candidate.solve) {
      console.say(fmt::format("{:<36} {:>10}  does not fit", name_of(candidate.form),
                              candidate.parameters));
      continue;
    }
    console.say(fmt::format("{:<36} {:>10} {:>7.3f} px {:>7.3f} px {:>8.0f}{}",
                            name_of(candidate.form), candidate.parameters, candidate.solve->rms_px,
                            candidate.heldout_rms_px, candidate.time_ms, mark));
  }
  // What the predicted error is over the picture, where it is known.
  std::vector<double> errors;
  constexpr int across = 40;
  for (int y = 0; y < across; ++y) {
    for (int x = 0; x < across; ++x) {
      const auto error =
          c.overlay->at({(x + 0.5) * c.lens.width / across, (y + 0.5) * c.lens.height / across});
      if (error) errors.push_back(*error);
    }
  }
  std::ranges::sort(errors);
  if (errors.empty()) return;
  console.say(fmt::format(
      "a virtual object is off by less than {:.2f} px (95 %) in half, {:.2f} px in nearly all of "
      "the {:.0f} % of the picture where corners were seen, up to {:.0f} degrees off the axis",
      errors[errors.size() / 2], errors[errors.size() * 95 / 100],
      100.0 * static_cast<double>(errors.size()) / (across * across), c.coverage_deg));
}

bool is_of_opencv(const std::string& file) {
  return file.ends_with(".yml") || file.ends_with(".yaml") || file.ends_with(".xml");
}

// mrcal's files, and OpenCV's.
bool fits_perspective_only(const std::string& file) {
  return file.ends_with(".cameramodel") || is_of_opencv(file);
}

LensCalibrationOptions models_of(const LensOptions& options) {
  using Models = LensCalibrationOptions::Models;
  LensCalibrationOptions models;
  models.splines = !is_of_opencv(options.out);
  if (options.model == "auto") {
    models.models = fits_perspective_only(options.out) ? Models::perspective : Models::any;
  } else if (options.model == "perspective") {
    models.models = Models::perspective;
  } else if (options.model == "fisheye") {
    models.models = Models::angular;
    if (fits_perspective_only(options.out)) {
      throw UsageError("the fish-eyes to choose from fit into a .toml file only: let -o name one");
    }
  } else if (options.model.starts_with("LENSMODEL_")) {
    models.form = calibrate::LensForm{options.model, 0, false};
    try {
      free_count(*models.form);
    } catch (const std::invalid_argument& error) {
      throw UsageError(error.what());
    }
    if (is_of_opencv(options.out) && options.model != "LENSMODEL_PINHOLE" &&
        !options.model.starts_with("LENSMODEL_OPENCV")) {
      throw UsageError(
          fmt::format("OpenCV has no model for a lens of {}: let -o name a .cameramodel or .toml",
                      options.model));
    }
  } else {
    throw UsageError("--model is auto, perspective, fisheye or one of mrcal's LENSMODEL_...");
  }
  return models;
}

void calibrate_lens(const LensOptions& options, Console& console) {
  if (!options.out.ends_with(".toml") && !fits_perspective_only(options.out)) {
    throw UsageError("-o must name a .toml, a .cameramodel, or OpenCV's .yml, .yaml or .xml file");
  }
  const calibrate::Board board = board_of(options.board);
  LensOptions adjusted = options;
  adjusted.fisheye = options.model == "fisheye";
  const LensCalibrationOptions models = models_of(options);
  // Before all the work.
  const std::string report =
      options.report.empty()
          ? std::filesystem::path(options.out).replace_extension("report.html").string()
          : options.report;
  if (!report.ends_with(".html")) throw UsageError("--report names a .html file");
  std::vector<ReadFile> read;
  for (const std::string& image : options.images) {
    std::vector<ReadFile> files = files_of(image, "one of the pictures");
    files.push_back({"one of the pictures", image});
    read.insert(read.end(), files.begin(), files.end());
  }
  for (const std::string& file : {options.out, report}) {
    check_directory_of(file);
    spare_files(read, file);
  }
  const std::vector<Picture> pictures = read_pictures(options, console);

  const auto begin = std::chrono::steady_clock::now();
  Found found;
  find_boards(pictures, board, detection_options(adjusted), found, console);
  if (found.count() == 0) {
    throw std::runtime_error(fmt::format("no board in any of {} pictures; {}: {}", pictures.size(),
                                         pictures[0].name, found.detections[0].reason));
  }
  Result result{problem_of(pictures, board, found), {}};
  result.calibration = calibrate::calibrate_lens(result.problem, models);
  result = calibrate_again(pictures, board, adjusted, models, found, std::move(result), console);
  const double whole_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();

  const LensCalibration& c = result.calibration;
  calibrate::write_lens(options.out, c.lens);
  calibrate::write_text_file(
      report, calibration_report(result.problem, c,
                                 "Lens of " + std::filesystem::path(options.out).stem().string()));
  console.figures(json_text(figures_of(result, pictures, found, whole_ms - c.time_ms)));
  say(c, console);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (found.detections[i].view) continue;
    console.warn(fmt::format("{}: {}", pictures[i].name, found.detections[i].reason));
  }
  for (const std::string& warning : c.warnings) console.warn(warning);
  console.say(fmt::format("{}: {} from {} of {} pictures; see {}", options.out, name_of(c.form),
                          found.count(), pictures.size(), report));
}

}  // namespace

Command calibrate_lens_command() {
  return {"calibrate lens", "Find a camera's lens from pictures of a board",
          "platelight calibrate lens boards/*.png --board 9x6 --square 0.025 -o cam.cameramodel",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<LensOptions>();
            arguments.positionals("IMAGES", o->images, "pictures, or videos of a moving board");
            declare(arguments, o->board);
            arguments.option("-o,--out", o->out,
                             ".cameramodel or OpenCV's .yml; .toml for any lens");
            arguments.required("--out");
            arguments.option("--report", o->report, "HTML file; else beside the lens");
            arguments.option("--model", o->model,
                             "auto, perspective, fisheye, or one of mrcal's LENSMODEL_...");
            arguments.option("--every", o->every, 1, 100000,
                             "frames of a video; one in 25, or each of up to 50");
            arguments.option("--limit", o->limit_s, 0.1, 600, "seconds to look at each picture; 5");
            return [o](Console& console) { calibrate_lens(*o, console); };
          }};
}

}  // namespace studio
