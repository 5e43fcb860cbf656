// The least application that can read a GigE Vision camera: what made cameras are tested with.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/gige_wire.h"
#include "capture/made_gige_description.h"
#include "capture/made_gige_socket.h"

namespace made {

using capture::gige::Bytes;
using capture::gige::CommandCode;
using capture::gige::Status;
using std::chrono_literals::operator""s;
using std::chrono_literals::operator""ms;

constexpr std::uint32_t here = 127U << 24U | 1U;

inline std::uint32_t address_of(const std::string& text) {
  std::uint32_t address = 0;
  std::uint32_t part = 0;
  for (const char c : text + ".") {
    if (c != '.') {
      part = part * 10 + static_cast<std::uint32_t>(c - '0');
    } else {
      address = address << 8U | part;
      part = 0;
    }
  }
  return address;
}

// A frame as its packets came.
struct ClientFrame {
  std::uint16_t block = 0;
  std::uint64_t ticks = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t pixel_format = 0;
  bool has_chunks = false;
  std::map<std::uint32_t, Bytes> packets;  // of data, by their numbers
  Bytes payload() const {
    Bytes all;
    for (const auto& [number, data] : packets) all.insert(all.end(), data.begin(), data.end());
    return all;
  }
};

class GigeClient {
 public:
  explicit GigeClient(const std::string& camera) : camera_{address_of(camera), 3956} {
    control_.open({here, 0}, false);
    stream_.open({here, stream_port}, false);
    while (!stream_.is_open()) stream_.open({here, ++stream_port}, false);
  }

  // The answer's status and data; nothing if none came.
  std::optional<std::pair<Status, Bytes>> ask(CommandCode code, const Bytes& data) {
    Bytes packet(8 + data.size());
    packet[0] = 0x42;
    packet[1] = 1;
    capture::gige::put16(&packet[2], static_cast<std::uint16_t>(code));
    capture::gige::put16(&packet[4], static_cast<std::uint16_t>(data.size()));
    capture::gige::put16(&packet[6], ++id_);
    std::copy(data.begin(), data.end(), packet.begin() + 8);
    control_.send(camera_, packet);
    const auto end = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < end) {
      Bytes answer;
      if (!control_.receive(answer)) {
        capture::gige::wait_for_packets(control_, {}, 20ms);
        continue;
      }
      if (answer.size() < 8 || capture::gige::get16(&answer[6]) != id_) continue;
      return std::pair{static_cast<Status>(capture::gige::get16(answer.data())),
                       Bytes(answer.begin() + 8, answer.end())};
    }
    return std::nullopt;
  }

  Status write(std::uint32_t address, std::uint32_t value) {
    Bytes data(8);
    capture::gige::put32(data.data(), address);
    capture::gige::put32(data.data() + 4, value);
    const auto answer = ask(CommandCode::write_register, data);
    return answer ? answer->first : Status::not_implemented;
  }

  Status write_real(std::uint32_t address, double value) {
    Bytes data(12);
    capture::gige::put32(data.data(), address);
    capture::gige::put64(data.data() + 4, std::bit_cast<std::uint64_t>(value));
    const auto answer = ask(CommandCode::write_memory, data);
    return answer ? answer->first : Status::not_implemented;
  }

  std::optional<Bytes> read(std::uint32_t address, std::uint16_t size) {
    Bytes data(8);
    capture::gige::put32(data.data(), address);
    capture::gige::put16(data.data() + 6, size);
    const auto answer = ask(CommandCode::read_memory, data);
    if (!answer || answer->first != Status::success) return std::nullopt;
    return Bytes(answer->second.begin() + 4, answer->second.end());
  }

  std::uint32_t value(std::uint32_t address) {
    const auto bytes = read(address, 4);
    return bytes ? capture::gige::get32(bytes->data()) : 0;
  }

  double real(std::uint32_t address) {
    const auto bytes = read(address, 8);
    return bytes ? std::bit_cast<double>(capture::gige::get64(bytes->data())) : -1;
  }

  void start() {
    namespace at = capture::gige::at;
    EXPECT_EQ(write(at::control_privilege, 2), Status::success);
    EXPECT_EQ(write(at::stream_address, here), Status::success);
    EXPECT_EQ(write(at::stream_port, stream_port), Status::success);
    EXPECT_EQ(write(at::stream_packet_size, 1400), Status::success);
    EXPECT_EQ(write(capture::gige::feature::acquisition, 1), Status::success);
  }

  void ask_again(std::uint16_t block, std::uint32_t first, std::uint32_t last) {
    Bytes packet(20);
    packet[0] = 0x42;
    capture::gige::put16(&packet[2], static_cast<std::uint16_t>(CommandCode::packet_resend));
    capture::gige::put16(&packet[4], 12);
    capture::gige::put16(&packet[6], ++id_);
    capture::gige::put32(&packet[8], block);
    capture::gige::put32(&packet[12], first);
    capture::gige::put32(&packet[16], last);
    control_.send(camera_, packet);
  }

  // The next packet of the stream; nothing if none comes.
  std::optional<Bytes> packet(capture::Time longest = patience) {
    const auto end = std::chrono::steady_clock::now() + longest;
    while (std::chrono::steady_clock::now() < end) {
      Bytes packet;
      // Cameras of other tests may still send to this port.
      if (const auto from = stream_.receive(packet)) {
        if (from->address == camera_.address) return packet;
        continue;
      }
      capture::gige::wait_for_packets(stream_, {}, 20ms);
    }
    return std::nullopt;
  }

  // The next frame whose leader and trailer come.
  std::optional<ClientFrame> frame() {
    ClientFrame frame;
    while (const auto bytes = packet()) {
      const std::uint8_t* const data = bytes->data();
      const std::uint16_t block = capture::gige::get16(data + 2);
      if (data[4] == 1) {
        frame = {block,
                 capture::gige::get64(data + 12),
                 capture::gige::get32(data + 24),
                 capture::gige::get32(data + 28),
                 capture::gige::get32(data + 20),
                 (capture::gige::get16(data + 10) & 0x4000U) != 0,
                 {}};
      } else if (block == frame.block && data[4] == 3) {
        frame.packets[capture::gige::get32(data + 4) & 0xffffffU] =
            Bytes(bytes->begin() + 8, bytes->end());
      } else if (block == frame.block && frame.block != 0) {
        return frame;
      }
    }
    return std::nullopt;
  }

  static constexpr capture::Time patience = 20s;
  std::uint16_t stream_port = 20000;

 private:
  capture::gige::Endpoint camera_;
  capture::gige::UdpSocket control_;
  capture::gige::UdpSocket stream_;
  std::uint16_t id_ = 0;
};

}  // namespace made
