// What a frame tells of the range of light.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "capture/image.h"

namespace capture {

// Of a frame's linear values, 1 = saturated, each channel on its own.
struct FrameLight {
  double dark = 0;       // all but the meter's share of the values reach this one
  double brightest = 0;  // of those that are not saturated; 0 if there are none
  double saturated = 0;  // share of values that are
};

struct LightMeterSettings {
  double dark_share = 0.01;  // of the values: so many may be darker than `FrameLight::dark`
  double saturation = 0.98;  // values from here on are saturated
  // (height, width): pixels that count are not 0, as those within a fish-eye's circle. Empty, or of
  // another size than the frames: all.
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> counts;
};

// Every value is looked at for saturation, and for the brightest one; `dark` is from some 16,000
// evenly spread ones. A value that is not finite was taken near a saturated one (see
// CameraOptions::mark_saturated) and counts as saturated. A site of the sensor that is stuck at its
// highest code counts as light.
class LightMeter {
 public:
  // Throws std::invalid_argument for a share outside 0 to 1, a saturation not above 0, or pixels
  // that are not as many as width and height say.
  explicit LightMeter(LightMeterSettings settings);

  // Allocates nothing if the frame has the size of the one before. Throws std::invalid_argument for
  // an empty picture.
  FrameLight measure(const Image& image);

 private:
  struct Stretch {
    std::size_t first, count;  // values
  };
  void lay_out(const Image& image);

  LightMeterSettings settings_;
  int width_ = 0, height_ = 0, channels_ = 0;
  std::vector<Stretch> stretches_;   // of values that count
  std::vector<std::size_t> sample_;  // those that `dark` is from
  std::size_t values_ = 0;
  std::vector<float> sampled_;
};

}  // namespace capture
