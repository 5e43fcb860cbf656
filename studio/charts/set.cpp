// Error against time of a whole set.
#include "studio/charts/set.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "studio/effort_points.h"
#include "studio/effort_settings.h"
#include "studio/picture_error.h"
#include "studio/probe_source.h"
#include "studio/set_digest.h"
#include "studio/show.h"
#include "studio/show_inputs.h"
#include "studio/timed_source.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

// A directory for takes, removed at the end.
class Scratch {
 public:
  Scratch() : path_(fs::temp_directory_path() / fmt::format("platelight_chart_{}", getpid())) {
    fs::create_directories(path_);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  // Where a set's recording goes instead; EXR frames are left out.
  RecordSettings in_place_of(RecordSettings record) const {
    record.exr.clear();
    if (!record.file.empty()) record.file = (path_ / "take.mkv").string();
    if (!record.fill.empty()) record.fill = (path_ / "fill.mkv").string();
    if (!record.key.empty()) record.key = (path_ / "key.mkv").string();
    return record;
  }

 private:
  fs::path path_;
};

std::vector<EffortSetting> settings_to_measure(const render::Effort& base, bool quick) {
  using render::Effort;
  std::vector<EffortSetting> all{{"the set's own", "the set's own", base}};
  const std::vector<EffortSetting> steps = effort_dial(base);
  if (quick) {
    all.push_back(steps[2]);
    return all;
  }
  std::ranges::copy_if(steps, std::back_inserter(all),
                       [&](const EffortSetting& s) { return s.effort != base; });
  vary_effort(all, "rays at edges and glints", base, &Effort::aa_samples, {1, 4, 64});
  vary_effort(all, "tolerance of uncertain pixels", base, &Effort::aa_tolerance,
              {0.0F, 0.4F, 0.2F, 0.1F, 0.05F, 0.02F});
  vary_effort(all, "contrast of glints", base, &Effort::glint_contrast,
              {0.0F, 0.4F, 0.2F, 0.05F, 0.02F});
  vary_effort(all, "lights", base, &Effort::light_samples, {16, 32, 128, 256});
  vary_effort(all, "shadow rays", base, &Effort::interleave, {2, 4});
  if (base.adaptive_visibility) {
    all.push_back({"shadow rays", "every pixel", base});
    all.back().effort.adaptive_visibility = false;
  }
  if (base.soft_lights) {
    all.push_back({"shadow rays", "hard", base});
    all.back().effort.soft_lights = false;
  }
  vary_effort(all, "accuracy", base, &Effort::accuracy, {0.8F, 0.9F, 0.98F, 0.99F});
  return all;
}

[[noreturn]] void refuse_live(const Set& set, Place place, const std::string& what) {
  throw SetError({{set.path, place.line, place.column,
                   what + " is a live camera: each setting would be measured with other frames "
                          "than the reference. Record it first (platelight capture record), and "
                          "chart the set with what was recorded (replay:DIR)"}});
}

// Throws SetError also where it cannot be opened.
void refuse_if_live(const Set& set, Place place, const std::string& uri) {
  bool live = false;
  try {
    live = open_video({uri, fs::absolute(set.path).parent_path().string()})->info().live;
  } catch (const std::exception& error) {
    throw SetError({{set.path, place.line, place.column, error.what()}});
  }
  if (live) refuse_live(set, place, uri);
}

// Throws SetError for a set whose frames are not the same each time.
void require_recorded(const Set& set) {
  if (open_plate(set)->is_live()) refuse_live(set, set.camera.source_place, "the plate");
  for (const VideoSettings& video : set.videos) {
    refuse_if_live(set, video.source_place, video.source);
  }
  for (const PersonSettings& person : set.persons) {
    for (const PersonCamera& camera : person.cameras) {
      refuse_if_live(set, camera.place, camera.source);
    }
  }
  const auto& probe = set.probe;
  if (!probe || probe->kind != ProbeSettings::Kind::camera) return;
  if (ProbeSource(set).holds_camera_of(set)) refuse_live(set, probe->source_place, "the probe");
}

// What takes longer is measured once: the whole chart is to take minutes.
constexpr double slow_frame_ms = 150;

struct Take {
  double frame_ms = 0, first_frame_ms = 0;
  ShownFrame last;
};

Take put_on_air(Set set, std::int64_t frames) {
  set.show.sharpen = false;  // every frame is to be of that setting
  ShowOptions options;
  options.frames = frames;
  Show show(set, options);
  Take take;
  show.run([&](const ShownFrame& shown) { take.last = shown; });
  take.frame_ms = show.status()->frame_ms_p50;
  take.first_frame_ms = show.status()->first_frame_ms;
  if (!take.last.result || !(take.frame_ms > 0)) {
    throw std::runtime_error(set.path + " shows too few frames to measure: two at least");
  }
  return take;
}

ChartPoint point_of(const EffortSetting& setting, const Take& take, const render::PictureError& e) {
  ChartPoint point;
  point.method = setting.method;
  point.label = setting.label;
  point.settings = settings_of(setting.effort);
  point.time_ms = take.frame_ms;
  point.error = e.relative_rms;
  point.error_p99 = e.p99;
  point.figures = {{"first_frame_ms", take.first_frame_ms}, {"delta_e", e.delta_e_mean}};
  return point;
}

}  // namespace

Chart chart_set(const std::string& set_path, const SetChartSettings& settings, Console& console) {
  Set set = read_set(set_path);
  const std::string digest = set_digest(set_path);  // now: charts take minutes, and sets are edited
  require_recorded(set);
  const Scratch scratch;
  set.record = scratch.in_place_of(set.record);
  const std::int64_t frames = settings.quick ? 3 : 16;

  Chart chart;
  chart.stage = fs::path(set_path).stem().string() + ".chart";
  chart.title = fmt::format("{}: error against time", set.name.empty() ? set_path : set.name);
  chart.subtitle =
      fmt::format("{}x{}, from one shown frame to the next; labels: the setting's value",
                  set.show.width, set.show.height);
  chart.time_name = "time per frame, ms";
  chart.set_digest = digest;
  const std::vector<EffortSetting> all = settings_to_measure(set.effort, settings.quick);
  Truth truth;
  double done = 0;
  // In two rounds, so that what else the machine does for a while slows no point alone.
  for (const int round : {0, 1}) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      console.progress(done++ / static_cast<double>(2 * all.size()), all[i].method);
      if (round > 0 && chart.points[i].time_ms > slow_frame_ms) continue;
      set.effort = all[i].effort;
      const Take take = put_on_air(set, frames);
      if (round > 0) {
        chart.points[i].time_ms = std::min(chart.points[i].time_ms, take.frame_ms);
        continue;
      }
      if (i == 0) {
        console.progress(0, "reference");
        truth = truth_of(take.last, settings.samples);
      }
      const render::PictureError error = error_against(truth, take.last);
      if (error.pixels == 0) {
        throw std::runtime_error(set_path + " shows nothing virtual: every effort costs the same");
      }
      chart.points.push_back(point_of(all[i], take, error));
      chart.points.back().by_default = i == 0;
    }
  }
  return chart;
}

}  // namespace studio
