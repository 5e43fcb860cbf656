// From a container's time stamps to the times of frames.
#include "capture/stamp_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace capture::stamp_clock_test {
namespace {

TEST(StampClock, TakesOutTheRoundingOfMatroska) {
  for (const Rational rate :
       {Rational{24000, 1001}, Rational{25, 1}, Rational{30000, 1001}, Rational{60000, 1001}}) {
    StampClock clock({1, 1000}, rate);
    for (std::int64_t n = 0; n < 5000; ++n) {
      const auto stamp = std::llround(static_cast<double>(n) / rate.value() * 1000);
      ASSERT_EQ(clock.time_of(500 + stamp), time_of_frame(n, rate)) << n;
    }
  }
}

TEST(StampClock, KeepsARateThatVaries) {
  StampClock clock({1, 90000}, {30, 1});
  EXPECT_EQ(clock.time_of(9000), Time{0});
  EXPECT_EQ(clock.time_of(9000 + 4500), std::chrono::milliseconds(50));
  EXPECT_EQ(clock.time_of(9000 + 90000), std::chrono::seconds(1));
}

TEST(StampClock, RisesWhateverTheStamps) {
  std::mt19937_64 random(2);
  for (const Rational rate : {Rational{}, Rational{25, 1}}) {
    StampClock clock({1, 1000}, rate);
    Time last{-1};
    for (int i = 0; i < 2000; ++i) {
      const std::uint64_t kind = random() % 4;
      std::optional<std::int64_t> stamp;
      if (kind == 1) stamp = static_cast<std::int64_t>(random());
      if (kind == 2) stamp = static_cast<std::int64_t>(random() % 100000);
      if (kind == 3) stamp = std::numeric_limits<std::int64_t>::max();
      const Time time = clock.time_of(stamp);
      ASSERT_GT(time, last);
      last = time;
      if (i % 500 == 499) {
        clock.restart();
        last = Time{-1};
      }
    }
  }
}

// A picture would stand for as long.
TEST(StampClock, DoesNotBelieveJumpsBeyondTheEnd) {
  StampClock clock({1, 1000}, {25, 1}, std::chrono::seconds(8));
  for (std::int64_t n = 0; n < 200; ++n) {
    const std::int64_t damage = n >= 50 && n < 75 ? 62'000 : 0;
    ASSERT_EQ(clock.time_of(40 * n + damage), time_of_frame(n, {25, 1}));
  }
  // A file that is longer than it tells is no damage.
  EXPECT_EQ(clock.time_of(12'000), std::chrono::seconds(12));
  EXPECT_EQ(clock.time_of(21'000), std::chrono::seconds(21));
}

TEST(StampClock, BelievesAPictureThatStandsForMinutes) {
  StampClock clock({1, 1000}, {25, 1});
  clock.time_of(0);
  EXPECT_EQ(clock.time_of(300'000), std::chrono::minutes(5));
}

TEST(StampClock, CountsFramesThatHaveNoStamp) {
  StampClock clock({1, 1000}, {30000, 1001});
  for (std::int64_t n = 0; n < 1000; ++n) {
    ASSERT_EQ(clock.time_of(std::nullopt), time_of_frame(n, {30000, 1001}));
  }
  EXPECT_EQ(clock.end(), time_of_frame(1000, {30000, 1001}));
}

}  // namespace
}  // namespace capture::stamp_clock_test
