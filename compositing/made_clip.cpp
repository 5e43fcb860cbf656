// Scenes, motion and composition of made clips.
#include "compositing/made_clip.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "capture/colour.h"
#include "capture/counter_random.h"
#include "compositing/made_video_camera.h"
#include "render/made_noise.h"

namespace compositing {
namespace {

using capture::Image;
using render::fractal_noise;
using render::smooth_step;

constexpr float shutter = 0.5F;    // of a frame: 180 degrees
constexpr float arm_swing = 0.8F;  // rad to either side

std::vector<MadeScene> make_scenes() {
  std::vector<MadeScene> scenes;
  const auto add = [&](std::string_view name, auto&& change) {
    MadeScene scene{name};
    change(scene);
    scenes.push_back(scene);
  };
  add("plain", [](MadeScene&) {});
  add("uneven", [](MadeScene& s) { s.uneven = 0.8F; });
  add("wrinkled", [](MadeScene& s) { s.uneven = 0.3F, s.wrinkles = 0.8F; });
  add("shadow", [](MadeScene& s) { s.shadow = 0.6F; });
  add("spill", [](MadeScene& s) { s.actor.spill = 0.16F; });
  add("blond", [](MadeScene& s) { s.actor.hair = MadeHair::blond; });
  add("white hair", [](MadeScene& s) { s.actor.hair = MadeHair::white; });
  add("black hair", [](MadeScene& s) { s.actor.hair = MadeHair::black; });
  add("black hair, shadow",
      [](MadeScene& s) { s.actor.hair = MadeHair::black, s.shadow = 0.5F, s.uneven = 0.3F; });
  add("fur", [](MadeScene& s) { s.actor.fur = 0.12F, s.uneven = 0.4F; });
  add("veil", [](MadeScene& s) { s.actor.veil = 0.7F; });
  add("glass", [](MadeScene& s) { s.actor.glass = true; });
  add("motion blur", [](MadeScene& s) { s.arm = 0.35F; });
  add("walking", [](MadeScene& s) { s.walk = 4; });
  add("over-exposed", [](MadeScene& s) { s.light = 2.7F, s.actor.spill = 0.05F; });
  add("under-exposed", [](MadeScene& s) { s.light = 0.3F, s.noise_floor = 4e-6F; });
  add("4:2:0", [](MadeScene& s) { s.halved_chroma = true; });
  add("noise", [](MadeScene& s) { s.noise_gain = 1.5e-3F, s.noise_floor = 2e-5F; });
  add("green clothes", [](MadeScene& s) { s.actor.green_clothes = true; });
  add("lamp flicker", [](MadeScene& s) { s.flicker = 0.08F, s.uneven = 0.3F; });
  add("stale plate",
      [](MadeScene& s) { s.stale = 0.12F, s.shift_px = 4, s.uneven = 0.5F, s.wrinkles = 0.2F; });
  add("blue screen", [](MadeScene& s) { s.screen = {0.03F, 0.06F, 0.36F}, s.uneven = 0.3F; });
  add("yellow screen", [](MadeScene& s) { s.screen = {0.35F, 0.4F, 0.02F}, s.uneven = 0.3F; });
  add("studio", [](MadeScene& s) {
    s.uneven = 0.4F, s.wrinkles = 0.3F, s.shadow = 0.45F, s.arm = 0.2F, s.halved_chroma = true;
    s.actor.spill = 0.09F, s.actor.hair = MadeHair::blond;
    s.noise_gain = 4e-4F, s.noise_floor = 5e-6F;
  });
  return scenes;
}

Image paint_screen(const MadeScene& scene, std::uint32_t seed, int height, int width) {
  Image screen = capture::make_image(height, width);
  const auto random = [&](std::uint64_t of) {
    return 2 * static_cast<float>(capture::uniform_high(capture::mixed_bits(seed, of))) - 1;
  };
  const float slope_x = random(1), slope_y = random(2);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(width) - 0.5F;
      const float v = static_cast<float>(y) / static_cast<float>(width);
      const float bent = 9 * u + 2 * fractal_noise(3 * u, 3 * v, 2, seed + 9);
      const float fold = fractal_noise(bent, 4 * v, 4, seed + 3);
      const float crease = std::sin(60 * u + 9 * fold) * smooth_step(0, 0.4F, fold + 0.1F);
      float light = 1 + scene.uneven * (0.9F * (slope_x * u + slope_y * (v - 0.28F)) -
                                        1.2F * (u * u + (v - 0.28F) * (v - 0.28F)));
      light += scene.wrinkles * (0.6F * fold + 0.25F * crease);
      light = scene.light * std::max(light, 0.12F);
      for (int c = 0; c < 3; ++c) {
        const float own = scene.screen[static_cast<std::size_t>(c)];
        const float faded = own < 0.2F ? 0.02F * (scene.uneven + scene.wrinkles) * fold : 0;
        screen.at(y, x, c) = light * std::max(own + faded, 0.004F);
      }
    }
  }
  return screen;
}

// Frames go by until the person comes to rest.
float phase_of(float frame) {
  const float rest = static_cast<float>(MadeClip::rests_from);
  if (frame < rest - 6) return frame;
  const float slowed = std::min(frame, rest) - (rest - 6);
  return rest - 6 + slowed - slowed * slowed / 12;
}

struct Arm {
  float shoulder_x, shoulder_y, length, radius;
};

}  // namespace

std::span<const MadeScene> made_scenes() {
  static const std::vector<MadeScene> scenes = make_scenes();
  return scenes;
}

const MadeScene& made_scene(std::string_view name) {
  std::string names;
  for (const MadeScene& scene : made_scenes()) {
    if (scene.name == name) return scene;
    names += (names.empty() ? "" : ", ") + std::string(scene.name);
  }
  throw std::invalid_argument("no made scene \"" + std::string(name) + "\"; there are: " + names);
}

Image light_of(const MadePicture& picture) {
  static const std::array<float, 256> light = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) {
      const double value = static_cast<double>(i) / 255;
      table[i] = static_cast<float>(capture::decode(capture::Transfer::srgb, value));
    }
    return table;
  }();
  Image image = capture::make_image(picture.height, picture.width);
  for (std::size_t i = 0; i < picture.codes.size(); ++i) {
    image.pixels[i] = light[picture.codes[i]];
  }
  return image;
}

struct MadeClip::Pose {
  float shift_x, lean, flutter, phase;
};

MadeClip::MadeClip(const MadeScene& scene, std::uint32_t seed, int height, int width)
    : scene_(scene), seed_(seed), height_(height), width_(width) {
  if (height < 16 || width < 16) throw std::invalid_argument("a made clip is at least 16x16");
  screen_ = paint_screen(scene, seed, height, width);
  layer_ = paint_actor(scene.actor, seed, height, width);
  sleeve_ = sleeve_of(scene.actor, seed);
  skin_ = skin_of(scene.actor, seed);
}

MadeClip::Pose MadeClip::pose_at(float phase) const {
  const float way = static_cast<float>(height_) / 270;
  return {way * (scene_.walk * (phase - 18) + 3 * std::sin(0.21F * phase)),
          0.02F * std::sin(0.17F * phase + static_cast<float>(seed_ % 7)), way * 1.5F, phase};
}

// Adds share * layer, moved.
void MadeClip::add_person(const Pose& pose, float share, std::vector<float>& person) const {
  constexpr float detail = actor_detail;
  const float bottom = static_cast<float>(height_);
  for (int y = 0; y < height_; ++y) {
    const float fy = static_cast<float>(y);
    const float bow = pose.lean * (bottom - fy) + pose.shift_x;
    const float wave = pose.flutter * std::sin(0.05F * fy + 0.4F * pose.phase);
    const float sy =
        std::min(detail * (fy + 0.5F) - 0.5F, static_cast<float>(layer_.height) - 1.01F);
    const int iy = static_cast<int>(sy);
    const float v = sy - static_cast<float>(iy);
    for (int x = 0; x < width_; ++x) {
      const float fx = static_cast<float>(x);
      const float moved = fx - bow - wave * std::sin(0.03F * fx);
      const float sx = detail * (moved + 0.5F) - 0.5F;
      if (!(sx >= 0 && sx < static_cast<float>(layer_.width - 1))) continue;
      const int ix = static_cast<int>(sx);
      const float u = sx - static_cast<float>(ix);
      const float* above = &layer_.pixels[layer_.index(iy, ix)];
      const float* below = above + static_cast<std::size_t>(layer_.width) * actor_channels;
      float* to = &person[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                           static_cast<std::size_t>(x)) *
                          actor_channels];
      for (int c = 0; c < actor_channels; ++c) {
        const float top = above[c] + u * (above[c + actor_channels] - above[c]);
        const float low = below[c] + u * (below[c + actor_channels] - below[c]);
        to[c] += share * (top + v * (low - top));
      }
    }
  }
}

// The waving arm, over the person; its way while the shutter is open is averaged.
void MadeClip::add_arm(float phase, float open, std::vector<float>& person) const {
  const float unit = static_cast<float>(height_);
  const Pose pose = pose_at(phase);
  const float head_x = 0.5F * static_cast<float>(width_) + pose.shift_x;
  const Arm arm{head_x + 0.25F * unit, 0.74F * unit, 0.43F * unit, 0.04F * unit};
  const int steps = std::clamp(static_cast<int>(200 * scene_.arm * open), 3, 40);
  const int left = std::max(0, static_cast<int>(arm.shoulder_x - 0.5F * unit));
  const int right = std::min(width_, static_cast<int>(arm.shoulder_x + 0.5F * unit));
  const int top = std::max(0, static_cast<int>(arm.shoulder_y - 0.5F * unit));
  for (int y = top; y < height_; ++y) {
    for (int x = left; x < right; ++x) {
      std::array<float, actor_channels> sum{};
      for (int k = 0; k < steps; ++k) {
        const float when =
            phase + open * ((static_cast<float>(k) + 0.5F) / static_cast<float>(steps) - 0.5F);
        const float angle = -0.75F + arm_swing * std::sin(when * scene_.arm / arm_swing);
        const float dx = static_cast<float>(x) - arm.shoulder_x,
                    dy = static_cast<float>(y) - arm.shoulder_y;
        const float along = dx * std::cos(angle) + dy * std::sin(angle);
        const float across = std::abs(dy * std::cos(angle) - dx * std::sin(angle));
        const float past = std::max({0.0F, -along, along - arm.length});
        const float radius = arm.radius * (1 - 0.25F * std::clamp(along / arm.length, 0.0F, 1.0F));
        const float inside = radius - std::hypot(across, past);
        const float cover = std::clamp(inside + 0.5F, 0.0F, 1.0F);
        if (cover <= 0) continue;
        const float round = std::sqrt(std::max(0.0F, 1 - across * across / (radius * radius)));
        const float texture =
            1 + 0.25F * fractal_noise(0.15F * along, 0.15F * across, 2, seed_ + 5);
        const ActorColour& colour = along < 0.8F * arm.length ? sleeve_ : skin_;
        for (std::size_t c = 0; c < 3; ++c)
          sum[c] += cover * colour[c] * (0.5F + 0.5F * round) * texture;
        sum[3] += cover;
        sum[4] += cover * scene_.actor.spill *
                  (0.4F + 2 * std::exp(-std::max(inside, 0.0F) / (0.012F * unit)));
      }
      const float share = 1.0F / static_cast<float>(steps);
      float* to = &person[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                           static_cast<std::size_t>(x)) *
                          actor_channels];
      const float through = 1 - sum[3] * share;
      for (std::size_t c = 0; c < sum.size(); ++c) to[c] = sum[c] * share + to[c] * through;
    }
  }
}

MadeFrame MadeClip::frame(int index) const {
  const float phase = phase_of(static_cast<float>(index));
  const float open = shutter * (phase_of(static_cast<float>(index) + 0.5F) -
                                phase_of(static_cast<float>(index) - 0.5F));
  const std::size_t pixels = static_cast<std::size_t>(height_) * static_cast<std::size_t>(width_);
  std::vector<float> person(pixels * actor_channels);
  const int steps = std::clamp(static_cast<int>(std::ceil(2 * scene_.walk * open)), 1, 8);
  for (int k = 0; k < steps; ++k) {
    const float when = (static_cast<float>(k) + 0.5F) / static_cast<float>(steps) - 0.5F;
    add_person(pose_at(phase + open * when), 1 / static_cast<float>(steps), person);
  }
  add_arm(phase, open, person);

  const float unit = static_cast<float>(height_);
  const float shadow_x = 0.5F * static_cast<float>(width_) + pose_at(phase).shift_x + 0.1F * unit;
  const float lamps = 1 + scene_.flicker * std::sin(2.3F * static_cast<float>(index));
  MadeFrame made{{}, capture::make_image(height_, width_, 4)};
  Image light = capture::make_image(height_, width_);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const float dx = (static_cast<float>(x) - shadow_x) / (0.33F * unit);
      const float dy = (static_cast<float>(y) - 0.66F * unit) / (0.52F * unit);
      const float dark = 1 - smooth_step(0.55F, 1.15F, std::hypot(dx, dy));
      const float lit = lamps * (1 - scene_.shadow * dark);
      const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                             static_cast<std::size_t>(x);
      const float* p = &person[at * actor_channels];
      for (int c = 0; c < 3; ++c) {
        const float spilled =
            p[4] * scene_.light * lamps * scene_.screen[static_cast<std::size_t>(c)];
        made.truth.at(y, x, c) = p[c];
        light.at(y, x, c) = p[c] + spilled + (1 - p[3]) * lit * screen_.at(y, x, c);
      }
      made.truth.at(y, x, 3) = std::clamp(p[3], 0.0F, 1.0F);
    }
  }
  made.seen = photograph(light, static_cast<std::uint64_t>(index));
  return made;
}

MadePicture MadeClip::plate_shot(int index) const {
  Image light = screen_;
  if (scene_.stale > 0 || scene_.shift_px > 0) {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        for (int c = 0; c < 3; ++c) {
          light.at(y, x, c) =
              (1 + scene_.stale) * screen_.at(y, std::min(x + scene_.shift_px, width_ - 1), c);
        }
      }
    }
  }
  return photograph(light, 0x10000 + static_cast<std::uint64_t>(index));
}

MadePicture MadeClip::photograph(const Image& light, std::uint64_t noise_seed) const {
  const MadeSensor sensor{scene_.noise_gain, scene_.noise_floor, scene_.halved_chroma};
  return {height_, width_, photograph_light(light, sensor, capture::mixed_bits(seed_, noise_seed))};
}

}  // namespace compositing
