// The time offset between two cameras that see one thing move in space.
#pragma once

#include <span>

#include "calibrate/time_offset.h"

namespace calibrate {

struct MotionOffset {
  double offset_s = 0;
  double correlation = 0;  // of what both see in common
};

// The offset near `about_s` at which what both cameras see in common correlates most; 0 where they
// saw too little at one time.
//
// The planes through both cameras are a pencil, and which of them a point is in either camera can
// tell from where it sees it: Hartley and Zisserman, "Multiple View Geometry", 2003, section 9.1.
// So there is a function of the place in A's picture, and one of that in B's, which are equal at
// one time and wherever the thing moves. Both are sought as quadratics, by the first canonical
// correlation, anew for each offset: no lens, pose or pinhole is needed. B's places are
// interpolated by cubics at the times of A's frames, but not over gaps.
MotionOffset refine_motion_offset(std::span<const SeenPoint> a,
                                  std::span<const SeenPoint> b,
                                  double about_s);

// Its standard deviation: what leaving out each eighth of the time in turn changes (the jackknife:
// Efron, "The Jackknife, the Bootstrap and Other Resampling Plans", 1982, chapter 3). Infinite if
// too little is left of it then.
double motion_sigma_s(std::span<const SeenPoint> a, std::span<const SeenPoint> b, double offset_s);

}  // namespace calibrate
