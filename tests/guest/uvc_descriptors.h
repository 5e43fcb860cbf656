// What a made USB camera says of itself: USB Device Class Definition for Video Devices 1.0a.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "tests/guest/usb_ip.h"
#include "tests/guest/uvc_picture.h"

namespace made {

struct UvcSize {
  int width;
  int height;
};

inline constexpr std::array<UvcSize, 2> uvc_sizes{{{160, 120}, {320, 240}}};
// Of each size, in units of 100 ns: 30 and 15 frames a second.
inline constexpr std::array<std::uint32_t, 2> uvc_intervals{333333, 666666};
inline constexpr std::uint8_t uvc_streaming_endpoint = 1;
inline constexpr std::uint32_t uvc_payload_bytes = 16384;  // with its header

// Numbers of the terminal with the exposure's controls, and of the interfaces.
inline constexpr std::uint8_t uvc_camera_terminal = 1;
inline constexpr std::uint8_t uvc_control_interface = 0;
inline constexpr std::uint8_t uvc_streaming_interface = 1;

// A mode that the host chooses: numbers from 1, as in the descriptors.
struct UvcMode {
  UvcFormat format = UvcFormat::yuyv;
  std::uint8_t size = 1;
  std::uint32_t interval = uvc_intervals[0];

  UvcSize pixels() const { return uvc_sizes[size - 1U]; }
};

// Of GET_DESCRIPTOR, by the setup's value; nothing if there is none.
std::optional<Bytes> uvc_descriptor(std::uint16_t value, const std::string& name);

// The 26 bytes of a probe or a commit, and back. Numbers that there are not become the nearest ones
// that there are.
Bytes uvc_probe(const UvcMode& mode);
UvcMode uvc_mode(const Bytes& probe);

// Appends a number, little end first.
void append(Bytes& bytes, std::uint32_t number, int count);
// Reads one; 0 beyond the end.
std::uint32_t number_at(const Bytes& bytes, std::size_t at, int count);

}  // namespace made
