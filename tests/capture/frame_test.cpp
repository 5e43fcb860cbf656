// When frames are.
#include "capture/frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include <random>
#include <stdexcept>

namespace capture::frame_test {
namespace {

TEST(TimeOfFrame, DoesNotDriftOverYears) {
  const Rational rate{30000, 1001};
  const std::int64_t whole = 30000LL * 1'000'000;  // frames that end on a whole second
  EXPECT_EQ(time_of_frame(whole, rate), std::chrono::seconds(1'001'000'000));
  EXPECT_EQ(time_of_frame(whole + 1, rate) - time_of_frame(whole, rate), time_of_frame(1, rate));
}

TEST(TimeOfFrame, RoundsDownOnBothSidesOfZero) {
  EXPECT_EQ(time_of_frame(1, {3, 1}).count(), 333'333'333);
  EXPECT_EQ(time_of_frame(-1, {3, 1}).count(), -333'333'334);
  EXPECT_EQ(time_of_frame(-3, {3, 1}).count(), -1'000'000'000);
}

TEST(TimeOfFrame, RefusesARateOfZero) {
  EXPECT_THROW(time_of_frame(1, {0, 1}), std::invalid_argument);
  EXPECT_THROW(time_of_frame(1, {25, 0}), std::invalid_argument);
}

TEST(FrameAt, IsTheLastFrameThatIsNotLater) {
  std::mt19937_64 random(1);
  for (const Rational rate : {Rational{25, 1}, {30000, 1001}, {3, 1}, {1, 100}, {1000, 7}}) {
    for (int i = 0; i < 1000; ++i) {
      const auto n = static_cast<std::int64_t>(random() >> 37U) - (std::int64_t{1} << 26U);
      const Time time = time_of_frame(n, rate);
      EXPECT_EQ(frame_at(time, rate), n);
      EXPECT_EQ(frame_at(time - Time{1}, rate), n - 1);
      EXPECT_EQ(frame_at(time_of_frame(n + 1, rate) - Time{1}, rate), n);
    }
  }
}

TEST(NominalRate, IsWholeOrThatOfNtsc) {
  EXPECT_EQ(nominal_rate(19001.0 / 317, 1e-6), (Rational{60000, 1001}));
  EXPECT_EQ(nominal_rate(29.97, 1e-3), (Rational{30000, 1001}));
  EXPECT_EQ(nominal_rate(25.000001, 1e-6), (Rational{25, 1}));
  EXPECT_EQ(nominal_rate(49.95, 1e-2), (Rational{50, 1})) << "no camera has 49.95";
  EXPECT_EQ(nominal_rate(25.01, 1e-6), std::nullopt);
  for (const double none : {0.0, -25.0, std::nan(""), HUGE_VAL}) {
    EXPECT_EQ(nominal_rate(none, 1e-3), std::nullopt) << none;
  }
}

TEST(FrameAt, RefusesARateOfZero) {
  EXPECT_THROW(frame_at(Time{1}, {0, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace capture::frame_test
