// Lists of cameras.
#include "studio/camera_list.h"

#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/camera_settings.h"
#include "capture/genicam_format.h"
#include "capture/v4l2_format.h"
#include "capture/v4l2_request.h"
#include "studio/json_text.h"

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

bool is_read(const std::string& format) { return capture::genicam_format_of(format) != nullptr; }

void add_lines(const capture::AravisListing::Entry& entry, std::vector<std::string>& lines) {
  const capture::AravisDevice& device = entry.device;
  const capture::AravisAbilities& abilities = entry.abilities;
  lines.push_back(fmt::format("aravis:{}  {} {} ({}), serial {}, also aravis:{}", device.id,
                              device.vendor, device.model, device.protocol, device.serial,
                              device.address));
  if (!entry.fault.empty()) {
    lines.push_back("  " + entry.fault);
    return;
  }
  std::string formats;
  for (const std::string& format : abilities.formats) {
    formats += (formats.empty() ? "" : ", ") + format + (is_read(format) ? "" : " (not read)");
  }
  lines.push_back("  " + (formats.empty() ? "it lists no formats" : formats));
  if (abilities.smallest && abilities.largest) {
    lines.push_back("  " + capture::words_of(*abilities.smallest) + " to " +
                    capture::words_of(*abilities.largest));
  }
  if (abilities.highest_rate > 0) {
    lines.push_back(
        fmt::format("  {:.5g} to {:.5g}/s", abilities.lowest_rate, abilities.highest_rate));
  }
  if (abilities.exposures) {
    lines.push_back(fmt::format("  exposure {:.4g} to {:.4g} s", abilities.exposures->shortest_s,
                                abilities.exposures->longest_s));
  } else {
    lines.emplace_back("  exposure: it has none that can be set");
  }
}

Json network_json(const capture::AravisListing::Entry& entry) {
  const capture::AravisDevice& device = entry.device;
  const capture::AravisAbilities& abilities = entry.abilities;
  Json formats = Json::array();
  for (const std::string& format : abilities.formats) {
    formats.push_back({{"format", format}, {"read", is_read(format)}});
  }
  const auto size = [](const std::optional<capture::PictureSize>& told) -> Json {
    return told ? Json(std::array{told->width, told->height}) : Json(nullptr);
  };
  Json rates = nullptr;
  if (abilities.highest_rate > 0) rates = std::array{abilities.lowest_rate, abilities.highest_rate};
  Json exposure = nullptr;
  if (abilities.exposures) {
    exposure = std::array{abilities.exposures->shortest_s, abilities.exposures->longest_s};
  }
  return {{"uri", "aravis:" + device.id},
          {"id", device.id},
          {"vendor", device.vendor},
          {"model", device.model},
          {"serial", device.serial},
          {"address", device.address},
          {"protocol", device.protocol},
          {"formats", formats},
          {"min_size", size(abilities.smallest)},
          {"max_size", size(abilities.largest)},
          {"rates", rates},
          {"exposure_s", exposure},
          {"fault", entry.fault}};
}

}  // namespace

std::vector<std::string> camera_lines(const capture::V4l2Listing& listing,
                                      const capture::AravisListing& network) {
  std::vector<std::string> lines;
  for (const capture::V4l2Device& device : listing.devices) add_lines(device, lines);
  for (const capture::AravisListing::Entry& entry : network.cameras) add_lines(entry, lines);
  if (lines.empty()) {
    lines.emplace_back(listing.closed.empty()
                           ? "no camera: there is no /dev/video device that captures, and no GigE "
                             "Vision or USB3 Vision camera answers"
                           : "no camera that can be opened");
  }
  for (const capture::V4l2Listing::Closed& closed : listing.closed) {
    lines.push_back(fmt::format("{}: {}", closed.path, closed.reason));
  }
  return lines;
}

std::string cameras_json(const capture::V4l2Listing& listing,
                         const capture::AravisListing& network) {
  Json cameras = Json::array();
  for (const capture::V4l2Device& device : listing.devices) cameras.push_back(device_json(device));
  for (const capture::AravisListing::Entry& entry : network.cameras) {
    cameras.push_back(network_json(entry));
  }
  Json closed = Json::array();
  for (const capture::V4l2Listing::Closed& one : listing.closed) {
    closed.push_back({{"path", one.path}, {"reason", one.reason}});
  }
  return json_text(Json{{"cameras", cameras}, {"closed", closed}});
}

}  // namespace studio
