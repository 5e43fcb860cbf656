// The least-squares core of lens solves: one lens, one board's shape, many poses of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/lens_form.h"
#include "calibrate/pose.h"

namespace calibrate {

// A corner as seen in a picture.
struct SeenCorner {
  std::size_t view = 0;   // index into poses
  std::size_t index = 0;  // on the board
  Vec2 q;
};

// What a solve moves.
struct Bundle {
  LensForm form;
  std::vector<double> free;  // of the form
  // How far the board's middle is bent away from its edges, along its rows and its columns, metres:
  // z = warp.x (1 - a^2) + warp.y (1 - b^2), where a and b run from -1 to 1 over the corners, as
  // mrcal has it.
  Vec2 warp_m;
  std::vector<Pose> cam_from_board;
};

// A corner of a bent board, in its frame.
Vec3 corner_of(const Board& board, Vec2 warp_m, std::size_t index);

struct BundleOptions {
  bool move_lens = true;
  bool move_warp = false;
  double loss_px = 0;  // scale of Cauchy's loss; 0 = plain squares
  int max_iterations = 30;
};

// Moves the bundle to the least sum over `corners`, whose flag in `used` is set, of squared
// residuals in pixels. Poses of views without such corners stay. Returns whether it converged; a
// corner that the lens cannot see at the start is an obstacle: false, and nothing moves.
//
// Ceres's Levenberg-Marquardt on the Schur complement of the poses (Agarwal, Mierle and others,
// "Ceres Solver"; Triggs et al., "Bundle Adjustment - A Modern Synthesis", 1999, section 6).
bool minimise(Bundle& bundle,
              const Board& board,
              std::span<const SeenCorner> corners,
              std::span<const std::uint8_t> used,
              const BundleOptions& options);

// Seen minus projected pixel of each corner; nothing where the lens does not see it.
std::vector<std::optional<Vec2>> residuals(const Bundle& bundle,
                                           const Board& board,
                                           std::span<const SeenCorner> corners);

// What the corners in use say about lens and warp when all poses are free: the inverse covariance
// for residuals of standard deviation 1 px, (free_count + 2)^2 values row by row, lens first, then
// the warp. Without `warp`, the warp is held and its rows are 0.
std::vector<double> information(const Bundle& bundle,
                                const Board& board,
                                std::span<const SeenCorner> corners,
                                std::span<const std::uint8_t> used,
                                bool warp);

}  // namespace calibrate
