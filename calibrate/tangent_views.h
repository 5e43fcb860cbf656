// Straight pictures of parts of a bent one.
#pragma once

#include <chrono>
#include <vector>

#include "calibrate/grey_picture.h"
#include "calibrate/lens.h"

namespace calibrate {

// A pinhole's picture of what a wide lens sees around one direction.
struct TangentView {
  GreyPicture picture;
  Vec3 axis, right, down;  // unit vectors in the camera's frame
  double focal_px = 0;

  // The direction of a pixel of this picture, of any length.
  Vec3 ray(Vec2 q) const;
};

// Views of 90 degrees that together cover what the lens sees, the rim first and in its finer
// resolution, none larger than 900 x 900; those that are made by then. Takes a lens of the
// picture's size, if only a guess.
std::vector<TangentView> tangent_views(const GreyPicture& picture,
                                       const Lens& lens,
                                       std::chrono::steady_clock::time_point deadline);

}  // namespace calibrate
