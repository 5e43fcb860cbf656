// Made green-screen clips with truth: what a camera delivers, and the alpha and colour behind it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "capture/image.h"
#include "compositing/made_actor.h"

namespace compositing {

// What a scene asks of a keyer. Light is in units of display white.
struct MadeScene {
  std::string_view name;
  MadeActor actor{};
  std::array<float, 3> screen{0.035F, 0.40F, 0.06F};
  float uneven = 0;            // of the screen's light: slope and vignette
  float wrinkles = 0;          // of the cloth
  float shadow = 0;            // of the person on the screen; moves with the person
  float light = 1;             // of the screen: above 2.4 green is clipped
  float flicker = 0;           // of the lamps, from frame to frame
  float stale = 0;             // the plate's light is this much too bright,
  int shift_px = 0;            // ... and the plate is shifted so far to the left
  float arm = 0.06F;           // how fast it waves, rad a frame
  float walk = 0.7F;           // pixels a frame to the side
  float noise_gain = 1e-4F;    // variance per light
  float noise_floor = 1e-6F;   // variance
  bool halved_chroma = false;  // 4:2:0 on the way
};

// The judged scenes, each one difficulty or a mixture of them.
std::span<const MadeScene> made_scenes();
// Throws std::invalid_argument listing the names.
const MadeScene& made_scene(std::string_view name);

// A picture as a decoder delivers it: (height, width, 3) sRGB codes.
struct MadePicture {
  int height = 0;
  int width = 0;
  std::vector<std::uint8_t> codes;
};
// Its light.
capture::Image light_of(const MadePicture& picture);

struct MadeFrame {
  MadePicture seen;
  capture::Image truth;  // (height, width, 4): premultiplied, without spill
};

// The person walks, sways and waves in front of the screen until `rests_from`, and keeps still from
// then on, so that both trails and flicker show. Frames are made on demand and do not depend on
// each other.
class MadeClip {
 public:
  static constexpr int frames = 50;
  static constexpr int rests_from = 36;

  // Throws std::invalid_argument for a side below 16.
  MadeClip(const MadeScene& scene, std::uint32_t seed, int height = 270, int width = 480);

  MadeFrame frame(int index) const;
  // The empty screen through the same camera.
  MadePicture plate_shot(int index) const;

 private:
  struct Pose;
  Pose pose_at(float phase) const;
  void add_person(const Pose& pose, float share, std::vector<float>& person) const;
  void add_arm(float phase, float shutter, std::vector<float>& person) const;
  MadePicture photograph(const capture::Image& light, std::uint64_t noise_seed) const;

  MadeScene scene_;
  std::uint32_t seed_;
  int height_;
  int width_;
  capture::Image screen_;  // without shadow
  capture::Image layer_;
  ActorColour sleeve_;
  ActorColour skin_;
};

}  // namespace compositing
