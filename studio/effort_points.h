// What each setting of effort costs and buys in one set on this machine: written by `chart set`,
// picked from by `run --fps` and `run --error`.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "render/frame_job.h"
#include "studio/chart.h"

namespace studio {

struct EffortPoint {
  render::Effort effort;
  double time_ms = 0;  // from one shown frame to the next, > 0
  double error = 0;    // of the picture, relative RMS
};

// The settings of an effort that a chart varies, by their names in a set file's [effort].
std::vector<std::pair<std::string, ChartValue>> settings_of(const render::Effort& effort);

// Where a set's points are kept: beside it, "car.chart.json" for "car.toml".
std::string effort_points_file(const std::string& set_path);

struct EffortPoints {
  std::vector<EffortPoint> points;  // at least one
  // Why they may not hold for the set any more, and the command that measures it anew; "" = they
  // are of the set as it is.
  std::string doubt;
};

// The points of a set; what they do not name stays as in `base`, the set's own effort. Throws
// std::runtime_error, with the command that makes the file, if it is missing, no chart of a set, or
// measured on another machine, or if the set file cannot be read.
EffortPoints read_effort_points(const std::string& set_path, const render::Effort& base);

// What was asked for, and whether the point does it. If none does: the fastest, or the most
// accurate one.
struct EffortChoice {
  EffortPoint point;
  bool holds = false;
};
EffortChoice most_accurate_at(const std::vector<EffortPoint>& points, double fps);
EffortChoice fastest_within(const std::vector<EffortPoint>& points, double error);

}  // namespace studio
