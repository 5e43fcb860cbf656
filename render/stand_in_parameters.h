// The parameter block of the shader "stand_in": how a real surface answers to virtual objects.
#pragma once

#include <algorithm>
#include <cstdint>

#include "render/mesh.h"

namespace render {

// Plain bytes, as every parameter block. The shader itself lives in compositing; the block is here
// because the reference renders stand-ins too.
struct StandInParameters {
  float albedo[3] = {0.2F, 0.2F, 0.2F};  // of the real surface, where the plate does not tell it
  float reflectance = 0;                 // at normal incidence (Schlick's F0); 0 = no reflection
  float roughness = 0;                   // of that reflection
  std::uint32_t catches_shadow = 1;      // switches, 0 or 1
  std::uint32_t catches_reflection = 0;
  std::uint32_t catches_light = 1;  // of virtual lamps
};

// The block in a material of the shader "stand_in". Throws std::invalid_argument, naming the
// material, if it is not one, or albedo, reflectance or roughness are not 0 to 1.
StandInParameters stand_in_parameters(const Material& material);

// A plate pixel at or above this, of display white, may have been brighter than the camera could
// say.
inline constexpr float clipped_plate = 0.98F;
// Below this, noise decides what albedo a plate pixel implies.
inline constexpr float dark_plate = 0.002F;

// Whether a plate pixel tells the albedo of the surface that it shows: pi plate / irradiance, at
// most 1.
inline bool plate_tells_albedo(Vec3f plate, Vec3f irradiance) {
  constexpr float pi = 3.14159265F;
  const auto tells = [](float value, float e) { return value > dark_plate && pi * value <= e; };
  return std::max({plate.x, plate.y, plate.z}) < clipped_plate && tells(plate.x, irradiance.x) &&
         tells(plate.y, irradiance.y) && tells(plate.z, irradiance.z);
}

// A pixel of the plate, and the light that comes to it. Where a stand-in mirrors something virtual
// that is darker than what was there, light goes away: but no more than the pixel has.
inline Vec3f with_light(Vec3f plate, Vec3f added) {
  const auto sum = [](float p, float a) {
    return a < 0 ? std::max(p + a, std::min(p, 0.0F)) : p + a;
  };
  return {sum(plate.x, added.x), sum(plate.y, added.y), sum(plate.z, added.z)};
}

}  // namespace render
