// Streaming from GigE Vision and USB3 Vision cameras.
#include "capture/aravis_stream.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include <arv.h>
#include <linux/videodev2.h>

#include "capture/gige_wire.h"
#include "capture/gvsp_filter.h"
#include "capture/live_reader.h"

namespace capture {
namespace {

using namespace std::chrono_literals;

constexpr int buffers = 8;
constexpr std::size_t most_payload = std::size_t{1} << 29U;  // bytes
constexpr int usual_socket_buffer = 8 << 20;
constexpr unsigned packet_timeout_us = 10000;  // then a packet is asked for again
constexpr double rate_tolerance = 0.01;
constexpr double exposure_tolerance = 1e-6;  // of the range that is told
constexpr Time most_delay = 10s;             // of an arrival that is told

std::string words_of_seconds(double seconds) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g s", seconds);
  return text.data();
}

std::string words_of_status(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets of the picture are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "packets of the picture have wrong numbers";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "the picture is not as large as it should be";
    case ARV_BUFFER_STATUS_ABORTED:
      return "the picture was broken off";
    default:
      return "the picture is faulty (status " + std::to_string(status) + ")";
  }
}

// In the machine's byte order; nothing if it is not of IPv4.
std::optional<std::uint32_t> ipv4_of(GSocketAddress* socket) {
  if (!G_IS_INET_SOCKET_ADDRESS(socket)) return std::nullopt;
  GInetAddress* address = g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(socket));
  if (g_inet_address_get_family(address) != G_SOCKET_FAMILY_IPV4) return std::nullopt;
  return gige::get32(g_inet_address_to_bytes(address));
}

// Whether nothing arrives by raw packets: within this machine they pass by.
bool is_loopback(ArvCamera* camera) {
  const auto address =
      ipv4_of(arv_gv_device_get_device_address(ARV_GV_DEVICE(arv_camera_get_device(camera))));
  return !address || *address >> 24U == 127;
}

}  // namespace

AravisStream::AravisStream(const AravisDevice& device, const AravisRequest& request)
    : device_(device), camera_(open_aravis_handle(device)) {
  const auto lost =
      +[](ArvDevice*, gpointer flag) { *static_cast<std::atomic<bool>*>(flag) = true; };
  lost_handler_ = g_signal_connect(arv_camera_get_device(camera_.get()), "control-lost",
                                   G_CALLBACK(lost), &control_lost_);
  try {
    identify();
    set_all(request);
    start(request);
  } catch (...) {
    g_signal_handler_disconnect(arv_camera_get_device(camera_.get()), lost_handler_);
    g_clear_object(&chunk_parser_);
    g_clear_object(&stream_);
    throw;
  }
}

AravisStream::~AravisStream() {
  if (!control_lost_) {
    AravisError error;
    arv_camera_stop_acquisition(camera_.get(), &error);
  }
  g_signal_handler_disconnect(arv_camera_get_device(camera_.get()), lost_handler_);
  g_clear_object(&held_);
  g_clear_object(&chunk_parser_);
  g_clear_object(&stream_);
}

void AravisStream::identify() {
  ArvCamera* const camera = camera_.get();
  is_gige_ = arv_camera_is_gv_device(camera) != 0;
  const auto text = [&](const char* (*get)(ArvCamera*, GError**)) {
    AravisError error;
    const char* words = get(camera, &error);
    return error || words == nullptr ? std::string() : std::string(words);
  };
  if (is_gige_ && !arv_gv_device_is_controller(ARV_GV_DEVICE(arv_camera_get_device(camera)))) {
    throw std::runtime_error("another program controls the camera: end that one first");
  }
  device_.vendor = text(arv_camera_get_vendor_name);
  device_.model = text(arv_camera_get_model_name);
  const std::string serial = text(arv_camera_get_device_serial_number);
  if (!serial.empty()) device_.serial = serial;
}

void AravisStream::set_all(const AravisRequest& request) {
  AravisError ignored;
  arv_camera_stop_acquisition(camera_.get(), &ignored);
  for (const CameraSetting& feature : request.features) {
    set_aravis_feature(*camera_, feature.key, feature.value);
  }
  set_format(request.format);
  set_region(request);
  if (is_gige_) set_packets(request);
  exposures_ = exposure_range_of(*camera_);
  if (request.exposure_s) {
    fixed_exposure_s_ = write_exposure(*request.exposure_s);
  } else if (exposures_) {
    AravisError error;
    const bool has_auto = arv_camera_is_exposure_auto_available(camera_.get(), &error) != 0;
    const bool is_fixed = !error && (!has_auto || arv_camera_get_exposure_time_auto(
                                                      camera_.get(), &error) == ARV_AUTO_OFF);
    const double us = is_fixed ? arv_camera_get_exposure_time(camera_.get(), &error) : 0;
    if (!error && us > 0) fixed_exposure_s_ = us * 1e-6;
  }
  if (request.gain) set_gain(*request.gain);
  set_rate(request.rate);
  set_chunks(request.chunks);
}

void AravisStream::set_format(const std::optional<std::string>& wanted) {
  const std::vector<std::string> there = abilities_of(*camera_).formats;
  if (wanted) {
    if (std::ranges::find(there, *wanted) == there.end()) {
      throw std::runtime_error("format " + *wanted + " was asked for; it has " + list_of(there));
    }
    AravisError error;
    arv_camera_set_pixel_format_from_string(camera_.get(), wanted->c_str(), &error);
    error.check("format " + *wanted + " was asked for");
  } else {
    for (const GenicamFormat& format : genicam_formats()) {
      if (std::ranges::find(there, format.name) == there.end()) continue;
      AravisError error;
      arv_camera_set_pixel_format(camera_.get(), format.code, &error);
      if (!error) break;
    }
  }
  AravisError error;
  const auto code = static_cast<std::uint32_t>(arv_camera_get_pixel_format(camera_.get(), &error));
  error.check("the camera does not tell its format");
  const char* name = arv_camera_get_pixel_format_as_string(camera_.get(), &error);
  format_name_ = error || name == nullptr ? "unknown" : name;
  const GenicamFormat* format = genicam_format_of(code);
  if (format == nullptr) {
    throw std::runtime_error("format " + format_name_ + " is not read; it has " + list_of(there));
  }
  if (wanted && format_name_ != *wanted) {
    throw std::runtime_error("format " + *wanted + " was asked for; the camera sets " +
                             format_name_ + " instead");
  }
  format_ = *format;
}

void AravisStream::set_region(const AravisRequest& request) {
  ArvCamera* const camera = camera_.get();
  std::array<int, 4> wanted{};
  AravisError error;
  // What is possible is told for where the region begins.
  if (request.region || request.size) arv_camera_set_region(camera, 0, 0, -1, -1, &error);
  error.clear();
  const AravisAbilities abilities = abilities_of(*camera);
  if (request.region) {
    wanted = *request.region;
  } else if (request.size) {
    wanted = {0, 0, request.size->width, request.size->height};
    gint sensor_width = 0;
    gint sensor_height = 0;
    arv_camera_get_sensor_size(camera, &sensor_width, &sensor_height, &error);
    if (!error) {
      // Many cameras place pictures in steps.
      wanted[0] = std::max(sensor_width - wanted[2], 0) / 2 / 8 * 8;
      wanted[1] = std::max(sensor_height - wanted[3], 0) / 2 / 8 * 8;
    }
    error.clear();
  }
  if (wanted[2] > 0) {
    std::string asked = "a picture of " + words_of(PictureSize{wanted[2], wanted[3]}) + " at " +
                        std::to_string(wanted[0]) + "," + std::to_string(wanted[1]) +
                        " was asked for";
    if (abilities.largest &&
        (wanted[2] > abilities.largest->width || wanted[3] > abilities.largest->height ||
         wanted[2] < abilities.smallest->width || wanted[3] < abilities.smallest->height)) {
      throw std::runtime_error(asked + "; it has " + words_of(*abilities.smallest) + " to " +
                               words_of(*abilities.largest));
    }
    arv_camera_set_region(camera, wanted[0], wanted[1], wanted[2], wanted[3], &error);
    error.check(asked);
  }
  gint x = 0;
  gint y = 0;
  gint width = 0;
  gint height = 0;
  arv_camera_get_region(camera, &x, &y, &width, &height, &error);
  error.check("the camera does not tell its region");
  region_ = {x, y, width, height};
  const bool placed = request.region
                          ? region_ == wanted
                          : wanted[2] == 0 || (width == wanted[2] && height == wanted[3]);
  if (!placed) {
    throw std::runtime_error("region " + std::to_string(wanted[0]) + "," +
                             std::to_string(wanted[1]) + "," + std::to_string(wanted[2]) + "," +
                             std::to_string(wanted[3]) + " was asked for; the camera sets " +
                             std::to_string(x) + "," + std::to_string(y) + "," +
                             std::to_string(width) + "," + std::to_string(height) + " instead");
  }
  // Codes of sensors are light, unless the set names a response.
  layout_ = {
      format_.fourcc,     width, height, 0, V4L2_COLORSPACE_SRGB, 0, V4L2_QUANTIZATION_FULL_RANGE,
      V4L2_XFER_FUNC_NONE};
}

void AravisStream::set_rate(const std::optional<Rational>& wanted) {
  ArvCamera* const camera = camera_.get();
  AravisError error;
  if (!arv_camera_is_frame_rate_available(camera, &error) || error) {
    if (wanted) {
      throw std::runtime_error("rate " + words_of(*wanted) +
                               " was asked for; the camera has no rate that can be set");
    }
    return;
  }
  double low = 0;
  double high = 0;
  if (wanted) {
    const std::string asked = "rate " + words_of(*wanted) + " was asked for";
    arv_camera_get_frame_rate_bounds(camera, &low, &high, &error);
    const double rate = wanted->value();
    if (!error && (rate < low * (1 - rate_tolerance) || rate > high * (1 + rate_tolerance))) {
      throw std::runtime_error(asked + "; it has " + std::to_string(low) + " to " +
                               std::to_string(high) + "/s");
    }
    error.clear();
    arv_camera_set_frame_rate(camera, rate, &error);
    error.check(asked);
  }
  const double now = arv_camera_get_frame_rate(camera, &error);
  if (error || !(now > 0.001 && now < 1e6)) return;
  if (wanted && std::abs(now / wanted->value() - 1) > rate_tolerance) {
    throw std::runtime_error("rate " + words_of(*wanted) + " was asked for; the camera sets " +
                             std::to_string(now) + " instead");
  }
  // Cameras tell 29.97 for 30000/1001.
  constexpr double of_rounding = 1e-4;
  rate_ = wanted
              ? *wanted
              : nominal_rate(now, of_rounding).value_or(Rational{std::llround(now * 1000), 1000});
}

void AravisStream::set_gain(double gain) {
  const std::string asked = "gain " + std::to_string(gain) + " was asked for";
  AravisError error;
  if (!arv_camera_is_gain_available(camera_.get(), &error) || error) {
    throw std::runtime_error(asked + "; the camera has none that can be set");
  }
  double low = 0;
  double high = 0;
  arv_camera_get_gain_bounds(camera_.get(), &low, &high, &error);
  if (!error && (gain < low || gain > high)) {
    throw std::runtime_error(asked + "; it can be " + std::to_string(low) + " to " +
                             std::to_string(high));
  }
  error.clear();
  if (arv_camera_is_gain_auto_available(camera_.get(), &error) && !error) {
    arv_camera_set_gain_auto(camera_.get(), ARV_AUTO_OFF, &error);
  }
  error.clear();
  arv_camera_set_gain(camera_.get(), gain, &error);
  error.check(asked);
}

void AravisStream::set_packets(const AravisRequest& request) {
  ArvCamera* const camera = camera_.get();
  const bool raw = request.packet_socket.value_or(false) && !is_loopback(camera);
  arv_camera_gv_set_stream_options(
      camera, raw ? ARV_GV_STREAM_OPTION_NONE : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  AravisError error;
  if (request.packet_delay_ns) {
    arv_camera_gv_set_packet_delay(camera, *request.packet_delay_ns, &error);
    error.check("packet_delay=" + std::to_string(*request.packet_delay_ns) + " was asked for");
  }
  if (!request.packet_size) return;
  const std::string asked =
      "packet_size=" + std::to_string(*request.packet_size) + " was asked for";
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  arv_camera_gv_set_packet_size(camera, *request.packet_size, &error);
  error.check(asked);
  const auto now = static_cast<int>(arv_camera_gv_get_packet_size(camera, &error));
  if (!error && now != *request.packet_size) {
    throw std::runtime_error(asked + "; the camera sets " + std::to_string(now) + " instead");
  }
}

void AravisStream::set_chunks(bool wanted) {
  ArvCamera* const camera = camera_.get();
  AravisError error;
  if (!arv_camera_are_chunks_available(camera, &error) || error) return;
  arv_camera_set_chunk_mode(camera, wanted ? TRUE : FALSE, &error);
  if (error || !wanted) return;
  for (const char* chunk : {"Timestamp", "FrameID", "ExposureTime"}) {
    error.clear();
    arv_camera_set_chunk_state(camera, chunk, TRUE, &error);
  }
  // Without exposures the others are no use either.
  if (error) {
    error.clear();
    arv_camera_set_chunk_mode(camera, FALSE, &error);
    return;
  }
  chunk_parser_ = arv_camera_create_chunk_parser(camera);
}

double AravisStream::write_exposure(double exposure_s) {
  if (!exposures_) throw std::runtime_error("it has no exposure time that can be set");
  const std::string asked = "an exposure of " + words_of_seconds(exposure_s) + " was asked for";
  if (!(exposure_s >= exposures_->shortest_s * (1 - exposure_tolerance) &&
        exposure_s <= exposures_->longest_s * (1 + exposure_tolerance))) {
    throw std::runtime_error(asked + "; possible are " + words_of_seconds(exposures_->shortest_s) +
                             " to " + words_of_seconds(exposures_->longest_s));
  }
  AravisError error;
  if (!exposure_is_ours_ && arv_camera_is_exposure_auto_available(camera_.get(), &error) &&
      !error) {
    arv_camera_set_exposure_time_auto(camera_.get(), ARV_AUTO_OFF, &error);
    error.check(asked);
  }
  error.clear();
  arv_camera_set_exposure_time(camera_.get(), exposure_s * 1e6, &error);
  error.check(asked);
  const double now_us = arv_camera_get_exposure_time(camera_.get(), &error);
  error.check(asked);
  if (!(now_us > 0) || !std::isfinite(now_us)) {
    throw std::runtime_error(asked + "; the camera tells " + std::to_string(now_us) + " us then");
  }
  return now_us * 1e-6;
}

double AravisStream::set_exposure(double exposure_s) {
  const double taken = write_exposure(exposure_s);
  exposure_is_ours_ = true;
  fixed_exposure_s_ = 0;
  return taken;
}

void AravisStream::start(const AravisRequest& request) {
  ArvCamera* const camera = camera_.get();
  AravisError error;
  payload_bytes_ = arv_camera_get_payload(camera, &error);
  error.check("the camera does not tell how large its pictures are");
  const std::size_t picture = genicam_picture_bytes(format_, layout_.width, layout_.height);
  if (payload_bytes_ < picture || payload_bytes_ > most_payload) {
    throw std::runtime_error("the camera tells pictures of " + std::to_string(payload_bytes_) +
                             " bytes; " + format_name_ + " " +
                             words_of(PictureSize{layout_.width, layout_.height}) + " takes " +
                             std::to_string(picture));
  }
  stream_ = arv_camera_create_stream(camera, nullptr, nullptr, &error);
  error.check("no stream can be made");
  if (stream_ == nullptr) throw std::runtime_error("no stream can be made");
  if (ARV_IS_GV_STREAM(stream_)) {
    // What is missing after three frames' time stays missing.
    const double period_s = rate_.num > 0 ? 1 / rate_.value() : 0.04;
    const auto retention_us = static_cast<unsigned>(std::clamp(3e6 * period_s, 40e3, 500e3));
    g_object_set(
        stream_, "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
        request.socket_buffer.value_or(usual_socket_buffer), "packet-timeout", packet_timeout_us,
        "frame-retention", retention_us, "packet-resend",
        request.resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
        nullptr);
    guard();
  }
  for (int i = 0; i < buffers; ++i) {
    arv_stream_push_buffer(stream_, arv_buffer_new_allocate(payload_bytes_));
  }
  arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, &error);
  error.clear();
  arv_camera_start_acquisition(camera, &error);
  error.check("it does not start to stream");
}

// The library takes packets from anyone, and does not check where in a buffer their numbers are.
void AravisStream::guard() {
  ArvCamera* const camera = camera_.get();
  ArvGvDevice* const device = ARV_GV_DEVICE(arv_camera_get_device(camera));
  AravisError error;
  const guint packet_bytes = arv_camera_gv_get_packet_size(camera, &error);
  error.check("the camera does not tell how large its packets are");
  if (packet_bytes < least_gvsp_packet) {
    throw std::runtime_error("the camera sends packets of " + std::to_string(packet_bytes) +
                             " bytes; they need " + std::to_string(least_gvsp_packet));
  }
  // Its thread reads already, but has no buffers: what it still holds is gone once it stops.
  arv_stream_stop_thread(stream_, FALSE);
  try {
    const auto from = ipv4_of(arv_gv_device_get_device_address(device));
    const auto to = ipv4_of(arv_gv_device_get_interface_address(device));
    const auto socket =
        to ? udp_socket_at(*to, arv_gv_stream_get_port(ARV_GV_STREAM(stream_))) : std::nullopt;
    if (!from || !socket) throw std::runtime_error("the stream's socket is not found");
    filter_gvsp(*socket, {*from, payload_bytes_, packet_bytes});
  } catch (const std::runtime_error& problem) {
    unguarded_ = problem.what();
  }
  arv_stream_start_thread(stream_);
}

void AravisStream::give_back() {
  if (held_ != nullptr) arv_stream_push_buffer(stream_, held_);
  held_ = nullptr;
}

std::optional<AravisBuffer> AravisStream::next(Time longest) {
  give_back();
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(longest).count();
  held_ =
      arv_stream_timeout_pop_buffer(stream_, static_cast<guint64>(std::max<std::int64_t>(us, 0)));
  if (held_ != nullptr) return read(*held_);
  if (control_lost_) throw std::runtime_error("the camera is gone");
  return std::nullopt;
}

AravisBuffer AravisStream::read(_ArvBuffer& buffer) {
  AravisBuffer read;
  const ArvBufferStatus status = arv_buffer_get_status(&buffer);
  if (status != ARV_BUFFER_STATUS_SUCCESS) read.fault = words_of_status(status);
  read.id = arv_buffer_get_frame_id(&buffer);
  read.arrival = monotonic_now();
  if (status == ARV_BUFFER_STATUS_SUCCESS) {
    const auto since = static_cast<std::int64_t>(g_get_real_time()) * 1000 -
                       static_cast<std::int64_t>(arv_buffer_get_system_timestamp(&buffer));
    if (since > 0 && Time(since) < most_delay) read.arrival -= Time(since);
    const std::uint64_t stamp = arv_buffer_get_timestamp(&buffer);
    if (stamp > 0 && stamp < std::uint64_t{1} << 62U) {
      read.stamp = Time(static_cast<std::int64_t>(stamp));
    }
  }
  read.exposure_s = exposure_of(buffer);
  read.bytes = picture_in(buffer, read.fault);
  return read;
}

// What has a fault may still hold most of a picture.
std::span<const std::byte> AravisStream::picture_in(_ArvBuffer& buffer, std::string& fault) {
  const std::size_t picture = genicam_picture_bytes(format_, layout_.width, layout_.height);
  std::size_t size = 0;
  const auto* bytes = static_cast<const std::byte*>(arv_buffer_get_data(&buffer, &size));
  if (bytes == nullptr) return {};
  if (fault.empty()) {
    const ArvBufferPayloadType type = arv_buffer_get_payload_type(&buffer);
    if (type != ARV_BUFFER_PAYLOAD_TYPE_IMAGE &&
        type != ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA) {
      fault = "what came is no picture";
      return {};
    }
    if (arv_buffer_get_image_width(&buffer) != layout_.width ||
        arv_buffer_get_image_height(&buffer) != layout_.height ||
        arv_buffer_get_image_pixel_format(&buffer) != format_.code) {
      fault = "a picture of another size or format came";
      return {};
    }
    if (size < picture) {
      fault = "the picture is cut short: " + std::to_string(size) + " of " +
              std::to_string(picture) + " bytes came";
    }
  }
  // Every buffer has room for the payload, whatever came.
  const std::span<const std::byte> all{bytes, picture};
  if (format_.packing == GenicamPacking::none) return all;
  unpack_genicam(format_,
                 static_cast<std::size_t>(layout_.width) * static_cast<std::size_t>(layout_.height),
                 all, unpacked_);
  return unpacked_;
}

double AravisStream::exposure_of(_ArvBuffer& buffer) const {
  std::size_t size = 0;
  arv_buffer_get_data(&buffer, &size);
  // Chunks are found from the end of what came, which packets of both kinds of ids may count twice.
  if (chunk_parser_ != nullptr && arv_buffer_has_chunks(&buffer) && size <= payload_bytes_) {
    AravisError error;
    const double us =
        arv_chunk_parser_get_float_value(chunk_parser_, &buffer, "ChunkExposureTime", &error);
    if (!error && us > 0 && us < 1e12) return us * 1e-6;
  }
  return fixed_exposure_s_;
}

}  // namespace capture
