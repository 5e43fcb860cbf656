// How much a lens dims towards its rim.
#pragma once

#include <span>

#include "calibrate/lens.h"

namespace calibrate {

// The sensitivity of a lens at an angle off its axis, 1 on it: 1 + v1 angle^2 + v2 angle^4 + ...,
// in radians. No terms = even.
double sensitivity(std::span<const double> vignetting, double angle_rad);

// Fills in the table's sensitivity; empties it if there are no terms.
void add_vignetting(std::span<const double> vignetting, DirectionTable& table);

// Throws std::invalid_argument unless the sensitivity stays above 0.05 up to an angle: below, a
// correction would show noise only.
void check_vignetting(std::span<const double> vignetting, double max_angle_rad);
// The same up to the corners of the lens's picture, or to its rim if that lies inside.
void check_vignetting(std::span<const double> vignetting, const Lens& lens);

}  // namespace calibrate
