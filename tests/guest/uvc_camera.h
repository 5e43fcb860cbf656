// A made USB camera, which the kernel's own uvcvideo driver takes for a real one.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>

#include "tests/guest/usb_ip.h"
#include "tests/guest/uvc_descriptors.h"
#include "tests/guest/uvc_picture.h"

namespace made {

// What goes wrong with a picture.
enum class UvcFault {
  error_bit,  // its last payload says that something was wrong
  cut,        // it ends after half of its bytes
  too_long,   // it goes on after its end
  halt,       // the endpoint halts in it, until the host has it go on
};

// Speaks on a thread of its own from plug() to unplug(). Pictures come at the rate that the host
// chose, later where the host asks for them later; none is left out, so a picture's number counts
// all of them since the camera was made. An exposure is that of the pictures from the
// `exposure_lag`th after it on.
class UvcCamera {
 public:
  explicit UvcCamera(int port, std::string name = "Made webcam", int exposure_lag = 3);
  ~UvcCamera();
  UvcCamera(const UvcCamera&) = delete;
  UvcCamera& operator=(const UvcCamera&) = delete;

  // All settings are then as they were when it was made. Throws std::runtime_error where there is
  // no controller.
  void plug();
  void unplug();

  // Of the next picture that begins.
  void fault(UvcFault fault);
  // Sends nothing for so long.
  void stall(std::chrono::milliseconds length);

  // What the host has set.
  bool is_manual() const { return mode_of_exposure_ == manual; }
  int exposure() const { return exposure_; }
  std::uint32_t interval() const { return interval_; }
  // Of a picture that was begun; nothing if there was none of this number.
  std::optional<int> exposure_of(std::uint16_t number) const;

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::uint8_t manual = 1;
  static constexpr std::uint8_t aperture_priority = 8;

  void serve();
  void obey(const UsbTransfer& transfer);
  std::optional<Bytes> told(const UsbSetup& setup) const;
  std::optional<Bytes> told_of_camera(const UsbSetup& setup) const;
  bool take(const UsbSetup& setup, const Bytes& bytes);
  bool take_exposure(int control, const Bytes& bytes);
  void start(bool streams);
  void begin_picture();
  void send_payloads();
  int longest_wait_ms() const;

  int port_;
  std::string name_;
  int exposure_lag_;

  std::atomic<bool> stopping_ = false;
  std::atomic<std::uint8_t> mode_of_exposure_ = aperture_priority;
  std::atomic<int> exposure_ = uvc_normal_exposure;
  std::atomic<std::uint32_t> interval_ = uvc_intervals[0];
  mutable std::mutex mutex_;  // of these:
  std::deque<UvcFault> faults_;
  Clock::time_point silent_until_;
  std::unordered_map<std::uint16_t, int> exposures_;  // by picture

  // Of the thread.
  std::optional<UsbPlug> plug_;
  UvcMode probed_;
  UvcMode mode_;
  std::uint8_t error_code_ = 0;
  bool streams_ = false;
  bool halted_ = false;
  bool odd_picture_ = false;
  std::uint16_t number_ = 0;
  Clock::time_point next_picture_;
  std::deque<int> exposures_to_come_;
  std::deque<Bytes> payloads_;  // of the present picture; an empty one halts the endpoint
  std::thread thread_;
};

}  // namespace made
