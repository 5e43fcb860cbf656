// Descriptors of made USB cameras.
#include "tests/guest/uvc_descriptors.h"

#include <algorithm>

namespace made {
namespace {

constexpr std::uint8_t class_interface = 0x24;  // CS_INTERFACE
constexpr std::uint8_t video_class = 0x0e;

// A descriptor with its length in front.
Bytes sized(const Bytes& body) {
  Bytes all(body.size() + 1);
  all[0] = static_cast<std::uint8_t>(all.size());
  std::ranges::copy(body, all.begin() + 1);
  return all;
}

void join(Bytes& bytes, const Bytes& more) {
  for (const std::uint8_t byte : more) bytes.push_back(byte);
}

// VideoControl: a camera whose exposure can be set, and where its pictures go.
Bytes control_descriptors() {
  constexpr std::uint8_t sensor_low = 0x01, sensor_high = 0x02;  // ITT_CAMERA
  constexpr std::uint8_t auto_exposure_and_time = 0x0a;          // bits 1 and 3
  const Bytes camera = sized({class_interface, 2, uvc_camera_terminal, sensor_low, sensor_high, 0,
                              0, 0, 0, 0, 0, 0, 0, 3, auto_exposure_and_time, 0, 0});
  const Bytes output = sized({class_interface, 3, 2, 0x01, 0x01, 0, uvc_camera_terminal, 0});
  Bytes header{class_interface, 1};
  append(header, 0x0100, 2);
  append(header, static_cast<std::uint32_t>(13 + camera.size() + output.size()), 2);
  append(header, 48'000'000, 4);
  join(header, {1, uvc_streaming_interface});
  Bytes all = sized(header);
  join(all, camera);
  join(all, output);
  return all;
}

std::uint32_t bytes_of_pixel(UvcFormat format) { return format == UvcFormat::grey ? 1 : 2; }

Bytes frame_descriptors(UvcFormat format) {
  Bytes all;
  for (std::size_t i = 0; i < uvc_sizes.size(); ++i) {
    const auto width = static_cast<std::uint32_t>(uvc_sizes[i].width);
    const auto height = static_cast<std::uint32_t>(uvc_sizes[i].height);
    const std::uint32_t bytes = bytes_of_pixel(format) * width * height;
    Bytes frame{class_interface, static_cast<std::uint8_t>(format == UvcFormat::mjpeg ? 7 : 5),
                static_cast<std::uint8_t>(i + 1), 0};
    append(frame, width, 2);
    append(frame, height, 2);
    append(frame, bytes * 8 * 15, 4);
    append(frame, bytes * 8 * 30, 4);
    append(frame, bytes, 4);
    append(frame, uvc_intervals[0], 4);
    frame.push_back(static_cast<std::uint8_t>(uvc_intervals.size()));
    for (const std::uint32_t interval : uvc_intervals) append(frame, interval, 4);
    join(all, sized(frame));
  }
  return all;
}

Bytes format_descriptors(UvcFormat format) {
  const auto number = static_cast<std::uint8_t>(format);
  const auto sizes = static_cast<std::uint8_t>(uvc_sizes.size());
  Bytes body{class_interface, static_cast<std::uint8_t>(format == UvcFormat::mjpeg ? 6 : 4), number,
             sizes};
  if (format != UvcFormat::mjpeg) {
    const std::string name = format == UvcFormat::grey ? "Y800" : "YUY2";
    body.insert(body.end(), name.begin(), name.end());
    join(body, {0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71});
  }
  // Bits of a pixel, or that sizes are fixed; the first size is the usual one.
  join(body,
       {static_cast<std::uint8_t>(format == UvcFormat::mjpeg ? 1 : 8 * bytes_of_pixel(format)), 1,
        0, 0, 0, 0});
  Bytes all = sized(body);
  join(all, frame_descriptors(format));
  join(all, sized({class_interface, 0x0d, 1, 1, 4}));  // BT.709 colours, matrix of BT.601
  return all;
}

// VideoStreaming: its formats.
Bytes streaming_descriptors() {
  Bytes formats;
  for (const UvcFormat format : {UvcFormat::yuyv, UvcFormat::mjpeg, UvcFormat::grey}) {
    join(formats, format_descriptors(format));
  }
  Bytes header{class_interface, 1, 3};
  append(header, static_cast<std::uint32_t>(16 + formats.size()), 2);
  join(header, {0x80 | uvc_streaming_endpoint, 0, 2, 0, 0, 0, 1, 0, 0, 0});
  Bytes all = sized(header);
  join(all, formats);
  return all;
}

Bytes configuration() {
  Bytes all;
  join(all, sized({0x0b, 0, 2, video_class, 3, 0, 0}));
  join(all, sized({4, uvc_control_interface, 0, 0, video_class, 1, 0, 0}));
  join(all, control_descriptors());
  join(all, sized({4, uvc_streaming_interface, 0, 1, video_class, 2, 0, 0}));
  join(all, streaming_descriptors());
  join(all, sized({5, 0x80 | uvc_streaming_endpoint, 2, 0x00, 0x02, 0}));  // bulk, 512 bytes
  Bytes head{2};
  append(head, static_cast<std::uint32_t>(9 + all.size()), 2);
  join(head, {2, 1, 0, 0x80, 50});
  head = sized(head);
  join(head, all);
  return head;
}

Bytes text(const std::string& words) {
  Bytes body{3};
  for (const char c : words) append(body, static_cast<std::uint8_t>(c), 2);
  return sized(body);
}

}  // namespace

void append(Bytes& bytes, std::uint32_t number, int count) {
  for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
}

std::uint32_t number_at(const Bytes& bytes, std::size_t at, int count) {
  std::uint32_t number = 0;
  for (int i = 0; i < count; ++i) {
    const std::size_t here = at + static_cast<std::size_t>(i);
    if (here < bytes.size()) number |= static_cast<std::uint32_t>(bytes[here]) << (8 * i);
  }
  return number;
}

std::optional<Bytes> uvc_descriptor(std::uint16_t value, const std::string& name) {
  const int index = value & 0xff;
  switch (value >> 8) {
    case 1:  // USB 2.0, of several interfaces; the numbers that pid.codes gives to tests
      return sized({1, 0x00, 0x02, 0xef, 2, 1, 64, 0x09, 0x12, 0x01, 0x00, 0x00, 0x01, 1, 2, 0, 1});
    case 2:
      return configuration();
    case 3:
      if (index == 0) return sized({3, 0x09, 0x04});
      return text(index == 1 ? "Platelight" : name);
    default:
      return std::nullopt;
  }
}

Bytes uvc_probe(const UvcMode& mode) {
  Bytes bytes;
  append(bytes, 1, 2);  // the interval stands
  bytes.push_back(static_cast<std::uint8_t>(mode.format));
  bytes.push_back(mode.size);
  append(bytes, mode.interval, 4);
  bytes.resize(18);
  const UvcSize size = mode.pixels();
  append(bytes, bytes_of_pixel(mode.format) * static_cast<std::uint32_t>(size.width * size.height),
         4);
  append(bytes, uvc_payload_bytes, 4);
  return bytes;
}

UvcMode uvc_mode(const Bytes& probe) {
  UvcMode mode;
  mode.format = static_cast<UvcFormat>(std::clamp(number_at(probe, 2, 1), 1U, 3U));
  mode.size = static_cast<std::uint8_t>(
      std::clamp<std::uint32_t>(number_at(probe, 3, 1), 1, uvc_sizes.size()));
  const std::uint32_t interval = number_at(probe, 4, 4);
  mode.interval = interval < uvc_intervals[1] ? uvc_intervals[0] : uvc_intervals[1];
  return mode;
}

}  // namespace made
