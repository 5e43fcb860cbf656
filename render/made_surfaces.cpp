// Asphalt, concrete and wood, painted texel by texel.
#include "render/made_surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "capture/colour.h"
#include "capture/counter_random.h"
#include "capture/parallel_loop.h"
#include "render/made_noise.h"
#include "render/texture.h"

namespace render {
namespace {

// A number in -1..1 of its own for every texel.
float grain(int x, int y, std::uint32_t seed) {
  const auto key = static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32 |
                   static_cast<std::uint32_t>(y);
  return static_cast<float>(capture::uniform_high(capture::mixed_bits(seed, key)) * 2 - 1);
}

// 1 where `value` lies within `half_width` of 0, soft over `soft`.
float band(float value, float half_width, float soft) {
  return 1 - smooth_step(half_width - soft, half_width + soft, std::abs(value));
}

// Albedo at texel (x, y), (u, v) in 0..1.
using calibrate::mix;
using Paint = std::function<Vec3f(int x, int y, float u, float v)>;

Texture paint_texture(int size, const Paint& paint) {
  const auto side = static_cast<std::size_t>(size);
  std::vector<std::uint8_t> texels(side * side * 3);
  capture::parallel_for(0, size, [&](int y) {
    for (int x = 0; x < size; ++x) {
      const float u = (static_cast<float>(x) + 0.5F) / static_cast<float>(size);
      const float v = (static_cast<float>(y) + 0.5F) / static_cast<float>(size);
      const Vec3f albedo = paint(x, y, u, v);
      std::uint8_t* texel =
          &texels[(static_cast<std::size_t>(y) * side + static_cast<std::size_t>(x)) * 3];
      for (const float channel : {albedo.x, albedo.y, albedo.z}) {
        const double code = 255 * capture::encode(capture::Transfer::srgb, channel);
        *texel++ = static_cast<std::uint8_t>(std::clamp(code + 0.5, 0.0, 255.0));
      }
    }
  });
  return make_texture(size, size, 3, true, texels);
}

// How much paint lies at (x, y), metres from the court's middle, y up the picture.
float painted(float x, float y) {
  constexpr float line = 0.06F;  // half the width
  constexpr float soft = 0.006F;
  float paint = 0;
  if (y > 2.2F && y < 7.5F) {  // bays of 2.6 m
    const float bay = x / 2.6F - std::floor(x / 2.6F) - 0.5F;
    paint = std::max(paint, band(bay * 2.6F, line, soft));
  }
  paint = std::max(paint, band(y - 2.2F, line, soft) * (std::abs(x) < 7.86F ? 1 : 0));
  // A broken line along the drive.
  if (x / 3 - std::floor(x / 3) < 0.62F) paint = std::max(paint, band(y + 3.55F, line, soft));
  // An arrow to the right.
  const float ax = x - 2.9F;
  const float ay = y + 2.4F;
  if (ax > -1.3F && ax < 0.5F) paint = std::max(paint, band(ay, 0.09F, soft));
  if (ax >= 0.5F && ax < 1.3F) paint = std::max(paint, band(ay, 0.36F * (1.3F - ax) / 0.8F, soft));
  return paint;
}

Vec3f asphalt(int x, int y, float mx, float my, std::uint32_t seed) {
  const float stains = fractal_noise(mx * 0.45F, my * 0.45F, 5, seed);
  const float mottle = plane_noise(mx * 14, my * 14, seed + 1);
  const float grit = grain(x, y, seed + 2);
  const float stones = grain(x / 2, y / 2, seed + 3);
  float albedo = 0.165F * (1 + 0.28F * stains) * (1 + 0.07F * mottle);
  albedo *= 1 + 0.20F * grit + (stones > 0.8F ? 0.35F : 0.06F * stones);

  constexpr float mend_left = -2.0F;
  constexpr float mend_right = -0.4F;
  constexpr float mend_low = 0.1F;
  constexpr float mend_high = 1.7F;
  const bool mended = mx > mend_left && mx < mend_right && my > mend_low && my < mend_high;
  if (mended) albedo *= 0.72F;
  const float edge =
      std::max(std::max(mend_left - mx, mx - mend_right), std::max(mend_low - my, my - mend_high));
  const float seam = band(edge + 0.02F * plane_noise(mx * 3, my * 3, seed + 4), 0.025F, 0.012F);
  float crack = 0;
  const float open = smooth_step(0.05F, 0.3F, plane_noise(mx * 0.3F, my * 0.3F, seed + 7));
  if (open > 0) {
    const float bend = 0.35F * fractal_noise(mx * 0.9F, my * 0.9F, 4, seed + 5);
    const float line = plane_noise(mx * 0.33F + bend, my * 0.33F - bend, seed + 6);
    crack = open * band(line, 0.0035F, 0.002F);
  }
  albedo *= 1 - 0.6F * std::max(seam, crack);

  constexpr std::array<std::array<float, 3>, 3> spills{
      {{-1.3F, 4.6F, 0.55F}, {3.8F, 5.2F, 0.4F}, {0.9F, 5.6F, 0.3F}}};
  for (const auto& [sx, sy, radius] : spills) {
    const float away = std::hypot(mx - sx, my - sy) / radius;
    if (away > 1.7F) continue;
    const float shape = away + 0.5F * fractal_noise(mx * 3, my * 3, 3, seed + 8);
    albedo *= 1 - 0.5F * (1 - smooth_step(0.3F, 1.1F, shape));
  }
  return Vec3f{1.02F, 1.0F, 0.96F} * albedo;
}

}  // namespace

Texture make_court_texture(int size, std::uint32_t seed) {
  return paint_texture(size, [=](int x, int y, float u, float v) {
    const float mx = (u - 0.5F) * court_m;
    const float my = (0.5F - v) * court_m;
    const Vec3f ground = asphalt(x, y, mx, my, seed);
    const float paint = painted(mx, my);
    if (paint <= 0) return ground;
    const float wear = fractal_noise(mx * 5, my * 5, 5, seed + 20) + 0.35F * grain(x, y, seed + 21);
    const float left = paint * (1 - smooth_step(0.12F, 0.5F, wear));
    return mix(ground, Vec3f{0.60F, 0.59F, 0.56F} * (1 + 0.06F * grain(x, y, seed + 2)),
               0.92F * left);
  });
}

Texture make_lawn_texture(int size, std::uint32_t seed) {
  return paint_texture(size, [=](int x, int y, float u, float v) {
    const float patches = fractal_noise(u * 8, v * 8, 4, seed, 8);
    const float tufts = fractal_noise(u * 96, v * 96, 3, seed + 1, 96);
    const float blades = grain(x, y / 2, seed + 2);
    const float dry = smooth_step(0.05F, 0.5F, fractal_noise(u * 5, v * 5, 4, seed + 3, 5));
    const Vec3f green = mix({0.235F, 0.300F, 0.056F}, {0.36F, 0.32F, 0.11F}, 0.3F * dry);
    return green * ((1 + 0.20F * patches) * (1 + 0.35F * tufts) * (1 + 0.22F * blades));
  });
}

Texture make_paving_texture(int size, std::uint32_t seed) {
  return paint_texture(size, [=](int x, int y, float u, float v) {
    constexpr float slabs = 4;
    const float su = u * slabs;
    const float sv = v * slabs;
    const int iu = static_cast<int>(su);
    const int iv = static_cast<int>(sv);
    const float tone = 1 + 0.10F * grain(iu, iv, seed);
    const float mottle = fractal_noise(u * 12, v * 12, 5, seed + 1, 12);
    const float from_edge = 0.5F - std::max(std::abs(su - static_cast<float>(iu) - 0.5F),
                                            std::abs(sv - static_cast<float>(iv) - 0.5F));
    const float joint = 1 - smooth_step(0.008F, 0.02F, from_edge);
    const float albedo = 0.30F * tone * (1 + 0.2F * mottle) * (1 + 0.10F * grain(x, y, seed + 2));
    return mix(Vec3f{1.03F, 1.0F, 0.94F} * albedo, {0.09F, 0.085F, 0.075F}, joint);
  });
}

Texture make_wall_texture(int size, std::uint32_t seed) {
  return paint_texture(size, [=](int x, int y, float u, float v) {
    const float panel = u * 2 - std::floor(u * 2);
    const float tone = 1 + 0.05F * grain(static_cast<int>(u * 2), 0, seed);
    const float streaks = fractal_noise(u * 48, v * 3, 5, seed + 1, 48);
    const float mottle = fractal_noise(u * 8, v * 8, 6, seed + 2, 8);
    float albedo = 0.42F * tone * (1 + 0.22F * mottle) * (1 + 0.06F * grain(x, y, seed + 3));
    albedo *= 1 - 0.30F * std::max(0.0F, streaks) * (1 - 0.6F * v);      // rain from the top
    albedo *= 1 - 0.35F * smooth_step(0.84F, 1.0F, v + 0.10F * mottle);  // splashes at the foot
    Vec3f colour = Vec3f{1.0F, 0.965F, 0.89F} * albedo;
    const float worn = smooth_step(0.25F, 0.55F, fractal_noise(u * 24, v * 24, 4, seed + 5, 24));
    const float stripe = band(v - 0.47F, 0.085F, 0.002F) * (1 - 0.8F * worn);
    colour = mix(colour, Vec3f{0.05F, 0.16F, 0.30F} * (1 + 0.15F * mottle), 0.9F * stripe);
    const float joint = band(std::min(panel, 1 - panel), 0.006F, 0.002F);
    float hole = 0;
    for (const float hv : {0.22F, 0.72F}) {
      for (const float hu : {0.2F, 0.8F}) {
        hole =
            std::max(hole, 1 - smooth_step(0.008F, 0.012F, std::hypot((panel - hu) / 2, v - hv)));
      }
    }
    return colour * (1 - 0.65F * std::max(joint, hole));
  });
}

Texture make_board_texture(int size, std::uint32_t seed) {
  return paint_texture(size, [=](int x, int y, float u, float v) {
    constexpr float boards = 8;
    const float across = v * boards;
    const int board = static_cast<int>(across);
    const auto board_seed = seed + 7 * static_cast<std::uint32_t>(board);
    const float figure = plane_noise(u * 3, across * 2, board_seed, 48);
    const float rings = std::sin(40 * (across - static_cast<float>(board)) + 9 * figure +
                                 static_cast<float>(board));
    const float fibre = fractal_noise(u * 6, v * 160, 3, board_seed + 1);
    const float tone = 1 + 0.22F * grain(board, 3, seed);
    const float edge = 0.5F - std::abs(across - static_cast<float>(board) - 0.5F);
    const float gap = 1 - smooth_step(0.015F, 0.05F, edge);
    const float albedo =
        tone * (1 + 0.10F * rings + 0.25F * fibre) * (1 + 0.05F * grain(x, y, seed + 5));
    return mix(Vec3f{0.40F, 0.265F, 0.145F} * albedo, {0.03F, 0.022F, 0.015F}, gap);
  });
}

Texture make_concrete_texture(int size, std::uint32_t seed) {
  return paint_texture(size, [=](int x, int y, float u, float v) {
    const float mottle = fractal_noise(u * 6, v * 6, 6, seed, 6);
    const float albedo = 0.38F * (1 + 0.25F * mottle) * (1 + 0.10F * grain(x, y, seed + 1));
    return Vec3f{1.02F, 1.0F, 0.95F} * albedo;
  });
}

Texture make_carpet_texture(int size, std::uint32_t seed) {
  return paint_texture(size, [=](int x, int y, float u, float v) {
    const float from_edge = std::min({u, v, 1 - u, 1 - v});
    const float lozenge =
        std::abs(u * 6 - std::floor(u * 6) - 0.5F) + std::abs(v * 6 - std::floor(v * 6) - 0.5F);
    const Vec3f red{0.30F, 0.035F, 0.03F}, cream{0.48F, 0.40F, 0.28F}, blue{0.03F, 0.05F, 0.13F};
    Vec3f wool = mix(red, blue, band(lozenge - 0.5F, 0.09F, 0.02F));
    wool = mix(wool, cream, band(lozenge - 0.2F, 0.05F, 0.02F));
    wool = mix(wool, blue, 1 - smooth_step(0.085F, 0.09F, from_edge));
    wool = mix(wool, cream, band(from_edge - 0.055F, 0.014F, 0.003F));
    const float knots =
        1 + 0.25F * grain(x, y, seed) + 0.3F * fractal_noise(u * 64, v * 64, 3, seed + 1, 64);
    return wool * knots;
  });
}

Texture make_screen_texture(int size) {
  return paint_texture(size, [=](int, int, float u, float v) {
    constexpr float horizon = 0.58F;
    const float from_sun = std::hypot((u - 0.68F) * 1.3F, v - 0.42F);
    const float glow = std::exp(-7 * from_sun * from_sun);
    Vec3f colour = mix({0.10F, 0.22F, 0.60F}, {0.95F, 0.45F, 0.16F}, smooth_step(0, horizon, v));
    const float clouds = fractal_noise(u * 5, v * 16, 4, 3);
    colour = mix(colour, {1.0F, 0.72F, 0.5F}, 0.8F * smooth_step(0.05F, 0.5F, clouds));
    colour = mix(colour, {1.0F, 0.85F, 0.5F}, glow);
    colour = mix({1, 0.97F, 0.8F}, colour, smooth_step(0.07F, 0.08F, from_sun));
    if (v > horizon) {
      const float depth = v - horizon;
      const float waves = fractal_noise(u * 8 / (0.1F + depth), 6 / (0.05F + depth), 3, 4);
      const float path = std::exp(-30 * (u - 0.68F) * (u - 0.68F) / (0.3F + 2 * depth));
      colour =
          mix({0.03F, 0.14F, 0.26F}, {1.0F, 0.66F, 0.3F}, path * smooth_step(-0.2F, 0.3F, waves));
    }
    const float sail = band(u - 0.27F, 0.10F * std::max(0.0F, v - 0.28F), 0.004F);
    if (v > 0.28F && v < 0.6F) colour = mix(colour, {0.95F, 0.92F, 0.88F}, sail);
    if (v >= 0.6F && v < 0.65F) {
      colour =
          mix(colour, {0.25F, 0.02F, 0.02F}, band(u - 0.27F, 0.09F - 0.6F * (v - 0.6F), 0.004F));
    }
    return colour;
  });
}

}  // namespace render
