// Textures: mip levels and filtering.
#include "render/texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "capture/colour.h"

namespace render::texture_test {
namespace {

using render::footprint_grid;
using render::FootprintGrid;
using render::make_texture;
using render::sample;
using render::square_footprint;
using render::Texture;
using render::UvFootprint;

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
    const auto coarsest = sample(texture, 0.3F, 0.7F, square_footprint(1e5F));
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
      const auto linear = sample(colour, u + 3, v - 2, {});
      const auto codes = sample(plain, u, v, {});
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
  float previous = sample(texture, 0.4F, 0.6F, square_footprint(0.4F / 64))[1];
  for (float footprint = 0.4F / 64; footprint < 2; footprint *= 1.01F) {
    const float value = sample(texture, 0.4F, 0.6F, square_footprint(footprint))[1];
    EXPECT_NEAR(value, previous, 0.02) << footprint;
    previous = value;
  }
  EXPECT_NEAR(sample(texture, 0.0F, 0.5F, {})[0], sample(texture, 0.99999F, 0.5F, {})[0], 2e-3);
}

// Against a texture of three by three tiles laid out so.
TEST(Texture, GoesOnBeyondItsEdgesAsItSays) {
  constexpr int w = 8, h = 4;
  const auto texels = random_texels(w * h * 3, 3);
  const auto source = [](Wrap wrap, int i, int size) {
    if (wrap == Wrap::repeat) return (i + size) % size;
    if (wrap == Wrap::clamp) return std::clamp(i, 0, size - 1);
    return i < 0 ? -1 - i : i >= size ? 2 * size - 1 - i : i;
  };
  for (const Wrap along : {Wrap::repeat, Wrap::clamp, Wrap::mirror}) {
    for (const Wrap down : {Wrap::repeat, Wrap::clamp, Wrap::mirror}) {
      const Texture one = make_texture(w, h, 3, false, texels, {along, down});
      std::vector<std::uint8_t> tiles;
      for (int y = -h; y < 2 * h; ++y) {
        for (int x = -w; x < 2 * w; ++x) {
          const int at = source(down, y, h) * w + source(along, x, w);
          for (int c = 0; c < 3; ++c) tiles.push_back(texels[static_cast<std::size_t>(3 * at + c)]);
        }
      }
      const Texture all = make_texture(3 * w, 3 * h, 3, false, tiles);
      for (int i = 0; i < 400; ++i) {
        const float u = 2.7F * static_cast<float>(i % 20) / 20 - 0.85F;
        const float v = 2.7F * static_cast<float>(i / 20) / 20 - 0.85F;
        const auto there = sample(one, u, v, {}),
                   expected = sample(all, (u + 1) / 3, (v + 1) / 3, {});
        for (std::size_t c = 0; c < 3; ++c)
          ASSERT_NEAR(there[c], expected[c], 1e-4) << u << " " << v;
      }
    }
  }
}

// At every level: a clamped gradient's ends do not run into one another.
TEST(Texture, KeepsClampedEdgesApartAtEveryLevel) {
  std::vector<std::uint8_t> texels(64);
  for (std::size_t i = 0; i < 64; ++i) texels[i] = i < 32 ? 0 : 255;
  const Texture texture = make_texture(64, 1, 1, false, texels, {Wrap::clamp, Wrap::repeat});
  for (const TextureFilter filter : {TextureFilter::dense, TextureFilter::quick}) {
    for (float width = 0; width < 0.3F; width += 0.05F) {
      EXPECT_EQ(sample(texture, 0, 0.5F, square_footprint(width), filter)[0], 0) << width;
      EXPECT_NEAR(sample(texture, 1.5F, 0.5F, square_footprint(width), filter)[0], 1, 1e-5)
          << width;
    }
  }
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
      squares += std::pow(sample(texture, x / 64, 0.4F, square_footprint(width / 64))[0] - mean, 2);
      ++count;
    }
    EXPECT_LT(std::sqrt(squares / count), 0.045) << width;
  }
}

// Boards of random greys, side by side.
Texture boards(int side) {
  std::mt19937 random(9);
  std::vector<std::uint8_t> texels(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (int i = 0; i < side * side / 40; ++i) {
    const int x0 = static_cast<int>(random()) & (side - 1),
              y0 = static_cast<int>(random()) & (side - 1);
    const int w = 2 + static_cast<int>(random() % 60), h = 2 + static_cast<int>(random() % 20);
    const auto grey = static_cast<std::uint8_t>(random() & 255U);
    for (int y = y0; y < std::min(y0 + h, side); ++y) {
      for (int x = x0; x < std::min(x0 + w, side); ++x) {
        texels[static_cast<std::size_t>(y * side + x)] = grey;
      }
    }
  }
  return make_texture(side, side, 1, false, texels);
}

// As wide rectangles as pixels see of a floor at a slant, whichever way they lie.
TEST(Texture, IsNearTheMeanOfARectangle) {
  constexpr int side = 512, places = 300;
  const Texture texture = boards(side);
  std::mt19937 random(4);
  std::uniform_real_distribution<float> one(0, 1);
  for (const float narrow : {0.7F, 1.5F, 3.0F, 6.0F}) {
    for (const float longer : {1.0F, 2.5F, 4.0F}) {
      double squares = 0, sum = 0, sum_squares = 0;
      for (int i = 0; i < places; ++i) {
        const float u = one(random), v = one(random), turn = 6.28F * one(random);
        const float a = narrow * longer / side, b = narrow / side;
        const UvFootprint footprint{{a * std::cos(turn), a * std::sin(turn)},
                                    {-b * std::sin(turn), b * std::cos(turn)}};
        double mean = 0;
        constexpr int n = 24;
        for (int k = 0; k < n * n; ++k) {
          const float s = (static_cast<float>(k % n) + 0.5F) / n - 0.5F;
          const float t = (static_cast<float>(k / n) + 0.5F) / n - 0.5F;
          mean += double{sample(texture, u + s * footprint.a[0] + t * footprint.b[0],
                                v + s * footprint.a[1] + t * footprint.b[1], {})[0]} /
                  (n * n);
        }
        squares += std::pow(double{sample(texture, u, v, footprint)[0]} - mean, 2);
        sum += mean, sum_squares += mean * mean;
      }
      const double deviation = std::sqrt(sum_squares / places - std::pow(sum / places, 2));
      EXPECT_LT(std::sqrt(squares / places), 0.1 * deviation) << narrow << " x " << longer;
    }
  }
}

// Look-ups and what each stands for have the footprint's second moments.
TEST(FootprintGrid, SpreadsAsFarAsItsFootprintDoes) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> one(-1, 1);
  constexpr int width = 64, height = 256, last = 8;
  for (int i = 0; i < 500; ++i) {
    const float size = std::exp2(3 * one(random) + 3);  // texels
    const auto side = [&]() -> std::array<float, 2> {
      return {one(random) * size / width, one(random) * size / height};
    };
    const UvFootprint f{side(), side()};
    const FootprintGrid grid = footprint_grid(f, width, height, last, 12);
    if (grid.fine == last) continue;
    ASSERT_LE(grid.across, 2);
    ASSERT_LE(grid.along, 12);
    std::array<double, 3> wanted{}, found{};
    const auto add = [](std::array<double, 3>& to, const std::array<float, 2>& uv, double share) {
      const double x = double{uv[0]} * width, y = double{uv[1]} * height;
      to[0] += share * x * x, to[1] += share * x * y, to[2] += share * y * y;
    };
    add(wanted, f.a, 1.0 / 12), add(wanted, f.b, 1.0 / 12);
    for (int k = 0; k < grid.count(); ++k) add(found, grid.offset(k), 1.0 / grid.count());
    add(found, grid.step_along, 1.0 / 12), add(found, grid.step_across, 1.0 / 12);
    // What is narrower than a texel stays together.
    for (std::size_t c = 0; c < 3; ++c)
      ASSERT_NEAR(found[c], wanted[c], 0.1 + 1e-3 * wanted[0] + 1e-3 * wanted[2]);
  }
}

TEST(Texture, StaysFiniteForAnyCoordinate) {
  const Texture texture = make_texture(3, 7, 2, false, random_texels(42, 3));
  for (const float bad : {NAN, INFINITY, -INFINITY, 1e30F, -1e30F, -0.0F, 1.0F, -1e-20F}) {
    for (const float footprint : {0.0F, 1.0F, INFINITY, NAN}) {
      for (const float value : sample(texture, bad, 0.5F, square_footprint(footprint))) {
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
}  // namespace render::texture_test
