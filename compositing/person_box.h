// The box that a person's visual hull is looked for in: where all cameras' outlines meet.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "capture/image.h"

namespace compositing {

// Edges of all that may be somebody in a matte: alpha (height, width, 1) of a tenth or more, and
// two pixels around it. Left, top, right, bottom in pixels of the matte; nothing if it is empty.
std::optional<std::array<float, 4>> outline_box(const capture::Image& alpha);

// What one camera sees of the person.
struct OutlinedView {
  calibrate::Lens lens;
  calibrate::Pose cam_from_set;
  std::array<float, 4> box{};  // outline_box(), in pixels of the lens's picture
};

struct PersonBox {
  calibrate::Vec3 lower, upper;
  bool has(calibrate::Vec3 p) const {
    return p.x >= lower.x && p.x <= upper.x && p.y >= lower.y && p.y <= upper.y && p.z >= lower.z &&
           p.z <= upper.z;
  }
};

// The least upright box, along the set's axes, that holds all places that each view sees within its
// outline or beyond its picture, no further than 3 m from `standing` and no higher than 3 m, from a
// millimetre above the floor it stands on; 20 mm wider than that. An outline that touches the
// picture's edge goes on beyond it, there .8 m wider, if any view shows all of the person. Nothing
// if there is no such place, or it is not finite.
std::optional<PersonBox> person_box(std::span<const OutlinedView> views, calibrate::Vec3 standing);

}  // namespace compositing
