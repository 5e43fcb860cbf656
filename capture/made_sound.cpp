// A clap, made of noise that dies away.
#include "capture/made_sound.h"

#include <cmath>
#include <stdexcept>

#include "capture/counter_random.h"

namespace capture {
namespace {

constexpr double room_level = 0.001;  // root mean square
constexpr double clap_level = 0.25;
constexpr double decay_s = 0.004;

}  // namespace

Sound make_clap(const MadeSoundSettings& settings) {
  if (settings.rate < 1 || !(settings.length_s > 0)) {
    throw std::invalid_argument("a made sound needs a rate and a length above 0");
  }
  Sound sound;
  sound.channels = 1;
  sound.rate = settings.rate;
  const auto count = std::llround(settings.length_s * settings.rate);
  const auto clap = std::llround(settings.clap_s * settings.rate);
  sound.samples.reserve(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    double level = room_level;
    if (i >= clap) {
      level += clap_level * std::exp(-static_cast<double>(i - clap) / (decay_s * settings.rate));
    }
    const double noise = normal_deviate(mixed_bits(settings.seed, static_cast<std::uint64_t>(i)));
    // The clap opens with its loudest sample, so that its start can be told to the sample.
    const double value = i == clap ? 0.95 : std::fmin(std::fmax(level * noise, -0.9), 0.9);
    sound.samples.push_back(static_cast<float>(value));
  }
  return sound;
}

}  // namespace capture
