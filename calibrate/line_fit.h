// A fish-eye from straight lines of the scene, where there is no board.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/lens_distance.h"
#include "calibrate/line_marks.h"
#include "calibrate/line_planes.h"

namespace calibrate {

struct LineFitOptions {
  FisheyeLaw law = FisheyeLaw::equisolid;
  bool free_centre = false;  // else the marks' centre, or the picture's
  // Standard deviations that are to be expected; larger residuals raise the uncertainty, smaller
  // ones do not lower it.
  double noise_px = 0.5;                                     // of a mark across its line
  double parallel_noise_rad = 0.3 * std::numbers::pi / 180;  // of a built edge's direction
};

// What became of one line.
struct LineReport {
  Vec3 normal_cam;          // of the plane through the camera in which it lies, unit
  double rms_px = 0;        // of its marks, across it
  double worst_px = 0;      // the largest of them
  double heldout_px = 0;    // rms_px when the lens is fitted without this line; NaN: it cannot be
  double parallel_rad = 0;  // between the line's plane and its group's direction; 0 without a group
  // The same with lens and direction by the other lines alone; NaN: they do not tell.
  double heldout_parallel_rad = 0;
};

// Parallel lines, each with a plane of its own.
struct ParallelReport {
  std::string name;
  std::size_t lines = 0;
  Vec3 direction_cam;  // unit, y >= 0: verticals point down
  double rms_rad = 0;  // of the lines' parallel_rad; 0 for two lines, whose planes always meet
};

// What a marked rectangle looks like, seen straight on.
struct RectangleReport {
  std::string name;
  double aspect = 0;          // its first and third side's length over that of the others
  double off_square_rad = 0;  // how far its corners are from right angles, at most
  Vec3 normal_cam;            // of its plane, unit, away from the camera
};

// What the same lines make of a lens of the other law.
struct OtherLaw {
  Lens lens;
  double rms_px = 0;
  // By how much the lines speak against it: its cost less ours, in variances of what is off by as
  // much as expected; below 0 they are for it.
  double against = 0;
  LensDistance distance;  // between both lenses, up to the mark that is farthest from the middle

  // Less than three standard deviations.
  bool undecided() const { return std::abs(against) < 9; }
};

struct LineFit {
  // "equisolid", or "kannala_brandt" without terms. Its error_px counts the uncertainty of the
  // focal length, and how far the other law's lens is from it as far as the lines leave that open.
  Lens lens;
  double focal_sigma_px = 0;
  Vec2 centre_sigma_px;  // 0 if it was given
  double rms_px = 0;     // of all marks
  std::vector<LineReport> lines;
  std::vector<ParallelReport> parallels;
  std::vector<RectangleReport> rectangles;
  std::optional<OtherLaw> other;  // nothing: it fits no lens to these lines
};

// The lens under which marks of one line have bearings in one plane, and planes of parallel lines
// have one direction in common, up to noise: the least sum of Cauchy's losses of the distances in
// pixels (to first order, after Sampson, "Fitting Conic Sections to Very Scattered Data", CGIP
// 18(2), 1982) and of the angles. Lines instead of boards: Devernay and Faugeras, "Straight Lines
// Have to Be Straight", MVA 13(1), 2001; ours lie in planes through the camera, so that angles
// beyond 90 degrees are as good as others. Lines through the centre tell the focal length only by
// being parallel to others. Where marks or parallels are off by more than expected, by the median
// of their squares, the fit is repeated with what they are off by.
//
// Throws std::invalid_argument as check(), and for noise that is not above 0; std::runtime_error,
// saying what to do, if the lines do not tell the focal length to a tenth.
LineFit fit_lens_to_lines(const LineMarks& marks, const LineFitOptions& options = {});

// The shape of what has four sides that lie, one after the other, in planes through the camera with
// these normals. If its own plane is known, by its normal, sides are measured on it; else it is the
// one on which they form a parallelogram. Nothing if they bound nothing there.
std::optional<RectangleReport> rectangle_of(const std::array<Vec3, 4>& sides_cam,
                                            std::optional<Vec3> normal_cam = {});

}  // namespace calibrate
