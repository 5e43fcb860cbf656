// The chart of lens calibration.
#include "studio/charts/lens.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "calibrate/lens_calibration.h"
#include "calibrate/made_boards.h"
#include "calibrate/rotation_fit.h"
#include "studio/charts/lens_peers.h"

namespace studio {
namespace {

using calibrate::LensCalibration;
using calibrate::LensForm;
using calibrate::LensProblem;
using calibrate::MadeBoards;
using calibrate::MadeLens;
using calibrate::Vec2;
using calibrate::Vec3;

double now_ms() {
  return std::chrono::duration<double, std::milli>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

// A made camera and its boards, in as many throws of the noise as the error is averaged over.
struct Camera {
  std::string name;
  MadeLens truth;
  MadeBoards boards;
  double max_deg;
  std::vector<LensProblem> problems;
};

Camera make_camera(
    std::string name, const MadeLens& truth, MadeBoards boards, double max_deg, unsigned throws) {
  Camera camera{std::move(name), truth, boards, max_deg, {}};
  for (unsigned seed = 1; seed <= throws; ++seed) {
    boards.seed = seed;
    camera.problems.push_back(make_board_views(truth, boards));
  }
  return camera;
}

// True and predicted error over the pixels where the error is known: 95th percentiles, in pixels.
struct Overlay {
  double error_px = 0;
  double predicted_px = 0;
};

std::optional<Overlay> overlay_of(const MadeLens& truth, const LensCalibration& c) {
  std::vector<Vec2> pixels;
  std::vector<Vec3> expected, found;
  std::vector<double> predicted, errors;
  for (int y = 8; y < truth.lens.height; y += 16) {
    for (int x = 8; x < truth.lens.width; x += 16) {
      const Vec2 q{static_cast<double>(x), static_cast<double>(y)};
      const auto error = c.overlay->at(q);
      const auto v = truth.unproject(q);
      const auto w = unproject(c.lens, q);
      if (!error || !v || !w) continue;
      pixels.push_back(q);
      expected.push_back(*v);
      found.push_back(*w);
      predicted.push_back(*error);
    }
  }
  if (pixels.empty()) return std::nullopt;
  const calibrate::Mat3 turn = calibrate::best_rotation(expected, found);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto there = project(c.lens, turn * expected[i]);
    errors.push_back(there ? calibrate::hypotenuse(there->x - pixels[i].x, there->y - pixels[i].y)
                           : 1000);
  }
  const auto percentile = [](std::vector<double>& values) {
    std::ranges::sort(values);
    return values[values.size() * 95 / 100];
  };
  return Overlay{std::min(percentile(errors), 1000.0), std::min(percentile(predicted), 1000.0)};
}

class LensChart {
 public:
  LensChart(const ChartRequest& request, Console& console)
      : quick_(request.quick), console_(console) {
    const unsigned throws = quick_ ? 1 : 8;
    MadeBoards boards;
    if (quick_) boards.views = 10;
    // Not quite of any form: decentred, not quite square, with a ripple of a quarter of a pixel.
    fisheye_ = make_camera("fish-eye", calibrate::made_fisheye(0.0008), boards, 89, throws);
    MadeBoards normal = calibrate::normal_boards();
    if (quick_) normal.views = 10;
    normal_ = make_camera("normal", calibrate::made_normal(), normal, 28, throws);
  }

  Chart measure() {
    Chart chart;
    chart.stage = "lens";
    chart.title = "Lens calibration: error against time";
    chart.subtitle = fmt::format(
        "{} made pictures of 10x10 corners, noise 0.3 px, {} times; fish-eye of 180 degrees, "
        "normal "
        "lens of 60; labels: free parameters",
        fisheye_.problems[0].views.size(), fisheye_.problems.size());
    chart.time_name = "time of a solve, ms";
    chart.error_name = "RMS ray error, mrad";
    chart.relative = false;
    chart.stressed_error_name = "95 % overlay error, px";
    chart.variant_name = "form";
    add_forms(chart, fisheye_, calibrate::angular_forms());
    std::vector<LensForm> forms = calibrate::perspective_forms();
    const std::vector<LensForm> more = calibrate::angular_forms();
    forms.insert(forms.end(), more.begin(), more.end());
    add_forms(chart, normal_, forms);
    add_selection(chart, fisheye_);
    add_selection(chart, normal_);
    using enum LensPeer;
    for (const LensPeer peer : {opencv_fisheye, opencv_omnidir, mrcal_splined}) {
      if (!quick_ || peer == opencv_fisheye) add_peer(chart, fisheye_, peer);
    }
    for (const LensPeer peer : {opencv_camera5, opencv_camera8, mrcal_opencv5}) {
      if (!quick_ || peer == opencv_camera5) add_peer(chart, normal_, peer);
    }
    chart.panels.push_back(
        {"RMS ray error, mrad", {{"error", ""}}, "parameters", "free parameters"});
    chart.panels.push_back(
        {"largest of the throws' errors, mrad", {{"largest_error", ""}}, "", ""});
    add_stressors(chart);
    return chart;
  }

 private:
  // Sums over the throws of one point.
  struct Throws {
    double squares = 0, largest = 0, least_ms = HUGE_VAL;
    std::size_t count = 0;
    void add(double error_mrad, double time_ms) {
      squares += error_mrad * error_mrad;
      largest = std::max(largest, error_mrad);
      least_ms = std::min(least_ms, time_ms);
      ++count;
    }
    bool finite() const { return count > 0 && std::isfinite(squares); }
  };

  void finish(Chart& chart, ChartPoint point, const Throws& throws) {
    // What is farther off than the whole picture tells nothing.
    constexpr double worthless_mrad = 1000;
    if (!throws.finite() || throws.largest > worthless_mrad) return;
    point.error = std::sqrt(throws.squares / static_cast<double>(throws.count));
    point.figures.emplace_back("largest_error", throws.largest);
    point.time_ms = throws.least_ms;
    point.settings.emplace_back("throws", static_cast<double>(throws.count));
    chart.points.push_back(std::move(point));
  }

  // One solve of one form, from the corners on, of a flat board.
  void add_forms(Chart& chart, const Camera& camera, const std::vector<LensForm>& forms) {
    for (const LensForm& form : forms) {
      if (quick_ && form.terms % 2 == 1) continue;
      console_.progress(0.1, name_of(form));
      Throws throws;
      for (const LensProblem& problem : camera.problems) {
        const double begin = now_ms();
        const calibrate::LensStart start = calibrate::start_lens(problem, one_parameter_form(form));
        const auto solve = calibrate::solve_lens(problem, form, start, {.warp = false});
        if (!solve) continue;
        const double taken_ms = now_ms() - begin;
        throws.add(ray_error_mrad(camera.truth, solve->lens, camera.max_deg), taken_ms);
      }
      ChartPoint point;
      point.method =
          fmt::format("{}: {}", camera.name,
                      form.model.starts_with("LENSMODEL") ? "mrcal's models" : "Kannala-Brandt");
      point.variant = form.model.starts_with("decentred") ? "decentred" : "as it is";
      if (!form.one_focal) point.variant += ", fx fy";
      const std::size_t parameters = free_count(form);
      point.settings = {{"model", name_of(form)}, {"parameters", static_cast<double>(parameters)}};
      point.figures.emplace_back("parameters", static_cast<double>(parameters));
      point.label = std::to_string(parameters);
      finish(chart, std::move(point), throws);
    }
  }

  // The whole way: robust start, board's shape, choice of the form, uncertainty.
  void add_selection(Chart& chart, const Camera& camera) {
    Throws throws;
    for (const LensProblem& problem : camera.problems) {
      console_.progress(0.3, "selection");
      const double begin = now_ms();
      const LensCalibration c = calibrate::calibrate_lens(problem);
      const double taken_ms = now_ms() - begin;
      throws.add(ray_error_mrad(camera.truth, c.lens, camera.max_deg), taken_ms);
    }
    ChartPoint point;
    point.method = camera.name + ": selection";
    point.variant = "chosen";
    point.settings = {{"model", "chosen"}};
    point.by_default = true;
    point.label = "default";
    finish(chart, std::move(point), throws);
  }

  void add_peer(Chart& chart, const Camera& camera, LensPeer peer) {
    Throws throws;
    std::size_t parameters = 0;
    std::size_t refused = 0;
    for (const LensProblem& problem : camera.problems) {
      console_.progress(0.5, name_of(peer));
      // Minutes of one tool would tell nothing more.
      if (throws.count > 1 && throws.least_ms > 5000) break;
      const LensPeerResult result = calibrate_with(peer, problem);
      if (result.status != "ok") {
        ++refused;
        console_.say(fmt::format("{}: {}", name_of(peer), result.status));
        continue;
      }
      parameters = result.parameters;
      throws.add(calibrate::ray_error_mrad(camera.truth, result.unproject, camera.max_deg),
                 result.time_ms);
    }
    ChartPoint point;
    point.method = fmt::format("{}: {}", camera.name, name_of(peer));
    point.peer = true;
    point.settings = {{"parameters", static_cast<double>(parameters)},
                      {"refused", static_cast<double>(refused)}};
    point.figures.emplace_back("parameters", static_cast<double>(parameters));
    point.label = std::to_string(parameters);
    finish(chart, std::move(point), throws);
  }

  StressorSample sample(double value, const MadeLens& truth, const LensProblem& problem) {
    StressorSample result;
    result.value = value;
    try {
      const LensCalibration c = calibrate::calibrate_lens(problem);
      const auto overlay = overlay_of(truth, c);
      result.status = c.warnings.empty() ? "ok" : c.warnings.front();
      if (overlay) {
        result.error = overlay->error_px;
        result.reported_error = overlay->predicted_px;
      }
    } catch (const std::runtime_error& error) {
      result.status = std::string("refused: ") + error.what();
    }
    return result;
  }

  // Errors over a few throws of the noise: their root mean squares; the first one's status.
  StressorSample stressed(double value,
                          MadeBoards boards,
                          const std::function<void(LensProblem&, unsigned)>& change = {}) {
    const MadeLens truth = calibrate::made_fisheye();
    const unsigned throws = quick_ ? 1 : 4;
    StressorSample all;
    double error = 0;
    double reported = 0;
    for (unsigned seed = 1; seed <= throws; ++seed) {
      boards.seed = seed;
      LensProblem problem = make_board_views(truth, boards);
      if (change) change(problem, seed);
      const StressorSample one = sample(value, truth, problem);
      if (seed == 1) all = one;
      if (all.status == "ok") all.status = one.status;
      error += one.error * one.error / throws;
      if (one.reported_error) reported += *one.reported_error * *one.reported_error / throws;
    }
    all.error = std::sqrt(error);
    if (reported > 0) all.reported_error = std::sqrt(reported);
    return all;
  }

  template <class Change>
  void sweep(Chart& chart,
             const std::string& name,
             const std::string& unit,
             bool logarithmic,
             std::vector<double> values,
             Change change) {
    console_.progress(0.7, name);
    if (quick_) values = {values.front(), values.back()};
    Stressor stressor{name, unit, logarithmic, {}};
    for (const double value : values) {
      MadeBoards boards;
      boards.views = quick_ ? 8 : 15;
      change(boards, value);
      stressor.samples.push_back(stressed(value, boards));
    }
    chart.stressors.push_back(std::move(stressor));
  }

  void add_stressors(Chart& chart) {
    sweep(chart, "noise of corners", "px", true, {0.03, 0.1, 0.3, 1, 3},
          [](MadeBoards& b, double v) { b.noise_px = v; });
    sweep(chart, "share of wrong corners", "", false, {0, 0.05, 0.15, 0.3, 0.5, 0.7},
          [](MadeBoards& b, double v) { b.outliers = v; });
    sweep(chart, "pictures", "", true, {2, 3, 5, 8, 15, 30},
          [](MadeBoards& b, double v) { b.views = static_cast<std::size_t>(v); });
    sweep(chart, "bend of the board", "mm", false, {0, 1, 2, 5, 10}, [](MadeBoards& b, double v) {
      b.warp_m = {v / 1000, 0};
    });
    sweep(chart, "boards' middles up to, off the axis", "degrees", false, {5, 15, 30, 50, 78},
          [](MadeBoards& b, double v) { b.centre_deg = v; });
    sweep(chart, "boards' tilt up to", "degrees", false, {0, 5, 10, 20, 40},
          [](MadeBoards& b, double v) { b.tilt_deg = v; });
    add_rolling_shutter(chart);
  }

  // The board moves while rows are exposed one after the other.
  void add_rolling_shutter(Chart& chart) {
    Stressor stressor{"movement during a rolling shutter", "px", true, {}};
    const std::vector<double> values =
        quick_ ? std::vector<double>{0.1, 10} : std::vector<double>{0.1, 0.3, 1, 3, 10};
    for (const double value : values) {
      MadeBoards boards;
      boards.views = quick_ ? 8 : 15;
      stressor.samples.push_back(
          stressed(value, boards, [value](LensProblem& problem, unsigned seed) {
            std::mt19937 random(seed);
            std::uniform_real_distribution<double> way(0, 2 * std::numbers::pi);
            for (calibrate::BoardView& view : problem.views) {
              const double a = way(random);
              for (auto& q : view.corners) {
                if (!q) continue;
                const double late = q->y / problem.height - 0.5;
                q = Vec2{q->x + value * std::cos(a) * late, q->y + value * std::sin(a) * late};
              }
            }
          }));
    }
    chart.stressors.push_back(std::move(stressor));
  }

  bool quick_;
  Console& console_;
  Camera fisheye_, normal_;
};

}  // namespace

ChartStage lens_chart() {
  return {"lens", "lens calibration: every form, OpenCV's and mrcal's solvers",
          [](const ChartRequest& request, Console& console) {
            return LensChart(request, console).measure();
          }};
}

}  // namespace studio
