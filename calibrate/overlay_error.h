// How far off a virtual object may be drawn, by what a calibration knows of its own error.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "calibrate/lens_solve.h"

namespace calibrate {

// A lens form's solve of the corners, and its share of belief.
struct BelievedSolve {
  const LensSolve* solve = nullptr;
  double share = 1;  // of all forms'; they add up to 1
};

// The predicted error at each pixel: the distance in pixels that at least 95 of 100 calibrations
// like this one stay below (the far end of the 95 % ellipse: errors of one calibration stand and
// fall together, so a length that just 95 % of pixels hold would be broken all over the picture by
// one in twenty), once the camera's pose has been found through the same lens (a turn of the camera
// is part of its pose, not of the lens's error).
//
// Three things go into it. The corners' noise, carried from residuals through the solve to the
// pixel: after mrcal's projection uncertainty (mrcal.secretsauce.net/uncertainty.html), but that we
// take the turn out by least squares over the covered picture instead of averaging over the boards.
// What other lens forms make of the same corners, each with its own noise, by its share of belief:
// Burnham and Anderson, "Model Selection and Multimodel Inference", 2002, section 4.3. And the
// held-out residuals: if corners that took no part are missed by more than the solve's own, so is
// the rest.
class OverlayError {
 public:
  // `solves` are over the same corners, of `start`; the first is the one whose lens is used.
  // `sigma_px` is of a corner's coordinates. Throws std::invalid_argument if there is no solve, or
  // no corner is in use.
  OverlayError(const LensProblem& problem,
               const LensStart& start,
               std::span<const BelievedSolve> solves,
               double sigma_px);

  // Whether corners were seen about there, and at such angles. The picture is divided into cells
  // of a 32nd of its diagonal; a cell counts if a corner lies in it or in one of its neighbours.
  bool covered(Vec2 q) const;

  // 95 % error in pixels; nothing where it is unknown: outside of coverage.
  std::optional<double> at(Vec2 q) const;

  // RMS over the covered picture of a pixel's standard deviation along its worst direction.
  double rms_px() const;

  // Its part from noise alone: the covariance (xx, xy, yy) of a pixel, pixels^2, also outside of
  // coverage. Nothing where the lens sees nothing.
  struct Covariance {
    double xx = 0, xy = 0, yy = 0;
  };
  std::optional<Covariance> noise(Vec2 q) const;

  double max_angle_rad() const { return max_angle_rad_; }  // off the axis, of a corner

 private:
  struct Member {
    LensForm form;
    Lens lens;
    std::vector<double> free;
    std::vector<double> root;  // n x m: root root^T is the covariance of the free parameters
    std::vector<double> turn;  // 3 x n: the turn that goes with a change of them
    double share = 1;
    Mat3 from_ours;  // turns directions of the first lens to this one's
  };
  static std::optional<Covariance> noise_of(const Member& member, Vec3 v);

  std::size_t cell_of(Vec2 q) const;
  void cover(const LensProblem& problem, const LensStart& start, const LensSolve& solve);

  int cells_x_ = 0, cells_y_ = 0;
  double cell_px_ = 1;
  std::vector<std::uint8_t> covered_;
  double max_angle_rad_ = 0;
  std::vector<Member> members_;
};

}  // namespace calibrate
