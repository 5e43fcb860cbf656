// Light from all directions, as the probe sees it.
#include "render/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "render/lobe_filter.h"

namespace render {
namespace {

constexpr float pi = std::numbers::pi_v<float>;

struct Texel {
  int x, y;
};

// Beyond a pole lies the row itself, half way around.
Texel wrapped(int x, int y, int width, int height) {
  if (y < 0 || y >= height) {
    y = std::clamp(y, 0, height - 1);
    x += width / 2;
  }
  if (x < 0) x += width;
  if (x >= width) x -= width;
  return {x, y};
}

Vec3f texel(const capture::Image& map, Texel at) {
  const float* p = &map.pixels[map.index(at.y, at.x)];
  return {p[0], p[1], p[2]};
}

// atan2 to 1e-7 radians, several times as fast as the C library's, and alike everywhere.
//
// Abramowitz and Stegun, "Handbook of Mathematical Functions", formula 4.4.49.
float arc_tangent(float y, float x) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float larger = std::max(ax, ay);
  if (!(larger > 0)) return 0;
  const float t = std::min(ax, ay) / larger;
  const float s = t * t;
  float angle = 0.0028662257F;
  for (const float k : {-0.0161657367F, 0.0429096138F, -0.0752896400F, 0.1065626393F,
                        -0.1420889944F, 0.1999355085F, -0.3333314528F, 1.0F}) {
    angle = angle * s + k;
  }
  angle *= t;
  if (ay > ax) angle = pi / 2 - angle;
  if (x < 0) angle = pi - angle;
  return y < 0 ? -angle : angle;
}

// Where a direction lies in a map of any size: 0..1 from the left, and from the top.
struct MapPoint {
  float u, v;
};

MapPoint map_point(Vec3f direction) {
  const float across = std::sqrt(direction.x * direction.x + direction.y * direction.y);
  return {0.5F - arc_tangent(direction.y, direction.x) / (2 * pi),
          arc_tangent(across, direction.z) / pi};
}

Vec3f bilinear(const capture::Image& map, MapPoint at) {
  const int w = map.width;
  const int h = map.height;
  const float x = at.u * static_cast<float>(w) - 0.5F;
  const float y = at.v * static_cast<float>(h) - 0.5F;
  const float x_floor = std::floor(x);
  const float y_floor = std::floor(y);
  const float fx = x - x_floor;
  const float fy = y - y_floor;
  const int x0 = static_cast<int>(x_floor);
  const int y0 = static_cast<int>(y_floor);
  const Vec3f top =
      texel(map, wrapped(x0, y0, w, h)) * (1 - fx) + texel(map, wrapped(x0 + 1, y0, w, h)) * fx;
  const Vec3f bottom = texel(map, wrapped(x0, y0 + 1, w, h)) * (1 - fx) +
                       texel(map, wrapped(x0 + 1, y0 + 1, w, h)) * fx;
  return top * (1 - fy) + bottom * fy;
}

// `level` = `map` with every value as it counts.
void copy_counted(const capture::Image& map, capture::Image& level) {
  level.height = map.height;
  level.width = map.width;
  level.channels = map.channels;
  level.pixels.resize(map.pixels.size());
  std::ranges::transform(map.pixels, level.pixels.begin(), counted_radiance);
}

}  // namespace

void check(const Environment& env) {
  const capture::Image& map = env.radiance;
  if (map.height < 1 || map.width != 2 * map.height || map.channels != 3 ||
      map.pixels.size() != map.index(map.height, 0)) {
    throw std::invalid_argument("an environment must be twice as wide as high, with 3 channels");
  }
}

Vec3f direction_of_texel(float x, float y, int width, int height) {
  const float azimuth_rad = (0.5F - (x + 0.5F) / static_cast<float>(width)) * 2 * pi;
  const float polar_rad = (y + 0.5F) / static_cast<float>(height) * pi;
  const float sine = std::sin(polar_rad);
  return {sine * std::cos(azimuth_rad), sine * std::sin(azimuth_rad), std::cos(polar_rad)};
}

std::array<float, 2> texel_of_direction(Vec3f direction, int width, int height) {
  const auto [u, v] = map_point(direction);
  return {u * static_cast<float>(width) - 0.5F, v * static_cast<float>(height) - 0.5F};
}

double texel_solid_angle(int row, int width, int height) {
  const double step_rad = std::numbers::pi / height;
  return (std::cos(row * step_rad) - std::cos((row + 1) * step_rad)) * 2 * std::numbers::pi / width;
}

Vec3f radiance_of(const Environment& env, Vec3f direction, float roughness) {
  if (!std::isfinite(direction.x + direction.y + direction.z)) return {};
  if (env.smoothed.empty())
    return env.radiance.empty() ? Vec3f{} : bilinear(env.radiance, map_point(direction));
  const auto last = static_cast<float>(env.smoothed.size() - 1);
  const float level = roughness > 0 ? std::min(roughness, 1.0F) * last : 0.0F;
  const auto below = static_cast<std::size_t>(level);
  const float f = level - static_cast<float>(below);
  const MapPoint at = map_point(direction);
  const Vec3f smoother = bilinear(env.smoothed[below], at);
  if (f == 0) return smoother;
  return smoother * (1 - f) + bilinear(env.smoothed[below + 1], at) * f;
}

Vec3f irradiance_of(const Environment& env, Vec3f normal) {
  const capture::Image& map = env.radiance;
  // What the cosine owes to a column, before the row's sine.
  std::vector<float> across(static_cast<std::size_t>(map.width));
  for (int x = 0; x < map.width; ++x) {
    const float azimuth_rad =
        (0.5F - (static_cast<float>(x) + 0.5F) / static_cast<float>(map.width)) * 2 * pi;
    across[static_cast<std::size_t>(x)] =
        normal.x * std::cos(azimuth_rad) + normal.y * std::sin(azimuth_rad);
  }
  std::array<double, 3> sum{};
  for (int y = 0; y < map.height; ++y) {
    const float polar_rad = (static_cast<float>(y) + 0.5F) / static_cast<float>(map.height) * pi;
    const float sine = std::sin(polar_rad);
    const float along = normal.z * std::cos(polar_rad);
    std::array<float, 3> row{};
    const float* p = &map.pixels[map.index(y, 0)];
    for (std::size_t x = 0; x < across.size(); ++x, p += 3) {
      const float cosine = std::max(sine * across[x] + along, 0.0F);
      for (std::size_t c = 0; c < 3; ++c) row[c] += cosine * counted_radiance(p[c]);
    }
    const double solid_angle = texel_solid_angle(y, map.width, map.height);
    for (std::size_t c = 0; c < 3; ++c) sum[c] += row[c] * solid_angle;
  }
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

void smooth_for_reflections(Environment& env, int levels) {
  check(env);
  if (levels < 2)
    throw std::invalid_argument("an environment needs at least 2 levels of roughness");
  env.smoothed.resize(static_cast<std::size_t>(levels));
  copy_counted(env.radiance, env.smoothed[0]);
  capture::Image shrunk;
  const capture::Image* source = &env.smoothed[0];
  for (int k = 1; k < levels; ++k) {
    const float roughness = static_cast<float>(k) / static_cast<float>(levels - 1);
    const LobeFilter& filter = shared_lobe_filter(roughness * roughness);
    if (source->height != filter.height()) {
      // From what the level before was made of: the rougher, the smaller.
      shrunk = area_averaged(*source, filter.height());
      source = &shrunk;
    }
    filter.apply(*source, env.smoothed[static_cast<std::size_t>(k)]);
  }
}

Environment environment_from_map(const capture::Image& map, double yaw_rad, int height) {
  Environment env;
  env.radiance = map;
  check(env);
  if (height < 1 || height > 4096 || !std::isfinite(yaw_rad)) {
    throw std::invalid_argument("an environment's height must be from 1 to 4096");
  }
  const capture::Image level = area_averaged(map, height);
  env.radiance = capture::make_image(height, 2 * height);
  env.seen.assign(env.radiance.pixels.size() / 3, 1);
  // Turned to the left by yaw, the map's columns move left; what lies between two is shared.
  const int width = 2 * height;
  const double turns = yaw_rad / (2 * std::numbers::pi);
  const double moved = (turns - std::floor(turns)) * width;
  const int whole = static_cast<int>(moved) % width;
  const auto part = static_cast<float>(moved - std::floor(moved));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int from = (x + whole) % width;
      const int next = (from + 1) % width;
      for (int c = 0; c < 3; ++c) {
        env.radiance.at(y, x, c) = level.at(y, from, c) * (1 - part) + level.at(y, next, c) * part;
      }
    }
  }
  return env;
}

}  // namespace render
