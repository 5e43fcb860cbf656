// A made car: procedural, at real size.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/mesh.h"
#include "render/scene.h"

namespace render {

// Triangles of the made car: as many as the car of Pomi et al., "Streaming Video Textures for Mixed
// Reality Applications in Interactive Ray Tracing Environments", VMV 2003.
inline constexpr std::size_t made_car_triangles = 208259;

// The car's materials, by their index in the description.
enum class CarMaterial : std::uint32_t {
  paint,    // coloured ground under a smooth clear coat
  plastic,  // dark trim
  rubber,
  alloy,      // rims
  glass,      // dark, smooth
  lens,       // dark lamp housing, smooth
  head_lamp,  // glows
  tail_lamp,  // glows a little
  chrome,
  brake,
  caliper,
  plate,
  seam,
  count
};
inline std::uint32_t index(CarMaterial material) { return static_cast<std::uint32_t>(material); }

struct MadeCarSettings {
  float paint[3] = {0.42F, 0.012F, 0.018F};  // base colour, linear
  float head_lamp_gain = 1;                  // emission gains of front and rear lamps
  float tail_lamp_gain = 1;
};

// A car of 4.2 x 1.8 x 1.4 m (without mirrors), standing on z = 0 about the origin, front to +x:
// body, four wheels and mirrors as instances with names. All its materials are of the shader
// "standard". The same settings give the same car, bit for bit.
//
// Its triangles are all of the visible outer surface: what a panel, a lamp or glass covers is not
// there. A triangle counts as visible if a straight line leads from it out of the car; a tyre's
// also if such a line is there once the wheel has turned half around. (A test shoots these lines;
// fewer than one triangle in a thousand is seen by none of them: cells that an edge all but
// covers.) The count is met exactly by halving the largest triangles along their longest edge,
// which changes no shape.
SceneDescription made_car(const MadeCarSettings& settings = {});

// Where its wheels are.
inline constexpr float car_wheel_radius_m = 0.325F;
inline constexpr float car_front_axle_x = 1.30F;
inline constexpr float car_rear_axle_x = -1.28F;
inline constexpr float car_wheel_y = 0.745F;  // of the middle of the tyre

// Parts, for made_car alone. In the car's frame; the wheel about its own centre, outside to +y.
Mesh make_car_body();
Mesh make_car_mirror();  // the left one
Mesh make_car_wheel();

}  // namespace render
