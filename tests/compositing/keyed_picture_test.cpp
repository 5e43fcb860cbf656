// Keyed frames as live pictures: texels that are keyed where they are seen.
#include "compositing/keyed_picture.h"

#include <gtest/gtest.h>

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
                                             keyer.dials());
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
