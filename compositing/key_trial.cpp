// Trials of keyers on made clips.
#include "compositing/key_trial.h"

#include <algorithm>

#include "capture/parallel_loop.h"
#include "compositing/clean_plate.h"

namespace compositing {
namespace {

using capture::Image;

// What one method's frames add up to.
struct Judge {
  KeyErrorSum errors;
  AlphaFlicker flicker;

  void add(
      const Image& keyed, const MadeFrame& made, const Image& background, int frame, bool moving) {
    if (moving) errors.add(keyed, made.truth, background);
    if (frame >= MadeClip::rests_from) flicker.add(keyed);
  }
  KeyScore score() const { return {errors.mean(), flicker.deviation()}; }
};

}  // namespace

KeyScore mean_of(std::span<const KeyScore> scores) {
  KeyScore mean;
  const double share = 1 / static_cast<double>(std::max<std::size_t>(scores.size(), 1));
  for (const KeyScore& s : scores) {
    mean.error.composite += share * s.error.composite;
    mean.error.edge += share * s.error.edge;
    mean.error.alpha_mse += share * s.error.alpha_mse;
    mean.error.leak += share * s.error.leak;
    mean.error.hole += share * s.error.hole;
    mean.flicker += share * s.flicker;
  }
  return mean;
}

SceneTrial judge_scene(const MadeScene& scene,
                       std::span<const std::uint32_t> seeds,
                       const KeySettings& settings,
                       const TrialSize& size) {
  SceneTrial trial;
  trial.name = scene.name;
  const Image background = make_new_background(size.height, size.width);
  std::vector<KeyScore> ours, ffmpeg, obs, gstreamer;
  for (const std::uint32_t seed : seeds) {
    const MadeClip clip(scene, seed, size.height, size.width);
    std::vector<Image> shots;
    for (int i = 0; i < 8; ++i) shots.push_back(light_of(clip.plate_shot(i)));
    Keyer keyer(average_plate(shots), settings);
    capture::HalfImage keyed;
    Judge own, f, o, g;
    for (int i = 0; i < size.frames; ++i) {
      const MadeFrame made = clip.frame(i);
      const KeyReport report = keyer.key(light_of(made.seen), keyed);
      trial.confidence +=
          report.confidence / static_cast<float>(size.frames * static_cast<int>(seeds.size()));
      own.add(to_float(keyed), made, background, i, true);
      const bool counts = i % size.peer_step == 0;
      if (!counts && i < MadeClip::rests_from) continue;
      const PeerKeyColour key = pick_key_colour(made);
      f.add(key_as_ffmpeg(made.seen, key, tuned_ffmpeg), made, background, i, counts);
      o.add(key_as_obs(made.seen, key, tuned_obs), made, background, i, counts);
      g.add(key_as_gstreamer(made.seen, key, tuned_gstreamer), made, background, i, counts);
    }
    ours.push_back(own.score()), ffmpeg.push_back(f.score());
    obs.push_back(o.score()), gstreamer.push_back(g.score());
  }
  trial.ours = mean_of(ours), trial.ffmpeg = mean_of(ffmpeg);
  trial.obs = mean_of(obs), trial.gstreamer = mean_of(gstreamer);
  return trial;
}

std::vector<SceneTrial> judge_scenes(std::span<const MadeScene> scenes,
                                     std::span<const std::uint32_t> seeds,
                                     const KeySettings& settings,
                                     const TrialSize& size) {
  std::vector<SceneTrial> trials(scenes.size());
  capture::parallel_for(std::size_t{0}, scenes.size(), [&](std::size_t i) {
    trials[i] = judge_scene(scenes[i], seeds, settings, size);
  });
  return trials;
}

KeyScore mean_over(std::span<const SceneTrial> trials, KeyScore SceneTrial::*method) {
  std::vector<KeyScore> scores;
  for (const SceneTrial& trial : trials) scores.push_back(trial.*method);
  return mean_of(scores);
}

}  // namespace compositing
