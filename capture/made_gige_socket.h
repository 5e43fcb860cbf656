// UDP sockets of a made GigE Vision camera on the loopback network.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "capture/frame.h"
#include "capture/gige_wire.h"

namespace capture::gige {

// Where a packet comes from or goes to, in the machine's byte order.
struct Endpoint {
  std::uint32_t address = 0;
  std::uint16_t port = 0;
  friend bool operator==(const Endpoint&, const Endpoint&) = default;
};

constexpr std::uint32_t broadcast_address = 0xffffffff;

std::string text_of_address(std::uint32_t address);

class UdpSocket {
 public:
  UdpSocket() = default;
  ~UdpSocket() { close(); }
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  // Port 0 is any free one; several may share one that is `shared`. Returns whether it was free.
  // Throws std::runtime_error if there are no sockets.
  bool open(Endpoint at, bool shared);
  void close();
  bool is_open() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }
  // What cannot be sent is lost, as on any network.
  void send(Endpoint to, ByteSpan packet) const;
  // The next packet that is there, into `packet`; nothing if there is none.
  std::optional<Endpoint> receive(Bytes& packet) const;

 private:
  int descriptor_ = -1;
};

// Waits until either has a packet, at most so long. Sockets that are not open are left out.
void wait_for_packets(const UdpSocket& one, const UdpSocket& other, Time longest);

}  // namespace capture::gige
