// made:plate and made:probe.
#include "render/made_camera.h"

#include <algorithm>
#include <array>
#include <charconv>
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
#include "render/made_studio.h"

namespace render {
namespace {

[[noreturn]] void fail(std::string_view uri, const std::string& why) {
  throw std::runtime_error("cannot open made:" + std::string(uri) + ": " + why +
                           "; write made:plate?width=640&height=480&frames=0&samples=4&seed=1 or "
                           "made:probe?size=384&frames=0&samples=4&seed=1");
}

struct Request {
  bool probe = false;
  MadeStudioSettings studio;
  int frames = 0;
  int samples = 4;
};

struct Key {
  std::string_view name;
  int low, high;
  int* target;
};

Request parse(std::string_view uri) {
  Request request;
  const std::size_t mark = uri.find('?');
  const std::string_view name = uri.substr(0, mark);
  if (name != "plate" && name != "probe") fail(uri, "there is no such made camera");
  request.probe = name == "probe";
  int seed = 1;
  MadeStudioSettings& studio = request.studio;
  const std::array<Key, 6> keys{{{"width", 16, 8192, &studio.width},
                                 {"height", 16, 8192, &studio.height},
                                 {"size", 16, 4096, &studio.probe_size},
                                 {"frames", 0, 1 << 30, &request.frames},
                                 {"samples", 1, 65536, &request.samples},
                                 {"seed", 1, 1'000'000, &seed}}};
  std::string_view rest = mark == std::string_view::npos ? "" : uri.substr(mark + 1);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view setting = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const std::size_t equals = setting.find('=');
    const auto key = std::ranges::find(keys, setting.substr(0, equals), &Key::name);
    if (key == keys.end() || equals == std::string_view::npos) {
      fail(uri, "\"" + std::string(setting) + "\" is no setting");
    }
    const std::string_view value = setting.substr(equals + 1);
    const auto [last, error] =
        std::from_chars(value.data(), value.data() + value.size(), *key->target);
    if (error != std::errc{} || last != value.data() + value.size() || *key->target < key->low ||
        *key->target > key->high) {
      fail(uri, std::string(key->name) + " must be a whole number from " +
                    std::to_string(key->low) + " to " + std::to_string(key->high));
    }
  }
  studio.seed = static_cast<std::uint32_t>(seed);
  // No finer than the picture shows.
  const int across = request.probe ? studio.probe_size : studio.width;
  studio.texture_size = std::clamp(4 * across, 64, studio.texture_size);
  studio.sky_height = std::clamp(across, 128, studio.sky_height);
  return request;
}

class MadeStream final : public capture::Camera {
 public:
  MadeStream(const Request& request, const capture::CameraOptions& options, std::string_view uri)
      : studio_(make_studio(request.studio)),
        camera_(request.probe ? studio_.probe : studio_.plate),
        frames_(request.frames),
        number_(options.frame.value_or(0)) {
    const calibrate::Lens& lens = camera_.lens;
    crop_ = options.crop.value_or(std::array{0, 0, lens.width, lens.height});
    const auto [x, y, width, height] = crop_;
    if (x < 0 || y < 0 || width < 1 || height < 1 || width > lens.width - x ||
        height > lens.height - y) {
      fail(uri, "the crop reaches beyond its picture of " + std::to_string(lens.width) + "x" +
                    std::to_string(lens.height));
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

  capture::CameraStatistics statistics() const override { return {.delivered = delivered_}; }

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
        return std::make_unique<MadeStream>(parse(rest), options, rest);
      });
}

}  // namespace render
