// Directions all over the regions of the sky that lights of a table stand for.
#pragma once

#include <span>
#include <vector>

#include "render/light_regions.h"

namespace render {

// For each region of a map that it was cut from, sixteen directions that have a sixteenth of its
// light each: a shadow that covers a part of the region then takes as much as it has there,
// whatever the region's shape is and wherever in it light is brightest. They lie about the
// direction of the region's light, as far apart in the mean of squares as that is wide. A region
// without light has nothing but its middle. `lights`: one for each region.
std::vector<RegionParts> part_regions(const LightRegions& regions,
                                      const capture::Image& map,
                                      std::span<const DirectionalLight> lights);

}  // namespace render
