// Shots of a made GigE camera that tell what they are.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "capture/made_gige.h"

namespace made {

// Codes of 12 bits: the shot's number in the first pixel, its exposure in units of 10 us in the
// second, a hundred times its gain in the third, and a pattern behind them.
inline capture::MadeShot telling_shot(const capture::MadeGigeShot& shot, int width, int height) {
  capture::MadeShot made{width, height, 1, 12,
                         std::vector<std::uint16_t>(static_cast<std::size_t>(width) *
                                                    static_cast<std::size_t>(height))};
  for (std::size_t i = 0; i < made.codes.size(); ++i) {
    made.codes[i] =
        static_cast<std::uint16_t>((i * 37 + static_cast<std::size_t>(shot.number)) % 4096);
  }
  made.codes[0] = static_cast<std::uint16_t>(shot.number % 4096);
  made.codes[1] = static_cast<std::uint16_t>(std::lround(shot.exposure_s * 1e5));
  made.codes[2] = static_cast<std::uint16_t>(std::lround(shot.gain * 100));
  return made;
}

}  // namespace made
