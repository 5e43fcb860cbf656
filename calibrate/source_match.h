// How a lightprobe is turned, from bright sources that the scene camera sees too.
#pragma once

#include <string>
#include <vector>

#include "calibrate/bright_sources.h"
#include "calibrate/rotation_fit.h"

namespace calibrate {

// A picture, and how it was taken. Both must outlive it.
struct LensedPicture {
  const capture::Image* radiance = nullptr;
  const Lens* lens = nullptr;
};

struct SourceMatch {
  RotationFit fit;                           // probe_from_set, and its uncertainty
  std::vector<BrightSource> camera_sources;  // of the pairs, in the order of the fit
  std::vector<BrightSource> probe_sources;
  double likeness = 0;  // correlation of both pictures' logarithms over common directions, -1 to 1
  std::vector<std::string> warnings;
};

// The rotation that brings most sources together, out of those that two pairs of sources at equal
// angles to each other allow; of rotations that do so alike, the one by which the whole pictures
// are alike. Both cameras are taken to stand at one place, or the sources to be far away:
// `tolerance_rad` is how far apart directions to one source may be. Throws std::runtime_error,
// saying what to do, if fewer than two sources are found in both, or two rotations fit as well;
// std::invalid_argument as find_bright_sources.
SourceMatch match_sources(const LensedPicture& camera,
                          const Mat3& cam_from_set,
                          const LensedPicture& probe,
                          double tolerance_rad);

}  // namespace calibrate
