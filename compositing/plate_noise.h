// The noise of a camera's pixels, as a line over light: of shots, and of footage.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "capture/image.h"

namespace compositing {

// What is as bright as this is clipped, and has none.
inline constexpr float clipped_light = 0.98F;

// Of one frame's pixel: variance = gain * light + floor.
struct PlateNoise {
  float gain = 0, floor = 0;
};

// Variances seen at some lights, and the line through them.
class NoiseSums {
 public:
  // The sum of so many that were seen at one light.
  void add(double light, double variances, double times) {
    n_ += times, sx_ += times * light, sy_ += variances;
    sxx_ += times * light * light, sxy_ += light * variances;
  }
  // By least squares, neither below its least. Nothing of fewer than `least_count`, or of one light
  // alone.
  std::optional<PlateNoise> line(double least_count) const;

 private:
  double n_ = 0, sx_ = 0, sy_ = 0, sxx_ = 0, sxy_ = 0;
};

// A row of (width, 3), each pixel the mean of the five about it.
std::vector<float> smoothed_along(std::span<const float> row);

// Which pixels of a row of a frame show what the plate is of: 1, else 0. `light` is (width, 3),
// smoothed along the row.
using ShowsPlate =
    std::function<void(std::size_t frame, int y, const float* light, std::uint8_t* shows)>;

// The noise of frames of one size in which somebody may pass before what the plate is of. By
// medians over runs of pixels, so that edges of persons, folds and creases count for none. Nothing
// where too little of it is in sight, none as bright as `reaches`, or it holds still. What is
// clipped or black does not count.
//
// From each frame to the next, without what a run has in common, which is light that flickers.
std::optional<PlateNoise> noise_of_steps(std::span<const capture::HalfImage> frames,
                                         const ShowsPlate& shows,
                                         float reaches = 0);
// Within frames, from what pixels differ from the 5x5 around them: for a screen, which is smooth.
std::optional<PlateNoise> noise_of_grain(std::span<const capture::HalfImage> frames,
                                         const ShowsPlate& shows,
                                         float reaches = 0);

}  // namespace compositing
