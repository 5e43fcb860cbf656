// platelight calibrate offset: by how much one camera's clock is ahead of another's.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/time_offset.h"
#include "capture/camera.h"
#include "studio/commands/commands.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

constexpr double default_length_s = 20;
constexpr double aimed_at_s = 1e-3;

struct OffsetOptions {
  std::string camera_a;
  std::string camera_b;
  std::optional<double> length_s;
  std::optional<double> largest_s;
  std::optional<double> exposure_a_s;
  std::optional<double> exposure_b_s;
};

// Of about ten thousand pixels; what is not finite has no light.
double brightness_of(const capture::Image& image) {
  constexpr std::size_t looked_at = 10'000;
  const auto channels = static_cast<std::size_t>(image.channels);
  const std::size_t pixels = image.pixels.size() / channels;
  // Odd, so that it does not fall in step with even widths.
  const std::size_t step = std::max<std::size_t>(1, pixels / looked_at) | 1U;
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < pixels; i += step) {
    for (std::size_t c = 0; c < channels; ++c) {
      const auto value = static_cast<double>(image.pixels[i * channels + c]);
      if (std::isfinite(value)) sum += value;
      count += 1;
    }
  }
  return sum / count;
}

// `exposure_s` is that of frames which do not tell theirs.
std::vector<calibrate::SignalSample> watch(capture::Camera& camera,
                                           double length_s,
                                           double exposure_s) {
  using Seconds = std::chrono::duration<double>;
  std::vector<calibrate::SignalSample> signal;
  while (const std::optional<capture::Frame> frame = camera.next()) {
    if (frame->status == capture::FrameStatus::lost || frame->image == nullptr) continue;
    const double time_s = Seconds(frame->time).count();
    if (!signal.empty() && time_s <= signal.back().time_s) continue;
    signal.push_back({time_s, brightness_of(*frame->image),
                      frame->exposure_s > 0 ? frame->exposure_s : exposure_s});
    if (time_s - signal.front().time_s >= length_s) break;
  }
  return signal;
}

void calibrate_offset(const OffsetOptions& options, Console& console) {
  const double length_s = options.length_s.value_or(default_length_s);
  const auto camera_a = capture::open_camera(options.camera_a);
  const auto camera_b = capture::open_camera(options.camera_b);
  if (camera_a->info().live != camera_b->info().live) {
    throw std::runtime_error(
        "one camera is live and the other recorded: their times are on clocks that have nothing in "
        "common");
  }
  if (camera_a->info().live) {
    console.say(fmt::format(
        "for {:.0f} s, switch a lamp that both cameras see on and off, at random", length_s));
  }
  // Both at a time: live cameras would wait for each other.
  auto watching = std::async(std::launch::async, [&] {
    return watch(*camera_b, length_s, options.exposure_b_s.value_or(0));
  });
  const auto a = watch(*camera_a, length_s, options.exposure_a_s.value_or(0));
  const auto b = watching.get();
  calibrate::TimeOffsetOptions search;
  search.largest_s = options.largest_s.value_or(search.largest_s);
  const calibrate::TimeOffset found = calibrate::find_time_offset(a, b, search);
  console.figures(Json{{"offset_ms", 1000 * found.offset_s},
                       {"sigma_ms", 1000 * found.sigma_s},
                       {"correlation", found.correlation},
                       {"next_best", found.next_best},
                       {"edges", found.edges},
                       {"overlap_s", found.overlap_s},
                       {"frames", {a.size(), b.size()}}}
                      .dump(2));
  const auto tells_none = [](const std::vector<calibrate::SignalSample>& signal) {
    return std::ranges::all_of(signal, [](const auto& sample) { return sample.exposure_s == 0; });
  };
  if (found.sigma_s > aimed_at_s) {
    const bool unknown = tells_none(a) || tells_none(b);
    console.warn(
        unknown ? fmt::format("the offset is uncertain by more than a millisecond: {} does not "
                              "tell its exposures; say them by --exposure-{}",
                              tells_none(a) ? options.camera_a : options.camera_b,
                              tells_none(a) ? "a" : "b")
                : fmt::format("the offset is uncertain by more than a millisecond: watch for "
                              "longer than {:.0f} s, or with longer exposures",
                              length_s));
  }
  console.say(fmt::format("{} stamps its frames {:.2f} +- {:.2f} ms {} than {}", options.camera_b,
                          1000 * std::abs(found.offset_s), 1000 * found.sigma_s,
                          found.offset_s < 0 ? "earlier" : "later", options.camera_a));
  console.say(fmt::format("offset_s = {:.5f}", found.offset_s));
}

}  // namespace

Command calibrate_offset_command() {
  return {"calibrate offset", "Measure the time between two cameras from a lamp that both see",
          "platelight calibrate offset v4l2:/dev/video0 aravis:probe --json offset.json",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<OffsetOptions>();
            arguments.positional("CAMERA_A", o->camera_a, "a camera or clip: the scene camera");
            arguments.positional("CAMERA_B", o->camera_b,
                                 "another: a set's offset_s is what it is later by");
            arguments.option("--seconds", o->length_s, 1, 600, "how long to watch; 20 if not said");
            arguments.option("--largest", o->largest_s, 0.01, 60,
                             "seconds that the offset may be at most; 5 if not said");
            arguments.option("--exposure-a", o->exposure_a_s, 1e-6, 10,
                             "seconds, where the first camera does not tell them, as in videos");
            arguments.option("--exposure-b", o->exposure_b_s, 1e-6, 10, "and of the second");
            return [o](Console& console) { calibrate_offset(*o, console); };
          }};
}

}  // namespace studio
