// The plate's exposure, frame by frame, over the one that a set's match was calibrated at.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "calibrate/light_gain.h"

namespace studio {

// Memory across frames, of a show. Where times of exposure are told, they are taken at their word:
// only what they leave open, be it the calibrated one or the camera's amplification, is measured
// from directions that both cameras see.
class ExposureFollower {
 public:
  // Fewer directions may be one thing that moves.
  static constexpr std::size_t fewest_pairs = 10;

  // `calibrated_s`: the plate's exposure that the match was calibrated at; nothing = not told.
  // `told_by_pairs`: what pairs tell of that exposure, where the match is by something else (> 0).
  explicit ExposureFollower(std::optional<double> calibrated_s = std::nullopt,
                            double told_by_pairs = 1)
      : calibrated_s_(calibrated_s), told_by_pairs_(told_by_pairs) {}

  // Takes one frame: its exposure, 0 = not told, and pairs whose probe side is what the plate would
  // show at a level.
  void follow(double exposure_s,
              double level_of_pairs,
              std::span<const calibrate::LightPair> pairs);
  // Whether pairs would be of any use.
  bool needs_pairs(double exposure_s) const { return !(calibrated_s_ && exposure_s > 0); }

  double level() const { return level_; }
  // By how much the directions last measured by disagree: relative, robust.
  double spread() const { return spread_; }
  // Whether that is so much that the last frame's exposure is to be doubted; the note says so, too.
  bool is_doubtful() const { return doubtful_; }
  // How the last frame's was found, in words.
  const std::string& note() const { return note_; }

 private:
  std::optional<double> calibrated_s_;
  double told_by_pairs_ = 1;
  double level_ = 1;
  double spread_ = 0;
  bool doubtful_ = false;
  bool measured_ = false;
  bool timed_ = false;     // what follows is per second of exposure
  double per_second_ = 1;  // level over the told exposure, averaged; the level itself if not told
  std::string note_;
};

}  // namespace studio
