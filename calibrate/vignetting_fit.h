// A lens's vignetting, from shots of one scene in several orientations, or of an even field.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "capture/image.h"

namespace calibrate {

// What a shot shows of a place whose light stays: at an angle off the axis, radiance > 0.
struct VignettingSample {
  std::size_t place = 0;
  double angle_rad = 0;
  double radiance = 0;
};

struct VignettingCandidate {
  int terms = 0;
  double heldout_error = 0;  // relative RMS, of places that took no part
};

struct VignettingFit {
  std::vector<double> terms;  // as sensitivity() takes them, and sets' `vignetting`
  double heldout_error = 0;
  double max_angle_rad = 0;  // of places seen twice or more; beyond it the terms are a guess
  std::vector<VignettingCandidate> candidates;
  std::vector<std::string> warnings;  // for people; held-out errors of 10 % and more have one
};

// The fewest terms, none to four, whose squared errors on held-out places are within nine variances
// of a sample of the best's, and within a tenth: a term that moves all of them together by three
// standard deviations is kept.
// The light of each place is eliminated; Cauchy's loss, so that what moved hardly pulls; each count
// of terms starts from the one before, and its steps are halved while the loss rises. An even
// field is a single place (then angles are held out). Differences of logarithms between samples of
// one place tell the sensitivity: Goldman, "Vignette and Exposure Calibration and Compensation",
// IEEE PAMI 32(12), 2010, section 3, with our even polynomial of the angle. Places with a single
// sample tell nothing and take no part.
// Throws std::invalid_argument for values that are not finite or above 0, std::runtime_error if
// places are seen at too few different angles.
VignettingFit fit_vignetting(std::span<const VignettingSample> samples);

// One shot of a scene that stands still and is far away, the camera turned about its lens.
struct TurnedShot {
  const capture::Image* radiance = nullptr;  // linear, of one exposure or divided by it
  Pose cam_from_set;                         // its position does not matter
};

// Samples of some 4000 directions over the sphere, in every shot that sees them: the mean of the
// channels over 3 x 3 pixels, left out where it is not above 0, not finite, from `saturation` on,
// or uneven by over 10 %. Throws std::invalid_argument for no shots or sizes that are not the
// lens's.
std::vector<VignettingSample> turned_samples(std::span<const TurnedShot> shots,
                                             const Lens& lens,
                                             double saturation);

// Samples of a shot of an even field (an integrating sphere, an overcast sky through a diffuser):
// one place.
std::vector<VignettingSample> even_field_samples(const capture::Image& radiance,
                                                 const Lens& lens,
                                                 double saturation);

}  // namespace calibrate
