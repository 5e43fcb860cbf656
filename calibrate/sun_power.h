// The power of a sun that clips even the shortest exposure, from its shadow on the plate's floor.
#pragma once

#include <array>

namespace calibrate {

// Two patches of one level, matt material on the plate, one lit by the sun and one in its shadow.
// Per colour, red, green, blue; irradiance in the probe's unit.
struct SunPatches {
  std::array<double, 3> lit{};     // mean of the plate's linear values over the lit patch, > 0
  std::array<double, 3> shadow{};  // and over the shadow, > 0
  std::array<double, 3> lit_sigma{};
  std::array<double, 3> shadow_sigma{};
  // Irradiance of the patches' plane by everything but the sun; the shadow's is less where what
  // casts it hides sky.
  std::array<double, 3> sky_at_lit{};
  std::array<double, 3> sky_at_shadow{};
  double sun_cosine = 1;  // between the plane's normal and the sun, > 0
};

// Irradiance by the sun of a plane that faces it, and its standard deviation by the patches'.
struct SunPower {
  std::array<double, 3> irradiance{};
  std::array<double, 3> sigma{};
};

// lit / shadow = (sky_at_lit + sun * cosine) / sky_at_shadow, as albedo and the plate's gain are
// alike in both patches: Debevec et al., "Estimating Surface Reflectance Properties of a Complex
// Scene under Captured Natural Illumination", USC ICT-TR-06.2004, solve a clipped sun
// from a diffuse ball in this way; we take the plate's own floor. Throws std::invalid_argument
// for values that are not finite or above 0; std::runtime_error if the lit patch is not brighter
// than the sky alone would make it.
SunPower solve_sun_power(const SunPatches& patches);

}  // namespace calibrate
