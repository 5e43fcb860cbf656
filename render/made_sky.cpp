// The made sky: a gradient, two layers of clouds, a line of trees.
#include "render/made_sky.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "calibrate/angles.h"
#include "capture/parallel_loop.h"
#include "render/environment.h"
#include "render/made_noise.h"

namespace render {
namespace {

using calibrate::pi_f;
constexpr float degree_f = pi_f / 180;
constexpr Vec3f sun_colour{1.08F, 1.0F, 0.86F};
// Edge of the disc: full inside, nothing outside. Half its light lies within 0.5 degrees.
constexpr float disc_inner_rad = 0.25F * degree_f;
constexpr float disc_outer_rad = 0.80F * degree_f;
constexpr float disc_share = 0.93F;  // of the sun's irradiance; the rest is glow

struct Weather {
  Vec3f sun;
  float cloudiness;
  std::uint32_t seed;
};

// Cumulus: how thick the layer is where it is met, 0 = clear.
float cumulus(const Weather& weather, float x, float y, int octaves) {
  const float bend = 0.35F * plane_noise(x * 0.7F, y * 0.7F, weather.seed + 11);
  const float shape = fractal_noise(x + bend, y - bend, octaves, weather.seed + 1);
  const float cover = 0.42F - 0.62F * weather.cloudiness;
  return std::max(0.0F, shape - cover * 0.6F) * 2.4F;
}

Vec3f clear_sky(const Weather& weather, Vec3f v) {
  const float up = std::max(v.z, 0.0F);
  const float haze = std::pow(1 - up, 4.0F);
  const Vec3f zenith{0.17F, 0.33F, 0.66F};
  const Vec3f horizon{0.80F, 0.88F, 0.98F};
  const float toward = std::max(0.0F, dot(v, weather.sun));
  const float scattered = 0.75F + 0.25F * toward * toward + 0.5F * std::pow(toward, 12.0F);
  return mix(zenith, horizon, haze) * scattered;
}

Vec3f cloudy_sky(const Weather& weather, Vec3f v) {
  Vec3f sky = clear_sky(weather, v);
  const float up = v.z;
  if (up <= 0.01F) return sky;
  // Where the ray meets the layers; the curved Earth keeps the horizon finite.
  const float reach = 1 / (up + 0.06F);
  const float x = v.x * reach;
  const float y = v.y * reach;
  const float toward = std::max(0.0F, dot(v, weather.sun));

  const float veil =
      smooth_step(-0.25F, 0.75F, fractal_noise(x * 0.5F, y * 1.4F, 6, weather.seed + 7));
  const float forward = 1 + 1.2F * std::pow(toward, 8.0F);
  sky = mix(sky, Vec3f{1.0F, 0.99F, 0.97F} * (0.95F * forward), 0.35F * veil);

  const float thick = cumulus(weather, x * 1.15F, y * 1.15F, 7);
  const float cover = 1 - std::exp(-5 * thick);
  if (cover < 1e-3F) return sky;
  // Light that reaches this spot, through what lies between it and the sun along the layer.
  const float step = 0.10F;
  float between = 0;
  for (int i = 1; i <= 3; ++i) {
    const float along = step * static_cast<float>(i);
    between += cumulus(weather, (x + weather.sun.x * along) * 1.15F,
                       (y + weather.sun.y * along) * 1.15F, 4);
  }
  const float lit = std::exp(-0.55F * between - 0.5F * thick);
  const Vec3f shadow{0.50F, 0.55F, 0.63F};
  const Vec3f bright = Vec3f{1.75F, 1.68F, 1.58F} * (1 + 0.5F * std::pow(toward, 6.0F));
  const Vec3f cloud = mix(shadow, bright, lit);
  const float far = smooth_step(0.02F, 0.22F, up);
  return mix(sky, mix(sky * 1.02F, cloud, 0.35F + 0.65F * far), cover * (0.3F + 0.7F * far));
}

// Trees about the horizon: how high they reach, and how light their leaves are.
Vec3f skyline(const Weather& weather, Vec3f v, Vec3f behind) {
  const float azimuth = std::atan2(v.y, v.x);
  const float elevation = std::asin(std::clamp(v.z, -1.0F, 1.0F)) / degree_f;
  if (elevation < -0.5F) {
    const Vec3f ground{0.20F, 0.19F, 0.165F};
    return mix(ground, behind, 0.15F);
  }
  constexpr int around = 64;  // noise units in a full turn
  const float u = (azimuth / (2 * pi_f) + 0.5F) * around;
  Vec3f colour = behind;
  for (int row = 0; row < 2; ++row) {  // the far row first
    const auto seed = weather.seed + 40 + static_cast<std::uint32_t>(row) * 9;
    const float crowns =
        plane_noise(u * (row == 0 ? 1 : 0.5F), 0.5F, seed, row == 0 ? around : around / 2);
    const float leaves = fractal_noise(u * 8, elevation * 1.5F, 4, seed + 1, around * 8);
    const float top = (row == 0 ? 4.2F : 2.6F) + 2.6F * crowns + 0.9F * leaves;
    const float cover = smooth_step(-0.25F, 0.25F, top - elevation);
    const float sunny =
        0.55F + 0.45F * -std::cos(azimuth - std::atan2(weather.sun.y, weather.sun.x));
    const float shade = 0.55F + 0.45F * leaves + 0.35F * (elevation / 6);
    const Vec3f leaf = row == 0 ? Vec3f{0.15F, 0.19F, 0.13F} : Vec3f{0.075F, 0.115F, 0.045F};
    colour = mix(colour, leaf * ((0.45F + sunny) * std::max(shade, 0.15F)), cover);
  }
  return colour;
}

using Radiance = std::function<Vec3f(Vec3f)>;

// How many directions a side a texel is averaged over, by the direction of its centre.
using Samples = std::function<int(Vec3f)>;

// A map of `radiance`.
capture::Image make_map(int height, const Samples& samples_at, const Radiance& radiance) {
  capture::Image map = capture::make_image(height, 2 * height);
  capture::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < map.width; ++x) {
      const auto fx = static_cast<float>(x);
      const auto fy = static_cast<float>(y);
      const int samples = samples_at(direction_of_texel(fx, fy, map.width, height));
      Vec3f sum{};
      for (int i = 0; i < samples * samples; ++i) {
        const float dy = (static_cast<float>(i / samples) + 0.5F) / static_cast<float>(samples);
        const float dx = (static_cast<float>(i % samples) + 0.5F) / static_cast<float>(samples);
        sum += radiance(direction_of_texel(fx - 0.5F + dx, fy - 0.5F + dy, map.width, height));
      }
      sum *= 1 / static_cast<float>(samples * samples);
      map.at(y, x, 0) = sum.x;
      map.at(y, x, 1) = sum.y;
      map.at(y, x, 2) = sum.z;
    }
  });
  return map;
}

// Scales a map so that its green irradiance on a surface that faces `normal` is `irradiance`.
void scale_to(capture::Image& map, Vec3f normal, float irradiance) {
  double sum = 0;
  for (int y = 0; y < map.height; ++y) {
    const double texel = texel_solid_angle(y, map.width, map.height);
    for (int x = 0; x < map.width; ++x) {
      const Vec3f v =
          direction_of_texel(static_cast<float>(x), static_cast<float>(y), map.width, map.height);
      sum += texel * std::max(0.0F, dot(v, normal)) * map.at(y, x, 1);
    }
  }
  const float scale = irradiance / static_cast<float>(sum);
  for (float& value : map.pixels) value *= scale;
}

}  // namespace

MadeSky make_sky(const MadeSkySettings& settings) {
  if (settings.height < 128) throw std::invalid_argument("a made sky needs 128 rows or more");
  if (!(settings.sun_irradiance > 0) || !(settings.sky_irradiance > 0)) {
    throw std::invalid_argument("a made sky's irradiances must be above 0");
  }
  const float level = std::cos(settings.sun_elevation_rad);
  const Vec3f sun{level * std::cos(settings.sun_azimuth_rad),
                  level * std::sin(settings.sun_azimuth_rad), std::sin(settings.sun_elevation_rad)};
  const Weather weather{sun, settings.cloudiness, settings.seed};

  MadeSky sky;
  sky.sun_direction = sun;
  sky.rest = make_map(
      settings.height, [](Vec3f v) { return v.z < -0.02F ? 1 : 2; },
      [&](Vec3f v) { return skyline(weather, v, cloudy_sky(weather, v)); });
  scale_to(sky.rest, {0, 0, 1}, settings.sky_irradiance);

  const auto angle_to_sun = [&](Vec3f v) {
    return std::acos(std::clamp(dot(v, sun), -1.0F, 1.0F));
  };
  const auto near_disc = [&](Vec3f v) {
    return dot(v, sun) > std::cos(4 * disc_outer_rad) ? 8 : 1;
  };
  sky.sun = make_map(settings.height, near_disc, [&](Vec3f v) {
    const float angle = angle_to_sun(v);
    return sun_colour * (1 - smooth_step(disc_inner_rad, disc_outer_rad, angle));
  });
  scale_to(sky.sun, sun, disc_share * settings.sun_irradiance);
  capture::Image glow = make_map(
      settings.height, [](Vec3f) { return 1; },
      [&](Vec3f v) {
        if (v.z < 0.12F) return Vec3f{};  // trees hide it
        const float angle = angle_to_sun(v) / degree_f;
        return mix(sun_colour, Vec3f{1, 1, 1}, 0.5F) *
               (std::exp(-angle / 2.5F) + 0.06F * std::exp(-angle / 12));
      });
  scale_to(glow, sun, (1 - disc_share) * settings.sun_irradiance);
  for (std::size_t i = 0; i < glow.pixels.size(); ++i) sky.sun.pixels[i] += glow.pixels[i];
  return sky;
}

}  // namespace render
