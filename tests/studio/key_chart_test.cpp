// The chart of the keyer: what it must show whatever the machine.
#include "studio/charts/key.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>

#include "studio/charts/hull.h"
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
  for (const auto& [method, most] : {std::pair("by texels", 2.0), {"difference", 6.0}}) {
    const auto point = std::ranges::find(chart.points, method, &ChartPoint::method);
    ASSERT_NE(point, chart.points.end()) << method;
    EXPECT_LT(point->error, most * ours->error) << method;
  }
  ASSERT_EQ(chart.stressors.size(), 7U);
  for (const Stressor& stressor : std::span(chart.stressors).first(6)) {
    for (const StressorSample& sample : stressor.samples) {
      EXPECT_TRUE(sample.status == "ok" || sample.status == "unsure") << sample.status;
    }
  }
}

// From its own camera's place a billboard is the picture; from aside its outline is off as stated.
TEST(KeyChart, HasViewsOfABillboardThatErrAsIsStated) {
  Console console(true, "");
  const Stressor views = billboard_view_stressor(true, console);
  ASSERT_GE(views.samples.size(), 2U);
  EXPECT_EQ(views.samples[0].value, 0);
  EXPECT_LT(views.samples[0].error, 0.005);
  for (const StressorSample& sample : views.samples) {
    if (sample.status != "ok") continue;
    ASSERT_TRUE(sample.reported_error);
    // What is stated is the mean of a step; this is one moment of it.
    EXPECT_LE(sample.error, *sample.reported_error + 0.005) << sample.value;
    if (sample.value > 0) {
      EXPECT_GT(sample.error, 0.2 * *sample.reported_error) << sample.value;
    }
  }
}

}  // namespace
}  // namespace studio::key_chart_test
