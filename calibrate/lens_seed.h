// Where a lens solve begins, with no guess from the user.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/lens_bundle.h"

namespace calibrate {

// Flags of the corners that lie as smoothly in their picture as any lens would show them: each
// view's picture is a cubic in the board's rows and columns, fitted robustly, and corners far off
// it are wrong. Up to a third of a view's corners, more if they are off in all directions.
std::vector<std::uint8_t> smooth_corners(const Board& board,
                                         std::size_t views,
                                         std::span<const SeenCorner> corners);

// A lens with one parameter, and the poses of the views.
struct LensSeed {
  Bundle bundle;  // "kannala_brandt 0" (equidistant) or "LENSMODEL_PINHOLE", centre in the middle
  std::vector<std::uint8_t> posed;  // per view; a view without a pose has too few corners
  double error_px = 0;              // median over the views of their RMS residual
};

// The best of a range of focal lengths, of a model. Nothing if no view can be posed.
std::optional<LensSeed> seed_lens(const LensForm& form,
                                  const Board& board,
                                  int width,
                                  int height,
                                  std::size_t views,
                                  std::span<const SeenCorner> corners,
                                  std::span<const std::uint8_t> used);

// A view's pose through the bundle's lens, from the corners in use; and its RMS residual in pixels.
struct SeededPose {
  Pose cam_from_board;
  double error_px = 0;
};
std::optional<SeededPose> seed_pose(const Lens& lens,
                                    const Board& board,
                                    Vec2 warp_m,
                                    std::span<const SeenCorner> corners_of_view,
                                    std::span<const std::uint8_t> used);

}  // namespace calibrate
