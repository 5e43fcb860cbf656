// What a live merge does to every stretch of samples, planned once per window. Private to the
// merge.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "capture/live_merge.h"

namespace capture::window_merge {

inline constexpr std::size_t channels = 3;
inline constexpr std::size_t stretch_pixels = 64;
inline constexpr std::size_t lanes = stretch_pixels * channels;  // samples that are merged together
inline constexpr float infinite = std::numeric_limits<float>::infinity();
// Linear values outside these are not taken for values.
inline constexpr float least_value = -1;
inline constexpr float largest_value = 1e6F;

// a * b + c, rounded once where the instruction set can.
inline float mul_add(float a, float b, float c) {
#ifdef __FMA__
  return std::fma(a, b, c);
#else
  return a * b + c;
#endif
}

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

// Squared difference that is allowed between two tellings of a radiance L: read + L * (shot + L *
// slack).
struct Tolerance {
  float read = infinite, shot = 0, slack = 0;

  float at(float light) const { return mul_add(light, mul_add(light, slack, shot), read); }
};

// How a shot enters the average of all shorter ones.
struct Step {
  float gain = 1;
  Tolerance allowed;          // of its difference from that average
  float dark = 0;             // an average with it is dark below this
  std::uint16_t counted = 0;  // the shots of the average with it
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
  std::size_t place = 0;  // in the window
  std::uint16_t bit = 0;  // of it, in MergedFrame::counted
  ShotTerms terms{};
  Step step;
  Lanes scale, offset;  // radiance = scale * value + offset
};

template <class Code>
struct Plan {
  std::array<PlannedShot<Code>, most_window_shots> shots;     // the shortest first
  std::array<std::size_t, most_window_shots> newest_first{};  // places among them
  std::size_t count = 0;
  // By how many shots are taken, the shortest first: below which radiance their average is dark,
  // infinite for none, and which they are.
  std::array<float, most_window_shots + 1> dark{infinite};
  std::array<std::int32_t, most_window_shots + 1> counted{};
  alignas(64) std::array<Code, lanes> saturation;
  Lanes saturated_value;       // the same as floats
  float read = 0, shot = 0;    // the average's variance: (read * firsts + shot * seconds * L) / W^2
  float relative_squared = 0;  // beside it
  float doubt = 0;             // squared deviations that are too many
  float slack = 0;             // squared relative difference of two exposures
};

// Where a merged stretch goes.
struct Merged {
  float* radiance;         // of `lanes` samples
  std::uint16_t* counted;  // of `lanes` samples
  MergeStatus* status;     // of `stretch_pixels` pixels
};

// What speaks against the average of all shots.
struct Doubts {
  bool contradicted = false;  // a sample that differs by more than chance
  bool shifted = false;       // perhaps all samples differ a little, by more than chance in sum
};

template <class Code>
struct Kernel {
  // Averages all shots of the stretch of `lanes` samples from `begin` on.
  Doubts (*average_all)(const Plan<Code>& plan, std::size_t begin, const Merged& merged);
  // The lanes where that average is contradicted, as -1.
  Flags (*find_contradictions)(const Plan<Code>& plan, std::size_t begin);
};

// For the instruction set that the program is built for, and the widest one that the machine has
// (AVX-512, if it was built for AVX2 and FMA): the same bits.
template <class Code>
Kernel<Code> built_kernel();
template <class Code>
Kernel<Code> best_kernel();

// Averages the shots of the pixels that `contradicted` names from the newest on, without older ones
// that contradict them. Where the sum over a stretch tells of a change that no pixel could tell
// alone, all its pixels leave out the older shot.
template <class Code>
void average_newest(const Plan<Code>& plan,
                    std::size_t begin,
                    const Flags& contradicted,
                    const Merged& merged);

// The light that each shot of the window tells, over the geometric mean of all: 1 where shots agree
// within their noise, or cannot be compared.
template <class Code>
std::array<double, most_window_shots> compare_shots(const Plan<Code>& plan, std::size_t samples);

// The sum of all lanes, in one order.
inline float sum_of(Lanes lane) {
  std::size_t left = lanes;
  for (; left % 2 == 0; left /= 2) {
    for (std::size_t i = 0; i < left / 2; ++i) lane.v[i] += lane.v[i + left / 2];
  }
  float sum = 0;
  for (std::size_t i = 0; i < left; ++i) sum += lane.v[i];
  return sum;
}

// A pixel is judged as one: colours of two things do not mix.
void join_pixels(Flags& flags);

}  // namespace capture::window_merge
