// Radiance pictures (.hdr, .pic): three mantissas with a common exponent.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "capture/image.h"

namespace capture {

using Rgbe = std::array<std::uint8_t, 4>;

// The encoding of one colour: mantissas are cut off, and decoding adds half a step, as Radiance
// does, so that the mean of many pixels is unbiased (other readers are darker by up to 0.4 %).
// Relative error of the largest channel at most 1/256. Negative values become 0; values beyond the
// format's 1.7e38 its largest; NaN counts as 0.
Rgbe rgbe_from_radiance(float r, float g, float b);
std::array<float, 3> radiance_from_rgbe(Rgbe rgbe);

// Reads flat, old and new run-length encoded pictures, RGBE and XYZE, in all eight orientations.
// Returns (height, width, 3), upright, linear Rec.709: EXPOSURE= and COLORCORR= are divided out,
// and PRIMARIES= converted. Throws std::runtime_error with path and reason for a missing, damaged
// or truncated file, a side over 16,384 pixels, an image over `max_image_bytes`, or a GAMMA= other
// than 1.
Image read_rgbe(const std::string& path, std::size_t max_image_bytes = std::size_t{2} << 30);

// Writes (height, width, 3), run-length encoded where the format allows. Throws
// std::invalid_argument for another number of channels, or a value that is not finite;
// std::runtime_error with path and reason if it cannot be written.
void write_rgbe(const std::string& path, const Image& image);

}  // namespace capture
