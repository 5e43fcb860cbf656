// The chart of the keyer: what it must show whatever the machine.
#include "studio/charts/key.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/studio/quick_chart.h"

namespace studio {
namespace {

TEST(KeyChart, HasAKeyThatErrsLessThanOtherToolsAndSaysWhenItIsUnsure) {
  const Chart chart = measure_quickly(key_chart());
  double best = 1e9, best_peer = 1e9;
  int peers = 0, defaults = 0;
  for (const ChartPoint& p : chart.points) {
    EXPECT_GT(p.time_ms, 0);
    defaults += p.by_default;
    peers += p.peer;
    double& least = p.peer ? best_peer : best;
    least = std::min(least, p.error);
  }
  EXPECT_EQ(peers, 3);
  EXPECT_EQ(defaults, 1);
  EXPECT_LT(best, best_peer);
  ASSERT_EQ(chart.stressors.size(), 4U);
  for (const Stressor& stressor : chart.stressors) {
    for (const StressorSample& sample : stressor.samples) {
      EXPECT_TRUE(sample.status == "ok" || sample.status == "unsure") << sample.status;
    }
  }
}

}  // namespace
}  // namespace studio
