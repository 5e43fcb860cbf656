// Levels of keyed frames, and look-ups between them.
#include "compositing/keyed_texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <stdexcept>
#include <tuple>

#include <gtest/gtest.h>

#include "capture/half.h"
#include "compositing/keyer.h"
#include "compositing/made_clip.h"
#include "render/video_texture.h"

namespace compositing::keyed_texture_test {
namespace {

capture::Image random_picture(int height, int width, int channels, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> one(0, 1);
  capture::Image image = capture::make_image(height, width, channels);
  for (float& value : image.pixels) value = one(random);
  return image;
}

float value_at(const capture::HalfImage& level, int y, int x, int c) {
  return capture::float_from_half(level.pixels[level.index(y, x, c)]);
}

// The same light, as render's textures have it.
std::array<float, 4> reference(const render::VideoTexture& texture, float u, float v, float wide) {
  std::array<render::VideoSample, render::most_video_samples> places;
  const std::size_t count = render::find_video_samples(
      texture.width(), texture.height(), u, v,
      render::undistorted_square(texture.width(), texture.height(), wide), 0, places);
  std::array<float, 4> sum{};
  for (const render::VideoSample& place : std::span(places).first(count)) {
    const capture::Image& level = texture.levels[place.level];
    const float x = std::clamp(place.x, 0.0F, static_cast<float>(level.width - 1));
    const float y = std::clamp(place.y, 0.0F, static_cast<float>(level.height - 1));
    for (int j = 0; j < level.height; ++j) {
      for (int i = 0; i < level.width; ++i) {
        const float near_x = std::max(0.0F, 1 - std::abs(x - static_cast<float>(i)));
        const float near_y = std::max(0.0F, 1 - std::abs(y - static_cast<float>(j)));
        for (int c = 0; c < 4; ++c) {
          sum[static_cast<std::size_t>(c)] += place.share * near_x * near_y * level.at(j, i, c);
        }
      }
    }
  }
  return sum;
}

// All 0 but for one pixel of `each`.
capture::Image sparse_picture(int height, int width, int each, unsigned seed) {
  capture::Image image = random_picture(height, width, 4, seed);
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    if (random() % static_cast<unsigned>(each) != 0) std::fill_n(&image.pixels[i], 4, 0.0F);
  }
  return image;
}

TEST(KeyedTexture, HasTheMeansOfItsFrameAtEveryLevel) {
  for (const auto& [height, width, each] :
       {std::tuple(48, 64, 1), {48, 68, 20}, {53, 91, 1}, {1, 7, 1}, {30, 1, 1}, {1, 1, 1}}) {
    const capture::Image image = sparse_picture(height, width, each, 3);
    const auto texture = make_keyed_texture(image);
    const render::VideoTexture wanted = render::make_video_texture(image);
    ASSERT_EQ(texture->levels(), wanted.levels.size());
    for (std::size_t k = 0; k < wanted.levels.size(); ++k) {
      const capture::Image& level = wanted.levels[k];
      ASSERT_EQ(texture->level(k).width, level.width);
      ASSERT_EQ(texture->level(k).height, level.height);
      for (int y = 0; y < level.height; ++y) {
        for (int x = 0; x < level.width; ++x) {
          for (int c = 0; c < 4; ++c) {
            ASSERT_NEAR(value_at(texture->level(k), y, x, c), level.at(y, x, c), 1e-3)
                << width << "x" << height << " level " << k << ": " << x << " " << y;
          }
        }
      }
    }
  }
}

TEST(KeyedTexture, FiltersAsTheRendersTexturesDo) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> one(0, 1);
  for (const auto& [height, width] : {std::pair(96, 64), {53, 91}, {3, 200}, {5, 4}}) {
    const capture::Image image = random_picture(height, width, 4, 7);
    const auto texture = make_keyed_texture(image);
    const render::VideoTexture wanted = render::make_video_texture(image);
    for (int i = 0; i < 3000; ++i) {
      const float u = 1.2F * one(random) - 0.1F, v = 1.2F * one(random) - 0.1F;
      const float wide = std::exp2(-9 * one(random));
      const float texels = wide * std::sqrt(static_cast<float>(width * height));
      if (texels > 0.5F && texels < 2) continue;  // there a texel counts as the mean of its square
      const auto seen = texture->filtered(u, v, wide);
      const auto truth = reference(wanted, u, v, wide);
      for (std::size_t c = 0; c < 4; ++c) {
        ASSERT_NEAR(seen[c], truth[c], 1e-3)
            << width << "x" << height << ": " << u << " " << v << " wide " << wide;
      }
    }
  }
}

// The mean of a picture whose texels are squares, over a square of `wide` texels about (x, y).
double mean_of_squares(const capture::Image& image, double x, double y, double wide, int c) {
  double sum = 0;
  for (int j = 0; j < image.height; ++j) {
    const double high = std::min(j + 1.0, y + wide / 2) - std::max<double>(j, y - wide / 2);
    for (int i = 0; i < image.width && high > 0; ++i) {
      const double broad = std::min(i + 1.0, x + wide / 2) - std::max<double>(i, x - wide / 2);
      if (broad > 0) sum += high * broad * static_cast<double>(image.at(j, i, c));
    }
  }
  return sum / (wide * wide);
}

TEST(KeyedTexture, IsAsSharpAsFilmedWhereAPixelSeesOneTexel) {
  constexpr int size = 64;
  const capture::Image image = random_picture(size, size, 4, 9);
  const auto texture = make_keyed_texture(image);
  const double deviation = std::sqrt(1.0 / 12);  // of the texels
  std::mt19937 random(2);
  std::uniform_real_distribution<double> inside(4, size - 4);
  for (const auto& [wide, most] :
       {std::pair(1.0, 0.001), {1.05, 0.04}, {1.2, 0.08}, {1.5, 0.08}, {1.8, 0.06}, {2.0, 0.04}}) {
    double squares = 0;
    constexpr int places = 2000;
    for (int i = 0; i < places; ++i) {
      const double x = inside(random), y = inside(random);
      const auto seen =
          texture->filtered(static_cast<float>(x / size), static_cast<float>(y / size),
                            static_cast<float>(wide / size));
      const double error = static_cast<double>(seen[1]) - mean_of_squares(image, x, y, wide, 1);
      squares += error * error;
    }
    EXPECT_LT(std::sqrt(squares / places), most * deviation) << wide << " texels";
  }
}

// Memory of frames before leaves no trace.
TEST(KeyedTexture, ShowsNothingOfTheFramesThatItHeldBefore) {
  const MadeClip clip(made_scene("plain"), 2, 96, 160);
  std::vector<capture::Image> shots{light_of(clip.plate_shot(0)), light_of(clip.plate_shot(1))};
  Keyer keyer(average_plate(shots), {}), same(average_plate(shots), {});
  KeyedTexture again;
  again.take(random_picture(96, 160, 3, 1));
  for (int i = 0; i < 12; i += 3) {
    const capture::Image frame = light_of(clip.frame(i).seen);
    KeyedTexture fresh;
    keyer.key(frame, again.frame());
    same.key(frame, fresh.frame());
    again.finish();
    fresh.finish();
    ASSERT_EQ(again.levels(), fresh.levels());
    for (std::size_t k = 0; k < fresh.levels(); ++k) {
      ASSERT_EQ(again.level(k).pixels, fresh.level(k).pixels) << "frame " << i << " level " << k;
    }
  }
  again.take(random_picture(31, 17, 4, 1));
  EXPECT_EQ(again.level(1).width, 8);
}

TEST(KeyedTexture, IsClearByItsOwnFrameAlone) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> one(0, 1);
  KeyedTexture again;
  int clear = 0, not_clear = 0;
  for (const auto& [height, width] : {std::pair(80, 120), {80, 120}, {80, 120}, {64, 200}}) {
    capture::Image image = capture::make_image(height, width, 4);
    const int pixel = static_cast<int>(one(random) * static_cast<float>(height * width - 1));
    image.at(pixel / width, pixel % width, 3) = 1;
    again.take(image);
    const auto fresh = make_keyed_texture(image);
    for (int i = 0; i < 500; ++i) {
      const float u = one(random), v = one(random), wide = 0.1F * one(random);
      ASSERT_EQ(again.is_clear(u, v, wide), fresh->is_clear(u, v, wide)) << u << " " << v;
      (fresh->is_clear(u, v, wide) ? clear : not_clear) += 1;
    }
  }
  EXPECT_GT(clear, 200);
  EXPECT_GT(not_clear, 200);
}

TEST(KeyedTexture, IsBareWhereNobodyIs) {
  KeyedTexture texture;
  capture::Image picture = capture::make_image(70, 90, 4);
  for (const bool somebody : {false, true, false}) {
    picture.at(69, 89, 3) = somebody ? 0.1F : 0;
    texture.take(picture);
    EXPECT_EQ(texture.is_bare(), !somebody);
    EXPECT_EQ(texture.is_clear(0.95F, 0.95F, 0), !somebody);
  }
}

TEST(KeyedTexture, IsClearOnlyWhereALookUpFindsNothing) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> one(0, 1);
  for (const auto& [height, width] : {std::pair(270, 480), {307, 505}}) {
    const MadeClip clip(made_scene("plain"), 2, height, width);
    std::vector<capture::Image> shots{light_of(clip.plate_shot(0)), light_of(clip.plate_shot(1))};
    Keyer keyer(average_plate(shots), {});
    KeyedTexture texture;
    keyer.key(light_of(clip.frame(4).seen), texture.frame());
    texture.finish();
    int clear = 0, bare = 0;
    for (int i = 0; i < 40000; ++i) {
      const float u = 1.4F * one(random) - 0.2F, v = 1.4F * one(random) - 0.2F;
      const float wide = i % 4 == 0 ? 0 : std::exp2(-10 * one(random));
      const auto rgba = texture.filtered(u, v, wide);
      const bool nothing = rgba == std::array<float, 4>{};
      bare += nothing && wide == 0;
      if (!texture.is_clear(u, v, wide)) continue;
      clear += wide == 0;
      ASSERT_TRUE(nothing) << u << " " << v << " wide " << wide;
    }
    EXPECT_GT(clear, bare / 3);
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    constexpr float infinity = std::numeric_limits<float>::infinity();
    for (const float wide : {nan, infinity}) EXPECT_FALSE(texture.is_clear(0.01F, 0.01F, wide));
    for (const float at : {nan, infinity}) EXPECT_FALSE(texture.is_clear(at, 0.01F, 0));
    const auto whole = make_keyed_texture(random_picture(height, width, 3, 2));
    for (const float wide : {-1.0F, -infinity}) EXPECT_FALSE(whole->is_clear(0.4F, 0.6F, wide));
  }
}

// One faint pixel alone among bare ones is noise; a person's faint edges lie beside stronger ones.
TEST(KeyedFrame, HasNoLoneFaintPixels) {
  const MadeClip clip(made_scene("plain"), 2, 270, 480);
  std::vector<capture::Image> shots{light_of(clip.plate_shot(0)), light_of(clip.plate_shot(1))};
  Keyer keyer(average_plate(shots), {});
  KeyedFrame keyed;
  int lone = 0, soft = 0;
  for (int i = 4; i < 8; ++i) {
    keyer.key(light_of(clip.frame(i).seen), keyed);
    const capture::HalfImage& image = keyed.image();
    for (int y = 0; y < image.height; ++y) {
      for (int first = 0; first < image.width; first += KeyedFrame::run) {
        int found = 0;
        float most = 0;
        for (int x = first; x < first + KeyedFrame::run; ++x) {
          const float alpha = value_at(image, y, x, 3);
          found += alpha > 0;
          most = std::max(most, alpha);
        }
        lone += found == 1 && most < 0.02F;
        soft += most > 0.1F && most < 0.9F;
      }
    }
  }
  EXPECT_EQ(lone, 0);
  EXPECT_GT(soft, 400);
}

TEST(KeyedTexture, TakesPicturesThatAreNotKeyed) {
  capture::Image opaque = random_picture(4, 6, 3, 9);
  opaque.at(0, 0, 0) = std::numeric_limits<float>::quiet_NaN();
  opaque.at(0, 0, 1) = -std::numeric_limits<float>::infinity();
  opaque.at(0, 0, 2) = 1e9F;
  const auto texture = make_keyed_texture(opaque);
  EXPECT_EQ(value_at(texture->level(0), 0, 0, 0), 0);
  EXPECT_EQ(value_at(texture->level(0), 0, 0, 1), 0);
  EXPECT_EQ(value_at(texture->level(0), 0, 0, 2), capture::half_max);
  for (std::size_t k = 0; k < texture->levels(); ++k) {
    const capture::HalfImage& level = texture->level(k);
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) EXPECT_EQ(value_at(level, y, x, 3), 1);
    }
  }
  EXPECT_THROW(make_keyed_texture(capture::make_image(4, 4, 1)), std::invalid_argument);
  EXPECT_THROW(make_keyed_texture({}), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::keyed_texture_test
