// Trials of keyers on made clips.
#include "compositing/key_trial.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "capture/parallel_loop.h"
#include "compositing/clean_plate.h"
#include "compositing/keyed_picture.h"
#include "compositing/plate_footage.h"

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

CleanPlate plate_of(const MadeClip& clip, const KeyWay& way, int frames) {
  if (way.from_footage) {
    PlateFootage footage;
    for (int i = 0; i < frames; ++i) footage.add(light_of(clip.frame(i).seen));
    return way.settings.method == KeyMethod::screen ? footage.screen() : footage.background();
  }
  std::vector<Image> shots;
  for (int i = 0; i < 8; ++i) shots.push_back(light_of(clip.plate_shot(i)));
  return average_plate(shots);
}

KeyReport key(Keyer& keyer, const Image& frame, bool by_texel, Image& keyed) {
  if (by_texel) {
    const KeyReport report = keyer.follow(frame);
    key_by_texels(keyer, make_keyed_texture(frame), keyed);
    return report;
  }
  capture::HalfImage half;
  const KeyReport report = keyer.key(frame, half);
  keyed = to_float(half);
  return report;
}

}  // namespace

void key_by_texels(Keyer& keyer,
                   std::shared_ptr<const KeyedTexture> texture,
                   capture::Image& keyed) {
  const int height = texture->height(), width = texture->width();
  const TexelKeyedPicture picture(std::move(texture), keyer.shared_lit(), keyer.shared_filtered(),
                                  keyer.dials());
  const float pixel = 1 / std::sqrt(static_cast<float>(width) * static_cast<float>(height));
  if (keyed.height != height || keyed.width != width || keyed.channels != 4) {
    keyed = capture::make_image(height, width, 4);
  }
  std::vector<render::PicturePlace> places(static_cast<std::size_t>(width));
  std::vector<std::array<float, 4>> row(places.size());
  for (int y = 0; y < height; ++y) {
    const float v = (static_cast<float>(y) + 0.5F) / static_cast<float>(height);
    for (std::size_t x = 0; x < places.size(); ++x) {
      places[x] = {(static_cast<float>(x) + 0.5F) / static_cast<float>(width), v, pixel};
    }
    picture.look_up_all(places, row);
    std::memcpy(&keyed.at(y, 0, 0), row.data(), row.size() * sizeof row[0]);
  }
}

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
                       const KeyWay& way,
                       const TrialSize& size) {
  SceneTrial trial;
  trial.name = scene.name;
  const Image background = make_new_background(size.height, size.width);
  std::vector<KeyScore> ours, ffmpeg, obs, gstreamer;
  for (const std::uint32_t seed : seeds) {
    const MadeClip clip(scene, seed, size.height, size.width);
    Keyer keyer(plate_of(clip, way, size.frames), way.settings);
    Judge own, f, o, g;
    for (int i = 0; i < size.frames; ++i) {
      const MadeFrame made = clip.frame(i);
      Image keyed;
      const KeyReport report = key(keyer, light_of(made.seen), way.by_texel, keyed);
      trial.confidence +=
          report.confidence / static_cast<float>(size.frames * static_cast<int>(seeds.size()));
      own.add(keyed, made, background, i, true);
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
                                     const KeyWay& way,
                                     const TrialSize& size) {
  std::vector<SceneTrial> trials(scenes.size());
  capture::parallel_for(std::size_t{0}, scenes.size(), [&](std::size_t i) {
    trials[i] = judge_scene(scenes[i], seeds, way, size);
  });
  return trials;
}

KeyScore mean_over(std::span<const SceneTrial> trials, KeyScore SceneTrial::*method) {
  std::vector<KeyScore> scores;
  for (const SceneTrial& trial : trials) scores.push_back(trial.*method);
  return mean_of(scores);
}

}  // namespace compositing
