// The least-squares core of a rig: poses of cameras, poses of boards, lenses held.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "calibrate/lens_error.h"
#include "calibrate/pose.h"
#include "calibrate/sight.h"

namespace calibrate {

// A corner of a board before one camera at one instant; the sight's p_set is in the board's frame.
struct RigCorner {
  std::size_t camera = 0;
  std::size_t board = 0;  // which pose of it
  Sight sight;
};

struct RigBundle {
  std::vector<Pose> cam_from_rig;  // the first one is held
  std::vector<Pose> rig_from_board;
};

// Moves all poses to the least sum over the corners in use of squared residuals (sight.h), or of
// Cauchy's loss at the scale `loss_px` if that is above 0. Poses without corners stay. Returns
// whether there is a solution.
bool minimise(RigBundle& bundle,
              std::span<const RigCorner> corners,
              std::span<const std::uint8_t> used,
              double loss_px);

// How far one board alone would put the cameras elsewhere than all boards do.
struct BoardPull {
  double squares = 0;    // px^2: by how much its own residuals would be less
  double freedoms = 0;   // of the cameras, that it tells: what noise of 1 px makes of it
  double of_lenses = 0;  // px^2: what the lenses' errors make of it
};

// Of turn and move of each camera but the first, one after the other: square matrices of 6 values
// per camera, row by row.
struct RigCovariance {
  std::vector<double> of_noise;   // if residuals have a standard deviation of 1 px
  std::vector<double> of_lenses;  // by what each is off by, to be added
  std::vector<BoardPull> boards;
};
// `errors` are the cameras' lenses'. Empty matrices if a camera's pose is open.
RigCovariance covariance(const RigBundle& bundle,
                         std::span<const RigCorner> corners,
                         std::span<const std::uint8_t> used,
                         std::span<const LensError> errors);

}  // namespace calibrate
