// Light from all directions, as the probe sees it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "calibrate/vec.h"
#include "capture/image.h"

namespace render {

using calibrate::Vec3f;

// Latitude-longitude map in the set's frame: row 0 looks up (+z); column u = (x + .5) / width
// stands for azimuth atan2(y, x) = (0.5 - u) * 2 pi. Radiance in the plate's units (match applied).
struct Environment {
  capture::Image radiance;         // (height, 2 * height, 3)
  std::vector<std::uint8_t> seen;  // per texel, 1 = the probe saw it, 0 = filled
  // The map smoothed by GGX lobes of growing roughness, for reflections: level k is for roughness
  // k / (levels - 1), each (level_height[k], 2 * level_height[k], 3). Level 0 is `radiance` itself,
  // with not-a-number and negative values as 0.
  std::vector<capture::Image> smoothed;
  // Level 0 of it, averaged over 2x2, 4x4, ... texels (halved[0] is half as high), for narrow
  // cones.
  std::vector<capture::Image> halved;
  // Levels from 1 on lack the light of the sources that the light table marks as compact: rough
  // lobes see those one by one, where nothing hides them.
  bool compact_apart = false;
  // Then also `smoothed[0]` and `halved` without that light, in this order, for the narrow cones
  // that rays take all over a rough lobe.
  std::vector<capture::Image> diffused;
  float unseen_share = 0;  // of the irradiance on a surface that faces up: filled, not measured
};

// Throws std::invalid_argument if `radiance` is not (height, 2 * height, 3).
void check(const Environment& env);

// Of the rest of it: places are found by the sizes of the levels and looked up without a check.
inline constexpr std::size_t most_environment_levels = 128;
// Throws std::invalid_argument, saying which, unless every level is twice as wide as high, with 3
// channels, `smoothed[0]` is of the size of `radiance`, each of `halved` half as high as the one
// before, `diffused` of the sizes of these, or empty; or if all are more than
// most_environment_levels. Without `smoothed`, there may be `radiance` alone.
void check_levels(const Environment& env);

// The brightest radiance that counts; brighter ones, and infinity, are taken as this.
inline constexpr float brightest_radiance = 1e9F;

// What a stored radiance counts as: not-a-number and negative values are 0.
inline float counted_radiance(float stored) {
  return stored > 0 ? (stored < brightest_radiance ? stored : brightest_radiance) : 0.0F;
}

// Direction of a texel and back, both continuous: (0, 0) is the centre of the top-left texel,
// -0.5 <= x <= width - 0.5, -0.5 <= y <= height - 0.5. Straight up and down, x is that of azimuth
// 0.
Vec3f direction_of_texel(float x, float y, int width, int height);
std::array<float, 2> texel_of_direction(Vec3f direction, int width, int height);

// Solid angle of each texel of a row, in steradians.
double texel_solid_angle(int row, int width, int height);

// How directions change across a sample's cone, one way and the other: full widths in radians, both
// perpendicular to the middle direction, as conjugate diameters of an ellipse. Nothing: one ray.
struct Spread {
  Vec3f a, b;
};

// Radiance in a direction (unit), as a lobe of `roughness` 0..1 mirrors it to a sample whose cone
// of directions has that spread: what is narrower than the first smoothed level comes from the
// halved ones, in several steps along a cone that is longer than wide, and all from `radiance`
// where neither is filled. A direction that is not finite gives 0; a spread that is not counts as
// none.
Vec3f radiance_of(const Environment& env,
                  Vec3f direction,
                  float roughness,
                  const Spread& spread = {});

// The same as places to look up: radiance_of() is the sum of their shares of what radiance_at()
// finds there. They depend on the sizes of an environment's levels, not on its light.
struct MapSample {
  float x, y;  // in texels, (0, 0) the centre of the top-left one
  float share;
  std::uint32_t level;  // `smoothed` [0], `halved`, the rest of `smoothed`, `diffused`
};
inline constexpr std::size_t most_map_samples = 112;
std::size_t find_map_samples(const Environment& env,
                             Vec3f direction,
                             float roughness,
                             const Spread& spread,
                             std::span<MapSample, most_map_samples> samples);
// Of a cone without the light of compact sources, where they are apart.
std::size_t find_diffused_samples(const Environment& env,
                                  Vec3f direction,
                                  const Spread& spread,
                                  std::span<MapSample, most_map_samples> samples);
// All levels in the order that MapSample counts them.
std::vector<const capture::Image*> levels_of(const Environment& env);
// Of these the number of the level of half the width that shows the same; `level` itself where
// there is none.
std::size_t halved_level(const Environment& env, std::size_t level);
// A level's radiance at a place, bilinear. Poles and the seam are passed as on the sphere.
Vec3f radiance_at(const capture::Image& level, float x, float y);

// Irradiance on a surface that faces `normal` (unit), summed over all texels.
Vec3f irradiance_of(const Environment& env, Vec3f normal);

// The same of texels that the probe saw, and of those that were filled in.
struct SplitIrradiance {
  Vec3f seen, filled;
  float seen_share = 1;  // of what lights the surface, were all directions alike
};
SplitIrradiance split_irradiance_of(const Environment& env, Vec3f normal);

// Fills `smoothed` with `levels` (at least 2) levels, and `halved`. About 2 ms for 512x256. The
// lobe is that of a surface seen head-on, the same all around, of alpha = roughness^2; what it
// would send below the surface is mirrored up again, as in standard.h, so every level keeps a white
// map white. Throws std::invalid_argument as check(), or if levels is below 2.
void smooth_for_reflections(Environment& env, int levels = 6);

// Texels of compact sources: a coarse map (height, 2 * height), 1 where there is one.
struct CompactTexels {
  int height = 0;  // divides the environment's; 0 = none
  std::vector<std::uint8_t> is_compact;
};

// The same with the light of those texels left out of all levels but the first (compact_apart).
// Throws also if that map is not of its size, or its height does not divide the environment's.
void smooth_for_reflections(Environment& env, const CompactTexels& compact, int levels = 6);

// The share of a lobe's light that comes from levels that compact sources are left out of, 0..1.
float share_without_compact(const Environment& env, float roughness, const Spread& spread);

// The environment of a whole latitude-longitude map (any height, twice as wide, 3 channels), row 0
// up and its middle column towards azimuth yaw_rad, averaged or interpolated to `height` rows. All
// of it counts as seen. Throws std::invalid_argument as check(), or unless height is from 1 to
// 4096.
Environment environment_from_map(const capture::Image& map, double yaw_rad, int height = 256);

// How directions that the probe did not see are filled: see ProbeMapper.
enum class Unseen { floor, mirror, mean };

}  // namespace render
