// Products of independent differences.
#include "render/paired_error.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>

namespace render {

PairedError paired_error(const PicturePair& x,
                         const PicturePair& truth,
                         const capture::Image& mask,
                         float clamp) {
  for (const capture::Image* image : {x.a, x.b, truth.a, truth.b}) {
    if (image == nullptr || image->width != mask.width || image->height != mask.height ||
        image->channels < 3) {
      throw std::invalid_argument("paired_error: pictures and mask must be of one size");
    }
  }
  PairedError error;
  double squares = 0;
  double truth_squares = 0;
  double variance = 0;  // of `squares`
  for (int row = 0; row < mask.height; ++row) {
    for (int column = 0; column < mask.width; ++column) {
      if (!(mask.at(row, column) > 0)) continue;
      ++error.pixels;
      for (int c = 0; c < 3; ++c) {
        const auto value = [&](const capture::Image& image) {
          return std::min<double>(image.at(row, column, c), clamp);
        };
        const double ra = value(*truth.a);
        const double rb = value(*truth.b);
        const double da = value(*x.a) - ra;
        const double db = value(*x.b) - rb;
        squares += da * db;
        truth_squares += ra * rb;
        // With noise of variance v in da and in db, da db has the variance 2 d^2 v + v^2. For
        // Gaussian noise the following has that mean; long tails make it larger.
        const double v = (da - db) * (da - db) / 2;
        variance += 2 * da * db * v + v * v;
      }
    }
  }
  if (error.pixels == 0 || !(truth_squares > 0)) return error;
  error.square = squares / truth_squares;
  error.square_standard_error = std::sqrt(std::max(0.0, variance)) / truth_squares;
  error.relative_rms = std::sqrt(std::max(0.0, error.square));
  // The root's slope is infinite at 0, so it is taken over the width of the noise.
  const double high = std::sqrt(std::max(0.0, error.square) + error.square_standard_error);
  error.standard_error = high - error.relative_rms;
  return error;
}

}  // namespace render
