// The chart of the keyer.
#include "studio/charts/key.h"

#include <algorithm>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "compositing/key_trial.h"
#include "studio/charts/hull.h"
#include "studio/machine.h"

namespace studio {
namespace {

using compositing::KeyScore;
using compositing::KeySettings;
using compositing::KeyWay;
using compositing::MadeClip;
using compositing::MadeScene;
using compositing::SceneTrial;

constexpr std::uint32_t seed = 1;  // none that anything was tuned on

struct Setting {
  std::string name, label;
  KeyWay way;
  bool by_default = false;
};

std::vector<Setting> settings() {
  std::vector<Setting> all{{"table", "default", {}, true}};
  KeySettings s;
  s.smoothing = 0;
  all.push_back({"table", "no smoothing", {s}});
  s.follows_light = false;
  all.push_back({"table", "plate as taken", {s}});
  all.push_back({"table", "plate of the footage", {.from_footage = true}});
  all.push_back({"by texels", "each pixel once", {.by_texel = true}});
  s = {};
  s.effort = compositing::KeyEffort::quick;
  all.push_back({"table, quick", "quick", {s}});
  s.smoothing = 0;
  all.push_back({"table, quick", "no smoothing", {s}});
  s = {};
  s.learned = false;
  all.push_back({"plain ratio", "all else", {s}});
  s.smoothing = 0;
  all.push_back({"plain ratio", "no smoothing", {s}});
  s.follows_light = false;
  all.push_back({"plain ratio", "plate as taken", {s}});
  s = {};
  s.method = compositing::KeyMethod::difference;
  all.push_back({"difference", "from any background", {s}});
  return all;
}

// Of a few runs, the least.
double least_ms(int runs, const std::function<void()>& work) {
  double least = 1e30;
  for (int i = 0; i < runs; ++i) {
    const double start = cpu_ms_so_far();
    work();
    least = std::min(least, cpu_ms_so_far() - start);
  }
  return std::max(least, 1e-3);
}

class KeyChart {
 public:
  KeyChart(const ChartRequest& request, Console& console)
      : quick_(request.quick),
        console_(console),
        height_(quick_ ? 270 : 1080),
        width_(quick_ ? 480 : 1920) {
    for (const MadeScene& scene : compositing::made_scenes()) {
      if (!quick_ || scenes_.size() < 2) scenes_.push_back(scene);
    }
  }

  Chart measure() {
    Chart chart;
    chart.stage = "key";
    chart.title = "The keyer: error against time";
    chart.subtitle = fmt::format(
        "{} made scenes, seed {}; time of one {}x{} frame on one thread. Peers are ports of their "
        "formulas, with the one setting that was best for them.",
        scenes_.size(), seed, width_, height_);
    chart.time_name = "CPU time of a frame, ms";
    chart.error_name = "distance in Oklab x100, composite";
    chart.relative = false;
    chart.stressed_error_name = "distance in Oklab x100";
    add_points(chart);
    chart.panels.push_back({"edges: distance in Oklab x100", {{"edge", ""}}});
    chart.panels.push_back({"alpha: mean squared error x1000", {{"alpha_mse_e3", ""}}});
    chart.panels.push_back({"alpha: flicker at rest x1000", {{"flicker_e3", ""}}});
    add_stressors(chart);
    return chart;
  }

 private:
  compositing::TrialSize size() const {
    if (quick_) return {135, 240, 4, 2};
    return {270, 480, MadeClip::frames, 5};
  }

  std::vector<SceneTrial> judge(const std::vector<MadeScene>& scenes,
                                const KeyWay& way,
                                bool peers = true) const {
    compositing::TrialSize trial_size = size();
    if (!peers) trial_size.peer_step = trial_size.frames;
    const std::array<std::uint32_t, 1> seeds{seed};
    return compositing::judge_scenes(scenes, seeds, way, trial_size);
  }

  void add(Chart& chart, ChartPoint point, const KeyScore& score) const {
    point.error = score.error.composite;
    point.figures = {{"edge", score.error.edge},
                     {"alpha_mse_e3", 1e3 * score.error.alpha_mse},
                     {"flicker_e3", 1e3 * score.flicker},
                     {"leak_e3", 1e3 * score.error.leak},
                     {"hole_e3", 1e3 * score.error.hole}};
    chart.points.push_back(std::move(point));
  }

  void add_points(Chart& chart) {
    const MadeClip clip(compositing::made_scene("plain"), seed, height_, width_);
    std::vector<capture::Image> shots;
    for (int i = 0; i < 2; ++i) shots.push_back(compositing::light_of(clip.plate_shot(i)));
    const compositing::MadeFrame frame = clip.frame(3);
    std::vector<std::uint8_t> rgba;
    for (std::size_t i = 0; i < frame.seen.codes.size(); i += 3) {
      rgba.insert(rgba.end(), {frame.seen.codes[i], frame.seen.codes[i + 1],
                               frame.seen.codes[i + 2], std::uint8_t{255}});
    }
    const compositing::CodedFrame coded{height_, width_, rgba, capture::Transfer::srgb};
    const capture::Image light = compositing::light_of(frame.seen);
    const auto texture = compositing::make_keyed_texture(light);
    capture::Image by_texels;
    const auto all = settings();
    std::vector<SceneTrial> trials;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Setting& setting = all[i];
      console_.progress(0.6 * static_cast<double>(i) / static_cast<double>(all.size()),
                        setting.name + ", " + setting.label);
      const KeySettings& s = setting.way.settings;
      trials = judge(scenes_, setting.way, i + 1 == all.size());
      compositing::Keyer keyer(compositing::average_plate(shots), s);
      compositing::KeyedFrame keyed;
      ChartPoint point;
      point.method = setting.name;
      point.label = setting.label;
      point.by_default = setting.by_default;
      point.settings = {
          {"by", std::string(s.method == compositing::KeyMethod::screen ? "screen" : "difference")},
          {"by_texel", setting.way.by_texel},
          {"from_footage", setting.way.from_footage},
          {"learned", s.learned},
          {"follows_light", s.follows_light},
          {"smoothing", double{s.smoothing}},
          {"quick", s.effort == compositing::KeyEffort::quick}};
      point.time_ms = least_ms(quick_ ? 2 : 9, [&] {
        if (setting.way.by_texel) {
          keyer.follow(light);
          compositing::key_by_texels(keyer, texture, by_texels);
        } else {
          keyer.key(coded, keyed);
        }
      });
      add(chart, std::move(point), compositing::mean_over(trials, &SceneTrial::ours));
    }
    const auto key = compositing::pick_key_colour(frame);
    const auto add_peer = [&](const char* name, KeyScore SceneTrial::*score,
                              const std::function<void()>& work) {
      ChartPoint point;
      point.method = name;
      point.peer = true;
      point.time_ms = least_ms(quick_ ? 1 : 3, work);
      add(chart, std::move(point), compositing::mean_over(trials, score));
    };
    add_peer("FFmpeg chromakey + despill", &SceneTrial::ffmpeg,
             [&] { compositing::key_as_ffmpeg(frame.seen, key, compositing::tuned_ffmpeg); });
    add_peer("OBS chroma key v2", &SceneTrial::obs,
             [&] { compositing::key_as_obs(frame.seen, key, compositing::tuned_obs); });
    add_peer("GStreamer alpha", &SceneTrial::gstreamer,
             [&] { compositing::key_as_gstreamer(frame.seen, key, compositing::tuned_gstreamer); });
  }

  void add_stressor(Chart& chart,
                    const std::string& name,
                    const std::string& unit,
                    std::vector<double> values,
                    const std::function<void(MadeScene&, float)>& stress) {
    if (quick_) values.resize(2);
    console_.progress(0.6 + 0.05 * static_cast<double>(chart.stressors.size()), name);
    std::vector<MadeScene> scenes;
    for (const double value : values) {
      MadeScene scene = compositing::made_scene("plain");
      stress(scene, static_cast<float>(value));
      scenes.push_back(scene);
    }
    const auto trials = judge(scenes, KeyWay{});
    Stressor stressor{name, unit, false, {}};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float confidence = trials[i].confidence;
      StressorSample sample{values[i], trials[i].ours.error.composite, std::nullopt,
                            compositing::is_unsure(confidence) ? "unsure" : "ok"};
      sample.label = fmt::format("{:.2f}", confidence);
      sample.figures = {{"confidence", confidence},
                        {"edge", trials[i].ours.error.edge},
                        {"ffmpeg", trials[i].ffmpeg.error.composite},
                        {"obs", trials[i].obs.error.composite},
                        {"gstreamer", trials[i].gstreamer.error.composite}};
      stressor.samples.push_back(std::move(sample));
    }
    chart.stressors.push_back(std::move(stressor));
  }

  void add_stressors(Chart& chart) {
    add_stressor(chart, "shadow on the screen (confidence)", "of its light",
                 {0, .2, .4, .6, .8, .9}, [](MadeScene& scene, float v) { scene.shadow = v; });
    add_stressor(chart, "light of the screen (confidence)", "of display white",
                 {.1, .3, 1, 2, 3, 4}, [](MadeScene& scene, float v) { scene.light = v; });
    add_stressor(chart, "plate too bright, and shifted by 4 px (confidence)", "of its light",
                 {0, .1, .2, .4, .8, 1.2}, [](MadeScene& scene, float v) {
                   scene.stale = v;
                   scene.shift_px = v > 0 ? 4 : 0;
                 });
    // Of a screen that tells where it is.
    add_stressor(chart, "plate shifted, of a screen with folds (confidence)", "px",
                 {0, 1, 2, 3, 4, 6, 8}, [](MadeScene& scene, float v) {
                   scene.shift_px = static_cast<int>(v);
                   scene.uneven = 0.5F;
                   scene.wrinkles = 0.4F;
                 });
    add_stressor(chart, "flicker of the lamps (confidence)", "of their light",
                 {0, .05, .1, .2, .4, .8}, [](MadeScene& scene, float v) { scene.flicker = v; });
    add_stressor(chart, "noise (confidence)", "x1000 variance per light", {.1, .5, 1, 2, 4, 8},
                 [](MadeScene& scene, float v) { scene.noise_gain = 1e-3F * v; });
    chart.stressors.push_back(billboard_view_stressor(quick_, console_));
  }

  bool quick_;
  Console& console_;
  int height_, width_;
  std::vector<MadeScene> scenes_;
};

}  // namespace

ChartStage key_chart() {
  return {"key", "the keyer's settings and other tools' formulas on made clips, and what upsets it",
          [](const ChartRequest& request, Console& console) {
            return KeyChart(request, console).measure();
          }};
}

}  // namespace studio
