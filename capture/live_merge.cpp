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

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>

#include "capture/live_merge_plan.h"

namespace capture {
namespace {

using namespace window_merge;

constexpr std::size_t stretches_per_task = 128;

// The worst status of each pixel's channels.
void store_status(const Flags& status, std::size_t pixels, MergeStatus* to) {
  std::int32_t any = 0;
  for (const std::int32_t one : status.v) any |= one;
  if (any == 0) {
    std::fill_n(to, pixels, MergeStatus::good);
    return;
  }
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::int32_t* of = &status.v[channels * i];
    to[i] = static_cast<MergeStatus>(std::max(of[0], std::max(of[1], of[2])));
  }
}

void store(const Merged& merged, std::size_t begin, std::size_t count, MergedFrame& frame) {
  std::copy_n(merged.radiance.v.begin(), count,
              frame.radiance.pixels.begin() + static_cast<std::ptrdiff_t>(begin));
  std::copy_n(merged.deviation.v.begin(), count,
              frame.deviation.pixels.begin() + static_cast<std::ptrdiff_t>(begin));
  store_status(merged.status, count / channels, &frame.status[begin / channels]);
}

// The last stretch of a picture, if it is a short one: filled up with its last pixel.
template <class Code>
void merge_rest(const Plan<Code>& plan, std::size_t begin, std::size_t count, MergedFrame& frame) {
  Plan<Code> rest = plan;
  std::array<std::array<Code, lanes>, most_shots> values;
  for (std::size_t i = 0; i < plan.count; ++i) {
    const Code* from = plan.shots[i].values + begin;
    for (std::size_t k = 0; k < lanes; ++k) {
      values[i][k] = from[k < count ? k : count - channels + k % channels];
    }
    rest.shots[i].values = values[i].data();
  }
  Merged merged;
  merge_stretch(rest, 0, merged);
  store(merged, begin, count, frame);
}

void require_exposure(double exposure_s) {
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
  if (!sane(settings.consistency) || !sane(settings.exposure_error)) {
    throw std::invalid_argument("consistency and exposure_error are not below 0");
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
void merge_all(const Plan<Code>& plan, int width, int height, MergedFrame& frame) {
  resize(frame.radiance, width, height);
  resize(frame.deviation, width, height);
  const std::size_t samples = frame.radiance.pixels.size();
  frame.status.resize(samples / channels);
  const std::size_t stretches = samples / lanes;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, stretches, stretches_per_task),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      Merged merged;
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        merge_stretch(plan, i * lanes, merged);
                        store(merged, i * lanes, lanes, frame);
                      }
                    });
  if (samples % lanes != 0) merge_rest(plan, stretches * lanes, samples % lanes, frame);
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
  std::array<WindowShot<Code>, most_shots> of;  // the newest last
  std::size_t count = 0;
};

// The terms of every shot, and how it is added to the shorter ones.
template <class Code>
void plan_steps(const Shots<Code>& shots,
                const LinearCodes& codes,
                const NoiseModel& noise,
                Plan<Code>& plan) {
  std::array<std::size_t, most_shots> order{};  // from the shortest, and of equal ones the oldest
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(shots.count);
  std::sort(order.begin(), end, [&](std::size_t a, std::size_t b) {
    return std::pair(shots.of[a].exposure_s, a) < std::pair(shots.of[b].exposure_s, b);
  });
  const double longest_s = shots.of[*(end - 1)].exposure_s;
  plan.read = static_cast<float>(noise.read / (longest_s * longest_s));
  plan.shot = static_cast<float>(noise.shot / longest_s);
  float weight = 0, first = 0, second = 0;
  Step step;
  for (std::size_t i = 0; i < shots.count; ++i) {
    const WindowShot<Code>& from = shots.of[order[i]];
    PlannedShot<Code>& shot = plan.shots[i];
    plan.newest_first[shots.count - 1 - order[i]] = i;
    const double t = from.exposure_s / longest_s;
    shot.values = from.values;
    shot.terms = {static_cast<float>(noise.read / (from.exposure_s * from.exposure_s)),
                  static_cast<float>(noise.shot / from.exposure_s),
                  static_cast<float>(t * std::sqrt(t)), static_cast<float>(t),
                  static_cast<float>(t * t)};
    step.read = step.mean_read + shot.terms.read;
    step.shot = step.mean_shot + shot.terms.shot;
    weight += shot.terms.weight;
    first += shot.terms.first;
    second += shot.terms.second;
    step.gain = shot.terms.weight / weight;
    step.mean_read = plan.read * first / (weight * weight);
    step.mean_shot = plan.shot * second / (weight * weight);
    shot.step = step;
    for (std::size_t k = 0; k < lanes; ++k) {
      const double black = codes.black[k % channels];
      const double scale = 1 / ((codes.white[k % channels] - black) * from.exposure_s);
      shot.scale.v[k] = static_cast<float>(scale);
      shot.offset.v[k] = static_cast<float>(black * scale);
    }
  }
}

template <class Code>
void merge_shots_of(const Shots<Code>& shots,
                    const LinearCodes& codes,
                    const WindowMergeSettings& settings,
                    MergedFrame& frame) {
  const NoiseModel& noise = settings.noise;
  Plan<Code> plan;
  plan.count = shots.count;
  plan_steps(shots, codes, noise, plan);
  const double slack =
      noise.relative * noise.relative + settings.exposure_error * settings.exposure_error;
  plan.slack = static_cast<float>(2 * slack);
  plan.doubt = settings.consistency == 0
                   ? infinite
                   : static_cast<float>(settings.consistency * settings.consistency);
  plan.relative_squared = static_cast<float>(noise.relative * noise.relative);
  for (std::size_t k = 0; k < lanes; ++k) {
    const double black = codes.black[k % channels];
    const double white = codes.white[k % channels];
    plan.saturation[k] = saturated_code<Code>(black, white, noise.saturation);
    plan.saturated_value.v[k] = static_cast<float>(plan.saturation[k]);
  }
  merge_all(plan, codes.width, codes.height, frame);
}

void require_count(std::size_t count) {
  if (count == 0) throw std::invalid_argument("there are no shots to merge");
  if (count > most_shots) {
    throw std::invalid_argument("a window holds up to " + std::to_string(most_shots) + " shots");
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
  const std::size_t samples =
      static_cast<std::size_t>(codes.width) * static_cast<std::size_t>(codes.height) * channels;
  for (const Coded& shot : shots) {
    require_exposure(shot.exposure_s);
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
    require_exposure(shot.exposure_s);
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
