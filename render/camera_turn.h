// How a camera is turned in the set. Private to the kernel.
#pragma once

#include <array>

#include "calibrate/pose.h"
#include "calibrate/vec.h"

namespace render {

// The rotation between a camera's frame and the set's, for directions of one number or of eight.
struct CameraTurn {
  std::array<float, 9> set_from_cam{1, 0, 0, 0, 1, 0, 0, 0, 1};  // row-major

  CameraTurn() = default;
  explicit CameraTurn(const calibrate::Mat3& cam_from_set) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j)
        set_from_cam[i * 3 + j] = static_cast<float>(cam_from_set.m[j * 3 + i]);
    }
  }

  template <class T>
  calibrate::Vec3T<T> to_set(const calibrate::Vec3T<T>& v) const {
    const auto& m = set_from_cam;
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
  }
  calibrate::Vec3f to_camera(calibrate::Vec3f d) const {
    const auto& m = set_from_cam;
    return {m[0] * d.x + m[3] * d.y + m[6] * d.z, m[1] * d.x + m[4] * d.y + m[7] * d.z,
            m[2] * d.x + m[5] * d.y + m[8] * d.z};
  }
};

}  // namespace render
