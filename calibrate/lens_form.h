// What a lens solve chooses from: a model, and which of its parameters it may move.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "calibrate/lens.h"

namespace calibrate {

// One candidate. Its free parameters are those of the lens model in their order, but that two equal
// focal lengths are one.
struct LensForm {
  std::string model;      // of Lens; any but "pinhole" and "equisolid" (LENSMODEL_PINHOLE is there)
  std::size_t terms = 0;  // of Kannala and Brandt's polynomial, 0 to 4
  bool one_focal = true;  // fx = fy

  friend bool operator==(const LensForm&, const LensForm&) = default;
};

// "kannala_brandt 2", "LENSMODEL_OPENCV5", with " fx fy" behind it where the focal lengths differ.
std::string name_of(const LensForm& form);

// How many parameters are free. Throws std::invalid_argument for an unknown model.
std::size_t free_count(const LensForm& form);

// The lens of free parameters, and back. A lens of another model gives its focal lengths, its
// centre, and the terms that both models have; the others begin at zero.
Lens lens_of(const LensForm& form, int width, int height, std::span<const double> free);
std::vector<double> free_of(const LensForm& form, const Lens& lens);

// A form's projection with its derivatives, fast; for solvers.
class LensFunction {
 public:
  explicit LensFunction(const LensForm& form);  // throws as free_count()

  std::size_t free_count() const { return free_count_; }

  // The pixel of a point in the camera's frame. `dq_dp` is 2x3 and `dq_dfree` 2 x free_count(), row
  // by row; either may be null. False where the model has none: behind a lens that cannot see
  // there, not finite.
  bool operator()(const double* free, Vec3 p_cam, Vec2& q, double* dq_dp, double* dq_dfree) const;

 private:
  bool by_mrcal(const double* free, Vec3 p_cam, Vec2& q, double* dq_dp, double* dq_dfree) const;
  bool by_angle(const double* free, Vec3 p_cam, Vec2& q, double* dq_dp, double* dq_dfree) const;

  LensForm form_;
  std::size_t free_count_;
  bool mrcal_;
  bool decentred_;
  bool sees_behind_ = true;
  std::vector<std::byte> mrcal_model_;  // mrcal_lensmodel_t
};

}  // namespace calibrate
