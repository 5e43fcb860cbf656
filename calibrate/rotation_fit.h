// The rotation of a camera whose position is known, or whose sights are far away.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "calibrate/lens_error.h"
#include "calibrate/sight.h"

namespace calibrate {

// One direction in both frames, unit vectors.
struct SeenDirection {
  Vec3 v_cam;
  Vec3 v_set;
  double sigma_rad = 1e-3;  // expected error along each axis across it
};

struct RotationFit {
  Mat3 cam_from_set;
  std::array<double, 9> covariance{};  // of a small turn, rad^2: cam_from_set becomes exp(turn) * R
  double turn_sigma_rad = 0;           // root of its total variance
  double rms_rad = 0;                  // of the directions that agree
  double excess = 0;                   // their residuals, over the errors expected: about 1
  std::vector<double> residuals_rad;   // of every direction
  std::vector<bool> agrees;            // false: taken for wrong, and without a say
};

// From two directions or more; of five or more, a third may be wrong. Rotations of two directions
// each seed Wahba's problem with Cauchy's loss, solved by Davenport's method: Markley and Mortari,
// "Quaternion Attitude Estimation Using Vector Observations", J. Astronautical Sciences 48(2),
// 2000. What residuals exceed the expected errors by enlarges the uncertainty. Throws
// std::invalid_argument for directions that are not unit vectors, or errors not above 0;
// std::runtime_error if there are fewer than two, if all lie on one axis, or do not agree.
RotationFit fit_rotation(std::span<const SeenDirection> directions);

// The rotation R that brings R * from[i] and to[i] together best by least squares: all directions
// alike, none taken for wrong. Identity if they leave it open. Kabsch, "A Solution for the Best
// Rotation to Relate Two Sets of Vectors", Acta Crystallographica A32, 1976. Throws
// std::invalid_argument if they are not as many.
Mat3 best_rotation(std::span<const Vec3> from, std::span<const Vec3> to);

// Adds to a fit's uncertainty what the lens is off by, of directions_from() these sights and
// position, in their order.
void add_lens_error(RotationFit& fit,
                    std::span<const Sight> sights,
                    Vec3 position,
                    const LensError& error);

// Sights from a known position in the set; `noise_px` along each pixel axis. Throws
// std::invalid_argument if a sight's point is that position.
std::vector<SeenDirection> directions_from(std::span<const Sight> sights,
                                           Vec3 position,
                                           double noise_px);

}  // namespace calibrate
