// The light as a table of directional lights.
#include "render/light_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "render/light_regions.h"
#include "render/region_parts.h"

namespace render {

void check(const LightTableSettings& settings) {
  if (settings.count < 1 || settings.count > most_lights) {
    throw std::invalid_argument("a light table has from 1 to 4096 lights, not " +
                                std::to_string(settings.count));
  }
}

namespace {

// What must be added to the squared distance so that a lamp's irradiance is that of a disc of its
// area: from afar by the integral's second order, close by as on the disc's axis, where the radius'
// square is exact.
float nearness(
    const LampReceiver& point, const LocalLight& lamp, float cosine, float facing, float squared) {
  if (!(lamp.area_m2 > 0)) return 0;
  const float radius_squared = lamp.area_m2 / std::numbers::pi_v<float>;
  float afar = 1;
  if (lamp.normal != Vec3f{}) {
    const float along = -dot(point.normal, lamp.normal) * facing;
    const float ratio = std::clamp(along, -2 * cosine, 2 * cosine) / cosine;
    afar = std::clamp(3 * facing * facing - 1 - ratio, -2.0F, 1.0F);
  }
  const float close = radius_squared / (radius_squared + squared);
  return radius_squared * (close + (1 - close) * afar);
}

}  // namespace

std::optional<LampRay> ray_to_lamp(const LampReceiver& point, const LocalLight& lamp) {
  if (lamp.ambient != 0) return LampRay{{0, 0, 1}, 0, 1};
  const Vec3f to = lamp.position - point.origin;
  const float squared = dot(to, to);
  const float distance = std::sqrt(squared);
  if (!(distance > 1e-6F)) return std::nullopt;
  const Vec3f l = to * (1 / distance);
  const float cosine = dot(point.normal, l);
  if (!(cosine > 0) || !(dot(point.geometric_normal, l) > 0)) return std::nullopt;
  const float facing = lamp.normal == Vec3f{} ? 1.0F : -dot(lamp.normal, l);
  if (!(facing > 0)) return std::nullopt;
  return LampRay{l, distance * (1 - 1e-3F),
                 cosine * facing / (squared + nearness(point, lamp, cosine, facing, squared))};
}

LightTable make_light_table(const Environment& env, const LightTableSettings& settings) {
  check(settings);
  check(env);
  LightTable table;
  table.unseen_share = env.unseen_share;
  const capture::Image map = light_map(env);
  const LightRegions regions = cut_light_regions(map, settings);
  for (const RegionLight& region : sum_regions(regions, map, env.radiance)) {
    table.lights.push_back(make_light(region));
  }
  table.parts = part_regions(regions, map, table.lights);
  table.error_estimate = estimate_light_error(table.lights, env.radiance.height);
  return table;
}

}  // namespace render
