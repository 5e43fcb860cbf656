// Boards before made cameras, with known truth: for tests and charts.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/lens_solve.h"

namespace calibrate {

// A lens of the family, or just outside of it: the angle off the axis has a ripple; or far outside:
// the angle around it is bent.
struct MadeLens {
  Lens lens;
  double ripple_rad = 0;  // of five times the angle off the axis
  double sees_rad = 0;    // corners beyond are not in the picture
  double bend_rad = 0;    // at the rim, of three times the angle around the axis

  Vec2 project(Vec3 v) const;
  std::optional<Vec3> unproject(Vec2 q) const;
};

// 1024 x 1024, 180 degrees, two terms. With a ripple, it is decentred and not quite square as well,
// so that no form describes it.
MadeLens made_fisheye(double ripple_rad = 0);
// 1280 x 720, 60 degrees across, of OPENCV5.
MadeLens made_normal();

// 10 x 10 corners, squares of 4 cm.
Board made_board();

struct MadeBoards {
  std::size_t views = 30;
  double noise_px = 0.3;
  double outliers = 0;     // share of the corners
  double centre_deg = 78;  // boards' middles lie up to here off the axis
  double tilt_deg = 40;
  double least_m = 0.28, most_m = 0.6;  // distance
  Vec2 warp_m;
  bool fronto = false;    // all boards face the camera
  double sees_deg = 180;  // corners beyond are hidden
  unsigned seed = 1;
};

// What suits the normal lens: boards farther away, over its narrower picture.
MadeBoards normal_boards();

// Boards whose middles spread evenly over the field, each at least half in the picture (fewer than
// asked for, if that cannot be), with normal noise; an outlier is 5 to 20 pixels off in any
// direction. The same options always give the same corners.
LensProblem make_board_views(const MadeLens& truth, const MadeBoards& boards);

// A direction, and the pixel in which the camera shows it.
struct MadeRay {
  Vec3 v;
  Vec2 q;
};
// What the picture shows up to an angle off the axis, evenly over the sphere.
std::vector<MadeRay> even_rays(const MadeLens& truth, double max_deg);

// RMS angle in milliradians between true and solved directions of even_rays(), once the best
// rotation between the two cameras is taken out (no picture of boards can tell that). Infinite if
// the solved lens does not see one.
double ray_error_mrad(const MadeLens& truth, const Lens& solved, double max_deg);
// The same of any camera: `unproject` gives the direction of a pixel.
double ray_error_mrad(const MadeLens& truth,
                      const std::function<std::optional<Vec3>(Vec2)>& unproject,
                      double max_deg);

}  // namespace calibrate
