// UDP sockets.
#include "capture/made_gige_socket.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace capture::gige {
namespace {

constexpr std::size_t largest_command = 2048;

sockaddr_in native(Endpoint at) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(at.port);
  address.sin_addr.s_addr = htonl(at.address);
  return address;
}

}  // namespace

std::string text_of_address(std::uint32_t address) {
  return std::to_string(address >> 24U) + "." + std::to_string(address >> 16U & 0xffU) + "." +
         std::to_string(address >> 8U & 0xffU) + "." + std::to_string(address & 0xffU);
}

bool UdpSocket::open(Endpoint at, bool shared) {
  close();
  descriptor_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor_ < 0) {
    throw std::runtime_error(std::string("no UDP socket can be made: ") + std::strerror(errno));
  }
  const int on = 1;
  if (shared) ::setsockopt(descriptor_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  const int send_buffer = 4 << 20;
  ::setsockopt(descriptor_, SOL_SOCKET, SO_SNDBUF, &send_buffer, sizeof(send_buffer));
  const sockaddr_in address = native(at);
  if (::bind(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) {
    return true;
  }
  close();
  return false;
}

void UdpSocket::close() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

void UdpSocket::send(Endpoint to, ByteSpan packet) const {
  if (!is_open()) return;
  const sockaddr_in address = native(to);
  ::sendto(descriptor_, packet.data(), packet.size(), MSG_NOSIGNAL,
           reinterpret_cast<const sockaddr*>(&address), sizeof(address));
}

std::optional<Endpoint> UdpSocket::receive(Bytes& packet) const {
  if (!is_open()) return std::nullopt;
  packet.resize(largest_command);
  sockaddr_in from{};
  socklen_t size = sizeof(from);
  const ssize_t bytes = ::recvfrom(descriptor_, packet.data(), packet.size(), 0,
                                   reinterpret_cast<sockaddr*>(&from), &size);
  if (bytes < 0 || from.sin_family != AF_INET) return std::nullopt;
  packet.resize(static_cast<std::size_t>(bytes));
  return Endpoint{ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
}

void wait_for_packets(const UdpSocket& one, const UdpSocket& other, Time longest) {
  // poll leaves out negative descriptors.
  std::array<pollfd, 2> waiting{pollfd{one.descriptor(), POLLIN, 0},
                                pollfd{other.descriptor(), POLLIN, 0}};
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(longest);
  ::poll(waiting.data(), waiting.size(), static_cast<int>(ms.count()));
}

}  // namespace capture::gige
