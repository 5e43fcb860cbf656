// Boxes that live pictures stay in: what is kept of a cell knows which of its rays pass them.
#pragma once

#include <array>
#include <vector>

#include "render/blocker_boxes.h"
#include "render/scene.h"

namespace render {

// Where the live pictures of a frame may be: their bounds, outwards to a lattice, so that a person
// who moves a little stays within them.
class PictureStalls {
 public:
  static constexpr float lattice_m = 0.25F;

  PictureStalls() = default;
  explicit PictureStalls(const Scene::Places& places);
  explicit PictureStalls(std::vector<Scene::Bounds> boxes);

  bool empty() const { return boxes_.empty(); }
  const std::vector<Scene::Bounds>& boxes() const { return boxes_; }
  // Whether a straight line from `from`, `far_m` along the unit `direction`, passes any of them.
  bool are_passed(Vec3f from, Vec3f direction, float far_m) const;
  // Whether all of the pictures are in one of them.
  bool hold(const Scene::Places& places) const;
  // Boxes that hold what either has that the other one has not.
  static std::vector<Scene::Bounds> changed(const PictureStalls& before, const PictureStalls& now);

 private:
  std::vector<Scene::Bounds> boxes_;
  Scene::Bounds all_ = no_bounds;  // around them
};

// Stalls that stay for some time: larger than what stands in them, and others only once that has
// left them, or has needed much less for long. Memory across frames.
class StallFollower {
 public:
  static constexpr float margin_m = 0.25F;
  static constexpr int patience = 250;  // frames

  PictureStalls follow(const Scene::Places& places);

 private:
  struct Stall {
    Scene::Bounds box;
    int too_large = 0;  // for so many frames
    bool used = false;
  };
  std::vector<Stall> stalls_;  // by moving instance
};

// The stretch of from + t * direction, 0 <= t <= far_m, inside of a box; first > last: none.
struct BoxStretch {
  float first, last;
};
BoxStretch stretch_in(const Scene::Bounds& box, Vec3f from, Vec3f direction, float far_m);

}  // namespace render
