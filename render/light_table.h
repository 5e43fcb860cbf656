// The light as a table of directional lights.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "render/environment.h"

namespace render {

struct DirectionalLight {
  Vec3f direction;            // unit, towards the light
  Vec3f irradiance;           // on a surface facing it: radiance integrated over its solid angle
  float spread;               // angular radius of the region that it stands for, radians
  std::uint32_t compact = 0;  // 1 = part of a bright compact source, and its light is apart from
                              // the smoothed levels of the environment (Environment::compact_apart)
  Vec3f planned{};  // the irradiance by which sampling is decided (FrameInputs::planned); zero = as
                    // is
  friend bool operator==(const DirectionalLight&, const DirectionalLight&) = default;
};

// Directions all over the region that a light stands for; each of them has as much of its light.
struct RegionParts {
  static constexpr std::size_t side = 4;
  static constexpr std::size_t count = side * side;
  std::array<Vec3f, count> directions;  // unit; those that lie together in blocks lie so in the sky
  friend bool operator==(const RegionParts&, const RegionParts&) = default;
};

inline constexpr std::uint32_t no_instance = ~0U;

// A small lamp of the set: a point, or one sample of a glowing surface. Its intensity may change
// from frame to frame without a ray being taken; what shadows it casts depends on the rest.
struct LocalLight {
  Vec3f position;
  Vec3f normal;     // zero = shines to all sides; else cosine-weighted about it
  Vec3f intensity;  // radiant intensity (along the normal), so irradiance = intensity / distance^2
  Vec3f planned{};  // the intensity by which sampling is decided; zero = as is
  // Of the glowing surface, m^2: irradiance is about that of a disc, and has an end where surfaces
  // meet. 0 = a point.
  float area_m2 = 0;
  // 1 = light from everywhere: irradiance = intensity on any surface, without shadow.
  std::uint32_t ambient = 0;
  // Of the glowing surface: where lobes are rough enough to mirror its lamps, they do not meet the
  // surface itself as well. no_instance: lobes do not mirror the lamp.
  std::uint32_t instance = no_instance, material = 0;
  // 1 = it stands for what a surface sends back of other light (BouncedLight): a reference leaves
  // it out, and follows light between surfaces instead.
  std::uint32_t bounced = 0;
  friend bool operator==(const LocalLight&, const LocalLight&) = default;
};

// A point that a lamp may shine on, off its surface.
struct LampReceiver {
  Vec3f origin, normal, geometric_normal;
};

// The way from a point to a lamp.
struct LampRay {
  Vec3f direction;      // unit
  float far_m = 0;      // just before the lamp; 0 = nothing can be in the way
  float per_intensity;  // irradiance
};

// Nothing if the lamp does not shine there, whatever is in the way.
std::optional<LampRay> ray_to_lamp(const LampReceiver& point, const LocalLight& lamp);

struct LightTable {
  std::vector<DirectionalLight> lights;
  std::vector<RegionParts> parts;  // of the first lights; the regions of others count as discs
  std::vector<LocalLight> lamps;
  std::uint64_t version = 0;
  float unseen_share = 0;    // of the upward irradiance: filled, not measured
  float error_estimate = 0;  // relative RMS error of shading that the table expects of itself
  friend bool operator==(const LightTable&, const LightTable&) = default;
};

// median_cut: regions of equal energy, cut across their longer side.
// split: bright compact sources (sun, lamps, windows) are told from the rest and cut apart from it;
// the region whose shadows would err most is cut next, where its parts spread least. So sources get
// lights in proportion to their energy and size.
enum class LightMethod { median_cut, split };

// So many lights are marked compact at most.
inline constexpr std::size_t most_compact_lights = 32;

struct LightTableSettings {
  int count = 64;
  LightMethod method = LightMethod::split;
  friend bool operator==(const LightTableSettings&, const LightTableSettings&) = default;
};

inline constexpr int most_lights = 4096;

// Throws std::invalid_argument unless count is from 1 to 4096.
void check(const LightTableSettings& settings);

// The table of an environment: at most `count` lights. Works on a copy area-averaged to 256x128 or
// less; directions of bright sources are taken from the full map. NaN and negative radiance count
// as 0. A black map gives an empty table. The lights' irradiances add up to the map's radiance
// times solid angle. Deterministic. Throws std::invalid_argument as check(), or if the map is none.
//
// Debevec, "A Median Cut Algorithm for Light Probe Sampling", SIGGRAPH 2005 posters. Where to cut,
// in `split`: Viriyothai and Debevec, "Variance Minimization Light Probe Sampling", SIGGRAPH 2009
// posters; which region to cut next is ours.
LightTable make_light_table(const Environment& env, const LightTableSettings& settings);

}  // namespace render
