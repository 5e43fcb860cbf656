// Points of light between surfaces, gathered into lamps. Private to render.
#pragma once

#include <cstddef>
#include <vector>

#include "render/light_table.h"
#include "render/shader.h"

namespace render {

// One side of a piece of surface.
struct SurfacePoint {
  HitPoint hit;
  Vec3f albedo;
  float area_m2 = 0;
  float stays = 0;  // share of its light that meets something
  Vec3f sent;       // under the planned light: its intensity along its normal
};

// Lamps with the points that each stands for.
struct Lamps {
  std::vector<LocalLight> lamps;
  std::vector<std::vector<std::size_t>> points;
};

// At most so many lamps, of all points that send light, cut as by Debevec ("A Median Cut
// Algorithm for Light Probe Sampling", SIGGRAPH 2005 posters), in places and facings.
Lamps stand_lamps(const std::vector<SurfacePoint>& points, int most);

}  // namespace render
