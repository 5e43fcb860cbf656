// What the kernel lets through to the stream of a GigE Vision camera.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

namespace capture {

// What a camera's packets may be.
struct GvspLimits {
  std::uint32_t address = 0;      // of the camera, IPv4 in the machine's byte order
  std::size_t payload_bytes = 0;  // of a picture's buffer
  std::size_t packet_bytes = 0;   // the largest, with all headers
};

// Smaller packets cannot hold what a leader tells.
constexpr std::size_t least_gvsp_packet = 128;

// Has the kernel drop datagrams of this UDP socket that are not packets of such a camera's
// pictures, and those that wait there already. What passes, and nothing else, is sent by the
// address and is
//   - a leader: number 0, whole, of a picture or of chunks;
//   - data: numbers 1 to as many packets as the payload fills;
//   - a trailer: at most one more than that;
// with block ids of 16 or 64 bits (GigE Vision 2.0, GVSP). All else is what libaravis 0.8.26 does
// not check: numbers beyond the buffer, parts whose lengths add up to more than memory, headers
// that are cut off. Throws std::invalid_argument if a packet is below least_gvsp_packet or there is
// no payload, std::runtime_error if the kernel takes no filter.
void filter_gvsp(int socket, const GvspLimits& limits);

// The descriptor of this process's UDP socket that is bound there, IPv4 in the machine's byte
// order. Nothing if there is none, or /proc is not there.
std::optional<int> udp_socket_at(std::uint32_t address, std::uint16_t port);

}  // namespace capture
