// A calibrated camera inside a material: its lens as a grid of places, which travels as bytes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
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
  float uv_per_tangent;                      // in the grid's middle, root of the area's
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

// Four places of the grid, and how far between them.
struct GridCell {
  std::array<GridPlace, 2> upper, lower;
  float fx, fy;

  GridPlace place() const {
    const auto mixed = [&](float a, float b, float d, float e) {
      return (a * (1 - fx) + b * fx) * (1 - fy) + (d * (1 - fx) + e * fx) * fy;
    };
    return {mixed(upper[0].u, upper[1].u, lower[0].u, lower[1].u),
            mixed(upper[0].v, upper[1].v, lower[0].v, lower[1].v)};
  }
  // By how much the place changes over one step to the right, and down: the area's share.
  float area() const {
    const auto along = [&](float a, float b, float d, float e) {
      return (b - a) * (1 - fy) + (e - d) * fy;
    };
    const auto down = [&](float a, float b, float d, float e) {
      return (d - a) * (1 - fx) + (e - b) * fx;
    };
    const float ux = along(upper[0].u, upper[1].u, lower[0].u, lower[1].u);
    const float vx = along(upper[0].v, upper[1].v, lower[0].v, lower[1].v);
    const float uy = down(upper[0].u, upper[1].u, lower[0].u, lower[1].u);
    const float vy = down(upper[0].v, upper[1].v, lower[0].v, lower[1].v);
    return std::abs(ux * vy - uy * vx);
  }
};

// The cell at `gx`, `gy` steps from the grid's first; nothing beyond it, and no numbers where the
// lens does not see.
inline std::optional<GridCell> cell_in_grid(const CameraGrid& c,
                                            std::span<const std::byte> places,
                                            float gx,
                                            float gy) {
  const auto last_x = static_cast<float>(c.columns - 1), last_y = static_cast<float>(c.rows - 1);
  if (!(gx >= 0 && gx <= last_x && gy >= 0 && gy <= last_y)) return std::nullopt;
  const std::uint32_t column = std::min(static_cast<std::uint32_t>(gx), c.columns - 2);
  const std::uint32_t row = std::min(static_cast<std::uint32_t>(gy), c.rows - 2);
  GridCell cell;
  cell.fx = gx - static_cast<float>(column), cell.fy = gy - static_cast<float>(row);
  const std::size_t index = std::size_t{row} * c.columns + column;
  std::memcpy(&cell.upper, places.data() + index * sizeof(GridPlace), sizeof cell.upper);
  std::memcpy(&cell.lower, places.data() + (index + c.columns) * sizeof(GridPlace),
              sizeof cell.lower);
  return cell;
}

inline std::optional<GridPlace> place_in_grid(const CameraGrid& c,
                                              std::span<const std::byte> places,
                                              float gx,
                                              float gy) {
  const auto cell = cell_in_grid(c, places, gx, gy);
  return cell ? std::optional(cell->place()) : std::nullopt;
}

// Through the camera's lens; nothing where it does not see. `places` begins with the grid's.
std::optional<LookUp> seen_by_camera(const CameraGrid& camera,
                                     std::span<const std::byte> places,
                                     calibrate::Vec3f p_cam);

}  // namespace compositing
