// The average of a stretch of all shots, from the shortest to the longest, by constant gains. What
// is saturated in one shot is saturated in all longer ones, so that the shots that count in a lane
// are always the first ones, and gains and tolerances are the window's, not the lane's.
#include <algorithm>
#include <bit>
#include <type_traits>

#include "capture/live_merge_plan.h"

namespace capture::window_merge {
namespace {

// The functions on lanes are functions of their own, with pointers that do not overlap, so that the
// compiler vectorises them. A float's sign bit is its flag: a union of them costs one instruction.
std::int32_t sign_of(float value) { return std::bit_cast<std::int32_t>(value); }

template <class Code>
std::size_t count_usable(const Code* __restrict values, const Code* __restrict saturation) {
  // Counts of the values' own size: as many in a register as there are values.
  using Count =
      std::conditional_t<sizeof(Code) == 1, std::uint8_t,
                         std::conditional_t<sizeof(Code) == 2, std::uint16_t, std::uint32_t>>;
  Count count = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    bool usable = values[i] < saturation[i];
    if constexpr (std::floating_point<Code>) usable &= values[i] > least_value;
    count = static_cast<Count>(count + (usable ? 1 : 0));
  }
  return count;
}

enum class Values { usable, saturated, mixed };

template <class Code>
Values kind_of(const Code* values, const Code* saturation) {
  const std::size_t usable = count_usable(values, saturation);
  if (usable == lanes) return Values::usable;
  return usable == 0 && std::integral<Code> ? Values::saturated : Values::mixed;
}

template <class Code>
[[gnu::noinline]] void start(const Code* __restrict values,
                             const float* __restrict scale,
                             const float* __restrict offset,
                             float* __restrict mean) {
  for (std::size_t i = 0; i < lanes; ++i) {
    mean[i] = mul_add(static_cast<float>(values[i]), scale[i], offset[i]);
  }
}

// Adds a shot that counts in all lanes. Whether it contradicts the average somewhere.
template <class Code>
[[gnu::noinline]] bool add_to_all(const Code* __restrict values,
                                  const float* __restrict scale,
                                  const float* __restrict offset,
                                  Step step,
                                  float* __restrict mean) {
  std::int32_t contradicted = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float radiance = mul_add(static_cast<float>(values[i]), scale[i], offset[i]);
    const float difference = radiance - mean[i];
    const float light = mul_add(step.gain, difference, mean[i]);
    mean[i] = light;
    contradicted |= sign_of(mul_add(-difference, difference, step.allowed.at(light)));
  }
  return contradicted < 0;
}

// Whether saturated values tell more light than the average somewhere.
template <class Code>
[[gnu::noinline]] bool exceeds(const Code* __restrict values,
                               const float* __restrict scale,
                               const float* __restrict offset,
                               Tolerance allowed,
                               const float* __restrict mean) {
  std::int32_t contradicted = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float bound = mul_add(static_cast<float>(values[i]), scale[i], offset[i]);
    const float excess = std::max(bound - mean[i], 0.0F);
    contradicted |= sign_of(mul_add(-excess, excess, allowed.at(mean[i])));
  }
  return contradicted < 0;
}

template <class Code>
bool add_usable(const PlannedShot<Code>& shot, bool first, std::size_t begin, float* mean) {
  const Code* values = shot.values + begin;
  const float* scale = shot.scale.v.data();
  const float* offset = shot.offset.v.data();
  if (!first) return add_to_all(values, scale, offset, shot.step, mean);
  start(values, scale, offset, mean);
  return false;
}

template <class Code>
bool add_bound(const PlannedShot<Code>& shot, bool first, std::size_t begin, float* mean) {
  const Code* values = shot.values + begin;
  const float* scale = shot.scale.v.data();
  const float* offset = shot.offset.v.data();
  if (!first) return exceeds(values, scale, offset, shot.step.allowed, mean);
  start(values, scale, offset, mean);
  return false;
}

// An average whose lanes count different shots: as many of the shortest as lie below saturation.
struct MixedAverage {
  Lanes mean;
  Lanes dark;            // the average is dark below; infinite where no shot counts
  Flags counted;         // the shots that count
  Flags open;            // -1 while no shot was saturated, then 0
  Flags contradictions;  // below 0 where there are some
};

float keep_if(std::int32_t mask, float value) {
  return std::bit_cast<float>(mask & std::bit_cast<std::int32_t>(value));
}

// A value as the merge reads it: masks of -1 or 0.
struct Reading {
  float value;
  std::int32_t usable, lacking;  // neither: saturated
};

template <class Code>
Reading read_value(Code code, float saturation) {
  const float value = static_cast<float>(code);
  const std::int32_t below = value < saturation ? -1 : 0;
  if constexpr (std::integral<Code>) return {value, below, 0};
  const std::int32_t saturated = value >= saturation ? -1 : 0;
  const std::int32_t usable = below & (value > least_value ? -1 : 0);
  return {value <= largest_value ? value : saturation, usable, ~(usable | saturated)};
}

// The lanes in the middle of a stretch, which are asked whether it changed by what no lane could
// tell alone.
constexpr std::size_t asked = 32;
constexpr std::size_t first_asked = (lanes - asked) / 2;

template <class Code>
[[gnu::noinline]] void ask(const Code* __restrict values,
                           const PlannedShot<Code>& __restrict shot,
                           const float* __restrict saturation,
                           const float* __restrict mean,
                           const std::int32_t* __restrict open,
                           float* __restrict apart,
                           float* __restrict light) {
  for (std::size_t k = 0; k < asked; ++k) {
    const std::size_t i = first_asked + k;
    const auto [value, usable, lacking] = read_value(values[i], saturation[i]);
    const float radiance = mul_add(value, shot.scale.v[i], shot.offset.v[i]);
    apart[k] = keep_if(usable & open[i], radiance - mean[i]);
    light[k] = keep_if(usable & open[i], mean[i]);
  }
}

float sum_of_asked(const float* values) {
  std::array<float, 8> sums;
  for (std::size_t k = 0; k < 8; ++k) {
    sums[k] = (values[k] + values[k + 8]) + (values[k + 16] + values[k + 24]);
  }
  return ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]));
}

// Whether a shot departs from the average in the sum of the lanes that are asked, as far as it
// counts there.
template <class Code>
bool shifts(const Code* values,
            const PlannedShot<Code>& shot,
            const float* saturation,
            const float* mean,
            const std::int32_t* open) {
  std::array<float, asked> lanes_apart, lanes_light;
  ask(values, shot, saturation, mean, open, lanes_apart.data(), lanes_light.data());
  const float apart = sum_of_asked(lanes_apart.data());
  const float light = sum_of_asked(lanes_light.data());
  Tolerance allowed = shot.step.allowed;
  allowed.read *= asked * asked;  // rounding, which neighbours have in common
  return apart * apart > allowed.at(std::max(light, 0.0F));
}

// The shortest shot.
template <class Code>
[[gnu::noinline]] void start_some(const Code* __restrict values,
                                  const PlannedShot<Code>& __restrict shot,
                                  const float* __restrict saturation,
                                  MixedAverage& __restrict average) {
  const float dark = shot.step.dark;
  const std::int32_t counted = shot.step.counted;
  for (std::size_t i = 0; i < lanes; ++i) {
    const auto [value, usable, lacking] = read_value(values[i], saturation[i]);
    average.mean.v[i] = mul_add(value, shot.scale.v[i], shot.offset.v[i]);
    average.dark.v[i] = usable != 0 ? dark : infinite;
    average.counted.v[i] = usable & counted;
    average.open.v[i] = usable;
    average.contradictions.v[i] = lacking;
  }
}

// Goes on from an average whose lanes all count the same shots, the last of which came with `step`.
[[gnu::noinline]] void start_mixed(const Step& step, const Lanes& mean, MixedAverage& average) {
  const float dark = step.dark;
  const std::int32_t counted = step.counted;
  for (std::size_t i = 0; i < lanes; ++i) {
    average.mean.v[i] = mean.v[i];
    average.dark.v[i] = dark;
    average.counted.v[i] = counted;
    average.open.v[i] = -1;
    average.contradictions.v[i] = 0;
  }
}

template <class Code>
[[gnu::noinline]] void add_to_some(const Code* __restrict values,
                                   const PlannedShot<Code>& __restrict shot,
                                   const float* __restrict saturation,
                                   MixedAverage& __restrict average) {
  const Step step = shot.step;
  const std::int32_t bit = shot.bit;
  for (std::size_t i = 0; i < lanes; ++i) {
    const auto [value, usable, lacking] = read_value(values[i], saturation[i]);
    const std::int32_t open = average.open.v[i];
    const std::int32_t takes = usable & open;
    const float radiance = mul_add(value, shot.scale.v[i], shot.offset.v[i]);
    const float difference = radiance - average.mean.v[i];
    const float light = mul_add(step.gain, keep_if(takes, difference), average.mean.v[i]);
    // A bound contradicts only what is below it.
    const float apart = std::max(difference, keep_if(usable, -infinite));
    const std::int32_t too_far = sign_of(mul_add(-apart, apart, step.allowed.at(light)));
    average.mean.v[i] = light;
    average.dark.v[i] = takes != 0 ? step.dark : average.dark.v[i];
    average.counted.v[i] |= takes & bit;
    average.open.v[i] = takes;
    average.contradictions.v[i] |= (too_far & open) | (usable & ~open) | lacking;
  }
}

// All shots from `first` on; shorter ones count in all lanes, and have the average `mean`. Whether
// a shot shifts.
template <class Code>
bool average_rest(const Plan<Code>& plan,
                  std::size_t first,
                  const Lanes& mean,
                  std::size_t begin,
                  MixedAverage& average) {
  bool shifted = false;
  const float* saturation = plan.saturated_value.v.data();
  if (first > 0) start_mixed(plan.shots[first - 1].step, mean, average);
  for (std::size_t i = first; i < plan.count; ++i) {
    const PlannedShot<Code>& shot = plan.shots[i];
    const Code* values = shot.values + begin;
    if (i == 0) {
      start_some(values, shot, saturation, average);
      continue;
    }
    shifted |= shifts(values, shot, saturation, average.mean.v.data(), average.open.v.data());
    add_to_some(values, shot, saturation, average);
  }
  return shifted;
}

std::int32_t union_of(const Flags& flags) {
  std::int32_t all = 0;
  for (const std::int32_t flag : flags.v) all |= flag;
  return all;
}

bool is_dark_somewhere(const float* mean, float dark) {
  std::int32_t below = 0;
  for (std::size_t i = 0; i < lanes; ++i) below |= sign_of(mean[i] - dark);
  return below < 0;
}

// The worst status of each pixel's channels. An average is dark below `dark`; infinite = no shot
// counts.
[[gnu::noinline]] void tell_status(const float* __restrict mean,
                                   const float* __restrict dark,
                                   MergeStatus* __restrict status) {
  static_assert(MergeStatus::dark == MergeStatus{1} && MergeStatus::lower_bound == MergeStatus{3});
  std::array<std::uint8_t, lanes> of_lane;
  for (std::size_t i = 0; i < lanes; ++i) {
    const std::int32_t below = mean[i] < dark[i] ? 1 : 0;
    of_lane[i] = static_cast<std::uint8_t>(dark[i] < infinite ? below : 3);
  }
  for (std::size_t i = 0; i < stretch_pixels; ++i) {
    const std::uint8_t* of = &of_lane[channels * i];
    status[i] = static_cast<MergeStatus>(std::max(of[0], std::max(of[1], of[2])));
  }
}

// An average of the same shots in all lanes, which came with `step`; null = of none.
void store_uniform(const Step* step, const Lanes& mean, const Merged& merged) {
  for (std::size_t i = 0; i < lanes; ++i) merged.radiance[i] = mean.v[i];
  const std::uint16_t counted = step != nullptr ? step->counted : std::uint16_t{0};
  for (std::size_t i = 0; i < lanes; ++i) merged.counted[i] = counted;
  if (step != nullptr && is_dark_somewhere(mean.v.data(), step->dark)) {
    Lanes dark;
    dark.v.fill(step->dark);
    tell_status(mean.v.data(), dark.v.data(), merged.status);
    return;
  }
  const MergeStatus status = step != nullptr ? MergeStatus::good : MergeStatus::lower_bound;
  for (std::size_t i = 0; i < stretch_pixels; ++i) merged.status[i] = status;
}

void store_mixed(const MixedAverage& average, const Merged& merged) {
  for (std::size_t i = 0; i < lanes; ++i) merged.radiance[i] = average.mean.v[i];
  for (std::size_t i = 0; i < lanes; ++i) {
    merged.counted[i] = static_cast<std::uint16_t>(average.counted.v[i]);
  }
  tell_status(average.mean.v.data(), average.dark.v.data(), merged.status);
}

}  // namespace

template <class Code>
Doubts average_all(const Plan<Code>& plan, std::size_t begin, const Merged& merged) {
  static constexpr Flags all_open = [] {
    Flags flags{};
    for (std::int32_t& flag : flags.v) flag = -1;
    return flags;
  }();
  const auto kind = [&](std::size_t i) {
    return kind_of(plan.shots[i].values + begin, plan.saturation.data());
  };
  Lanes mean;
  Doubts doubts;
  std::size_t usable = 0;
  for (; usable < plan.count && kind(usable) == Values::usable; ++usable) {
    const PlannedShot<Code>& shot = plan.shots[usable];
    if (usable > 0) {
      doubts.shifted |= shifts(shot.values + begin, shot, plan.saturated_value.v.data(),
                               mean.v.data(), all_open.v.data());
    }
    doubts.contradicted |= add_usable(shot, usable == 0, begin, mean.v.data());
  }
  std::size_t rest = usable;
  while (rest < plan.count && kind(rest) == Values::saturated) ++rest;
  if (rest < plan.count) {
    MixedAverage average;
    doubts.shifted |= average_rest(plan, usable, mean, begin, average);
    doubts.contradicted |= union_of(average.contradictions) < 0;
    store_mixed(average, merged);
    return doubts;
  }
  // Of the saturated shots the shortest has the highest bound.
  if (usable < rest) {
    doubts.contradicted |= add_bound(plan.shots[usable], usable == 0, begin, mean.v.data());
  }
  store_uniform(usable > 0 ? &plan.shots[usable - 1].step : nullptr, mean, merged);
  return doubts;
}

template <class Code>
Flags find_contradictions(const Plan<Code>& plan, std::size_t begin) {
  MixedAverage average;
  average_rest(plan, 0, {}, begin, average);
  for (std::int32_t& flag : average.contradictions.v) flag >>= 31;
  return average.contradictions;
}

template Doubts average_all(const Plan<std::uint8_t>&, std::size_t, const Merged&);
template Doubts average_all(const Plan<std::uint16_t>&, std::size_t, const Merged&);
template Doubts average_all(const Plan<float>&, std::size_t, const Merged&);
template Flags find_contradictions(const Plan<std::uint8_t>&, std::size_t);
template Flags find_contradictions(const Plan<std::uint16_t>&, std::size_t);
template Flags find_contradictions(const Plan<float>&, std::size_t);

}  // namespace capture::window_merge
