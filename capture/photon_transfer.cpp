// Photon transfer: saturation, noise line, black level, linearity, colour by colour.
#include "capture/photon_transfer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "capture/black_level.h"
#include "capture/code_range.h"
#include "capture/median.h"
#include "capture/noise_line.h"
#include "capture/shot_blocks.h"

namespace capture {
namespace {

void check(std::span<const SensorShot> shots, int bits, double exposure_error) {
  if (shots.empty()) throw std::invalid_argument("there are no shots to measure a sensor by");
  if (bits < 8 || bits > 16) throw std::invalid_argument("a sensor has 8 to 16 bits");
  if (!(exposure_error > 0)) throw std::invalid_argument("an exposure's error is above 0");
  for (const SensorShot& shot : shots) {
    if (shot.width != shots[0].width || shot.height != shots[0].height ||
        shot.channels != shots[0].channels || shot.pattern != shots[0].pattern) {
      throw std::invalid_argument("the shots of a sensor need one size and kind");
    }
    if (shot.width < 1 || shot.height < 1 || (shot.channels != 1 && shot.channels != 3) ||
        (shot.channels == 3 && shot.pattern != BayerPattern::none) ||
        shot.codes.size() != static_cast<std::size_t>(shot.width) *
                                 static_cast<std::size_t>(shot.height) *
                                 static_cast<std::size_t>(shot.channels)) {
      throw std::invalid_argument("a sensor's shot has one or three channels and a code for each");
    }
    if (!(shot.exposure_s >= 0) || !std::isfinite(shot.exposure_s)) {
      throw std::invalid_argument("an exposure time is above 0, or 0 for a dark shot");
    }
  }
}

std::vector<NoisePoint> noise_points(const ColourBlocks& colour,
                                     std::span<const ExposureLevel> levels,
                                     const WholeRange& range) {
  std::vector<NoisePoint> points;
  for (std::size_t b = 0; b < colour.count(); ++b) {
    for (std::size_t k = 0; k < levels.size(); ++k) {
      const SiteBlock& block = colour.at(b, k);
      if (block.variance < 0 || !is_whole(block, range)) continue;
      points.push_back({block.mean, block.variance,
                        static_cast<double>((levels[k].shots.size() - 1) * (block_sites - 1))});
    }
  }
  return points;
}

std::vector<std::vector<BlockMean>> block_means(const ColourBlocks& colour,
                                                std::span<const ExposureLevel> levels,
                                                const WholeRange& range,
                                                const NoiseLine& line) {
  constexpr std::size_t enough = 6000;
  constexpr double rounding = 1.0 / 12 / block_sites;  // the same at every shot of few noise
  const std::size_t step = std::max<std::size_t>(1, colour.count() / enough);
  std::vector<std::vector<BlockMean>> blocks;
  for (std::size_t b = 0; b < colour.count(); b += step) {
    std::vector<BlockMean> means;
    for (std::size_t k = 0; k < levels.size(); ++k) {
      const SiteBlock& block = colour.at(b, k);
      if (!is_whole(block, range)) continue;
      const double variance = std::max(0.0, line.variance(block.mean)) /
                                  (block_sites * static_cast<double>(levels[k].shots.size())) +
                              rounding;
      means.push_back({k, block.mean, std::sqrt(variance)});
    }
    const bool dark = !means.empty() && levels[means[0].level].exposure_s == 0;
    if (means.size() > 1 || dark) blocks.push_back(std::move(means));
  }
  return blocks;
}

// Codes against those that the shorter exposures foretell, by code.
struct Linearity {
  double error = std::numeric_limits<double>::quiet_NaN();
  double usable = 0;
};

Linearity find_linearity(const ColourBlocks& colour,
                         std::span<const ExposureLevel> levels,
                         const Saturation& saturation,
                         const WholeRange& whole,
                         const BlackFit& fit) {
  constexpr std::size_t bins = 32;
  std::vector<std::vector<double>> departures(bins);
  const double range = saturation.from - fit.black.value;
  for (std::size_t b = 0; b < colour.count(); ++b) {
    for (std::size_t k = 1; k < levels.size(); ++k) {
      // The next shorter exposure: the farther, the noisier.
      const SiteBlock& shorter = colour.at(b, k - 1);
      const SiteBlock& block = colour.at(b, k);
      if (!(levels[k - 1].exposure_s > 0) || !is_whole(shorter, whole)) continue;
      const double light = shorter.mean - fit.black.value;
      constexpr double bright = 0.02;  // where black's error is no matter
      if (light < bright * range) continue;
      const double expected =
          light * std::exp(fit.log_exposures[k] - fit.log_exposures[k - 1]) / range;
      if (!(expected < 1)) continue;
      departures[static_cast<std::size_t>(expected * bins)].push_back(
          (block.mean - fit.black.value) / (expected * range) - 1);
    }
  }
  Linearity linearity{std::numeric_limits<double>::quiet_NaN(), saturation.from};
  constexpr std::size_t least = 12;
  constexpr double lowest_share = 0.1;
  constexpr double bent = 0.02;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const double low = static_cast<double>(bin) / bins;
    if (departures[bin].size() < least || low < lowest_share) continue;
    const double departure = std::abs(median_in_place(departures[bin]));
    if (low >= fitted_share && departure > bent) {
      linearity.usable = fit.black.value + low * range;
      break;
    }
    linearity.error =
        std::isnan(linearity.error) ? departure : std::max(linearity.error, departure);
  }
  return linearity;
}

// The power of the claimed exposures that the solved ones follow: 1 for a linear sensor.
double power_of(std::span<const ExposureLevel> levels, const BlackFit& fit) {
  double mean_claim = 0;
  double mean_solved = 0;
  double count = 0;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    if (!(levels[k].exposure_s > 0)) continue;
    mean_claim += std::log(levels[k].exposure_s);
    mean_solved += fit.log_exposures[k];
    count += 1;
  }
  double both = 0;
  double square = 0;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    if (!(levels[k].exposure_s > 0)) continue;
    const double claim = std::log(levels[k].exposure_s) - mean_claim / count;
    both += claim * (fit.log_exposures[k] - mean_solved / count);
    square += claim * claim;
  }
  return square > 0 ? both / square : 1;
}

std::string percent(double share) { return std::to_string(std::lround(100 * share)) + " %"; }

[[noreturn]] void fail_not_linear(const std::string& why) {
  throw NotLinear("the codes are not those of a linear sensor: " + why +
                  "; recover a response curve instead");
}

void require_light(const ColourBlocks& colour, const Saturation& saturation, std::size_t points) {
  constexpr std::size_t least_points = 40;
  if (points >= least_points) return;
  std::size_t bright = 0;
  std::size_t dark = 0;
  for (const SiteBlock& block : colour.blocks) {
    if (block.highest >= saturation.from) ++bright;
    if (block.lowest == 0) ++dark;
  }
  if (2 * bright > colour.blocks.size()) {
    throw std::runtime_error(
        "nearly all of the shots is saturated; take shorter exposures of the scene");
  }
  if (2 * dark > colour.blocks.size()) {
    throw std::runtime_error(
        "nearly all of the shots is black; take longer exposures, or light the scene");
  }
  throw std::runtime_error("the shots have too few unclipped sites to measure a sensor (" +
                           std::to_string(points) + " blocks of 8 x 8 where " +
                           std::to_string(least_points) + " are needed)");
}

void check_noise(const NoiseLine& line) {
  constexpr double surely = 3;
  const double sigma = std::sqrt(line.covariance[2]);
  if (!std::isfinite(sigma) || !(line.slope > surely * sigma)) {
    if (std::isfinite(sigma) && line.slope < -surely * sigma) {
      fail_not_linear("their variance falls as light grows");
    }
    throw NotLinear(
        "the noise does not grow with light as photons' does: either the codes are not those of a "
        "linear sensor (then recover a response curve instead), or the scene has one brightness "
        "only (then take brighter and darker exposures, each twice)");
  }
  constexpr double much = 0.3;
  if (std::abs(line.bend) > much && std::abs(line.bend) > 5 * line.bend_sigma) {
    fail_not_linear("their variance does not grow in proportion to light (by " +
                    percent(std::abs(line.bend)) + ")");
  }
}

struct Measured {
  ChannelTransfer channel;
  BlackFit fit;
};

Estimate root_of(double variance, double sigma) {
  const double value = std::sqrt(std::max(0.0, variance));
  const double above = std::sqrt(std::max(0.0, variance) + sigma) - value;
  return {value, variance > sigma ? sigma / (2 * value) : above};
}

ChannelTransfer channel_of(const NoiseLine& line,
                           const BlackFit& fit,
                           const Saturation& saturation,
                           const Linearity& linearity) {
  ChannelTransfer channel;
  const double slope_sigma = std::sqrt(line.covariance[2]);
  channel.gain = {1 / line.slope, slope_sigma / (line.slope * line.slope)};
  channel.black = fit.black;
  const double at_black = line.variance(fit.black.value);
  const double sigma = std::hypot(line.sigma(fit.black.value), line.slope * fit.black.sigma);
  channel.read_noise = root_of(at_black, sigma);
  channel.read_noise_e = {
      channel.read_noise.value / line.slope,
      std::hypot(channel.read_noise.sigma / line.slope,
                 channel.read_noise.value * slope_sigma / (line.slope * line.slope))};
  channel.saturation = saturation.code;
  channel.saturated = saturation.seen;
  channel.usable = linearity.usable;
  channel.linearity_error = linearity.error;
  return channel;
}

Measured measure_colour(const ColourBlocks& colour,
                        std::span<const ExposureLevel> levels,
                        int last_code,
                        double exposure_error) {
  const Saturation saturation = find_saturation(colour, levels, last_code);
  const WholeRange whole = whole_range(colour, saturation);
  const std::vector<NoisePoint> points = noise_points(colour, levels, whole);
  require_light(colour, saturation, points.size());
  const NoiseLine line = fit_noise_line(points);
  std::vector<double> claimed_s;
  for (const ExposureLevel& level : levels) claimed_s.push_back(level.exposure_s);
  Measured measured;
  measured.fit =
      fit_black_level(block_means(colour, levels, whole, line), claimed_s, exposure_error);
  constexpr double most_bent = 0.05;
  // Without two exposures of one place there are none to solve for: said below.
  if (!measured.fit.log_exposures.empty()) {
    const double power = power_of(levels, measured.fit);
    if (std::abs(power - 1) > most_bent) {
      fail_not_linear("they grow as the exposure to the power " +
                      std::to_string(power).substr(0, 4));
    }
  }
  check_noise(line);
  if (!std::isfinite(measured.fit.black.sigma)) {
    throw std::runtime_error(
        "no place is seen unclipped at two exposures, so that black is not known; take exposures "
        "closer together, or a dark shot");
  }
  const Linearity linearity = find_linearity(colour, levels, saturation, whole, measured.fit);
  if (linearity.error > most_bent) {
    fail_not_linear("they depart from a straight line by " + percent(linearity.error));
  }
  measured.channel = channel_of(line, measured.fit, saturation, linearity);
  return measured;
}

std::vector<std::string> warnings_of(const PhotonTransfer& transfer) {
  constexpr std::array names{"red", "green", "blue"};
  std::vector<std::string> warnings;
  for (std::size_t c = 0; c < transfer.channels.size(); ++c) {
    const ChannelTransfer& channel = transfer.channels[c];
    const std::string of = transfer.channels.size() == 1 ? "" : " of " + std::string(names[c]);
    const auto warn = [&](const std::string& words) { warnings.push_back(words + of); };
    if (!channel.saturated) warn("nothing is saturated: the last code is taken for saturation");
    if (std::isnan(channel.linearity_error)) {
      warn("the shots do not tell whether codes are proportional to light");
    } else if (channel.linearity_error > 0.01) {
      warn("codes depart from a straight line by " + percent(channel.linearity_error));
    }
    if (channel.gain.sigma > 0.1 * channel.gain.value) {
      warn("the gain is known to " + percent(channel.gain.sigma / channel.gain.value) +
           " only: more shots of each exposure help");
    }
    if (!(channel.read_noise.sigma < channel.read_noise.value)) {
      warn("the read noise is too small to be told from rounding: its deviation is a bound");
    }
  }
  return warnings;
}

}  // namespace

NoiseModel PhotonTransfer::noise() const {
  NoiseModel noise{.read = 0, .shot = 0, .relative = 0, .saturation = 1};
  const auto count = static_cast<double>(channels.size());
  for (const ChannelTransfer& channel : channels) {
    const double range = channel.saturation - channel.black.value;
    const double read = channel.read_noise.value;
    noise.read += (read * read + 1.0 / 12) / (range * range) / count;
    noise.shot += 1 / (channel.gain.value * range) / count;
    // The noise of what is just below saturation reaches above it.
    noise.saturation =
        std::min({noise.saturation, 0.98, (channel.usable - channel.black.value) / range});
  }
  return noise;
}

PhotonTransfer measure_photon_transfer(std::span<const SensorShot> shots,
                                       int bits,
                                       double exposure_error) {
  check(shots, bits, exposure_error);
  const std::vector<ExposureLevel> levels = exposure_levels(shots);
  const auto twice = [](const ExposureLevel& level) { return level.shots.size() > 1; };
  if (std::none_of(levels.begin(), levels.end(), twice)) {
    throw std::runtime_error(
        "no exposure was taken twice: a sensor's noise shows in the difference of two shots of "
        "one exposure");
  }
  if (levels.size() < 2) {
    throw std::runtime_error(
        "all shots have one exposure: take another one, or a dark shot, to tell black");
  }
  PhotonTransfer transfer;
  transfer.exposures_s.assign(shots.size(), 0);
  std::vector<double> log_exposures(levels.size(), 0);
  const std::vector<ColourBlocks> colours = colour_blocks(shots, levels);
  for (const ColourBlocks& colour : colours) {
    const Measured measured = measure_colour(colour, levels, (1 << bits) - 1, exposure_error);
    transfer.channels.push_back(measured.channel);
    for (std::size_t k = 0; k < levels.size(); ++k) {
      log_exposures[k] += measured.fit.log_exposures[k] / static_cast<double>(colours.size());
    }
  }
  for (std::size_t k = 0; k < levels.size(); ++k) {
    for (const std::size_t shot : levels[k].shots) {
      if (levels[k].exposure_s > 0) transfer.exposures_s[shot] = std::exp(log_exposures[k]);
    }
  }
  transfer.warnings = warnings_of(transfer);
  return transfer;
}

}  // namespace capture
