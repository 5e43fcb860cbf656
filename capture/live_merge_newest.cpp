// The average of a stretch from the newest shot on, without older ones that contradict it.
#include <algorithm>

#include "capture/live_merge_plan.h"

namespace capture::window_merge {
namespace {

// What newer shots say of a stretch. `weight` is 0 where none counts, `bound` minus infinity where
// none is saturated.
struct Stretch {
  Lanes mean, weight, first, second, bound;
  Flags counted, inconsistent;
};

// A shot, looked at against what newer ones say.
struct Look {
  Lanes radiance;  // 0 where nothing counts
  Flags usable, saturated, disagrees;
};

template <class Code>
[[gnu::noinline]] void read_shot(const Plan<Code>& plan,
                                 const PlannedShot<Code>& shot,
                                 const Code* __restrict values,
                                 Look& __restrict look) {
  for (std::size_t i = 0; i < lanes; ++i) {
    const float value = static_cast<float>(values[i]);
    const float saturation = plan.saturated_value.v[i];
    const std::int32_t saturated = value >= saturation ? 1 : 0;
    const std::int32_t below = value < saturation ? 1 : 0;
    const std::int32_t light = value > least_value ? 1 : 0;
    const std::int32_t usable = below & light;
    const float sane = value <= static_cast<float>(largest<Code>()) ? value : saturation;
    const float radiance = mul_add(sane, shot.scale.v[i], shot.offset.v[i]);
    look.usable.v[i] = usable;
    look.saturated.v[i] = saturated;
    look.radiance.v[i] = (usable | saturated) != 0 ? radiance : 0.0F;
  }
}

template <class Code>
[[gnu::noinline]] void compare(const Plan<Code>& plan,
                               const ShotTerms& terms,
                               const Stretch& __restrict s,
                               Look& __restrict look) {
  const Tolerance alone{plan.doubt * terms.read, plan.doubt * terms.shot, plan.doubt * plan.slack};
  for (std::size_t i = 0; i < lanes; ++i) {
    const float radiance = look.radiance.v[i];
    const float weight = s.weight.v[i] > 0 ? s.weight.v[i] : 1.0F;
    const float inverse = 1 / (weight * weight);
    const float read = alone.read + plan.doubt * (plan.read * s.first.v[i] * inverse);
    const float shot = alone.shot + plan.doubt * (plan.shot * s.second.v[i] * inverse);
    const float apart = radiance - s.mean.v[i];
    const float difference = s.weight.v[i] > 0 ? apart : 0.0F;
    const float light = std::max(std::max(s.mean.v[i], radiance), 0.0F);
    const float tolerance = Tolerance{read, shot, alone.slack}.at(light);
    const float gap = std::max(s.bound.v[i] - radiance, 0.0F);
    const float bound_tolerance = alone.at(std::max(s.bound.v[i], 0.0F));
    const std::int32_t differs = difference * difference > tolerance ? 1 : 0;
    const std::int32_t below = gap * gap > bound_tolerance ? 1 : 0;
    look.disagrees.v[i] = (differs | below) & look.usable.v[i];
  }
}

// Whether the pixels that do not tell a change alone tell one together. What is noise at black may
// be rounding, which neighbours have in common: it does not average out.
template <class Code>
[[gnu::noinline]] bool vote(const Plan<Code>& plan,
                            const ShotTerms& terms,
                            const Stretch& __restrict s,
                            const Look& __restrict look) {
  Lanes voices, apart, light, read, shot;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float radiance = look.radiance.v[i];
    const float mean = s.mean.v[i];
    const float weight = s.weight.v[i] > 0 ? s.weight.v[i] : 1.0F;
    const float inverse = 1 / (weight * weight);
    const float level = std::max(0.5F * (radiance + mean), 0.0F);
    const float of_read = terms.read + inverse * (plan.read * s.first.v[i]);
    const float of_shot = terms.shot + inverse * (plan.shot * s.second.v[i]);
    const std::int32_t seen = s.weight.v[i] > 0 ? 1 : 0;
    const std::int32_t votes = seen & look.usable.v[i] & (1 - look.disagrees.v[i]);
    voices.v[i] = static_cast<float>(votes);
    apart.v[i] = votes != 0 ? radiance - mean : 0.0F;
    light.v[i] = votes != 0 ? level : 0.0F;
    read.v[i] = votes != 0 ? of_read : 0.0F;
    shot.v[i] = votes != 0 ? of_shot * level : 0.0F;
  }
  const float difference = sum_of(apart);
  const float level = sum_of(light);
  const float variance = sum_of(voices) * sum_of(read) + sum_of(shot);
  return difference * difference > plan.doubt * (variance + plan.slack * level * level);
}

[[gnu::noinline]] void take_look(const ShotTerms& terms,
                                 std::int32_t bit,
                                 const Look& __restrict look,
                                 Stretch& __restrict s) {
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
    s.counted.v[i] |= counts != 0 ? bit : 0;
    s.inconsistent.v[i] |= look.disagrees.v[i];
  }
}

// What the lanes become.
struct Finished {
  Lanes radiance;
  Flags status;
};

template <class Code>
[[gnu::noinline]] void finish(const Plan<Code>& plan,
                              const Stretch& __restrict s,
                              Finished& __restrict to) {
  static_assert(MergeStatus::dark == MergeStatus{1} && MergeStatus::inconsistent == MergeStatus{2});
  static_assert(MergeStatus::lower_bound == MergeStatus{3} &&
                MergeStatus::missing == MergeStatus{4});
  for (std::size_t i = 0; i < lanes; ++i) {
    const bool seen = s.weight.v[i] > 0;
    const bool bounded = s.bound.v[i] > -infinite;
    const float weight = seen ? s.weight.v[i] : 1.0F;
    const float inverse = 1 / (weight * weight);
    const float mean = s.mean.v[i];
    const Tolerance variance{plan.read * s.first.v[i] * inverse,
                             plan.shot * s.second.v[i] * inverse, plan.relative_squared};
    const float sigma = std::sqrt(variance.at(std::max(mean, 0.0F)));
    const float unseen = bounded ? s.bound.v[i] : 0.0F;
    const std::int32_t dark = mean < 2 * sigma ? 1 : 0;
    const std::int32_t of_light = s.inconsistent.v[i] != 0 ? 2 : dark;
    const std::int32_t of_none = bounded ? 3 : 4;
    to.radiance.v[i] = seen ? mean : unseen;
    to.status.v[i] = seen ? of_light : of_none;
  }
}

void store(const Stretch& s,
           const Finished& finished,
           const Flags& contradicted,
           const Merged& merged) {
  for (std::size_t i = 0; i < lanes; ++i) {
    const bool takes = contradicted.v[i] != 0;
    merged.radiance[i] = takes ? finished.radiance.v[i] : merged.radiance[i];
    merged.counted[i] = takes ? static_cast<std::uint16_t>(s.counted.v[i]) : merged.counted[i];
  }
  for (std::size_t p = 0; p < stretch_pixels; ++p) {
    const std::int32_t* of = &finished.status.v[channels * p];
    if (contradicted.v[channels * p] == 0) continue;
    merged.status[p] = static_cast<MergeStatus>(std::max(of[0], std::max(of[1], of[2])));
  }
}

}  // namespace

void join_pixels(Flags& flags) {
  std::int32_t any = 0;
  for (const std::int32_t flag : flags.v) any |= flag;
  if (any == 0) return;
  for (std::size_t i = 0; i < lanes; i += channels) {
    const std::int32_t joined = flags.v[i] | flags.v[i + 1] | flags.v[i + 2];
    flags.v[i] = flags.v[i + 1] = flags.v[i + 2] = joined;
  }
}

template <class Code>
void average_newest(const Plan<Code>& plan,
                    std::size_t begin,
                    const Flags& contradicted,
                    const Merged& merged) {
  Stretch s;
  for (Lanes* zero : {&s.mean, &s.weight, &s.first, &s.second}) zero->v.fill(0);
  s.bound.v.fill(-infinite);
  s.counted.v.fill(0);
  s.inconsistent.v.fill(0);
  Look look;
  bool voted = false;
  for (std::size_t i = 0; i < plan.count; ++i) {
    const PlannedShot<Code>& shot = plan.shots[plan.newest_first[i]];
    read_shot(plan, shot, shot.values + begin, look);
    compare(plan, shot.terms, s, look);
    join_pixels(look.disagrees);
    if (vote(plan, shot.terms, s, look)) {
      look.disagrees = look.usable;
      voted = true;
    }
    take_look(shot.terms, shot.bit, look, s);
  }
  Finished finished;
  finish(plan, s, finished);
  Flags all;
  all.v.fill(-1);
  store(s, finished, voted ? all : contradicted, merged);
}

template void average_newest(const Plan<std::uint8_t>&, std::size_t, const Flags&, const Merged&);
template void average_newest(const Plan<std::uint16_t>&, std::size_t, const Flags&, const Merged&);
template void average_newest(const Plan<float>&, std::size_t, const Flags&, const Merged&);

}  // namespace capture::window_merge
