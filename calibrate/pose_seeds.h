// Poses to start from: those of three sights each that explain the others best.
#pragma once

#include <span>
#include <vector>

#include "calibrate/sight.h"

namespace calibrate {

// How far one camera's pose is from another: the angle between them, or the way between their
// positions in parts of the distance to `centre` in the set, whichever is more.
double distance_between(const Pose& a, const Pose& b, Vec3 centre);

struct PoseSeed {
  Pose cam_from_set;
  double cost = 0;  // the sum of log(1 + r^2 / loss_px^2) over the sights that are compared
};

// Sights by which poses are compared, if there are more: that many of them, evenly.
inline constexpr std::size_t most_seed_sights = 60;

// A few poses that differ by over a tenth (distance_between), the best first; none if no three
// sights have any. All triples of up to eight sights are tried, else as many drawn with a fixed
// seed as the share of sights that the best pose explains calls for. See register_camera.
std::vector<PoseSeed> find_pose_seeds(std::span<const Sight> sights, Vec3 centre, double loss_px);

}  // namespace calibrate
