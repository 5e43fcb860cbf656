// A made sensor: from radiance to the codes that a real camera would have delivered, with known
// noise.
#pragma once

#include <cstdint>
#include <vector>

#include "capture/colour.h"
#include "capture/hdr.h"
#include "capture/image.h"

namespace capture {

// A sensor whose every property is known. Each channel of each pixel is a site of its own.
//
// A site that sees `radiance` for `exposure_s` gathers, in the mean, full_well_e * radiance *
// exposure_s / saturation electrons; their number is a Poisson deviate. Reading adds Gaussian noise
// of read_noise_e. Black has code 0 plus `pedestal`; a full well has the last code. Between them
// the codes follow `transfer`. What falls outside is clipped, and codes are rounded to whole ones.
//
// So a linear sensor's codes have, away from the clips, the mean  pedestal + g n  and the variance
// g^2 (n + read_noise_e^2) + 1/12, with n the mean of electrons and g = (last - pedestal) /
// full_well_e codes per electron (where the noise is no less than half a code: it blurs the steps).
struct MadeSensor {
  double saturation = 1;       // radiance times seconds that fill the well, > 0
  double full_well_e = 20000;  // electrons, > 0
  double read_noise_e = 4;     // electrons, >= 0
  int bits = 8;                // 1 to 16
  double pedestal = 0;         // codes, below the last one
  Transfer transfer = Transfer::linear;
  std::uint64_t seed = 1;
};

// What came off a sensor: (height, width, channels), row by row, codes 0 .. 2^bits - 1.
struct MadeShot {
  int width = 0;
  int height = 0;
  int channels = 0;
  int bits = 0;
  std::vector<std::uint16_t> codes;
};

// The picture of `radiance` (any channels; negative or not finite counts as dark) exposed for
// exposure_s. The noise is that of shot number `shot`: the same number gives the same codes,
// another one independent noise. Throws std::invalid_argument for an empty picture, an exposure
// that is not > 0, or a sensor out of its ranges.
MadeShot expose(const MadeSensor& sensor,
                const Image& radiance,
                double exposure_s,
                std::uint64_t shot);

// The light that a code stands for, 0 = black, 1 = full well: what a reader with the right response
// makes of it.
double light_of_code(const MadeSensor& sensor, int code);

// The noise of a linear sensor's values, (code - pedestal) / (last code - pedestal): photons,
// reading and the rounding to codes. Throws std::invalid_argument for other transfers.
NoiseModel noise_of(const MadeSensor& sensor);

}  // namespace capture
