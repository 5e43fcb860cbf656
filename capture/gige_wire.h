// GigE Vision as it goes over the wire: control (GVCP) and stream (GVSP) packets of version 1.2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace capture::gige {

constexpr std::uint16_t control_port = 3956;
// IP, UDP and GVSP headers: what a packet size counts beyond the picture's bytes.
constexpr std::size_t packet_overhead = 20 + 8 + 8;

using Bytes = std::vector<std::uint8_t>;
using ByteSpan = std::span<const std::uint8_t>;

// Numbers are big-endian everywhere.
void put16(std::uint8_t* to, std::uint16_t value);
void put32(std::uint8_t* to, std::uint32_t value);
void put64(std::uint8_t* to, std::uint64_t value);
std::uint16_t get16(const std::uint8_t* from);
std::uint32_t get32(const std::uint8_t* from);
std::uint64_t get64(const std::uint8_t* from);

enum class CommandCode : std::uint16_t {
  discovery = 0x0002,
  packet_resend = 0x0040,
  read_register = 0x0080,
  write_register = 0x0082,
  read_memory = 0x0084,
  write_memory = 0x0086,
};

enum class Status : std::uint16_t {
  success = 0,
  not_implemented = 0x8001,
  invalid_parameter = 0x8002,
  invalid_address = 0x8003,
  write_protect = 0x8004,
  access_denied = 0x8006,
};

// What an application asks of a device.
struct Command {
  CommandCode code{};
  bool wants_answer = false;
  std::uint16_t id = 0;
  ByteSpan data;  // within the packet
};
// Nothing if the packet is none.
std::optional<Command> parse_command(ByteSpan packet);

// The answer to a command: its code is one more.
Bytes answer(const Command& command, Status status, ByteSpan data);

// Where the registers are that every device has (GigE Vision 1.2, section 28).
namespace at {
constexpr std::uint32_t version = 0x0000;
constexpr std::uint32_t device_mode = 0x0004;
constexpr std::uint32_t mac_high = 0x0008;
constexpr std::uint32_t mac_low = 0x000c;
constexpr std::uint32_t ip_configuration = 0x0014;
constexpr std::uint32_t ip_address = 0x0024;
constexpr std::uint32_t subnet_mask = 0x0034;
constexpr std::uint32_t manufacturer = 0x0048;  // 32 bytes
constexpr std::uint32_t model = 0x0068;         // 32 bytes
constexpr std::uint32_t device_version = 0x0088;
constexpr std::uint32_t serial = 0x00d8;  // 16 bytes
constexpr std::uint32_t discovery_end = 0x00f8;
constexpr std::uint32_t description_url = 0x0200;  // 512 bytes
constexpr std::uint32_t network_interfaces = 0x0600;
constexpr std::uint32_t stream_channels = 0x0904;
constexpr std::uint32_t capability = 0x0934;
constexpr std::uint32_t heartbeat_timeout_ms = 0x0938;
constexpr std::uint32_t tick_frequency = 0x093c;  // 64 bits
constexpr std::uint32_t control_privilege = 0x0a00;
constexpr std::uint32_t stream_port = 0x0d00;
constexpr std::uint32_t stream_packet_size = 0x0d04;
constexpr std::uint32_t stream_address = 0x0d18;
}  // namespace at

// What the leader of a picture tells.
struct Leader {
  std::uint64_t ticks = 0;
  std::uint32_t pixel_format = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t x = 0;
  std::uint32_t y = 0;
  bool has_chunks = false;
};

// A frame cut into packets: number 0 is the leader, the last one the trailer.
class PacketCutter {
 public:
  // `packet_bytes` as the register has it, with all headers.
  PacketCutter(std::uint16_t block,
               const Leader& leader,
               ByteSpan payload,
               std::size_t packet_bytes);

  std::uint32_t count() const { return data_packets_ + 2; }
  // Replaces what is in `packet`. `number` is below count().
  void cut(std::uint32_t number, Bytes& packet) const;

 private:
  std::uint16_t block_;
  Leader leader_;
  ByteSpan payload_;
  std::size_t data_bytes_;  // of each packet but the last
  std::uint32_t data_packets_;
};

}  // namespace capture::gige
