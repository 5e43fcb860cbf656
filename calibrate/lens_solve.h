// One lens of a given form from pictures of a board.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/lens_bundle.h"

namespace calibrate {

// Pictures of one board by one camera that does not zoom or refocus.
struct LensProblem {
  Board board;
  int width = 0;  // of the pictures
  int height = 0;
  std::vector<BoardView> views;
};

// Throws std::invalid_argument: a bad board, sizes below 1, views whose number of corners is not
// the board's.
void check(const LensProblem& problem);

// The corners of a problem, sorted by view, and where to begin. Corners that are not finite or lie
// outside the picture (by more than half its size) are left out.
struct LensStart {
  std::vector<SeenCorner> corners;
  std::vector<std::uint8_t> used;   // per corner: smooth enough, and of a view that has a pose
  std::vector<std::uint8_t> posed;  // per view
  Bundle bundle;                    // one parameter
  double error_px = 0;              // median over the views of their RMS residual
  std::size_t not_finite = 0;       // corners left out
};

// Both projections are tried, as are focal lengths from 0.15 to 12 picture widths; the one with the
// smaller error comes first. Throws as check(), and std::runtime_error: no view shows 6 corners or
// more.
struct LensStarts {
  LensStart equidistant, pinhole;
};
LensStarts start_lens(const LensProblem& problem);
// With one projection only: "kannala_brandt" without terms, or "LENSMODEL_PINHOLE".
LensStart start_lens(const LensProblem& problem, const LensForm& one_parameter);
// The one that suits a form.
LensForm one_parameter_form(const LensForm& form);

struct LensSolve {
  Bundle bundle;
  Lens lens;
  bool warp = false;               // whether the board's shape was solved for
  std::vector<std::uint8_t> used;  // per corner of the start: no outlier
  double sigma_px = 0;             // of each coordinate of a corner, by residuals and freedoms
  double rms_px = 0;               // distance between seen and projected corners
  bool converged = false;
};

// What to start from, and what to move.
struct SolveOptions {
  bool warp = true;
  // Keeps the corners of the start in use, whatever their residuals become.
  bool keep_used = false;
};

// Robust at first (Cauchy's loss at the scale of the residuals' median), then plain squares over
// corners within 4.5 standard deviations, until no corner changes sides. Nothing if the form's lens
// cannot see what is in the pictures, or there are too few corners for it.
std::optional<LensSolve> solve_lens(const LensProblem& problem,
                                    const LensForm& form,
                                    const LensStart& start,
                                    const SolveOptions& options = {});

// The largest angle off the axis of a corner in use, by a solve of the start's corners.
double farthest_angle(const LensProblem& problem, const LensStart& start, const LensSolve& solve);

// How many flags are set.
std::size_t count_used(std::span<const std::uint8_t> used);

// The start of a further solve: where this one ended.
LensStart start_of(const LensStart& before, const LensSolve& solve);

}  // namespace calibrate
