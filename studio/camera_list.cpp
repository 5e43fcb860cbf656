// Lists of cameras.
#include "studio/camera_list.h"

#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/v4l2_format.h"
#include "capture/v4l2_request.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

bool is_read(const capture::V4l2Mode& mode) { return capture::coding_of(mode.fourcc) != nullptr; }

void add_lines(const capture::V4l2Device& device, std::vector<std::string>& lines) {
  lines.push_back(fmt::format("v4l2:{}  {} ({}), also v4l2:{}", device.path, device.card,
                              device.driver, device.bus));
  for (const capture::V4l2Mode& mode : device.modes) {
    lines.push_back(fmt::format("  {} {} at {}{}", capture::name_of_fourcc(mode.fourcc),
                                capture::sizes_of(mode), capture::rates_of(mode),
                                is_read(mode) ? "" : " (not read)"));
  }
  if (device.modes.empty()) lines.emplace_back("  it lists no formats");
  if (const auto range = capture::exposure_range(device)) {
    lines.push_back(
        fmt::format("  exposure {:.4g} to {:.4g} s (exposure_time_absolute in 0.0001 s)",
                    range->shortest_s, range->longest_s));
  } else {
    lines.emplace_back("  exposure: it tells no range in seconds");
  }
  for (const capture::V4l2Control& control : device.controls) {
    lines.push_back(fmt::format("  {} {} to {}, now {}{}", control.name, control.low, control.high,
                                control.value,
                                !control.settable  ? " (read only)"
                                : control.inactive ? " (another control is automatic)"
                                                   : ""));
  }
}

Json mode_json(const capture::V4l2Mode& mode) {
  Json rates = Json::array();
  for (const capture::Rational rate : mode.rates) rates.push_back(rate.value());
  return {{"format", capture::name_of_fourcc(mode.fourcc)},
          {"read", is_read(mode)},
          {"min_size", std::array{mode.min_width, mode.min_height}},
          {"max_size", std::array{mode.max_width, mode.max_height}},
          {"rates", rates},
          {"rates_between", mode.rates_between}};
}

Json control_json(const capture::V4l2Control& control) {
  return {{"name", control.name},         {"low", control.low},          {"high", control.high},
          {"step", control.step},         {"default", control.normal},   {"value", control.value},
          {"settable", control.settable}, {"inactive", control.inactive}};
}

Json device_json(const capture::V4l2Device& device) {
  Json modes = Json::array();
  for (const capture::V4l2Mode& mode : device.modes) modes.push_back(mode_json(mode));
  Json controls = Json::array();
  for (const capture::V4l2Control& control : device.controls) {
    controls.push_back(control_json(control));
  }
  Json exposure = nullptr;
  if (const auto range = capture::exposure_range(device)) {
    exposure = std::array{range->shortest_s, range->longest_s};
  }
  return {{"uri", "v4l2:" + device.path}, {"path", device.path},     {"bus", device.bus},
          {"name", device.card},          {"driver", device.driver}, {"modes", modes},
          {"exposure_s", exposure},       {"controls", controls}};
}

}  // namespace

std::vector<std::string> camera_lines(const capture::V4l2Listing& listing) {
  std::vector<std::string> lines;
  for (const capture::V4l2Device& device : listing.devices) add_lines(device, lines);
  if (listing.devices.empty()) {
    lines.emplace_back(listing.closed.empty()
                           ? "no camera: there is no /dev/video device that captures"
                           : "no camera that can be opened");
  }
  for (const capture::V4l2Listing::Closed& closed : listing.closed) {
    lines.push_back(fmt::format("{}: {}", closed.path, closed.reason));
  }
  return lines;
}

std::string cameras_json(const capture::V4l2Listing& listing) {
  Json cameras = Json::array();
  for (const capture::V4l2Device& device : listing.devices) cameras.push_back(device_json(device));
  Json closed = Json::array();
  for (const capture::V4l2Listing::Closed& one : listing.closed) {
    closed.push_back({{"path", one.path}, {"reason", one.reason}});
  }
  // Devices' names may hold any bytes.
  return Json{{"cameras", cameras}, {"closed", closed}}.dump(2, ' ', false,
                                                             Json::error_handler_t::replace);
}

}  // namespace studio
