// Other tools' lens calibrations, to measure ours against.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "calibrate/lens_solve.h"

namespace studio {

enum class LensPeer {
  opencv_camera5,  // cv::calibrateCamera, k1 k2 p1 p2 k3
  opencv_camera8,  // with its rational model
  opencv_fisheye,  // cv::fisheye::calibrate
  opencv_omnidir,  // cv::omnidir::calibrate
  mrcal_opencv5,   // mrcal_optimize, LENSMODEL_OPENCV5
  mrcal_splined,   // LENSMODEL_SPLINED_STEREOGRAPHIC, 8 x 8 knots over 190 degrees
};

const char* name_of(LensPeer peer);

struct LensPeerResult {
  std::string status;  // "ok", or what the tool said instead of an answer
  std::size_t parameters = 0;
  double time_ms = 0;                                                        // of the solve
  std::function<std::optional<calibrate::Vec3>(calibrate::Vec2)> unproject;  // if ok
};

// All corners of all views, with each tool's own defaults for its start and its outliers. mrcal's
// solver, which may abort, and cv::omnidir's run in processes of their own; `time_limit_s` ends
// them.
LensPeerResult calibrate_with(LensPeer peer,
                              const calibrate::LensProblem& problem,
                              double time_limit_s = 120);

}  // namespace studio
