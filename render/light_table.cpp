// The light as a table of directional lights.
#include "render/light_table.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "render/lamp_way.h"
#include "render/light_regions.h"
#include "render/region_parts.h"

namespace render {

void check(const LightTableSettings& settings) {
  if (settings.count < 1 || settings.count > most_lights) {
    throw std::invalid_argument("a light table has from 1 to 4096 lights, not " +
                                std::to_string(settings.count));
  }
}

std::optional<LampRay> ray_to_lamp(const LampReceiver& point, const LocalLight& lamp) {
  if (lamp.ambient != 0) return LampRay{{0, 0, 1}, 0, 1};
  const LampWay<float> way = way_to_lamp(point.origin, point.normal, point.geometric_normal, lamp);
  if (!way.shines) return std::nullopt;
  return LampRay{way.direction, way.distance_m * before_lamp, way.per_intensity};
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
