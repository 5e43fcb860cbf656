// Timecode: the laws of drop-frame counting, known labels, refusals.
#include "compositing/timecode.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

namespace compositing::timecode_test {
namespace {

constexpr capture::Rational ntsc{30000, 1001};
constexpr capture::Rational ntsc_double{60000, 1001};

TEST(TimecodeAt, IsUndoneByFramesSinceMidnightForAWholeDropFrameDay) {
  for (const capture::Rational rate : {ntsc, ntsc_double}) {
    const std::int64_t per_day = rate == ntsc ? 2589408 : 5178816;
    for (std::int64_t n = 0; n < per_day; ++n) {
      ASSERT_EQ(frames_since_midnight(timecode_at(n, rate, true), rate), n);
    }
    EXPECT_EQ(timecode_at(per_day, rate, true), timecode_at(0, rate, true));
  }
}

TEST(TimecodeAt, NamesEveryFrameLaterThanTheOneBefore) {
  Timecode before = timecode_at(0, ntsc, true);
  for (std::int64_t n = 1; n < 40000; ++n) {
    const Timecode now = timecode_at(n, ntsc, true);
    ASSERT_LT(to_string(before), to_string(now)) << n;
    before = now;
  }
}

TEST(TimecodeAt, StaysWithinAFewFramesOfTheClockWithDropFrame) {
  for (std::int64_t n = 0; n < 2589408; n += 997) {
    const Timecode label = timecode_at(n, ntsc, true);
    const double labelled_s =
        label.hours * 3600 + label.minutes * 60 + label.seconds + label.frames / 30.0;
    const double clock_s = static_cast<double>(n) / ntsc.value();
    // Two labels and a half at the worst minute, and the day itself is 86.4 ms short.
    ASSERT_LT(std::abs(labelled_s - clock_s), 0.17) << n;
  }
}

TEST(TimecodeAt, LeavesOutTwoLabelsAtEachMinuteButTheTenth) {
  EXPECT_EQ(to_string(timecode_at(1799, ntsc, true)), "00:00:59;29");
  EXPECT_EQ(to_string(timecode_at(1800, ntsc, true)), "00:01:00;02");
  EXPECT_EQ(to_string(timecode_at(17981, ntsc, true)), "00:09:59;29");
  EXPECT_EQ(to_string(timecode_at(17982, ntsc, true)), "00:10:00;00");
  EXPECT_EQ(to_string(timecode_at(3600, ntsc_double, true)), "00:01:00;04");
}

TEST(TimecodeAt, CountsEveryLabelWithoutDropFrame) {
  EXPECT_EQ(to_string(timecode_at(1800, ntsc, false)), "00:01:00:00");
  EXPECT_EQ(to_string(timecode_at(25 * 3600, {25, 1}, false)), "01:00:00:00");
  EXPECT_EQ(to_string(timecode_at(-1, {25, 1}, false)), "23:59:59:24");
}

TEST(Advance, AddsUp) {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> any(-1'000'000'000'000, 1'000'000'000'000);
  const Timecode start = parse_timecode("09:58:59;29", ntsc);
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t a = any(random);
    const std::int64_t b = any(random);
    ASSERT_EQ(advance(advance(start, a, ntsc), b, ntsc), advance(start, a + b, ntsc));
  }
}

TEST(TimecodeBase, RoundsTheRateToAWholeNumber) {
  EXPECT_EQ(timecode_base({25, 1}), 25);
  EXPECT_EQ(timecode_base({24000, 1001}), 24);
  EXPECT_EQ(timecode_base({25, 2}), 13);
  EXPECT_THROW(timecode_base({0, 1}), std::invalid_argument);
  EXPECT_THROW(timecode_base({1, 0}), std::invalid_argument);
  EXPECT_THROW(timecode_base({1000, 1}), std::invalid_argument);
  EXPECT_THROW(timecode_base({1, 1000}), std::invalid_argument);
}

TEST(AllowsTimecode, AgreesWithTimecodeBase) {
  for (const capture::Rational rate : {capture::Rational{25, 1}, {1, 2}, {199, 2}, {30000, 1001}}) {
    EXPECT_EQ(allows_timecode(rate), rate.value() < 99.5) << rate.num;
  }
  for (const capture::Rational rate : {capture::Rational{0, 1}, {1, 0}, {1, 3}, {120, 1}}) {
    EXPECT_FALSE(allows_timecode(rate)) << rate.num;
    EXPECT_THROW(timecode_base(rate), std::invalid_argument);
  }
}

TEST(ParseTimecode, ReadsWhatToStringWrites) {
  EXPECT_EQ(parse_timecode("01:02:03;04", ntsc), (Timecode{1, 2, 3, 4, true}));
  EXPECT_EQ(parse_timecode("23:59:59:24", {25, 1}), (Timecode{23, 59, 59, 24, false}));
}

TEST(ParseTimecode, RefusesLabelsThatDoNotExist) {
  for (const char* text :
       {"", "1:02:03:04", "01:02:03.04", "aa:02:03:04", "01:02:03:04 ", "24:00:00:00",
        "00:60:00:00", "00:00:60:00", "00:00:00:30", "00:01:00;01", "-1:00:00:00"}) {
    EXPECT_THROW(parse_timecode(text, ntsc), std::invalid_argument) << text;
  }
  EXPECT_THROW(parse_timecode("00:00:00;00", {25, 1}), std::invalid_argument);
  EXPECT_THROW(parse_timecode("00:00:00;00", {24000, 1001}), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::timecode_test
