// Jumps of a signal, as of a lamp that is switched, and the time offset that they tell.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calibrate/time_offset.h"

namespace calibrate {

// A jump from one level to another, and when it was.
struct SignalEdge {
  double low_s = 0;  // not before, and not after
  double high_s = 0;
  double sigma_s = 0;  // of both limits
  bool rising = false;
  // Of the exposure during which it was, after it; nothing if it was between two, or noise hides
  // what is near an exposure's ends.
  std::optional<double> share;
};

// Jumps by over eight times the noise, between levels that two frames hold before and after, with
// at most one frame in between. If that one's exposure is known, the share of the new level in it
// tells the moment; else the jump was in the gap.
std::vector<SignalEdge> find_edges(std::span<const SignalSample> signal);

// Whether jumps are all at one place in their exposures, as of a lamp that is switched by the
// camera's own clock: then a wrong exposure does not show, and moves all of them alike. Six of them
// or more tell.
bool are_in_step(std::span<const SignalEdge> edges);

struct EdgeOffset {
  double offset_s = 0;
  double sigma_s = 0;
  std::size_t pairs = 0;
  double agreeing = 0;  // share of the pairs that the offset allows
};

// The mean of the offset's distribution given the edges that both saw, if they come at random:
// that of each pair is the difference of two moments within their limits, and some are wrong. Only
// offsets within `reach_s` of `about_s` are looked at. Nothing from fewer than four pairs.
std::optional<EdgeOffset> offset_of_edges(std::span<const SignalEdge> a,
                                          std::span<const SignalEdge> b,
                                          double about_s,
                                          double reach_s);

}  // namespace calibrate
