// What a v4l2: URI asks of a camera, and the mode of the camera that answers it best.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/camera_settings.h"
#include "capture/v4l2_device.h"

namespace capture {

struct V4l2Request {
  std::string device;  // "/dev/video0", or a bus: "usb-0000:00:14.0-1"
  std::optional<std::uint32_t> fourcc;
  std::optional<PictureSize> size;
  std::optional<Rational> rate;
  std::vector<std::pair<std::string, std::int64_t>> controls;  // set in this order
};

// Of what follows v4l2: in
//
//     v4l2:/dev/video0?format=YUYV&size=640x480&rate=30&auto_exposure=1&exposure_time_absolute=80
//
// A rate is a whole number, a decimal one, or a fraction (30000/1001). Every other key is a
// control of the device by its name. Throws std::runtime_error with the reason and an example,
// without the URI.
V4l2Request parse_v4l2(std::string_view rest);

struct V4l2Choice {
  std::uint32_t fourcc = 0;
  PictureSize size;
  std::optional<Rational> rate;  // nothing: the device does not tell its rates
};

// The mode to use. What the request leaves open: the largest picture of at most 1920x1080 at 24/s
// or more (if there is none, the fastest), the earliest format of pixel_codings(), and its highest
// rate. Throws std::runtime_error, without the device's name, with what was asked and what the
// device has.
V4l2Choice choose_mode(const V4l2Device& device, const V4l2Request& request);

// The control of this name, if it can be set to `value` now. Throws std::runtime_error, without the
// device's name, with what is possible.
const V4l2Control& control_for(const V4l2Device& device,
                               const std::string& name,
                               std::int64_t value);

// All sizes of a mode: "640x480", "2x2 to 1920x1080".
std::string sizes_of(const V4l2Mode& mode);
// All rates: "30, 15/s", "1 to 60/s".
std::string rates_of(const V4l2Mode& mode);

}  // namespace capture
