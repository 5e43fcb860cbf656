// Descriptions of V4L2 devices.
#include "capture/v4l2_device.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <numeric>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <linux/videodev2.h>

#include "capture/libav.h"

namespace capture {
namespace {

// A device that lists more than these is not believed.
constexpr std::uint32_t max_formats = 128;
constexpr std::uint32_t max_sizes = 512;
constexpr std::uint32_t max_rates = 128;
constexpr int max_controls = 1024;

template <std::size_t size>
std::string text_of(const __u8 (&field)[size]) {
  const auto* const begin = reinterpret_cast<const char*>(field);
  std::string text(begin, strnlen(begin, size));
  std::ranges::replace_if(
      text, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return text;
}

std::uint32_t capabilities_of(const v4l2_capability& capability) {
  return (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                               : capability.capabilities;
}

bool captures_video(const v4l2_capability& capability) {
  return (capabilities_of(capability) & V4L2_CAP_VIDEO_CAPTURE) != 0;
}

v4l2_capability query(const V4l2Node& node) {
  v4l2_capability capability{};
  if (const int error = node.call(VIDIOC_QUERYCAP, &capability); error < 0) {
    throw std::runtime_error("it is no V4L2 device: " + reason_of(-error));
  }
  return capability;
}

void read_rates(const V4l2Node& node, V4l2Mode& mode) {
  for (std::uint32_t i = 0; i < max_rates; ++i) {
    v4l2_frmivalenum interval{};
    interval.index = i;
    interval.pixel_format = mode.fourcc;
    interval.width = static_cast<std::uint32_t>(mode.max_width);
    interval.height = static_cast<std::uint32_t>(mode.max_height);
    if (node.call(VIDIOC_ENUM_FRAMEINTERVALS, &interval) < 0) break;
    const bool discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const auto first = rate_of_interval(discrete ? interval.discrete : interval.stepwise.min);
    if (first) mode.rates.push_back(*first);
    if (discrete) continue;
    if (const auto last = rate_of_interval(interval.stepwise.max)) mode.rates.push_back(*last);
    mode.rates_between = mode.rates.size() == 2;
    break;
  }
  std::ranges::sort(mode.rates, [](Rational a, Rational b) { return a.value() > b.value(); });
}

bool is_size(std::uint32_t width, std::uint32_t height) {
  constexpr std::uint32_t most = libav::max_side;
  return width > 0 && height > 0 && width <= most && height <= most;
}

void read_sizes(const V4l2Node& node, std::uint32_t fourcc, std::vector<V4l2Mode>& modes) {
  for (std::uint32_t i = 0; i < max_sizes; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = fourcc;
    if (node.call(VIDIOC_ENUM_FRAMESIZES, &size) < 0) break;
    V4l2Mode mode;
    mode.fourcc = fourcc;
    const bool discrete = size.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    const auto& range = size.stepwise;
    const v4l2_frmsize_stepwise same{size.discrete.width,  size.discrete.width,  1,
                                     size.discrete.height, size.discrete.height, 1};
    v4l2_frmsize_stepwise sizes = discrete ? same : range;
    sizes.max_width = std::min<std::uint32_t>(sizes.max_width, libav::max_side);
    sizes.max_height = std::min<std::uint32_t>(sizes.max_height, libav::max_side);
    if (is_size(sizes.min_width, sizes.min_height) && sizes.min_width <= sizes.max_width &&
        sizes.min_height <= sizes.max_height) {
      mode.min_width = static_cast<int>(sizes.min_width);
      mode.max_width = static_cast<int>(sizes.max_width);
      mode.min_height = static_cast<int>(sizes.min_height);
      mode.max_height = static_cast<int>(sizes.max_height);
      mode.width_step = static_cast<int>(std::clamp<std::uint32_t>(sizes.step_width, 1, 4096));
      mode.height_step = static_cast<int>(std::clamp<std::uint32_t>(sizes.step_height, 1, 4096));
      read_rates(node, mode);
      modes.push_back(std::move(mode));
    }
    if (!discrete) break;
  }
}

// For devices that list formats and no sizes: the one they are set to.
void read_set_size(const V4l2Node& node, std::uint32_t fourcc, std::vector<V4l2Mode>& modes) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (node.call(VIDIOC_G_FMT, &format) < 0) return;
  const v4l2_pix_format& set = format.fmt.pix;
  if (!is_size(set.width, set.height)) return;
  const auto width = static_cast<int>(set.width);
  const auto height = static_cast<int>(set.height);
  modes.push_back({fourcc, width, width, 1, height, height, 1, {}, false});
}

std::vector<V4l2Mode> read_modes(const V4l2Node& node) {
  std::vector<V4l2Mode> modes;
  for (std::uint32_t i = 0; i < max_formats; ++i) {
    v4l2_fmtdesc format{};
    format.index = i;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (node.call(VIDIOC_ENUM_FMT, &format) < 0) break;
    const std::size_t before = modes.size();
    read_sizes(node, format.pixelformat, modes);
    if (modes.size() == before) read_set_size(node, format.pixelformat, modes);
  }
  return modes;
}

// As v4l2-ctl spells it.
std::string control_name(const char* text, std::size_t size) {
  std::string name;
  bool gap = false;
  for (std::size_t i = 0; i < size && text[i] != '\0'; ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (std::isalnum(c) == 0) {
      gap = !name.empty();
      continue;
    }
    if (gap) name += '_';
    gap = false;
    name += static_cast<char>(std::tolower(c));
  }
  return name;
}

std::optional<V4l2Control> control_of(const V4l2Node& node, const v4l2_query_ext_ctrl& its) {
  switch (its.type) {
    case V4L2_CTRL_TYPE_INTEGER:
    case V4L2_CTRL_TYPE_BOOLEAN:
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
    case V4L2_CTRL_TYPE_INTEGER64:
    case V4L2_CTRL_TYPE_BITMASK:
      break;
    default:
      return std::nullopt;
  }
  if (its.nr_of_dims > 0 || (its.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return std::nullopt;
  V4l2Control control;
  control.id = its.id;
  control.name = control_name(its.name, sizeof its.name);
  control.low = its.minimum;
  control.high = its.maximum;
  control.step = static_cast<std::int64_t>(std::clamp<std::uint64_t>(its.step, 1, 1U << 31U));
  control.normal = its.default_value;
  control.value = its.default_value;
  control.settable = (its.flags & V4L2_CTRL_FLAG_READ_ONLY) == 0;
  control.inactive = (its.flags & V4L2_CTRL_FLAG_INACTIVE) != 0;
  v4l2_ext_control value{};
  value.id = its.id;
  v4l2_ext_controls one{};
  one.which = V4L2_CTRL_WHICH_CUR_VAL;
  one.count = 1;
  one.controls = &value;
  if ((its.flags & V4L2_CTRL_FLAG_WRITE_ONLY) == 0 && node.call(VIDIOC_G_EXT_CTRLS, &one) >= 0) {
    control.value = its.type == V4L2_CTRL_TYPE_INTEGER64 ? value.value64 : value.value;
  }
  return control;
}

std::vector<V4l2Control> read_controls(const V4l2Node& node) {
  std::vector<V4l2Control> controls;
  std::uint32_t id = 0;
  for (int i = 0; i < max_controls; ++i) {
    v4l2_query_ext_ctrl its{};
    its.id = id | V4L2_CTRL_FLAG_NEXT_CTRL;
    if (node.call(VIDIOC_QUERY_EXT_CTRL, &its) < 0 || its.id <= id) break;
    id = its.id;
    if (auto control = control_of(node, its)) controls.push_back(std::move(*control));
  }
  return controls;
}

struct Seen {
  std::string path;
  std::string bus;
  std::string card;
};

// The nodes that open and capture video.
std::vector<Seen> cameras_now(const std::shared_ptr<V4l2Io>& io) {
  std::vector<Seen> cameras;
  for (const std::string& path : io->nodes()) {
    try {
      const V4l2Node node(io, path);
      const v4l2_capability capability = query(node);
      if (!captures_video(capability)) continue;
      cameras.push_back({path, text_of(capability.bus_info), text_of(capability.card)});
    } catch (const std::runtime_error&) {
      continue;  // another device, or one that is just going
    }
  }
  return cameras;
}

}  // namespace

bool V4l2Mode::has_size(int width, int height) const {
  return width >= min_width && width <= max_width && (width - min_width) % width_step == 0 &&
         height >= min_height && height <= max_height && (height - min_height) % height_step == 0;
}

std::string reason_of(int error) {
  switch (error) {
    case EACCES:
    case EPERM:
      return "no permission; add yourself to the group video (sudo usermod -aG video $USER) and "
             "log in again";
    case ENOENT:
    case ENXIO:
      return "there is no such device";
    case ENODEV:
      return "the device is gone; is it plugged in?";
    case EBUSY:
      return "another program uses it; end that one first";
    case ENOTTY:
      return "it cannot do that";
    default:
      return std::generic_category().message(error);
  }
}

std::optional<Rational> rate_of_interval(const v4l2_fract& interval) {
  if (interval.numerator == 0 || interval.denominator == 0) return std::nullopt;
  const std::int64_t divisor =
      std::gcd(std::int64_t{interval.numerator}, std::int64_t{interval.denominator});
  return Rational{interval.denominator / divisor, interval.numerator / divisor};
}

V4l2Device describe_v4l2(const V4l2Node& node, const std::string& path) {
  const v4l2_capability capability = query(node);
  const std::uint32_t can = capabilities_of(capability);
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    throw std::runtime_error((can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
                                 ? "it delivers pictures in several planes, which is not handled"
                                 : "it captures no video");
  }
  if ((can & V4L2_CAP_STREAMING) == 0) {
    throw std::runtime_error("it cannot stream into mapped memory");
  }
  V4l2Device device;
  device.path = path;
  device.bus = text_of(capability.bus_info);
  device.card = text_of(capability.card);
  device.driver = text_of(capability.driver);
  device.modes = read_modes(node);
  device.controls = read_controls(node);
  return device;
}

std::optional<V4l2Control> read_control(const V4l2Node& node, std::uint32_t id) {
  v4l2_query_ext_ctrl its{};
  its.id = id;
  if (node.call(VIDIOC_QUERY_EXT_CTRL, &its) < 0) return std::nullopt;
  return control_of(node, its);
}

std::optional<ExposureRange> exposure_range(const V4l2Device& device) {
  const auto found = std::ranges::find(device.controls, std::uint32_t{V4L2_CID_EXPOSURE_ABSOLUTE},
                                       &V4l2Control::id);
  if (found == device.controls.end() || found->high <= 0) return std::nullopt;
  return ExposureRange{
      v4l2_exposure_unit_s * static_cast<double>(std::max<std::int64_t>(found->low, 1)),
      v4l2_exposure_unit_s * static_cast<double>(found->high)};
}

double fixed_exposure_s(const V4l2Node& node) {
  const auto time = read_control(node, V4L2_CID_EXPOSURE_ABSOLUTE);
  if (!time || time->inactive || time->value <= 0) return 0;
  if (const auto automatic = read_control(node, V4L2_CID_EXPOSURE_AUTO);
      automatic && automatic->value != V4L2_EXPOSURE_MANUAL &&
      automatic->value != V4L2_EXPOSURE_SHUTTER_PRIORITY) {
    return 0;
  }
  return v4l2_exposure_unit_s * static_cast<double>(time->value);
}

V4l2Identity identity_of(const std::shared_ptr<V4l2Io>& io, const std::string& path) {
  const V4l2Node node(io, path);
  const v4l2_capability capability = query(node);
  V4l2Identity identity{text_of(capability.bus_info), text_of(capability.card), 0};
  std::error_code none;
  const std::string real = std::filesystem::weakly_canonical(path, none).string();
  int index = 0;
  for (const Seen& seen : cameras_now(io)) {
    if (seen.bus != identity.bus || seen.card != identity.card) continue;
    if (seen.path == path || seen.path == real) identity.index = index;
    ++index;
  }
  return identity;
}

std::optional<std::string> find_v4l2(const std::shared_ptr<V4l2Io>& io,
                                     const V4l2Identity& identity) {
  int index = 0;
  for (const Seen& seen : cameras_now(io)) {
    const bool same =
        seen.bus == identity.bus && (identity.card.empty() || seen.card == identity.card);
    if (same && index++ == identity.index) return seen.path;
  }
  return std::nullopt;
}

V4l2Listing list_v4l2(const std::shared_ptr<V4l2Io>& io) {
  V4l2Listing listing;
  for (const std::string& path : io->nodes()) {
    try {
      const V4l2Node node(io, path);
      if (!captures_video(query(node))) continue;
      listing.devices.push_back(describe_v4l2(node, path));
    } catch (const std::system_error& error) {
      listing.closed.push_back({path, reason_of(error.code().value())});
    } catch (const std::runtime_error& error) {
      listing.closed.push_back({path, error.what()});
    }
  }
  return listing;
}

}  // namespace capture
