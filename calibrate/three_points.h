// The poses from which three points are seen in three directions.
#pragma once

#include <array>
#include <span>

#include "calibrate/pose.h"

namespace calibrate {

// At most four.
class ThreePointPoses {
 public:
  void add(const Pose& cam_from_set) { poses_[count_++] = cam_from_set; }
  bool full() const { return count_ == poses_.size(); }
  auto begin() const { return poses_.begin(); }
  auto end() const { return poses_.begin() + static_cast<std::ptrdiff_t>(count_); }
  std::size_t size() const { return count_; }

 private:
  std::array<Pose, 4> poses_;
  std::size_t count_ = 0;
};

// Every cam_from_set in which p_set[i] lies in the unit direction v_cam[i], at any angle to the
// camera's axis; none for points on a line, or directions that no pose explains.
//
// Persson and Nordberg, "Lambda Twist: An Accurate Fast Robust Perspective Three Point (P3P)
// Solver", ECCV 2018, sections 3 and 4. We factor the degenerate conic by Eigen's decomposition.
ThreePointPoses solve_three_points(const std::array<Vec3, 3>& v_cam,
                                   const std::array<Vec3, 3>& p_set);

}  // namespace calibrate
