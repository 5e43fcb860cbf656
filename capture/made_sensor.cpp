// The made sensor: photons counted, read, coded.
#include "capture/made_sensor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include "capture/counter_random.h"

namespace capture {
namespace {

// Means below this are counted photon by photon; above it, where Poisson's skewness is below 0.21,
// their number is a normal deviate.
constexpr double most_counted_e = 24;

int last_code(const MadeSensor& sensor) { return (1 << sensor.bits) - 1; }

void check(const MadeSensor& sensor) {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0; };
  if (!positive(sensor.saturation) || !positive(sensor.full_well_e)) {
    throw std::invalid_argument("a made sensor needs saturation and full_well_e above 0");
  }
  if (!std::isfinite(sensor.read_noise_e) || sensor.read_noise_e < 0) {
    throw std::invalid_argument("a made sensor's read_noise_e must be 0 or more");
  }
  if (sensor.bits < 1 || sensor.bits > 16) {
    throw std::invalid_argument("a made sensor has 1 to 16 bits");
  }
  if (!(sensor.pedestal >= 0 && sensor.pedestal < last_code(sensor))) {
    throw std::invalid_argument("a made sensor's pedestal must lie below its last code");
  }
}

// A Poisson deviate by inversion: as many photons as the uniform number reaches.
double count_photons(double mean, double uniform) {
  double probability = std::exp(-mean);
  double reached = probability;
  double photons = 0;
  while (uniform > reached && probability > 0) {
    photons += 1;
    probability *= mean / photons;
    reached += probability;
  }
  return photons;
}

// The electrons that are read where `mean` were to be expected.
double read_electrons(const MadeSensor& sensor, double mean, std::uint64_t key) {
  const double read = sensor.read_noise_e;
  if (mean > most_counted_e) {
    return mean + std::sqrt(mean + read * read) * normal_deviate(mixed_bits(key));
  }
  const double photons = mean > 0 ? count_photons(mean, uniform_high(mixed_bits(key, 1))) : 0;
  return photons + (read > 0 ? read * normal_deviate(mixed_bits(key)) : 0);
}

// The codes of a sensor by the light at which each begins.
class Coder {
 public:
  explicit Coder(const MadeSensor& sensor)
      : linear_(sensor.transfer == Transfer::linear),
        pedestal_(sensor.pedestal),
        scale_(last_code(sensor) - sensor.pedestal),
        last_(last_code(sensor)) {
    if (linear_) return;
    for (int code = 1; code <= last_; ++code) {
      begins_.push_back(decode(sensor.transfer, (code - 0.5 - pedestal_) / scale_));
    }
    for (int bin = 0; bin <= bins; ++bin) {
      first_.push_back(
          count_up_to(static_cast<double>(bin) * bin / (bins * double{bins}), 0, begins_.size()));
    }
  }

  std::uint16_t code(double light) const {
    if (linear_) {
      const double code = std::floor(pedestal_ + scale_ * light + 0.5);
      return static_cast<std::uint16_t>(std::clamp(code, 0.0, double(last_)));
    }
    if (light >= 1) return static_cast<std::uint16_t>(last_);
    // The square root spreads codes evenly enough over the bins.
    const int bin = light > 0 ? static_cast<int>(std::sqrt(light) * bins) : 0;
    const std::size_t from = light > 0 ? first_[static_cast<std::size_t>(bin)] : 0;
    // The next bin but one: the root is rounded.
    const std::size_t to = first_[static_cast<std::size_t>(std::min(bin + 2, bins))];
    return static_cast<std::uint16_t>(count_up_to(light, from > 0 ? from - 1 : 0, to));
  }

 private:
  static constexpr int bins = 1024;

  // How many codes beyond 0 begin at `light` or below, known to be `from` to `to`.
  std::size_t count_up_to(double light, std::size_t from, std::size_t to) const {
    const auto begin = begins_.begin();
    return static_cast<std::size_t>(std::upper_bound(begin + static_cast<std::ptrdiff_t>(from),
                                                     begin + static_cast<std::ptrdiff_t>(to),
                                                     light) -
                                    begin);
  }

  bool linear_;
  double pedestal_;
  double scale_;
  int last_;
  std::vector<double> begins_;      // of code i + 1
  std::vector<std::size_t> first_;  // codes that begin up to each bin's lower edge
};

}  // namespace

MadeShot expose(const MadeSensor& sensor,
                const Image& radiance,
                double exposure_s,
                std::uint64_t shot) {
  check(sensor);
  if (radiance.empty()) throw std::invalid_argument("there is no picture to expose");
  if (!std::isfinite(exposure_s) || exposure_s <= 0) {
    throw std::invalid_argument("an exposure must be above 0 s");
  }
  MadeShot result{radiance.width, radiance.height, radiance.channels, sensor.bits,
                  std::vector<std::uint16_t>(radiance.pixels.size())};
  const Coder coder(sensor);
  const double electrons = sensor.full_well_e * exposure_s / sensor.saturation;
  const std::uint64_t shot_key = mixed_bits(sensor.seed, shot);
  for (std::size_t i = 0; i < result.codes.size(); ++i) {
    const double seen = std::isfinite(radiance.pixels[i]) ? radiance.pixels[i] : 0;
    // Beyond 64 wells nothing is left to chance: the site is full.
    const double mean = std::clamp(seen * electrons, 0.0, 64 * sensor.full_well_e);
    const double light = read_electrons(sensor, mean, mixed_bits(shot_key, i)) / sensor.full_well_e;
    result.codes[i] = coder.code(std::min(light, 1.0));
  }
  return result;
}

double light_of_code(const MadeSensor& sensor, int code) {
  check(sensor);
  return decode(sensor.transfer, (code - sensor.pedestal) / (last_code(sensor) - sensor.pedestal));
}

NoiseModel noise_of(const MadeSensor& sensor) {
  check(sensor);
  if (sensor.transfer != Transfer::linear) {
    throw std::invalid_argument("the noise model is that of a linear sensor");
  }
  const double step = 1 / (last_code(sensor) - sensor.pedestal);
  const double read = sensor.read_noise_e / sensor.full_well_e;
  return {.read = read * read + step * step / 12, .shot = 1 / sensor.full_well_e};
}

}  // namespace capture
