// Whether the pictures of a lens calibration agree on one focal length.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "calibrate/lens_solve.h"

namespace calibrate {

// What one picture says of the focal length by itself, the lens else as it was solved.
struct ViewFocal {
  double factor = 1;  // of the solve's focal lengths
  double sigma = 0;   // its standard deviation, by the pictures' own residuals
};

struct FocalAgreement {
  // One for each of the problem's; nothing: not in use, fewer than 12 corners, or cannot tell.
  std::vector<std::optional<ViewFocal>> views;
  double mean_factor = 1;  // weighted by their variances
  std::size_t told = 0;    // by so many pictures
  // Of the factors about their mean, over told - 1: 1 if they differ as the noise of the corners
  // lets them. Nothing of fewer than three pictures, not counting those of a board held still: the
  // solve fits its lens to what two differ by.
  std::optional<double> chi_squared;
  // Up to where chi_squared is taken for noise.
  double most = 0;

  bool disagree() const { return chi_squared && *chi_squared > most; }
  // By how much the error of the lens is larger than the noise of the corners foretells; 1 unless
  // the pictures disagree.
  double error_factor() const;
  // How many standard deviations a picture's factor lies off the mean; 0 if it tells none.
  double deviation(std::size_t view) const;
};

// For each picture the pose and a factor of the focal lengths, by least squares over its corners in
// use; then the spread of the factors. A zoom or a focus that changed, a rolling shutter, a board
// that is twisted or longer one way pull each picture's focal length elsewhere, as it stands
// otherwise to the board, whereas the common solve hides them in the poses and the lens: its
// residuals stay small. `solve` is of the corners of `start`, which are sorted by view. Throws as
// free_count() for the solve's form.
//
// Birge, "The Calculation of Errors by the Method of Least Squares", Phys. Rev. 40, 1932: the ratio
// of the spread of measurements to what their errors foretell, by which their mean's error grows.
FocalAgreement focal_agreement(const LensProblem& problem,
                               const LensStart& start,
                               const LensSolve& solve);

}  // namespace calibrate
