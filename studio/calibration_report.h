// A lens calibration as one HTML file, for people.
#pragma once

#include <string>

#include "calibrate/lens_calibration.h"

namespace studio {

// Summary, warnings, and as inline SVG: where corners were seen and how far off each is, the error
// of every candidate, the predicted error over the picture; then the tables of candidates and
// pictures. Holds nothing from outside. `title` is shown as text, whatever is in it.
std::string calibration_report(const calibrate::LensProblem& problem,
                               const calibrate::LensCalibration& calibration,
                               const std::string& title);

}  // namespace studio
