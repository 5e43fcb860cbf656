// Made skies: a smooth sky with clouds, a dark ground, and a sun of any size and strength.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "render/environment.h"

namespace render {

struct SunAndSky {
  float sun_radius_rad = 0.00465F;  // the real sun's
  float sun_irradiance = 2.5F;      // on a surface that faces it
  float sun_azimuth_rad = -0.35F;
  float sun_elevation_rad = 0.73F;
  float clouds = 0.9F;
};

inline Vec3f sun_direction(const SunAndSky& sky) {
  const float c = std::cos(sky.sun_elevation_rad);
  return {c * std::cos(sky.sun_azimuth_rad), c * std::sin(sky.sun_azimuth_rad),
          std::sin(sky.sun_elevation_rad)};
}

inline Vec3f radiance_without_sun(const SunAndSky& sky, Vec3f d) {
  if (d.z <= 0) return {.14F, .13F, .11F};
  const float t = (1 - d.z) * (1 - d.z) * (1 - d.z);
  Vec3f c = Vec3f{.18F, .32F, .62F} * (1 - t) + Vec3f{.75F, .8F, .85F} * t;
  c += Vec3f{1.2F, 1.F, .7F} * std::exp(-(1 - dot(d, sun_direction(sky))) * 30);
  const float cloud = std::sin(7 * d.x / (d.z + .2F)) * std::sin(6 * d.y / (d.z + .2F) + 1) - .2F;
  if (cloud > 0) c += Vec3f{1, 1, 1} * (sky.clouds * cloud);
  return c;
}

// (height, 2 * height, 3). The sun's irradiance is exact, however few texels it covers.
inline Environment make_sun_and_sky(const SunAndSky& sky, int height) {
  Environment env;
  env.radiance = capture::make_image(height, 2 * height);
  env.seen.assign(env.radiance.pixels.size() / 3, 1);
  const Vec3f sun = sun_direction(sky);
  const float cos_radius = std::cos(sky.sun_radius_rad);
  const float texel_rad = std::numbers::pi_v<float> / static_cast<float>(height);
  std::vector<float> coverage(env.seen.size());
  double solid_angle = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < 2 * height; ++x) {
      const Vec3f d =
          direction_of_texel(static_cast<float>(x), static_cast<float>(y), 2 * height, height);
      const Vec3f c = radiance_without_sun(sky, d);
      float* p = &env.radiance.pixels[env.radiance.index(y, x)];
      p[0] = c.x;
      p[1] = c.y;
      p[2] = c.z;
      if (std::acos(std::min(dot(d, sun), 1.0F)) > sky.sun_radius_rad + 1.5F * texel_rad) continue;
      constexpr int steps = 16;
      int inside = 0;
      for (int i = 0; i < steps * steps; ++i) {
        const float dx = (static_cast<float>(i % steps) + .5F) / steps - .5F;
        const float dy = (static_cast<float>(i / steps) + .5F) / steps - .5F;
        const Vec3f e = direction_of_texel(static_cast<float>(x) + dx, static_cast<float>(y) + dy,
                                           2 * height, height);
        inside += dot(e, sun) > cos_radius;
      }
      const std::size_t at = static_cast<std::size_t>(y * 2 * height + x);
      coverage[at] = static_cast<float>(inside) / (steps * steps);
      solid_angle += coverage[at] * texel_solid_angle(y, 2 * height, height);
    }
  }
  if (solid_angle == 0) {  // smaller than the sampling sees: all of it in the texel that it is in
    const auto [x, y] = texel_of_direction(sun, 2 * height, height);
    const int row = static_cast<int>(std::lround(y));
    coverage[static_cast<std::size_t>(row * 2 * height + static_cast<int>(std::lround(x)))] = 1;
    solid_angle = texel_solid_angle(row, 2 * height, height);
  }
  const auto radiance = static_cast<float>(sky.sun_irradiance / solid_angle);
  for (std::size_t i = 0; i < coverage.size(); ++i) {
    env.radiance.pixels[3 * i] += coverage[i] * radiance;
    env.radiance.pixels[3 * i + 1] += .93F * coverage[i] * radiance;
    env.radiance.pixels[3 * i + 2] += .8F * coverage[i] * radiance;
  }
  return env;
}

inline Environment make_even_environment(float radiance, int height) {
  Environment env;
  env.radiance = capture::make_image(height, 2 * height);
  std::fill(env.radiance.pixels.begin(), env.radiance.pixels.end(), radiance);
  env.seen.assign(env.radiance.pixels.size() / 3, 1);
  return env;
}

// The same map with each texel's light changed by independent noise, sigma relative.
inline Environment with_noise(const Environment& env, float sigma, unsigned seed) {
  Environment noisy = env;
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(1, sigma);
  for (std::size_t i = 0; i < noisy.radiance.pixels.size(); i += 3) {
    const float factor = std::max(normal(random), 0.0F);
    for (std::size_t c = 0; c < 3; ++c) noisy.radiance.pixels[i + c] *= factor;
  }
  return noisy;
}

// ShadedSurface normals evenly over the upper half.
inline std::vector<Vec3f> upward_normals(int count) {
  std::vector<Vec3f> normals;
  for (int i = 0; i < count; ++i) {
    const float z = (static_cast<float>(i) + .5F) / static_cast<float>(count);
    const float azimuth = static_cast<float>(i) * 2.39996323F;
    const float r = std::sqrt(1 - z * z);
    normals.push_back({r * std::cos(azimuth), r * std::sin(azimuth), z});
  }
  return normals;
}

}  // namespace render
