// Where a picture errs: group by group of pixels.
#pragma once

#include <array>
#include <vector>

#include "capture/image.h"

namespace render {

// Pixels on a side.
inline constexpr int error_group = 8;
// Radiance, where 1 is display white: darker groups are taken for as bright as this.
inline constexpr float darkest_group = 1e-3F;

struct GroupError {
  int x = 0, y = 0;  // of its top left pixel
  // Of the mean colour of its pixels: what is seen from where they are no longer told apart.
  double mean = 0;
  double rms = 0;  // of its pixels
};

// The errors of groups of 8x8 pixels, from the top left on, row by row; of those cut off by the
// picture's border, what lies in it. Groups in which `mask` (height, width, 1) is nowhere above 0
// are left out, and so are pixels. Both errors are relative to the group's truth, values clamped at
// `clamp`, as in picture_error(), against two references of independent noise. A group that is not
// finite has an infinite error. Throws std::invalid_argument if sizes differ.
std::vector<GroupError> group_errors(const capture::Image& x,
                                     const std::array<capture::Image, 2>& references,
                                     const capture::Image& mask,
                                     float clamp = 4.0F);

// The share of groups whose error is at most `most`; 1 if there are none.
double share_within(const std::vector<GroupError>& groups, double GroupError::*error, double most);

}  // namespace render
