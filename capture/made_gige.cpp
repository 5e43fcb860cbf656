// A GigE Vision camera of made pictures.
#include "capture/made_gige.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include "capture/counter_random.h"
#include "capture/made_gige_registers.h"
#include "capture/made_gige_socket.h"
#include "capture/made_gige_stream.h"

namespace capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using gige::Bytes;
using gige::ByteSpan;
using gige::Status;

constexpr Time control_patience = 20ms;  // between looks at whether to stop
constexpr int most_addresses = 1000;     // that are tried

void check(const MadeGigeSettings& settings) {
  const auto refuse = [](const std::string& why) {
    throw std::invalid_argument("a made GigE camera " + why);
  };
  const auto share = [](double value) { return value >= 0 && value <= 1; };
  const auto positive = [](double value) { return std::isfinite(value) && value > 0; };
  constexpr int most_side = 8192;
  if (settings.width < 4 || settings.height < 4 || settings.width > most_side ||
      settings.height > most_side) {
    refuse("has 4 to 8192 pixels a side");
  }
  if (settings.formats.empty()) refuse("needs a format");
  for (const std::string& name : settings.formats) {
    if (genicam_format_of(name) == nullptr) refuse("has no format " + name);
  }
  const ExposureRange& range = settings.exposures;
  if (!positive(range.shortest_s) || !positive(range.longest_s) ||
      range.shortest_s > range.longest_s || !(settings.exposure_s >= range.shortest_s) ||
      !(settings.exposure_s <= range.longest_s) || !positive(settings.exposure_step_s)) {
    refuse("needs exposures above 0, and its own within their range");
  }
  if (!positive(settings.rate) || !(settings.rate <= settings.highest_rate) ||
      !std::isfinite(settings.highest_rate)) {
    refuse("needs a rate above 0, at most its highest");
  }
  if (settings.exposure_lag < 0) refuse("has a lag of 0 or more frames");
  if (settings.first_block == 0) refuse("counts its frames from 1 on");
  if (settings.serial.size() > 15) refuse("has a serial of at most 15 characters");
  if (!share(settings.packet_loss) || !share(settings.drop_share) ||
      !share(settings.repeat_share)) {
    refuse("loses a share of 0 to 1");
  }
  if (!positive(settings.clock_rate) || !positive(settings.link_bits_per_s)) {
    refuse("needs a clock and a link that go");
  }
}

// 127.x.y.z that differ between processes and cameras, but not 127.0.y.z, which others use.
std::uint32_t address_to_try(int attempt) {
  static std::atomic<std::uint32_t> cameras{0};
  const std::uint64_t bits =
      mixed_bits(static_cast<std::uint64_t>(::getpid()),
                 std::uint64_t{cameras++} << 32U | static_cast<std::uint32_t>(attempt));
  const auto part = [bits](unsigned shift, std::uint32_t many) {
    return static_cast<std::uint32_t>(bits >> shift & 0xffffU) % many;
  };
  return 127U << 24U | (1 + part(0, 254)) << 16U | part(16, 256) << 8U | (1 + part(32, 254));
}

}  // namespace

struct MadeGigeCamera::Device {
  Device(const MadeGigeSettings& its_settings, MadeGigePicture its_picture)
      : settings(its_settings), stream(its_settings, std::move(its_picture)) {}

  void find_address();
  void start();
  void stop();
  void control();
  void take_packet(const gige::UdpSocket& socket, gige::Endpoint from, const Bytes& packet);
  Bytes obey(const gige::Command& command, gige::Endpoint from);
  Status write(std::uint32_t address, ByteSpan data, gige::Endpoint from);
  void resend(const gige::Command& command);
  void watch_heartbeat();
  bool controls(gige::Endpoint from) const { return !controller || *controller == from; }

  MadeGigeSettings settings;
  std::uint32_t address = 0;
  std::string address_text;
  std::string serial;
  gige::MadeStream stream;
  gige::UdpSocket control_socket;
  gige::UdpSocket discovery_socket;
  std::thread thread;
  std::atomic<bool> stopping{false};
  std::atomic<bool> hides_exposures{false};

  // Of the control thread alone, while it runs.
  std::optional<gige::MadeRegisters> registers;
  std::optional<gige::Endpoint> controller;
  Clock::time_point last_sign;
};

void MadeGigeCamera::Device::find_address() {
  for (int attempt = 0; attempt < most_addresses; ++attempt) {
    address = address_to_try(attempt);
    if (control_socket.open({address, gige::control_port}, false)) {
      address_text = gige::text_of_address(address);
      serial =
          settings.serial.empty() ? "M" + std::to_string(address & 0xffffffU) : settings.serial;
      return;
    }
  }
  throw std::runtime_error(
      "a made GigE camera finds no loopback address whose port 3956 is free: is the loopback "
      "network up?");
}

void MadeGigeCamera::Device::start() {
  if (thread.joinable()) return;
  if (!control_socket.is_open() && !control_socket.open({address, gige::control_port}, false)) {
    throw std::runtime_error("the made GigE camera's address " + address_text + " was taken");
  }
  // Without it the camera is found by its address only.
  discovery_socket.open({gige::broadcast_address, gige::control_port}, true);
  registers.emplace(settings, address, serial);
  controller.reset();
  stopping = false;
  stream.start(address);
  thread = std::thread([this] { control(); });
}

void MadeGigeCamera::Device::stop() {
  if (!thread.joinable()) return;
  stopping = true;
  thread.join();
  stream.stop();
  control_socket.close();
  discovery_socket.close();
}

void MadeGigeCamera::Device::control() {
  Bytes packet;
  while (!stopping) {
    gige::wait_for_packets(control_socket, discovery_socket, control_patience);
    for (const gige::UdpSocket* socket : {&control_socket, &discovery_socket}) {
      while (const auto from = socket->receive(packet)) take_packet(*socket, *from, packet);
    }
    watch_heartbeat();
  }
}

void MadeGigeCamera::Device::take_packet(const gige::UdpSocket& socket,
                                         gige::Endpoint from,
                                         const Bytes& packet) {
  const auto command = gige::parse_command(packet);
  if (!command) return;
  // The network beyond this machine is none of its business.
  const bool is_discovery = command->code == gige::CommandCode::discovery;
  if (&socket == &discovery_socket && (!is_discovery || from.address >> 24U != 127)) return;
  if (command->code == gige::CommandCode::packet_resend) {
    resend(*command);
    return;
  }
  const Bytes answer = obey(*command, from);
  if (command->wants_answer || is_discovery) control_socket.send(from, answer);
  if (controller == from) last_sign = Clock::now();
}

Bytes MadeGigeCamera::Device::obey(const gige::Command& command, gige::Endpoint from) {
  const ByteSpan data = command.data;
  Bytes told;
  Status status = Status::invalid_parameter;
  switch (command.code) {
    case gige::CommandCode::discovery:
      status = registers->read(0, gige::at::discovery_end, told);
      break;
    case gige::CommandCode::read_register:
      for (std::size_t i = 0; i + 4 <= data.size(); i += 4) {
        status = registers->read(gige::get32(data.data() + i), 4, told);
        if (status != Status::success) break;
      }
      break;
    case gige::CommandCode::read_memory:
      if (data.size() < 8) break;
      told.assign(data.begin(), data.begin() + 4);
      status = registers->read(gige::get32(data.data()), gige::get16(data.data() + 6), told);
      if (hides_exposures && gige::get32(data.data()) == gige::feature::exposure_us) {
        std::fill(told.begin() + 4, told.end(), std::uint8_t{0});
      }
      break;
    case gige::CommandCode::write_register: {
      std::uint16_t done = 0;
      for (std::size_t i = 0; i + 8 <= data.size(); i += 8, ++done) {
        status = write(gige::get32(data.data() + i), data.subspan(i + 4, 4), from);
        if (status != Status::success) break;
      }
      told = {0, 0, static_cast<std::uint8_t>(done >> 8U), static_cast<std::uint8_t>(done & 0xffU)};
      break;
    }
    case gige::CommandCode::write_memory: {
      if (data.size() <= 4) break;
      status = write(gige::get32(data.data()), data.subspan(4), from);
      const std::size_t size = status == Status::success ? data.size() - 4 : 0;
      told = {0, 0, static_cast<std::uint8_t>(size >> 8U), static_cast<std::uint8_t>(size & 0xffU)};
      break;
    }
    default:
      status = Status::not_implemented;
  }
  if (status != Status::success && told.size() > 4) told.clear();
  return gige::answer(command, status, told);
}

Status MadeGigeCamera::Device::write(std::uint32_t at, ByteSpan data, gige::Endpoint from) {
  if (!controls(from)) return Status::access_denied;
  if (!controller && at != gige::at::control_privilege) return Status::access_denied;
  if (at == gige::at::stream_packet_size && data.size() == 4 && (data[0] & 0x80U) != 0) {
    stream.send_test_packet(*registers, gige::get32(data.data()) & 0xffffU);
    return Status::success;
  }
  const Status status = registers->write(at, data);
  if (status != Status::success) return status;
  if (at == gige::at::control_privilege) {
    controller.reset();
    if (registers->value(at) != 0) controller = from;
    last_sign = Clock::now();
    if (!controller) registers->set(gige::feature::acquisition, 0);
  }
  stream.follow(*registers);
  return status;
}

void MadeGigeCamera::Device::resend(const gige::Command& command) {
  if (!settings.resends || command.data.size() < 12) return;
  stream.resend(gige::get16(command.data.data() + 2),
                gige::get32(command.data.data() + 4) & 0xffffffU,
                gige::get32(command.data.data() + 8) & 0xffffffU);
}

void MadeGigeCamera::Device::watch_heartbeat() {
  const std::chrono::milliseconds most{registers->value(gige::at::heartbeat_timeout_ms)};
  if (!controller || Clock::now() - last_sign < most) return;
  controller.reset();
  registers->set(gige::at::control_privilege, 0);
  registers->set(gige::feature::acquisition, 0);
  stream.follow(*registers);
}

MadeGigeCamera::MadeGigeCamera(const MadeGigeSettings& settings, MadeGigePicture picture) {
  check(settings);
  if (!picture) throw std::invalid_argument("a made GigE camera needs pictures");
  device_ = std::make_unique<Device>(settings, std::move(picture));
  device_->find_address();
  device_->start();
}

MadeGigeCamera::~MadeGigeCamera() { device_->stop(); }

const std::string& MadeGigeCamera::address() const { return device_->address_text; }

const std::string& MadeGigeCamera::serial() const { return device_->serial; }

MadeGigeCounts MadeGigeCamera::counts() const { return device_->stream.counts(); }

void MadeGigeCamera::unplug() { device_->stop(); }

void MadeGigeCamera::plug_in() { device_->start(); }

void MadeGigeCamera::drop_next(int frames) { device_->stream.drop_next(frames); }

void MadeGigeCamera::hide_exposures(bool hidden) { device_->hides_exposures = hidden; }

void MadeGigeCamera::set_packet_loss(double share) { device_->stream.set_packet_loss(share); }

void MadeGigeCamera::set_exposure_lag(int frames) { device_->stream.set_exposure_lag(frames); }

MadeGigePicture made_picture(
    const MadeSensor& sensor,
    std::function<std::shared_ptr<const Image>(std::int64_t number)> radiance) {
  return [sensor, radiance = std::move(radiance)](const MadeGigeShot& shot) {
    MadeSensor amplified = sensor;
    amplified.saturation /= shot.gain;
    amplified.full_well_e /= shot.gain;
    return expose(amplified, *radiance(shot.number), shot.exposure_s,
                  static_cast<std::uint64_t>(shot.number));
  };
}

}  // namespace capture
