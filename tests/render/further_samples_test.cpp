#include "render/further_samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>

namespace render::further_samples_test {
namespace {

constexpr std::size_t pixel = 37;
constexpr int per_batch = 4;

// A picture's values, sixteen in the order of the pattern.
template <class Value>
FurtherSamples samples_of(int count, Value&& value) {
  FurtherSamples samples;
  samples.clear();
  samples.begin(pixel);
  for (int i = 0; i < count; ++i) {
    const CameraSample sample{calibrate::Vec3f{1, 1, 1} * value(i), {}};
    samples.add(pixel, sample);
    samples.add_to_batch(pixel, i / per_batch, sample);
  }
  samples.end_batch();
  return samples;
}

TEST(FurtherSamples, AreSureWhereAllOfThemAgree) {
  const FurtherSamples samples = samples_of(16, [](int) { return 0.7F; });
  EXPECT_EQ(samples.count(pixel), 16);
  EXPECT_NEAR(samples.spread(pixel), 0, 1e-5);
  EXPECT_NEAR(samples.variance(pixel), 0, 1e-6);
  EXPECT_EQ(samples.count(pixel + 1), 0);
  EXPECT_EQ(samples.variance(pixel + 1), 0);
}

// An edge through the middle: each batch is half of it, as the whole is.
TEST(FurtherSamples, AreSurerOfAnEdgeThanOfNoise) {
  const FurtherSamples edge =
      samples_of(16, [](int i) { return static_cast<float>((i >> 1) & 1); });
  std::mt19937 random(3);
  double noise = 0;
  constexpr int runs = 200;
  for (int run = 0; run < runs; ++run) {
    noise += samples_of(16, [&](int) { return static_cast<float>(random() & 1); }).variance(pixel);
  }
  noise /= runs;
  EXPECT_NEAR(noise, 0.28, 0.05);  // of a coin .25, and a little more where batches agree less
  // Not more sure than n^(-3/4) allows.
  EXPECT_NEAR(edge.variance(pixel), 16 * 0.25F / 15 / std::sqrt(16.0F), 1e-5);
}

TEST(FurtherSamples, CountTheSameSampleManyTimes) {
  FurtherSamples once, many;
  for (FurtherSamples* samples : {&once, &many}) {
    samples->clear();
    samples->begin(pixel);
  }
  const CameraSample dark{{}, {1, 1, 1}}, bright{{2, 1, 0}, {}};
  for (int i = 0; i < 5; ++i) once.add(pixel, dark), once.add(pixel, bright);
  many.add(pixel, dark, 5);
  many.add(pixel, bright, 5);
  EXPECT_EQ(once.count(pixel), many.count(pixel));
  EXPECT_NEAR(once.spread(pixel), many.spread(pixel), 1e-4);
  EXPECT_GT(once.spread(pixel), 1);
}

// A sun in one sample is worth no more than what a display shows of it.
TEST(FurtherSamples, CountNothingBeyondTheLimit) {
  const auto spark = [](float radiance) {
    return samples_of(16, [=](int i) { return i == 5 ? radiance : 0.0F; });
  };
  const float at_limit = spark(sample_limit).variance(pixel);
  EXPECT_GT(at_limit, 0);
  EXPECT_EQ(spark(1e9F).variance(pixel), at_limit);
  EXPECT_EQ(spark(std::numeric_limits<float>::infinity()).variance(pixel), at_limit);
}

// Noise of light that is white on any display may be as much as its square is above that.
TEST(FurtherSamples, ShowLessOfLightThatIsBrighterThanDisplaysShow) {
  const auto share = [](float mean, float off) {
    return samples_of(16, [=](int i) { return mean + (i % 2 == 0 ? off : -off); })
        .share_shown(pixel);
  };
  EXPECT_EQ(share(1, 0.5F), 1);
  EXPECT_EQ(share(3.9F, 0.5F), 1);
  EXPECT_NEAR(share(8, 0.01F), 1 / 16.0, 1e-3);
  EXPECT_NEAR(share(16, 0.01F), 1 / 256.0, 1e-4);
  EXPECT_EQ(FurtherSamples{}.share_shown(pixel), 1);
}

// A few samples of something bright tell of a mean that is above white, of what may be dark: it is
// not sure enough to show less.
TEST(FurtherSamples, ShowAllOfAGlint) {
  for (const float light : {10.0F, 30.0F, 60.0F, 1e9F}) {
    const FurtherSamples glint =
        samples_of(16, [=](int i) { return i == 5 || i == 10 ? light : 0.1F; });
    EXPECT_EQ(glint.share_shown(pixel), 1) << light;
  }
}

TEST(FurtherSamples, BeginAnew) {
  FurtherSamples samples = samples_of(16, [](int i) { return static_cast<float>(i); });
  samples.begin(pixel);
  EXPECT_EQ(samples.count(pixel), 0);
  samples.add(pixel, {{1, 1, 1}, {}}, 3);
  EXPECT_EQ(samples.count(pixel), 3);
  EXPECT_NEAR(samples.spread(pixel), 0, 1e-5);
}

}  // namespace
}  // namespace render::further_samples_test
