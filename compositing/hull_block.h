// The parameter block of visual hulls.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "compositing/camera_grid.h"

namespace compositing {

inline constexpr std::size_t most_hull_views = 8;

// Plain bytes, for parameter blocks.
struct MarchView {
  std::uint32_t picture;
  std::uint32_t first_byte;  // of its places among all of them
  float px_per_tangent;      // at the picture's middle
  float root_aspect;         // of the picture's height over its width
  calibrate::Vec3f position;
  CameraGrid camera;
};
struct HullBlock {
  std::uint32_t views;
  std::uint32_t hides;
  float step_px;
  std::array<float, 3> gain;
  std::array<MarchView, most_hull_views> view;
};

// Alpha that is not looked for.
inline constexpr float no_alpha = 1.5F / 255;

inline bool is_in_picture(GridPlace p) { return p.u >= 0 && p.u <= 1 && p.v >= 0 && p.v <= 1; }

}  // namespace compositing
