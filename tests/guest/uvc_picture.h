// The pictures of made USB cameras: each tells its number and its exposure.
//
// Top quarter: the number as sixteen black (0) or white (1) bars, highest bit first. Middle: grey,
// of light (x + 1/2) / width * exposure / uvc_normal_exposure, at most 1. Bottom quarter: four
// patches of colour, always the same.
#pragma once

#include <array>
#include <cstdint>

#include "capture/image.h"
#include "tests/guest/usb_ip.h"

namespace made {

enum class UvcFormat { yuyv = 1, mjpeg = 2, grey = 3 };  // by their numbers in the descriptors

inline constexpr int uvc_normal_exposure = 100;  // in units of 100 us

struct UvcPicture {
  std::uint16_t number = 0;
  int exposure = uvc_normal_exposure;  // in units of 100 us
};

// The bytes of a picture as the camera sends them; the height is a multiple of 4. YUYV is BT.601 in
// limited range with the curve of Rec.1886; JPEG and grey are of full range.
Bytes coded(const UvcPicture& picture, UvcFormat format, int width, int height);

// The number that is seen in a decoded picture.
std::uint16_t seen_number(const capture::Image& image);
// The exposure that is seen, in units of 100 us, to 5 %.
double seen_exposure(const capture::Image& image);
// Linear light of the four patches; grey cameras see only their luma.
std::array<std::array<double, 3>, 4> uvc_patches(bool grey);
// The same, as seen in the middle of each.
std::array<std::array<double, 3>, 4> seen_patches(const capture::Image& image);

}  // namespace made
