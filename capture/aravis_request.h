// What an aravis: URI asks of a camera.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/camera_settings.h"

namespace capture {

struct AravisRequest {
  std::string device;                   // id, part of one, serial or address; "" = the only one
  std::vector<CameraSetting> features;  // by their GenICam names, set first and in this order
  std::optional<std::string> format;    // "Mono12"
  std::optional<std::array<int, 4>> region;  // x, y, width, height on the sensor
  std::optional<PictureSize> size;           // in place of a region: in the sensor's middle
  std::optional<Rational> rate;
  std::optional<double> exposure_s;
  std::optional<double> gain;  // as the camera counts it, mostly dB
  std::optional<int> packet_size;
  std::optional<int> packet_delay_ns;
  std::optional<int> socket_buffer;   // bytes
  std::optional<bool> packet_socket;  // raw packets past the kernel's UDP
  bool resend = true;                 // asks for packets again that are missing
  bool chunks = true;                 // has the camera tell exposures with its frames, if it can
};

// Of what follows aravis: in
//
//     aravis:Vendor-Model-123?format=Mono12&size=1024x1024&rate=60&exposure=0.005&Gamma=1
//
// Keys that begin with a capital are features. Throws std::runtime_error with the reason and an
// example, without the URI.
AravisRequest parse_aravis(std::string_view rest);

}  // namespace capture
