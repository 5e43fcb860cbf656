// A made camera that sees a made scene whose light changes: exposures are told to it from frame to
// frame, and act some frames later.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "capture/camera.h"
#include "capture/made_sensor_live.h"

namespace made {

// Radiance of a scene, log-uniform from `least` to `most`, in patches; and some pixels of a lamp.
inline capture::Image make_light(double least, double most, double lamp, int lamp_pixels) {
  constexpr int size = 96;
  constexpr int patch = 6;
  capture::Image image = capture::make_image(size, size);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> patches(std::size_t{size / patch} * (size / patch));
  for (double& level : patches) level = least * std::pow(most / least, uniform(random));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      for (int c = 0; c < 3; ++c) {
        const auto i = static_cast<std::size_t>(y / patch * (size / patch) + x / patch);
        image.at(y, x, c) =
            static_cast<float>(std::clamp(patches[i] * (1 + 0.1 * (c - 1)), least, most));
      }
    }
  }
  for (int i = 0; i < lamp_pixels; ++i) {
    for (int c = 0; c < 3; ++c) image.at(40 + i / 2, 50 + i % 2, c) = static_cast<float>(lamp);
  }
  return image;
}

// A radiance of 1 fills the well in a second.
inline capture::Image make_room() { return make_light(10, 600, 2e4, 12); }
inline capture::Image make_sunny_day() { return make_light(60, 8000, 1e9, 4); }
inline capture::Image make_night() { return make_light(0.05, 2, 3000, 4); }

// What the test sees of a camera that others own, and says of its light.
struct LightScript {
  capture::Image scene = make_room();
  std::function<double(std::int64_t)> gain = [](std::int64_t) { return 1.0; };
  int lag = 2;
  capture::ExposureRange exposures{20e-6, 1};
  bool settable = true;
  double unit_s = 1e-6;        // that exposures are rounded to
  std::vector<double> made_s;  // what made the frames, by number
};

// At 60 frames a second, 12 bits, 20,000 electrons.
class LightCamera : public capture::Camera {
 public:
  static constexpr double period_s = 1.0 / 60;
  static constexpr double pedestal = 64;

  static capture::MadeSensor sensor() { return {.bits = 12, .pedestal = pedestal}; }

  explicit LightCamera(std::shared_ptr<LightScript> script)
      : script_(std::move(script)), sensor_(sensor()) {
    info_.width = script_->scene.width;
    info_.height = script_->scene.height;
    info_.rate = {60, 1};
    info_.description = "made";
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }
  std::optional<capture::ExposureRange> exposure_range() const override {
    return script_->settable ? std::optional(script_->exposures) : std::nullopt;
  }
  double set_exposure(double exposure_s) override {
    const double unit_s = script_->unit_s;
    const double taken_s = unit_s * std::max(1.0, std::round(exposure_s / unit_s));
    requests_.emplace_back(number_, taken_s);
    return taken_s;
  }
  std::optional<capture::Frame> next() override {
    while (!requests_.empty() && requests_.front().first <= number_ - script_->lag) {
      in_effect_s_ = requests_.front().second;
      requests_.pop_front();
    }
    capture::Image light = script_->scene;
    const auto gain = static_cast<float>(script_->gain(number_));
    for (float& value : light.pixels) value *= gain;
    sensor_.expose(light, in_effect_s_, static_cast<std::uint64_t>(number_), shot_);
    for (std::size_t i = 0; i < light.pixels.size(); ++i) {
      light.pixels[i] = static_cast<float>((shot_.codes[i] - pedestal) / (4095 - pedestal));
    }
    script_->made_s.push_back(in_effect_s_);
    capture::Frame frame;
    frame.time = capture::time_of_frame(number_, info_.rate);
    frame.number = number_++;
    frame.image = std::make_shared<const capture::Image>(std::move(light));
    return frame;
  }

 protected:
  capture::CameraInfo info_;

 private:
  std::shared_ptr<LightScript> script_;
  capture::LiveSensor sensor_;
  capture::MadeShot shot_;
  std::deque<std::pair<std::int64_t, double>> requests_;  // before which frame
  double in_effect_s_ = 0.005;
  std::int64_t number_ = 0;
};

}  // namespace made
