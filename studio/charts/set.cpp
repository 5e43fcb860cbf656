// Error against time of a whole set.
#include "studio/charts/set.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "studio/effort_points.h"
#include "studio/picture_error.h"
#include "studio/show.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

// A directory for one take, removed at the end.
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
  std::string take() const { return (path_ / "take.mkv").string(); }

 private:
  fs::path path_;
};

std::vector<render::Effort> efforts(const render::Effort& base, bool quick) {
  std::vector<render::Effort> all;
  const auto add = [&](int aa_samples, int light_samples, int interleave, float accuracy) {
    render::Effort effort = base;
    effort.aa_samples = aa_samples;
    effort.light_samples = light_samples;
    effort.interleave = interleave;
    effort.accuracy = accuracy;
    all.push_back(effort);
  };
  if (quick) {
    add(1, 16, 1, base.accuracy);
    add(4, 64, 1, base.accuracy);
    return all;
  }
  for (const int aa_samples : {1, 4, 9, 16}) {
    for (const int light_samples : {16, 32, 64, 128, 256}) {
      for (const int interleave : {1, 2}) add(aa_samples, light_samples, interleave, 0.95F);
    }
  }
  for (const float accuracy : {0.9F, 0.98F, 0.99F}) {
    add(4, 32, 1, accuracy);
    add(9, 64, 1, accuracy);
    add(16, 256, 1, accuracy);
  }
  add(36, 512, 1, 0.99F);
  return all;
}

struct Take {
  double frame_ms = 0;
  ShownFrame last;
};

Take put_on_air(const Set& set, std::int64_t frames) {
  ShowOptions options;
  options.frames = frames;
  Show show(set, options);
  Take take;
  show.run([&](const ShownFrame& shown) { take.last = shown; });
  take.frame_ms = show.status()->frame_ms_p50;
  if (!take.last.result || !(take.frame_ms > 0)) {
    throw std::runtime_error(set.path + " shows too few frames to measure: two at least");
  }
  return take;
}

ChartPoint point_of(const render::Effort& effort, double frame_ms, const render::PictureError& e) {
  ChartPoint point;
  point.method = effort.interleave == 1 ? "every pixel tests every light" : "interleaved 2x2";
  point.settings = settings_of(effort);
  point.time_ms = frame_ms;
  point.error = e.relative_rms;
  point.error_p99 = e.p99;
  point.figures = {{"fps", 1000 / frame_ms}, {"delta_e", e.delta_e_mean}};
  point.label = fmt::format("{}/{}", effort.aa_samples, effort.light_samples);
  return point;
}

}  // namespace

Chart chart_set(const std::string& set_path, const SetChartSettings& settings, Console& console) {
  Set set = read_set(set_path);
  const Scratch scratch;
  set.record.exr.clear();
  if (!set.record.file.empty()) set.record.file = scratch.take();
  const std::int64_t frames = settings.quick ? 3 : 12;

  Chart chart;
  chart.stage = fs::path(set_path).stem().string() + ".chart";
  chart.title = fmt::format("{}: error against time", set.name.empty() ? set_path : set.name);
  chart.subtitle =
      fmt::format("{}x{}, labels: samples at edges / lights", set.show.width, set.show.height);
  const std::vector<render::Effort> all = efforts(set.effort, settings.quick);
  Truth truth;
  for (std::size_t i = 0; i < all.size(); ++i) {
    set.effort = all[i];
    const Take take = put_on_air(set, frames);
    if (i == 0) {
      console.progress(0, "reference");
      truth = truth_of(take.last, settings.samples);
    }
    const render::PictureError error = error_against(truth, take.last);
    if (error.pixels == 0) {
      throw std::runtime_error(set_path + " shows nothing virtual: every effort costs the same");
    }
    chart.points.push_back(point_of(all[i], take.frame_ms, error));
    console.progress(static_cast<double>(i + 1) / static_cast<double>(all.size()), "efforts");
  }
  return chart;
}

}  // namespace studio
