// Live video as textures: decoded, then filtered in linear light.
#include "render/video_texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "capture/rgbe.h"

namespace render::video_texture_test {
namespace {

capture::Image noise(int height, int width, int channels = 3) {
  std::mt19937 random(static_cast<unsigned>(height * 1000 + width));
  std::uniform_real_distribution<float> uniform(0, 2);
  capture::Image image = capture::make_image(height, width, channels);
  for (float& value : image.pixels) value = uniform(random);
  return image;
}

Vec3f mean_of(const capture::Image& image) {
  double r = 0, g = 0, b = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x)
      r += image.at(y, x, 0), g += image.at(y, x, 1), b += image.at(y, x, 2);
  }
  const double n = image.height * image.width;
  return {static_cast<float>(r / n), static_cast<float>(g / n), static_cast<float>(b / n)};
}

void expect_near(Vec3f a, Vec3f b, float tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(MakeVideoTexture, KeepsTheMeanInEveryLevelWhateverTheSize) {
  for (const auto& [height, width] : {std::pair(64, 64), {45, 67}, {1, 37}, {101, 3}, {1, 1}}) {
    const capture::Image image = noise(height, width);
    const VideoTexture texture = make_video_texture(image);
    for (const capture::Image& level : texture.levels)
      expect_near(mean_of(level), mean_of(image), 1e-4F);
    EXPECT_EQ(texture.levels.back().width, 1);
    EXPECT_EQ(texture.levels.back().height, 1);
  }
}

TEST(MakeVideoTexture, MadeAgainIsAsMadeAnew) {
  VideoTexture texture = make_video_texture(noise(90, 160));
  make_video_texture(noise(33, 20, 4), texture);
  const VideoTexture fresh = make_video_texture(noise(33, 20, 4));
  ASSERT_EQ(texture.levels.size(), fresh.levels.size());
  for (std::size_t k = 0; k < fresh.levels.size(); ++k)
    EXPECT_EQ(texture.levels[k].pixels, fresh.levels[k].pixels);
}

TEST(MakeVideoTexture, CountsWhatIsNoNumberAsNoLight) {
  capture::Image image = noise(8, 8);
  image.at(2, 3, 1) = std::nanf("");
  image.at(5, 5, 0) = HUGE_VALF;
  image.at(6, 5, 0) = 1e30F;
  const VideoTexture texture = make_video_texture(image);
  EXPECT_EQ(texture.not_numbers, 2);
  EXPECT_EQ(texture.levels[0].at(2, 3, 1), 0);
  EXPECT_EQ(texture.levels[0].at(5, 5, 0), 0);
  for (const capture::Image& level : texture.levels) {
    for (const float value : level.pixels) EXPECT_TRUE(std::isfinite(value));
  }
}

// One texel of each format, with what it must be.
struct Packed {
  VideoFormat format;
  std::vector<std::uint8_t> bytes;
  std::array<float, 4> light;
  int channels;
};

TEST(MakeVideoTexture, DecodesEveryFormat) {
  const auto light = [](double code) {
    return static_cast<float>(capture::decode(capture::Transfer::srgb, code));
  };
  const std::vector<Packed> all{
      {VideoFormat::rgb565,
       {0xEA, 0x8B},  // 10001 011111 01010
       {light(17 / 31.0), light(31 / 63.0), light(10 / 31.0), 0},
       3},
      {VideoFormat::rgb8, {255, 128, 3}, {1, light(128 / 255.0), light(3 / 255.0), 0}, 3},
      {VideoFormat::rgba8, {255, 0, 128, 51}, {0.2F, 0, 0.2F * light(128 / 255.0), 0.2F}, 4},
      {VideoFormat::rgb_half, {0x00, 0x3C, 0x00, 0xC0, 0xFF, 0x7B}, {1, -2, 65504, 0}, 3},
      {VideoFormat::rgba_half, {0, 0x3C, 0, 0x38, 0, 0, 0, 0x38}, {1, 0.5F, 0, 0.5F}, 4},
  };
  for (const Packed& p : all) {
    const VideoTexture texture = make_video_texture(
        PackedFrame{p.format, 1, 1, std::as_bytes(std::span(p.bytes)), capture::Transfer::srgb});
    ASSERT_EQ(texture.levels[0].channels, p.channels);
    for (int c = 0; c < p.channels; ++c)
      EXPECT_NEAR(texture.levels[0].at(0, 0, c), p.light[static_cast<std::size_t>(c)], 1e-6F)
          << static_cast<int>(p.format) << " " << c;
  }
}

// Mantissas of different exponents must not be mixed: 1000 beside 1 is 500.5 in the middle.
TEST(MakeVideoTexture, DecodesRadianceBeforeItFilters) {
  std::vector<std::uint8_t> bytes;
  for (const float value : {1.0F, 1000.0F}) {
    const capture::Rgbe rgbe = capture::rgbe_from_radiance(value, value, value);
    bytes.insert(bytes.end(), rgbe.begin(), rgbe.end());
  }
  const VideoTexture texture =
      make_video_texture(PackedFrame{VideoFormat::rgbe, 2, 1, std::as_bytes(std::span(bytes))});
  EXPECT_NEAR(sample(texture, 0.5F, 0.5F, 0).x, 500.5F, 2);
  EXPECT_NEAR(sample(texture, 0.5F, 0.5F, 1).x, 500.5F, 2);
}

TEST(MakeVideoTexture, RefusesWhatIsNoFrame) {
  EXPECT_THROW(make_video_texture(capture::Image{}), std::invalid_argument);
  EXPECT_THROW(make_video_texture(noise(2, 2, 2)), std::invalid_argument);
  const std::vector<std::byte> bytes(11);
  EXPECT_THROW(make_video_texture(PackedFrame{VideoFormat::rgb8, 2, 2, bytes}),
               std::invalid_argument);
  EXPECT_THROW(make_video_texture(PackedFrame{VideoFormat::rgb8, 0, 2, {}}), std::invalid_argument);
}

TEST(SampleVideo, FindsEveryTexelAtItsMiddle) {
  const capture::Image image = noise(7, 10);
  const VideoTexture texture = make_video_texture(image);
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 10; ++x) {
      const float u = (static_cast<float>(x) + 0.5F) / 10, v = (static_cast<float>(y) + 0.5F) / 7;
      EXPECT_NEAR(sample(texture, u, v, 0).x, image.at(y, x, 0), 1e-5F);
    }
  }
}

TEST(SampleVideo, GoesOnBeyondTheEdgeAndDoesNotRepeat) {
  capture::Image image = capture::make_image(1, 2);
  image.at(0, 1, 0) = 1;
  const VideoTexture texture = make_video_texture(image);
  EXPECT_EQ(sample(texture, -0.3F, 0.5F, 0).x, 0);
  EXPECT_EQ(sample(texture, 1.0F, 0.5F, 0).x, 1);
  EXPECT_EQ(sample(texture, 7.0F, 0.5F, 0).x, 1);
  EXPECT_EQ(sample(texture, std::nanf(""), 0.5F, std::nanf("")).x, 0);
}

// A picture's edge, as squares of any size cross it.
TEST(SampleVideo, IsTheMeanOfASquare) {
  constexpr int edge = 31;
  capture::Image image = capture::make_image(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = edge; x < 64; ++x) image.at(y, x, 0) = 1;
  }
  const VideoTexture texture = make_video_texture(image);
  for (const float width : {1.5F, 2.0F, 3.0F, 4.0F, 6.0F, 8.0F, 12.0F}) {
    double squares = 0;
    int count = 0;
    for (float x = edge - width; x < edge + width; x += 0.13F) {
      const float mean = std::clamp((x - edge) / width + 0.5F, 0.0F, 1.0F);
      squares += std::pow(sample(texture, x / 64, 0.4F, width / 64).x - mean, 2);
      ++count;
    }
    EXPECT_LT(std::sqrt(squares / count), 0.05) << width;
  }
}

TEST(SampleVideo, HasNoJumpAsSquaresGrow) {
  const VideoTexture texture = make_video_texture(noise(64, 64));
  float before = sample(texture, 0.43F, 0.58F, 0.4F / 64).x;
  for (float footprint = 0.4F / 64; footprint < 1; footprint *= 1.01F) {
    const float now = sample(texture, 0.43F, 0.58F, footprint).x;
    EXPECT_NEAR(now, before, 0.03F) << footprint;
    before = now;
  }
}

TEST(SampleVideo, NearsTheMeanAsTheFilterGrows) {
  const VideoTexture texture = make_video_texture(noise(64, 64));
  const float mean = texture.levels.back().at(0, 0, 0);
  float before = 2;
  for (const float footprint : {0.0F, 0.06F, 0.2F, 1.0F, 8.0F}) {
    float worst = 0;
    for (float u = 0.05F; u < 1; u += 0.1F)
      worst = std::max(worst, std::abs(sample(texture, u, u, footprint).x - mean));
    EXPECT_LE(worst, before) << footprint;
    before = worst;
  }
  EXPECT_LT(before, 1e-5F);
}

TEST(MeanOver, AddsUpToTheMeanOfThePicture) {
  for (const int n : {1, 3, 5, 16}) {
    const VideoTexture texture = make_video_texture(noise(90, 133));
    Vec3f sum;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const auto at = [n](int k) { return static_cast<float>(k) / static_cast<float>(n); };
        sum += mean_over(texture, at(i), at(j), at(i + 1), at(j + 1));
      }
    }
    expect_near(sum * (1 / static_cast<float>(n * n)), mean_of(texture.levels[0]), 1e-4F);
  }
}

TEST(MeanOver, TellsOnePartFromAnother) {
  capture::Image image = capture::make_image(100, 100);
  for (int y = 0; y < 100; ++y) {
    for (int x = 40; x < 60; ++x) image.at(y, x, 1) = 3;
  }
  const VideoTexture texture = make_video_texture(image);
  EXPECT_NEAR(mean_over(texture, 0.4F, 0.2F, 0.6F, 0.4F).y, 3, 0.3F);
  EXPECT_NEAR(mean_over(texture, 0.0F, 0.2F, 0.2F, 0.4F).y, 0, 1e-5F);
}

}  // namespace
}  // namespace render::video_texture_test
