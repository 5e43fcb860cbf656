// The error of a picture against a truth that is known only with noise.
#pragma once

#include <cstddef>

#include "capture/image.h"

namespace render {

// Two pictures of the same thing whose noise is independent: path-traced with different seeds. A
// picture without noise of its own is its own second.
struct PicturePair {
  const capture::Image* a = nullptr;  // (height, width, 3 or more)
  const capture::Image* b = nullptr;
};

// Where noise outweighs the error, the estimate of the square may come out below 0.
struct PairedError {
  double relative_rms = 0;    // the root of the square, 0 if that is below 0
  double standard_error = 0;  // of relative_rms, from the noise of the pictures alone
  double square = 0;          // unbiased
  double square_standard_error = 0;
  std::size_t pixels = 0;
};

// The error as picture_error() defines it, sqrt(sum (x - r)^2 / sum r^2) over pixels where `mask`
// (height, width, 1) is above 0, both clamped at `clamp`, as it would be without noise in the truth
// r or in x: of each square, the factors come from different pictures, so that their noise has a
// product of mean 0. Not corrected: the clamp works on the noisy pictures, which darkens the truth
// of pixels that flicker about it. Throws std::invalid_argument if the pictures or the mask differ
// in size.
PairedError paired_error(const PicturePair& x,
                         const PicturePair& truth,
                         const capture::Image& mask,
                         float clamp = 4.0F);

}  // namespace render
