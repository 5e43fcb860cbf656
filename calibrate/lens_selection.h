// The smallest lens form that suffices, by corners that took no part in its solve.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibrate/lens_solve.h"

namespace calibrate {

// One form that was tried.
struct LensCandidate {
  LensForm form;
  std::size_t parameters = 0;
  std::optional<LensSolve> solve;       // nothing: the form cannot see what is in the pictures
  double heldout_rms_px = 0;            // over all views, each left out once
  std::vector<double> heldout_squares;  // per view: sum of squared distances, pixels^2
  double time_ms = 0;
};

struct LensSelection {
  std::vector<LensCandidate> candidates;  // by rising number of parameters
  std::size_t chosen = 0;
  std::size_t best = 0;  // of the least held-out error
  std::size_t folds = 0;
  double twins = 1;  // twin_variance() of the best one: what is off alike counts once

  // Takes one more, and chooses again. Throws std::runtime_error if none can be solved.
  void add(LensCandidate candidate);
};

// Fish-eyes and other lenses by angle: Kannala and Brandt's, from none to four terms, with and
// without decentring and a second focal length.
std::vector<LensForm> angular_forms();
// What fits into a .cameramodel: mrcal's PINHOLE and OPENCV4, 5 and 8, with one focal length or
// two.
std::vector<LensForm> perspective_forms();

// Solves each form from `start` over the corners in use there, and judges it by cross-validation:
// the views are dealt into five groups, those of a board held still (view_groups.h) into one; each
// in turn is left out of the solve, its poses are found
// from every other of their corners, and the corners between them are compared. Of fewer than five
// views, each quarter of the board is left out in turn. Chosen is the form with the fewest
// parameters whose sum of squared distances is within nine variances of the best's, and within 5 %
// of it: a term that moves all held-out corners together by three standard deviations is kept.
//
// Stone, "Cross-Validatory Choice and Assessment of Statistical Predictions", J. R. Stat. Soc. B
// 36(2), 1974. We do not take the spread of the differences over the views for tolerance (Breiman
// et al., "Classification and Regression Trees", 1984, section 3.4.3): of a real term it grows with
// the term, which would be missed up to twice that size.
//
// Throws std::runtime_error if no form can be solved, std::invalid_argument for no forms.
LensSelection select_lens(const LensProblem& problem,
                          const LensStart& start,
                          std::span<const LensForm> forms,
                          bool warp);

}  // namespace calibrate
