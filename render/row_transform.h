// Fourier transforms along the rows of maps.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace render {

// Rows that are transformed side by side, so that plain loops fill a vector register.
inline constexpr std::size_t rows_at_once = 16;
using Rows = std::array<float, rows_at_once>;

// The discrete Fourier transform of `rows_at_once` complex sequences at once; the length is a power
// of two.
//
// Cooley and Tukey, "An Algorithm for the Machine Calculation of Complex Fourier Series", Math.
// Comput. 19, 1965: radix 2, decimation in time.
class RowTransform {
 public:
  explicit RowTransform(std::size_t length)
      : length_(length), swap_(length), cosine_(length / 2), sine_(length / 2) {
    for (std::size_t i = 0, j = 0; i < length; ++i) {
      swap_[i] = j;
      std::size_t bit = length >> 1U;
      for (; bit != 0 && (j & bit) != 0; bit >>= 1U) j ^= bit;
      j |= bit;
    }
    for (std::size_t i = 0; i < length / 2; ++i) {
      const double angle =
          -2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(length);
      cosine_[i] = static_cast<float>(std::cos(angle));
      sine_[i] = static_cast<float>(std::sin(angle));
    }
  }

  std::size_t length() const { return length_; }

  // In place: x[m] = sum over j of x[j] exp(-2 pi i j m / length).
  void forward(Rows* re, Rows* im) const {
    for (std::size_t i = 0; i < length_; ++i) {
      if (i < swap_[i]) {
        std::swap(re[i], re[swap_[i]]);
        std::swap(im[i], im[swap_[i]]);
      }
    }
    for (std::size_t half = 1; half < length_; half *= 2) {
      const std::size_t stride = length_ / (2 * half);
      for (std::size_t begin = 0; begin < length_; begin += 2 * half) {
        for (std::size_t k = 0; k < half; ++k) {
          butterfly(re[begin + k], im[begin + k], re[begin + k + half], im[begin + k + half],
                    cosine_[k * stride], sine_[k * stride]);
        }
      }
    }
  }

  // The inverse, times the length: swapping the real and imaginary parts turns the sign around.
  void backward(Rows* re, Rows* im) const { forward(im, re); }

 private:
  static void butterfly(Rows& a_re, Rows& a_im, Rows& b_re, Rows& b_im, float c, float s) {
    for (std::size_t l = 0; l < rows_at_once; ++l) {
      const float t_re = b_re[l] * c - b_im[l] * s;
      const float t_im = b_re[l] * s + b_im[l] * c;
      b_re[l] = a_re[l] - t_re;
      b_im[l] = a_im[l] - t_im;
      a_re[l] += t_re;
      a_im[l] += t_im;
    }
  }

  std::size_t length_;
  std::vector<std::size_t> swap_;
  std::vector<float> cosine_, sine_;
};

}  // namespace render
