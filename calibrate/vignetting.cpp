// How much a lens dims towards its rim.
#include "calibrate/vignetting.h"

#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace calibrate {

double sensitivity(std::span<const double> vignetting, double angle_rad) {
  const double squared = angle_rad * angle_rad;
  double sum = 0;
  for (std::size_t i = vignetting.size(); i > 0; --i) sum = (sum + vignetting[i - 1]) * squared;
  return 1 + sum;
}

void add_vignetting(std::span<const double> vignetting, DirectionTable& table) {
  table.sensitivity.clear();
  if (vignetting.empty()) return;
  table.sensitivity.reserve(table.z.size());
  for (std::size_t i = 0; i < table.z.size(); ++i) {
    const double angle_rad = std::atan2(std::hypot(table.x[i], table.y[i]), table.z[i]);
    table.sensitivity.push_back(static_cast<float>(sensitivity(vignetting, angle_rad)));
  }
}

void check_vignetting(std::span<const double> vignetting, double max_angle_rad) {
  constexpr double least_sensitivity = 0.05;
  constexpr int steps = 100;
  for (int i = 0; i <= steps; ++i) {
    if (!(sensitivity(vignetting, max_angle_rad * i / steps) > least_sensitivity)) {
      throw std::invalid_argument("a lens's vignetting must stay above 0.05 up to its rim");
    }
  }
}

}  // namespace calibrate
