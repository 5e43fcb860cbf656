// Gradient noise by hashed lattice.
#include "render/made_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/counter_random.h"

namespace render {
namespace {

int wrapped(int i, int period) {
  if (period <= 0) return i;
  const int rest = i % period;
  return rest < 0 ? rest + period : rest;
}

// The gradient of a lattice point times the way from it.
float corner(int ix, int iy, float dx, float dy, std::uint32_t seed, int period) {
  const auto key = static_cast<std::uint64_t>(static_cast<std::uint32_t>(wrapped(ix, period)))
                       << 32 |
                   static_cast<std::uint32_t>(wrapped(iy, period));
  // Sixteen directions suffice, and cost no sine.
  static constexpr float half = std::numbers::sqrt2_v<float> / 2;
  static constexpr float c = 0.92387953F;  // of 22.5 degrees
  static constexpr float s = 0.38268343F;
  static constexpr float gradients[16][2] = {
      {1, 0},  {c, s},   {half, half},   {s, c},   {0, 1},  {-s, c}, {-half, half}, {-c, s},
      {-1, 0}, {-c, -s}, {-half, -half}, {-s, -c}, {0, -1}, {s, -c}, {half, -half}, {c, -s}};
  const auto& g = gradients[capture::mixed_bits(key ^ (std::uint64_t{seed} << 48 | seed)) >> 60];
  return g[0] * dx + g[1] * dy;
}

float fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

}  // namespace

float plane_noise(float x, float y, std::uint32_t seed, int period) {
  const float fx = std::floor(x);
  const float fy = std::floor(y);
  const int ix = static_cast<int>(fx);
  const int iy = static_cast<int>(fy);
  const float dx = x - fx;
  const float dy = y - fy;
  const float u = fade(dx);
  const float a = std::lerp(corner(ix, iy, dx, dy, seed, period),
                            corner(ix + 1, iy, dx - 1, dy, seed, period), u);
  const float b = std::lerp(corner(ix, iy + 1, dx, dy - 1, seed, period),
                            corner(ix + 1, iy + 1, dx - 1, dy - 1, seed, period), u);
  return std::lerp(a, b, fade(dy)) * std::numbers::sqrt2_v<float>;
}

float fractal_noise(float x, float y, int octaves, std::uint32_t seed, int period) {
  float sum = 0;
  float weight = 1;
  float total = 0;
  float frequency = 1;
  for (int octave = 0; octave < octaves; ++octave) {
    const auto octave_seed = seed * 31 + static_cast<std::uint32_t>(octave);
    sum += weight * plane_noise(x * frequency, y * frequency, octave_seed,
                                period * static_cast<int>(frequency));
    total += weight;
    weight /= 2;
    frequency *= 2;
  }
  return sum / total;
}

float smooth_step(float low, float high, float value) {
  const float t = std::clamp((value - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

}  // namespace render
