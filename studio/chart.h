// Charts of error against time: what each setting of a stage costs, and what it buys.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace studio {

using ChartValue = std::variant<bool, double, std::string>;

// One measured setting of one method.
struct ChartPoint {
  std::string scene;    // what it was measured on; those of different scenes do not compete. "" =
                        // there is one scene
  std::string method;   // "split", "median cut": one colour and one legend line each
  std::string variant;  // of the method: "adaptive grid": one mark each; "" = there are none
  bool peer = false;    // another tool's
  std::vector<std::pair<std::string, ChartValue>> settings;  // in the order to show
  double time_ms = 0;                                        // > 0
  double error = 0;                 // as the chart's `error_name` says; >= 0
  std::optional<double> error_p99;  // the error that 99 % stay below; none = not measured
  std::vector<std::pair<std::string, double>> figures;  // what else was measured: flicker, memory
  std::string label;        // a few characters beside the mark: "N 64"; "" = none
  bool by_default = false;  // what the program does if it is told nothing else
  bool on_front = false;    // mark_front() sets it
};

struct StressorSample {
  double value = 0;
  double error = 0;
  std::optional<double> reported_error;  // what the method expected of itself
  std::string status;                    // "ok", "refused", "failed"
  std::string label{};                   // a few characters beside the mark; "" = none
  std::vector<std::pair<std::string, double>> figures{};  // what else was measured
};

// Error while one circumstance gets worse and worse.
struct Stressor {
  std::string stressor;  // "angular radius of the sun"
  std::string unit;      // "degrees"; "" = none
  bool logarithmic = true;
  std::vector<StressorSample> samples;  // by rising value
  // Error that is left whatever the samples do, with its name; 0 = none is known.
  double floor = 0;
  std::string floor_name{};
  std::string error_name{};  // of its axis, "" = the chart's
  std::string own_name{};    // of its line, "" = "error"
  // Figures of the samples that are drawn as lines too, each with a name.
  std::vector<std::pair<std::string, std::string>> beside{};
};

// Other figures of the points against their time, each with a word on it. "error", "error_p99", or
// a name among ChartPoint::figures; points without it are left out.
struct FigurePanel {
  std::string name;  // of the axis
  std::vector<std::pair<std::string, std::string>> figures;
  // Against another figure than time, and its axis's name.
  std::string across{};
  std::string across_name{};
  std::string scene{};  // of this one's points alone; "" = of all
};

// What an error is made of: it falls from step to step as one thing after the other is made true.
struct ErrorStep {
  std::string name;  // "light"
  double error = 0;  // after the step
  double standard_error = 0;
};
struct ErrorSteps {
  std::string title;
  std::vector<ErrorStep> steps;
};

struct Chart {
  std::string stage;  // file name: "lights"
  std::string title;
  std::string subtitle;                          // scene, size, threads
  std::string time_name = "time per frame, ms";  // of the axes
  std::string error_name = "relative RMS error";
  bool relative = true;                       // errors are shares, written in percent
  std::string stressed_error_name = "error";  // of the stressors' axes
  std::string variant_name;                   // what variants differ in
  std::string set_digest{};  // of the set file that was measured (set_digest.h); "" = none was
  std::vector<ChartPoint> points;
  std::vector<FigurePanel> panels;
  std::vector<Stressor> stressors;
  std::vector<ErrorSteps> steps;
};

// Marks the points of our own that no other of our own on the same scene beats in both time and
// error.
void mark_front(Chart& chart);

// The chart as scripts read it, with the machine that measured it: design's `chart STAGE --json`.
std::string chart_json(const Chart& chart);
// One row a point: its scene, if there are several, method, peer, every setting and figure that any
// point has, time, errors, front.
std::string chart_csv(const Chart& chart);
// The picture: error against time on logarithmic axes, for each scene, then a smaller one for each
// figure, split into steps and stressor. The same chart always gives the same text.
std::string chart_svg(const Chart& chart);

// Writes STAGE.json, .csv, .svg and .png into a directory, which is made if need be. Throws
// std::invalid_argument if a time is not > 0 or a value is not finite; std::runtime_error naming
// the file that cannot be written.
void write_chart(const Chart& chart, const std::string& directory);

}  // namespace studio
