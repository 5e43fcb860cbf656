// Maps from plane to plane.
#pragma once

#include <optional>
#include <span>

#include "calibrate/vec.h"

namespace calibrate {

// The homography, up to a factor, that takes points (x, y, 1) to their images by least squares of
// the algebraic error. Nothing from fewer than four, or where they do not tell it.
//
// Hartley and Zisserman, "Multiple View Geometry", 2003, algorithm 4.2, with their normalisation.
std::optional<Mat3> find_homography(std::span<const Vec2> points, std::span<const Vec2> images);

}  // namespace calibrate
