// Pictures that were taken with a turned camera, turned upright.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "capture/crop.h"
#include "capture/image.h"

namespace capture {

// How a picture is turned: each in its turn, if at all.
struct Turn {
  bool transposed = false;  // rows become columns
  bool mirrored = false;    // left and right are exchanged
  bool upended = false;     // top and bottom are exchanged
  bool any() const { return transposed || mirrored || upended; }
  friend bool operator==(const Turn&, const Turn&) = default;
};

// The turn that a container's display matrix asks for: nine numbers as libav has them, so that
// (x, y) of the picture is shown at (m0 x + m3 y, m1 x + m4 y), y down. Its scale is not looked at;
// a matrix of zeros asks for none. Nothing if it is none of the eight turns of a rectangle, to a
// degree.
std::optional<Turn> turn_of_matrix(std::span<const std::int32_t, 9> matrix);

// In words, for people: "turned by 90 degrees clockwise".
std::string describe(const Turn& turn);

// Width and height of a turned picture, from those before.
std::array<int, 2> turned_size(const Turn& turn, int width, int height);

// The part of the picture before, of this size, that becomes `part` of the turned one.
Crop crop_before(const Turn& turn, const Crop& part, int width, int height);

// The image turned, into `to`, which is used again if it has the size; it is another one.
void turn_image(const Turn& turn, const Image& from, Image& to);

}  // namespace capture
