// Which tone curve each frame of a show gets.
#pragma once

#include <optional>

#include "capture/frame.h"
#include "compositing/tone.h"
#include "studio/set.h"

namespace studio {

// Memory across frames, of a show. A frame's curve comes from the pictures before it, so that all
// its tiles can have it before one of them is rendered; the first frame's from its own.
//
// Levels are followed as logarithms, by the time that has passed and not by the number of frames.
// Where the picture's middle changes to its half or double from one frame to the next, that is a
// cut: the next frame has the new picture's curve. What comes within a thousandth of where it is
// going stays there.
class ToneFollower {
 public:
  explicit ToneFollower(const ToneSettings& settings) : settings_(settings) {}

  // For the next frame; nothing before the first picture.
  std::optional<compositing::ToneCurve> curve() const;
  // Takes a finished picture's levels; nothing = it is black, and all stays.
  void follow(const std::optional<compositing::PictureLevels>& levels, capture::Time time);

 private:
  ToneSettings settings_;
  std::optional<compositing::PictureLevels> followed_;
  float last_middle_ = 0;
  capture::Time last_time_{};
};

}  // namespace studio
