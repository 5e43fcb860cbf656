// The noise, black level and saturation of a linear sensor, from shots of a scene that stands
// still.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "capture/hdr.h"
#include "capture/raw.h"

namespace capture {

// One shot in the sensor's own codes: (height, width, channels), interleaved.
struct SensorShot {
  int width = 0;
  int height = 0;
  int channels = 1;                           // 1 or 3
  BayerPattern pattern = BayerPattern::none;  // of one channel
  std::span<const std::uint16_t> codes;       // right-aligned
  double exposure_s = 0;                      // 0 = dark: no light on the sensor
};

// A value and its standard deviation.
struct Estimate {
  double value = 0;
  double sigma = std::numeric_limits<double>::infinity();
};

// What one colour of a sensor is like. Codes follow  black + electrons / gain, up to saturation.
struct ChannelTransfer {
  Estimate gain;           // electrons per code
  Estimate black;          // codes
  Estimate read_noise;     // codes, without what rounding adds
  Estimate read_noise_e;   // electrons
  double saturation = 0;   // the code of a full well, or the last code
  double usable = 0;       // the highest code that is still linear to 2 % and never clipped
  bool saturated = false;  // whether the shots show saturation; else it is the last code
  // Codes against a straight line: the largest relative departure of the median, from 1/10 of the
  // range to the usable end; not finite if a single exposure leaves it open.
  double linearity_error = std::numeric_limits<double>::quiet_NaN();
};

struct PhotonTransfer {
  std::vector<ChannelTransfer> channels;  // one (grey), or red, green, blue
  std::vector<double> exposures_s;        // solved, in the shots' order
  std::vector<std::string> warnings;      // what to know before it is used

  // For linear values, black = 0, saturation = 1; of colours, the mean.
  NoiseModel noise() const;
};

// The shots are not those of a linear sensor: a response curve (response.h) is what they need.
class NotLinear : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Measures a linear sensor of 8 to 16 bits by the growth of its noise with light. Needs at least
// one exposure taken twice or more, and another exposure, or a dark shot; several exposures and a
// scene of many brightnesses make it exact. What moves is left out as long as it is a lesser part.
//
// The variance of light's shot noise is proportional to its mean; the slope is the gain, and what
// is left at black is the read noise. EMVA Standard 1288 Release 4.0, sections 2 and 6; Janesick,
// "Photon Transfer", SPIE Press 2007, chapter 5. Differences of shots of one exposure free the
// variance from the scene and from fixed pattern. We go without flat fields: blocks of 8 x 8 sites
// of any scene are points of the curve. Black and the true exposures are solved together from the
// blocks' means. Rounding's variance is taken off as it is where noise is small, not as 1/12.
//
// Deviations are of noise; `exposure_error` is how far exposure times may be off, relative.
// Throws std::invalid_argument for no shots, sizes that differ, or bits out of range; NotLinear if
// codes are not proportional to light or their variance does not grow with it; std::runtime_error
// with what to do if the shots are too few, all saturated or all dark.
PhotonTransfer measure_photon_transfer(std::span<const SensorShot> shots,
                                       int bits,
                                       double exposure_error = 0.01);

// The variance of rounded values less that of the values, 1/12 for a noise of half a code or more,
// for steps that lie anywhere between the values: the noise's variance from the seen one, codes^2.
double variance_before_rounding(double variance);

}  // namespace capture
