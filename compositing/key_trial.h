// Our keyer and other tools' formulas on the same made clips.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "compositing/key_error.h"
#include "compositing/keyed_texture.h"
#include "compositing/keyer.h"
#include "compositing/made_clip.h"
#include "compositing/peer_keys.h"

namespace compositing {

struct KeyScore {
  KeyError error;
  double flicker = 0;
};
// Of several, the mean.
KeyScore mean_of(std::span<const KeyScore> scores);

// Settings of the peers with which the sum of their errors over all made scenes was least, on seed
// 21; one for all scenes, as ours.
inline constexpr FfmpegKey tuned_ffmpeg{0.02F, 0.08F, 0.75F};
inline constexpr ObsKey tuned_obs{0.055F, 0.04F, 0.18F};
inline constexpr GstreamerKey tuned_gstreamer{80, 6};

// How frames are keyed.
struct KeyWay {
  KeySettings settings{};
  bool from_footage = false;  // the plate: from the clip's own frames, in each of which somebody is
  bool by_texel = false;      // each pixel by itself, as rays of its size see it
};

struct SceneTrial {
  std::string_view name;
  KeyScore ours, ffmpeg, obs, gstreamer;
  float confidence = 0;  // of ours, the mean
};

struct TrialSize {
  int height = 270;
  int width = 480;
  int frames = MadeClip::frames;  // of each clip, from the first
  int peer_step = 5;              // peers see every so many of the moving frames
};

// Keys a scene with each seed; the plate is the mean of eight shots, if it is not from the footage;
// the peers' key is picked in each frame. Flicker needs frames after MadeClip::rests_from, else it
// is 0.
SceneTrial judge_scene(const MadeScene& scene,
                       std::span<const std::uint32_t> seeds,
                       const KeyWay& way,
                       const TrialSize& size = {});

// The same for several scenes, beside each other.
std::vector<SceneTrial> judge_scenes(std::span<const MadeScene> scenes,
                                     std::span<const std::uint32_t> seeds,
                                     const KeyWay& way,
                                     const TrialSize& size = {});

// A frame whose every pixel is looked up in a picture that is keyed by texels, to `keyed`: (height,
// width, 4).
void key_by_texels(Keyer& keyer,
                   std::shared_ptr<const KeyedTexture> texture,
                   capture::Image& keyed);

// The mean of one method's scores.
KeyScore mean_over(std::span<const SceneTrial> trials, KeyScore SceneTrial::*method);

}  // namespace compositing
