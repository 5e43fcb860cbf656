// The made car's smooth surfaces: the band around its body, deck and cabin. Private to made_car.
#pragma once

#include <array>
#include <vector>

#include "render/surface_patches.h"

namespace render {

// x is forward, y to the left, z up; metres.
//
// The band goes around the car from its sill to its shoulder. Its first parameter is the way along
// the plan's outline, 0 at the front, positive to the left, `length()` all the way around; its
// second is the height. The deck (bonnet and boot) lies between the shoulders, with parameters x
// and the share -1..1 of the way from right to left. The cabin stands on the deck: its parameters
// are the x of its foot and the share 0..1 of the way from its right foot over the roof to its left
// one.
class CarShape {
 public:
  CarShape();

  double length() const { return length_; }
  // Way along the left side's outline where it is at x, -2.1 < x < 2.1.
  double way_at_x(double x) const;
  // x of the outline there.
  double x_at_way(double way) const;

  Vec3 band(double way, double z) const;
  double sill_z(double x) const;      // lower edge of the band, wheel arches included
  double shoulder_z(double x) const;  // upper edge
  Vec3 deck(double x, double share) const;
  Vec3 cabin(double foot_x, double share) const;
  double cabin_height(double foot_x) const;
  // Half width and height of the shoulder at x.
  std::array<double, 2> shoulder_at(double x) const;

  static constexpr double half_length = 2.1, half_width = 0.9;
  static constexpr double floor_z = 0.17;
  static constexpr double arch_radius = 0.40;
  static constexpr double cabin_front_x = 1.02, cabin_rear_x = -1.80;

 private:
  std::array<double, 2> outline(double way, std::array<double, 2>& normal) const;
  double angle_at_way(double way) const;

  double length_ = 0;
  std::vector<double> ways_;                      // of even angles, half way around
  std::vector<std::array<double, 3>> shoulders_;  // x, half width, z; x falling
  MonotoneCurve shoulder_;
  MonotoneCurve crown_;
  MonotoneCurve height_;
  MonotoneCurve inset_;
};

}  // namespace render
