// The straight line of variance over mean that a linear sensor's noise follows.
#pragma once

#include <array>
#include <vector>

namespace capture {

// A block's mean and temporal variance, codes and codes^2.
struct NoisePoint {
  double mean = 0;
  double variance = 0;
  double freedom = 0;  // degrees of freedom of the variance
};

// variance = at_zero + slope * mean, rounding taken off.
struct NoiseLine {
  double at_zero = 0;
  double slope = 0;                    // codes per electron
  std::array<double, 3> covariance{};  // of at_zero; of both; of slope
  // What a square term would add at the highest mean, relative to the line there, and its
  // deviation.
  double bend = 0;
  double bend_sigma = 0;
  double highest_mean = 0;

  double variance(double mean) const { return at_zero + slope * mean; }
  double sigma(double mean) const;  // of variance(mean)
};

// Points are taken together by their means, a group's variance without those that movement has
// made far larger than the others'. Wants 4 groups, so 40 points, or returns a line whose slope's
// variance is infinite.
NoiseLine fit_noise_line(std::vector<NoisePoint> points);

}  // namespace capture
