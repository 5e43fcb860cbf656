// Made sound: a quiet room and a clap at a stated instant.
#pragma once

#include <cstdint>

#include "capture/camera.h"

namespace capture {

struct MadeSoundSettings {
  int rate = 48000;  // samples per second
  double length_s = 1;
  double clap_s = 0.5;  // when the clap begins: its first sample is its loudest
  std::uint64_t seed = 1;
};

// One channel from time 0 on: noise at -60 dB of full scale and a clap that dies away in some 20
// ms. Throws std::invalid_argument if rate or length are not above 0.
Sound make_clap(const MadeSoundSettings& settings);

}  // namespace capture
