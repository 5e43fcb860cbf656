// The fewest exposures for a range of radiance.
#include "capture/exposure_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace capture {
namespace {

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

constexpr double most_steps = 1000;

// Where the exposures of a scene begin and end, and how many steps lie between them.
struct Ends {
  double least_value = 0;
  double wanted_shortest_s = 0;
  double wanted_longest_s = 0;
  double shortest_s = 0;
  double longest_s = 0;
  double steps = 0;
};

Ends ends_of(const RadianceRange& scene, const ChoiceSettings& settings) {
  const ExposureRange& possible = settings.possible;
  Ends ends{.least_value = least_resolved_value(settings)};
  ends.wanted_shortest_s = settings.fullest / scene.most;
  ends.wanted_longest_s = ends.least_value / scene.least;
  ends.shortest_s = std::clamp(ends.wanted_shortest_s, possible.shortest_s, possible.longest_s);
  ends.longest_s = std::clamp(ends.wanted_longest_s, ends.shortest_s, possible.longest_s);
  const double stops = std::log2(ends.longest_s / ends.shortest_s);
  const double reach = std::log2(settings.fullest / ends.least_value);  // of one exposure
  // A little less, so that rounding makes no exposure more.
  if (stops > 0) ends.steps = std::max(std::ceil(stops / reach - 1e-9), 0.0);
  return ends;
}

}  // namespace

// Noise / value falls as the value grows.
double least_resolved_value(const ChoiceSettings& settings) {
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
  const Ends ends = ends_of(scene, settings);
  if (!(ends.steps < most_steps)) {
    throw std::invalid_argument("so small an error takes more than 1000 exposures");
  }
  ExposureChoice choice;
  choice.relative_error = settings.relative_error;
  for (double i = 0; i < ends.steps; ++i) {
    choice.exposures_s.push_back(ends.shortest_s *
                                 std::pow(ends.longest_s / ends.shortest_s, i / ends.steps));
  }
  choice.exposures_s.push_back(ends.steps > 0 ? ends.longest_s : ends.shortest_s);
  choice.too_bright = ends.wanted_shortest_s < settings.possible.shortest_s;
  choice.too_dark = ends.wanted_longest_s > settings.possible.longest_s;
  return choice;
}

ExposureChoice choose_at_most(std::size_t most,
                              const RadianceRange& scene,
                              const ChoiceSettings& settings) {
  check(scene, settings);
  if (most == 0) throw std::invalid_argument("a bracket has exposures");
  ChoiceSettings wider = settings;
  while (!(ends_of(scene, wider).steps < static_cast<double>(most))) wider.relative_error *= 1.05;
  return choose_exposures(scene, wider);
}

}  // namespace capture
