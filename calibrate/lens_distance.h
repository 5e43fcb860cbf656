// How far two lenses are from each other.
#pragma once

#include <optional>
#include <span>

#include "calibrate/lens.h"

namespace calibrate {

// Over some pixels, RMS but for the greatest, once the turn is taken out that brings their
// directions together best: a pose takes that back.
struct LensDistance {
  double angle_rad = 0;
  double axis_px = 0;      // in the first one's picture, along each axis
  double greatest_px = 0;  // there, of any of the pixels, whichever way
};

// Of pixels that either has no direction for, or the first one no pixel, nothing is said. Nothing
// if that leaves fewer than three. Throws as check().
std::optional<LensDistance> distance_between(const Lens& a,
                                             const Lens& b,
                                             std::span<const Vec2> pixels);

}  // namespace calibrate
