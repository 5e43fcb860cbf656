// Sensors' own codes to light: exact unpacking, and colour from a mosaic.
#include "capture/raw.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <stdexcept>

namespace capture::raw_test {
namespace {

constexpr std::array patterns{BayerPattern::rggb, BayerPattern::grbg, BayerPattern::gbrg,
                              BayerPattern::bggr};

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> all;
  for (const int value : values) all.push_back(static_cast<std::byte>(value));
  return all;
}

std::vector<std::uint16_t> unpack(Packing packing,
                                  int bits,
                                  const std::vector<std::byte>& from,
                                  std::size_t sites) {
  std::vector<std::uint16_t> to(sites);
  unpack_row(packing, bits, from, to);
  return to;
}

// Packed as videodev2.h's formats say, straight from their definition.
std::vector<std::byte> pack(Packing packing, const std::vector<std::uint16_t>& codes) {
  std::vector<std::byte> to(packed_row_bytes(packing, static_cast<int>(codes.size())));
  for (std::size_t x = 0; x < codes.size(); ++x) {
    const unsigned code = codes[x];
    switch (packing) {
      case Packing::bytes:
        to[x] = static_cast<std::byte>(code);
        break;
      case Packing::words:
        to[2 * x] = static_cast<std::byte>(code & 255U);
        to[2 * x + 1] = static_cast<std::byte>(code >> 8U);
        break;
      case Packing::mipi10:
        to[x / 4 * 5 + x % 4] = static_cast<std::byte>(code >> 2U);
        to[x / 4 * 5 + 4] |= static_cast<std::byte>((code & 3U) << (2 * (x % 4)));
        break;
      case Packing::mipi12:
        to[x / 2 * 3 + x % 2] = static_cast<std::byte>(code >> 4U);
        to[x / 2 * 3 + 2] |= static_cast<std::byte>((code & 15U) << (4 * (x % 2)));
        break;
    }
  }
  return to;
}

using ColourAt = double (*)(double y, double x, int c);

Mosaic photograph(BayerPattern pattern, int width, int height, ColourAt colour) {
  Mosaic mosaic;
  mosaic.resize(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      mosaic.row(y)[x] = static_cast<float>(colour(y, x, colour_of_site(pattern, y, x)));
    }
  }
  return mosaic;
}

double rms_error(const Image& image, ColourAt colour) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < 3; ++c) sum += std::pow(image.at(y, x, c) - colour(y, x, c), 2);
    }
  }
  return std::sqrt(sum / static_cast<double>(image.pixels.size()));
}

// A mosaic's colour by means of the nearest sites, to compare with.
Image bilinear(const Mosaic& mosaic, BayerPattern pattern) {
  Image image = make_image(mosaic.height, mosaic.width);
  for (int y = 0; y < mosaic.height; ++y) {
    for (int x = 0; x < mosaic.width; ++x) {
      std::array<double, 3> sum{};
      std::array<int, 3> sites{};
      const int own = colour_of_site(pattern, y, x);
      for (int j = std::max(y - 1, 0); j <= std::min(y + 1, mosaic.height - 1); ++j) {
        for (int i = std::max(x - 1, 0); i <= std::min(x + 1, mosaic.width - 1); ++i) {
          const auto c = static_cast<std::size_t>(colour_of_site(pattern, j, i));
          if (static_cast<int>(c) == own && (i != x || j != y)) continue;
          sum[c] += static_cast<double>(mosaic.row(j)[i]);
          ++sites[c];
        }
      }
      for (std::size_t c = 0; c < 3; ++c) {
        image.at(y, x, static_cast<int>(c)) = static_cast<float>(sum[c] / sites[c]);
      }
    }
  }
  return image;
}

TEST(UnpackRow, GivesBackWhatWasPacked) {
  std::mt19937 random(1);
  const std::array<std::pair<Packing, int>, 7> kinds{{{Packing::bytes, 8},
                                                      {Packing::words, 10},
                                                      {Packing::words, 12},
                                                      {Packing::words, 14},
                                                      {Packing::words, 16},
                                                      {Packing::mipi10, 10},
                                                      {Packing::mipi12, 12}}};
  for (const auto& [packing, bits] : kinds) {
    for (std::size_t sites = 1; sites < 20; ++sites) {
      std::vector<std::uint16_t> codes(sites);
      for (auto& code : codes) code = static_cast<std::uint16_t>(random() % (1U << bits));
      EXPECT_EQ(unpack(packing, bits, pack(packing, codes), sites), codes) << bits;
    }
  }
}

TEST(UnpackRow, FollowsTheFormatsDefinition) {
  using Codes = std::vector<std::uint16_t>;
  EXPECT_EQ(unpack(Packing::words, 12, bytes({0xbc, 0x0a, 0xff, 0xff}), 2), (Codes{0xabc, 0xfff}))
      << "bits above are no light";
  EXPECT_EQ(unpack(Packing::mipi10, 10, bytes({0xff, 0, 0, 0x80, 0b01'00'11'10}), 4),
            (Codes{0x3fe, 3, 0, 0x201}));
  EXPECT_EQ(unpack(Packing::mipi12, 12, bytes({0xab, 0x12, 0x3c}), 2), (Codes{0xabc, 0x123}));
}

TEST(UnpackRow, RefusesRowsThatAreTooShortOrOfOtherBits) {
  EXPECT_THROW(unpack(Packing::words, 10, bytes({1, 2, 3}), 2), std::invalid_argument);
  EXPECT_THROW(unpack(Packing::mipi10, 10, bytes({1, 2, 3, 4}), 2), std::invalid_argument);
  EXPECT_THROW(unpack(Packing::mipi10, 12, bytes({1, 2, 3, 4, 5}), 4), std::invalid_argument);
  EXPECT_THROW(unpack(Packing::words, 17, bytes({1, 2}), 1), std::invalid_argument);
}

TEST(Demosaic, KeepsEverySiteAsItIs) {
  const ColourAt noise = [](double y, double x, int) {
    return std::abs(std::fmod(std::sin(y * 12.9 + x * 78.2) * 43758.5, 1.0));
  };
  for (const BayerPattern pattern : patterns) {
    Mosaic mosaic = photograph(pattern, 12, 10, noise);
    Image image;
    demosaic(mosaic, pattern, {0, 0, 12, 10}, image);
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 12; ++x) {
        EXPECT_EQ(image.at(y, x, colour_of_site(pattern, y, x)), mosaic.row(y)[x]);
      }
    }
  }
}

TEST(Demosaic, IsExactForEvenColourUpToTheEdge) {
  const ColourAt even = [](double, double, int c) { return 0.25 * (c + 1); };
  for (const BayerPattern pattern : patterns) {
    Mosaic mosaic = photograph(pattern, 8, 6, even);
    Image image;
    demosaic(mosaic, pattern, {0, 0, 8, 6}, image);
    EXPECT_LT(rms_error(image, even), 1e-7);
  }
}

TEST(Demosaic, IsExactInsideForColoursThatChangeLinearly) {
  const ColourAt slopes = [](double y, double x, int c) {
    return 0.3 + 0.1 * c + (c - 1) * 0.004 * y + (0.5 - c) * 0.003 * x;
  };
  for (const BayerPattern pattern : patterns) {
    Mosaic mosaic = photograph(pattern, 16, 14, slopes);
    Image image;
    demosaic(mosaic, pattern, {0, 0, 16, 14}, image);
    for (int y = 2; y < 12; ++y) {
      for (int x = 2; x < 14; ++x) {
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.at(y, x, c), slopes(y, x, c), 1e-6);
      }
    }
  }
}

TEST(Demosaic, ErrsLessThanMeansOfNeighboursOnFineDetail) {
  // Rings of grey on a tinted ground: detail that the colours share, as in most pictures.
  const ColourAt rings = [](double y, double x, int c) {
    const double r2 = (y - 32) * (y - 32) + (x - 32) * (x - 32);
    return (0.5 + 0.3 * std::sin(r2 / 60)) * (1 - 0.1 * c);
  };
  for (const BayerPattern pattern : patterns) {
    Mosaic mosaic = photograph(pattern, 64, 64, rings);
    const double plain = rms_error(bilinear(mosaic, pattern), rings);
    Image image;
    demosaic(mosaic, pattern, {0, 0, 64, 64}, image);
    EXPECT_LT(rms_error(image, rings), 0.6 * plain);
  }
}

TEST(Demosaic, GivesAPartAsItIsInTheWhole) {
  const ColourAt waves = [](double y, double x, int c) { return 0.5 + 0.4 * std::sin(y * x + c); };
  Mosaic mosaic = photograph(BayerPattern::grbg, 20, 16, waves);
  Image whole;
  Image part;
  demosaic(mosaic, BayerPattern::grbg, {0, 0, 20, 16}, whole);
  demosaic(mosaic, BayerPattern::grbg, {5, 3, 7, 9}, part);
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 7; ++x) {
      for (int c = 0; c < 3; ++c) EXPECT_EQ(part.at(y, x, c), whole.at(y + 3, x + 5, c));
    }
  }
}

TEST(Demosaic, MakesNothingBrighterThanWhatSaturates) {
  const ColourAt edges = [](double y, double x, int) {
    return std::fmod(y + 2 * x, 5) < 2 ? 1.0 : 0.0;
  };
  Mosaic mosaic = photograph(BayerPattern::bggr, 20, 20, edges);
  Image image;
  demosaic(mosaic, BayerPattern::bggr, {0, 0, 20, 20}, image);
  for (const float light : image.pixels) {
    EXPECT_GE(light, 0);
    EXPECT_LE(light, 1);
  }
}

// Black with the noise of its sites, of either sign.
TEST(Demosaic, GivesNoiseAtBlackNoColour) {
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, 0.002F);
  Mosaic mosaic;
  mosaic.resize(256, 256);
  float darkest = 0;
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      mosaic.row(y)[x] = noise(random);
      darkest = std::min(darkest, mosaic.row(y)[x]);
    }
  }
  // A bright edge makes nothing darker than noise does.
  for (int y = 0; y < 256; ++y) mosaic.row(y)[255] = 1;
  Image image;
  demosaic(mosaic, BayerPattern::rggb, {0, 0, 256, 256}, image);
  for (const float value : image.pixels) ASSERT_GE(value, darkest);
  std::array<double, 3> mean{};
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 252; ++x) {
      for (int c = 0; c < 3; ++c) {
        mean[static_cast<std::size_t>(c)] += static_cast<double>(image.at(y, x, c)) / (256 * 252);
      }
    }
  }
  for (const double value : mean) EXPECT_NEAR(value, 0, 5e-5);
}

TEST(Demosaic, RefusesGreySensorsAndPartsBeyondThem) {
  Mosaic mosaic;
  mosaic.resize(8, 8);
  Image image;
  EXPECT_THROW(demosaic(mosaic, BayerPattern::none, {0, 0, 8, 8}, image), std::invalid_argument);
  EXPECT_THROW(demosaic(mosaic, BayerPattern::rggb, {1, 0, 8, 8}, image), std::invalid_argument);
  EXPECT_THROW(mosaic.resize(3, 8), std::invalid_argument);
}

TEST(MarkSaturated, LeavesOutWhatWasInterpolatedFromSaturatedSites) {
  Mosaic mosaic;
  mosaic.resize(20, 16);
  for (int y = 0; y < 16; ++y) std::fill_n(mosaic.row(y), 20, 0.5F);
  mosaic.row(7)[9] = 1;
  for (const Crop crop : {Crop{0, 0, 20, 16}, Crop{8, 7, 5, 4}, Crop{0, 0, 8, 16}}) {
    Image image;
    demosaic(mosaic, BayerPattern::rggb, crop, image);
    const Image before = image;
    mark_saturated(mosaic, BayerPattern::rggb, 0.98F, crop, image);
    for (int y = 0; y < crop.height; ++y) {
      for (int x = 0; x < crop.width; ++x) {
        const bool near = std::abs(crop.x + x - 9) <= 2 && std::abs(crop.y + y - 7) <= 2;
        for (int c = 0; c < 3; ++c) {
          const bool own = colour_of_site(BayerPattern::rggb, crop.y + y, crop.x + x) == c;
          if (near && !own) {
            EXPECT_TRUE(std::isnan(image.at(y, x, c))) << x << ' ' << y;
          } else {
            EXPECT_EQ(image.at(y, x, c), before.at(y, x, c)) << x << ' ' << y;
          }
        }
      }
    }
  }
}

TEST(MarkSaturated, KeepsWhatIsSaturatedAllAround) {
  constexpr Crop whole{0, 0, 21, 16};
  Mosaic mosaic;
  mosaic.resize(whole.width, whole.height);
  for (int y = 0; y < whole.height; ++y) {
    std::fill_n(mosaic.row(y), whole.width, 0.5F);
    if (y >= 5) std::fill_n(mosaic.row(y), whole.width, 1.0F);
  }
  Image image;
  demosaic(mosaic, BayerPattern::gbrg, whole, image);
  mark_saturated(mosaic, BayerPattern::gbrg, 0.98F, whole, image);
  for (int y = 0; y < whole.height; ++y) {
    for (int x = 0; x < whole.width; ++x) {
      int none = 0;
      for (int c = 0; c < 3; ++c) none += std::isnan(image.at(y, x, c)) ? 1 : 0;
      EXPECT_EQ(none, y >= 3 && y <= 6 ? 2 : 0) << x << ' ' << y;
      if (y > 6) {
        for (int c = 0; c < 3; ++c) EXPECT_EQ(image.at(y, x, c), 1);
      }
    }
  }
}

}  // namespace
}  // namespace capture::raw_test
