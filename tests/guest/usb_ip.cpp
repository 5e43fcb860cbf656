// USB/IP, the device's side: Linux's Documentation/usb/usbip_protocol.rst.
#include "tests/guest/usb_ip.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <thread>

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace made {
namespace {

constexpr const char* controller = "/sys/devices/platform/vhci_hcd.0/attach";
constexpr int high_speed = 3;
constexpr std::uint32_t device_id = 0x10002;  // bus 1, device 2: any will do
constexpr std::size_t header_words = 12;
constexpr std::uint32_t submit = 1;
constexpr std::uint32_t unlink_request = 2;
constexpr std::uint32_t submitted = 3;
constexpr std::uint32_t unlinked = 4;
constexpr std::uint32_t most_bytes = 1U << 20U;

using Header = std::array<std::uint32_t, header_words>;

std::uint32_t status_of(int error) { return static_cast<std::uint32_t>(-error); }

// Setup packets are in the order of USB, little end first, inside of the header.
UsbSetup setup_of(std::span<const std::uint8_t, 8> bytes) {
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
  };
  return {bytes[0], bytes[1], word(2), word(4), word(6)};
}

// A port is free again some time after its device was unplugged.
void attach(int port, int socket) {
  for (int tries = 0; tries < 200; ++tries) {
    std::ofstream file(controller);
    file << port << ' ' << socket << ' ' << device_id << ' ' << high_speed << std::flush;
    if (file.good()) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  throw std::runtime_error("no device can be plugged into port " + std::to_string(port) + " of " +
                           controller);
}

}  // namespace

UsbPlug::UsbPlug(int port) {
  std::array<int, 2> pair{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0) {
    throw std::system_error(errno, std::generic_category(), "socketpair");
  }
  socket_ = pair[1];
  try {
    attach(port, pair[0]);
  } catch (const std::runtime_error&) {
    ::close(pair[0]);
    ::close(pair[1]);
    throw;
  }
  ::close(pair[0]);  // the kernel has it
}

UsbPlug::~UsbPlug() { ::close(socket_); }

std::optional<UsbTransfer> UsbPlug::next(int longest_ms) {
  pollfd polled{socket_, POLLIN, 0};
  if (!open_ || ::poll(&polled, 1, longest_ms) <= 0) return std::nullopt;
  std::array<std::uint8_t, 4 * header_words> bytes{};
  if (!read(bytes)) return std::nullopt;
  Header header = std::bit_cast<Header>(bytes);
  std::ranges::transform(header, header.begin(), [](std::uint32_t word) { return ntohl(word); });
  if (header[0] == unlink_request) {
    give_back(header[1], header[5]);
    return std::nullopt;
  }
  UsbTransfer transfer;
  transfer.id = header[1];
  transfer.to_host = header[3] != 0;
  transfer.endpoint = header[4];
  transfer.length = header[6];
  transfer.setup = setup_of(std::span(bytes).last<8>());
  open_ = header[0] == submit && transfer.length <= most_bytes;
  if (!open_) return std::nullopt;
  if (!transfer.to_host) {
    transfer.sent.resize(transfer.length);
    if (!read(transfer.sent)) return std::nullopt;
  }
  if (transfer.endpoint == 0) return transfer;
  waiting_.push_back(std::move(transfer));
  return std::nullopt;
}

void UsbPlug::answer(const UsbTransfer& transfer, std::span<const std::uint8_t> bytes) {
  const auto sent = bytes.first(std::min<std::size_t>(bytes.size(), transfer.length));
  const auto count = transfer.to_host ? static_cast<std::uint32_t>(sent.size()) : transfer.length;
  write(Header{submitted, transfer.id, 0, 0, 0, 0, count}, sent);
}

void UsbPlug::refuse(const UsbTransfer& transfer) {
  write(Header{submitted, transfer.id, 0, 0, 0, status_of(EPIPE)}, {});
}

// The host does not want an answer any more; it is told whether there was still none.
void UsbPlug::give_back(std::uint32_t id, std::uint32_t taken_back) {
  const bool was_waiting = std::erase_if(waiting_, [&](const UsbTransfer& transfer) {
                             return transfer.id == taken_back;
                           }) > 0;
  write(Header{unlinked, id, 0, 0, 0, was_waiting ? status_of(ECONNRESET) : 0}, {});
}

bool UsbPlug::read(std::span<std::uint8_t> bytes) {
  while (!bytes.empty() && open_) {
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
    if (count < 0 && errno == EINTR) continue;
    open_ = count > 0;
    if (open_) bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return open_;
}

void UsbPlug::write(std::span<const std::uint32_t> words, std::span<const std::uint8_t> bytes) {
  Bytes all;
  for (const std::uint32_t word : words) {
    for (const int shift : {24, 16, 8, 0}) all.push_back(static_cast<std::uint8_t>(word >> shift));
  }
  all.insert(all.end(), bytes.begin(), bytes.end());
  std::span<const std::uint8_t> left = all;
  while (!left.empty() && open_) {
    const ssize_t count = ::send(socket_, left.data(), left.size(), MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    open_ = count > 0;
    if (open_) left = left.subspan(static_cast<std::size_t>(count));
  }
}

}  // namespace made
