// The plate's exposure over the calibrated one, from what is told and what both cameras see.
#include "studio/exposure_follower.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/calibrate/made_markers.h"

namespace studio::exposure_follower_test {
namespace {

using testing::HasSubstr;

// Directions whose light is `truth` in the plate, where `level` is expected: with noise, and every
// tenth of something else.
std::vector<calibrate::LightPair> made_pairs(double truth,
                                             double level,
                                             made::Random& random,
                                             int count = 300) {
  std::vector<calibrate::LightPair> pairs;
  for (int i = 0; i < count; ++i) {
    calibrate::LightPair pair;
    const double off = i % 10 == 0 ? 0.3 : 1;
    for (std::size_t c = 0; c < 3; ++c) {
      const double light = std::exp(random.uniform(-2, 1));
      pair.probe[c] = light * level;
      pair.plate[c] = light * truth * off * (1 + 0.03 * random.normal());
    }
    pairs.push_back(pair);
  }
  return pairs;
}

TEST(ExposureFollower, IsThereAtOnceAfterAStep) {
  made::Random random(1);
  ExposureFollower follower;
  for (int n = 0; n < 20; ++n) {
    const double truth = n < 10 ? 1 : 1.4;
    follower.follow(0, follower.level(), made_pairs(truth, follower.level(), random));
    EXPECT_NEAR(follower.level() / truth, 1, 0.01) << n;
  }
}

TEST(ExposureFollower, TakesOutWhatPairsTellOfTheCalibratedExposure) {
  made::Random random(8);
  ExposureFollower follower(std::nullopt, 0.8);
  for (const double truth : {1.0, 1.0, 1.5, 0.6}) {
    follower.follow(0, follower.level(), made_pairs(0.8 * truth, follower.level(), random));
    EXPECT_NEAR(follower.level() / truth, 1, 0.01) << truth;
  }
}

TEST(ExposureFollower, KeepsUpWithAnExposureThatCreeps) {
  made::Random random(2);
  ExposureFollower follower;
  for (int n = 0; n < 100; ++n) {
    const double truth = std::pow(1.01, n);
    follower.follow(0, follower.level(), made_pairs(truth, follower.level(), random));
    EXPECT_NEAR(follower.level() / truth, 1, 0.02) << n;
  }
}

// No lag that is made up for at once, again and again.
TEST(ExposureFollower, FollowsWhatCreepsWithoutSteps) {
  made::Random random(12);
  ExposureFollower follower;
  constexpr double creep = 1.005;
  constexpr int frames = 400;
  double squares = 0;
  for (int n = 0; n < frames; ++n) {
    const double before = follower.level(), truth = std::pow(creep, n);
    follower.follow(0, follower.level(), made_pairs(truth, follower.level(), random));
    squares += std::pow(follower.level() / before - creep, 2) / frames;
    EXPECT_NEAR(follower.level() / truth, 1, 0.012) << n;
  }
  EXPECT_LT(std::sqrt(squares), 0.005);
}

TEST(ExposureFollower, IsSteadierThanOneFrame) {
  made::Random random(3);
  ExposureFollower follower;
  constexpr int frames = 200;
  double squares = 0;
  double squares_of_one = 0;
  for (int n = 0; n < frames; ++n) {
    const auto pairs = made_pairs(1, 1, random, 40);
    follower.follow(0, 1, pairs);
    if (n < 20) continue;
    squares += std::pow(follower.level() - 1, 2);
    squares_of_one += std::pow(calibrate::follow_exposure({}, pairs) - 1, 2);
  }
  EXPECT_LT(squares, squares_of_one / 4);
}

TEST(ExposureFollower, HoldsWhereNothingIsSeenByBoth) {
  made::Random random(4);
  ExposureFollower follower;
  follower.follow(0, 1, made_pairs(0.8, 1, random));
  const double level = follower.level();
  EXPECT_NEAR(level, 0.8, 0.01);
  EXPECT_THAT(follower.note(), HasSubstr("by 300 directions"));
  follower.follow(0, level, made_pairs(2, level, random, 5));
  EXPECT_EQ(follower.level(), level);
  EXPECT_THAT(follower.note(), HasSubstr("held at 0.8"));
}

TEST(ExposureFollower, TakesToldTimesAtTheirWord) {
  ExposureFollower follower(0.01);
  EXPECT_FALSE(follower.needs_pairs(0.02));
  follower.follow(0.01, 1, {});
  EXPECT_EQ(follower.level(), 1);
  follower.follow(0.014, 1, {});
  EXPECT_DOUBLE_EQ(follower.level(), 1.4);
  EXPECT_THAT(follower.note(), HasSubstr("1.400 of the calibrated exposure"));
}

TEST(ExposureFollower, HoldsWhatWasToldWhereATimeIsMissing) {
  made::Random random(7);
  ExposureFollower follower(0.01);
  follower.follow(0.02, 1, {});
  follower.follow(0, 2, {});
  EXPECT_DOUBLE_EQ(follower.level(), 2);
  EXPECT_THAT(follower.note(), HasSubstr("held at 2.000"));
  follower.follow(0, 2, made_pairs(1.7, 2, random));
  EXPECT_NEAR(follower.level(), 1.7, 0.017);
  follower.follow(0.03, 1.7, {});
  EXPECT_DOUBLE_EQ(follower.level(), 3);
}

// The first measurement tells what the calibrated exposure must have been.
TEST(ExposureFollower, GoesOnByTimesWhereTheOverlapEnds) {
  made::Random random(5);
  ExposureFollower follower;
  for (int n = 0; n < 5; ++n) {
    follower.follow(0.01, follower.level(), made_pairs(0.7, follower.level(), random));
  }
  EXPECT_NEAR(follower.level(), 0.7, 0.007);
  follower.follow(0.02, follower.level(), {});
  EXPECT_NEAR(follower.level(), 1.4, 0.014);
  EXPECT_THAT(follower.note(), HasSubstr("by its time alone"));
}

TEST(ExposureFollower, MeasuresWhereTheCalibratedExposureIsToldAndThePlatesIsNot) {
  made::Random random(6);
  ExposureFollower follower(0.01);
  EXPECT_TRUE(follower.needs_pairs(0));
  follower.follow(0, 1, made_pairs(1.3, 1, random));
  EXPECT_NEAR(follower.level(), 1.3, 0.013);
}

}  // namespace
}  // namespace studio::exposure_follower_test
