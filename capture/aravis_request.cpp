// aravis: URIs.
#include "capture/aravis_request.h"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace capture {
namespace {

[[noreturn]] void refuse(const std::string& why) {
  throw std::runtime_error(
      why +
      "; write aravis:NAME?format=Mono12&size=1024x1024&rate=60&exposure=0.005 with any of region, "
      "gain, packet_size, packet_delay, socket_buffer, packet_socket, resend, chunks, and GenICam "
      "features by their names (platelight devices lists the cameras)");
}

int whole_in(const CameraSetting& setting, int low, int high) {
  const auto value = number_in<int>(setting.value);
  if (!value || *value < low || *value > high) {
    refuse(setting.key + "=" + setting.value + " is no whole number from " + std::to_string(low) +
           " to " + std::to_string(high));
  }
  return *value;
}

double real_in(const CameraSetting& setting, double least) {
  const auto value = number_in<double>(setting.value);
  if (!value || !std::isfinite(*value) || *value < least) {
    refuse(setting.key + "=" + setting.value + " is no such number");
  }
  return *value;
}

std::array<int, 4> region_in(const CameraSetting& setting) {
  std::array<int, 4> region{};
  std::string_view rest = setting.value;
  for (std::size_t i = 0; i < region.size(); ++i) {
    const std::size_t comma = rest.find(',');
    const auto value = number_in<int>(rest.substr(0, comma));
    const bool ends_well = (comma == rest.npos) == (i == 3);
    if (!value || *value < (i < 2 ? 0 : 1) || !ends_well) {
      refuse("region=" + setting.value + " is not x,y,width,height");
    }
    region[i] = *value;
    rest.remove_prefix(comma == rest.npos ? rest.size() : comma + 1);
  }
  return region;
}

void take(const CameraSetting& setting, AravisRequest& request) {
  constexpr int largest = std::numeric_limits<int>::max();
  const auto& [key, value] = setting;
  if (key == "format") {
    if (value.empty()) refuse("format= is no format");
    request.format = value;
  } else if (key == "size") {
    request.size = size_in(value);
    if (!request.size) refuse("size=" + value + " is no size");
  } else if (key == "region") {
    request.region = region_in(setting);
  } else if (key == "rate") {
    request.rate = rate_in(value);
    if (!request.rate) refuse("rate=" + value + " is no rate in frames a second");
  } else if (key == "exposure") {
    request.exposure_s = real_in(setting, 1e-9);
  } else if (key == "gain") {
    request.gain = real_in(setting, -1e6);
  } else if (key == "packet_size") {
    request.packet_size = whole_in(setting, 220, 65507);
  } else if (key == "packet_delay") {
    request.packet_delay_ns = whole_in(setting, 0, largest);
  } else if (key == "socket_buffer") {
    request.socket_buffer = whole_in(setting, 4096, 1 << 30);
  } else if (key == "packet_socket") {
    request.packet_socket = whole_in(setting, 0, 1) != 0;
  } else if (key == "resend") {
    request.resend = whole_in(setting, 0, 1) != 0;
  } else if (key == "chunks") {
    request.chunks = whole_in(setting, 0, 1) != 0;
  } else if (key[0] >= 'A' && key[0] <= 'Z') {
    request.features.push_back(setting);
  } else {
    refuse("there is no setting " + key);
  }
}

}  // namespace

AravisRequest parse_aravis(std::string_view rest) {
  CameraSettings parsed;
  try {
    parsed = parse_settings(rest);
  } catch (const std::runtime_error& error) {
    refuse(error.what());
  }
  AravisRequest request;
  request.device = parsed.device;
  for (const CameraSetting& setting : parsed.settings) take(setting, request);
  if (request.size && request.region) refuse("size and region were both given");
  return request;
}

}  // namespace capture
