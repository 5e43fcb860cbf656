// A made sensor that keeps up with a camera's rate.
#pragma once

#include <cstdint>
#include <vector>

#include "capture/image.h"
#include "capture/made_sensor.h"

namespace capture {

// Exposes as expose() does, some twenty times faster: electrons and reading together are one normal
// deviate of their common variance, out of a table of 65,536 that every run of 256 sites enters at
// a place of its own. So means and variances are right where a site gathers more than a few
// electrons; the tails end at 4.2 deviations, and dark sites lack Poisson's skewness. Curved codes
// are right to 1/4096 of the light's square root.
class LiveSensor {
 public:
  // Throws std::invalid_argument for a sensor out of its ranges.
  explicit LiveSensor(const MadeSensor& sensor);

  // The picture of `radiance` exposed for exposure_s, into `shot`. The same number gives the same
  // codes. Throws std::invalid_argument as expose().
  void expose(const Image& radiance, double exposure_s, std::uint64_t number, MadeShot& shot) const;

 private:
  MadeSensor sensor_;
  std::vector<float> deviates_;       // standard normal
  std::vector<std::uint16_t> codes_;  // by the square root of light; empty = linear
};

}  // namespace capture
