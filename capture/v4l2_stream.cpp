// Streaming from V4L2 devices.
#include "capture/v4l2_stream.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <linux/videodev2.h>

#include "capture/v4l2_format.h"

namespace capture {
namespace {

constexpr std::uint32_t wanted_buffers = 4;
constexpr std::uint32_t least_buffers = 2;
constexpr std::uint32_t most_buffers = 32;
constexpr double told_rate_tolerance = 0.01;

[[noreturn]] void fail(const std::string& what, int error) {
  throw std::runtime_error(what + ": " + reason_of(error));
}

V4l2Buffer stamp_of(const v4l2_buffer& filled) {
  V4l2Buffer buffer;
  buffer.sequence = filled.sequence;
  buffer.marked_faulty = (filled.flags & V4L2_BUF_FLAG_ERROR) != 0;
  buffer.stamped =
      (filled.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  buffer.at_start = (filled.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  // A stamp outside of some hundred years is a broken one.
  constexpr std::int64_t most_s = 9'000'000'000;
  const std::int64_t seconds = filled.timestamp.tv_sec;
  const std::int64_t micros = filled.timestamp.tv_usec;
  if (seconds < 0 || seconds > most_s || micros < 0 || micros >= 1'000'000) {
    buffer.stamped = false;
  } else {
    buffer.stamp = std::chrono::seconds(seconds) + std::chrono::microseconds(micros);
  }
  return buffer;
}

bool is_whole_picture(std::uint32_t field) {
  switch (field) {
    case V4L2_FIELD_ANY:
    case V4L2_FIELD_NONE:
    case V4L2_FIELD_INTERLACED:
    case V4L2_FIELD_INTERLACED_TB:
    case V4L2_FIELD_INTERLACED_BT:
      return true;
    default:
      return false;
  }
}

}  // namespace

struct V4l2Stream::Mapping {
  Mapping(V4l2Io& its_io, int descriptor, std::size_t size, std::int64_t offset)
      : io(its_io), memory(its_io.map(descriptor, size, offset)), bytes(size) {
    if (memory == nullptr) throw std::runtime_error("its buffers cannot be mapped into memory");
  }
  ~Mapping() { io.unmap(memory, bytes); }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  V4l2Io& io;
  const std::byte* memory;
  std::size_t bytes;
};

V4l2Stream::V4l2Stream(std::shared_ptr<V4l2Io> io,
                       const std::string& path,
                       const V4l2Request& request)
    : node_(std::move(io), path), device_(describe_v4l2(node_, path)) {
  const V4l2Choice choice = choose_mode(device_, request);
  set_format(choice);
  set_rate(choice, request);
  for (const auto& [name, value] : request.controls) set_control(name, value);
  exposure_s_ = fixed_exposure_s(node_);
  start();
}

V4l2Stream::~V4l2Stream() {
  if (streaming_) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    node_.call(VIDIOC_STREAMOFF, &type);
  }
}

void V4l2Stream::set_format(const V4l2Choice& choice) {
  const std::string asked =
      name_of_fourcc(choice.fourcc) + " " + words_of(choice.size) + " was asked for";
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_pix_format& picture = format.fmt.pix;
  picture.pixelformat = choice.fourcc;
  picture.width = static_cast<std::uint32_t>(choice.size.width);
  picture.height = static_cast<std::uint32_t>(choice.size.height);
  picture.field = V4L2_FIELD_NONE;
  if (const int error = node_.call(VIDIOC_S_FMT, &format); error < 0) fail(asked, -error);
  if (picture.pixelformat != choice.fourcc ||
      picture.width != static_cast<std::uint32_t>(choice.size.width) ||
      picture.height != static_cast<std::uint32_t>(choice.size.height)) {
    throw std::runtime_error(asked + "; the device sets " + name_of_fourcc(picture.pixelformat) +
                             " " + std::to_string(picture.width) + "x" +
                             std::to_string(picture.height) + " instead");
  }
  if (!is_whole_picture(picture.field)) {
    throw std::runtime_error(asked +
                             "; the device delivers it as single fields, which is not "
                             "handled");
  }
  interlaced_ = picture.field != V4L2_FIELD_ANY && picture.field != V4L2_FIELD_NONE;
  layout_ = {choice.fourcc,
             choice.size.width,
             choice.size.height,
             picture.bytesperline,
             picture.colorspace,
             0,
             0,
             0};
  if (picture.priv == V4L2_PIX_FMT_PRIV_MAGIC) {
    layout_.ycbcr_encoding = picture.ycbcr_enc;
    layout_.quantization = picture.quantization;
    layout_.transfer = picture.xfer_func;
  }
}

void V4l2Stream::set_rate(const V4l2Choice& choice, const V4l2Request& request) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  if (choice.rate) {
    interval.numerator = static_cast<std::uint32_t>(choice.rate->den);
    interval.denominator = static_cast<std::uint32_t>(choice.rate->num);
  }
  const int error = node_.call(choice.rate ? VIDIOC_S_PARM : VIDIOC_G_PARM, &parameters);
  const auto told = error >= 0 ? rate_of_interval(interval) : std::nullopt;
  if (told) rate_ = *told;
  if (!request.rate) return;
  const std::string asked = "rate " + words_of(*request.rate) + " was asked for; the device ";
  if (!told) throw std::runtime_error(asked + "has no rate that can be set");
  if (std::abs(rate_.value() / request.rate->value() - 1) > told_rate_tolerance) {
    throw std::runtime_error(asked + "sets " + words_of(rate_) + " instead");
  }
}

// Returns what the device has after that.
std::int64_t V4l2Stream::set_control(const std::string& name, std::int64_t value) {
  // One that was set before may have woken this one.
  const auto known = std::ranges::find(device_.controls, name, &V4l2Control::name);
  if (known != device_.controls.end()) {
    *known = read_control(node_, known->id).value_or(*known);
  }
  const V4l2Control& control = control_for(device_, name, value);
  v4l2_ext_control one{};
  one.id = control.id;
  one.value64 = value;  // the other members share its low bytes
  v4l2_ext_controls all{};
  all.which = V4L2_CTRL_WHICH_CUR_VAL;
  all.count = 1;
  all.controls = &one;
  const std::string asked = name + "=" + std::to_string(value) + " was asked for";
  if (const int error = node_.call(VIDIOC_S_EXT_CTRLS, &all); error < 0) fail(asked, -error);
  const auto now = read_control(node_, control.id);
  if (now && std::abs(now->value - value) >= std::max<std::int64_t>(control.step, 1)) {
    throw std::runtime_error(asked + "; the device sets " + std::to_string(now->value) +
                             " instead");
  }
  return now ? now->value : value;
}

// "" = it has none of this number.
std::string V4l2Stream::name_of_control(std::uint32_t id) const {
  const auto control = std::ranges::find(device_.controls, id, &V4l2Control::id);
  return control == device_.controls.end() ? std::string() : control->name;
}

double V4l2Stream::set_exposure(double exposure_s) {
  const auto range = capture::exposure_range(device_);
  if (!range) {
    throw std::runtime_error("it has no exposure time that can be set (no exposure_time_absolute)");
  }
  if (!(exposure_s >= 0.5 * range->shortest_s && exposure_s <= 1.001 * range->longest_s)) {
    throw std::runtime_error("an exposure of " + std::to_string(exposure_s) +
                             " s was asked for; possible are " + std::to_string(range->shortest_s) +
                             " to " + std::to_string(range->longest_s) + " s");
  }
  if (!exposure_is_ours_) {
    // Only a manual exposure takes a time.
    const std::string automatic = name_of_control(V4L2_CID_EXPOSURE_AUTO);
    if (!automatic.empty()) set_control(automatic, V4L2_EXPOSURE_MANUAL);
    exposure_is_ours_ = true;
  }
  const auto units = std::max<std::int64_t>(std::llround(exposure_s / v4l2_exposure_unit_s), 1);
  exposure_s_ = 0;
  const std::int64_t taken = set_control(name_of_control(V4L2_CID_EXPOSURE_ABSOLUTE), units);
  if (taken < 1) {
    throw std::runtime_error("an exposure of " + std::to_string(exposure_s) +
                             " s was asked for; the device sets " + std::to_string(taken) +
                             " units of 0.1 ms");
  }
  return v4l2_exposure_unit_s * static_cast<double>(taken);
}

void V4l2Stream::start() {
  v4l2_requestbuffers wanted{};
  wanted.count = wanted_buffers;
  wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  wanted.memory = V4L2_MEMORY_MMAP;
  if (const int error = node_.call(VIDIOC_REQBUFS, &wanted); error < 0) {
    fail("it gives no buffers", -error);
  }
  if (wanted.count < least_buffers || wanted.count > most_buffers) {
    throw std::runtime_error("it gives " + std::to_string(wanted.count) + " buffers; " +
                             std::to_string(least_buffers) + " to " + std::to_string(most_buffers) +
                             " are needed");
  }
  for (std::uint32_t i = 0; i < wanted.count; ++i) {
    v4l2_buffer buffer{};
    buffer.index = i;
    buffer.type = wanted.type;
    buffer.memory = wanted.memory;
    if (const int error = node_.call(VIDIOC_QUERYBUF, &buffer); error < 0) {
      fail("a buffer is not told", -error);
    }
    mappings_.push_back(
        std::make_unique<Mapping>(node_.io(), node_.descriptor(), buffer.length, buffer.m.offset));
    if (const int error = node_.call(VIDIOC_QBUF, &buffer); error < 0) {
      fail("a buffer is not taken", -error);
    }
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = node_.call(VIDIOC_STREAMON, &type); error < 0) {
    fail("it does not start to stream", -error);
  }
  streaming_ = true;
}

void V4l2Stream::give_back() {
  if (!held_) return;
  v4l2_buffer buffer{};
  buffer.index = *std::exchange(held_, std::nullopt);
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (const int error = node_.call(VIDIOC_QBUF, &buffer); error < 0) {
    fail("a buffer is not taken back", -error);
  }
}

std::optional<V4l2Buffer> V4l2Stream::next(Time longest) {
  give_back();
  const int ready = node_.io().wait(node_.descriptor(), longest);
  if (ready == 0 && gave_up_) {
    throw std::runtime_error("the stream ended: the driver gave empty buffers, then no more");
  }
  if (ready == 0) return std::nullopt;
  if (ready < 0) fail("the stream ended", -ready);
  v4l2_buffer filled{};
  filled.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  filled.memory = V4L2_MEMORY_MMAP;
  const int error = node_.call(VIDIOC_DQBUF, &filled);
  if (error == -EAGAIN) return std::nullopt;
  if (error < 0) fail("the stream ended", -error);
  if (filled.index >= mappings_.size()) {
    throw std::runtime_error("the device gave a buffer that there is not");
  }
  held_ = filled.index;
  const Mapping& mapping = *mappings_[filled.index];
  V4l2Buffer buffer = stamp_of(filled);
  gave_up_ = buffer.marked_faulty && filled.bytesused == 0;
  buffer.bytes = {mapping.memory, std::min<std::size_t>(filled.bytesused, mapping.bytes)};
  return buffer;
}

}  // namespace capture
