// What an operator should know of a lens calibration, in plain words.
#pragma once

#include <string>
#include <vector>

#include "calibrate/lens_calibration.h"

namespace calibrate {

// One sentence for each doubt: corners that scatter or agree among neighbours, a bent board, too
// few or too similar pictures, parts of the picture without corners, a focal length that is hardly
// known. `calibration` is finished but for its warnings.
std::vector<std::string> warnings_of(const LensProblem& problem,
                                     const LensCalibration& calibration);

}  // namespace calibrate
