// Codes of stills and recordings, for calibration.
#include "capture/calibration_shots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>

#include "capture/camera.h"
#include "capture/exif.h"
#include "capture/files.h"
#include "capture/linearise.h"
#include "capture/still.h"

namespace capture {
namespace {

struct ValueShot {
  Image values;  // 0..1
  double exposure_s = 0;
  std::string name;
};

bool is_jpeg(std::span<const std::byte> bytes) {
  return bytes.size() > 2 && bytes[0] == std::byte{0xff} && bytes[1] == std::byte{0xd8};
}

std::vector<ValueShot> read_stills(std::span<const std::string> paths,
                                   std::span<const double> exposures_s,
                                   CalibrationShots& shots) {
  std::vector<ValueShot> values;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const std::vector<std::byte> bytes = read_file(paths[i]);
    double exposure_s = 0;
    if (!exposures_s.empty()) {
      exposure_s = exposures_s[i];
    } else {
      exposure_s = exposure_s_of(paths[i]);
    }
    ValueShot shot{{}, exposure_s, paths[i]};
    if (is_jpeg(bytes)) {
      shots.compressed = true;
      const Still8 still = decode_still8(bytes, paths[i]);
      shot.values = make_image(still.height, still.width);
      for (std::size_t t = 0; t < still.texels.size(); ++t) {
        shot.values.pixels[t] = static_cast<float>(still.texels[t] / 255.0);
      }
    } else {
      shot.values = read_still(paths[i], {{Transfer::linear}, std::nullopt}).image;
    }
    values.push_back(std::move(shot));
  }
  return values;
}

std::vector<ValueShot> read_recording(const std::string& uri,
                                      const CalibrationShotOptions& options,
                                      CalibrationShots& shots) {
  CameraOptions camera_options;
  camera_options.colour.transfer = Transfer::linear;
  const std::unique_ptr<Camera> camera = open_camera(uri, camera_options);
  if (camera->info().live) {
    throw std::runtime_error(uri + ": is live; record it (platelight capture record) and give " +
                             "replay:DIR");
  }
  if (camera->info().description.starts_with("Bayer") && options.pattern == BayerPattern::none) {
    throw std::runtime_error(uri + ": is of a Bayer sensor; state its pattern, such as rggb");
  }
  std::vector<ValueShot> values;
  std::size_t passed_over = 0;
  std::size_t frames = 0;
  while (static_cast<int>(values.size()) < options.most_frames) {
    const std::optional<Frame> frame = camera->next();
    if (!frame) break;
    const std::size_t number = frames++;
    const double exposure_s =
        number < options.exposures_s.size() ? options.exposures_s[number] : frame->exposure_s;
    if (frame->status != FrameStatus::good || !frame->image ||
        (exposure_s == 0 && options.exposures_s.empty())) {
      ++passed_over;
      continue;
    }
    values.push_back({*frame->image, exposure_s, uri + ", frame " + std::to_string(number)});
  }
  if (!options.exposures_s.empty() && options.exposures_s.size() != frames) {
    throw std::runtime_error(uri + ": has " + std::to_string(frames) + " frames, but " +
                             std::to_string(options.exposures_s.size()) + " exposures were given");
  }
  if (values.empty()) {
    throw std::runtime_error(uri + ": has no good frame with an exposure time; state them");
  }
  if (passed_over > 0) {
    shots.warnings.push_back(std::to_string(passed_over) +
                             " frames are damaged or tell no exposure, and are passed over");
  }
  return values;
}

// How many bits the values are codes of: the fewest of which all are whole codes.
int bits_of(std::span<const ValueShot> values) {
  for (const int bits : {8, 10, 12, 14, 16}) {
    const double last = (1 << bits) - 1;
    const bool whole = std::all_of(values.begin(), values.end(), [&](const ValueShot& shot) {
      constexpr std::size_t stride = 7;  // enough of them
      for (std::size_t i = 0; i < shot.values.pixels.size(); i += stride) {
        const double code = static_cast<double>(shot.values.pixels[i]) * last;
        constexpr double tolerance = 0.02;
        if (std::abs(code - std::round(code)) > tolerance) return false;
      }
      return true;
    });
    if (whole) return bits;
  }
  return 16;
}

bool is_grey(std::span<const ValueShot> values) {
  return std::all_of(values.begin(), values.end(), [](const ValueShot& shot) {
    const std::vector<float>& p = shot.values.pixels;
    for (std::size_t i = 0; i + 2 < p.size(); i += 3) {
      if (p[i] != p[i + 1] || p[i] != p[i + 2]) return false;
    }
    return true;
  });
}

std::vector<std::uint16_t> codes_of(const ValueShot& shot, const CalibrationShots& shots) {
  const double last = (1 << shots.bits) - 1;
  std::vector<std::uint16_t> codes;
  codes.reserve(static_cast<std::size_t>(shots.width) * static_cast<std::size_t>(shots.height) *
                static_cast<std::size_t>(shots.channels));
  const auto add = [&](float value) {
    codes.push_back(static_cast<std::uint16_t>(
        std::lround(std::clamp(static_cast<double>(value), 0.0, 1.0) * last)));
  };
  for (int y = 0; y < shots.height; ++y) {
    for (int x = 0; x < shots.width; ++x) {
      if (shots.pattern != BayerPattern::none) {
        add(shot.values.at(y, x, colour_of_site(shots.pattern, y, x)));
      } else {
        for (int c = 0; c < shots.channels; ++c) add(shot.values.at(y, x, c));
      }
    }
  }
  return codes;
}

// Codes in the upper bits of words, and those of fewer bits in lower ones.
void shift_codes(CalibrationShots& shots) {
  int step = 0;
  int highest = 0;
  for (const std::vector<std::uint16_t>& codes : shots.codes) {
    for (const std::uint16_t code : codes) {
      step = std::gcd(step, int{code});
      highest = std::max(highest, int{code});
    }
  }
  constexpr std::array steps{2, 4, 16, 64};
  const bool shifted = std::find(steps.begin(), steps.end(), step) != steps.end();
  if (shifted && shots.bits > 8) {
    for (std::vector<std::uint16_t>& codes : shots.codes) {
      for (std::uint16_t& code : codes) code = static_cast<std::uint16_t>(code / step);
    }
    highest /= step;
    shots.full_code /= step;
  }
  while (shots.bits > 8 && highest < 1 << (shots.bits - 2)) shots.bits -= 2;
}

}  // namespace

std::vector<SensorShot> CalibrationShots::sensor_shots() const {
  std::vector<SensorShot> shots;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    shots.push_back({width, height, channels, pattern, codes[i], exposures_s[i]});
  }
  return shots;
}

std::vector<CodedShot> CalibrationShots::coded_shots() const {
  std::vector<CodedShot> shots;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const bool known = std::any_of(shots.begin(), shots.end(), [&](const CodedShot& shot) {
      return std::abs(shot.exposure_s / exposures_s[i] - 1) < 1e-3;
    });
    if (known || exposures_s[i] == 0) continue;
    CodedShot shot{{width, height, 3, {}}, exposures_s[i]};
    const int repeats = channels == 3 ? 1 : 3;
    for (const std::uint16_t code : codes[i]) {
      const auto byte =
          static_cast<std::uint8_t>(std::lround(std::min(255.0, 255.0 * code / full_code)));
      for (int r = 0; r < repeats; ++r) shot.still.texels.push_back(byte);
    }
    shots.push_back(std::move(shot));
  }
  return shots;
}

CalibrationShots read_calibration_shots(std::span<const std::string> inputs,
                                        const CalibrationShotOptions& options) {
  if (inputs.empty()) throw std::invalid_argument("there are no shots to calibrate by");
  CalibrationShots shots;
  const bool recording = inputs.size() == 1 && (inputs[0].find(':') != std::string::npos);
  if (!recording && !options.exposures_s.empty() && options.exposures_s.size() != inputs.size()) {
    throw std::invalid_argument("there are " + std::to_string(options.exposures_s.size()) +
                                " exposures for " + std::to_string(inputs.size()) + " shots");
  }
  const std::vector<ValueShot> values = recording ? read_recording(inputs[0], options, shots)
                                                  : read_stills(inputs, options.exposures_s, shots);
  shots.width = values[0].values.width;
  shots.height = values[0].values.height;
  for (const ValueShot& shot : values) {
    if (shot.values.width != shots.width || shot.values.height != shots.height) {
      throw std::runtime_error(shot.name + ": has another size than " + values[0].name +
                               "; the shots need one size");
    }
    shots.exposures_s.push_back(shot.exposure_s);
  }
  shots.pattern = options.pattern;
  shots.channels = shots.pattern != BayerPattern::none || is_grey(values) ? 1 : 3;
  shots.bits = bits_of(values);
  shots.full_code = (1 << shots.bits) - 1;
  for (const ValueShot& shot : values) shots.codes.push_back(codes_of(shot, shots));
  shift_codes(shots);
  return shots;
}

}  // namespace capture
