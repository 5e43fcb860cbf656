// Made V4L2 devices behind the system calls' seam, with a clock that only they move.
#pragma once

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <linux/videodev2.h>

#include "capture/v4l2_io.h"

namespace made {

struct FakeSize {
  std::uint32_t width;
  std::uint32_t height;
  std::vector<std::uint32_t> rates;  // whole frames a second
};

struct FakeFormat {
  std::uint32_t fourcc;
  std::vector<FakeSize> sizes;
};

struct FakeControl {
  std::uint32_t id;
  std::string name;
  int low, high, value;
  std::uint32_t flags = 0;
  int step = 1;  // values are rounded down to it
};

// What happens at the next wait for a picture.
struct FakeEvent {
  int wait_result = 1;     // 0 = nothing in time; negative = error
  int dequeue_result = 0;  // negative = error
  std::uint32_t sequence_step = 1;
  std::uint32_t flags = 0;      // V4L2_BUF_FLAG_ERROR
  std::size_t bytes_short = 0;  // of the picture
  capture::Time stamp_shift{};
};

struct FakeDevice {
  std::string path = "/dev/video0";
  std::string bus = "usb-0000:00:14.0-1";
  std::string card = "Made camera";
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<FakeFormat> formats{
      {V4L2_PIX_FMT_YUYV, {{64, 48, {30, 15}}, {32, 24, {60, 30}}}},
      {V4L2_PIX_FMT_MJPEG, {{128, 96, {30}}}},
  };
  std::vector<FakeControl> controls{
      {V4L2_CID_GAIN, "Gain", 0, 100, 10},
      {V4L2_CID_EXPOSURE_AUTO, "Auto Exposure", 0, 3, V4L2_EXPOSURE_APERTURE_PRIORITY},
      {V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute", 3, 2047, 250,
       V4L2_CTRL_FLAG_INACTIVE},
  };
  bool present = true;
  int open_error = 0;                        // errno
  std::map<unsigned long, int> call_errors;  // errno, by request
  std::uint32_t stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  std::uint32_t first_sequence = 0;
  std::vector<std::byte> picture;         // "" = zeros of the format's size
  bool changes_size = false;              // S_FMT sets another one
  std::uint32_t field = V4L2_FIELD_NONE;  // that S_FMT sets
  std::deque<FakeEvent> events;           // then pictures without a fault

  // What was set.
  v4l2_pix_format format{};
  v4l2_fract interval{1, 30};
  bool sets_interval = true;  // else it stays, whatever is asked for
  bool streaming = false;
};

class FakeV4l2 final : public capture::V4l2Io {
 public:
  std::vector<FakeDevice> devices{FakeDevice{}};
  std::function<void()> on_sleep;
  capture::Time clock = std::chrono::seconds(1000);
  int open_nodes = 0;
  int mapped = 0;

  std::vector<std::string> nodes() override {
    std::vector<std::string> paths;
    for (const FakeDevice& device : devices) {
      if (device.present) paths.push_back(device.path);
    }
    return paths;
  }

  int open(const std::string& path) override {
    for (FakeDevice& device : devices) {
      if (!device.present || device.path != path) continue;
      if (device.open_error != 0) return -device.open_error;
      ++open_nodes;
      nodes_[++last_descriptor_] = {&device, {}, {}, 0};
      return last_descriptor_;
    }
    return -ENOENT;
  }

  void close(int descriptor) override {
    --open_nodes;
    Node& node = nodes_.at(descriptor);
    if (!node.buffers.empty()) node.device->streaming = false;
    nodes_.erase(descriptor);
  }

  const std::byte* map(int descriptor, std::size_t bytes, std::int64_t offset) override {
    Node& node = nodes_.at(descriptor);
    const auto i = static_cast<std::size_t>(offset / page);
    if (i >= node.buffers.size() || node.buffers[i].size() != bytes) return nullptr;
    ++mapped;
    return node.buffers[i].data();
  }

  void unmap(const std::byte*, std::size_t) override { --mapped; }

  int wait(int descriptor, capture::Time longest) override {
    FakeDevice& device = *nodes_.at(descriptor).device;
    if (!device.present) return -ENODEV;
    event_ = {};
    if (!device.events.empty()) {
      event_ = device.events.front();
      device.events.pop_front();
    }
    const bool picture = event_.wait_result == 1;
    clock += picture
                 ? std::chrono::nanoseconds(std::chrono::seconds(1)) * device.interval.numerator /
                       device.interval.denominator * event_.sequence_step
             : event_.wait_result == 0 ? longest
                                       : capture::Time{0};
    return event_.wait_result;
  }

  capture::Time now() override { return clock; }

  void sleep(capture::Time length) override {
    clock += length;
    if (on_sleep) on_sleep();
  }

  int ioctl(int descriptor, unsigned long request, void* argument) override {
    Node& node = nodes_.at(descriptor);
    FakeDevice& device = *node.device;
    if (!device.present) return -ENODEV;
    if (const auto error = device.call_errors.find(request); error != device.call_errors.end()) {
      return -error->second;
    }
    switch (request) {
      case VIDIOC_QUERYCAP:
        return query(device, *static_cast<v4l2_capability*>(argument));
      case VIDIOC_ENUM_FMT:
        return list_format(device, *static_cast<v4l2_fmtdesc*>(argument));
      case VIDIOC_ENUM_FRAMESIZES:
        return list_size(device, *static_cast<v4l2_frmsizeenum*>(argument));
      case VIDIOC_ENUM_FRAMEINTERVALS:
        return list_rate(device, *static_cast<v4l2_frmivalenum*>(argument));
      case VIDIOC_S_FMT:
        return set_format(device, static_cast<v4l2_format*>(argument)->fmt.pix);
      case VIDIOC_S_PARM:
        if (!device.sets_interval) {
          static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = device.interval;
        }
        device.interval = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
        return 0;
      case VIDIOC_QUERY_EXT_CTRL:
        return query_control(device, *static_cast<v4l2_query_ext_ctrl*>(argument));
      case VIDIOC_G_EXT_CTRLS:
      case VIDIOC_S_EXT_CTRLS:
        return control(device, *static_cast<v4l2_ext_controls*>(argument)->controls,
                       request == VIDIOC_S_EXT_CTRLS);
      case VIDIOC_REQBUFS:
        node.buffers.assign(static_cast<v4l2_requestbuffers*>(argument)->count,
                            std::vector<std::byte>(device.format.sizeimage));
        return 0;
      case VIDIOC_QUERYBUF: {
        auto& buffer = *static_cast<v4l2_buffer*>(argument);
        buffer.length = device.format.sizeimage;
        buffer.m.offset = buffer.index * page;
        return 0;
      }
      case VIDIOC_QBUF:
        node.queued.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_DQBUF:
        return dequeue(node, *static_cast<v4l2_buffer*>(argument));
      case VIDIOC_STREAMON:
        node.sequence = device.first_sequence - 1;
        device.streaming = true;
        return 0;
      case VIDIOC_STREAMOFF:
        device.streaming = false;
        return 0;
      default:
        return -ENOTTY;
    }
  }

 private:
  static constexpr std::uint32_t page = 4096;

  struct Node {
    FakeDevice* device = nullptr;
    std::vector<std::vector<std::byte>> buffers;
    std::deque<std::uint32_t> queued;
    std::uint32_t sequence = 0;
  };

  template <std::size_t size>
  static void copy(const std::string& text, __u8 (&field)[size]) {
    std::memcpy(field, text.data(), std::min(text.size(), size - 1));
  }

  static int query(const FakeDevice& device, v4l2_capability& capability) {
    copy("made", capability.driver);
    copy(device.card, capability.card);
    copy(device.bus, capability.bus_info);
    capability.device_caps = device.capabilities;
    capability.capabilities = device.capabilities | V4L2_CAP_DEVICE_CAPS;
    return 0;
  }

  static int list_format(const FakeDevice& device, v4l2_fmtdesc& format) {
    if (format.index >= device.formats.size()) return -EINVAL;
    format.pixelformat = device.formats[format.index].fourcc;
    return 0;
  }

  static const FakeFormat* format_of(const FakeDevice& device, std::uint32_t fourcc) {
    const auto found = std::ranges::find(device.formats, fourcc, &FakeFormat::fourcc);
    return found == device.formats.end() ? nullptr : &*found;
  }

  static int list_size(const FakeDevice& device, v4l2_frmsizeenum& size) {
    const FakeFormat* format = format_of(device, size.pixel_format);
    if (format == nullptr || size.index >= format->sizes.size()) return -EINVAL;
    size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    size.discrete = {format->sizes[size.index].width, format->sizes[size.index].height};
    return 0;
  }

  static int list_rate(const FakeDevice& device, v4l2_frmivalenum& rate) {
    const FakeFormat* format = format_of(device, rate.pixel_format);
    if (format == nullptr) return -EINVAL;
    const auto size = std::ranges::find(format->sizes, rate.width, &FakeSize::width);
    if (size == format->sizes.end() || rate.index >= size->rates.size()) return -EINVAL;
    rate.type = V4L2_FRMIVAL_TYPE_DISCRETE;
    rate.discrete = {1, size->rates[rate.index]};
    return 0;
  }

  static int set_format(FakeDevice& device, v4l2_pix_format& format) {
    if (device.changes_size) format.width /= 2;
    const bool bytes = format.pixelformat == V4L2_PIX_FMT_GREY;
    format.bytesperline = format.pixelformat == V4L2_PIX_FMT_MJPEG ? 0
                          : bytes                                  ? format.width
                                                                   : 2 * format.width;
    format.sizeimage = 2 * format.width * format.height;
    format.field = device.field;
    format.priv = V4L2_PIX_FMT_PRIV_MAGIC;
    device.format = format;
    return 0;
  }

  static int query_control(const FakeDevice& device, v4l2_query_ext_ctrl& its) {
    const bool next = (its.id & V4L2_CTRL_FLAG_NEXT_CTRL) != 0;
    const std::uint32_t id = its.id & ~V4L2_CTRL_FLAG_NEXT_CTRL;
    const FakeControl* found = nullptr;
    for (const FakeControl& control : device.controls) {
      const bool fits = next ? control.id > id : control.id == id;
      if (fits && (found == nullptr || control.id < found->id)) found = &control;
    }
    if (found == nullptr) return -EINVAL;
    its.id = found->id;
    its.type = V4L2_CTRL_TYPE_INTEGER;
    its.minimum = found->low;
    its.maximum = found->high;
    its.step = found->step;
    its.flags = found->flags;
    std::memcpy(its.name, found->name.c_str(), found->name.size() + 1);
    return 0;
  }

  static int control(FakeDevice& device, v4l2_ext_control& value, bool set) {
    const auto found = std::ranges::find(device.controls, value.id, &FakeControl::id);
    if (found == device.controls.end()) return -EINVAL;
    if (!set) {
      value.value = found->value;
      return 0;
    }
    found->value = value.value / found->step * found->step;
    if (value.id == V4L2_CID_EXPOSURE_AUTO) {
      for (FakeControl& other : device.controls) {
        if (other.id != V4L2_CID_EXPOSURE_ABSOLUTE) continue;
        other.flags = value.value == V4L2_EXPOSURE_MANUAL ? 0U : V4L2_CTRL_FLAG_INACTIVE;
      }
    }
    return 0;
  }

  int dequeue(Node& node, v4l2_buffer& buffer) {
    const FakeDevice& device = *node.device;
    if (event_.dequeue_result < 0) return event_.dequeue_result;
    if (node.queued.empty() || !device.streaming) return -EINVAL;
    buffer.index = node.queued.front();
    node.queued.pop_front();
    std::vector<std::byte>& bytes = node.buffers[buffer.index];
    std::copy_n(device.picture.begin(), std::min(device.picture.size(), bytes.size()),
                bytes.begin());
    const std::size_t whole = device.picture.empty() ? bytes.size() : device.picture.size();
    buffer.bytesused = static_cast<std::uint32_t>(whole - event_.bytes_short);
    node.sequence += event_.sequence_step;
    buffer.sequence = node.sequence;
    buffer.flags = device.stamp_flags | event_.flags;
    const auto stamp =
        std::chrono::duration_cast<std::chrono::microseconds>(clock + event_.stamp_shift);
    buffer.timestamp = {stamp.count() / 1'000'000, stamp.count() % 1'000'000};
    return 0;
  }

  std::map<int, Node> nodes_;
  int last_descriptor_ = 2;
  FakeEvent event_;
};

}  // namespace made
