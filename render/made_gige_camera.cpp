// The made studio over packets.
#include "render/made_gige_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "calibrate/lens.h"
#include "capture/live_reader.h"
#include "capture/made_gige.h"
#include "capture/made_sensor_live.h"

namespace render {
namespace {

constexpr int sun_steps = 64;  // that the sun's strength is rounded to

// A row or column of (1, 2, 1) / 4: what lies `step` apart becomes one.
void soften(capture::Image& image, int size, std::size_t step, std::size_t from) {
  float* value = image.pixels.data() + from;
  float before = *value;
  for (int i = 0; i < size; ++i, value += step) {
    const float after = i + 1 < size ? value[step] : *value;
    const float softened = (before + 2 * *value + after) / 4;
    before = *value;
    *value = softened;
  }
}

// The optical low-pass filter that stands before Bayer mosaics, so that a point, such as the sun,
// is seen by sites of all colours alike.
void filter_for_mosaic(capture::Image& image) {
  const auto width = static_cast<std::size_t>(image.width);
  const std::size_t row = 3 * width;
  for (std::size_t y = 0; y < static_cast<std::size_t>(image.height); ++y) {
    for (std::size_t c = 0; c < 3; ++c) soften(image, image.width, 3, y * row + c);
  }
  for (std::size_t x = 0; x < row; ++x) soften(image, image.height, row, x);
}

// One of the studio's cameras with all that it sees.
class View {
 public:
  explicit View(const MadeCameraRequest& request)
      : studio_(make_studio(request.studio)),
        camera_(request.probe ? studio_.probe : studio_.plate),
        sensor_(sensor_of(camera_)) {
    const Scene court(studio_.place);
    parts_ = photograph_parts(studio_, court, calibrate::make_direction_table(camera_.lens),
                              camera_.cam_from_set, {.samples = request.samples});
  }

  const MadeCamera& camera() const { return camera_; }

  // What machine-vision cameras give is linear, with 12 bits.
  static capture::MadeSensor sensor_of(const MadeCamera& camera) {
    capture::MadeSensor sensor = camera.sensor;
    sensor.bits = 12;
    sensor.transfer = capture::Transfer::linear;
    return sensor;
  }

  // Of the camera's own thread.
  capture::MadeShot picture(const capture::MadeGigeShot& wanted) {
    const float strength = sun_strength(studio_, capture::monotonic_now());
    const int step = static_cast<int>(std::lround(strength * sun_steps));
    if (step != step_) {
      radiance_ = add_light(parts_, static_cast<float>(step) / sun_steps);
      filter_for_mosaic(radiance_);
      step_ = step;
    }
    sensor_.expose(radiance_, wanted.exposure_s, static_cast<std::uint64_t>(wanted.number), shot_);
    return shot_;
  }

 private:
  MadeStudio studio_;
  MadeCamera camera_;
  capture::LiveSensor sensor_;
  LightParts parts_;
  capture::Image radiance_;
  int step_ = -1;
  capture::MadeShot shot_;
};

class MadeGige final : public capture::Camera {
 public:
  MadeGige(const MadeCameraRequest& request, const capture::CameraOptions& options)
      : view_(request), device_(settings_of(request), [this](const capture::MadeGigeShot& shot) {
          return view_.picture(shot);
        }) {
    camera_ = capture::open_camera(device_.uri(), options);
  }

  const capture::CameraInfo& info() const override { return camera_->info(); }
  std::optional<capture::Frame> next() override { return camera_->next(); }
  capture::CameraStatistics statistics() const override { return camera_->statistics(); }
  std::optional<capture::ExposureRange> exposure_range() const override {
    return camera_->exposure_range();
  }
  double set_exposure(double exposure_s) override { return camera_->set_exposure(exposure_s); }

 private:
  capture::MadeGigeSettings settings_of(const MadeCameraRequest& request) const {
    const MadeCamera& camera = view_.camera();
    capture::MadeGigeSettings settings;
    settings.width = camera.lens.width;
    settings.height = camera.lens.height;
    settings.formats = {"BayerRG12"};
    settings.rate = request.rate > 0 ? request.rate : camera.rate.value();
    settings.exposures = {1e-6, 1};
    settings.exposure_s = camera.exposures_s.front();
    settings.exposure_lag = request.lag;
    settings.packet_loss = request.loss_per_mille * 1e-3;
    settings.seed = request.studio.seed;
    return settings;
  }

  View view_;
  capture::MadeGigeCamera device_;
  std::unique_ptr<capture::Camera> camera_;  // ends before the device
};

}  // namespace

std::unique_ptr<capture::Camera> open_made_gige(const MadeCameraRequest& request,
                                                const capture::CameraOptions& options) {
  return std::make_unique<MadeGige>(request, options);
}

}  // namespace render
