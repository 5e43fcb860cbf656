// A lens calibration as one HTML file, for people.
#include "studio/calibration_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "studio/chart_axes.h"
#include "studio/svg.h"

namespace studio {
namespace {

using calibrate::LensCalibration;
using calibrate::LensProblem;
using calibrate::Vec2;

constexpr double figure_width = 640;
constexpr double legend_height = 34;

std::string pixels(double px) {
  return std::isfinite(px) ? fmt::format("{:.3f}", px) : std::string("&ndash;");
}

// The picture, drawn to the figures' width.
struct Canvas {
  double scale;
  double height;
  explicit Canvas(const LensProblem& problem)
      : scale(figure_width / problem.width), height(problem.height * scale) {}
};

// Corners, each with a line towards where it was seen from where the lens puts it.
std::string residual_figure(const LensProblem& problem, const LensCalibration& c) {
  const Canvas canvas(problem);
  Svg svg(figure_width, canvas.height + legend_height);
  svg.rectangle(0, 0, figure_width, canvas.height, "#f6f6f4");
  const calibrate::LensSolve& solve = c.solve();
  const auto missed = residuals(solve.bundle, problem.board, c.start.corners);
  // A usual residual is drawn 12 pixels long.
  const double magnified = 12 / std::max(c.train_rms_px * canvas.scale, 1e-3);
  for (std::size_t i = 0; i < missed.size(); ++i) {
    const Vec2 q = c.start.corners[i].q;
    const double x = (q.x + 0.5) * canvas.scale;
    const double y = (q.y + 0.5) * canvas.scale;
    if (solve.used[i] == 0) {
      svg.mark(x, y, Mark::cross, 3, "#c0392b");
    } else if (missed[i]) {
      svg.line(x, y, x + missed[i]->x * canvas.scale * magnified,
               y + missed[i]->y * canvas.scale * magnified, "#1f5fa8", 0.8);
      svg.mark(x, y, Mark::disc, 0.9, "#222222");
    }
  }
  svg.frame(0, 0, figure_width, canvas.height, chart_ink);
  svg.text(0, canvas.height + 22,
           fmt::format("residuals {:.0f} times as long as they are; crosses: left out", magnified));
  return svg.finish();
}

struct Step {
  double most_px;
  std::string_view colour;
};
// From good to bad, also in grey.
constexpr std::array steps{Step{0.1, "#eff6e0"},     Step{0.2, "#cfe8b6"}, Step{0.5, "#93cfa0"},
                           Step{1, "#4fae9b"},       Step{2, "#2b8296"},   Step{5, "#2a5682"},
                           Step{HUGE_VAL, "#2b2a5c"}};
constexpr std::string_view unknown_colour = "#d9d9d9";

std::string error_figure(const LensProblem& problem, const LensCalibration& c) {
  constexpr int columns = 64;
  const Canvas canvas(problem);
  const double cell = figure_width / columns;
  Svg svg(figure_width, canvas.height + legend_height);
  for (double y = 0; y < canvas.height; y += cell) {
    for (int x = 0; x < columns; ++x) {
      const Vec2 q{(x + 0.5) * cell / canvas.scale, (y + 0.5 * cell) / canvas.scale};
      const auto error = c.overlay->at(q);
      std::string_view colour = unknown_colour;
      if (error) {
        colour =
            std::ranges::find_if(steps, [&](const Step& s) { return *error < s.most_px; })->colour;
      }
      svg.rectangle(x * cell, y, cell + 0.3, std::min(cell + 0.3, canvas.height - y), colour);
    }
  }
  svg.frame(0, 0, figure_width, canvas.height, chart_ink);
  double x = 0;
  const auto entry = [&](std::string_view colour, const std::string& name) {
    svg.rectangle(x, canvas.height + 10, 14, 14, colour);
    svg.text(x + 19, canvas.height + 22, name, {.size = 12});
    x += 27 + text_width(name, 12);
  };
  for (const Step& step : steps) {
    entry(step.colour,
          std::isfinite(step.most_px) ? fmt::format("< {}", step.most_px) : std::string("more"));
  }
  entry(unknown_colour, "unknown");
  return svg.finish();
}

std::string candidate_figure(const LensCalibration& c) {
  constexpr double height = 300;
  Svg svg(figure_width, height);
  std::vector<double> errors;
  double most = 0;
  for (const auto& candidate : c.selection.candidates) {
    if (!candidate.solve) continue;
    errors.push_back(candidate.solve->rms_px);
    if (std::isfinite(candidate.heldout_rms_px)) errors.push_back(candidate.heldout_rms_px);
    most = std::max(most, static_cast<double>(candidate.parameters));
  }
  const Axis y = log_axis(errors, height - 46, 12);
  const Axis x{0, most + 1, false, 84, figure_width - 12, false};
  draw_axes(svg, x, y, "free parameters of the lens", "RMS distance, px", 12);
  for (std::size_t i = 0; i < c.selection.candidates.size(); ++i) {
    const auto& candidate = c.selection.candidates[i];
    if (!candidate.solve) continue;
    const double at = x(static_cast<double>(candidate.parameters));
    svg.mark(at, y(candidate.solve->rms_px), Mark::disc, 4, "#888888", false);
    if (!std::isfinite(candidate.heldout_rms_px)) continue;
    const bool chosen = i == c.selection.chosen;
    svg.mark(at, y(candidate.heldout_rms_px), Mark::disc, chosen ? 6 : 4,
             chosen ? "#c0392b" : "#1f5fa8");
  }
  return svg.finish();
}

std::string candidate_table(const LensCalibration& c) {
  std::string rows;
  for (std::size_t i = 0; i < c.selection.candidates.size(); ++i) {
    const auto& candidate = c.selection.candidates[i];
    rows += fmt::format("<tr{}><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.0f}</td></tr>\n",
                        i == c.selection.chosen ? " class=\"chosen\"" : "",
                        escaped(name_of(candidate.form)), candidate.parameters,
                        candidate.solve ? pixels(candidate.solve->rms_px) : "does not fit",
                        pixels(candidate.heldout_rms_px), candidate.time_ms);
  }
  return "<table><tr><th>model</th><th>parameters</th><th>training, px</th><th>held out, px</th>"
         "<th>ms</th></tr>\n" +
         rows + "</table>\n";
}

std::string view_table(const LensCalibration& c) {
  std::string rows;
  for (const calibrate::ViewReport& view : c.views) {
    rows += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                        escaped(view.name), view.seen, view.used,
                        view.used > 0 ? pixels(view.rms_px) : "", escaped(view.rejected));
  }
  return "<table><tr><th>picture</th><th>corners</th><th>in use</th><th>RMS, px</th><th>left out "
         "because it</th></tr>\n" +
         rows + "</table>\n";
}

std::string parameter_list(const LensCalibration& c) {
  std::string list;
  for (const double p : c.lens.parameters)
    list += fmt::format("{}{:.6g}", list.empty() ? "" : ", ", p);
  return list;
}

}  // namespace

std::string calibration_report(const LensProblem& problem,
                               const LensCalibration& c,
                               const std::string& title) {
  std::string warnings;
  for (const std::string& warning : c.warnings) {
    warnings += fmt::format("<li>{}</li>\n", escaped(warning));
  }
  if (!warnings.empty())
    warnings = "<h2>Take care</h2>\n<ul class=\"care\">\n" + warnings + "</ul>\n";
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\n"
      "<style>body{{font:15px/1.45 'DejaVu Sans',sans-serif;color:#222;max-width:46em;"
      "margin:2em auto;padding:0 1em}}table{{border-collapse:collapse;font-size:13px}}"
      "td,th{{padding:.2em .8em .2em 0;text-align:left;border-bottom:1px solid #ddd}}"
      ".chosen td{{font-weight:bold}}.care li{{color:#a02b1f}}svg{{max-width:100%;height:auto}}"
      "</style></head><body>\n<h1>{0}</h1>\n"
      "<p><b>{1}</b>, {2} free parameters ({3}), {4}&times;{5} px. Corners in use miss it by "
      "{6} px RMS, corners that took no part by {7} px; noise {8} px per coordinate. Corners were "
      "seen up to {9:.0f}&deg; off the axis.</p>\n{10}"
      "<h2>Corners and residuals</h2>\n{11}\n"
      "<h2>Predicted error of a virtual object, 95 %, px</h2>\n{12}\n"
      "<h2>Candidates</h2>\n<p>Filled: corners that took no part; rings: training; red: chosen, "
      "the "
      "fewest parameters within the tolerance of the best.</p>\n{13}\n{14}"
      "<h2>Pictures</h2>\n{15}</body></html>\n",
      escaped(title), escaped(name_of(c.form)),
      c.selection.candidates[c.selection.chosen].parameters, parameter_list(c), problem.width,
      problem.height, pixels(c.train_rms_px), pixels(c.heldout_rms_px), pixels(c.sigma_px),
      c.coverage_deg, warnings, residual_figure(problem, c), error_figure(problem, c),
      candidate_figure(c), candidate_table(c), view_table(c));
}

}  // namespace studio
