// platelight demo: makes footage, sets and their truth.
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/made_park.h"
#include "studio/commands/commands.h"
#include "studio/demo.h"

namespace studio {
namespace {

struct DemoOptions {
  std::string dir;
  std::string world = "court";
  std::string map;
  bool lamp = false;
  std::optional<std::int64_t> width;
  std::optional<std::int64_t> samples;
  std::optional<std::int64_t> frames;
  std::optional<std::int64_t> seed;
};

void demo(const DemoOptions& options, Console& console) {
  DemoSettings settings;
  settings.dir = options.dir;
  if (options.world == "park") {
    if (options.map.empty()) throw UsageError("the park is lit by a map: --map FILE.hdr");
    if (options.lamp) throw UsageError("the lamp stands on the court: --lamp is not for the park");
    settings.world = DemoWorld::park;
    settings.map = options.map;
    settings.studio = render::park_settings();
  } else if (options.world != "court") {
    throw UsageError("there is no world \"" + options.world + "\": there are court, park");
  } else if (!options.map.empty()) {
    throw UsageError("the court has a sky of its own: --map is for the park");
  }
  settings.lamp = options.lamp;
  if (options.width) {
    const int width = static_cast<int>(*options.width);
    if (width % 2 != 0) throw UsageError("--width must be even: the plate is H.264 video");
    settings.studio.height = height_for(settings.studio, width);
    settings.studio.width = width;
  }
  if (options.samples) settings.samples = static_cast<int>(*options.samples);
  if (options.frames) settings.studio.frames = static_cast<int>(*options.frames);
  if (options.seed) settings.studio.seed = static_cast<std::uint32_t>(*options.seed);
  const auto start = std::chrono::steady_clock::now();
  const DemoFigures made = write_demo(
      settings, [&](double share, std::string_view what) { console.progress(share, what); });
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  console.figures(nlohmann::ordered_json{{"frames", made.frames},
                                         {"shots", made.shots},
                                         {"car_share", made.car_share},
                                         {"ground_share", made.ground_share},
                                         {"bytes", made.bytes},
                                         {"time_ms", seconds * 1000}}
                      .dump(2));
  console.say(
      fmt::format("{}: {} frames, {} probe shots, {:.0f} MB in {:.1f} s; the car "
                  "covers {:.0f} % of the picture",
                  made.set.string(), made.frames, made.shots,
                  static_cast<double>(made.bytes) * 1e-6, seconds, 100 * made.car_share));
}

}  // namespace

Command demo_command() {
  return {
      "demo", "Make footage, a set and their truth", "platelight demo made",
      [](Arguments& arguments) -> std::function<void(Console&)> {
        auto options = std::make_shared<DemoOptions>();
        arguments.positional("DIR", options->dir, "where to write");
        arguments.option("--world", options->world,
                         "court (a made sky) or park (a real map of light; the camera pans)");
        arguments.option("--map", options->map, "of the park: a latitude-longitude .hdr or .exr");
        arguments.flag("--lamp", options->lamp, "of the court: a lamp beside the car, virtual too");
        arguments.option("--width", options->width, 32, 8192,
                         "of the plate (court 640, park 1280), even; its shape stays");
        arguments.option("--samples", options->samples, 1, 65536,
                         "paths per pixel of the truth, for each part of the light (16)");
        arguments.option("--frames", options->frames, 1, 100000,
                         "frames of the plate (court 60, park 8)");
        arguments.option("--seed", options->seed, 1, 1'000'000, "another one makes another sky");
        return [options](Console& console) { demo(*options, console); };
      }};
}

}  // namespace studio
