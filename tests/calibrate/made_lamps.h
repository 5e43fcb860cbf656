// A made world of lamps, far away, and pictures of it.
#pragma once

#include <cmath>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "capture/image.h"
#include "tests/calibrate/made_markers.h"

namespace made {

struct Lamp {
  calibrate::Vec3 v_set;  // unit
  double radius_rad = 0.02;
  double radiance = 20;
};

struct LampWorld {
  std::vector<Lamp> lamps;
  double detail = 1;  // of the walls; 0 = even

  double light(calibrate::Vec3 v) const {
    double sum = 0.2 * std::exp(detail * (0.5 * std::sin(5 * v.x + 1) * std::cos(4 * v.y) +
                                          0.4 * std::sin(7 * v.z - 2 * v.x)));
    for (const Lamp& lamp : lamps) {
      const double off = std::atan2(length(cross(v, lamp.v_set)), dot(v, lamp.v_set));
      sum += lamp.radiance / (1 + std::exp((off - lamp.radius_rad) / (0.1 * lamp.radius_rad)));
    }
    return sum;
  }
};

// Clipped at `white`, with relative noise; 2 x 2 rays a pixel.
inline capture::Image photograph(const LampWorld& world,
                                 const calibrate::Lens& lens,
                                 const calibrate::Mat3& cam_from_set,
                                 double white,
                                 double noise,
                                 Random& random) {
  capture::Image image = capture::make_image(lens.height, lens.width, 3);
  const calibrate::Mat3 set_from_cam = cam_from_set.transposed();
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      double sum = 0;
      for (const double dy : {-0.25, 0.25}) {
        for (const double dx : {-0.25, 0.25}) {
          const auto v = unproject(lens, {x + dx, y + dy});
          if (v) sum += world.light(set_from_cam * *v) / 4;
        }
      }
      for (int c = 0; c < 3; ++c) {
        image.at(y, x, c) =
            static_cast<float>(std::min(white, sum * (1 + noise * random.normal())));
      }
    }
  }
  return image;
}

// 73 degrees across.
inline calibrate::Lens scene_lens() { return {"pinhole", 320, 240, {215, 215, 159.5, 119.5}}; }
inline calibrate::Lens probe_lens() {
  return {"equisolid", 300, 300, {104, 149.5, 149.5}, 92 * degree};
}

}  // namespace made
