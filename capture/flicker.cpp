// The fit of a swing to ratios of light.
#include "capture/flicker.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

namespace capture {
namespace {

constexpr std::size_t fewest = 24;
constexpr double least_explained = 0.7;
constexpr double least_modulation = 0.01;
// Below this the camera's rate hides the swing: the mean square of what a swing of 1 would make.
constexpr double least_swing = 0.02;

double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

// What an exposure leaves of a swing.
double kept(double light_hz, double exposure_s) {
  const double x = std::numbers::pi * light_hz * exposure_s;
  return x < 1e-6 ? 1 : std::sin(x) / x;
}

}  // namespace

void FlickerWatch::add(const ShotLight& before, const ShotLight& shot) {
  const double log = std::log(shot.gain / before.gain);
  if (!std::isfinite(log) || !(before.exposure_s > 0) || !(shot.exposure_s > 0)) return;
  if (!first_) first_ = before.time;
  ratios_[added_++ % most] = {log,
                              {seconds(before.time - *first_), seconds(shot.time - *first_)},
                              {before.exposure_s, shot.exposure_s}};
}

// Least squares of log = a (difference of the sines) + b (of the cosines).
Flicker FlickerWatch::fit(double light_hz) const {
  const std::size_t count = std::min(added_, most);
  double ss = 0, sc = 0, cc = 0, sy = 0, cy = 0, yy = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Ratio& ratio = ratios_[i];
    double sine = 0, cosine = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      const double phase = 2 * std::numbers::pi * light_hz * ratio.times_s[k];
      const double amount = (k == 0 ? -1 : 1) * kept(light_hz, ratio.exposures_s[k]);
      sine += amount * std::sin(phase);
      cosine += amount * std::cos(phase);
    }
    ss += sine * sine;
    sc += sine * cosine;
    cc += cosine * cosine;
    sy += sine * ratio.log;
    cy += cosine * ratio.log;
    yy += ratio.log * ratio.log;
  }
  const double determinant = ss * cc - sc * sc;
  const double seen = (ss + cc) / static_cast<double>(count);
  if (!(seen > least_swing) || !(yy > 0)) return {light_hz, 0, 0};
  // A camera that sees the swing at two phases only tells one of the two terms.
  const bool both = determinant > 1e-3 * ss * cc;
  const double a = both ? (cc * sy - sc * cy) / determinant : ss > cc ? sy / ss : 0;
  const double b = both ? (ss * cy - sc * sy) / determinant : ss > cc ? 0 : cy / cc;
  return {light_hz, std::hypot(a, b), std::clamp((a * sy + b * cy) / yy, 0.0, 1.0)};
}

std::optional<Flicker> FlickerWatch::found() const {
  if (added_ < fewest) return std::nullopt;
  const Flicker fifty = fit(100);
  const Flicker sixty = fit(120);
  const Flicker better = fifty.explained >= sixty.explained ? fifty : sixty;
  if (better.explained < least_explained || better.modulation < least_modulation) {
    return std::nullopt;
  }
  return better;
}

}  // namespace capture
