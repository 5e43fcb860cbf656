// made:plate and made:probe, as files would give them.
#include "render/made_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calibrate/lens.h"
#include "capture/camera.h"
#include "capture/colour.h"
#include "render/made_camera_request.h"
#include "render/made_gige_camera.h"
#include "render/made_studio.h"

namespace render {
namespace {

class MadeStream final : public capture::Camera {
 public:
  MadeStream(const MadeCameraRequest& request,
             const capture::CameraOptions& options,
             std::string_view uri)
      : studio_(make_studio(request.studio)),
        camera_(request.probe ? studio_.probe : studio_.plate),
        frames_(request.frames),
        number_(options.frame.value_or(0)) {
    const calibrate::Lens& lens = camera_.lens;
    crop_ = options.crop.value_or(std::array{0, 0, lens.width, lens.height});
    const auto [x, y, width, height] = crop_;
    if (x < 0 || y < 0 || width < 1 || height < 1 || width > lens.width - x ||
        height > lens.height - y) {
      refuse_made_camera(uri, "the crop reaches beyond its picture of " +
                                  std::to_string(lens.width) + "x" + std::to_string(lens.height));
    }
    const Scene court(studio_.place);
    parts_ = photograph_parts(studio_, court, calibrate::make_direction_table(lens),
                              camera_.cam_from_set, {.samples = request.samples});
    const int codes = 1 << camera_.sensor.bits;
    for (int code = 0; code < codes; ++code) {
      light_of_code_.push_back(
          static_cast<float>(capture::decode(options.colour.transfer, code / (codes - 1.0))));
    }
    info_.width = width;
    info_.height = height;
    info_.rate = camera_.rate;
    info_.frames = frames_;
    info_.description = std::string("made ") + (request.probe ? "probe" : "plate") + ", " +
                        std::to_string(camera_.sensor.bits) + " bits, " +
                        std::string(capture::name_of(camera_.sensor.transfer));
  }

  const capture::CameraInfo& info() const override { return info_; }

  std::optional<capture::Frame> next() override {
    if (frames_ > 0 && number_ >= frames_) return std::nullopt;
    const capture::Time time = time_of_picture(camera_, number_);
    capture::Frame frame;
    frame.number = number_;
    frame.time = time - camera_.start;
    frame.exposure_s = exposure_of_picture(camera_, number_);
    const capture::MadeShot shot =
        capture::expose(camera_.sensor, add_light(parts_, sun_strength(studio_, time)),
                        frame.exposure_s, static_cast<std::uint64_t>(number_));
    frame.image = std::make_shared<const capture::Image>(decode(shot));
    ++number_;
    ++delivered_;
    return frame;
  }

  capture::CameraStatistics statistics() const override {
    capture::CameraStatistics statistics;
    statistics.delivered = delivered_;
    return statistics;
  }

 private:
  capture::Image decode(const capture::MadeShot& shot) const {
    const auto [x0, y0, width, height] = crop_;
    capture::Image image = capture::make_image(height, width);
    for (int y = 0; y < height; ++y) {
      const std::size_t from =
          (static_cast<std::size_t>(y0 + y) * static_cast<std::size_t>(shot.width) +
           static_cast<std::size_t>(x0)) *
          3;
      float* to = &image.pixels[image.index(y, 0)];
      for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(width); ++i) {
        to[i] = light_of_code_[shot.codes[from + i]];
      }
    }
    return image;
  }

  MadeStudio studio_;
  MadeCamera camera_;
  LightParts parts_;
  std::vector<float> light_of_code_;
  std::array<int, 4> crop_{};
  capture::CameraInfo info_;
  std::int64_t frames_;
  std::int64_t number_;
  std::int64_t delivered_ = 0;
};

}  // namespace

void register_made_cameras() {
  capture::register_camera(
      "made",
      [](std::string_view rest,
         const capture::CameraOptions& options) -> std::unique_ptr<capture::Camera> {
        const MadeCameraRequest request = parse_made_camera(rest);
        if (request.gige) return open_made_gige(request, options);
        return std::make_unique<MadeStream>(request, options, rest);
      });
}

}  // namespace render
