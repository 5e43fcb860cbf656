// The chart of glass: what it must show whatever the machine.
#include "studio/charts/glass.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/studio/quick_chart.h"

namespace studio::glass_chart_test {
namespace {

double against_reference(const ChartPoint& p) {
  const auto found = std::ranges::find(p.figures, "error_against_reference",
                                       &std::pair<std::string, double>::first);
  return found == p.figures.end() ? -1 : found->second;
}

TEST(GlassChart, ErrsLessTheFurtherRaysAreFollowedAndLessThanWithDarkCuts) {
  const Chart chart = measure_quickly(glass_chart());
  // 80 and 95 %: cut rays see the environment, or nothing, or some are followed by chance.
  ASSERT_EQ(chart.points.size(), 6U);
  const auto& p = chart.points;
  EXPECT_LT(p[1].error, p[0].error);
  EXPECT_LT(p[3].error, p[2].error);
  EXPECT_LT(p[0].error, p[2].error);
  EXPECT_LT(p[1].error, p[3].error);
  EXPECT_LT(p[5].error, p[4].error);
  EXPECT_LT(p[4].error, p[0].error);
  EXPECT_LT(p[5].error, p[1].error);
  EXPECT_LT(p[1].error, 0.05);
  for (const ChartPoint& point : p) {
    EXPECT_GT(point.time_ms, 0);
    EXPECT_EQ(point.scene, "glass_sphere");
    EXPECT_GT(against_reference(point), 0);
    EXPECT_LT(against_reference(point), point.error + 0.15) << "what is no cut";
  }
  EXPECT_LT(against_reference(p[1]), against_reference(p[2]));

  ASSERT_EQ(chart.stressors.size(), 1U);
  const auto& depths = chart.stressors[0].samples;
  EXPECT_NE(depths.front().status, "ok");
  EXPECT_GT(depths.front().error, 5 * depths.back().error);
}

}  // namespace
}  // namespace studio::glass_chart_test
