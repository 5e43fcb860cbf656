// A calibrated camera inside a material: its lens as a grid of places, which travels as bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"

namespace compositing {

// The camera that filmed a person: its picture is projected from there, so that it is exact as
// seen from there, whatever it is projected on.
struct BillboardCamera {
  calibrate::Lens lens;  // of the whole picture; sees less than widest_billboard_rad off its axis
  calibrate::Pose cam_from_set;
};
inline constexpr double widest_billboard_rad = 1.3;

// A place of the picture, 0..1 from its top left; no numbers where the lens does not see.
struct GridPlace {
  float u, v;
};

// Plain bytes, for parameter blocks. Its places, rows times columns, row by row, are at even steps
// of x/z and y/z in the camera's frame; between them is interpolated.
struct CameraGrid {
  std::uint32_t columns, rows;  // 0 = no camera
  std::array<float, 12> cam_from_set;
  std::array<float, 2> first, steps_a_unit;  // of x/z and y/z: where the grid begins
  float uv_per_tangent;                      // at the picture's middle
};
inline constexpr std::uint32_t most_grid_steps = 1024;

struct LensGrid {
  CameraGrid camera;
  std::vector<GridPlace> places;
};
// Throws std::invalid_argument for a lens that sees wider than widest_billboard_rad or nothing, and
// for a number of steps that is not 1..1023.
LensGrid make_lens_grid(const BillboardCamera& camera, int steps);

// Why bytes of a file are no such grid, or null.
const char* fault_of(const CameraGrid& camera);
inline std::size_t bytes_of_places(const CameraGrid& camera) {
  return std::size_t{camera.rows} * camera.columns * sizeof(GridPlace);
}

struct LookUp {
  GridPlace place;
  float uv_per_metre;
};

calibrate::Vec3f in_camera(const CameraGrid& camera, calibrate::Vec3f p_set);
calibrate::Vec3f turned_to_camera(const CameraGrid& camera, calibrate::Vec3f v_set);

// Through the camera's lens; nothing where it does not see. `places` begins with the grid's.
std::optional<LookUp> seen_by_camera(const CameraGrid& camera,
                                     std::span<const std::byte> places,
                                     calibrate::Vec3f p_cam);

}  // namespace compositing
