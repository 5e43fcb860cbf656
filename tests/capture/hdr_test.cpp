// HDR merge: radiance recovered whatever the bracket, with as little noise as the shots allow.
#include "capture/hdr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>

#include "tests/capture/made_bracket.h"

namespace capture::hdr_test {
namespace {

Image sample_shot(
    double radiance, double exposure_s, const NoiseModel& noise, int count, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Image image = make_image(1, count, 1);
  const double mean = radiance * exposure_s;
  for (float& value : image.pixels) {
    const double taken = mean + normal(random) * std::sqrt(noise.variance(mean));
    value = static_cast<float>(std::min(taken, 1.0));
  }
  return image;
}

TEST(MergeShots, RecoversRadianceWhateverTheBracket) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> stops(-8, 8);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<double> exposures_s;
    for (std::size_t i = 0; i <= random() % 6; ++i) exposures_s.push_back(std::exp2(stops(random)));
    const double shortest = *std::min_element(exposures_s.begin(), exposures_s.end());
    Image radiance = make_image(3, 5);
    for (float& value : radiance.pixels) {
      value = static_cast<float>(std::exp2(stops(random) - 8) * 0.97 / shortest);
    }
    std::vector<Shot> shots;
    for (const double exposure_s : exposures_s) {
      Shot shot{radiance, exposure_s};
      for (float& value : shot.linear.pixels) {
        value = std::min(1.0F, value * static_cast<float>(exposure_s));
      }
      shots.push_back(std::move(shot));
    }
    const Image merged = merge_shots(shots);
    for (std::size_t i = 0; i < merged.pixels.size(); ++i) {
      ASSERT_NEAR(merged.pixels[i] / radiance.pixels[i], 1, 1e-5);
    }
  }
}

TEST(MergeShots, ComesWithin15PercentOfTheCramerRaoBound) {
  const NoiseModel noise;
  const std::vector<double> exposures_s{1, 1.0 / 8, 1.0 / 64};
  std::mt19937 random(2);
  constexpr int count = 1500;
  double ratios_squared = 0;
  int levels = 0;
  for (double stop = -9; stop < 5.9; stop += 0.1, ++levels) {  // from far below 1 to the last clip
    const double radiance = std::exp2(stop);
    double bound = 0;
    std::vector<Shot> shots;
    for (const double exposure_s : exposures_s) {
      shots.push_back({sample_shot(radiance, exposure_s, noise, count, random), exposure_s});
      bound += made::information(radiance, exposure_s, noise);
    }
    const Image merged = merge_shots(shots, noise);
    double squares = 0;
    for (const float value : merged.pixels) {
      squares += (static_cast<double>(value) - radiance) * (static_cast<double>(value) - radiance);
    }
    ratios_squared += squares / count * bound;
  }
  EXPECT_LT(std::sqrt(ratios_squared / levels), 1.15);
}

TEST(MergeShots, IsUnbiasedNearBlack) {
  const NoiseModel noise;
  std::mt19937 random(3);
  constexpr int count = 40'000;
  const double radiance = 3e-4;  // a third of the read noise's deviation
  const std::vector<Shot> shots{{sample_shot(radiance, 1, noise, count, random), 1},
                                {sample_shot(radiance, 0.25, noise, count, random), 0.25}};
  const Image merged = merge_shots(shots, noise);
  double sum = 0;
  for (const float value : merged.pixels) sum += static_cast<double>(value);
  EXPECT_NEAR(sum / count, radiance, 4 * 1e-3 / std::sqrt(count));
}

TEST(MergeShots, TellsTheDeviationThatItsValuesHave) {
  const NoiseModel noise;
  std::mt19937 random(4);
  constexpr int count = 20'000;
  for (const double radiance : {0.001, 0.1, 0.5, 2.0}) {
    const std::vector<Shot> shots{{sample_shot(radiance, 1, noise, count, random), 1},
                                  {sample_shot(radiance, 0.2, noise, count, random), 0.2}};
    Image deviation;
    const Image merged = merge_shots(shots, noise, &deviation);
    double chi_squared = 0;
    for (std::size_t i = 0; i < merged.pixels.size(); ++i) {
      const double error = static_cast<double>(merged.pixels[i]) - radiance;
      chi_squared += std::pow(error / static_cast<double>(deviation.pixels[i]), 2) / count;
    }
    EXPECT_NEAR(chi_squared, 1, 0.06) << radiance;
  }
}

TEST(MergeShots, TakesTheShortestShotWhereAllAreSaturated) {
  Image deviation;
  const std::vector<Shot> shots{{Image{1, 1, {1, 1, 0.5F}}, 1}, {Image{1, 1, {1, 1, 0.05F}}, 0.1}};
  const Image merged = merge_shots(shots, {}, &deviation);
  EXPECT_FLOAT_EQ(merged.at(0, 0, 0), 10);
  EXPECT_TRUE(std::isinf(deviation.at(0, 0, 0)));
  EXPECT_FLOAT_EQ(merged.at(0, 0, 2), 0.5F);
  EXPECT_TRUE(std::isfinite(deviation.at(0, 0, 2)));
}

TEST(MergeShots, LeavesOutValuesThatAreNotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Shot> shots{{Image{1, 1, {nan, nan, 0.5F}}, 1},
                                {Image{1, 1, {0.25F, nan, 0.5F}}, 1}};
  const Image merged = merge_shots(shots);
  EXPECT_FLOAT_EQ(merged.at(0, 0, 0), 0.25F);
  EXPECT_EQ(merged.at(0, 0, 1), 0);
}

TEST(MergeShots, RefusesShotsOfTwoSizes) {
  const std::vector<Shot> shots{{Image{1, 1, {0, 0, 0}}, 1}, {Image{}, 1}};
  EXPECT_THROW(merge_shots(shots), std::invalid_argument);
}

TEST(MergeShots, RefusesNoShotsAndExposuresThatAreNotAboveZero) {
  EXPECT_THROW(merge_shots({}), std::invalid_argument);
  for (const double wrong : {0.0, -1.0, std::nan("")}) {
    const std::vector<Shot> shots{{Image{1, 1, {0, 0, 0}}, wrong}};
    EXPECT_THROW(merge_shots(shots), std::invalid_argument);
  }
}

// A frame of a bracket: 8-bit linear codes.
struct CodedFrame {
  std::vector<std::vector<std::uint8_t>> codes;
  std::vector<const std::uint8_t*> pointers;
};

constexpr double black_code = 4;
constexpr double white_code = 255;

// Of the codes' values.
NoiseModel noise_of_codes() {
  NoiseModel noise;
  noise.read += std::pow(white_code - black_code, -2) / 12;  // rounding
  return noise;
}

CodedFrame coded_frame(const made::Scene& scene, std::span<const double> exposures_s) {
  CodedFrame frame;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const NoiseModel noise;
  for (const double exposure_s : exposures_s) {
    std::vector<std::uint8_t> codes;
    for (const double radiance : scene.radiance) {
      const double mean = radiance * exposure_s;
      const double value = mean + normal(random) * std::sqrt(noise.variance(mean));
      const double code = black_code + value * (white_code - black_code);
      codes.push_back(static_cast<std::uint8_t>(std::clamp(std::round(code), 0.0, white_code)));
    }
    frame.codes.push_back(std::move(codes));
  }
  for (const auto& codes : frame.codes) frame.pointers.push_back(codes.data());
  return frame;
}

// Weights by the noise, as merge_shots has them.
MergeTables tables_of_noise(int shots) {
  CodeTable table;
  const NoiseModel noise = noise_of_codes();
  for (int code = 0; code < Response::codes; ++code) {
    const double value = (code - black_code) / (white_code - black_code);
    table.value.push_back(value);
    table.variance.push_back(value < noise.saturation ? noise.variance(value)
                                                      : std::numeric_limits<double>::infinity());
  }
  return {{table, table, table}, shots};
}

std::vector<Shot> linear_shots(const CodedFrame& frame,
                               const made::Scene& scene,
                               std::span<const double> exposures_s) {
  std::vector<Shot> shots;
  for (std::size_t s = 0; s < exposures_s.size(); ++s) {
    Shot shot{make_image(scene.height, scene.width), exposures_s[s]};
    for (std::size_t i = 0; i < shot.linear.pixels.size(); ++i) {
      shot.linear.pixels[i] =
          static_cast<float>((frame.codes[s][i] - black_code) / (white_code - black_code));
    }
    shots.push_back(std::move(shot));
  }
  return shots;
}

TEST(MergeTables, AgreeWithMergeShotsWithinTheNoise) {
  const made::Scene scene = made::patches(64, 48, 6);
  for (const std::vector<double>& exposures_s : {std::vector<double>{0.1},
                                                 {1, 0.1},
                                                 {1, 0.1, 0.01},
                                                 {1, 0.2, 0.04, 0.01},
                                                 {2, 1, .5, .1, .01}}) {
    const CodedFrame frame = coded_frame(scene, exposures_s);
    MergeTables tables = tables_of_noise(static_cast<int>(exposures_s.size()));
    tables.set_exposures(exposures_s);
    Image fast = make_image(scene.height, scene.width);
    tables.merge(frame.pointers, scene.width, 0, scene.height, fast.pixels.data());

    const std::vector<Shot> shots = linear_shots(frame, scene, exposures_s);
    Image deviation;
    const Image exact = merge_shots(shots, noise_of_codes(), &deviation);
    for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
      const float allowed =
          std::isinf(deviation.pixels[i]) ? exact.pixels[i] * 1e-4F : deviation.pixels[i];
      ASSERT_NEAR(fast.pixels[i], exact.pixels[i], allowed);
    }
  }
}

TEST(MergeTables, GiveTheSameBitsForAnyDivisionIntoRows) {
  const made::Scene scene = made::patches(40, 30, 7);
  const std::vector<double> exposures_s{1, 0.1, 0.01};
  const CodedFrame frame = coded_frame(scene, exposures_s);
  MergeTables tables = tables_of_noise(3);
  tables.set_exposures(exposures_s);
  Image whole = make_image(scene.height, scene.width);
  tables.merge(frame.pointers, scene.width, 0, scene.height, whole.pixels.data());
  Image parts = make_image(scene.height, scene.width);
  for (const auto& [first, last] : {std::pair{20, 30}, {0, 7}, {7, 20}}) {
    tables.merge(frame.pointers, scene.width, first, last, parts.pixels.data());
  }
  EXPECT_EQ(parts.pixels, whole.pixels);
}

TEST(MergeTables, FollowExposuresThatChangeFromFrameToFrame) {
  const made::Scene scene = made::patches(16, 16, 8);
  MergeTables tables = tables_of_noise(2);
  for (const double step : {0.5, 0.1, 0.01}) {
    const std::vector<double> exposures_s{0.01, 0.01 * step};
    const CodedFrame frame = coded_frame(scene, exposures_s);
    tables.set_exposures(exposures_s);
    Image merged = make_image(scene.height, scene.width);
    tables.merge(frame.pointers, scene.width, 0, scene.height, merged.pixels.data());
    for (std::size_t i = 0; i < merged.pixels.size(); ++i) {
      if (scene.radiance[i] < 20 || scene.radiance[i] > 90) continue;
      ASSERT_NEAR(static_cast<double>(merged.pixels[i]) / scene.radiance[i], 1, 0.1);
    }
  }
}

// The weights of others, as plain formulas, on the same codes with the true response.
struct OtherMerge {
  std::function<double(int)> weight;  // of a code
  double exposure_power = 0;          // of the exposure in the weight
  bool logarithm = false;             // averages log radiance
};

double error_stops(const made::Scene& scene, const std::function<double(std::size_t)>& merged) {
  double squares = 0;
  for (std::size_t i = 0; i < scene.radiance.size(); ++i) {
    squares += std::pow(std::log2(std::max(1e-9, merged(i)) / scene.radiance[i]), 2);
  }
  return std::sqrt(squares / static_cast<double>(scene.radiance.size()));
}

TEST(MergeTables, ErrLessThanTheWeightsOfDebevecAndOfRobertson) {
  const made::Scene scene = made::patches(160, 120, 9);
  const Response srgb = srgb_response();
  const auto light_of_code = [&](double z) {
    const double code = std::clamp(z, 0.0, 1.0) * 255;
    const auto low = std::min<std::size_t>(254, static_cast<std::size_t>(code));
    const double share = code - static_cast<double>(low);
    return srgb.light[0][low] + (srgb.light[0][low + 1] - srgb.light[0][low]) * share;
  };
  const std::vector<double> exposures_s{4, 0.125, 0.125 / 32};
  std::vector<Still8> stills;
  std::vector<const std::uint8_t*> codes;
  for (const double exposure_s : exposures_s) {
    stills.push_back(made::photograph(scene, exposure_s, light_of_code, 10));
  }
  for (const Still8& still : stills) codes.push_back(still.texels.data());

  MergeTables tables(
      {response_code_table(srgb, 0), response_code_table(srgb, 1), response_code_table(srgb, 2)},
      3);
  tables.set_exposures(exposures_s);
  Image ours = make_image(scene.height, scene.width);
  tables.merge(codes, scene.width, 0, scene.height, ours.pixels.data());
  const double our_error =
      error_stops(scene, [&](std::size_t i) { return static_cast<double>(ours.pixels[i]); });

  // Debevec and Malik 1997: a hat, on logarithms. Robertson, Borman and Stevenson 1999: a bell
  // about the middle code times the exposure squared, on radiance.
  const OtherMerge debevec{[](int z) { return std::min(z, 255 - z) + 1e-3; }, 0, true};
  const OtherMerge robertson{[](int z) { return std::exp(-4 * std::pow((z - 127.5) / 127.5, 2)); },
                             2, false};
  for (const OtherMerge& other : {debevec, robertson}) {
    const double their_error = error_stops(scene, [&](std::size_t i) {
      double weighted = 0;
      double weights = 0;
      for (std::size_t s = 0; s < 3; ++s) {
        const int code = codes[s][i];
        const double radiance =
            std::max(1e-6, srgb.light[0][static_cast<std::size_t>(code)]) / exposures_s[s];
        const double weight = other.weight(code) * std::pow(exposures_s[s], other.exposure_power);
        weighted += weight * (other.logarithm ? std::log(radiance) : radiance);
        weights += weight;
      }
      return other.logarithm ? std::exp(weighted / weights) : weighted / weights;
    });
    EXPECT_LT(our_error, their_error);
  }
}

TEST(MergeTables, RefuseWhatDoesNotFit) {
  const CodeTable table = response_code_table(linear_response(), 0);
  EXPECT_THROW(MergeTables({table, table, table}, 0), std::invalid_argument);
  CodeTable other = table;
  other.value.push_back(1);
  other.variance.push_back(1);
  EXPECT_THROW(MergeTables({table, table, other}, 1), std::invalid_argument);
  EXPECT_THROW(MergeTables({other, other, other}, 1), std::invalid_argument);
  MergeTables tables({table, table, table}, 2);
  EXPECT_THROW(tables.set_exposures(std::vector<double>{1}), std::invalid_argument);
  EXPECT_THROW(tables.set_exposures(std::vector<double>{1, 0}), std::invalid_argument);
  const std::vector<const std::uint8_t*> one{nullptr};
  EXPECT_THROW(tables.merge(one, 1, 0, 1, nullptr), std::invalid_argument);
}

TEST(MergeTables, MergeThreeShotsOf512x512In1500Microseconds) {
  if (!PLATELIGHT_FULL_TESTS) GTEST_SKIP() << "times are measured in the long tests only";
  constexpr int side = 512;
  std::mt19937 random(11);
  std::vector<std::vector<std::uint8_t>> shots(3);
  std::vector<const std::uint8_t*> codes;
  for (auto& shot : shots) {
    for (int i = 0; i < side * side * 3; ++i) shot.push_back(static_cast<std::uint8_t>(random()));
    codes.push_back(shot.data());
  }
  const CodeTable table = response_code_table(linear_response(), 0);
  MergeTables tables({table, table, table}, 3);
  Image radiance = make_image(side, side);
  auto best = std::chrono::steady_clock::duration::max();
  for (int i = 0; i < 100; ++i) {
    const auto start = std::chrono::steady_clock::now();
    tables.set_exposures(std::vector<double>{1, 0.125, 1.0 / 64});
    tables.merge(codes, side, 0, side, radiance.pixels.data());
    best = std::min(best, std::chrono::steady_clock::now() - start);
  }
  const double best_us = std::chrono::duration<double, std::micro>(best).count();
  RecordProperty("best_us", std::to_string(best_us));
  EXPECT_LT(best_us, 1500);
}

TEST(ResponseCodeTable, TakesCodesFromAFullWellOnForSaturated) {
  Response response = linear_response();  // of a sensor that is full at code 200
  for (auto& channel : response.light) {
    for (std::size_t z = 0; z < channel.size(); ++z) {
      channel[z] = std::min(1.0, static_cast<double>(z) / 200);
    }
  }
  const CodeTable table = response_code_table(response, 0);
  EXPECT_TRUE(std::isfinite(table.variance[199]));
  for (std::size_t z = 200; z < 256; ++z) EXPECT_TRUE(std::isinf(table.variance[z])) << z;
}

}  // namespace
}  // namespace capture::hdr_test
