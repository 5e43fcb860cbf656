// What V4L2 cameras there are, and what they can do.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/frame.h"
#include "capture/v4l2_io.h"

struct v4l2_fract;

namespace capture {

// Sizes of a format, and their rates. Devices with fixed sizes have one such for each.
struct V4l2Mode {
  std::uint32_t fourcc = 0;
  int min_width = 0;
  int max_width = 0;
  int width_step = 1;
  int min_height = 0;
  int max_height = 0;
  int height_step = 1;
  // Falling; empty = the device does not tell. Of sizes in a range: those of the largest.
  std::vector<Rational> rates;
  bool rates_between = false;  // any from the last to the first

  bool has_size(int width, int height) const;
};

struct V4l2Control {
  std::uint32_t id = 0;
  std::string name;  // in small letters, joined by _: "exposure_time_absolute"
  std::int64_t low = 0;
  std::int64_t high = 0;
  std::int64_t step = 1;
  std::int64_t normal = 0;
  std::int64_t value = 0;
  bool settable = true;
  bool inactive = false;  // has no effect: another control is automatic
};

// Whole-number, yes-or-no and menu controls; others are left out.
struct V4l2Device {
  std::string path;  // now: node numbers change when a device is plugged in again
  std::string bus;   // where it is plugged in: "usb-0000:00:14.0-1"
  std::string card;  // its name
  std::string driver;
  std::vector<V4l2Mode> modes;
  std::vector<V4l2Control> controls;
};

// What does not change when a device is unplugged and comes back.
struct V4l2Identity {
  std::string bus;
  std::string card;
  int index = 0;  // among the nodes of that bus and card that capture video
};

// All that an open node can do. Throws std::runtime_error, without its name, if it is no camera
// that streams single-plane video.
V4l2Device describe_v4l2(const V4l2Node& node, const std::string& path);

// A control as it is now; nothing if the device has none of this number.
std::optional<V4l2Control> read_control(const V4l2Node& node, std::uint32_t id);

// Of V4L2_CID_EXPOSURE_ABSOLUTE.
inline constexpr double v4l2_exposure_unit_s = 1e-4;

// The range of exposure times that can be set, shortest first; nothing if the device tells none.
std::optional<ExposureRange> exposure_range(const V4l2Device& device);

// The exposure time that is set; 0 if it is automatic, or not told.
double fixed_exposure_s(const V4l2Node& node);

// Of the device behind a path.
V4l2Identity identity_of(const std::shared_ptr<V4l2Io>& io, const std::string& path);
// Where the device is now; nothing if it is not there.
std::optional<std::string> find_v4l2(const std::shared_ptr<V4l2Io>& io,
                                     const V4l2Identity& identity);

struct V4l2Listing {
  struct Closed {
    std::string path;
    std::string reason;
  };
  std::vector<V4l2Device> devices;
  std::vector<Closed> closed;  // nodes that could not be opened
};
// Every node that captures video.
V4l2Listing list_v4l2(const std::shared_ptr<V4l2Io>& io);

// The rate of an interval between frames; nothing if it is absurd.
std::optional<Rational> rate_of_interval(const v4l2_fract& interval);

// "no permission", "it is used by another program": an errno in words, and what to do.
std::string reason_of(int error);

}  // namespace capture
