// Shots and HDR pictures from files.
#include "capture/make_hdr.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <future>
#include <stdexcept>
#include <thread>
#include <utility>

#include "capture/camera_response.h"
#include "capture/exif.h"
#include "capture/exr.h"
#include "capture/files.h"
#include "capture/hdr.h"
#include "capture/median.h"
#include "capture/rgbe.h"
#include "capture/still.h"

namespace capture {
namespace {

enum class Kind { still, exr, rgbe };

bool starts_with(std::span<const std::byte> bytes, std::string_view magic) {
  return bytes.size() >= magic.size() &&
         std::equal(magic.begin(), magic.end(), bytes.begin(),
                    [](char a, std::byte b) { return static_cast<std::byte>(a) == b; });
}

// By the first bytes: names lie.
Kind kind_of(std::span<const std::byte> bytes) {
  if (starts_with(bytes, "\x76\x2f\x31\x01")) return Kind::exr;
  if (starts_with(bytes, "#?")) return Kind::rgbe;
  return Kind::still;
}

struct ShotFile {
  Kind kind = Kind::still;
  Still8 still;   // of stills
  Image picture;  // of HDR pictures
  ShotSettings settings;
};

ShotFile read_shot(const std::string& path) {
  ShotFile file;
  const std::vector<std::byte> bytes = read_file(path);
  file.kind = kind_of(bytes);
  switch (file.kind) {
    case Kind::exr:
      file.picture = read_exr(path);
      limit_infinite(file.picture);
      break;
    case Kind::rgbe:
      file.picture = read_rgbe(path);
      limit_infinite(file.picture);
      break;
    case Kind::still:
      file.still = decode_still8(bytes, path);
      file.settings = shot_settings(bytes);
      break;
  }
  return file;
}

std::vector<ShotFile> read_shots(std::span<const std::string> paths) {
  std::vector<std::future<ShotFile>> reading;
  for (const std::string& path : paths) {
    reading.push_back(std::async(std::launch::async, read_shot, path));
  }
  std::vector<ShotFile> files;
  for (std::future<ShotFile>& file : reading) files.push_back(file.get());
  return files;
}

void require_one_kind_and_size(std::span<const std::string> paths,
                               std::span<const ShotFile> files) {
  const auto size_of = [](const ShotFile& file) {
    return file.kind == Kind::still ? std::pair{file.still.width, file.still.height}
                                    : std::pair{file.picture.width, file.picture.height};
  };
  const auto text_of = [](std::pair<int, int> size) {
    return std::to_string(size.first) + " x " + std::to_string(size.second);
  };
  for (std::size_t i = 1; i < files.size(); ++i) {
    if ((files[i].kind == Kind::still) != (files[0].kind == Kind::still)) {
      throw std::runtime_error(paths[i] + ": is a shot and " + paths[0] +
                               " an HDR picture, or the other way round; merge one kind at a time");
    }
    if (size_of(files[i]) != size_of(files[0])) {
      throw std::runtime_error(paths[i] + ": is " + text_of(size_of(files[i])) + " pixels, but " +
                               paths[0] + " is " + text_of(size_of(files[0])) +
                               "; the shots of a bracket need one size");
    }
  }
}

std::vector<double> exposures_of(std::span<const std::string> paths,
                                 std::span<const ShotFile> files,
                                 const HdrOptions& options) {
  if (!options.exposures_s.empty()) return options.exposures_s;
  std::vector<double> exposures_s;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (files[i].settings.exposure_s == 0) {
      throw std::runtime_error(paths[i] +
                               ": tells no exposure time; state the exposures of all shots");
    }
    const auto tells_as_first = [&](double ShotSettings::*value, const char* what) {
      const bool here = files[i].settings.*value > 0, first = files[0].settings.*value > 0;
      if (here == first) return;
      throw std::runtime_error(paths[here ? 0 : i] + ": tells no " + what + ", but " +
                               paths[here ? i : 0] + " does; state the exposures of all shots");
    };
    tells_as_first(&ShotSettings::f_number, "f-number");
    tells_as_first(&ShotSettings::iso, "ISO");
    // Seconds, as long as f-number and ISO stay; else the seconds that would have given as much
    // light at the first shot's.
    const double gain_of_first =
        exposure_value(files[0].settings) / snapped_exposure_s(files[0].settings.exposure_s);
    exposures_s.push_back(exposure_value(files[i].settings) / gain_of_first);
  }
  return exposures_s;
}

// The first three channels; grey three times.
Image three_channels(const Image& image) {
  if (image.channels == 3) return image;
  Image rgb = make_image(image.height, image.width, 3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < 3; ++c) rgb.at(y, x, c) = image.at(y, x, image.channels == 1 ? 0 : c);
    }
  }
  return rgb;
}

std::vector<std::uint8_t> rgb_codes(const Still8& still) {
  if (still.channels == 3) return still.texels;
  std::vector<std::uint8_t> codes;
  const auto step = static_cast<std::size_t>(still.channels);
  codes.reserve(still.texels.size() / step * 3);
  for (std::size_t i = 0; i < still.texels.size(); i += step) {
    codes.insert(codes.end(), {still.texels[i], still.texels[i + 1], still.texels[i + 2]});
  }
  return codes;
}

void merge_stills(std::vector<ShotFile> files, const HdrOptions& options, HdrResult& result) {
  std::vector<CodedShot> shots;
  for (std::size_t i = 0; i < files.size(); ++i) {
    Still8& still = files[i].still;
    shots.push_back({{still.width, still.height, 3, rgb_codes(still)}, result.exposures_s[i]});
    still = {};
  }
  constexpr std::size_t enough_to_recover = 3;
  if (options.response == "auto" && shots.size() >= enough_to_recover) {
    ResponseFit fit = recover_response(shots);
    result.response = std::move(fit.response);
    result.exposures_s = std::move(fit.exposures_s);
    result.heldout_error = fit.heldout_error;
    result.candidates = std::move(fit.candidates);
    result.warnings = std::move(fit.warnings);
  } else if (options.response == "auto" || options.response == "sRGB") {
    result.response = srgb_response();
  } else if (options.response == "linear") {
    result.response = linear_response();
  } else {
    result.response = read_response(options.response).curve;
  }
  const std::array channels{response_code_table(result.response, 0),
                            response_code_table(result.response, 1),
                            response_code_table(result.response, 2)};
  MergeTables tables(channels, static_cast<int>(shots.size()));
  tables.set_exposures(result.exposures_s);
  std::vector<const std::uint8_t*> codes;
  for (const CodedShot& shot : shots) codes.push_back(shot.still.texels.data());
  const Still8& first = shots[0].still;
  result.radiance = make_image(first.height, first.width, 3);
  std::vector<std::future<void>> merging;
  const int strips = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 16);
  for (int i = 0; i < strips; ++i) {
    merging.push_back(std::async(std::launch::async, [&, i] {
      tables.merge(codes, first.width, first.height * i / strips, first.height * (i + 1) / strips,
                   result.radiance.pixels.data());
    }));
  }
  for (std::future<void>& strip : merging) strip.get();
  result.shares = check_bracket(codes, result.exposures_s, channels, result.radiance);
  for (std::string& warning : warnings_of(result.shares)) {
    result.warnings.push_back(std::move(warning));
  }
}

void merge_pictures(std::vector<ShotFile> files, HdrResult& result) {
  std::vector<Shot> shots;
  for (std::size_t i = 0; i < files.size(); ++i) {
    shots.push_back({three_channels(files[i].picture), result.exposures_s[i]});
  }
  result.response = linear_response();
  result.radiance = merge_shots(shots);
}

}  // namespace

HdrResult make_hdr(std::span<const std::string> paths, const HdrOptions& options) {
  if (paths.empty()) throw std::invalid_argument("there are no shots to merge");
  if (!options.exposures_s.empty() && options.exposures_s.size() != paths.size()) {
    throw std::invalid_argument("there are " + std::to_string(options.exposures_s.size()) +
                                " exposures for " + std::to_string(paths.size()) + " shots");
  }
  const auto start = std::chrono::steady_clock::now();
  std::vector<ShotFile> files = read_shots(paths);
  require_one_kind_and_size(paths, files);
  HdrResult result;
  if (files[0].kind == Kind::still) {
    result.exposures_s = exposures_of(paths, files, options);
    merge_stills(std::move(files), options, result);
  } else if (files.size() == 1 && options.exposures_s.empty()) {
    result.response = linear_response();
    result.radiance = three_channels(files[0].picture);
    if (std::string warning = warning_of_nan(result.radiance); !warning.empty()) {
      result.warnings.push_back(std::move(warning));
      std::ranges::replace_if(
          result.radiance.pixels, [](float v) { return std::isnan(v); }, 0.0F);
    }
  } else {
    result.exposures_s = exposures_of(paths, files, options);
    merge_pictures(std::move(files), result);
  }
  result.time_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return result;
}

std::string warning_of_nan(const Image& image) {
  const auto count = std::ranges::count_if(image.pixels, [](float v) { return std::isnan(v); });
  if (count == 0) return "";
  const double share = static_cast<double>(count) / static_cast<double>(image.pixels.size());
  const std::string percent = share < 0.01 ? "below 1" : std::to_string(std::lround(100 * share));
  return std::to_string(count) + " values (" + percent + " %) are no numbers and count as black";
}

double range_stops(const Image& radiance) {
  if (radiance.channels < 3) throw std::invalid_argument("the range is taken of RGB images");
  constexpr double tail = 1e-3;
  std::vector<double> luminance;
  const auto step = static_cast<std::size_t>(radiance.channels);
  for (std::size_t i = 0; i + step <= radiance.pixels.size(); i += step) {
    const float* rgb = &radiance.pixels[i];
    const double y = 0.2126 * static_cast<double>(rgb[0]) + 0.7152 * static_cast<double>(rgb[1]) +
                     0.0722 * static_cast<double>(rgb[2]);
    if (y > 0 && std::isfinite(y)) luminance.push_back(y);
  }
  if (luminance.empty()) return 0;
  const double faintest = quantile_in_place(luminance, tail);
  return std::log2(quantile_in_place(luminance, 1 - tail) / faintest);
}

}  // namespace capture
