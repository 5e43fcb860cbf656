// Cameras by URI.
#include "capture/camera.h"

#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "capture/aravis_camera.h"
#include "capture/aravis_request.h"
#include "capture/camera_response.h"
#include "capture/genicam_format.h"
#include "capture/linearise.h"
#include "capture/picture_camera.h"
#include "capture/replay.h"
#include "capture/sequence.h"
#include "capture/v4l2_camera.h"
#include "capture/v4l2_format.h"
#include "capture/v4l2_request.h"
#include "capture/video_file.h"

namespace capture {
namespace {

std::string absolute(std::string_view path, const CameraOptions& options) {
  const std::filesystem::path given(path);
  return (given.is_absolute() || options.base_dir.empty()
              ? given
              : std::filesystem::path(options.base_dir) / given)
      .string();
}

LightCurves curves_of(const CameraOptions& options) {
  if (options.response.empty()) {
    return {options.colour, std::nullopt, options.mark_saturated, options.alpha};
  }
  const auto response =
      std::make_shared<const CameraResponse>(read_response(absolute(options.response, options)));
  const auto curve_of = [&](int channel) -> Curve {
    return [response, channel](double value) { return response->light(channel, value); };
  };
  return {options.colour, std::array{curve_of(0), curve_of(1), curve_of(2)}, options.mark_saturated,
          options.alpha};
}

std::unique_ptr<Camera> open_file(std::string_view rest, const CameraOptions& options) {
  const std::string path = absolute(rest, options);
  const LightCurves curves = curves_of(options);
  if (is_sequence(path)) {
    return open_sequence(path, options, curves);
  }
  if (is_picture(path)) {
    const Rational rate = options.loop ? options.picture_rate : Rational{};
    return make_picture_camera(path, {PictureEntry{path, {}, exposure_in(path), {}, {}}}, rate,
                               options, curves);
  }
  return open_video_file(path, options, curves);
}

std::unique_ptr<Camera> open_replay_uri(std::string_view rest, const CameraOptions& options) {
  return open_replay(absolute(rest, options), options, curves_of(options));
}

std::unique_ptr<Camera> open_v4l2_uri(std::string_view rest, const CameraOptions& options) {
  return open_v4l2(rest, options, curves_of(options));
}

std::unique_ptr<Camera> open_aravis_uri(std::string_view rest, const CameraOptions& options) {
  return open_aravis(rest, options, curves_of(options));
}

std::map<std::string, CameraOpener, std::less<>>& openers() {
  static std::map<std::string, CameraOpener, std::less<>> by_scheme{{"aravis", open_aravis_uri},
                                                                    {"file", open_file},
                                                                    {"replay", open_replay_uri},
                                                                    {"v4l2", open_v4l2_uri}};
  return by_scheme;
}

struct SchemeAndRest {
  std::string_view scheme;  // "" = none, a bare path
  std::string_view rest;
};

// A path may have a colon in it. Throws std::runtime_error if there is no such scheme.
SchemeAndRest parts_of_uri(std::string_view uri, const CameraOptions& options) {
  const std::size_t colon = uri.find(':');
  const std::string_view scheme = uri.substr(0, colon == uri.npos ? 0 : colon);
  if (openers().contains(scheme)) return {scheme, uri.substr(colon + 1)};
  if (scheme.empty() || scheme.find('/') != scheme.npos ||
      std::filesystem::exists(absolute(uri, options))) {
    return {"", uri};
  }
  std::string known;
  for (const auto& [name, opener] : openers()) {
    known += (known.empty() ? "" : ", ") + name + ":";
  }
  throw std::runtime_error("no camera is called " + std::string(scheme) + ":; there are " + known);
}

[[noreturn]] void refuse_format(const std::string& name) {
  throw std::runtime_error("format " + name +
                           " is not read (platelight devices lists what each camera has)");
}

void check_v4l2_uri(std::string_view rest) {
  const V4l2Request request = parse_v4l2(rest);
  if (request.fourcc && coding_of(*request.fourcc) == nullptr) {
    refuse_format(name_of_fourcc(*request.fourcc));
  }
}

void check_aravis_uri(std::string_view rest) {
  const AravisRequest request = parse_aravis(rest);
  if (request.format && genicam_format_of(*request.format) == nullptr) {
    refuse_format(*request.format);
  }
}

}  // namespace

double Camera::set_exposure(double exposure_s) {
  throw std::runtime_error(
      "an exposure of " + std::to_string(exposure_s) +
      " s was asked of a source whose exposure cannot be set: " + info().description);
}

void register_camera(std::string scheme, CameraOpener opener) {
  openers()[std::move(scheme)] = std::move(opener);
}

std::unique_ptr<Camera> open_camera(std::string_view uri, const CameraOptions& options) {
  if (options.picture_rate.num <= 0 || options.picture_rate.den <= 0) {
    throw std::invalid_argument("pictures need a rate above 0");
  }
  const auto parts = [&] {
    try {
      return parts_of_uri(uri, options);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("cannot open " + std::string(uri) + ": " + error.what());
    }
  }();
  if (parts.scheme.empty()) return open_file(uri, options);
  return openers().find(parts.scheme)->second(parts.rest, options);
}

bool is_device(std::string_view uri) {
  return uri.starts_with("v4l2:") || uri.starts_with("aravis:");
}

std::string missing_pictures(std::string_view uri, const CameraOptions& options) {
  constexpr std::size_t most_gaps = 8;
  std::string missing;
  try {
    const auto [scheme, rest] = parts_of_uri(uri, options);
    const std::string path = absolute(rest, options);
    if ((scheme != "" && scheme != "file") || !is_sequence(path)) return "";
    const auto gaps = missing_numbers(numbered_files(path));
    for (std::size_t i = 0; i < gaps.size() && i < most_gaps; ++i) {
      const auto [first, last] = gaps[i];
      missing += (i > 0 ? ", " : "") + std::to_string(first);
      if (last > first) missing += " to " + std::to_string(last);
    }
    if (gaps.size() > most_gaps) {
      missing += " and " + std::to_string(gaps.size() - most_gaps) + " more gaps";
    }
  } catch (const std::runtime_error&) {
    return "";
  }
  return missing;
}

bool has_scheme(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  return colon != uri.npos && openers().contains(uri.substr(0, colon));
}

void check_camera_uri(std::string_view uri) {
  const auto [scheme, rest] = parts_of_uri(uri, {});
  if (scheme == "v4l2") check_v4l2_uri(rest);
  if (scheme == "aravis") check_aravis_uri(rest);
}

}  // namespace capture
