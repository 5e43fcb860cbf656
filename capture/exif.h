// How a still was taken, from its EXIF data.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace capture {

// What a camera wrote beside the picture; 0 where it did not.
struct ShotSettings {
  double exposure_s = 0;  // as marked on the camera: 1/80, 13
  double f_number = 0;
  double iso = 0;
};

// The settings in a JPEG file's bytes. A file without EXIF gives zeros; so do values that are not
// positive numbers.
ShotSettings shot_settings(std::span<const std::byte> file_bytes);

// The exposure that is really meant by a marked one. Cameras step by thirds (or halves) of a stop
// and round what they show: 1/80 is 2^(-19/3) = 1/80.6 s, 13 s is 12.7 s, 1/30 is 1/32 s. A time
// that is no such mark (within 0.5 %) comes back as it is, since phones and machine-vision cameras
// state theirs exactly. Throws std::invalid_argument unless marked_s > 0.
double snapped_exposure_s(double marked_s);

// The light that reaches the sensor's codes, relative to f/1 at ISO 100 for one second:
// exposure_s / f_number^2 * iso / 100, where unknown f-number and ISO count as 1 and 100. The
// f-number is snapped to thirds of a stop as well (f/5.6 is 2^2.5).
double exposure_value(const ShotSettings& settings);

// The snapped exposure time of a file. Throws std::runtime_error with path and reason if the file
// cannot be read or tells none.
double exposure_s_of(const std::string& path);

}  // namespace capture
