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
void read_shot(const Plan<Code>& plan,
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
void compare(const Plan<Code>& plan,
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

void take_look(const ShotTerms& terms,
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

// What `contradicted` lanes become.
template <class Code>
void store(const Plan<Code>& plan,
           const Stretch& s,
           const Flags& contradicted,
           const Merged& merged) {
  for (std::size_t i = 0; i < lanes; ++i) {
    if (contradicted.v[i] == 0) continue;
    const bool seen = s.weight.v[i] > 0;
    const bool bounded = s.bound.v[i] > -infinite;
    const float inverse = 1 / (s.weight.v[i] * s.weight.v[i]);
    const float light = std::max(s.mean.v[i], 0.0F);
    const Tolerance variance{plan.read * s.first.v[i] * inverse,
                             plan.shot * s.second.v[i] * inverse, plan.relative_squared};
    const bool is_dark = s.mean.v[i] < 2 * std::sqrt(variance.at(light));
    using enum MergeStatus;
    const MergeStatus of_light = s.inconsistent.v[i] != 0 ? inconsistent : is_dark ? dark : good;
    const MergeStatus status = seen ? of_light : bounded ? lower_bound : missing;
    MergeStatus& worst = merged.status[i / channels];
    worst = i % channels == 0 ? status : std::max(worst, status);
    merged.radiance[i] = seen ? s.mean.v[i] : bounded ? s.bound.v[i] : 0.0F;
    merged.counted[i] = static_cast<std::uint16_t>(s.counted.v[i]);
  }
}

}  // namespace

void join_pixels(Flags& flags) {
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
  for (std::size_t i = 0; i < plan.count; ++i) {
    const PlannedShot<Code>& shot = plan.shots[plan.newest_first[i]];
    read_shot(plan, shot, shot.values + begin, look);
    compare(plan, shot.terms, s, look);
    join_pixels(look.disagrees);
    take_look(shot.terms, shot.bit, look, s);
  }
  store(plan, s, contradicted, merged);
}

template void average_newest(const Plan<std::uint8_t>&, std::size_t, const Flags&, const Merged&);
template void average_newest(const Plan<std::uint16_t>&, std::size_t, const Flags&, const Merged&);
template void average_newest(const Plan<float>&, std::size_t, const Flags&, const Merged&);

}  // namespace capture::window_merge
