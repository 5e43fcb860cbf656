// The fit of a response curve's parameters to matched codes.
#pragma once

#include <span>
#include <vector>

#include "capture/comparagram.h"
#include "capture/curve_family.h"

namespace capture {

// What a family of curves makes of all matches. `claimed` has the exposures' logarithms, one for
// each shot.
struct CurveFit {
  std::vector<double> parameters;   // of all channels
  std::vector<double> exposures_s;  // solved; their geometric mean is kept
};
CurveFit fit_curve(const CurveFamily& family,
                   std::span<const CodeMatch> matches,
                   const std::vector<double>& claimed);

// Relative RMS of light, codes 25 to 235. Infinite if no shot can be judged.
struct HeldoutError {
  double by_code = 0;   // every code counts alike
  double by_pixel = 0;  // every pixel does, but those that differ by over 5 robust deviations
  double changed = 0;   // the share of these: what moved or flickered
};

// Each shot in turn is left out of the fit. What is then free is its exposure, taken from its
// matches' median; the disagreement that stays is the curve's.
HeldoutError heldout_error(const CurveFamily& family,
                           std::span<const CodeMatch> matches,
                           const std::vector<double>& claimed);

}  // namespace capture
