// Shots of a scene that stands still, read for calibration: codes as they are.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/photon_transfer.h"
#include "capture/response.h"

namespace capture {

struct CalibrationShots {
  int width = 0;
  int height = 0;
  int channels = 3;  // 1 if all three are alike, or of a mosaic
  BayerPattern pattern = BayerPattern::none;
  int bits = 8;
  double full_code = 255;   // the code of value 1, as pictures are read
  bool compressed = false;  // JPEG: its codes are no sensor's
  std::vector<std::vector<std::uint16_t>> codes;
  std::vector<double> exposures_s;  // 0 = dark
  std::vector<std::string> warnings;

  std::vector<SensorShot> sensor_shots() const;
  // Eight bits of each; the first one of each exposure, dark ones left out.
  std::vector<CodedShot> coded_shots() const;
};

struct CalibrationShotOptions {
  std::vector<double> exposures_s;            // of the shots, in their order; empty = as they tell
  BayerPattern pattern = BayerPattern::none;  // of a mosaic in grey pictures, or read as colours
  int most_frames = 64;                       // of a recording
};

// Reads still files (PNG, TIFF and others of up to 16 bits, JPEG), or one URI of a recording
// ("replay:DIR"), whose damaged frames and those without an exposure are passed over. Throws
// std::runtime_error naming what could not be read, told no exposure, or has another size.
CalibrationShots read_calibration_shots(std::span<const std::string> inputs,
                                        const CalibrationShotOptions& options);

}  // namespace capture
