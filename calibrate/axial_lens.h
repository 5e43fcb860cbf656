// Our own lens models: symmetric about the optical axis, but for decentring.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "calibrate/lens.h"

namespace calibrate {

// A lens whose picture radius depends on the angle off the axis only: pinhole, equisolid,
// Kannala-Brandt; the decentred one shifts its symmetric picture point afterwards. Prepared from a
// checked Lens, cheap to make and copy.
//
// Kannala and Brandt, "A Generic Camera Model and Calibration Method for Conventional, Wide-Angle,
// and Fish-Eye Lenses", IEEE PAMI 28(8), 2006, section 2: the radially symmetric model. For its
// asymmetric terms we take the two of Brown, "Decentering Distortion of Lenses", Photogrammetric
// Engineering 32(3), 1966, on the picture in focal lengths.
class AxialLens {
 public:
  enum class Kind { pinhole, equisolid, kannala_brandt, decentred_kannala_brandt };

  // The kind of a model's name, or nothing if it is not one of ours.
  static std::optional<Kind> kind_of(std::string_view model);

  // `lens` passes check() and is of one of these kinds.
  explicit AxialLens(const Lens& lens);

  std::optional<Vec2> project(Vec3 v_cam) const;
  std::optional<Vec3> unproject(Vec2 q) const;

  Kind kind() const { return kind_; }
  Vec2 focal_px() const { return focal_px_; }
  Vec2 centre() const { return centre_; }
  bool decentred() const { return kind_ == Kind::decentred_kannala_brandt; }
  // The radius, in focal lengths, of the largest angle that the model can show: that of the lens's
  // max_angle_rad, or where the radius stops growing with the angle.
  double max_radius() const { return max_radius_; }
  // (sin(angle) / radius, cos(angle)) of a radius in focal lengths, 0 <= radius <= max_radius().
  Vec2 ray_of_radius(double radius) const;

 private:
  double radius(double angle_rad) const;
  double radius_slope(double angle_rad) const;
  double angle(double radius) const;
  Vec2 decentre(Vec2 symmetric) const;
  std::optional<Vec2> recentre(Vec2 decentred) const;
  double fold_angle(double max_angle_rad) const;
  std::optional<double> scale_by_angle(Vec3 v, double l) const;
  std::optional<double> equisolid_scale(Vec3 v, double l) const;

  Kind kind_;
  Vec2 focal_px_;
  Vec2 centre_;
  Vec2 decentring_;
  std::array<double, 4> k_{};
  double max_angle_rad_;
  double max_radius_;
  double least_cosine_;  // of an angle off the axis
};

}  // namespace calibrate
