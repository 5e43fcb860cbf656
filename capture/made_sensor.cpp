// The made sensor: photons counted, read, coded.
#include "capture/made_sensor.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

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
  const double electrons = sensor.full_well_e * exposure_s / sensor.saturation;
  const double scale = last_code(sensor) - sensor.pedestal;
  const std::uint64_t shot_key = mixed_bits(sensor.seed, shot);
  for (std::size_t i = 0; i < result.codes.size(); ++i) {
    const double seen = std::isfinite(radiance.pixels[i]) ? radiance.pixels[i] : 0;
    // Beyond 64 wells nothing is left to chance: the site is full.
    const double mean = std::clamp(seen * electrons, 0.0, 64 * sensor.full_well_e);
    const double light = read_electrons(sensor, mean, mixed_bits(shot_key, i)) / sensor.full_well_e;
    const double value = encode(sensor.transfer, std::min(light, 1.0));
    const double code = std::floor(sensor.pedestal + scale * value + 0.5);
    result.codes[i] = static_cast<std::uint16_t>(std::clamp(code, 0.0, double(last_code(sensor))));
  }
  return result;
}

double light_of_code(const MadeSensor& sensor, int code) {
  check(sensor);
  return decode(sensor.transfer, (code - sensor.pedestal) / (last_code(sensor) - sensor.pedestal));
}

}  // namespace capture
