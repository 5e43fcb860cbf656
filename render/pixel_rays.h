// Camera rays through any point of a pixel.
#pragma once

#include <optional>

#include "calibrate/lens.h"
#include "calibrate/pose.h"

namespace render {

using calibrate::Vec3f;

// A lens's direction table at a pose. The table must outlive it.
class PixelRays {
 public:
  PixelRays(const calibrate::DirectionTable& directions, const calibrate::Pose& cam_from_set);

  // Where all rays begin, in the set.
  Vec3f origin() const { return origin_; }

  // Direction in the set (unit) through (x + dx, y + dy), -.5 <= dx, dy <= .5, bilinear between the
  // centres of pixels; nothing where the lens does not see the centre of (x, y).
  std::optional<Vec3f> direction(int x, int y, float dx, float dy) const;

 private:
  Vec3f at(int x, int y) const;

  const calibrate::DirectionTable& directions_;
  calibrate::Mat3 set_from_cam_;
  Vec3f origin_;
};

}  // namespace render
