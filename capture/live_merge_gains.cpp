// How much light each shot of a window tells, compared with the others: labels that are wrong,
// light that drifts and lamps that flicker show here, long before they show in a pixel.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "capture/live_merge_plan.h"
#include "capture/median.h"

namespace capture::window_merge {
namespace {

constexpr std::size_t most_compared = 128;  // stretches, all over the picture
constexpr std::size_t fewest_compared = 8;
// Of a stretch's sum, relative: the noisier ones are asked where the others are too few.
constexpr std::array most_noise{0.01, 0.03};

// What two shots tell over the samples of a stretch that both resolve.
struct Pair {
  double ratio = 0;      // of the longer shot's light to the shorter's; 0 = not comparable
  double deviation = 0;  // of it
};

template <class Code>
bool is_usable(Code value, Code saturation) {
  const float light = static_cast<float>(value);
  return value < saturation && least_value < light;
}

// The relative variance of a sum over `count` samples. Noise at black may be rounding, which
// neighbours have in common.
double variance_of(double sum, double count, const ShotTerms& terms) {
  const double noise =
      count * count * static_cast<double>(terms.read) + sum * static_cast<double>(terms.shot);
  return noise / (sum * sum);
}

template <class Code>
Pair compare_stretch(const Plan<Code>& plan,
                     const PlannedShot<Code>& shorter,
                     const PlannedShot<Code>& longer,
                     std::size_t begin) {
  double count = 0, a = 0, b = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    const Code of_shorter = shorter.values[begin + i];
    const Code of_longer = longer.values[begin + i];
    if (!is_usable(of_shorter, plan.saturation[i]) || !is_usable(of_longer, plan.saturation[i])) {
      continue;
    }
    count += 1;
    a += static_cast<double>(
        mul_add(static_cast<float>(of_shorter), shorter.scale.v[i], shorter.offset.v[i]));
    b += static_cast<double>(
        mul_add(static_cast<float>(of_longer), longer.scale.v[i], longer.offset.v[i]));
  }
  if (count < lanes / 2 || !(a > 0) || !(b > 0)) return {};
  return {b / a,
          std::sqrt(variance_of(a, count, shorter.terms) + variance_of(b, count, longer.terms))};
}

// The light that `longer` tells over that of `shorter`: the median over stretches that both
// resolve. 1 if they cannot be compared, or agree within their noise.
template <class Code>
double compare(const Plan<Code>& plan,
               const PlannedShot<Code>& shorter,
               const PlannedShot<Code>& longer,
               std::size_t stretches) {
  const std::size_t compared = std::min(stretches, most_compared);
  std::array<Pair, most_compared> pairs;
  for (std::size_t k = 0; k < compared; ++k) {
    const std::size_t place = compared < stretches ? k * std::size_t{2654435761} % stretches : k;
    pairs[k] = compare_stretch(plan, shorter, longer, place * lanes);
  }
  for (const double noise : most_noise) {
    std::array<double, most_compared> ratios, deviations;
    std::size_t count = 0;
    for (std::size_t k = 0; k < compared; ++k) {
      if (pairs[k].ratio == 0 || pairs[k].deviation > noise) continue;
      ratios[count] = pairs[k].ratio;
      deviations[count++] = pairs[k].deviation;
    }
    if (count < fewest_compared) continue;
    const double ratio = median_in_place(std::span(ratios).first(count));
    return std::abs(ratio - 1) > 2 * median_in_place(std::span(deviations).first(count)) ? ratio
                                                                                         : 1;
  }
  return 1;
}

}  // namespace

template <class Code>
std::array<double, most_window_shots> compare_shots(const Plan<Code>& plan, std::size_t samples) {
  std::array<double, most_window_shots> gains;
  gains.fill(1);
  double gain = 1, logs = 0;
  for (std::size_t i = 1; i < plan.count; ++i) {
    gain *= compare(plan, plan.shots[i - 1], plan.shots[i], samples / lanes);
    gains[plan.shots[i].place] = gain;
    logs += std::log(gain);
  }
  const double mean = std::exp(logs / static_cast<double>(plan.count));
  for (std::size_t i = 0; i < plan.count; ++i) gains[plan.shots[i].place] /= mean;
  return gains;
}

template std::array<double, most_window_shots> compare_shots(const Plan<std::uint8_t>&,
                                                             std::size_t);
template std::array<double, most_window_shots> compare_shots(const Plan<std::uint16_t>&,
                                                             std::size_t);
template std::array<double, most_window_shots> compare_shots(const Plan<float>&, std::size_t);

}  // namespace capture::window_merge
