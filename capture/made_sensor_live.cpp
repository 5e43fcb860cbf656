// Made sensors at a camera's rate.
#include "capture/made_sensor_live.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "capture/colour.h"
#include "capture/counter_random.h"

namespace capture {
namespace {

constexpr std::size_t deviates = 65536;
constexpr std::size_t run = 256;  // sites that take deviates which follow each other
constexpr int root_steps = 4096;
constexpr float full_enough = 64;  // wells; beyond them nothing changes

// What one run of sites needs.
struct Gain {
  float wells;  // for one unit of radiance
  float shot;   // variance of light 1, in squared wells
  float read;   // variance of reading
};

// Light of each site, 1 = full well, with its noise.
void gather(const float* __restrict radiance,
            const float* __restrict deviate,
            Gain gain,
            std::size_t count,
            float* __restrict light) {
  for (std::size_t i = 0; i < count; ++i) {
    const float seen = radiance[i] > 0 ? radiance[i] * gain.wells : 0.0F;
    const float mean = seen < full_enough ? seen : full_enough;
    light[i] = mean + std::sqrt(mean * gain.shot + gain.read) * deviate[i];
  }
}

}  // namespace

LiveSensor::LiveSensor(const MadeSensor& sensor) : sensor_(sensor) {
  static_cast<void>(light_of_code(sensor, 0));  // checks it
  for (std::size_t i = 0; i < deviates; ++i) {
    deviates_.push_back(static_cast<float>(normal_deviate(mixed_bits(sensor.seed, i))));
  }
  if (sensor.transfer == Transfer::linear) return;
  const int last = (1 << sensor.bits) - 1;
  int code = 0;
  for (int step = 0; step <= root_steps; ++step) {
    const double light = std::pow((step + 0.5) / root_steps, 2);
    const auto begins = [&](int next) {
      return decode(sensor.transfer, (next - 0.5 - sensor.pedestal) / (last - sensor.pedestal));
    };
    while (code < last && begins(code + 1) <= light) ++code;
    codes_.push_back(static_cast<std::uint16_t>(step == root_steps ? last : code));
  }
}

void LiveSensor::expose(const Image& radiance,
                        double exposure_s,
                        std::uint64_t number,
                        MadeShot& shot) const {
  if (radiance.empty()) throw std::invalid_argument("there is no picture to expose");
  if (!std::isfinite(exposure_s) || exposure_s <= 0) {
    throw std::invalid_argument("an exposure must be above 0 s");
  }
  shot.width = radiance.width;
  shot.height = radiance.height;
  shot.channels = radiance.channels;
  shot.bits = sensor_.bits;
  shot.codes.resize(radiance.pixels.size());
  const double read = sensor_.read_noise_e / sensor_.full_well_e;
  const Gain gain{static_cast<float>(exposure_s / sensor_.saturation),
                  static_cast<float>(1 / sensor_.full_well_e), static_cast<float>(read * read)};
  const auto last = static_cast<float>((1 << sensor_.bits) - 1);
  const auto pedestal = static_cast<float>(sensor_.pedestal);
  const float scale = last - pedestal;
  const std::uint64_t key = mixed_bits(sensor_.seed + 1, number);
  float light[run];
  for (std::size_t from = 0; from < shot.codes.size(); from += run) {
    const std::size_t count = std::min(run, shot.codes.size() - from);
    const std::size_t place = mixed_bits(key, from) % (deviates - run);
    gather(&radiance.pixels[from], &deviates_[place], gain, count, light);
    std::uint16_t* to = &shot.codes[from];
    if (codes_.empty()) {
      for (std::size_t i = 0; i < count; ++i) {
        const float code = pedestal + scale * light[i] + 0.5F;
        to[i] = static_cast<std::uint16_t>(std::clamp(code, 0.0F, last));
      }
    } else {
      for (std::size_t i = 0; i < count; ++i) {
        const float root = std::sqrt(std::clamp(light[i], 0.0F, 1.0F));
        to[i] = codes_[static_cast<std::size_t>(root * float{root_steps})];
      }
    }
  }
}

}  // namespace capture
