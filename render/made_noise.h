// Smooth noise of the plane, for made skies and grounds.
#pragma once

#include <cstdint>

namespace render {

// Gradient noise: 0 in the mean, within -1..1, smooth, of about one wave per unit; 0 on whole
// coordinates. With a `period` (whole units, 0 = none) it repeats in both directions. Coordinates
// up to a million.
//
// Perlin, "Improving Noise", SIGGRAPH 2002; gradients are hashed, not permuted.
float plane_noise(float x, float y, std::uint32_t seed, int period = 0);

// Octaves of it, each of twice the frequency and half the weight, scaled to stay within -1..1.
float fractal_noise(float x, float y, int octaves, std::uint32_t seed, int period = 0);

// 0 below `low`, 1 above `high`, smooth between.
float smooth_step(float low, float high, float value);

}  // namespace render
