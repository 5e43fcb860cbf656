// Made USB cameras.
#include "tests/guest/uvc_camera.h"

#include <algorithm>
#include <utility>

namespace made {
namespace {

using namespace std::chrono_literals;

// Standard requests (USB 2.0, section 9.4), and those of video devices (UVC 1.0a, section 4).
constexpr std::uint8_t clear_feature = 1;
constexpr std::uint8_t get_status = 0;
constexpr std::uint8_t get_descriptor = 6;
constexpr std::uint8_t set_interface = 11;
constexpr std::uint8_t set_current = 0x01;
constexpr std::uint8_t get_current = 0x81;
constexpr std::uint8_t get_least = 0x82;
constexpr std::uint8_t get_most = 0x83;
constexpr std::uint8_t get_step = 0x84;
constexpr std::uint8_t get_length = 0x85;
constexpr std::uint8_t get_abilities = 0x86;
constexpr std::uint8_t get_usual = 0x87;

constexpr int error_code_control = 2;
constexpr int probe_control = 1;
constexpr int commit_control = 2;
constexpr int exposure_mode_control = 2;
constexpr int exposure_time_control = 4;

constexpr std::uint8_t can_be_read_and_set = 3;
constexpr std::uint8_t wrong_state = 2;
constexpr int shortest_exposure = 3;
constexpr int longest_exposure = 2047;

constexpr std::uint8_t payload_header_bytes = 2;
constexpr std::uint8_t header_ends = 0x80;
constexpr std::uint8_t picture_ends = 0x02;
constexpr std::uint8_t picture_has_errors = 0x40;

bool is_standard(const UsbSetup& setup) { return (setup.type & 0x60) == 0; }
bool asks(const UsbSetup& setup) { return (setup.type & 0x80) != 0; }
int control_of(const UsbSetup& setup) { return setup.value >> 8; }
int interface_of(const UsbSetup& setup) { return setup.index & 0xff; }
int unit_of(const UsbSetup& setup) { return setup.index >> 8; }

Bytes number(std::uint32_t value, int bytes) {
  Bytes all;
  append(all, value, bytes);
  return all;
}

// A picture in payloads with their headers.
std::deque<Bytes> payloads_of(const Bytes& picture, bool odd, bool has_errors) {
  constexpr std::size_t most = uvc_payload_bytes - payload_header_bytes;
  std::deque<Bytes> payloads;
  for (std::size_t at = 0; at < picture.size(); at += most) {
    const std::size_t end = std::min(at + most, picture.size());
    const bool last = end == picture.size();
    Bytes payload{
        payload_header_bytes,
        static_cast<std::uint8_t>(header_ends | (odd ? 1 : 0) | (last ? picture_ends : 0) |
                                  (last && has_errors ? picture_has_errors : 0))};
    payload.insert(payload.end(), picture.begin() + static_cast<std::ptrdiff_t>(at),
                   picture.begin() + static_cast<std::ptrdiff_t>(end));
    payloads.push_back(std::move(payload));
  }
  return payloads;
}

}  // namespace

UvcCamera::UvcCamera(int port, std::string name, int exposure_lag)
    : port_(port), name_(std::move(name)), exposure_lag_(exposure_lag) {}

UvcCamera::~UvcCamera() { unplug(); }

void UvcCamera::plug() {
  mode_of_exposure_ = aperture_priority;
  exposure_ = uvc_normal_exposure;
  probed_ = mode_ = {};
  streams_ = halted_ = false;
  stopping_ = false;
  plug_.emplace(port_);
  thread_ = std::thread([this] { serve(); });
}

void UvcCamera::unplug() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
  plug_.reset();
}

void UvcCamera::fault(UvcFault fault) {
  const std::lock_guard lock(mutex_);
  faults_.push_back(fault);
}

void UvcCamera::stall(std::chrono::milliseconds length) {
  const std::lock_guard lock(mutex_);
  silent_until_ = Clock::now() + length;
}

std::optional<int> UvcCamera::exposure_of(std::uint16_t number) const {
  const std::lock_guard lock(mutex_);
  const auto found = exposures_.find(number);
  return found == exposures_.end() ? std::nullopt : std::optional(found->second);
}

void UvcCamera::serve() {
  while (!stopping_ && plug_->is_open()) {
    if (const auto transfer = plug_->next(longest_wait_ms())) obey(*transfer);
    if (streams_ && payloads_.empty() && Clock::now() >= next_picture_) begin_picture();
    send_payloads();
  }
}

int UvcCamera::longest_wait_ms() const {
  if (!streams_) return 50;
  if (!payloads_.empty()) return 5;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(next_picture_ - Clock::now());
  return static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, 50));
}

void UvcCamera::obey(const UsbTransfer& transfer) {
  if (asks(transfer.setup)) {
    if (const auto bytes = told(transfer.setup)) {
      plug_->answer(transfer, *bytes);
    } else {
      plug_->refuse(transfer);
    }
  } else if (take(transfer.setup, transfer.sent)) {
    plug_->answer(transfer, {});
  } else {
    plug_->refuse(transfer);
  }
}

std::optional<Bytes> UvcCamera::told(const UsbSetup& setup) const {
  if (is_standard(setup)) {
    if (setup.request == get_descriptor) return uvc_descriptor(setup.value, name_);
    return setup.request == get_status ? std::optional(Bytes{0, 0}) : std::nullopt;
  }
  if (interface_of(setup) == uvc_control_interface) return told_of_camera(setup);
  if (control_of(setup) != probe_control && control_of(setup) != commit_control) return {};
  if (setup.request == get_abilities) return Bytes{can_be_read_and_set};
  UvcMode mode = control_of(setup) == probe_control ? probed_ : mode_;
  if (setup.request == get_least) mode.interval = uvc_intervals.front();
  if (setup.request == get_most) mode.interval = uvc_intervals.back();
  if (setup.request == get_usual) mode = {};
  const Bytes probe = uvc_probe(mode);
  if (setup.request == get_length) return number(static_cast<std::uint32_t>(probe.size()), 2);
  return probe;
}

std::optional<Bytes> UvcCamera::told_of_camera(const UsbSetup& setup) const {
  const int control = control_of(setup);
  if (unit_of(setup) == 0) {
    return control == error_code_control ? std::optional(Bytes{error_code_}) : std::nullopt;
  }
  const bool mode = control == exposure_mode_control;
  if (unit_of(setup) != uvc_camera_terminal || (!mode && control != exposure_time_control)) {
    return std::nullopt;
  }
  const int size = mode ? 1 : 4;
  const auto one_of = [&](std::uint8_t of_mode, int of_time) {
    return number(mode ? of_mode : static_cast<std::uint32_t>(of_time), size);
  };
  switch (setup.request) {
    case get_current:
      return one_of(mode_of_exposure_, exposure_);
    case get_least:
      return one_of(manual, shortest_exposure);
    case get_most:
      return one_of(aperture_priority, longest_exposure);
    case get_step:  // of the mode: all that there are
      return one_of(manual | aperture_priority, 1);
    case get_usual:
      return one_of(aperture_priority, uvc_normal_exposure);
    case get_length:
      return number(static_cast<std::uint32_t>(size), 2);
    case get_abilities:
      return Bytes{can_be_read_and_set};
    default:
      return std::nullopt;
  }
}

// What the host sets; returns whether that is possible.
bool UvcCamera::take(const UsbSetup& setup, const Bytes& bytes) {
  if (is_standard(setup)) {
    // A host ends a stream of this kind by having the endpoint go on.
    if (setup.request == clear_feature || setup.request == set_interface) start(false);
    return true;
  }
  if (setup.request != set_current) return false;
  if (interface_of(setup) == uvc_control_interface) {
    return unit_of(setup) == uvc_camera_terminal && take_exposure(control_of(setup), bytes);
  }
  probed_ = uvc_mode(bytes);
  if (control_of(setup) == commit_control) {
    mode_ = probed_;
    interval_ = mode_.interval;
    start(true);
  }
  return true;
}

bool UvcCamera::take_exposure(int control, const Bytes& bytes) {
  const std::uint32_t value = number_at(bytes, 0, 4);
  if (control == exposure_mode_control && (value == manual || value == aperture_priority)) {
    mode_of_exposure_ = static_cast<std::uint8_t>(value);
    return true;
  }
  if (control != exposure_time_control) return false;
  if (!is_manual()) {
    error_code_ = wrong_state;
    return false;
  }
  exposure_ =
      static_cast<int>(std::clamp<std::uint32_t>(value, shortest_exposure, longest_exposure));
  return true;
}

void UvcCamera::start(bool streams) {
  streams_ = streams;
  halted_ = false;
  payloads_.clear();
  exposures_to_come_.assign(static_cast<std::size_t>(exposure_lag_), exposure_);
  next_picture_ = Clock::now();
}

void UvcCamera::begin_picture() {
  const auto interval = std::chrono::nanoseconds(100) * mode_.interval;
  next_picture_ = std::max(next_picture_ + interval, Clock::now());
  exposures_to_come_.push_back(exposure_);
  const UvcPicture picture{++number_, exposures_to_come_.front()};
  exposures_to_come_.pop_front();
  std::optional<UvcFault> fault;
  {
    const std::lock_guard lock(mutex_);
    exposures_[picture.number] = picture.exposure;
    if (!faults_.empty()) {
      fault = faults_.front();
      faults_.pop_front();
    }
  }
  const UvcSize size = mode_.pixels();
  Bytes bytes = coded(picture, mode_.format, size.width, size.height);
  if (fault == UvcFault::cut) bytes.resize(bytes.size() / 2);
  if (fault == UvcFault::too_long) bytes.resize(2 * bytes.size());
  odd_picture_ = !odd_picture_;
  payloads_ = payloads_of(bytes, odd_picture_, fault == UvcFault::error_bit);
  if (fault == UvcFault::halt) payloads_.back().clear();
}

void UvcCamera::send_payloads() {
  {
    const std::lock_guard lock(mutex_);
    if (Clock::now() < silent_until_) return;
  }
  auto& waiting = plug_->waiting();
  while (!waiting.empty() && (halted_ || !payloads_.empty())) {
    const UsbTransfer transfer = std::move(waiting.front());
    waiting.pop_front();
    halted_ = halted_ || payloads_.front().empty();
    if (halted_) {
      plug_->refuse(transfer);
      payloads_.clear();
      continue;
    }
    plug_->answer(transfer, payloads_.front());
    payloads_.pop_front();
  }
}

}  // namespace made
