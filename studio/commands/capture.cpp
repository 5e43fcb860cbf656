// platelight capture: recordings of live cameras.
#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/camera.h"
#include "capture/recording.h"
#include "studio/commands/commands.h"
#include "studio/commands/interruptible.h"
#include "studio/json_text.h"

namespace studio {
namespace {

struct CaptureOptions {
  std::string action;
  std::string camera;
  std::string folder;
  std::optional<std::int64_t> frames;
  std::optional<double> seconds;
};

struct Taken {
  capture::RecordingStatistics written;
  capture::CameraStatistics camera;
  double seconds = 0;  // from the first frame to the last
  std::string error;   // why it ended early
};

// Until so many frames or seconds are recorded, the camera ends, or somebody presses Ctrl-C.
Taken record(const CaptureOptions& options,
             std::optional<capture::Frame> frame,
             capture::Camera& camera,
             Console& console) {
  const double most_frames = options.frames ? static_cast<double>(*options.frames)
                                            : std::numeric_limits<double>::infinity();
  const double most_s = options.seconds.value_or(std::numeric_limits<double>::infinity());
  capture::FrameRecording recording(options.folder);
  std::optional<capture::Time> first;
  Taken taken;
  const Interruptible ctrl_c;
  for (double frames = 0; frame && frames < most_frames && !ctrl_c.is_interrupted(); ++frames) {
    if (!first) first = frame->time;
    const double seconds = std::chrono::duration<double>(frame->time - *first).count();
    if (seconds >= most_s) break;
    try {
      recording.add(*frame);
    } catch (const std::runtime_error& error) {
      taken.error = error.what();
      break;
    }
    taken.seconds = seconds;
    const double share = std::max((frames + 1) / most_frames, seconds / most_s);
    console.progress(share, fmt::format("{:.0f} frames", frames + 1));
    frame = camera.next();
  }
  try {
    recording.finish();
  } catch (const std::runtime_error& error) {
    if (taken.error.empty()) taken.error = error.what();
  }
  taken.written = recording.statistics();
  taken.camera = camera.statistics();
  return taken;
}

void record_camera(const CaptureOptions& o, Console& console) {
  if (o.action != "record") {
    throw UsageError(fmt::format("capture has no action \"{}\"; there is: record", o.action));
  }
  capture::CameraOptions options;
  options.keep_coded = true;
  const auto camera = capture::open_camera(o.camera, options);
  const capture::CameraInfo& info = camera->info();
  std::optional<capture::Frame> first = camera->next();
  if (first && !first->coded) {
    throw std::runtime_error(
        fmt::format("cannot record {}: it is no live camera; copy its files instead", o.camera));
  }
  const Taken taken = record(o, std::move(first), *camera, console);
  console.figures(json_text(
      nlohmann::ordered_json{{"camera", info.description},
                             {"width", info.width},
                             {"height", info.height},
                             {"frames", taken.written.frames},
                             {"lost", taken.written.lost},
                             {"skipped", taken.written.skipped},
                             {"damaged", taken.camera.damaged},
                             {"seconds", taken.seconds},
                             {"error", taken.error.empty() ? nlohmann::ordered_json(nullptr)
                                                           : nlohmann::ordered_json(taken.error)},
                             {"megabytes", static_cast<double>(taken.written.bytes) * 1e-6}}));
  console.say(fmt::format("{}: {} frames of {}, {} lost, {:.1f} s; play it as replay:{}", o.folder,
                          taken.written.frames, info.description, taken.written.lost, taken.seconds,
                          o.folder));
  if (taken.written.skipped > 0) {
    console.warn(fmt::format("the disk was too slow for {} frames: they are recorded as lost",
                             taken.written.skipped));
  }
  if (!taken.error.empty()) throw std::runtime_error(taken.error);
}

}  // namespace

Command capture_command() {
  return {
      "capture", "Record a live camera without loss",
      "platelight capture record v4l2:/dev/video0 take/ --seconds 10",
      [](Arguments& arguments) -> std::function<void(Console&)> {
        auto o = std::make_shared<CaptureOptions>();
        arguments.positional("ACTION", o->action, "record");
        arguments.positional("CAMERA", o->camera, "URI of a live camera: see platelight devices");
        arguments.positional("DIR", o->folder, "a new folder, which replay:DIR plays");
        arguments.option("--frames", o->frames, 1, std::int64_t{1} << 40, "end after so many");
        arguments.option("--seconds", o->seconds, 1e-3, 1e7, "end after so long; else at Ctrl-C");
        return [o](Console& console) { record_camera(*o, console); };
      }};
}

}  // namespace studio
