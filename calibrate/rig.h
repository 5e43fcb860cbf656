// Where the cameras of a rig stand to each other, from boards that several of them see.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "calibrate/sight.h"

namespace calibrate {

// A camera with its lens, and what it saw at each instant; a view without corners saw no board.
struct RigCamera {
  std::string name;
  Lens lens;
  std::vector<BoardView> views;  // as many as all others have, taken at the same instants
};

struct RigProblem {
  Board board;  // one, flat, that moves or not; or the cameras move together before it
  std::vector<RigCamera> cameras;
};

struct RigOptions {
  // Standard deviation of a corner along each pixel axis that is to be expected; residuals that are
  // larger than that raise the uncertainty, smaller ones do not lower it.
  double noise_px = 0.3;
};

// One camera of the solved rig. The rig's frame is that of the first camera.
struct RigCameraFit {
  Pose cam_from_rig;
  PoseMatrix covariance{};      // of turn and move (sight.h), 0 for the first camera
  double turn_sigma_rad = 0;    // root of the turn's total variance
  double position_sigma_m = 0;  // and of the position's
  double rms_px = 0;            // length of residuals, of the corners in use
  std::size_t views = 0;        // that another camera has, too
  std::size_t corners = 0;      // in use
  std::size_t left_out = 0;     // corners taken for wrong
  std::size_t boards = 0;       // views of which half the corners or more are in use
};

struct RigFit {
  std::vector<RigCameraFit> cameras;
  // Per instant; nothing where fewer than two cameras saw the board.
  std::vector<std::optional<Pose>> rig_from_board;
  double rms_px = 0;
  // How far each instant alone would put the cameras elsewhere, squared, over what noise and lenses
  // make of that: 1 if instants differ by these. Nothing of one instant.
  std::optional<double> chi_squared;
  std::vector<std::string> warnings;  // for people
};

// Poses of cameras and boards that explain all corners best: bundle adjustment over both, as in
// Triggs et al., "Bundle Adjustment - A Modern Synthesis", 1999, section 6, with lenses held, after
// a start from pairs of cameras that share the most views. Robust at first (Cauchy's loss), then
// plain squares over corners within 4.5 standard deviations. A chessboard that looks the same after
// half a turn may be counted from either end, one of as many rows as columns, if they are even,
// from any of its four corners: that is found out, or warned of where the instants do not tell it.
// The uncertainty counts what lenses are off by where they tell it (Lens::error_px); a turn of all
// of a lens's directions is none of it. Where instants differ by more than that, as of a board that
// moves before cameras that are not in step, or is longer one way, it is as much larger (Birge,
// Phys. Rev. 40, 1932), and a warning tells so.
//
// Throws std::invalid_argument: a bad board or lens, fewer than two cameras, a name that is empty
// or twice, views that are not as many as the first camera's or not of the board's corners, noise
// that is not above 0; std::runtime_error naming the cameras that share no view with the others, or
// one of whose corners or boards less than half, or but one board of several, agree with the rest.
RigFit fit_rig(const RigProblem& problem, const RigOptions& options = {});

}  // namespace calibrate
