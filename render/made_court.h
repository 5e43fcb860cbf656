// A made court: a car park with real things on it, as a scene of standard surfaces.
#pragma once

#include <cstdint>

#include "render/scene.h"

namespace render {

struct MadeCourtSettings {
  int texture_size =
      2048;  // texels of the court's side; other textures are smaller by a fixed ratio
  std::uint32_t seed = 1;
};

// Where things are, for whoever has to stand in for them: metres, the set's frame.
inline constexpr float court_middle_y = 1.8F;  // the court is court_m wide about (0, this)
struct MadeCrate {
  Vec3f middle;  // of its foot
  Vec3f size;
  float yaw_rad;
};
inline constexpr MadeCrate court_crate{{4.9F, 4.6F, 0}, {1.1F, 1.1F, 1.0F}, 0.35F};

// A matte grey card for matching cameras, flat on the court.
struct MadeCard {
  Vec3f middle;
  float width, depth;  // along its own x and y
  float yaw_rad;
  float albedo;
};
inline constexpr MadeCard court_card{{0.1F, -2.1F, 0.004F}, 0.5F, 0.36F, 0.9F, 0.5F};

// How the car of the made set stands at the origin.
inline constexpr double court_car_yaw_deg = -165;

// Where a made lamp may stand, beside the car.
inline constexpr Vec3f court_lamp_foot{1.55F, -1.5F, 0};
inline constexpr double court_lamp_yaw_deg = 180;

// Asphalt with lines and kerbs at z = 0 around the origin, where nothing but a grey card lies
// within 3.4 m; a wall in the +y direction, a lamp post, crates, cones and bollards. Every instance
// is a virtual object with a material of the shader "standard".
SceneDescription make_court(const MadeCourtSettings& settings);

}  // namespace render
