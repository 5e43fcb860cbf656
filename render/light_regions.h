// A map of light cut into regions, one for each light of a table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/light_table.h"

namespace render {

// The largest map that lights are cut from: (128, 256).
inline constexpr int light_map_height = 128;

// What lights are cut from: the environment area-averaged to that size or, if it is smaller, its
// own, with every value as it counts.
capture::Image light_map(const Environment& env);

// Which light each texel of a small map belongs to. Every texel belongs to one.
struct LightRegions {
  int height = 0;                    // the map is (height, 2 * height)
  std::vector<std::uint16_t> light;  // per texel
  std::size_t count = 0;             // of lights
  std::vector<std::uint8_t> bright;  // per light, 1 = part of a bright compact source
};

// Cuts a map (height, 2 * height, 3), which holds no negative and no unfinished value, into at most
// settings.count regions with light in them. A black map gives none.
LightRegions cut_light_regions(const capture::Image& map, const LightTableSettings& settings);

// What a region's light adds up to.
struct RegionLight {
  std::array<double, 3> irradiance{};  // radiance times solid angle
  double luminance = 0;                // of it
  std::array<double, 3> moment{};      // luminance times direction
};

// Sums a map of the regions' size over each region.
std::vector<RegionLight> sum_regions(const LightRegions& regions, const capture::Image& map);

// The same, but the directions of bright sources come from the finer map that `map` was averaged
// from, so that a small sun is not moved to the middle of a texel.
std::vector<RegionLight> sum_regions(const LightRegions& regions,
                                     const capture::Image& map,
                                     const capture::Image& finer);

// The light that stands for a region: in the direction of its centroid.
DirectionalLight make_light(const RegionLight& region);

// The relative RMS error of shading to be expected of lights made from an environment of a height:
// of the irradiance on surfaces of all orientations behind occluders of all orientations. A light
// errs where a shadow's edge passes through its region, by a part of its energy; the chance of that
// grows with the region's radius. In units of the plate: what is brighter than four times display
// white counts as that bright, as in the error of a picture.
float estimate_light_error(std::span<const DirectionalLight> lights, int map_height);

// Luminance of linear Rec.709 colours.
inline float luminance(float r, float g, float b) { return .2126F * r + .7152F * g + .0722F * b; }

}  // namespace render
