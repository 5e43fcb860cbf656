// Where two signals, or the places of one thing in two pictures, go alike: roughly, everywhere.
#pragma once

#include <span>
#include <vector>

#include "calibrate/time_offset.h"

namespace calibrate {

struct SignalMatch {
  double offset_s = 0;  // to a share of a frame
  double correlation = 0;
  double gain_b = 1;  // B's spread there over A's
};

// The offsets, up to the largest, at which two signals correlate more than just before and after:
// the highest first, eight of them at most, none if they nowhere do. Signals are interpolated, but
// not over gaps, and count where both cameras saw. Left out are offsets at which this is less than
// 40 % of what the one saw that saw less, or at which hardly anything changes.
std::vector<SignalMatch> match_signals(std::span<const SignalSample> a,
                                       std::span<const SignalSample> b,
                                       double largest_s);

// The same for places, along the direction in either picture that makes them correlate most (the
// first canonical correlation: Hotelling, "Relations Between Two Sets of Variates", Biometrika
// 28(3/4), 1936): cameras that stand apart see one direction of what moves in space in common, and
// need not see it move most along that.
std::vector<SignalMatch> match_places(std::span<const SeenPoint> a,
                                      std::span<const SeenPoint> b,
                                      double largest_s);

// The time from one frame to the next, where none is missing.
double frame_interval_s(std::span<const SignalSample> signal);
double frame_interval_s(std::span<const SeenPoint> points);

// Samples further apart than this, in frames, have a gap between them.
inline constexpr double gap_frames = 3.5;

}  // namespace calibrate
