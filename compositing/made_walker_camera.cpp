// Cameras about the made walker.
#include "compositing/made_walker_camera.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calibrate/angles.h"
#include "capture/camera.h"
#include "compositing/made_video_camera.h"

namespace compositing {
namespace {

constexpr capture::Rational rate{25, 1};
using calibrate::degree;
constexpr std::array screen{0.04, 0.42, 0.1};

Vec3 round_at(double round_deg, double radius_m, double z) {
  return {radius_m * std::sin(round_deg * degree), -radius_m * std::cos(round_deg * degree), z};
}

struct Request {
  int round = 0, width = 280, height = 350, frames = 0, detail = 3;
};

[[noreturn]] void refuse(std::string_view uri, const std::string& why) {
  throw std::runtime_error("cannot open made_walker:" + std::string(uri) + ": " + why +
                           "; write made_walker:round=60&width=280&height=350&frames=0&detail=3");
}

Request parse(std::string_view uri) {
  Request request;
  struct Key {
    std::string_view name;
    int low, high;
    int* target;
  };
  const std::array<Key, 5> keys{{{"round", -360, 360, &request.round},
                                 {"width", 16, 4096, &request.width},
                                 {"height", 16, 4096, &request.height},
                                 {"frames", 0, 1 << 30, &request.frames},
                                 {"detail", 1, 8, &request.detail}}};
  for (std::string_view rest = uri; !rest.empty();) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view setting = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const std::size_t equals = setting.find('=');
    const auto key = std::ranges::find(keys, setting.substr(0, equals), &Key::name);
    if (key == keys.end() || equals == std::string_view::npos) {
      refuse(uri, "\"" + std::string(setting) + "\" is no setting");
    }
    const char* const last = setting.data() + setting.size();
    const auto [stop, error] = std::from_chars(setting.data() + equals + 1, last, *key->target);
    if (error != std::errc{} || stop != last || *key->target < key->low ||
        *key->target > key->high) {
      refuse(uri, std::string(key->name) + " must be a whole number from " +
                      std::to_string(key->low) + " to " + std::to_string(key->high));
    }
  }
  return request;
}

class WalkerCamera final : public capture::Camera {
 public:
  WalkerCamera(const Request& request, const capture::CameraOptions& options)
      : request_(request),
        lens_(walker_camera_lens(request.width, request.height)),
        number_(options.frame.value_or(0)) {
    for (int code = 0; code < 256; ++code) {
      light_of_code_.push_back(
          static_cast<float>(capture::decode(options.colour.transfer, code / 255.0)));
    }
    info_.width = request.width;
    info_.height = request.height;
    info_.rate = rate;
    info_.frames = request.frames;
    info_.description = "made walker, 8 bits, sRGB";
  }

  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override {
    capture::CameraStatistics statistics;
    statistics.delivered = delivered_;
    return statistics;
  }

  std::optional<capture::Frame> next() override {
    if (request_.frames > 0 && number_ >= request_.frames) return std::nullopt;
    capture::Frame frame;
    frame.number = number_;
    frame.time = capture::time_of_frame(number_, rate);
    frame.image = std::make_shared<const capture::Image>(picture(number_));
    ++number_;
    ++delivered_;
    return frame;
  }

 private:
  capture::Image picture(std::int64_t number) const {
    const int height = request_.height, width = request_.width;
    capture::Image person =
        number < frames_of_nobody
            ? capture::make_image(height, width, 4)
            : photograph_of(lens_, walker_camera_pose(request_.round), filmed_walker(),
                            walk_time_s(number), request_.detail);
    capture::Image light = capture::make_image(height, width);
    for (int y = 0; y < height; ++y) {
      // Lit from above.
      const double share = 1.1 - 0.25 * y / height;
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 3; ++c) {
          const auto behind = static_cast<float>(share * screen[static_cast<std::size_t>(c)]);
          light.at(y, x, c) = person.at(y, x, c) + (1 - person.at(y, x, 3)) * behind;
        }
      }
    }
    const auto seed = static_cast<std::uint64_t>(number * 1000 + request_.round + 400) << 24;
    const std::vector<std::uint8_t> codes = photograph_light(light, {}, seed);
    std::ranges::transform(codes, light.pixels.begin(),
                           [&](std::uint8_t code) { return light_of_code_[code]; });
    return light;
  }

  Request request_;
  calibrate::Lens lens_;
  capture::CameraInfo info_;
  std::vector<float> light_of_code_;
  std::int64_t number_, delivered_ = 0;
};

}  // namespace

calibrate::Pose walker_camera_pose(double round_deg) {
  return calibrate::look_at(round_at(round_deg, 4, 1.4), {0, 0, 0.9}, 0);
}

calibrate::Lens walker_camera_lens(int width, int height) {
  const double focal = 1.5 * height;
  return {"pinhole", width, height, {focal, focal, (width - 1) / 2.0, (height - 1) / 2.0}};
}

MadeWalker filmed_walker() {
  MadeWalker walker;
  walker.way = round_at(30, 1, 0);
  walker.start = -0.75 * walker.way;
  return walker;
}

double walk_time_s(std::int64_t frame) {
  const std::int64_t walked = std::max<std::int64_t>(frame - frames_of_nobody, 0) % frames_of_walk;
  return static_cast<double>(walked) / rate.value();
}

void register_made_walkers() {
  capture::register_camera(
      "made_walker",
      [](std::string_view uri,
         const capture::CameraOptions& options) -> std::unique_ptr<capture::Camera> {
        if (options.crop) refuse(uri, "it cannot be cropped");
        return std::make_unique<WalkerCamera>(parse(uri), options);
      });
}

}  // namespace compositing
