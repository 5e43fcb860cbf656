// GVCP and GVSP packets.
#include "capture/gige_wire.h"

#include <algorithm>
#include <stdexcept>

namespace capture::gige {
namespace {

constexpr std::size_t command_header = 8;
constexpr std::size_t stream_header = 8;
constexpr std::uint8_t command_key = 0x42;
constexpr std::uint16_t image_payload = 0x0001;
constexpr std::uint16_t with_chunks = 0x4000;

enum class Content : std::uint8_t { leader = 1, trailer = 2, payload = 3 };

void start(Bytes& packet,
           std::uint16_t block,
           Content content,
           std::uint32_t number,
           std::size_t data_bytes) {
  packet.assign(stream_header + data_bytes, 0);
  put16(packet.data() + 2, block);
  put32(packet.data() + 4, static_cast<std::uint32_t>(content) << 24U | (number & 0xffffffU));
}

}  // namespace

void put16(std::uint8_t* to, std::uint16_t value) {
  to[0] = static_cast<std::uint8_t>(value >> 8U);
  to[1] = static_cast<std::uint8_t>(value & 0xffU);
}

void put32(std::uint8_t* to, std::uint32_t value) {
  put16(to, static_cast<std::uint16_t>(value >> 16U));
  put16(to + 2, static_cast<std::uint16_t>(value & 0xffffU));
}

void put64(std::uint8_t* to, std::uint64_t value) {
  put32(to, static_cast<std::uint32_t>(value >> 32U));
  put32(to + 4, static_cast<std::uint32_t>(value & 0xffffffffU));
}

std::uint16_t get16(const std::uint8_t* from) {
  return static_cast<std::uint16_t>(from[0] << 8U | from[1]);
}

std::uint32_t get32(const std::uint8_t* from) {
  return static_cast<std::uint32_t>(get16(from)) << 16U | get16(from + 2);
}

std::uint64_t get64(const std::uint8_t* from) {
  return static_cast<std::uint64_t>(get32(from)) << 32U | get32(from + 4);
}

std::optional<Command> parse_command(ByteSpan packet) {
  if (packet.size() < command_header || packet[0] != command_key) return std::nullopt;
  const std::size_t size = get16(packet.data() + 4);
  if (packet.size() < command_header + size) return std::nullopt;
  return Command{static_cast<CommandCode>(get16(packet.data() + 2)), (packet[1] & 1U) != 0,
                 get16(packet.data() + 6), packet.subspan(command_header, size)};
}

Bytes answer(const Command& command, Status status, ByteSpan data) {
  Bytes packet(command_header + data.size());
  put16(packet.data(), static_cast<std::uint16_t>(status));
  put16(packet.data() + 2,
        static_cast<std::uint16_t>(static_cast<std::uint16_t>(command.code) + 1));
  put16(packet.data() + 4, static_cast<std::uint16_t>(data.size()));
  put16(packet.data() + 6, command.id);
  std::ranges::copy(data, packet.begin() + command_header);
  return packet;
}

PacketCutter::PacketCutter(std::uint16_t block,
                           const Leader& leader,
                           ByteSpan payload,
                           std::size_t packet_bytes)
    : block_(block), leader_(leader), payload_(payload) {
  if (packet_bytes <= packet_overhead) throw std::invalid_argument("packets hold no data");
  data_bytes_ = packet_bytes - packet_overhead;
  data_packets_ = static_cast<std::uint32_t>((payload.size() + data_bytes_ - 1) / data_bytes_);
}

void PacketCutter::cut(std::uint32_t number, Bytes& packet) const {
  if (number == 0) {
    start(packet, block_, Content::leader, 0, 36);
    std::uint8_t* const data = packet.data() + stream_header;
    put16(data + 2, leader_.has_chunks ? image_payload | with_chunks : image_payload);
    put64(data + 4, leader_.ticks);
    put32(data + 12, leader_.pixel_format);
    put32(data + 16, leader_.width);
    put32(data + 20, leader_.height);
    put32(data + 24, leader_.x);
    put32(data + 28, leader_.y);
  } else if (number <= data_packets_) {
    const std::size_t from = (number - 1) * data_bytes_;
    const ByteSpan part = payload_.subspan(from, std::min(data_bytes_, payload_.size() - from));
    start(packet, block_, Content::payload, number, part.size());
    std::ranges::copy(part, packet.begin() + stream_header);
  } else {
    start(packet, block_, Content::trailer, number, 8);
    put16(packet.data() + stream_header + 2,
          leader_.has_chunks ? image_payload | with_chunks : image_payload);
    put32(packet.data() + stream_header + 4, leader_.height);
  }
}

}  // namespace capture::gige
