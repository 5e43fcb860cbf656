// A picture's light in a few values, to compare frames by.
#pragma once

#include <cstddef>
#include <vector>

#include "capture/hdr.h"
#include "capture/image.h"

namespace capture {

// A few linear values of a picture, (rows, columns, channels), 1 = saturated. The first and the
// last row hold those of the picture, so that a picture that changes its exposure somewhere shows
// it in one of them, whole. Values that are not finite count as not taken.
struct Thumbnail {
  int rows = 0;
  int columns = 0;
  int channels = 3;
  std::vector<float> values;
  float edge_variance = 1;  // the noise of the first and the last row is so many times the others'

  std::size_t row_size() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(channels);
  }
};

// The means of rows x columns cells; fewer where the picture has fewer pixels. So dark pictures, in
// which no pixel rises above the noise, tell their exposure all the same. Cells of the first and
// the last row are one pixel high, so that a border between two exposures is never within them. A
// mean of saturated and other pixels follows no exposure, and is no value (NaN). Throws
// std::invalid_argument for an empty picture, or rows or columns below 1.
Thumbnail thumbnail_of(const Image& image,
                       int rows = 16,
                       int columns = 16,
                       double saturation = NoiseModel{}.saturation);
// The noise of such values (but those of the edges), where `noise` is that of the picture's pixels.
NoiseModel noise_of_thumbnail(
    const NoiseModel& noise, int width, int height, int rows = 16, int columns = 16);

}  // namespace capture
