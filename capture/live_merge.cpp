// The live merge: all shots are averaged, from the shortest to the longest, by constant gains;
// where they contradict each other, the newest ones are.
#include "capture/live_merge.h"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include <tbb/partitioner.h>

#include "capture/live_merge_plan.h"
#include "capture/parallel_loop.h"

namespace capture {
namespace {

using namespace window_merge;

constexpr std::size_t stretches_per_task = 64;
constexpr double passed_over = 6.4;  // exposure errors between two shots that no pixel tells

template <class Code>
void merge_stretch(const Kernel<Code>& kernel,
                   const Plan<Code>& plan,
                   std::size_t begin,
                   const Merged& merged) {
  const Doubts doubts = kernel.average_all(plan, begin, merged);
  if (!doubts.contradicted && !doubts.shifted) return;
  Flags contradicted = kernel.find_contradictions(plan, begin);
  join_pixels(contradicted);
  average_newest(plan, begin, contradicted, merged);
}

// The last stretch of a picture, if it is a short one: filled up with its last pixel.
template <class Code>
void merge_rest(const Kernel<Code>& kernel,
                const Plan<Code>& plan,
                std::size_t begin,
                std::size_t count,
                MergedFrame& frame) {
  Plan<Code> rest = plan;
  std::array<std::array<Code, lanes>, most_window_shots> values;
  for (std::size_t i = 0; i < plan.count; ++i) {
    const Code* from = plan.shots[i].values + begin;
    for (std::size_t k = 0; k < lanes; ++k) {
      values[i][k] = from[k < count ? k : count - channels + k % channels];
    }
    rest.shots[i].values = values[i].data();
  }
  Lanes radiance;
  std::array<std::uint16_t, lanes> counted;
  std::array<MergeStatus, stretch_pixels> status;
  merge_stretch(kernel, rest, 0, {radiance.v.data(), counted.data(), status.data()});
  std::copy_n(radiance.v.data(), count, &frame.radiance.pixels[begin]);
  std::copy_n(counted.data(), count, &frame.counted[begin]);
  std::copy_n(status.data(), count / channels, &frame.status[begin / channels]);
}

std::size_t samples_of(const LinearCodes& codes) {
  return static_cast<std::size_t>(codes.width) * static_cast<std::size_t>(codes.height) * channels;
}

void require_live_exposure(double exposure_s) {
  if (!(exposure_s >= 1e-9 && exposure_s <= 1e6)) {
    throw std::invalid_argument("an exposure of a live bracket lies between 1 ns and 1e6 s");
  }
}

void require_settings(const WindowMergeSettings& settings) {
  const NoiseModel& noise = settings.noise;
  const auto sane = [](double value) { return value >= 0 && value <= 1e6; };
  if (!(noise.read > 0) || !sane(noise.read) || !sane(noise.shot) || !sane(noise.relative) ||
      !(noise.saturation > 0) || !sane(noise.saturation)) {
    throw std::invalid_argument("a noise model has variance at black, and a saturation above it");
  }
  if (!sane(settings.consistency) || !sane(settings.exposure_error) ||
      !sane(settings.most_levelled)) {
    throw std::invalid_argument("consistency, exposure_error and most_levelled are not below 0");
  }
}

void resize(Image& image, int width, int height) {
  image.width = width;
  image.height = height;
  image.channels = static_cast<int>(channels);
  image.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                      channels);
}

template <class Code>
void merge_all(
    const Kernel<Code>& kernel, const Plan<Code>& plan, int width, int height, MergedFrame& frame) {
  resize(frame.radiance, width, height);
  const std::size_t samples = frame.radiance.pixels.size();
  frame.counted.resize(samples);
  frame.status.resize(samples / channels);
  const auto merge = [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      merge_stretch(kernel, plan, i * lanes,
                    {&frame.radiance.pixels[i * lanes], &frame.counted[i * lanes],
                     &frame.status[i * stretch_pixels]});
    }
  };
  const std::size_t stretches = samples / lanes;
  capture::parallel_for(tbb::blocked_range<std::size_t>(0, stretches, stretches_per_task), merge);
  if (samples % lanes != 0) merge_rest(kernel, plan, stretches * lanes, samples % lanes, frame);
}

// The lowest code that is saturated: at the latest the largest there is.
template <class Code>
Code saturated_code(double black, double white, double saturation) {
  const double code = black + saturation * (white - black);
  if constexpr (std::floating_point<Code>) return static_cast<Code>(code);
  constexpr double largest = std::numeric_limits<Code>::max();
  return static_cast<Code>(std::clamp(std::ceil(code), 0.0, largest));
}

template <class Code>
struct WindowShot {
  const Code* values = nullptr;
  double exposure_s = 0;
};
template <class Code>
struct Shots {
  std::array<WindowShot<Code>, most_window_shots> of;  // the newest last
  std::size_t count = 0;
};

// The radiance below which an average of this variance is within two deviations of black.
float dark_below(float read, float shot, float relative_squared) {
  const float rest = 1 - 4 * relative_squared;
  if (rest <= 0) return std::numeric_limits<float>::max();
  return 2 * (shot + std::sqrt(shot * shot + rest * read)) / rest;
}

// Radiance from values, in every lane.
template <class Code>
void plan_scale(const LinearCodes& codes, double exposure_s, PlannedShot<Code>& shot) {
  for (std::size_t k = 0; k < lanes; ++k) {
    const double black = codes.black[k % channels];
    const double scale = 1 / ((codes.white[k % channels] - black) * exposure_s);
    shot.scale.v[k] = static_cast<float>(scale);
    shot.offset.v[k] = static_cast<float>(-black * scale);
  }
}

// The terms of every shot, and how it is added to the shorter ones.
template <class Code>
void plan_steps(const Shots<Code>& shots,
                const LinearCodes& codes,
                const NoiseModel& noise,
                Plan<Code>& plan) {
  std::array<std::size_t, most_window_shots> order{};  // from the shortest, then from the oldest
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(shots.count);
  std::sort(order.begin(), end, [&](std::size_t a, std::size_t b) {
    return std::pair(shots.of[a].exposure_s, a) < std::pair(shots.of[b].exposure_s, b);
  });
  const double longest_s = shots.of[*(end - 1)].exposure_s;
  plan.read = static_cast<float>(noise.read / (longest_s * longest_s));
  plan.shot = static_cast<float>(noise.shot / longest_s);
  float weight = 0, first = 0, second = 0, mean_read = 0, mean_shot = 0;
  Step step;
  for (std::size_t i = 0; i < shots.count; ++i) {
    const WindowShot<Code>& from = shots.of[order[i]];
    PlannedShot<Code>& shot = plan.shots[i];
    plan.newest_first[shots.count - 1 - order[i]] = i;
    const double t = from.exposure_s / longest_s;
    shot.values = from.values;
    shot.place = order[i];
    shot.bit = static_cast<std::uint16_t>(1U << order[i]);
    shot.terms = {static_cast<float>(noise.read / (from.exposure_s * from.exposure_s)),
                  static_cast<float>(noise.shot / from.exposure_s),
                  static_cast<float>(t * std::sqrt(t)), static_cast<float>(t),
                  static_cast<float>(t * t)};
    if (i > 0 && plan.doubt < infinite) {
      step.allowed = {plan.doubt * (mean_read + shot.terms.read),
                      plan.doubt * (mean_shot + shot.terms.shot), plan.doubt * plan.slack};
    }
    weight += shot.terms.weight;
    first += shot.terms.first;
    second += shot.terms.second;
    mean_read = plan.read * first / (weight * weight);
    mean_shot = plan.shot * second / (weight * weight);
    step.gain = shot.terms.weight / weight;
    step.dark = dark_below(mean_read, mean_shot, plan.relative_squared);
    step.counted |= shot.bit;
    shot.step = step;
    plan.dark[i + 1] = step.dark;
    plan.counted[i + 1] = step.counted;
    plan_scale(codes, from.exposure_s, shot);
  }
}

template <class Code>
void merge_shots_of(Shots<Code> shots,
                    const LinearCodes& codes,
                    const WindowMergeSettings& settings,
                    MergedFrame& frame) {
  const NoiseModel& noise = settings.noise;
  Plan<Code> plan;
  plan.count = shots.count;
  const double slack =
      noise.relative * noise.relative + settings.exposure_error * settings.exposure_error;
  plan.slack = static_cast<float>(2 * slack);
  plan.doubt = settings.consistency == 0
                   ? infinite
                   : static_cast<float>(settings.consistency * settings.consistency);
  plan.relative_squared = static_cast<float>(noise.relative * noise.relative);
  for (std::size_t k = 0; k < lanes; ++k) {
    plan.saturation[k] = saturated_code<Code>(codes.black[k % channels], codes.white[k % channels],
                                              noise.saturation);
    plan.saturated_value.v[k] = static_cast<float>(plan.saturation[k]);
  }
  plan_steps(shots, codes, noise, plan);
  frame.gains = compare_shots(plan, samples_of(codes));
  const auto [least, most] = std::minmax_element(
      frame.gains.begin(), frame.gains.begin() + static_cast<std::ptrdiff_t>(shots.count));
  frame.levelled = settings.level_flicker && *most <= settings.most_levelled * *least;
  if (frame.levelled) {
    for (std::size_t i = 0; i < shots.count; ++i) shots.of[i].exposure_s *= frame.gains[i];
    plan_steps(shots, codes, noise, plan);
  }
  frame.noise = noise;
  frame.shots = shots.count;
  frame.exposure_error = settings.exposure_error;
  for (std::size_t i = 0; i < shots.count; ++i) frame.exposures_s[i] = shots.of[i].exposure_s;
  merge_all(settings.widest_registers ? best_kernel<Code>() : built_kernel<Code>(), plan,
            codes.width, codes.height, frame);
}

// Of an average of radiance L: read + L * (shot + L * relative_squared).
struct Variance {
  float read = infinite, shot = 0, relative_squared = 0;
};

bool counts(std::uint16_t counted, std::size_t shot) { return (counted >> shot & 1) != 0; }

// How far an average is from what one of the shots tells, relatively. Shots that differ by more
// than pixels pass over, and do not count here, are told by the pixels' status.
double disagreement(const MergedFrame& frame, std::uint16_t counted) {
  if (frame.levelled) return 0;
  double weight = 0, sum = 0;
  for (std::size_t i = 0; i < frame.shots; ++i) {
    if (!counts(counted, i)) continue;
    const double of_shot = frame.exposures_s[i] * std::sqrt(frame.exposures_s[i]);
    weight += of_shot;
    sum += of_shot * frame.gains[i];
  }
  const double mean = sum / weight;
  double most = 0;
  for (std::size_t i = 0; i < frame.shots; ++i) {
    const double apart = std::abs(frame.gains[i] / mean - 1);
    if (counts(counted, i) || apart < passed_over * frame.exposure_error)
      most = std::max(most, apart);
  }
  return most;
}

Variance variance_of(const MergedFrame& frame, std::uint16_t counted) {
  if (counted == 0) return {};
  double weight = 0, first = 0, second = 0;
  for (std::size_t i = 0; i < frame.shots; ++i) {
    if (!counts(counted, i)) continue;
    const double t = frame.exposures_s[i];
    weight += t * std::sqrt(t);
    first += t;
    second += t * t;
  }
  const NoiseModel& noise = frame.noise;
  const double apart = disagreement(frame, counted);
  return {static_cast<float>(noise.read * first / (weight * weight)),
          static_cast<float>(noise.shot * second / (weight * weight)),
          static_cast<float>(noise.relative * noise.relative + apart * apart)};
}

void require_count(std::size_t count) {
  if (count == 0) throw std::invalid_argument("there are no shots to merge");
  if (count > most_window_shots) {
    throw std::invalid_argument("a window holds up to " + std::to_string(most_window_shots) +
                                " shots");
  }
}

template <class Coded>
void require_codes(std::span<const Coded> shots, const LinearCodes& codes) {
  require_count(shots.size());
  if (codes.width < 1 || codes.height < 1) throw std::invalid_argument("a shot has a size");
  for (std::size_t c = 0; c < channels; ++c) {
    if (!(codes.white[c] > codes.black[c]) || !(std::abs(codes.black[c]) <= 65535) ||
        !(codes.white[c] <= 65535)) {
      throw std::invalid_argument("white lies above black, both within 16 bits");
    }
  }
  const std::size_t samples = samples_of(codes);
  for (const Coded& shot : shots) {
    require_live_exposure(shot.exposure_s);
    if (shot.codes.size() != samples) {
      throw std::invalid_argument("the shots of a bracket need one size and three channels");
    }
  }
}

template <class Code, class Coded>
void merge_coded(std::span<const Coded> shots,
                 const LinearCodes& codes,
                 const WindowMergeSettings& settings,
                 MergedFrame& frame) {
  require_codes(shots, codes);
  require_settings(settings);
  Shots<Code> of{{}, shots.size()};
  for (std::size_t i = 0; i < shots.size(); ++i) {
    of.of[i] = {shots[i].codes.data(), shots[i].exposure_s};
  }
  merge_shots_of(of, codes, settings, frame);
}

}  // namespace

void MergedFrame::fill_deviation(Image& deviation) const {
  resize(deviation, radiance.width, radiance.height);
  std::uint16_t shots = 0;  // of the sample before: as a rule the same
  Variance variance = variance_of(*this, shots);
  for (std::size_t i = 0; i < counted.size(); ++i) {
    if (counted[i] != shots) variance = variance_of(*this, shots = counted[i]);
    const float light = std::max(radiance.pixels[i], 0.0F);
    deviation.pixels[i] =
        std::sqrt(variance.read + light * (variance.shot + light * variance.relative_squared));
  }
}

Image MergedFrame::deviation() const {
  Image deviation;
  fill_deviation(deviation);
  return deviation;
}

std::array<double, merge_status_count> MergedFrame::status_shares() const {
  std::array<double, merge_status_count> shares{};
  if (status.empty()) return shares;
  for (const MergeStatus one : status) shares[static_cast<std::size_t>(one)] += 1;
  for (double& share : shares) share /= static_cast<double>(status.size());
  return shares;
}

void merge_window(std::span<const LiveShot> shots,
                  const WindowMergeSettings& settings,
                  MergedFrame& frame) {
  require_count(shots.size());
  require_settings(settings);
  const Image* first = shots[0].linear;
  for (const LiveShot& shot : shots) {
    require_live_exposure(shot.exposure_s);
    if (shot.linear == nullptr || shot.linear->width != first->width ||
        shot.linear->height != first->height || shot.linear->channels != 3 ||
        shot.linear->empty()) {
      throw std::invalid_argument("the shots of a bracket need one size and three channels");
    }
  }
  const LinearCodes linear{first->width, first->height, {0, 0, 0}, {1, 1, 1}};
  Shots<float> of{{}, shots.size()};
  for (std::size_t i = 0; i < shots.size(); ++i) {
    of.of[i] = {shots[i].linear->pixels.data(), shots[i].exposure_s};
  }
  merge_shots_of(of, linear, settings, frame);
}

void merge_window(std::span<const CodedShot8> shots,
                  const LinearCodes& codes,
                  const WindowMergeSettings& settings,
                  MergedFrame& frame) {
  merge_coded<std::uint8_t>(shots, codes, settings, frame);
}

void merge_window(std::span<const CodedShot16> shots,
                  const LinearCodes& codes,
                  const WindowMergeSettings& settings,
                  MergedFrame& frame) {
  merge_coded<std::uint16_t>(shots, codes, settings, frame);
}

}  // namespace capture
