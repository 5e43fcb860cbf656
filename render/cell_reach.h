// What space a cell's rays pass, so that its transport can be kept while things move elsewhere.
// Private to the kernel.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "calibrate/lens.h"
#include "render/blocker_boxes.h"
#include "render/camera_turn.h"
#include "render/light_gather.h"
#include "render/light_table.h"
#include "render/soft_lights.h"

namespace render {

// All of space: around what is virtual in 16x16x16 boxes, of which the outermost have no end.
class SpaceGrid {
 public:
  static constexpr int side = 16;
  using Mask = std::array<std::uint64_t, side * side * side / 64>;  // of boxes

  SpaceGrid() = default;
  // All but the outermost half as large again as those bounds, to all sides.
  explicit SpaceGrid(const Scene::Bounds& bounds);

  bool is_laid() const { return per_size_.x > 0; }  // over anything
  // Whether these lie in none of the outermost.
  bool holds(const Scene::Bounds& bounds) const;
  // As if the outermost had walls, as far apart as others': the box that a point lies in, or -1.
  int box_at(Vec3f p) const;
  Scene::Bounds box(int index) const;
  // Those that a straight line from `from`, `far_m` along the unit `direction`, passes (Amanatides
  // and Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", Eurographics 1987).
  void mark_line(Vec3f from, Vec3f direction, float far_m, Mask& mask) const;
  void mark_bounds(const Scene::Bounds& bounds, Mask& mask) const;

 private:
  Vec3f lower_{}, size_{}, per_size_{};  // of a box; 1 / size
};

// What a cell depends on beside its camera rays.
struct CellReach {
  SpaceGrid::Mask passed{};  // boxes that bounced rays cross
  // Points from which shadow rays go: of all; of those that are not a grid of centres'.
  struct Receivers {
    SpaceGrid::Mask boxes{};  // that hold any
    Scene::Bounds outside = no_bounds;

    void add(const Receivers& other) {
      for (std::size_t i = 0; i < boxes.size(); ++i) boxes[i] |= other.boxes[i];
      outside = joined(outside, other.outside);
    }
    void add(const SpaceGrid& grid, Vec3f p) {
      if (const int box = grid.box_at(p); box >= 0) {
        const auto i = static_cast<std::size_t>(box);
        boxes[i / 64] |= std::uint64_t{1} << (i % 64);
      } else {
        outside = joined(outside, {p, p});
      }
    }
  };
  Receivers lit, lit_apart;

  void add(const CellReach& other) {
    for (std::size_t i = 0; i < passed.size(); ++i) passed[i] |= other.passed[i];
    lit.add(other.lit), lit_apart.add(other.lit_apart);
  }
  void add_receiver(const SpaceGrid& grid, Vec3f p, bool of_centre = false) {
    lit.add(grid, p);
    if (!of_centre) lit_apart.add(grid, p);
  }
};

// The directions from a camera that rays through each cell and the pixels around it may take.
struct CellCone {
  Vec3f axis;           // unit, in the set's frame
  float half_rad = 10;  // more than a half turn: any direction
};
// Of the cell whose top-left pixel is (x0, y0), and of all cells, row by row.
CellCone cell_cone(const calibrate::DirectionTable& directions,
                   const CameraTurn& turn,
                   int x0,
                   int y0);
std::vector<CellCone> cell_cones(const calibrate::DirectionTable& directions,
                                 const CameraTurn& turn);
// Whether any of these rays may meet what fills those bounds. Never says no where it is yes.
bool may_be_seen(const CellCone& cone, Vec3f camera, const Scene::Bounds& bounds);

// Whether what moved may have changed what a cell's rays met: things that filled `where`, before
// or after. Never says no where it is yes.
class MovedThings {
 public:
  // `receivers` are the boxes that any cell's shadow rays begin in. `relit`: where light falls
  // otherwise, whatever is between.
  MovedThings(std::vector<Scene::Bounds> where,
              const SpaceGrid& grid,
              const LightTable& lights,
              const SoftLights& soft,
              const SpaceGrid::Mask& receivers,
              std::vector<Scene::Bounds> relit = {});

  bool may_be_seen(const CellCone& cone, Vec3f camera) const;
  bool may_change(const CellReach& reach) const {
    return may_be_passed(reach) || may_light(reach.lit);
  }
  // Whether bounced rays may meet it; whether light may come otherwise to points.
  bool may_be_passed(const CellReach& reach) const;
  bool may_light(const CellReach::Receivers& receivers) const;
  // Whether that is by what fills, or has left, these, and nothing else.
  bool shade_alone() const { return relit_.empty(); }
  std::span<const Scene::Bounds> where() const { return where_; }

 private:
  bool may_shade(const Scene::Bounds& receivers) const;

  std::vector<Scene::Bounds> where_;
  const LightTable& lights_;
  const SoftLights& soft_;
  std::vector<Scene::Bounds> relit_;
  SpaceGrid::Mask filled_{}, shaded_{};
};

}  // namespace render
