// Exposures that follow the light of a scene.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "capture/exposure_choice.h"
#include "capture/light_meter.h"

namespace capture {

struct AutoExposureSettings {
  // Noise, error, and the exposures that are possible. The brightest value that is kept below
  // `fullest` may rise to 0.85 before exposures change.
  ChoiceSettings choice;
  std::size_t most_exposures = 6;  // where the error takes more, a larger one is made do with
  // Light that has gone is expected back for so many frames, up to twice as many.
  int hold = 30;
  // Frames from a request to its effect, while that is not known.
  int most_lag = 8;
};

// Says which exposures a bracket should have, frame after frame, from what the frames show. Knows
// no clock and no camera: the same frames give the same exposures.
//
// It begins with the fewest exposures, a constant ratio apart, that resolve all that the camera can
// at the stated error: three or four, for a range of 14 stops. So the first bracket is usable, and
// there is nothing to search. From the newest frame of each exposure come the brightest radiance,
// nothing of the scene being left out, and the darkest, but for the light meter's share of values;
// choose_exposures has the exposures for them. They become those in force one at a time, each once
// the one before was seen, in the order that keeps the bracket's largest error least; those that do
// already stay.
//
// - Where something saturates in the shortest exposure, however little it is, the bracket gets one
//   as much shorter as an exposure reaches (the ratio of the brightest value to the least that one
//   exposure resolves), and again, until nothing does or the camera's shortest one is in use: then
//   it is `too_bright`. So a sun is found in few steps. In the same way the dark end becomes longer
//   where the darkest values cannot be told from black.
// - The bracket is left alone as long as it resolves the light's range: while the brightest value
//   in the shortest exposure is at most 0.85, and the darkest one in the longest has at most the
//   stated error. A new end leaves 0.6 stops of room there (exposures that are nearer to each other
//   could not be told apart while light drifts), so light within 0.6 stops changes nothing. The
//   bracket becomes narrower if one exposure fewer resolves the range with half a stop more at each
//   end, or if an end is more than a stop from where it would be chosen.
// - The range is that of the last `hold` frames or more. So a bracket becomes wider at once, and
//   narrower later; a lamp that is switched on and off does not change it each time.
// - Frames whose exposure is not known tell too, if there are more in a row than a bracket and the
//   lag: where all of them saturate somewhere, the shortest exposure does, whatever the labels.
class AutoExposures {
 public:
  // Throws std::invalid_argument as choose_exposures, for most_exposures = 0, and settings below 0.
  explicit AutoExposures(const AutoExposureSettings& settings);

  // What the bracket should have now, the shortest first: at least one, within the possible range.
  const std::vector<double>& exposures_s() const { return exposures_s_; }

  // Takes the next frame's light. `exposure_s` made it, 0 = unknown; `taken_s` is what the device
  // makes of exposures_s(), in that order; `lag` is the camera's. Returns whether exposures_s() has
  // changed: one was added, dropped, or replaced.
  // Throws std::invalid_argument if taken_s has another size.
  bool observe(const FrameLight& light,
               double exposure_s,
               std::span<const double> taken_s,
               std::optional<int> lag);

  // Something saturates in the shortest possible exposure.
  bool too_bright() const { return too_bright_; }
  // In the longest possible exposure more than the share of values has a larger error than stated.
  bool too_dark() const { return too_dark_; }
  // The error that the exposures were chosen for: more than stated if they would be too many.
  double relative_error() const { return relative_error_; }

 private:
  // The newest frame of an exposure of the bracket.
  struct Member {
    FrameLight light;
    std::int64_t seen_at = -1;  // when; -1 = not yet
    double taken_s = 0;
  };
  // The largest logarithm of the last frames.
  struct Held {
    std::optional<double> now, before;
    void take(double value);
    std::optional<double> largest() const;
  };
  struct Step {
    std::optional<double> dropped_s, added_s;
  };

  bool at_shortest() const;
  bool at_longest() const;
  bool note_labelled(const FrameLight& light, double exposure_s);
  void note_unlabelled(const FrameLight& light);
  bool all_seen() const;
  void measure();
  RadianceRange light() const;
  bool covers(const RadianceRange& light) const;
  void choose();
  ExposureChoice keep(ExposureChoice choice, bool wide) const;
  bool is_worth_it(const ExposureChoice& choice) const;
  double worst_error(const std::vector<double>& exposures_s) const;
  bool step();
  void take(const Step& step);

  AutoExposureSettings settings_;
  double least_value_;  // that has the stated error
  double black_value_;  // up to here it tells nothing
  std::vector<double> exposures_s_;
  std::vector<Member> members_;      // of exposures_s_
  std::vector<double> target_s_;     // what they are to become
  double relative_error_ = 0;        // of the target
  std::optional<double> awaited_s_;  // the exposure that was added last, until it is seen
  std::int64_t frames_ = 0;
  std::int64_t changed_at_ = 0;
  int bracket_and_lag_ = 0;  // frames until all exposures in force have been seen

  Held brightest_;  // logarithms of radiance
  Held darkest_;    // the same, negative
  std::int64_t held_since_ = 0;
  bool saturates_ = false;  // in the shortest exposure
  bool is_black_ = false;   // in the longest one
  bool too_bright_ = false;
  bool too_dark_ = false;
  // Frames without a label, in a row.
  int unlabelled_ = 0;
  bool all_saturate_ = true;
  bool all_are_black_ = true;
};

}  // namespace capture
