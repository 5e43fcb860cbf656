// The gain from the lightprobe's units to the plate's, from what both tell of the same things.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace calibrate {

// One thing: a direction that both cameras see, a grey card, a patch of a chart.
struct LightPair {
  std::array<double, 3> probe{};  // what the probe's light makes it send, in the probe's units, > 0
  std::array<double, 3> plate{};  // what the plate shows, linear, > 0
  std::size_t frame = 0;          // of the plate, whose exposure may change from frame to frame
  // Pairs of one thing, in several frames, err alike: more of them tell the gains no better.
  static constexpr std::size_t of_its_own = static_cast<std::size_t>(-1);
  std::size_t thing = of_its_own;
};

// A held-out error from here on has a common cause, which no mean lessens: the sigmas do not hold.
inline constexpr double doubtful_heldout_error = 0.3;

struct LightGainOptions {
  // A matrix is taken if it lowers the held-out error by more than this share of it, the gains' is
  // above `good_enough`, and the probe's colours differ by five times the matrix's or more.
  double matrix_improves = 0.25;
  double good_enough = 0.01;
};

struct LightGain {
  std::array<double, 3> gain{1, 1, 1};  // plate = gain * probe * exposure of the frame
  // Relative, by Student's t; of fewer than five things one for all channels; 1 if the first frame
  // has one thing only.
  std::array<double, 3> sigma{};
  // Row by row, in place of the gains where held-out pairs ask for it.
  std::optional<std::array<double, 9>> matrix;
  // Relative RMS of the gains, of things that took no part; not a number if none could be judged.
  double heldout_error = 0;
  std::optional<double> matrix_heldout_error;  // nothing if there are too few pairs to try
  // The plate's exposure by frame, the first that pairs are of being 1; 0 where no pair is of it.
  std::vector<double> exposures;
  std::size_t left_out = 0;  // pairs beyond four standard deviations, which hardly count
  std::vector<std::string> warnings;
};

// Gains by Cauchy's loss on the logarithms of plate over probe, one exposure a frame solved along
// with them; the matrix by the same loss on relative errors. Held out is every fifth thing in turn,
// from all frames, and the worst tenth of errors does not count; uncertainties, too, are by things
// (Liang and Zeger, "Longitudinal Data Analysis using Generalized Linear Models", Biometrika 73(1),
// 1986). Throws std::invalid_argument for values that are not
// finite and above 0, std::runtime_error if there is no pair.
LightGain fit_light_gain(std::span<const LightPair> pairs, const LightGainOptions& options = {});

// One frame's exposure on the scale of a fit: a single number, whatever its pairs, so that the
// fixed gains follow the plate's auto-exposure. Throws as fit_light_gain.
double follow_exposure(const LightGain& fit, std::span<const LightPair> pairs);

// What a fit expects the plate to show, at exposure 1.
std::array<double, 3> predict(const LightGain& fit, const std::array<double, 3>& probe);

}  // namespace calibrate
