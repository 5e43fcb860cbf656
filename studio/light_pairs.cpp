// What both of a set's cameras tell the light of.
#include "studio/light_pairs.h"

#include <algorithm>
#include <cmath>

namespace studio {
namespace {

bool is_light(const std::array<double, 3>& colour) {
  return std::ranges::all_of(colour, [](double v) { return v > 0 && std::isfinite(v); });
}

}  // namespace

void add_light_pair(const calibrate::LightPair& pair, std::vector<calibrate::LightPair>& pairs) {
  if (is_light(pair.probe) && is_light(pair.plate)) pairs.push_back(pair);
}

std::vector<calibrate::LightPair> light_pairs_of(std::span<const render::OverlapTexel> overlap,
                                                 std::size_t frame) {
  std::vector<calibrate::LightPair> pairs;
  for (const render::OverlapTexel& both : overlap) {
    calibrate::LightPair pair;
    std::ranges::copy(both.probe, pair.probe.begin());
    std::ranges::copy(both.plate, pair.plate.begin());
    pair.frame = frame;
    pair.thing = both.texel;
    add_light_pair(pair, pairs);
  }
  return pairs;
}

}  // namespace studio
