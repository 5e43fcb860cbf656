// A made sky: sun, clouds and skyline as maps, the sun apart from the rest.
#pragma once

#include <cstdint>

#include "calibrate/vec.h"
#include "capture/image.h"

namespace render {

using calibrate::Vec3f;

// Radiance has the plate's units: 1 is display white.
struct MadeSkySettings {
  int height = 512;           // of the maps; they are twice as wide
  float sun_azimuth_rad = 0;  // counter-clockwise from x, seen from above
  float sun_elevation_rad = 0.7F;
  float sun_irradiance = 2.2F;  // of the sun and its glow on a surface that faces it, green
  float sky_irradiance = 1.5F;  // of all else on a surface that faces up, green
  float cloudiness = 0.5F;      // 0 = clear, 1 = overcast
  std::uint32_t seed = 1;
};

// Latitude-longitude maps (height, 2 * height, 3) as in render::Environment. The sky at a moment is
// rest + strength * sun, with strength 1 for a sun that no cloud dims.
struct MadeSky {
  capture::Image sun;   // disc of 0.5 degrees radius, softened to the map, and the glow about it
  capture::Image rest;  // sky, clouds, trees on the horizon, haze below it
  Vec3f sun_direction;
};

// The same settings give the same maps. Throws std::invalid_argument if height is below 128 or an
// irradiance is not above 0.
MadeSky make_sky(const MadeSkySettings& settings);

}  // namespace render
