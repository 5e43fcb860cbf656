// What a live merge does to every stretch of samples, planned once per window. Private to the
// merge.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace capture::window_merge {

inline constexpr std::size_t most_shots = 16;
inline constexpr std::size_t channels = 3;
inline constexpr std::size_t stretch_pixels = 32;
inline constexpr std::size_t lanes = stretch_pixels * channels;  // samples that are merged together
inline constexpr float infinite = std::numeric_limits<float>::infinity();
// Linear values outside these are not taken for values.
inline constexpr float least_value = -1;
inline constexpr float largest_value = 1e6F;

struct Lanes {
  alignas(64) std::array<float, lanes> v;
};
struct Flags {
  alignas(64) std::array<std::int32_t, lanes> v;
};

// What one shot of the window is worth.
struct ShotTerms {
  float read, shot;     // variance of one radiance L: read + shot * L
  float weight;         // t^1.5, with t the exposure over the window's longest
  float first, second;  // t, t^2: sums of them tell the average's variance
};

// How a shot enters the average of all shorter ones.
struct Step {
  float gain = 1;
  float read = 0, shot = 0;            // variance of its difference from that average
  float mean_read = 0, mean_shot = 0;  // variance of the average with it
};

// Values above are not light, and count as just saturated.
template <class Code>
constexpr Code largest() {
  if constexpr (std::integral<Code>) {
    return std::numeric_limits<Code>::max();
  } else {
    return largest_value;
  }
}

template <class Code>
struct PlannedShot {
  const Code* values = nullptr;
  ShotTerms terms{};
  Step step;
  Lanes scale, offset;  // radiance = scale * value - offset
};

template <class Code>
struct Plan {
  std::array<PlannedShot<Code>, most_shots> shots;     // the shortest first
  std::array<std::size_t, most_shots> newest_first{};  // places among them
  std::size_t count = 0;
  alignas(64) std::array<Code, lanes> saturation;
  Lanes saturated_value;       // the same as floats
  float read = 0, shot = 0;    // the average's variance: (read * firsts + shot * seconds * L) / W^2
  float relative_squared = 0;  // beside it
  float doubt = 0;             // squared deviations that are too many
  float slack = 0;             // squared relative difference of two exposures
};

// A merged stretch.
struct Merged {
  Lanes radiance, deviation;
  Flags status;
};

// Squared difference that is allowed between radiances of which the larger is L: read + L * (shot +
// L * slack). At the smaller one, noise that makes it too small would make the tolerance so as
// well.
struct Tolerance {
  float read, shot, slack;
};

template <class Code>
Tolerance tolerance_of(const Plan<Code>& plan, const Step& step) {
  return {plan.doubt * step.read, plan.doubt * step.shot, plan.doubt * plan.slack};
}

// Merges the stretch of `lanes` samples from `begin` on: all shots averaged, or, in pixels whose
// shots contradict each other, the newest ones.
template <class Code>
void merge_stretch(const Plan<Code>& plan, std::size_t begin, Merged& merged);

}  // namespace capture::window_merge
