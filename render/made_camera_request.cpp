// What a URI asks of a made camera.
#include "render/made_camera_request.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <stdexcept>

namespace render {
namespace {

struct Key {
  std::string_view name;
  int low, high;
  int* target;
};

}  // namespace

void refuse_made_camera(std::string_view uri, const std::string& why) {
  throw std::runtime_error(
      "cannot open made:" + std::string(uri) + ": " + why +
      "; write made:plate?width=640&height=480&frames=0&samples=4&seed=1 or "
      "made:probe?size=384&frames=0&samples=4&seed=1; gige_plate and gige_probe have rate, lag and "
      "loss (per mille of packets) in the place of frames");
}

MadeCameraRequest parse_made_camera(std::string_view uri) {
  MadeCameraRequest request;
  const std::size_t mark = uri.find('?');
  const std::string_view name = uri.substr(0, mark);
  request.gige = name.starts_with("gige_");
  const std::string_view which = request.gige ? name.substr(5) : name;
  if (which != "plate" && which != "probe") {
    refuse_made_camera(uri, "there is no such made camera");
  }
  request.probe = which == "probe";
  int seed = 1;
  MadeStudioSettings& studio = request.studio;
  const std::array<Key, 9> keys{{{"width", 16, 8192, &studio.width},
                                 {"height", 16, 8192, &studio.height},
                                 {"size", 16, 4096, &studio.probe_size},
                                 {"frames", 0, 1 << 30, &request.frames},
                                 {"samples", 1, 65536, &request.samples},
                                 {"seed", 1, 1'000'000, &seed},
                                 {"rate", 1, 1000, &request.rate},
                                 {"lag", 0, 16, &request.lag},
                                 {"loss", 0, 500, &request.loss_per_mille}}};
  std::string_view rest = mark == std::string_view::npos ? "" : uri.substr(mark + 1);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view setting = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const std::size_t equals = setting.find('=');
    const auto key = std::ranges::find(keys, setting.substr(0, equals), &Key::name);
    const bool packets = key >= keys.end() - 3;
    const bool endless = request.gige && setting.starts_with("frames");
    if (key == keys.end() || equals == std::string_view::npos ||
        packets != (packets && request.gige) || endless) {
      refuse_made_camera(uri, "\"" + std::string(setting) + "\" is no setting");
    }
    const std::string_view value = setting.substr(equals + 1);
    const auto [last, error] =
        std::from_chars(value.data(), value.data() + value.size(), *key->target);
    if (error != std::errc{} || last != value.data() + value.size() || *key->target < key->low ||
        *key->target > key->high) {
      refuse_made_camera(uri, std::string(key->name) + " must be a whole number from " +
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

}  // namespace render
