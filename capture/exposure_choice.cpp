// The fewest exposures for a range of radiance.
#include "capture/exposure_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace capture {
namespace {

// The least value whose deviation is small enough: noise / value falls as the value grows.
double least_value(const ChoiceSettings& settings) {
  const auto error = [&](double value) {
    return std::sqrt(settings.noise.variance(value)) / value;
  };
  if (error(settings.fullest) > settings.relative_error) {
    throw std::invalid_argument("no exposure has so small an error: the noise is larger");
  }
  double low = 1e-9;
  double high = settings.fullest;
  for (int i = 0; i < 80; ++i) {
    const double middle = std::sqrt(low * high);
    (error(middle) > settings.relative_error ? low : high) = middle;
  }
  return high;
}

void check(const RadianceRange& scene, const ChoiceSettings& settings) {
  const auto ordered = [](double low, double high) {
    return low > 0 && low <= high && std::isfinite(high);
  };
  if (!ordered(scene.least, scene.most) ||
      !ordered(settings.possible.shortest_s, settings.possible.longest_s) ||
      !(settings.relative_error > 0) || !(settings.fullest > 0 && settings.fullest <= 1)) {
    throw std::invalid_argument("exposures are chosen for ranges and errors above 0");
  }
}

}  // namespace

double merged_error(double radiance,
                    const std::vector<double>& exposures_s,
                    const NoiseModel& noise,
                    double fullest) {
  double information = 0;
  for (const double t : exposures_s) {
    // Rounding must not lose the value that an exposure was chosen for.
    if (radiance * t <= fullest * (1 + 1e-9)) information += t * t / noise.variance(radiance * t);
  }
  return information > 0 ? 1 / (std::sqrt(information) * radiance)
                         : std::numeric_limits<double>::infinity();
}

ExposureChoice choose_exposures(const RadianceRange& scene, const ChoiceSettings& settings) {
  check(scene, settings);
  const double least = least_value(settings);
  const double reach = settings.fullest / least;  // of one exposure
  const ExposureRange& possible = settings.possible;
  const double wanted_shortest_s = settings.fullest / scene.most;
  const double wanted_longest_s = least / scene.least;
  const double shortest_s = std::clamp(wanted_shortest_s, possible.shortest_s, possible.longest_s);
  const double longest_s = std::clamp(wanted_longest_s, shortest_s, possible.longest_s);
  // A little less, so that rounding makes no exposure more.
  const double steps = std::ceil(std::log(longest_s / shortest_s) / std::log(reach) - 1e-9);
  ExposureChoice choice;
  for (double i = 0; i <= steps; ++i) {
    choice.exposures_s.push_back(
        steps > 0 ? shortest_s * std::pow(longest_s / shortest_s, i / steps) : shortest_s);
  }
  choice.too_bright = wanted_shortest_s < possible.shortest_s;
  choice.too_dark = wanted_longest_s > possible.longest_s;
  choice.resolved = {least / choice.exposures_s.back(),
                     settings.fullest / choice.exposures_s.front()};
  return choice;
}

}  // namespace capture
