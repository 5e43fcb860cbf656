// Irradiance of surfaces behind straight-edged occluders: what a table of lights is judged by.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "render/light_regions.h"
#include "tests/render/sun_and_sky.h"

namespace render {

// Surfaces that face upward, each with a half-space that hides its light from one side.
struct ShadedSurface {
  Vec3f normal;
  Vec3f open_side;
};

inline std::vector<ShadedSurface> shaded_surfaces(int count) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::vector<ShadedSurface> surfaces;
  for (const Vec3f n : upward_normals(count)) {
    surfaces.push_back({n, normalize(Vec3f{normal(random), normal(random), normal(random)})});
  }
  return surfaces;
}

// Luminance of the irradiance on each surface, without and with its occluder.
struct Shading {
  std::vector<double> open, shadowed;
};

inline void add_light(Vec3f direction,
                      double luminance,
                      const std::vector<ShadedSurface>& surfaces,
                      Shading& sum) {
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const float cosine = dot(direction, surfaces[i].normal);
    if (cosine <= 0) continue;
    sum.open[i] += luminance * cosine;
    if (dot(direction, surfaces[i].open_side) > 0) sum.shadowed[i] += luminance * cosine;
  }
}

inline Shading shade_by_map(const Environment& env, const std::vector<ShadedSurface>& surfaces) {
  const capture::Image& map = env.radiance;
  Shading sum{std::vector<double>(surfaces.size()), std::vector<double>(surfaces.size())};
  for (int y = 0; y < map.height; ++y) {
    const double solid_angle = texel_solid_angle(y, map.width, map.height);
    for (int x = 0; x < map.width; ++x) {
      const float* p = &map.pixels[map.index(y, x)];
      const Vec3f d =
          direction_of_texel(static_cast<float>(x), static_cast<float>(y), map.width, map.height);
      add_light(d,
                luminance(counted_radiance(p[0]), counted_radiance(p[1]), counted_radiance(p[2])) *
                    solid_angle,
                surfaces, sum);
    }
  }
  return sum;
}

inline Shading shade_by_table(const LightTable& table, const std::vector<ShadedSurface>& surfaces) {
  Shading sum{std::vector<double>(surfaces.size()), std::vector<double>(surfaces.size())};
  for (const DirectionalLight& light : table.lights) {
    add_light(light.direction,
              luminance(light.irradiance.x, light.irradiance.y, light.irradiance.z), surfaces, sum);
  }
  return sum;
}

inline double relative_rms(const std::vector<double>& values, const std::vector<double>& truth) {
  double errors = 0;
  double squares = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    errors += (values[i] - truth[i]) * (values[i] - truth[i]);
    squares += truth[i] * truth[i];
  }
  return std::sqrt(errors / squares);
}

}  // namespace render
