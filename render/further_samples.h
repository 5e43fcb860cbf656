// What the further camera rays of a cell's pixels show, and how far off their mean may be. Private
// to the kernel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "calibrate/vec.h"
#include "render/cell_visibility.h"

namespace render {

using calibrate::Vec3f;

// A sample's light counts up to so many times display white: a sixteenth of a pixel is then as
// bright as a display shows.
inline constexpr float sample_limit = 64;
// Brighter light than this, in display white, looks alike.
inline constexpr float display_limit = 4;
// By which virtual things are taken to differ from the plate, whatever it shows: decisions hold
// from frame to frame.
inline constexpr float plate_contrast = 0.4F;

// What the rays of one camera ray add up to under the planned light.
struct CameraSample {
  Vec3f added;  // radiance
  Vec3f plate;  // share of the plate

  CameraSample& operator+=(const CameraSample& o) {
    added += o.added;
    plate += o.plate;
    return *this;
  }
};

// Sums over the further samples of each pixel of a cell.
//
// Samples that follow each other in the pattern are spread over the pixel by themselves. What such
// batches differ by tells how far off the mean of all may be: of an edge much less than what its
// samples differ by would make believe.
class FurtherSamples {
 public:
  // Of another cell: no pixel has any.
  void clear() { counts_.fill(0); }
  // Of a pixel that takes some. It has none.
  void begin(std::size_t pixel);
  // `times` that sample.
  void add(std::size_t pixel, const CameraSample& sample, int times = 1);
  // One that was added is of that batch of the pixel: batches come one after the other.
  void add_to_batch(std::size_t pixel, int batch, const CameraSample& sample);
  void end_batch();
  // One that was added is a batch by itself, which all agree with.
  void count_as_batch(std::size_t pixel) { ++of_pixel_[pixel].batches; }

  int count(std::size_t pixel) const { return counts_[pixel]; }
  // The squares of what samples differ from their mean by, added up.
  float spread(std::size_t pixel) const { return spread(pixel, of_pixel_[pixel].squares); }
  // How much of a variance shows: of a mean that is above display_limit for sure the less, by the
  // fourth power. A display shows white there, and a tone curve, steps the smaller the brighter it
  // is.
  float share_shown(std::size_t pixel) const;
  // The variance that independent samples would have whose mean is as far off as theirs.
  float variance(std::size_t pixel) const;

 private:
  struct Sums {
    Vec3f shown, behind;  // of all
    Vec3f squares, batch_squares;
    int batches = 0;
  };
  struct Batch {
    std::size_t pixel = 0;
    int number = 0, count = 0;
    Vec3f shown{}, behind{};
  };

  float spread(std::size_t pixel, Vec3f squares) const;

  std::array<std::uint16_t, cell_pixels> counts_{};
  std::array<Sums, cell_pixels> of_pixel_{};
  Batch batch_;
};

}  // namespace render
