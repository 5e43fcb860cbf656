// What camera rays through the centres of a cell's pixels, and of those around it, met: enough to
// find edges and to share shading. Private to the kernel.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "calibrate/vec.h"
#include "render/cell_visibility.h"
#include "render/scene.h"

namespace render {

struct Met {
  static constexpr Scene::Surface nothing{~0U, ~0U};

  Scene::Surface surface;     // or nothing
  calibrate::Vec3f normal;    // of the triangle, unit, towards the camera
  calibrate::Vec3f position;  // m, in the set
};

class MetCentres {
 public:
  static constexpr int side = cell_size + 2;

  // Of another cell. Whether neighbours show one surface depends on how far apart they are there.
  void begin(calibrate::Vec3f camera, float pixel_rad) { camera_ = camera, pixel_rad_ = pixel_rad; }
  // Of the pixel in that column and row of the cell, both from -1 to cell_size.
  Met& at(int x, int y) { return met_[place(x, y)]; }
  const Met& at(int x, int y) const { return met_[place(x, y)]; }
  // Of the cell's k-th pixel, by rows.
  const Met& of(std::size_t k) const {
    return met_[(k / cell_size + 1) * side + k % cell_size + 1];
  }
  std::span<const Met> all() const { return met_; }

  // Whether two that are neighbours show one surface: same thing, no crease, no step in depth.
  bool continuous(const Met& a, const Met& b) const {
    if (a.surface != b.surface) return false;
    if (a.surface == Met::nothing) return true;
    if (dot(a.normal, b.normal) < 0.9F) return false;
    const calibrate::Vec3f between = b.position - a.position;
    const float step = std::min(std::abs(dot(a.normal, between)), std::abs(dot(b.normal, between)));
    return step < 3 * pixel_rad_ * length(a.position - camera_);
  }
  bool continuous(std::size_t a, std::size_t b) const { return continuous(of(a), of(b)); }

 private:
  static std::size_t place(int x, int y) {
    return static_cast<std::size_t>((y + 1) * side + x + 1);
  }

  std::array<Met, std::size_t{side} * side> met_;
  calibrate::Vec3f camera_;
  float pixel_rad_ = 0;
};

}  // namespace render
