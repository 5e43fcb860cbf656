// platelight bench hdr: what a live lightprobe costs, from a camera's bytes to merged radiance.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/bracketed_camera.h"
#include "capture/coded_picture.h"
#include "capture/made_sensor.h"
#include "capture/pool.h"
#include "capture/v4l2_format.h"
#include "studio/commands/benches.h"
#include "studio/json_text.h"
#include "studio/machine.h"
#include "studio/rolling_bracket.h"

namespace studio {
namespace {

constexpr int side = 1024;
constexpr double exposures_s[] = {1e-4, 1.6e-3, 4e-4, 1.6e-2, 6.4e-3};
constexpr capture::Rational bracket_rate{60, 1};
constexpr int frames_of_pass = 40;

struct Format {
  const char* name;
  const char* fourcc;
  int bits;
  int channels;  // of the sensor
};
constexpr Format formats[] = {{"grey, 8 bit", "GREY", 8, 1},
                              {"grey, 12 bit", "Y12", 12, 1},
                              {"Bayer, 8 bit", "RGGB", 8, 3},
                              {"Bayer, 12 bit", "RG12", 12, 3},
                              {"RGB, 8 bit", "RGB3", 8, 3}};

// A room of eleven stops that saturates the longest exposure.
capture::Image made_room() {
  capture::Image image = capture::make_image(side, side);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double slope = std::sin(0.011 * x + 1) * std::cos(0.008 * y);
      for (int c = 0; c < 3; ++c) {
        image.at(y, x, c) = static_cast<float>(std::exp2(7.5 + 5.5 * slope + 0.2 * c));
      }
    }
  }
  return image;
}

// The bytes of one exposure, as a camera sends them.
std::vector<std::byte> coded(const Format& format, const capture::Image& room, double exposure_s) {
  const capture::MadeSensor sensor{.bits = format.bits, .pedestal = 0};
  const capture::MadeShot shot = capture::expose(sensor, room, exposure_s, 1);
  const bool mosaic = format.channels == 3 && format.fourcc != std::string("RGB3");
  const std::size_t code_bytes = format.bits > 8 ? 2 : 1;
  std::vector<std::byte> bytes;
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 0; x < side; ++x) {
      const std::uint16_t* codes = &shot.codes[3 * (y * side + x)];
      const std::size_t site = y % 2 + x % 2;  // red, green and blue of RGGB
      const std::size_t first = mosaic ? site : format.channels == 1 ? 1 : 0;
      const std::size_t count = mosaic || format.channels == 1 ? 1 : 3;
      const std::size_t at = bytes.size();
      bytes.resize(at + count * code_bytes);
      for (std::size_t c = 0; c < count; ++c) {
        std::memcpy(&bytes[at + c * code_bytes], &codes[first + c], code_bytes);
      }
    }
  }
  return bytes;
}

// Sends what it is asked for without delay, the bytes being there already.
class ReadyCamera final : public capture::Camera {
 public:
  explicit ReadyCamera(const Format& format)
      : reader_({.fourcc = *capture::fourcc_of_name(format.fourcc), .width = side, .height = side},
                {{.transfer = capture::Transfer::linear}, std::nullopt, true}) {
    info_.width = info_.height = side;
    info_.rate = bracket_rate;
    const capture::Image room = made_room();
    for (const double exposure_s : exposures_s)
      pictures_.push_back(coded(format, room, exposure_s));
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::ExposureRange> exposure_range() const override {
    return capture::ExposureRange{2e-5, 1.6e-2};
  }
  double set_exposure(double exposure_s) override { return asked_s_ = exposure_s; }
  std::optional<capture::Frame> next() override {
    const double begin_ms = cpu_ms_so_far();
    const std::shared_ptr<capture::Image> image = images_.lend();
    const auto made = std::ranges::find(exposures_s, in_effect_s_) - std::begin(exposures_s);
    in_effect_s_ = asked_s_;
    reader_.read(pictures_[static_cast<std::size_t>(made) % pictures_.size()], {0, 0, side, side},
                 *image);
    capture::Frame frame;
    frame.time = capture::time_of_frame(number_, bracket_rate);
    frame.number = number_++;
    frame.image = image;
    read_ms_ += cpu_ms_so_far() - begin_ms;
    return frame;
  }
  double take_read_ms() { return std::exchange(read_ms_, 0); }

 private:
  capture::CodedPictureReader reader_;
  capture::CameraInfo info_;
  std::vector<std::vector<std::byte>> pictures_;
  capture::Pool<capture::Image> images_;
  double asked_s_ = exposures_s[0];
  double in_effect_s_ = exposures_s[0];  // of the next frame
  std::int64_t number_ = 0;
  double read_ms_ = 0;
};

struct Cost {
  double read_ms = 1e9, label_ms = 1e9, merge_ms = 1e9;  // CPU, a frame
  double accepted = 0;                                   // share of the frames
  double total_ms() const { return read_ms + label_ms + merge_ms; }
};

Cost measure(const Format& format, int runs) {
  auto made = std::make_unique<ReadyCamera>(format);
  ReadyCamera& ready = *made;
  capture::BracketedCamera camera(std::move(made), "made", exposures_s, {});
  RollingBracket bracket(std::size(exposures_s));
  Cost best;
  std::int64_t frames = 0, accepted = 0;
  for (int run = 0; run <= runs; ++run) {
    Cost cost{0, 0, 0};
    for (int i = 0; i < frames_of_pass; ++i) {
      const double begin_ms = cpu_ms_so_far();
      const capture::Frame frame = *camera.next();
      const double came_ms = cpu_ms_so_far();
      ++frames;
      if (frame.exposure_s > 0) {
        ++accepted;
        bracket.add(frame.image, frame.exposure_s, frame.number, frame.time);
        bracket.merge();
      }
      const double read_ms = ready.take_read_ms();
      cost.read_ms += read_ms / frames_of_pass;
      cost.label_ms += (came_ms - begin_ms - read_ms) / frames_of_pass;
      cost.merge_ms += (cpu_ms_so_far() - came_ms) / frames_of_pass;
    }
    if (run > 0 && cost.total_ms() < best.total_ms()) best = cost;  // the first one warms up
  }
  best.accepted = static_cast<double>(accepted) / static_cast<double>(frames);
  return best;
}

}  // namespace

void bench_hdr(int runs, Console& console) {
  const Machine machine = this_machine();
  console.say(fmt::format("made room, {0}x{0}, {1} exposures; CPU ms of an HDR frame", side,
                          std::size(exposures_s)));
  console.say("camera           read  label  merge    all   of 2 cores at 60/s");
  nlohmann::ordered_json figures;
  for (const Format& format : formats) {
    const Cost cost = measure(format, runs);
    const double share = cost.total_ms() * bracket_rate.value() / 2000;
    console.say(fmt::format("{:<15} {:>5.1f}  {:>5.1f}  {:>5.1f}  {:>5.1f}   {:>5.0f} %",
                            format.name, cost.read_ms, cost.label_ms, cost.merge_ms,
                            cost.total_ms(), 100 * share));
    figures["formats"].push_back({{"format", format.name},
                                  {"read_ms", cost.read_ms},
                                  {"label_ms", cost.label_ms},
                                  {"merge_ms", cost.merge_ms},
                                  {"all_ms", cost.total_ms()},
                                  {"accepted", cost.accepted},
                                  {"of_two_cores_at_60", share}});
  }
  figures["machine"] = {{"cpu", machine.cpu}, {"threads", machine.threads}};
  console.figures(json_text(figures));
}

}  // namespace studio
