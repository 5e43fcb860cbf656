// A camera's lens from pictures of a board: the whole way, with what it knows of its own error.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibrate/focal_agreement.h"
#include "calibrate/lens_selection.h"
#include "calibrate/lens_solve.h"
#include "calibrate/overlay_error.h"

namespace calibrate {

struct LensCalibrationOptions {
  // Models that may be chosen: those that fit into a .cameramodel, those by angle, or what the
  // pictures ask for.
  enum class Models { any, perspective, angular };
  Models models = Models::any;
  // Chooses this form without asking the held-out corners; they are still measured.
  std::optional<LensForm> form;
  // Whether mrcal's splines may be chosen, where corners ask for them: OpenCV has none.
  bool splines = true;
};

// What became of one picture.
struct ViewReport {
  std::string name;
  std::size_t seen = 0;  // corners
  std::size_t used = 0;  // of them
  double rms_px = 0;     // of those in use
  std::string rejected;  // why it was; empty = it was not
  std::optional<Pose> cam_from_board;
};

struct LensCalibration {
  Lens lens;
  LensForm form;
  Vec2 warp_m;  // of the board; see Bundle
  // Of each coordinate of a corner: the larger of residuals and held-out ones, and larger yet if
  // the pictures are few.
  double sigma_px = 0;
  double train_rms_px = 0;
  double heldout_rms_px = 0;  // infinite: nothing could be left out
  double coverage_deg = 0;    // off the axis, of the farthest corner in use
  std::vector<ViewReport> views;
  std::size_t places = 0;  // of the board in the views in use: see view_groups.h
  // The square root of twin_variance(), by which all predicted errors are larger.
  double twin_factor = 1;
  LensSelection selection;
  // Where the pictures disagree, all predicted errors are larger by its error_factor().
  FocalAgreement focal;
  // Perspective forms were asked for, but the pictures are clearly a fish-eye's.
  bool of_fisheye = false;
  std::vector<std::string> warnings;
  double time_ms = 0;

  // For residuals and pictures of the error: the problem's corners and the chosen solve.
  LensStart start;
  std::optional<OverlayError> overlay;
  const LensSolve& solve() const { return *selection.candidates[selection.chosen].solve; }
};

// Calibrates. Views that tell nothing, or something else (a mirrored board, the same picture again,
// more than half of the corners wrong) are left out and named. Throws std::invalid_argument as
// start_lens(); std::runtime_error, with what to do, if no view is left, or if the corners are not
// those of this board.
LensCalibration calibrate_lens(const LensProblem& problem,
                               const LensCalibrationOptions& options = {});

}  // namespace calibrate
