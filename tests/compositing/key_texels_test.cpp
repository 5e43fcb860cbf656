// Many texels at once against each by itself.
#include "compositing/key_texels.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "capture/counter_random.h"
#include "compositing/keyer.h"

namespace compositing {
namespace {

float random(std::uint64_t seed, std::uint64_t of) {
  return static_cast<float>(capture::uniform_high(capture::mixed_bits(seed, of)));
}

TEST(KeyTexels, OfManyIsTheOneOfEach) {
  constexpr int height = 37, width = 51;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    CleanPlate plate;
    plate.light = capture::make_image(height, width);
    plate.colour = static_cast<ScreenColour>(seed % 6);
    for (std::size_t i = 0; i < plate.light.pixels.size(); ++i)
      plate.light.pixels[i] =
          random(seed, i) * (static_cast<int>(i % 3) == channels_of(plate.colour)[0] ? 0.9F : 0.2F);
    KeySettings settings;
    settings.method = seed % 4 == 3 ? KeyMethod::difference : KeyMethod::screen;
    settings.learned = seed % 3 != 1;
    settings.despill = seed % 5 == 0 ? 1.6F : 1;
    const Keyer keyer(plate, settings);
    std::vector<TexelLanes> texels(1 + seed);
    for (std::size_t i = 0; i < texels.size(); ++i) {
      for (int lane = 0; lane < key_lanes; ++lane) {
        const std::uint64_t of = 8 * i + static_cast<std::uint64_t>(lane);
        texels[i].y[lane] = static_cast<int>(random(50 + seed, of) * (height + 6)) - 3;
        texels[i].x[lane] = static_cast<int>(random(90 + seed, of) * (width + 6)) - 3;
        for (std::size_t c = 0; c < 3; ++c)
          texels[i].light[c][lane] = random(130 + seed, 3 * of + c);
      }
    }
    texels[0].light[1][3] = std::numeric_limits<float>::quiet_NaN();
    texels[0].light[2][4] = -1;
    std::vector<std::array<F8, 4>> keyed(texels.size());
    key_texels(keyer.lit(), keyer.dials(), texels, keyed.data());
    for (std::size_t i = 0; i < texels.size(); ++i) {
      for (int lane = 0; lane < key_lanes; ++lane) {
        const int y = std::clamp(texels[i].y[lane], 0, height - 1);
        const int x = std::clamp(texels[i].x[lane], 0, width - 1);
        const auto one = key_texel(
            keyer.lit(), keyer.dials(), y, x,
            {texels[i].light[0][lane], texels[i].light[1][lane], texels[i].light[2][lane]});
        for (std::size_t c = 0; c < 4; ++c)
          ASSERT_EQ(keyed[i][c][lane], one[c]) << seed << " " << i << " " << lane << " " << c;
      }
    }
  }
}

}  // namespace
}  // namespace compositing
