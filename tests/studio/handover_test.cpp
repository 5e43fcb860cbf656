// How values pass between the show's two threads.
#include "studio/handover.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace studio::handover_test {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::hours;

TEST(Handover, LetsTheGiverWorkOneValueAheadAndNoMore) {
  Handover<int> handover;
  std::atomic<int> begun = 0;
  std::jthread giver([&] {
    for (int i = 0; i < 50; ++i) {
      begun = i;
      if (!handover.give(i)) return;
    }
    handover.close();
  });
  int expected = 0;
  while (const auto value = handover.take()) {
    EXPECT_EQ(*value, expected++);
    std::this_thread::yield();
    EXPECT_LE(begun, *value + 1);
  }
  EXPECT_EQ(expected, 50);
}

TEST(Handover, TellsTheGiverWhenTheTakerAsksAgain) {
  Handover<int> handover;
  std::atomic<bool> dealt_with = false;
  std::thread taker([&] {
    EXPECT_EQ(handover.take(), 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    dealt_with = true;
    EXPECT_EQ(handover.take(), std::nullopt);
  });
  EXPECT_TRUE(handover.give(1));
  EXPECT_TRUE(handover.wait_for_taker());
  EXPECT_TRUE(dealt_with);
  handover.close();
  EXPECT_FALSE(handover.wait_for_taker());
  taker.join();
}

TEST(Handover, FreesAGiverWhenItIsClosed) {
  Handover<int> handover;
  std::jthread giver([&] { EXPECT_FALSE(handover.give(1)); });
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  handover.close();
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
}  // namespace studio::handover_test
