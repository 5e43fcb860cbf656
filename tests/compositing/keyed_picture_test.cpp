// Keyed frames as live pictures: texels that are keyed where they are seen.
#include "compositing/keyed_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "compositing/made_clip.h"
#include "compositing/picture_window.h"

namespace compositing::keyed_picture_test {
namespace {

std::shared_ptr<const TexelKeyedPicture> picture_of(const char* scene,
                                                    const KeySettings& settings) {
  constexpr int height = 90, width = 160;
  const MadeClip clip(made_scene(scene), 3, height, width);
  std::vector<capture::Image> shots;
  for (int i = 0; i < 4; ++i) shots.push_back(light_of(clip.plate_shot(i)));
  Keyer keyer(average_plate(shots), settings);
  const capture::Image frame = light_of(clip.frame(8).seen);
  keyer.follow(frame);
  return std::make_shared<TexelKeyedPicture>(make_keyed_texture(frame), keyer.shared_lit(),
                                             keyer.shared_filtered(), keyer.dials());
}

// Inside, at the rim, beyond it and nowhere; as wide as a texel, and much wider.
std::vector<render::PicturePlace> places() {
  std::vector<render::PicturePlace> all;
  for (int i = 0; i < 500; ++i) {
    const auto n = static_cast<float>(i);
    const float u = std::fmod(n * 0.618034F, 1.3F) - 0.15F;
    const float v = std::fmod(n * 0.754878F, 1.3F) - 0.15F;
    all.push_back({u, v, i % 3 == 0 ? 0.0F : 0.002F * static_cast<float>(i % 40)});
  }
  all[77].u = std::numeric_limits<float>::quiet_NaN();
  all[78].v = std::numeric_limits<float>::infinity();
  return all;
}

void expect_alike(const render::LivePicture& picture) {
  const std::vector<render::PicturePlace> at = places();
  std::vector<std::array<float, 4>> together(at.size(), {9, 9, 9, 9});
  picture.look_up_all(at, together);
  int seen = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const auto alone = picture.look_up(at[i].u, at[i].v, at[i].footprint_uv);
    ASSERT_EQ(together[i], alone) << i;
    seen += alone[3] > 0.5F;
  }
  EXPECT_GT(seen, 20);
}

TEST(TexelKeyedPicture, IsTheSameToTheBitHoweverManyAreLookedUp) {
  for (const char* scene : {"plain", "blue screen", "yellow screen"}) {
    SCOPED_TRACE(scene);
    const auto picture = picture_of(scene, {});
    expect_alike(*picture);
    expect_alike(*see_through({0.2F, 0.1F, 0.9F, 1}, picture));
  }
  KeySettings by_difference;
  by_difference.method = KeyMethod::difference;
  expect_alike(*picture_of("plain", by_difference));
  KeySettings plain;
  plain.learned = false;
  expect_alike(*picture_of("plain", plain));
}

// A room of patches with a disc of a person in it, seen in its own size down to 1/24 of it: keyed
// texel by texel it looks as the frame that is keyed first.
TEST(TexelKeyedPicture, IsAsClearBeforeAPatternHoweverSmallItIsSeen) {
  constexpr int height = 144, width = 192;
  const auto light = [](int y, int x, int c) {
    return 0.05F + 0.6F * static_cast<float>((x * 37 + y * 59 + c * 11 + x * y) % 17) / 17;
  };
  capture::Image room = capture::make_image(height, width, 3);
  capture::Image frame = room;
  const auto is_person = [](int y, int x) { return std::hypot(y - 72, x - 96) < 40; };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        room.at(y, x, c) = light(y, x, c);
        frame.at(y, x, c) = is_person(y, x) ? (c == 0 ? 0.9F : 0.7F) : light(y, x, c);
      }
    }
  }
  KeySettings settings;
  settings.method = KeyMethod::difference;
  Keyer keyer(average_plate(std::vector(4, room)), settings);
  KeyedTexture first;
  keyer.key(frame, first.frame());
  first.finish();
  const KeyedPicture by_frame(std::make_shared<KeyedTexture>(std::move(first)));
  const TexelKeyedPicture by_texel(make_keyed_texture(frame), keyer.shared_lit(),
                                   keyer.shared_filtered(), keyer.dials());
  const float texel = 1 / std::sqrt(static_cast<float>(width) * static_cast<float>(height));
  for (const float wide : {0.5F, 1.0F, 3.0F, 8.0F, 24.0F}) {
    SCOPED_TRACE(wide);
    double worst_clear = 0, worst_person = 1;
    for (int i = 0; i < 400; ++i) {
      const float u = std::fmod(static_cast<float>(i) * 0.618034F, 1.0F);
      const float v = std::fmod(static_cast<float>(i) * 0.754878F, 1.0F);
      const float away =
          std::hypot(v * static_cast<float>(height) - 72, u * static_cast<float>(width) - 96);
      const float seen = by_texel.look_up(u, v, wide * texel)[3];
      const float is = by_frame.look_up(u, v, wide * texel)[3];
      const bool inside = u > 0.15F && u < 0.85F && v > 0.15F && v < 0.85F;
      if (!inside) continue;
      if (away > 42 + wide) worst_clear = std::max<double>(worst_clear, seen - is);
      if (away < 38 - wide) worst_person = std::min<double>(worst_person, seen);
    }
    EXPECT_LT(worst_clear, 0.05);
    EXPECT_GT(worst_person, 0.9);
  }
}

TEST(TexelKeyedPicture, LooksUpNothingOfNowhere) {
  const auto picture = picture_of("plain", {});
  picture->look_up_all({}, {});
  std::array<std::array<float, 4>, 2> rgba{{{1, 1, 1, 1}, {1, 1, 1, 1}}};
  const std::array<render::PicturePlace, 2> beyond{{{-2, 0.5F, 0.01F}, {0.5F, 3, 0.01F}}};
  picture->look_up_all(beyond, rgba);
  for (const auto& one : rgba) EXPECT_EQ(one, (std::array<float, 4>{}));
}

}  // namespace
}  // namespace compositing::keyed_picture_test
