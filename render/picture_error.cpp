// The design's error of a picture.
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "capture/median.h"
#include "render/reference.h"

namespace render {
namespace {

struct Lab {
  double l, a, b;
};

// OK Lab of linear Rec.709 light, clamped to what a display shows.
//
// Ottosson, "A perceptual color space for image processing", 2020 (matrices of 2021-01-25).
Lab ok_lab(const float* rgb) {
  const auto shown = [](float value) { return value > 0 ? std::min<double>(value, 1) : 0.0; };
  const double r = shown(rgb[0]), g = shown(rgb[1]), b = shown(rgb[2]);
  const double l = std::cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const double m = std::cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const double s = std::cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
          1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

void check(const capture::Image& image, const capture::Image& mask, int channels) {
  if (image.width != mask.width || image.height != mask.height || image.channels < channels)
    throw std::invalid_argument("picture_error: pictures and mask must be of one size");
}

// Against two references, which may be the same one.
PictureError compare(const capture::Image& x,
                     const capture::Image& a,
                     const capture::Image& b,
                     const capture::Image& mask,
                     float clamp) {
  check(x, mask, 3);
  check(a, mask, 3);
  check(b, mask, 3);
  PictureError error;
  std::vector<double> differences;
  std::vector<double> delta_es;
  double squares = 0, reference_squares = 0, unclamped_squares = 0, noise_squares = 0;
  for (int row = 0; row < mask.height; ++row) {
    for (int column = 0; column < mask.width; ++column) {
      if (!(mask.at(row, column) > 0)) continue;
      ++error.pixels;
      std::array<float, 3> truth;
      for (int c = 0; c < 3; ++c) {
        const float value = x.at(row, column, c);
        const float truth_a = a.at(row, column, c), truth_b = b.at(row, column, c);
        const double shown = std::min(value, clamp);
        const double shown_a = std::min(truth_a, clamp), shown_b = std::min(truth_b, clamp);
        squares += (shown - shown_a) * (shown - shown_b);
        reference_squares += shown_a * shown_b;
        noise_squares += (shown_a - shown_b) * (shown_a - shown_b) / 4;
        const double mean = 0.5 * (static_cast<double>(truth_a) + truth_b);
        truth[static_cast<std::size_t>(c)] = static_cast<float>(mean);
        unclamped_squares += mean * mean;
        const double plain = std::abs(value - mean);
        differences.push_back(std::isnan(plain) ? HUGE_VAL : plain);
      }
      const Lab of_x = ok_lab(&x.pixels[x.index(row, column)]);
      const Lab of_truth = ok_lab(truth.data());
      delta_es.push_back(100 *
                         std::hypot(of_x.l - of_truth.l, of_x.a - of_truth.a, of_x.b - of_truth.b));
    }
  }
  if (error.pixels == 0) return error;
  // Where the reference is black, any light is an infinite error.
  const auto relative = [](double sum, double unit) { return sum == 0 ? 0 : sum / unit; };
  // Two references that hardly agree may leave less than nothing; not-a-number stays.
  error.relative_rms = std::sqrt(squares < 0 ? 0 : relative(squares, reference_squares));
  error.reference_noise = std::sqrt(relative(noise_squares, reference_squares));
  error.p99 = relative(capture::quantile_in_place(differences, 0.99),
                       std::sqrt(unclamped_squares / static_cast<double>(differences.size())));
  for (const double e : delta_es) error.delta_e_mean += e;
  error.delta_e_mean /= static_cast<double>(delta_es.size());
  error.delta_e_p95 = capture::quantile_in_place(delta_es, 0.95);
  error.delta_e_p99 = capture::quantile_in_place(delta_es, 0.99);
  return error;
}

}  // namespace

capture::Image affected_mask(const capture::Image& reference, const capture::Image& plate) {
  if (reference.width != plate.width || reference.height != plate.height ||
      reference.channels != 4 || plate.channels < 3) {
    throw std::invalid_argument("affected_mask: the reference and its plate must be of one size");
  }
  capture::Image mask = capture::make_image(reference.height, reference.width, 1);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      bool affected = reference.at(y, x, 3) > 0;
      for (int c = 0; c < 3; ++c) {
        const float behind = plate.at(y, x, c);
        affected = affected || std::abs(reference.at(y, x, c) - behind) > 1e-3F * behind;
      }
      mask.at(y, x) = affected ? 1.0F : 0.0F;
    }
  }
  return mask;
}

PictureError picture_error(const capture::Image& x,
                           const capture::Image& r,
                           const capture::Image& mask,
                           float clamp) {
  return compare(x, r, r, mask, clamp);
}

PictureError picture_error(const capture::Image& x,
                           const std::array<capture::Image, 2>& references,
                           const capture::Image& mask,
                           float clamp) {
  return compare(x, references[0], references[1], mask, clamp);
}

}  // namespace render
