// The made clap is where it says.
#include "capture/made_sound.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

namespace capture::made_sound_test {
namespace {

TEST(MakeClap, HasItsLoudestSampleWhereTheClapBegins) {
  const Sound sound = make_clap({.rate = 48000, .length_s = 2, .clap_s = 1.25});
  ASSERT_EQ(sound.samples.size(), 96000U);
  std::size_t loudest = 0;
  for (std::size_t i = 0; i < sound.samples.size(); ++i) {
    ASSERT_LE(std::abs(sound.samples[i]), 1);
    if (std::abs(sound.samples[i]) > std::abs(sound.samples[loudest])) loudest = i;
  }
  EXPECT_EQ(loudest, 60000U);
}

TEST(MakeClap, IsQuietBeforeAndAfter) {
  const Sound sound = make_clap({.rate = 48000, .length_s = 1, .clap_s = 0.5});
  const auto level = [&](std::size_t from, std::size_t to) {
    double sum = 0;
    for (std::size_t i = from; i < to; ++i) sum += double{sound.samples[i]} * sound.samples[i];
    return std::sqrt(sum / static_cast<double>(to - from));
  };
  EXPECT_NEAR(level(0, 24000), 0.001, 0.0001);
  EXPECT_NEAR(level(30000, 48000), 0.001, 0.0001);
  EXPECT_GT(level(24000, 24200), 0.05);
}

TEST(MakeClap, RefusesWhatIsNoSound) {
  EXPECT_THROW(make_clap({.rate = 0}), std::invalid_argument);
  EXPECT_THROW(make_clap({.length_s = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace capture::made_sound_test
