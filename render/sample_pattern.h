// Where in their pixels further camera rays go. Private to the kernel.
#pragma once

#include <array>

namespace render {

inline constexpr int samples_max = 1024;  // camera rays in one pixel

// The same in every pixel, so that edges are smooth along their length. Every first 4^n places, and
// every 4^n that follow a multiple of as many, have one in each part of the pixel that is 2^-i wide
// and 2^(i - 2n) high: Sobol's sequence. It is scrambled, for by itself it lies at the lower ends
// of these parts: sixteen of its places show things a thirtieth of a pixel off.
struct SamplePattern {
  std::array<std::array<float, 2>, samples_max> places;  // x, y from the pixel's middle, -.5 to .5
  int middle = 0;  // of the first four, the one nearest to the pixel's middle
};

const SamplePattern& sample_pattern();

}  // namespace render
