// What an operator should know of a lens calibration, in plain words.
#pragma once

#include <string>
#include <vector>

#include "calibrate/lens_calibration.h"

namespace calibrate {

// How much the residuals of neighbouring corners agree: their correlation, 0 if they are noise
// alone.
double agreement_of_neighbours(const LensProblem& problem,
                               const LensStart& start,
                               const LensSolve& solve);
// From here on, something is not in the model.
inline constexpr double suspicious_agreement = 0.25;

// One sentence for each doubt: corners that scatter or agree among neighbours, a bent board, too
// few or too similar pictures, or such that do not agree on a focal length, parts of the picture
// without corners or directions, a focal length that is hardly known. `calibration` is finished but
// for its warnings.
std::vector<std::string> warnings_of(const LensProblem& problem,
                                     const LensCalibration& calibration);

}  // namespace calibrate
