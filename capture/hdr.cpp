// HDR merge by inverse variances: per sample, and through tables.
#include "capture/hdr.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace capture {
namespace {

constexpr double no_bound = std::numeric_limits<double>::infinity();
constexpr std::size_t table_codes = Response::codes;

void require_exposure(double exposure_s) {
  if (!(exposure_s > 0) || !std::isfinite(exposure_s)) {
    throw std::invalid_argument("an exposure time is above 0");
  }
}

void require_one_size(std::span<const Shot> shots) {
  if (shots.empty()) throw std::invalid_argument("there are no shots to merge");
  const Image& first = shots[0].linear;
  for (const Shot& shot : shots) {
    const Image& picture = shot.linear;
    require_exposure(shot.exposure_s);
    if (picture.width != first.width || picture.height != first.height ||
        picture.channels != first.channels || picture.empty()) {
      throw std::invalid_argument("the shots of a bracket need one size");
    }
  }
}

void require_noise(const NoiseModel& noise) {
  if (!(noise.read > 0) || !(noise.shot >= 0) || !(noise.saturation > 0)) {
    throw std::invalid_argument("a noise model has variance at black, and a saturation above it");
  }
}

struct Estimate {
  double radiance = 0;
  double variance = no_bound;
};

// The mean of a sample's unsaturated shots, weighted by the inverse variances that they have if
// `radiance` is right.
Estimate weighted_mean(std::span<const Shot> shots,
                       std::size_t sample,
                       const NoiseModel& noise,
                       double radiance) {
  double weighted = 0;
  double weights = 0;
  for (const Shot& shot : shots) {
    const double value = static_cast<double>(shot.linear.pixels[sample]);
    if (!(value < noise.saturation) || !std::isfinite(value)) continue;
    const double t = shot.exposure_s;
    const double weight = t * t / noise.variance(radiance * t);
    weighted += weight * value / t;
    weights += weight;
  }
  if (weights == 0) return {};
  return {weighted / weights, 1 / weights};
}

Estimate merge_sample(std::span<const Shot> shots,
                      std::size_t sample,
                      const NoiseModel& noise,
                      const Shot& shortest) {
  // At radiance 0 all variances are equal: weights go by exposure alone, and are free of noise.
  Estimate estimate = weighted_mean(shots, sample, noise, 0);
  if (estimate.variance == no_bound) {
    const double bound = static_cast<double>(shortest.linear.pixels[sample]);
    return {std::isfinite(bound) ? bound / shortest.exposure_s : 0, no_bound};
  }
  constexpr int rounds = 2;  // a third one changes nothing that noise does not hide
  for (int round = 0; round < rounds; ++round) {
    estimate = weighted_mean(shots, sample, noise, estimate.radiance);
  }
  return estimate;
}

}  // namespace

double NoiseModel::variance(double value) const {
  const double light = std::max(0.0, value);
  return read + shot * light + relative * relative * light * light;
}

Image merge_shots(std::span<const Shot> shots, const NoiseModel& noise, Image* deviation) {
  require_one_size(shots);
  require_noise(noise);
  const Image& first = shots[0].linear;
  const Shot& shortest =
      *std::min_element(shots.begin(), shots.end(),
                        [](const Shot& a, const Shot& b) { return a.exposure_s < b.exposure_s; });
  Image radiance = make_image(first.height, first.width, first.channels);
  if (deviation != nullptr) *deviation = radiance;
  for (std::size_t i = 0; i < radiance.pixels.size(); ++i) {
    const Estimate estimate = merge_sample(shots, i, noise, shortest);
    radiance.pixels[i] = static_cast<float>(estimate.radiance);
    if (deviation != nullptr) {
      deviation->pixels[i] = static_cast<float>(std::sqrt(estimate.variance));
    }
  }
  return radiance;
}

CodeTable response_code_table(const Response& response, int channel, double code_sigma) {
  constexpr int saturated = 250;       // JPEG's ringing reaches some codes below 255
  constexpr int reach = 2;             // codes over which the slope is taken
  constexpr double least_step = 1e-5;  // of light between codes: a flat foot is not exact
  const auto& light = response.light.at(static_cast<std::size_t>(channel));
  CodeTable table;
  for (int code = 0; code < Response::codes; ++code) {
    const int low = std::max(0, code - reach);
    const int high = std::min(Response::codes - 1, code + reach);
    const double step = std::max(
        least_step, (light[static_cast<std::size_t>(high)] - light[static_cast<std::size_t>(low)]) /
                        (high - low));
    table.value.push_back(light[static_cast<std::size_t>(code)]);
    // A linear sensor may be full below the last code: its curve is flat from there on.
    const bool full = code >= saturated || !(light[static_cast<std::size_t>(code)] < light.back());
    table.variance.push_back(full ? no_bound : step * step * code_sigma * code_sigma);
  }
  return table;
}

MergeTables::MergeTables(std::array<CodeTable, 3> channels, int shots)
    : channels_(std::move(channels)) {
  if (shots < 1) throw std::invalid_argument("there are no shots to merge");
  shots_ = static_cast<std::size_t>(shots);
  for (const CodeTable& channel : channels_) {
    if (channel.value.size() != table_codes || channel.variance.size() != table_codes) {
      throw std::invalid_argument("a channel's table has 256 codes");
    }
    bool unsaturated = false;
    for (const double variance : channel.variance) {
      if (!(variance > 0)) throw std::invalid_argument("a code's variance is above 0");
      unsaturated = unsaturated || variance < no_bound;
    }
    if (!unsaturated) throw std::invalid_argument("every code is saturated");
  }
  entries_.resize(shots_ * channels_.size() * table_codes);
}

void MergeTables::set_exposures(std::span<const double> exposures_s) {
  if (exposures_s.size() != shots_) {
    throw std::invalid_argument("every shot of a bracket needs an exposure");
  }
  for (const double exposure_s : exposures_s) require_exposure(exposure_s);
  const double longest = *std::max_element(exposures_s.begin(), exposures_s.end());
  const auto shortest = static_cast<std::size_t>(
      std::min_element(exposures_s.begin(), exposures_s.end()) - exposures_s.begin());
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const CodeTable& table = channels_[c];
    const double least = *std::min_element(table.variance.begin(), table.variance.end());
    double lightest = no_bound;  // weight of any code that counts
    for (std::size_t s = 0; s < shots_; ++s) {
      const double t = exposures_s[s] / longest;  // keeps weights in a float's range
      for (std::size_t code = 0; code < table_codes; ++code) {
        const double weight = t * t * least / table.variance[code];  // 0 if saturated
        if (weight > 0) lightest = std::min(lightest, weight);
        entries_[(s * channels_.size() + c) * table_codes + code] = {
            static_cast<float>(weight * table.value[code] / exposures_s[s]),
            static_cast<float>(weight)};
      }
    }
    // Saturated in every shot: the shortest one's value alone counts. Beside any other it weighs
    // less than a float's last bit.
    constexpr double negligible = 1e-9;
    for (std::size_t code = 0; code < table_codes; ++code) {
      if (table.variance[code] < no_bound) continue;
      const double weight = negligible * lightest;
      entries_[(shortest * channels_.size() + c) * table_codes + code] = {
          static_cast<float>(weight * table.value[code] / exposures_s[shortest]),
          static_cast<float>(weight)};
    }
  }
}

void MergeTables::merge(std::span<const std::uint8_t* const> shots,
                        int width,
                        int first_row,
                        int last_row,
                        float* radiance) const {
  constexpr std::size_t channels = 3;
  if (shots.size() != shots_) {
    throw std::invalid_argument("the tables are for another number of shots");
  }
  const std::size_t begin = static_cast<std::size_t>(first_row) * static_cast<std::size_t>(width);
  const std::size_t end = static_cast<std::size_t>(last_row) * static_cast<std::size_t>(width);
  const auto merge_pixels = [&](auto shot_count) {
    for (std::size_t i = begin * channels; i < end * channels; i += channels) {
      for (std::size_t c = 0; c < channels; ++c) {
        const Entry* table = entries_.data() + c * table_codes;
        Entry sum;
        for (std::size_t s = 0; s < shot_count; ++s, table += channels * table_codes) {
          const Entry& entry = table[shots[s][i + c]];
          sum.weighted += entry.weighted;
          sum.weight += entry.weight;
        }
        radiance[i + c] = sum.weighted / sum.weight;
      }
    }
  };
  // Counts that are known to the compiler unroll.
  switch (shots_) {
    case 2:
      return merge_pixels(std::integral_constant<std::size_t, 2>());
    case 3:
      return merge_pixels(std::integral_constant<std::size_t, 3>());
    case 4:
      return merge_pixels(std::integral_constant<std::size_t, 4>());
    default:
      return merge_pixels(shots_);
  }
}

}  // namespace capture
