// Clean plates of footage that is shown frame by frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "compositing/clean_plate.h"
#include "compositing/screen_key.h"

namespace compositing {

// Frames of the empty screen: their mean, and a pixel's noise. Keeps sums, no frames but the last.
class PlateShots {
 public:
  // Throws std::invalid_argument if the frame is not (height, width, 3), or not of the first one's
  // size.
  void add(const capture::Image& frame);
  // How many there were.
  std::size_t count() const { return count_; }
  // As average_plate(). Throws std::invalid_argument if there was none.
  CleanPlate average(std::optional<ScreenColour> colour = {}) const;

 private:
  std::size_t count_ = 0;
  capture::Image last_;
  std::vector<double> sum_;
  // Of each value that noise is measured at: half the squares of the steps from frame to frame, and
  // how many there were, for none counts that is clipped.
  std::vector<double> steps_;
  std::vector<std::uint32_t> steps_count_;
};

// Frames in which a person never leaves. Keeps at most 96 of them, spread evenly over all, as
// halves: 12 MB each of 1080p.
class PlateFootage {
 public:
  // Throws as PlateShots::add().
  void add(const capture::Image& frame);
  // How many there were.
  std::size_t count() const { return count_; }

  // For each pixel the upper quartile of those frames that show the screen there, and where none
  // does, what surrounds it. `known` tells the share that was seen. The colour is
  // find_screen_colour()'s if not given. Noise is measured where the screen is in sight (see
  // plate_noise.h), of one picture by its grain, and is never less than what is taken for it
  // untold. Throws std::invalid_argument if there was no frame.
  CleanPlate screen(std::optional<ScreenColour> colour = {}) const;
  // The same of any still background: of each pixel the median; one picture tells no noise. `known`
  // tells the share of pixels in which most frames are near it.
  CleanPlate background() const;

 private:
  std::vector<Light3> spread_pixels() const;
  CleanPlate screen(ScreenColour colour, const ScreenLight& key) const;

  std::size_t count_ = 0, step_ = 1;  // of those, every step-th is kept
  std::vector<capture::HalfImage> frames_;
};

}  // namespace compositing
