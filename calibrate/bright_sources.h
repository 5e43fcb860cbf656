// Bright compact things in a picture: lamps, windows, the sun.
#pragma once

#include <vector>

#include "calibrate/lens.h"
#include "capture/image.h"

namespace calibrate {

struct BrightSource {
  Vec3 v_cam;             // its middle, unit
  Vec2 q;                 // and the pixel there
  double power = 0;       // mean of the channels, integrated over its solid angle
  double radius_rad = 0;  // of a disc of that solid angle
  double sigma_rad = 0;   // how well its middle is known, along each axis
};

// The most powerful first, at most `most`. A source is what lies, joined together, above half of a
// local maximum that is at least four times the picture's median; it counts if it covers three
// pixels or more, does not touch the picture's rim, and is no wider than `largest_rad`. Clipped
// sources are found as well, and their power is then too low. Throws std::invalid_argument if the
// picture has not the lens's size.
std::vector<BrightSource> find_bright_sources(const capture::Image& radiance,
                                              const Lens& lens,
                                              std::size_t most = 12,
                                              double largest_rad = 0.12);

}  // namespace calibrate
