// Camera clocks against the monotonic one.
#include "capture/device_clock.h"

#include <gtest/gtest.h>

#include <chrono>

#include "capture/counter_random.h"

namespace capture::device_clock_test {
namespace {

using namespace std::chrono_literals;

constexpr Time period = 20ms;

TEST(DeviceClock, TakesTheSmallestDelayForAll) {
  DeviceClock clock;
  for (int i = 0; i < 1000; ++i) {
    const Time true_time = 100s + i * period;
    // One in some is quick, the others late by up to 15 ms.
    const Time delay = i % 7 == 0
                           ? Time(1ms)
                           : Time(static_cast<std::int64_t>(
                                      mixed_bits(static_cast<std::uint64_t>(i)) % 15'000'000) +
                                  1'000'000);
    const auto mapped = clock.map(true_time - 70s, true_time + delay);
    ASSERT_TRUE(mapped);
    EXPECT_LE(*mapped, true_time + delay) << "never after its arrival";
    if (i >= 7) {
      EXPECT_EQ(*mapped, true_time + 1ms);
    }
  }
}

TEST(DeviceClock, FollowsAClockThatDrifts) {
  for (const double rate : {1 - 1e-4, 1 + 1e-4}) {
    DeviceClock clock;
    for (int i = 0; i < 3000; ++i) {
      const Time true_time = 100s + i * period;
      const Time stamp(static_cast<std::int64_t>(static_cast<double>(true_time.count()) * rate));
      const auto mapped = clock.map(stamp, true_time + 1ms);
      ASSERT_TRUE(mapped);
      EXPECT_NEAR(static_cast<double>((*mapped - true_time).count()), 1e6, 0.45e6);
    }
  }
}

TEST(DeviceClock, GivesStampsUpThatJump) {
  DeviceClock clock;
  ASSERT_TRUE(clock.map(10s, 100s));
  ASSERT_TRUE(clock.map(10s + period, 100s + period));
  EXPECT_FALSE(clock.map(3600s, 100s + 2 * period));
  EXPECT_EQ(clock.map(3600s + period, 100s + 3 * period), Time(100s + 3 * period)) << "a new start";
  EXPECT_FALSE(clock.map(1s, 100s + 4 * period)) << "backwards";
  EXPECT_FALSE(clock.map(0s, 100s + 5 * period)) << "none at all";
  EXPECT_FALSE(clock.map(Time::max(), 100s + 6 * period));
}

}  // namespace
}  // namespace capture::device_clock_test
