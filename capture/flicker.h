// Lamps on the mains that flicker, told from how the light of a bracket's shots differs.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "capture/frame.h"

namespace capture {

struct Flicker {
  double light_hz = 0;    // of the light, twice the mains' frequency: 100 or 120
  double modulation = 0;  // the light swings by so much of its mean, about
  double explained = 0;   // share of the shots' differences that it explains
};

// What a shot of a bracket tells.
struct ShotLight {
  Time time{};            // the middle of its exposure
  double exposure_s = 0;  // that averages the light
  double gain = 1;        // its light over that of others, as MergedFrame::gains has it
};

// Fits a swing of 100 or 120 Hz, whichever explains more, to the logarithms of the last 64 ratios
// of two shots in a row. A lamp that is switched, or light that drifts, is not explained by it. A
// camera whose rate divides the swing's (25 or 50 a second at 100 Hz) does not see it, and nothing
// is found.
class FlickerWatch {
 public:
  // Two shots in a row. Those with values that are not above 0, or not finite, are left out.
  void add(const ShotLight& before, const ShotLight& shot);
  // Nothing from fewer than 24 ratios, or if less than 70 % of their variance is explained, or the
  // modulation is below 1 %.
  std::optional<Flicker> found() const;

 private:
  static constexpr std::size_t most = 64;
  struct Ratio {
    double log = 0;
    std::array<double, 2> times_s{};      // since the first shot
    std::array<double, 2> exposures_s{};  // of the two shots
  };
  Flicker fit(double light_hz) const;

  std::array<Ratio, most> ratios_{};
  std::size_t added_ = 0;
  std::optional<Time> first_;
};

}  // namespace capture
