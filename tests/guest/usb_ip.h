// USB devices made in this process: plugged into the kernel's own virtual host controller
// (vhci_hcd), which speaks USB/IP with them, so that real drivers bind to them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace made {

using Bytes = std::vector<std::uint8_t>;

// The eight bytes that begin a control transfer (USB 2.0, section 9.3).
struct UsbSetup {
  std::uint8_t type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;
};

// A transfer that the host asks for and waits for the answer of.
struct UsbTransfer {
  std::uint32_t id = 0;
  std::uint32_t length = 0;
  std::uint32_t endpoint = 0;  // 0 = control
  bool to_host = false;
  UsbSetup setup;  // of endpoint 0
  Bytes sent;      // by the host
};

// One port of the controller with a high-speed device in it. Of one thread.
class UsbPlug {
 public:
  // Plugs a device into `port`, 0 to 7: the bus of V4L2 is then usb-vhci_hcd.0-(port + 1). Throws
  // std::runtime_error where the controller does not take it.
  explicit UsbPlug(int port);
  // Unplugs it.
  ~UsbPlug();
  UsbPlug(const UsbPlug&) = delete;
  UsbPlug& operator=(const UsbPlug&) = delete;

  // The next transfer at endpoint 0; waits for `longest_ms` at most. Those of other endpoints go
  // to `waiting`, unless the host takes them back.
  std::optional<UsbTransfer> next(int longest_ms);
  bool is_open() const { return open_; }
  // Transfers to the host, of the one streaming endpoint, in order.
  std::deque<UsbTransfer>& waiting() { return waiting_; }

  // Answers a transfer that asked for bytes, or one that sent some (with none).
  void answer(const UsbTransfer& transfer, std::span<const std::uint8_t> bytes);
  // Says that the endpoint is halted: it refuses the request, or cannot go on.
  void refuse(const UsbTransfer& transfer);

 private:
  bool read(std::span<std::uint8_t> bytes);
  void write(std::span<const std::uint32_t> words, std::span<const std::uint8_t> bytes);
  void give_back(std::uint32_t id, std::uint32_t taken_back);

  int socket_ = -1;
  bool open_ = true;
  std::deque<UsbTransfer> waiting_;
};

}  // namespace made
