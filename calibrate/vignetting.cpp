// How much a lens dims towards its rim.
#include "calibrate/vignetting.h"

#include <algorithm>
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

void check_vignetting(std::span<const double> vignetting, const Lens& lens) {
  double angle_rad = 0;
  for (const double x : {0.0, lens.width - 1.0}) {
    for (const double y : {0.0, lens.height - 1.0}) {
      const auto v = unproject(lens, {x, y});
      angle_rad =
          std::max(angle_rad, v ? std::atan2(std::hypot(v->x, v->y), v->z) : lens.max_angle_rad);
    }
  }
  check_vignetting(vignetting, angle_rad);
}

}  // namespace calibrate
