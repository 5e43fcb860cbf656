// platelight calibrate lines: a fish-eye's lens, from straight lines of the scene.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/angles.h"
#include "calibrate/lens.h"
#include "calibrate/line_fit.h"
#include "studio/commands/commands.h"
#include "studio/json_text.h"
#include "studio/set_files.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

using calibrate::degree;

struct LinesOptions {
  std::string lines;
  std::string out;
  std::string model = "equisolid";
  bool free_centre = false;
  std::optional<double> noise_px;
};

// How the camera is held, by where the set's down is in its frame.
struct Level {
  double roll_deg = 0;  // clockwise, as look_at has it
  double rise_deg = 0;  // of the optical axis above the horizon
};

std::optional<Level> level_of(const calibrate::LineFit& fit) {
  for (const calibrate::ParallelReport& parallel : fit.parallels) {
    if (parallel.name != "vertical") continue;
    const calibrate::Vec3 down = parallel.direction_cam;
    return Level{std::atan2(down.x, down.y) / degree,
                 -std::asin(std::min(std::max(down.z, -1.0), 1.0)) / degree};
  }
  return std::nullopt;
}

Json figures_of(const calibrate::LineMarks& marks, const calibrate::LineFit& fit) {
  const auto& p = fit.lens.parameters;
  Json lines = Json::array();
  for (std::size_t i = 0; i < fit.lines.size(); ++i) {
    const calibrate::LineReport& line = fit.lines[i];
    Json entry{{"name", marks.lines[i].name},
               {"marks", marks.lines[i].pixels.size()},
               {"rms_px", line.rms_px},
               {"worst_px", line.worst_px},
               {"heldout_px", line.heldout_px}};  // NaN becomes null
    if (!marks.lines[i].parallel.empty()) {
      entry["parallel_deg"] = line.parallel_rad / degree;
      entry["heldout_parallel_deg"] = line.heldout_parallel_rad / degree;
    }
    lines.push_back(std::move(entry));
  }
  Json parallels = Json::array();
  for (const calibrate::ParallelReport& parallel : fit.parallels) {
    const calibrate::Vec3 d = parallel.direction_cam;
    parallels.push_back({{"name", parallel.name},
                         {"lines", parallel.lines},
                         {"rms_deg", parallel.rms_rad / degree},
                         {"direction_cam", {d.x, d.y, d.z}}});
  }
  Json rectangles = Json::array();
  for (const calibrate::RectangleReport& rectangle : fit.rectangles) {
    rectangles.push_back({{"name", rectangle.name},
                          {"aspect", rectangle.aspect},
                          {"off_square_deg", rectangle.off_square_rad / degree}});
  }
  Json figures{{"model", fit.lens.model},
               {"focal_px", p[0]},
               {"focal_sigma_px", fit.focal_sigma_px},
               {"centre_px", {p[p.size() - 2], p[p.size() - 1]}},
               {"centre_sigma_px", {fit.centre_sigma_px.x, fit.centre_sigma_px.y}},
               {"rms_px", fit.rms_px},
               {"error_px", fit.lens.error_px},
               {"lines", lines},
               {"parallels", parallels},
               {"rectangles", rectangles}};
  if (fit.other) {
    const auto& q = fit.other->lens.parameters;
    figures["other_law"] = {{"model", fit.other->lens.model},
                            {"focal_px", q[0]},
                            {"rms_px", fit.other->rms_px},
                            {"against", fit.other->against},
                            {"distance_deg", fit.other->distance.angle_rad / degree},
                            {"distance_px", fit.other->distance.axis_px}};
  }
  if (const auto level = level_of(fit)) {
    figures["roll_deg"] = level->roll_deg;
    figures["rise_deg"] = level->rise_deg;
  }
  return figures;
}

void say(const calibrate::LineMarks& marks, const calibrate::LineFit& fit, Console& console) {
  console.say("line                       off, px   worst  held out  from parallel, deg");
  for (std::size_t i = 0; i < fit.lines.size(); ++i) {
    const calibrate::LineReport& line = fit.lines[i];
    const std::string angle =
        marks.lines[i].parallel.empty()
            ? ""
            : fmt::format("{:>8.2f}  {}", line.parallel_rad / degree, marks.lines[i].parallel);
    console.say(fmt::format("{:<25} {:>8.2f} {:>7.2f} {:>9.2f}  {}", marks.lines[i].name,
                            line.rms_px, line.worst_px, line.heldout_px, angle));
  }
  for (const calibrate::ParallelReport& parallel : fit.parallels) {
    if (parallel.lines < 3) continue;  // two planes always meet
    console.say(fmt::format("{}: {} lines agree to {:.2f} degrees", parallel.name, parallel.lines,
                            parallel.rms_rad / degree));
  }
  for (const calibrate::RectangleReport& rectangle : fit.rectangles) {
    console.say(fmt::format("{}: {:.3f} by 1, corners up to {:.1f} degrees off square",
                            rectangle.name, rectangle.aspect, rectangle.off_square_rad / degree));
  }
  if (const auto level = level_of(fit)) {
    console.say(fmt::format(
        "the camera is rolled by {:.2f} degrees and looks {:.2f} degrees {} "
        "the horizon",
        level->roll_deg, std::abs(level->rise_deg), level->rise_deg < 0 ? "below" : "above"));
  }
}

std::string law_of(const calibrate::Lens& lens) {
  return lens.model == "equisolid" ? "equisolid" : "equidistant";
}

// Of the law that the lens is taken to have, where the lines do not bear it out.
std::optional<std::string> doubt_of_law(const calibrate::LineFit& fit) {
  if (!fit.other) return std::nullopt;
  const calibrate::OtherLaw& other = *fit.other;
  const std::string ours = law_of(fit.lens), theirs = law_of(other.lens);
  const std::string apart =
      fmt::format("{:.1f} degrees (RMS) in direction", other.distance.angle_rad / degree);
  if (other.undecided()) {
    return fmt::format(
        "the lines do not tell an {} lens ({:.2f} px off) from an {} one ({:.2f} px), which are {} "
        "apart: the lens's error_px counts that; mark longer lines near the picture's rim, or "
        "calibrate by a board",
        ours, fit.rms_px, theirs, other.rms_px, apart);
  }
  if (other.against > 0) return std::nullopt;
  return fmt::format(
      "an {0} lens explains the lines better ({1:.2f} px off, not {2:.2f}), and is "
      "{3} from this one: is it one? --model {0}",
      theirs, other.rms_px, fit.rms_px, apart);
}

std::vector<std::string> warnings_of(const calibrate::LineMarks& marks,
                                     const calibrate::LineFit& fit,
                                     double noise_px) {
  constexpr double far_above = 5, most_deg = 5;
  std::vector<std::string> warnings;
  if (fit.rms_px > far_above * noise_px) {
    const auto worst = std::ranges::max_element(fit.lines, {}, &calibrate::LineReport::rms_px);
    warnings.push_back(fmt::format(
        "the lines are {:.1f} px off, far above the noise to be expected: are they straight, and "
        "of a picture of this size? farthest off: {}",
        fit.rms_px, marks.lines[static_cast<std::size_t>(worst - fit.lines.begin())].name));
  }
  for (const calibrate::ParallelReport& parallel : fit.parallels) {
    if (parallel.lines < 3 || parallel.rms_rad < most_deg * degree) continue;
    warnings.push_back(
        fmt::format("lines of \"{}\" are {:.0f} degrees (RMS) from parallel: does "
                    "one of them belong elsewhere?",
                    parallel.name, parallel.rms_rad / degree));
  }
  if (auto doubt = doubt_of_law(fit)) warnings.push_back(std::move(*doubt));
  return warnings;
}

void calibrate_lines(const LinesOptions& options, Console& console) {
  const ReadFile lines{"the lines", options.lines};
  spare_files(std::span(&lines, 1), options.out);
  const calibrate::LineMarks marks = calibrate::read_line_marks(options.lines);
  calibrate::LineFitOptions fitting;
  fitting.law = options.model == "equisolid" ? calibrate::FisheyeLaw::equisolid
                                             : calibrate::FisheyeLaw::equidistant;
  fitting.free_centre = options.free_centre;
  fitting.noise_px = options.noise_px.value_or(fitting.noise_px);
  const calibrate::LineFit fit = [&] {
    try {
      return calibrate::fit_lens_to_lines(marks, fitting);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: {}", options.lines, error.what()));
    }
  }();
  calibrate::write_lens(options.out, fit.lens);
  say(marks, fit, console);
  const std::vector<std::string> warnings = warnings_of(marks, fit, fitting.noise_px);
  Json figures = figures_of(marks, fit);
  figures["warnings"] = warnings;
  console.figures(json_text(figures));
  for (const std::string& warning : warnings) console.warn(warning);
  console.say(fmt::format("{}: {}, f = {:.1f} +- {:.1f} px, from {} lines, {:.2f} px off",
                          options.out, options.model, fit.lens.parameters[0], fit.focal_sigma_px,
                          marks.lines.size(), fit.rms_px));
  if (fit.other) {
    console.say(fmt::format("the other law: {}, f = {:.1f} px, {:.2f} px off, {:.2f} degrees apart",
                            law_of(fit.other->lens), fit.other->lens.parameters[0],
                            fit.other->rms_px, fit.other->distance.angle_rad / degree));
  }
}

}  // namespace

Command calibrate_lines_command() {
  return {"calibrate lines", "Find a fish-eye's lens from straight lines of the scene",
          "platelight calibrate lines lines.toml -o lens.toml",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<LinesOptions>();
            arguments.positional("LINES", o->lines, ".toml file of lines and their pixels");
            arguments.option("-o,--out", o->out, "the lens: a .toml file");
            arguments.required("--out");
            arguments.option("--model", o->model,
                             "equisolid or equidistant; equisolid if not said");
            arguments.flag("--free-centre", o->free_centre,
                           "also find where the axis meets the picture; needs lines all around");
            arguments.option("--noise", o->noise_px, 1e-3, 100,
                             "expected error of a mark across its line, px; 0.5 if not said");
            return [o](Console& console) {
              if (o->model != "equisolid" && o->model != "equidistant") {
                throw UsageError("--model is equisolid or equidistant, not " + o->model);
              }
              if (!o->out.ends_with(".toml")) throw UsageError("--out must end in .toml");
              calibrate_lines(*o, console);
            };
          }};
}

}  // namespace studio
