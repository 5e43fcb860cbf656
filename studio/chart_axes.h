// Axes of charts.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "studio/svg.h"

namespace studio {

inline constexpr std::string_view chart_ink = "#222222";
inline constexpr std::string_view faint_chart_ink = "#666666";

// One axis: values to pixels.
struct Axis {
  double low = 0, high = 1;  // of values
  bool logarithmic = true;
  double from = 0, to = 1;  // pixels of low and high
  bool percent = false;     // how its numbers are written

  double operator()(double value) const {
    const double share =
        logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return from + std::clamp(share, 0.0, 1.0) * (to - from);
  }
};

// A logarithmic one that holds all values above 0 with some air; whole decades are not needed.
Axis log_axis(const std::vector<double>& values, double from, double to);
// The same of relative errors, in percent.
Axis error_axis(const std::vector<double>& errors, double from, double to);

// Grid, frame, ticks with their numbers, and names.
void draw_axes(Svg& svg,
               const Axis& x,
               const Axis& y,
               const std::string& x_name,
               const std::string& y_name,
               double text_size);

}  // namespace studio
