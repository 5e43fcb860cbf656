// Gains between made probes and plates.
#include "calibrate/light_gain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/calibrate/made_markers.h"

namespace calibrate::light_gain_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Colour = std::array<double, 3>;

const Colour made_gain{0.31, 0.052, 1.7};

Colour random_colour(double saturation, made::Random& random) {
  const double level = std::exp(1.5 * random.normal());
  return {level * std::exp(saturation * random.normal()),
          level * std::exp(saturation * random.normal()),
          level * std::exp(saturation * random.normal())};
}

std::vector<LightPair> made_pairs(std::size_t count,
                                  const std::array<double, 9>& matrix,
                                  double noise,
                                  made::Random& random) {
  std::vector<LightPair> pairs(count);
  for (LightPair& pair : pairs) {
    pair.probe = random_colour(0.5, random);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < 3; ++k) pair.plate[c] += matrix[3 * c + k] * pair.probe[k];
      pair.plate[c] *= std::exp(noise * random.normal());
    }
  }
  return pairs;
}

std::array<double, 9> diagonal(const Colour& gain) {
  return {gain[0], 0, 0, 0, gain[1], 0, 0, 0, gain[2]};
}

void expect_gain(const LightGain& fit, const Colour& truth, double tolerance) {
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(fit.gain[c] / truth[c], 1, tolerance);
}

TEST(FitLightGain, IsRightToTwoPercentAndKnowsHowRight) {
  constexpr int cases = 100;
  double squares = 0;
  made::Random random(1);
  for (int i = 0; i < cases; ++i) {
    const LightGain fit = fit_light_gain(made_pairs(60, diagonal(made_gain), 0.05, random));
    expect_gain(fit, made_gain, 0.04);
    EXPECT_FALSE(fit.matrix);
    EXPECT_NEAR(fit.heldout_error, 0.045, 0.015);  // the worst tenth is left out
    const double error = std::log(fit.gain[1] / made_gain[1]) / fit.sigma[1];
    squares += error * error / cases;
  }
  EXPECT_GT(squares, 0.6);
  EXPECT_LT(squares, 1.6);
}

TEST(FitLightGain, DoesNotMindAFifthInAnotherLight) {
  made::Random random(2);
  for (int i = 0; i < 30; ++i) {
    auto pairs = made_pairs(100, diagonal(made_gain), 0.02, random);
    for (std::size_t k = 0; k < 20; ++k) {
      for (double& value : pairs[5 * k + k % 5].plate) value *= random.uniform(2, 6);
    }
    const LightGain fit = fit_light_gain(pairs);
    expect_gain(fit, made_gain, 0.02);
    EXPECT_GE(fit.left_out, 18U);
    EXPECT_FALSE(fit.matrix);
  }
}

TEST(FitLightGain, TakesOneGreyCardAndSaysThatItIsOne) {
  made::Random random(3);
  const LightGain fit = fit_light_gain(made_pairs(1, diagonal(made_gain), 0, random));
  expect_gain(fit, made_gain, 1e-9);
  EXPECT_THAT(fit.warnings, ElementsAre(HasSubstr("1 thing only")));
  EXPECT_TRUE(std::isnan(fit.heldout_error));
}

TEST(FitLightGain, TellsThatFewThingsContradictEachOther) {
  made::Random random(3);
  std::vector<LightPair> pairs = made_pairs(2, diagonal(made_gain), 0, random);
  EXPECT_THAT(fit_light_gain(pairs).warnings, ElementsAre(HasSubstr("2 things only")));
  for (double& shown : pairs[1].plate) shown *= 17;  // as where an albedo is stated wrongly
  EXPECT_THAT(fit_light_gain(pairs).warnings,
              ElementsAre(HasSubstr("2 things only"), HasSubstr("differ by a factor of 17.0")));
}

TEST(FitLightGain, KnowsHowRightItIsFromAFewThings) {
  for (const std::size_t things : {2U, 3U, 4U}) {
    made::Random random(5);
    int within = 0, far = 0, count = 0;
    for (int i = 0; i < 150; ++i) {
      const LightGain fit = fit_light_gain(made_pairs(things, diagonal(made_gain), 0.05, random));
      EXPECT_EQ(fit.sigma[0], fit.sigma[1]);
      for (std::size_t c = 0; c < 3; ++c) {
        const double off = std::abs(std::log(fit.gain[c] / made_gain[c])) / fit.sigma[c];
        within += off < 1 ? 1 : 0;
        far += off > 3 ? 1 : 0;
        ++count;
      }
    }
    EXPECT_GT(within, 0.6 * count) << things;
    EXPECT_LT(within, 0.92 * count) << things;
    EXPECT_LT(far, 0.05 * count) << things;
  }
}

TEST(FitLightGain, TakesManyFramesOfOneGreyCardForOneThing) {
  made::Random random(3);
  auto pairs = made_pairs(25, diagonal(made_gain), 0.01, random);
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].frame = i;
  const LightGain apart = fit_light_gain(pairs);  // of one thing each
  EXPECT_THAT(apart.warnings, ElementsAre(HasSubstr("nothing is left to check")));
  EXPECT_TRUE(std::isnan(apart.heldout_error));
  EXPECT_THAT(apart.sigma, ElementsAre(1, 1, 1));
  for (LightPair& pair : pairs) pair.thing = 7;
  const LightGain fit = fit_light_gain(pairs);
  EXPECT_THAT(fit.warnings, ElementsAre(HasSubstr("1 thing only")));
  EXPECT_TRUE(std::isnan(fit.heldout_error));
  EXPECT_THAT(fit.sigma, ElementsAre(1, 1, 1));
}

TEST(FitLightGain, KnowsHowRightItIsFromManyFramesOfThings) {
  // Each thing errs by 5 % in all frames alike. Of plates that stand still all frames show all of
  // them, else 20 of 60 each.
  made::Random random(8);
  for (const bool still : {true, false}) {
    constexpr int cases = 30;
    double squares = 0;
    for (int i = 0; i < cases; ++i) {
      auto things = made_pairs(60, diagonal(made_gain), 0.01, random);
      for (LightPair& thing : things) {
        const double common = std::exp(0.05 * random.normal());
        for (double& value : thing.plate) value *= common;
      }
      std::vector<LightPair> pairs;
      for (std::size_t frame = 0; frame < 10; ++frame) {
        const double exposure = frame == 0 ? 1 : std::exp(0.1 * random.normal());
        for (std::size_t k = 0; k < 60; ++k) {
          if (!still && (k + 6 * frame) % 60 >= 20) continue;
          LightPair pair = things[k];
          pair.thing = k;
          pair.frame = frame;
          for (double& value : pair.plate) value *= exposure * std::exp(0.005 * random.normal());
          pairs.push_back(pair);
        }
      }
      const LightGain fit = fit_light_gain(pairs);
      EXPECT_NEAR(fit.heldout_error, 0.045, 0.02);
      const double error = std::log(fit.gain[1] / made_gain[1]) / fit.sigma[1];
      squares += error * error / cases;
    }
    EXPECT_GT(squares, 0.45) << still;
    EXPECT_LT(squares, 1.8) << still;
  }
}

TEST(FitLightGain, TakesAMatrixOnlyWhereHeldOutPairsAskForIt) {
  const std::array<double, 9> mixed{0.9, 0.25, -0.05, 0.1, 0.7, 0.1, 0.02, 0.2, 0.8};
  made::Random random(4);
  for (int i = 0; i < 20; ++i) {
    const auto pairs = made_pairs(24, mixed, 0.01, random);  // a chart's patches
    const LightGain fit = fit_light_gain(pairs);
    ASSERT_TRUE(fit.matrix);
    EXPECT_LT(*fit.matrix_heldout_error, 0.02);
    EXPECT_GT(fit.heldout_error, 0.05);
    for (const LightPair& pair : made_pairs(10, mixed, 0, random)) {
      const Colour expected = predict(fit, pair.probe);
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(expected[c] / pair.plate[c], 1, 0.05);
    }
    EXPECT_FALSE(fit_light_gain(made_pairs(24, diagonal(made_gain), 0.01, random)).matrix);
    EXPECT_FALSE(fit_light_gain(made_pairs(8, mixed, 0.01, random)).matrix);
  }
}

TEST(FitLightGain, TakesNoMatrixToAverageTheNoiseOfGreys) {
  made::Random random(7);
  std::vector<LightPair> pairs(200);
  for (LightPair& pair : pairs) {
    const double level = std::exp(random.normal());
    for (std::size_t c = 0; c < 3; ++c) {
      pair.probe[c] = level * std::exp(0.03 * random.normal());
      pair.plate[c] = made_gain[c] * level;
    }
  }
  const LightGain fit = fit_light_gain(pairs);
  EXPECT_FALSE(fit.matrix);
  EXPECT_LT(*fit.matrix_heldout_error, 0.75 * fit.heldout_error);  // or this would test nothing
}

TEST(FitLightGain, TellsAutoExposureFromTheGains) {
  made::Random random(5);
  std::vector<LightPair> pairs;
  std::vector<double> exposures{1};
  for (std::size_t frame = 0; frame < 30; ++frame) {
    if (frame > 0) exposures.push_back(exposures.back() * std::exp(0.1 * random.normal()));
    for (LightPair pair : made_pairs(12, diagonal(made_gain), 0.03, random)) {
      pair.frame = frame;
      for (double& value : pair.plate) value *= exposures.back();
      pairs.push_back(pair);
    }
  }
  const LightGain fit = fit_light_gain(pairs);
  ASSERT_EQ(fit.exposures.size(), 30U);
  EXPECT_EQ(fit.exposures[0], 1);
  for (std::size_t frame = 0; frame < 30; ++frame) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(fit.gain[c] * fit.exposures[frame] / (made_gain[c] * exposures[frame]), 1, 0.03);
    }
  }
  auto later = made_pairs(20, diagonal(made_gain), 0.03, random);
  for (LightPair& pair : later) {
    for (double& value : pair.plate) value *= 2.5;
  }
  for (double& value : later[3].plate) value *= 4;  // something else
  const double scale = fit.gain[1] / made_gain[1];
  EXPECT_NEAR(follow_exposure(fit, later) * scale / 2.5, 1, 0.03);
}

TEST(FitLightGain, LeavesFramesOfWhichNothingIsKnownOpen) {
  made::Random random(6);
  auto pairs = made_pairs(10, diagonal(made_gain), 0, random);
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].frame = i < 5 ? 1 : 3;
  EXPECT_THAT(fit_light_gain(pairs).exposures, ElementsAre(0, 1, 0, testing::DoubleNear(1, 1e-9)));
}

TEST(FitLightGain, RefusesNoPairsAndWhatIsNoLight) {
  EXPECT_THROW(fit_light_gain({}), std::runtime_error);
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    const std::vector<LightPair> pairs{{{1, bad, 1}, {1, 1, 1}}};
    EXPECT_THROW(fit_light_gain(pairs), std::invalid_argument);
    EXPECT_THROW(follow_exposure({}, pairs), std::invalid_argument);
  }
}

}  // namespace
}  // namespace calibrate::light_gain_test
