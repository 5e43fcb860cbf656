// Registers of a made GigE Vision camera.
#include "capture/made_gige_registers.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>

namespace capture::gige {
namespace {

constexpr std::uint32_t heartbeat_ms = 3000;
constexpr std::uint32_t first_packet_size = 8192;
constexpr std::uint32_t largest_packet = 16380;
constexpr std::uint32_t smallest_packet = 220;
constexpr std::uint32_t packet_size_mask = 0xffff;
constexpr std::uint32_t may_resend = 1U << 2U;
constexpr std::uint32_t may_write_memory = 1U << 1U;
constexpr std::uint32_t has_serial = 1U << 30U;
constexpr std::uint32_t big_endian_utf8 = 0x80000001;
constexpr double lowest_rate = 0.1;

bool is_writable(std::uint32_t address, std::size_t size) {
  const auto within = [&](std::uint32_t from, std::uint32_t to) {
    return address >= from && address + size <= to;
  };
  return within(at::heartbeat_timeout_ms, at::heartbeat_timeout_ms + 4) ||
         within(at::control_privilege, at::control_privilege + 4) ||
         within(at::stream_port, at::stream_address + 4) ||
         within(feature::width, feature::payload_size) ||
         within(feature::acquisition, feature::gain_db + 8);
}

bool touches(std::uint32_t address, std::size_t size, std::uint32_t from, std::uint32_t to) {
  return address < to && address + size > from;
}

}  // namespace

MadeRegisters::MadeRegisters(const MadeGigeSettings& settings,
                             std::uint32_t address,
                             const std::string& serial)
    : settings_(settings), memory_(register_bytes) {
  MadeDescription description;
  for (const std::string& name : settings.formats) {
    description.formats.push_back(*genicam_format_of(name));
  }
  description.exposures = settings.exposures;
  description.lowest_rate = lowest_rate;
  description.highest_rate = settings.highest_rate;
  description.largest_packet = largest_packet;
  description.has_chunks = settings.has_chunks;
  const std::string xml = describe_made(description);
  std::array<char, 64> url{};
  std::snprintf(url.data(), url.size(), "local:made.xml;%x;%zx", description_at, xml.size());

  set(at::version, 0x00010002);
  set(at::device_mode, big_endian_utf8);
  set(at::mac_high, 0x0200);  // locally administered
  set(at::mac_low, address);
  set(at::ip_configuration, 1);
  set(at::ip_address, address);
  set(at::subnet_mask, 0xff000000);
  set_text(at::manufacturer, "Platelight", 32);
  set_text(at::model, "MadeGigE", 32);
  set_text(at::device_version, "1", 32);
  set_text(at::serial, serial, 16);
  set_text(at::description_url, url.data(), 512);
  set(at::network_interfaces, 1);
  set(at::stream_channels, 1);
  set(at::capability, has_serial | may_write_memory | (settings.resends ? may_resend : 0));
  set(at::heartbeat_timeout_ms, heartbeat_ms);
  set(at::tick_frequency + 4, 1'000'000'000);
  set(at::stream_packet_size, first_packet_size);
  set(feature::sensor_width, static_cast<std::uint32_t>(settings.width));
  set(feature::sensor_height, static_cast<std::uint32_t>(settings.height));
  set(feature::width, static_cast<std::uint32_t>(settings.width));
  set(feature::height, static_cast<std::uint32_t>(settings.height));
  set(feature::pixel_format, description.formats.front().code);
  set_real(feature::exposure_us, settings.exposure_s * 1e6);
  set_real(feature::frame_rate, settings.rate);
  tell_payload();
  memory_.insert(memory_.end(), xml.begin(), xml.end());
  memory_.resize((memory_.size() + 3) / 4 * 4);
}

void MadeRegisters::set(std::uint32_t address, std::uint32_t value) {
  put32(memory_.data() + address, value);
}

double MadeRegisters::real(std::uint32_t address) const {
  return std::bit_cast<double>(get64(memory_.data() + address));
}

void MadeRegisters::set_real(std::uint32_t address, double value) {
  put64(memory_.data() + address, std::bit_cast<std::uint64_t>(value));
}

void MadeRegisters::set_text(std::uint32_t address, const std::string& text, std::size_t size) {
  std::copy_n(text.begin(), std::min(text.size(), size - 1), memory_.begin() + address);
}

Region MadeRegisters::region() const {
  const auto whole = [this](std::uint32_t address) { return static_cast<int>(value(address)); };
  return {whole(feature::offset_x), whole(feature::offset_y), whole(feature::width),
          whole(feature::height)};
}

const GenicamFormat& MadeRegisters::format() const {
  return *genicam_format_of(value(feature::pixel_format));
}

bool MadeRegisters::has_chunk(std::uint32_t chunk) const {
  return settings_.has_chunks && value(feature::chunk_mode) != 0 &&
         value(feature::chunk_enable + 4 * chunk) != 0;
}

void MadeRegisters::tell_payload() {
  const Region region = this->region();
  std::size_t bytes = genicam_picture_bytes(format(), region.width, region.height);
  if (settings_.has_chunks && value(feature::chunk_mode) != 0) {
    bytes += 8;
    for (std::uint32_t chunk = 0; chunk < made_chunks; ++chunk) bytes += has_chunk(chunk) ? 16 : 0;
  }
  set(feature::payload_size, static_cast<std::uint32_t>(bytes));
}

Status MadeRegisters::read(std::uint32_t address, std::size_t size, Bytes& data) const {
  if (address >= memory_.size()) return Status::invalid_address;
  const std::size_t there = std::min(size, memory_.size() - address);
  data.insert(data.end(), memory_.begin() + address,
              memory_.begin() + static_cast<std::ptrdiff_t>(address + there));
  data.resize(data.size() + size - there);  // the description's end need not be whole
  return Status::success;
}

Status MadeRegisters::write(std::uint32_t address, ByteSpan data) {
  if (address >= register_bytes || data.size() > register_bytes - address) {
    return Status::invalid_address;
  }
  if (!is_writable(address, data.size())) return Status::write_protect;
  if (running() && touches(address, data.size(), feature::width, feature::payload_size)) {
    return Status::access_denied;
  }
  const auto from = memory_.begin() + address;
  const Bytes before(from, from + static_cast<std::ptrdiff_t>(data.size()));
  std::ranges::copy(data, from);
  const Status status = settle(address, data.size());
  if (status != Status::success) std::ranges::copy(before, from);
  tell_payload();
  return status;
}

// Checks and rounds what was written.
Status MadeRegisters::settle(std::uint32_t address, std::size_t size) {
  const auto sides = [](std::uint32_t offset, std::uint32_t side, std::uint32_t most) {
    return side >= 4 && side <= most && offset <= most - side;
  };
  if (!sides(value(feature::offset_x), value(feature::width), value(feature::sensor_width)) ||
      !sides(value(feature::offset_y), value(feature::height), value(feature::sensor_height))) {
    return Status::invalid_parameter;
  }
  const GenicamFormat* format = genicam_format_of(value(feature::pixel_format));
  if (format == nullptr ||
      std::ranges::find(settings_.formats, format->name) == settings_.formats.end()) {
    return Status::invalid_parameter;
  }
  const std::uint32_t packet = value(at::stream_packet_size) & packet_size_mask;
  if (packet < smallest_packet || packet > largest_packet) return Status::invalid_parameter;
  if (value(feature::chunk_selector) >= made_chunks) return Status::invalid_parameter;
  const double exposure_s = real(feature::exposure_us) * 1e-6;
  const double rate = real(feature::frame_rate);
  const double gain_db = real(feature::gain_db);
  if (!std::isfinite(exposure_s) || !std::isfinite(rate) || !(gain_db >= 0) ||
      gain_db > most_gain_db) {
    return Status::invalid_parameter;
  }
  if (touches(address, size, feature::exposure_us, feature::exposure_us + 8)) {
    const double step = settings_.exposure_step_s;
    const double within =
        std::clamp(exposure_s, settings_.exposures.shortest_s, settings_.exposures.longest_s);
    set_real(feature::exposure_us, std::max(std::round(within / step), 1.0) * step * 1e6);
  }
  set_real(feature::frame_rate, std::clamp(rate, lowest_rate, settings_.highest_rate));
  return Status::success;
}

}  // namespace capture::gige
