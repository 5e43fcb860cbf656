// The average of a stretch: of all shots, from the shortest to the longest, by constant gains;
// where they contradict each other, of the newest ones.
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "capture/live_merge.h"
#include "capture/live_merge_plan.h"

namespace capture::window_merge {
namespace {

// The functions on lanes are functions of their own, with pointers that do not overlap, so that the
// compiler vectorises them.

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

// The average of a stretch while shots are added, from the shortest to the longest: what is
// saturated in one shot is saturated in all longer ones, so that the shots that count in a lane are
// always the first ones, and gains and variances are the window's, not the lane's.
struct Average {
  Lanes mean;
  Flags disagrees;  // shots of this lane contradict each other
  bool any_disagrees = false;
  bool uniform = true;    // all lanes have counted the same shots,
  bool open = true;       // and none was saturated yet
  float read = infinite;  // then the variance is read + shot * L;
  float shot = 0;
  Lanes lane_read, lane_shot;  // else that of each lane
  Flags alive;                 // 0 = saturated in a shot before
};

template <class Code>
void start_mean(const Code* __restrict values,
                const float* __restrict scale,
                const float* __restrict offset,
                float* __restrict mean) {
  for (std::size_t i = 0; i < lanes; ++i) {
    mean[i] = static_cast<float>(values[i]) * scale[i] - offset[i];
  }
}

// Adds a shot that counts in all lanes; whether it contradicts the average somewhere.
template <class Code>
bool add_to_all(const Code* __restrict values,
                const float* __restrict scale,
                const float* __restrict offset,
                Tolerance allowed,
                float gain,
                float* __restrict mean,
                std::int32_t* __restrict disagrees) {
  std::int32_t far = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float radiance = static_cast<float>(values[i]) * scale[i] - offset[i];
    const float difference = radiance - mean[i];
    const float light = std::max(std::max(mean[i], radiance), 0.0F);
    const float tolerance = allowed.read + light * (allowed.shot + light * allowed.slack);
    const std::int32_t disagree = difference * difference > tolerance ? 1 : 0;
    mean[i] = mean[i] + gain * difference;
    disagrees[i] |= disagree;
    far |= disagree;
  }
  return far != 0;
}

// Looks at codes that are all saturated: whether that says more light than the average somewhere.
template <class Code>
bool compare_saturated(const Code* __restrict values,
                       const float* __restrict scale,
                       const float* __restrict offset,
                       Tolerance allowed,
                       const float* __restrict mean,
                       std::int32_t* __restrict disagrees) {
  std::int32_t far = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float radiance = static_cast<float>(values[i]) * scale[i] - offset[i];
    const float excess = std::max(radiance - mean[i], 0.0F);
    const float light = std::max(std::max(mean[i], radiance), 0.0F);
    const float tolerance = allowed.read + light * (allowed.shot + light * allowed.slack);
    const std::int32_t disagree = excess * excess > tolerance ? 1 : 0;
    disagrees[i] |= disagree;
    far |= disagree;
  }
  return far != 0;
}

// Adds a shot that counts in some lanes.
template <class Code>
bool add_to_some(const Code* __restrict values,
                 const float* __restrict scale,
                 const float* __restrict offset,
                 const float* __restrict saturation,
                 Tolerance allowed,
                 const Step& step,
                 float* __restrict mean,
                 std::int32_t* __restrict disagrees,
                 float* __restrict read,
                 float* __restrict shot,
                 std::int32_t* __restrict alive) {
  const float gain = step.gain, mean_read = step.mean_read, mean_shot = step.mean_shot;
  std::int32_t far = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    float value = static_cast<float>(values[i]);
    std::int32_t usable = value < saturation[i] ? 1 : 0;
    std::int32_t lacking = 0;
    if constexpr (std::floating_point<Code>) {
      const std::int32_t saturated = value >= saturation[i] ? 1 : 0;
      usable &= value > least_value ? 1 : 0;
      lacking = 1 - (usable | saturated);
      value = value <= largest_value ? value : saturation[i];
    }
    const float radiance = value * scale[i] - offset[i];
    const float difference = radiance - mean[i];
    const float excess = std::max(difference, 0.0F);
    const float contradiction = usable != 0 ? difference : excess;
    const float light = std::max(std::max(mean[i], radiance), 0.0F);
    const float tolerance = allowed.read + light * (allowed.shot + light * allowed.slack);
    const std::int32_t too_far = contradiction * contradiction > tolerance ? 1 : 0;
    const std::int32_t takes = usable & alive[i];
    const std::int32_t disagree = too_far | (usable ^ takes) | lacking;
    const float change = gain * difference;
    mean[i] = mean[i] + (takes != 0 ? change : 0.0F);
    read[i] = takes != 0 ? mean_read : read[i];
    shot[i] = takes != 0 ? mean_shot : shot[i];
    alive[i] = takes;
    disagrees[i] |= disagree;
    far |= disagree;
  }
  return far != 0;
}

// The shortest shot, which has nothing to contradict.
template <class Code>
bool start_with_some(const Code* __restrict values,
                     const float* __restrict scale,
                     const float* __restrict offset,
                     const float* __restrict saturation,
                     const Step& step,
                     float* __restrict mean,
                     std::int32_t* __restrict disagrees,
                     float* __restrict read,
                     float* __restrict shot,
                     std::int32_t* __restrict alive) {
  const float mean_read = step.mean_read, mean_shot = step.mean_shot;
  std::int32_t far = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    float value = static_cast<float>(values[i]);
    std::int32_t usable = value < saturation[i] ? 1 : 0;
    std::int32_t lacking = 0;
    if constexpr (std::floating_point<Code>) {
      const std::int32_t saturated = value >= saturation[i] ? 1 : 0;
      usable &= value > least_value ? 1 : 0;
      lacking = 1 - (usable | saturated);
      value = value <= largest_value ? value : saturation[i];
    }
    mean[i] = value * scale[i] - offset[i];
    read[i] = usable != 0 ? mean_read : infinite;
    shot[i] = usable != 0 ? mean_shot : 0.0F;
    alive[i] = usable;
    disagrees[i] = lacking;
    far |= lacking;
  }
  return far != 0;
}

template <class Code>
void start_average(const Plan<Code>& plan, std::size_t begin, Average& average) {
  const PlannedShot<Code>& shot = plan.shots[0];
  const Code* values = shot.values + begin;
  const float* scale = shot.scale.v.data();
  const float* offset = shot.offset.v.data();
  const std::size_t usable = count_usable(values, plan.saturation.data());
  average.open = usable == lanes;
  average.uniform = average.open || (usable == 0 && std::integral<Code>);
  average.read = average.open ? shot.step.mean_read : infinite;
  average.shot = average.open ? shot.step.mean_shot : 0;
  average.any_disagrees = false;
  if (average.uniform) {
    start_mean(values, scale, offset, average.mean.v.data());
    average.disagrees.v.fill(0);
    return;
  }
  average.any_disagrees =
      start_with_some(values, scale, offset, plan.saturated_value.v.data(), shot.step,
                      average.mean.v.data(), average.disagrees.v.data(), average.lane_read.v.data(),
                      average.lane_shot.v.data(), average.alive.v.data());
}

template <class Code>
void add_shot(const Plan<Code>& plan,
              const PlannedShot<Code>& shot,
              std::size_t begin,
              Average& average) {
  const Code* values = shot.values + begin;
  const float* scale = shot.scale.v.data();
  const float* offset = shot.offset.v.data();
  float* mean = average.mean.v.data();
  std::int32_t* disagrees = average.disagrees.v.data();
  const Tolerance allowed = tolerance_of(plan, shot.step);
  const std::size_t usable = count_usable(values, plan.saturation.data());
  if (usable == lanes && average.open) {
    average.any_disagrees |=
        add_to_all(values, scale, offset, allowed, shot.step.gain, mean, disagrees);
    average.read = shot.step.mean_read;
    average.shot = shot.step.mean_shot;
    return;
  }
  if (average.uniform && (usable > 0 || std::floating_point<Code>)) {
    average.lane_read.v.fill(average.read);
    average.lane_shot.v.fill(average.shot);
    average.alive.v.fill(average.open ? 1 : 0);
    average.uniform = false;
  }
  average.open = false;
  if (usable == 0 && std::integral<Code>) {
    average.any_disagrees |= compare_saturated(values, scale, offset, allowed, mean, disagrees);
    if (!average.uniform) average.alive.v.fill(0);
    return;
  }
  average.any_disagrees |= add_to_some(
      values, scale, offset, plan.saturated_value.v.data(), allowed, shot.step, mean, disagrees,
      average.lane_read.v.data(), average.lane_shot.v.data(), average.alive.v.data());
}

std::int32_t code_of(MergeStatus status) { return static_cast<std::int32_t>(status); }

void finish_uniform(const float* __restrict mean,
                    float read,
                    float shot,
                    float relative_squared,
                    float* __restrict deviation,
                    std::int32_t* __restrict status) {
  for (std::size_t i = 0; i < lanes; ++i) {
    const float light = std::max(mean[i], 0.0F);
    const float sigma = std::sqrt(read + light * (shot + light * relative_squared));
    deviation[i] = sigma;
    status[i] = mean[i] < 2 * sigma ? 1 : 0;
  }
}

void finish_lanes(const float* __restrict mean,
                  const float* __restrict read,
                  const float* __restrict shot,
                  float relative_squared,
                  float* __restrict deviation,
                  std::int32_t* __restrict status) {
  for (std::size_t i = 0; i < lanes; ++i) {
    const float light = std::max(mean[i], 0.0F);
    const float sigma = std::sqrt(read[i] + light * (shot[i] + light * relative_squared));
    deviation[i] = sigma;
    const std::int32_t dark = mean[i] < 2 * sigma ? 1 : 0;
    status[i] = sigma < infinite ? dark : 3;
  }
}
static_assert(MergeStatus::dark == MergeStatus{1} && MergeStatus::lower_bound == MergeStatus{3});

// Averages all shots of a stretch, if they agree.
template <class Code>
void average_all(const Plan<Code>& plan, std::size_t begin, Average& average, Merged& merged) {
  start_average(plan, begin, average);
  for (std::size_t i = 1; i < plan.count; ++i) add_shot(plan, plan.shots[i], begin, average);
  merged.radiance = average.mean;
  if (!average.uniform) {
    finish_lanes(average.mean.v.data(), average.lane_read.v.data(), average.lane_shot.v.data(),
                 plan.relative_squared, merged.deviation.v.data(), merged.status.v.data());
  } else if (average.read < infinite) {
    finish_uniform(average.mean.v.data(), average.read, average.shot, plan.relative_squared,
                   merged.deviation.v.data(), merged.status.v.data());
  } else {
    merged.deviation.v.fill(infinite);
    merged.status.v.fill(code_of(MergeStatus::lower_bound));
  }
}

// What newer shots say of a stretch. `weight` is 0 where none counts, `bound` minus infinity where
// none is saturated.
struct Stretch {
  Lanes mean, weight, first, second, bound;
  Flags inconsistent;
};

// A shot, looked at against what newer ones say.
struct Look {
  Lanes radiance;  // 0 where nothing counts
  Flags usable, saturated, disagrees;
};

template <class Code>
void look_at(const Plan<Code>& plan,
             const PlannedShot<Code>& shot,
             const Code* __restrict values,
             const Stretch& __restrict s,
             Look& __restrict look) {
  for (std::size_t i = 0; i < lanes; ++i) {
    const float value = static_cast<float>(values[i]);
    const float saturation = plan.saturated_value.v[i];
    const std::int32_t saturated = value >= saturation ? 1 : 0;
    const std::int32_t below = value < saturation ? 1 : 0;
    const std::int32_t light = value > least_value ? 1 : 0;
    const std::int32_t usable = below & light;
    const float sane = value <= static_cast<float>(largest<Code>()) ? value : saturation;
    const float radiance = sane * shot.scale.v[i] - shot.offset.v[i];
    look.usable.v[i] = usable;
    look.saturated.v[i] = saturated;
    look.radiance.v[i] = (usable | saturated) != 0 ? radiance : 0.0F;
  }
  const ShotTerms terms = shot.terms;
  const Tolerance alone{plan.doubt * terms.read, plan.doubt * terms.shot, plan.doubt * plan.slack};
  for (std::size_t i = 0; i < lanes; ++i) {
    const float radiance = look.radiance.v[i];
    const float weight = s.weight.v[i] > 0 ? s.weight.v[i] : 1.0F;
    const float inverse = 1 / (weight * weight);
    const float read = alone.read + plan.doubt * (plan.read * s.first.v[i] * inverse);
    const float shot_noise = alone.shot + plan.doubt * (plan.shot * s.second.v[i] * inverse);
    const float apart = radiance - s.mean.v[i];
    const float difference = s.weight.v[i] > 0 ? apart : 0.0F;
    const float light = std::max(std::max(s.mean.v[i], radiance), 0.0F);
    const float tolerance = read + light * (shot_noise + light * alone.slack);
    const float gap = std::max(s.bound.v[i] - radiance, 0.0F);
    const float least = std::max(s.bound.v[i], 0.0F);
    const float bound_tolerance = alone.read + least * (alone.shot + least * alone.slack);
    const std::int32_t differs = difference * difference > tolerance ? 1 : 0;
    const std::int32_t below = gap * gap > bound_tolerance ? 1 : 0;
    look.disagrees.v[i] = (differs | below) & look.usable.v[i];
  }
}

// A pixel is left out whole: colours of two things do not mix.
void join_pixels(Flags& flags) {
  std::int32_t any = 0;
  for (const std::int32_t flag : flags.v) any |= flag;
  if (any == 0) return;
  for (std::size_t i = 0; i < lanes; i += channels) {
    const std::int32_t joined = flags.v[i] | flags.v[i + 1] | flags.v[i + 2];
    flags.v[i] = flags.v[i + 1] = flags.v[i + 2] = joined;
  }
}

void take_look(const ShotTerms& terms, const Look& __restrict look, Stretch& __restrict s) {
  const auto [read, shot, shot_weight, first, second] = terms;
  for (std::size_t i = 0; i < lanes; ++i) {
    const std::int32_t counts = look.usable.v[i] & (1 - look.disagrees.v[i]);
    const float weight = s.weight.v[i] + (counts != 0 ? shot_weight : 0.0F);
    const float gain = counts != 0 ? shot_weight / weight : 0.0F;
    const float change = gain * (look.radiance.v[i] - s.mean.v[i]);
    const float raised = std::max(s.bound.v[i], look.radiance.v[i]);
    const std::int32_t unseen = s.weight.v[i] > 0 ? 0 : 1;
    const std::int32_t bounds = look.saturated.v[i] & unseen;
    s.bound.v[i] = bounds != 0 ? raised : s.bound.v[i];
    s.mean.v[i] = s.mean.v[i] + change;
    s.weight.v[i] = weight;
    s.first.v[i] = s.first.v[i] + (counts != 0 ? first : 0.0F);
    s.second.v[i] = s.second.v[i] + (counts != 0 ? second : 0.0F);
    s.inconsistent.v[i] |= look.disagrees.v[i];
  }
}

template <class Code>
void finish_newest(const Plan<Code>& plan, const Stretch& __restrict s, Merged& __restrict merged) {
  for (std::size_t i = 0; i < lanes; ++i) {
    const bool seen = s.weight.v[i] > 0;
    const bool bounded = s.bound.v[i] > -infinite;
    const float weight = seen ? s.weight.v[i] : 1.0F;
    const float inverse = 1 / (weight * weight);
    const float read = plan.read * s.first.v[i] * inverse;
    const float shot = plan.shot * s.second.v[i] * inverse;
    const float light = std::max(s.mean.v[i], 0.0F);
    const float sigma = std::sqrt(read + light * (shot + light * plan.relative_squared));
    const float unseen = bounded ? s.bound.v[i] : 0.0F;
    const std::int32_t dark = s.mean.v[i] < 2 * sigma ? 1 : 0;
    const std::int32_t status = s.inconsistent.v[i] != 0 ? 2 : dark;
    const std::int32_t none = bounded ? 3 : 4;
    merged.radiance.v[i] = seen ? s.mean.v[i] : unseen;
    merged.deviation.v[i] = seen ? sigma : infinite;
    merged.status.v[i] = seen ? status : none;
  }
}
static_assert(MergeStatus::inconsistent == MergeStatus{2} &&
              MergeStatus::missing == MergeStatus{4});

// Averages shots from the newest on, without older ones that contradict them.
template <class Code>
void average_newest(const Plan<Code>& plan, std::size_t begin, Merged& merged) {
  Stretch s;
  for (Lanes* zero : {&s.mean, &s.weight, &s.first, &s.second}) zero->v.fill(0);
  s.bound.v.fill(-infinite);
  s.inconsistent.v.fill(0);
  Look look;
  for (std::size_t i = 0; i < plan.count; ++i) {
    const PlannedShot<Code>& shot = plan.shots[plan.newest_first[i]];
    look_at(plan, shot, shot.values + begin, s, look);
    join_pixels(look.disagrees);
    take_look(shot.terms, look, s);
  }
  finish_newest(plan, s, merged);
}

}  // namespace

template <class Code>
void merge_stretch(const Plan<Code>& plan, std::size_t begin, Merged& merged) {
  Average average;
  average_all(plan, begin, average, merged);
  if (!average.any_disagrees) return;
  join_pixels(average.disagrees);
  Merged newest;
  average_newest(plan, begin, newest);
  for (std::size_t i = 0; i < lanes; ++i) {
    if (average.disagrees.v[i] == 0) continue;
    merged.radiance.v[i] = newest.radiance.v[i];
    merged.deviation.v[i] = newest.deviation.v[i];
    merged.status.v[i] = newest.status.v[i];
  }
}

template void merge_stretch(const Plan<std::uint8_t>& plan, std::size_t begin, Merged& merged);
template void merge_stretch(const Plan<std::uint16_t>& plan, std::size_t begin, Merged& merged);
template void merge_stretch(const Plan<float>& plan, std::size_t begin, Merged& merged);

}  // namespace capture::window_merge
