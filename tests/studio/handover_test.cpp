// How values pass between the show's two threads.
#include "studio/handover.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <vector>

namespace studio {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::hours;

TEST(Handover, GivesEveryValueOnceAndInOrder) {
  Handover<int> handover;
  std::jthread giver([&] {
    for (int i = 0; i < 1000; ++i) EXPECT_TRUE(handover.give(i));
    handover.close();
  });
  std::vector<int> taken;
  while (const std::optional<int> value = handover.take()) taken.push_back(*value);
  ASSERT_EQ(taken.size(), 1000U);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(taken[static_cast<std::size_t>(i)], i);
}

TEST(Handover, WaitsForItsTakerOrUntilATime) {
  Handover<int> handover;
  EXPECT_TRUE(handover.wait_for_taker(Clock::now() - hours(1))) << "nobody asks, but it is time";
  std::jthread taker([&] { EXPECT_EQ(handover.take(), 5); });
  EXPECT_TRUE(handover.wait_for_taker(Clock::now() + hours(1))) << "asks long before it is time";
  EXPECT_TRUE(handover.give(5));
}

TEST(Handover, LetsNobodyWaitOnceClosed) {
  Handover<int> handover;
  std::jthread closer([&] { handover.close(); });
  EXPECT_FALSE(handover.wait_for_taker());
  EXPECT_FALSE(handover.wait_for_taker(Clock::now() + hours(1)));
  EXPECT_FALSE(handover.give(1));
  EXPECT_EQ(handover.take(), std::nullopt);
}

}  // namespace
}  // namespace studio
