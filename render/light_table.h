// The light as a table of directional lights.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "render/environment.h"

namespace render {

struct DirectionalLight {
  Vec3f direction;   // unit, towards the light
  Vec3f irradiance;  // on a surface facing it: radiance integrated over its solid angle
  float spread;      // angular radius of the region that it stands for, radians
  friend bool operator==(const DirectionalLight&, const DirectionalLight&) = default;
};

// A small lamp of the set: a point, or one sample of a glowing surface.
struct LocalLight {
  Vec3f position;
  Vec3f normal;     // zero = shines to all sides; else cosine-weighted about it
  Vec3f intensity;  // radiant intensity (along the normal), so irradiance = intensity / distance^2
  friend bool operator==(const LocalLight&, const LocalLight&) = default;
};

struct LightTable {
  std::vector<DirectionalLight> lights;
  std::vector<LocalLight> lamps;
  std::uint64_t version = 0;
  float unseen_share = 0;     // of the upward irradiance: filled, not measured
  float error_estimate = 0;   // relative RMS error of shading that the table expects of itself
  friend bool operator==(const LightTable&, const LightTable&) = default;
};

enum class LightMethod { median_cut, split };

struct LightTableSettings {
  int count = 64;
  LightMethod method = LightMethod::split;
  float bright_share = 0.125F;  // split: share of the lights kept for bright compact sources
};

// The table of an environment. Works on a copy area-averaged to 256x128 or less. NaN and negative
// radiance count as 0. A black map gives an empty table. Deterministic.
//
// Debevec, "A Median Cut Algorithm for Light Probe Sampling", SIGGRAPH 2005 posters; bright sources
// are split off first, as the design says.
LightTable make_light_table(const Environment& env, const LightTableSettings& settings);

}  // namespace render
