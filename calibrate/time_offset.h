// By how much one camera's clock is ahead of another's, from something that both saw change.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "calibrate/vec.h"

namespace calibrate {

// What a camera saw in one frame: the mean brightness, or where something is along a line.
struct SignalSample {
  double time_s = 0;      // middle of the exposure, on the camera's clock
  double value = 0;       // in any unit
  double exposure_s = 0;  // over which it is averaged; 0 = unknown, half the time between frames
};

// Where a point that moves, as a board's middle, is seen in a frame.
struct SeenPoint {
  double time_s = 0;  // middle of the exposure, on the camera's clock
  Vec2 q;             // pixels
};

struct TimeOffsetOptions {
  double largest_s = 5;  // offsets to either side that are looked for
};

struct TimeOffset {
  double offset_s = 0;  // what is seen at t by A's clock is seen at t + offset by B's
  double sigma_s = 0;
  double correlation = 0;  // of both signals there, up to 1
  double next_best = 0;    // the highest correlation at an offset apart from it
  std::size_t edges = 0;   // jumps seen by both that it rests on; 0 = on the whole course
  bool in_step = false;    // these are in step with a camera's exposures: a wrong one does not show
  double overlap_s = 0;    // of the time that both saw
};

// Both signals are taken for averages, over their exposures, of one stationary Gaussian process
// with a gain, a level and noise for each; its smoothness (a Matern covariance of order 1/2, 3/2 or
// 5/2) and time scale are those of the greatest likelihood, and so is the offset: Rasmussen and
// Williams, "Gaussian Processes for Machine Learning", 2006, sections 4.2 and 5.4. So neither a
// lamp that jumps between frames nor a smooth motion biases it, as interpolation would. sigma_s is
// the likelihood's width, or what stretches of the signals differ by, if that is more. Where a
// camera does not tell its exposures, the offset is sought also with none and with whole frames'
// time instead of half of it: sigma_s is the largest of these, and, in quadrature, by how far the
// offset moves. Where both saw a lamp switched, and told their exposures, the moments of its
// switching take over (signal_edges.h), if they are ten or more; sigma_s is no less than a frame's
// time over the root of six times their number if they are fewer. Correlation of the signals,
// interpolated, finds the way there.
//
// Times rise strictly. Throws std::invalid_argument for values that are not finite, or times that
// do not rise; std::runtime_error, saying what to do, if there are fewer than 20 frames in common,
// if nothing changes, if the signals are not alike, or alike at several offsets, or tell the offset
// to no better than a frame.
TimeOffset find_time_offset(std::span<const SignalSample> a,
                            std::span<const SignalSample> b,
                            const TimeOffsetOptions& options = {});

// The same from where a point was seen that moves in any way (common_motion.h); frames in which it
// was not seen are left out. From two directions, perspective and lenses do not bias it. Refused as
// above, and if what both saw in common correlates by less than 0.99. `edges` is 0.
TimeOffset find_time_offset(std::span<const SeenPoint> a,
                            std::span<const SeenPoint> b,
                            const TimeOffsetOptions& options = {});

}  // namespace calibrate
