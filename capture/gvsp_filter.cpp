// A classic BPF program for the packets of one GigE Vision camera.
#include "capture/gvsp_filter.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <linux/filter.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace capture {
namespace {

// In an IPv4 header.
constexpr auto sender = static_cast<std::uint32_t>(SKF_NET_OFF) + 12;
// In what a filter of a UDP socket sees, which begins with that header.
constexpr std::uint32_t udp_header = 8;
constexpr std::uint32_t format_at = udp_header + 4;
constexpr std::uint32_t extended_ids = 0x80;  // in the format
constexpr std::uint32_t ip_and_udp = 28;
constexpr std::uint32_t leader_bytes = 36;  // of a picture, behind the header
constexpr std::uint32_t payload_type_in_leader = 2;
constexpr std::uint32_t payload_type_mask = 0x3fff;  // without the bit for chunks
constexpr std::uint32_t most_numbers = 0xffffff;     // of 24 bits

enum class Content : std::uint32_t { leader = 1, trailer = 2, payload = 3 };
enum class Payload : std::uint32_t { image = 1, chunks = 4, image_with_chunks = 5 };

// Where a header has its packet number.
struct Header {
  std::uint32_t bytes;
  std::uint32_t number_at;
  std::uint32_t number_mask;
};
constexpr Header short_header{8, format_at, 0xffffff};
constexpr Header long_header{20, udp_header + 16, 0xffffffff};

// Instructions of which each loads, tests or returns.
class Program {
 public:
  void load_word(std::uint32_t at) { add(BPF_LD | BPF_W | BPF_ABS, at); }
  void load_half(std::uint32_t at) { add(BPF_LD | BPF_H | BPF_ABS, at); }
  void load_byte(std::uint32_t at) { add(BPF_LD | BPF_B | BPF_ABS, at); }
  void load_length() { add(BPF_LD | BPF_W | BPF_LEN, 0); }
  void mask(std::uint32_t bits) { add(BPF_ALU | BPF_AND | BPF_K, bits); }
  void accept() { add(BPF_RET | BPF_K, 0xffffffff); }
  void drop() { add(BPF_RET | BPF_K, 0); }
  // The next instruction is run only if, or unless, what was loaded is so.
  void if_equal(std::uint32_t value) { add(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 1); }
  void unless_equal(std::uint32_t value) { add(BPF_JMP | BPF_JEQ | BPF_K, value, 1, 0); }
  void if_above(std::uint32_t value) { add(BPF_JMP | BPF_JGT | BPF_K, value, 0, 1); }
  void unless_least(std::uint32_t value) { add(BPF_JMP | BPF_JGE | BPF_K, value, 1, 0); }
  // What follows, up to the matching end(), is run only if what was loaded is so.
  std::size_t begin_if_equal(std::uint32_t value) {
    return add(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 0);
  }
  std::size_t begin_if_has(std::uint32_t bits) {
    return add(BPF_JMP | BPF_JSET | BPF_K, bits, 0, 0);
  }
  void end(std::size_t begin) {
    code_[begin].jf = static_cast<std::uint8_t>(code_.size() - begin - 1);
  }

  void attach(int socket) {
    const sock_fprog program{static_cast<unsigned short>(code_.size()), code_.data()};
    if (::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof(program)) != 0) {
      throw std::runtime_error(std::string("the kernel takes no filter: ") + std::strerror(errno));
    }
  }

 private:
  std::size_t add(int code, std::uint32_t value, std::uint8_t if_true = 0, std::uint8_t other = 0) {
    code_.push_back({static_cast<std::uint16_t>(code), if_true, other, value});
    return code_.size() - 1;
  }

  std::vector<sock_filter> code_;
};

void add_numbers(Program& program, const Header& header, std::uint32_t most) {
  program.load_word(header.number_at);
  program.mask(header.number_mask);
  program.if_equal(0);
  program.drop();
  program.if_above(most);
  program.drop();
  program.accept();
}

// Of packets with one kind of header; ends with what drops the others.
void add_packets(Program& program, const Header& header, const GvspLimits& limits) {
  const std::size_t data = limits.packet_bytes - ip_and_udp - header.bytes;
  const auto packets = static_cast<std::uint32_t>(
      std::min<std::size_t>((limits.payload_bytes + data - 1) / data, most_numbers - 1));
  program.load_length();
  program.unless_least(udp_header + header.bytes);
  program.drop();

  program.load_byte(format_at);
  program.mask(~extended_ids & 0xff);
  std::size_t begin = program.begin_if_equal(static_cast<std::uint32_t>(Content::payload));
  add_numbers(program, header, packets);
  program.end(begin);
  begin = program.begin_if_equal(static_cast<std::uint32_t>(Content::trailer));
  add_numbers(program, header, packets + 1);
  program.end(begin);

  program.unless_equal(static_cast<std::uint32_t>(Content::leader));
  program.drop();
  program.load_word(header.number_at);
  program.mask(header.number_mask);
  program.unless_equal(0);
  program.drop();
  program.load_length();
  program.unless_least(udp_header + header.bytes + leader_bytes);
  program.drop();
  program.load_half(udp_header + header.bytes + payload_type_in_leader);
  program.mask(payload_type_mask);
  for (const Payload type : {Payload::image, Payload::chunks, Payload::image_with_chunks}) {
    program.if_equal(static_cast<std::uint32_t>(type));
    program.accept();
  }
  program.drop();
}

}  // namespace

void filter_gvsp(int socket, const GvspLimits& limits) {
  if (limits.packet_bytes < least_gvsp_packet || limits.payload_bytes == 0) {
    throw std::invalid_argument("packets of " + std::to_string(limits.packet_bytes) +
                                " bytes for pictures of " + std::to_string(limits.payload_bytes));
  }
  Program program;
  program.load_word(sender);
  program.unless_equal(limits.address);
  program.drop();
  program.load_byte(format_at);
  const std::size_t begin = program.begin_if_has(extended_ids);
  add_packets(program, long_header, limits);
  program.end(begin);
  add_packets(program, short_header, limits);

  // Nothing may come between what is taken out and the first packet that was looked at.
  Program nothing;
  nothing.drop();
  nothing.attach(socket);
  std::uint8_t byte = 0;
  while (::recv(socket, &byte, 1, MSG_DONTWAIT) >= 0 || errno == EINTR) {
  }
  program.attach(socket);
}

std::optional<int> udp_socket_at(std::uint32_t address, std::uint16_t port) {
  std::error_code error;
  for (std::filesystem::directory_iterator files("/proc/self/fd", error), end;
       !error && files != end; files.increment(error)) {
    const std::string name = files->path().filename();
    int descriptor = -1;
    std::from_chars(name.data(), name.data() + name.size(), descriptor);
    int protocol = 0;
    socklen_t size = sizeof(protocol);
    if (::getsockopt(descriptor, SOL_SOCKET, SO_PROTOCOL, &protocol, &size) != 0 ||
        protocol != IPPROTO_UDP) {
      continue;
    }
    sockaddr_in bound{};
    size = sizeof(bound);
    if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&bound), &size) == 0 &&
        bound.sin_family == AF_INET && ntohl(bound.sin_addr.s_addr) == address &&
        ntohs(bound.sin_port) == port) {
      return descriptor;
    }
  }
  return std::nullopt;
}

}  // namespace capture
