// The chart of the keyer: what it must show whatever the machine.
#include "studio/charts/key.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/studio/quick_chart.h"

namespace studio::key_chart_test {
namespace {

TEST(KeyChart, HasADefaultThatErrsLessThanEachOtherToolAndSaysWhenItIsUnsure) {
  const Chart chart = measure_quickly(key_chart());
  EXPECT_EQ(std::ranges::count(chart.points, true, &ChartPoint::by_default), 1);
  const auto ours = std::ranges::find(chart.points, true, &ChartPoint::by_default);
  ASSERT_NE(ours, chart.points.end());
  int peers = 0;
  for (const ChartPoint& p : chart.points) {
    EXPECT_GT(p.time_ms, 0);
    EXPECT_FALSE(p.error_p99) << "it has a mean error of edges, and no percentile";
    if (!p.peer) continue;
    ++peers;
    EXPECT_LT(ours->error, p.error) << p.method;
  }
  EXPECT_EQ(peers, 3);
  ASSERT_EQ(chart.stressors.size(), 4U);
  for (const Stressor& stressor : chart.stressors) {
    for (const StressorSample& sample : stressor.samples) {
      EXPECT_TRUE(sample.status == "ok" || sample.status == "unsure") << sample.status;
    }
  }
}

}  // namespace
}  // namespace studio::key_chart_test
