// A calibrated camera inside a material.
#include "compositing/camera_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace compositing {
namespace {

using calibrate::Vec3f;

// x/z and y/z of what the picture's rim and inside show.
struct Window {
  double x0 = std::numeric_limits<double>::max(), x1 = -x0, y0 = x0, y1 = -x0;
};
Window window_of(const calibrate::Lens& lens) {
  constexpr int places = 64;
  Window window;
  for (int j = 0; j <= places; ++j) {
    for (int i = 0; i <= places; ++i) {
      const double share_x = static_cast<double>(i) / places;
      const double share_y = static_cast<double>(j) / places;
      const auto v =
          calibrate::unproject(lens, {lens.width * share_x - 0.5, lens.height * share_y - 0.5});
      if (!v) continue;
      if (!(std::atan2(std::hypot(v->x, v->y), v->z) < widest_billboard_rad)) {
        throw std::invalid_argument("a person's camera must see less than 75 degrees off its axis");
      }
      window.x0 = std::min(window.x0, v->x / v->z), window.x1 = std::max(window.x1, v->x / v->z);
      window.y0 = std::min(window.y0, v->y / v->z), window.y1 = std::max(window.y1, v->y / v->z);
    }
  }
  if (!(window.x0 < window.x1 && window.y0 < window.y1)) {
    throw std::invalid_argument("a person's camera sees nothing");
  }
  return window;
}

}  // namespace

LensGrid make_lens_grid(const BillboardCamera& camera, int steps) {
  const calibrate::Lens& lens = camera.lens;
  calibrate::check(lens);
  if (steps < 1 || steps >= static_cast<int>(most_grid_steps)) {
    throw std::invalid_argument("a lens's grid has 1 to 1023 steps");
  }
  LensGrid grid{};
  CameraGrid& c = grid.camera;
  const Window window = window_of(lens);
  const double step_x = (window.x1 - window.x0) / steps, step_y = (window.y1 - window.y0) / steps;
  c.columns = c.rows = static_cast<std::uint32_t>(steps) + 1;
  c.first = {static_cast<float>(window.x0), static_cast<float>(window.y0)};
  c.steps_a_unit = {static_cast<float>(1 / step_x), static_cast<float>(1 / step_y)};
  const auto& R = camera.cam_from_set.R.m;
  const calibrate::Vec3& t = camera.cam_from_set.t;
  const std::array<double, 3> moved{t.x, t.y, t.z};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t k = 0; k < 3; ++k)
      c.cam_from_set[row * 4 + k] = static_cast<float>(R[row * 3 + k]);
    c.cam_from_set[row * 4 + 3] = static_cast<float>(moved[row]);
  }
  for (std::uint32_t row = 0; row < c.rows; ++row) {
    for (std::uint32_t column = 0; column < c.columns; ++column) {
      const auto q =
          calibrate::project(lens, {window.x0 + column * step_x, window.y0 + row * step_y, 1});
      constexpr float none = std::numeric_limits<float>::quiet_NaN();
      grid.places.push_back(!q ? GridPlace{none, none}
                               : GridPlace{static_cast<float>((q->x + 0.5) / lens.width),
                                           static_cast<float>((q->y + 0.5) / lens.height)});
    }
  }
  const auto middle = static_cast<float>(steps) / 2;
  const auto cell = cell_in_grid(c, std::as_bytes(std::span(grid.places)), middle, middle);
  const float area = cell->area() * c.steps_a_unit[0] * c.steps_a_unit[1];
  // Where the lens does not see there, as the whole picture has over its window.
  c.uv_per_tangent =
      std::isfinite(area) && area > 0
          ? std::sqrt(area)
          : static_cast<float>(1 / std::sqrt((window.x1 - window.x0) * (window.y1 - window.y0)));
  return grid;
}

const char* fault_of(const CameraGrid& c) {
  if (c.columns > most_grid_steps || c.rows > most_grid_steps || c.columns == 1 || c.rows == 1 ||
      (c.columns == 0) != (c.rows == 0)) {
    return "wrong size of the lens's grid";
  }
  const auto all_finite = [](const auto& values) {
    return std::ranges::all_of(values, [](float v) { return std::isfinite(v); });
  };
  if (!all_finite(c.cam_from_set) || !all_finite(c.first) || !all_finite(c.steps_a_unit) ||
      !std::isfinite(c.uv_per_tangent)) {
    return "its camera is not finite";
  }
  return nullptr;
}

Vec3f turned_to_camera(const CameraGrid& camera, Vec3f v) {
  const auto& m = camera.cam_from_set;
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
          m[8] * v.x + m[9] * v.y + m[10] * v.z};
}

Vec3f in_camera(const CameraGrid& camera, Vec3f p) {
  const auto& m = camera.cam_from_set;
  return turned_to_camera(camera, p) + Vec3f{m[3], m[7], m[11]};
}

std::optional<LookUp> seen_by_camera(const CameraGrid& c,
                                     std::span<const std::byte> places,
                                     Vec3f p_cam) {
  const float z = p_cam.z;
  if (!(z > 1e-4F)) return std::nullopt;
  const float gx = (p_cam.x / z - c.first[0]) * c.steps_a_unit[0];
  const float gy = (p_cam.y / z - c.first[1]) * c.steps_a_unit[1];
  const auto cell = cell_in_grid(c, places, gx, gy);
  if (!cell) return std::nullopt;
  const GridPlace place = cell->place();
  // Where the lens does not see, the grid holds no numbers.
  if (!std::isfinite(place.u) || !std::isfinite(place.v)) return std::nullopt;
  const float area = cell->area() * c.steps_a_unit[0] * c.steps_a_unit[1];
  return LookUp{place, std::sqrt(area) / z};
}

}  // namespace compositing
