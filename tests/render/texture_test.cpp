// Textures: mip levels and filtering.
#include "render/texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "capture/colour.h"

namespace {

using render::make_texture;
using render::sample;
using render::Texture;

double light_of(int code) { return capture::decode(capture::Transfer::srgb, code / 255.0); }

std::vector<std::uint8_t> random_texels(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> texels(count);
  for (auto& texel : texels) texel = static_cast<std::uint8_t>(random() & 255U);
  return texels;
}

TEST(Texture, KeepsTheMeanInLinearLightOnEveryLevel) {
  for (const auto& [width, height] : {std::pair{64, 64}, {37, 21}, {128, 3}, {1, 50}}) {
    const auto texels = random_texels(static_cast<std::size_t>(width * height) * 3, 5);
    const Texture texture = make_texture(width, height, 3, true, texels);
    double mean = 0;
    for (std::size_t i = 0; i < texels.size(); i += 3) mean += light_of(texels[i]);
    mean /= width * height;
    const auto coarsest = sample(texture, 0.3F, 0.7F, 1e5F);
    EXPECT_NEAR(coarsest[0], mean, 0.012) << width << "x" << height;
  }
}

TEST(Texture, GivesTheTexelItselfAtItsCentre) {
  const auto texels = random_texels(8 * 5 * 4, 7);
  const Texture colour = make_texture(8, 5, 4, true, texels);
  const Texture plain = make_texture(8, 5, 4, false, texels);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 8; ++x) {
      const float u = (static_cast<float>(x) + 0.5F) / 8;
      const float v = (static_cast<float>(y) + 0.5F) / 5;
      const std::uint8_t* texel = &texels[static_cast<std::size_t>(y * 8 + x) * 4];
      const auto linear = sample(colour, u + 3, v - 2, 0);
      const auto codes = sample(plain, u, v, 0);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(linear[c], light_of(texel[c]), 2e-4);
        EXPECT_NEAR(codes[c], texel[c] / 255.0, 2e-4);
      }
      EXPECT_NEAR(linear[3], texel[3] / 255.0, 2e-4) << "alpha is never decoded";
    }
  }
}

TEST(Texture, IsContinuousInTheFootprintAndAcrossItsEdge) {
  const Texture texture = make_texture(64, 64, 3, false, random_texels(64 * 64 * 3, 11));
  float previous = sample(texture, 0.4F, 0.6F, 1.0F / 64)[1];
  for (float footprint = 1.0F / 64; footprint < 2; footprint *= 1.01F) {
    const float value = sample(texture, 0.4F, 0.6F, footprint)[1];
    EXPECT_NEAR(value, previous, 0.02) << footprint;
    previous = value;
  }
  EXPECT_NEAR(sample(texture, 0.0F, 0.5F, 0)[0], sample(texture, 0.99999F, 0.5F, 0)[0], 2e-3);
}

// An edge, as squares of any size cross it.
TEST(Texture, IsNearTheMeanOfASquare) {
  constexpr int edge = 31;
  std::vector<std::uint8_t> texels(64 * 64);
  for (std::size_t i = 0; i < texels.size(); ++i) texels[i] = i % 64 < edge ? 0 : 255;
  const Texture texture = make_texture(64, 64, 1, false, texels);
  for (const float width : {1.5F, 2.0F, 3.0F, 4.0F, 6.0F, 8.0F, 12.0F}) {
    double squares = 0;
    int count = 0;
    for (float x = edge - width; x < edge + width; x += 0.13F) {
      const float mean = std::clamp((x - edge) / width + 0.5F, 0.0F, 1.0F);
      squares += std::pow(sample(texture, x / 64, 0.4F, width / 64)[0] - mean, 2);
      ++count;
    }
    EXPECT_LT(std::sqrt(squares / count), 0.08) << width;
  }
}

TEST(Texture, StaysFiniteForAnyCoordinate) {
  const Texture texture = make_texture(3, 7, 2, false, random_texels(42, 3));
  for (const float bad : {NAN, INFINITY, -INFINITY, 1e30F, -1e30F, -0.0F, 1.0F, -1e-20F}) {
    for (const float footprint : {0.0F, 1.0F, INFINITY, NAN}) {
      for (const float value : sample(texture, bad, 0.5F, footprint)) {
        EXPECT_GE(value, 0);
        EXPECT_LE(value, 1);
      }
    }
  }
}

TEST(Texture, RefusesWrongSizes) {
  EXPECT_THROW(make_texture(0, 4, 3, true, {}), std::invalid_argument);
  EXPECT_THROW(make_texture(2, 2, 5, true, std::vector<std::uint8_t>(20)), std::invalid_argument);
  EXPECT_THROW(make_texture(2, 2, 3, true, std::vector<std::uint8_t>(11)), std::invalid_argument);
}

}  // namespace
