// The light as a table of directional lights.
#include "render/light_table.h"

#include <stdexcept>
#include <string>

#include "render/light_regions.h"

namespace render {

void check(const LightTableSettings& settings) {
  if (settings.count < 1 || settings.count > most_lights) {
    throw std::invalid_argument("a light table has from 1 to 4096 lights, not " +
                                std::to_string(settings.count));
  }
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
  table.error_estimate = estimate_light_error(table.lights, env.radiance.height);
  return table;
}

}  // namespace render
