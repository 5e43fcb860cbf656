// The chart of the HDR merge: what it must show whatever the machine.
#include "studio/charts/hdr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "tests/studio/quick_chart.h"

namespace studio::hdr_chart_test {
namespace {

const Chart& quick_chart() {
  static const Chart chart = measure_quickly(hdr_chart());
  return chart;
}

const Stressor& stressor_of(const std::string& begin) {
  const auto found = std::ranges::find_if(
      quick_chart().stressors, [&](const Stressor& s) { return s.stressor.starts_with(begin); });
  if (found == quick_chart().stressors.end()) throw std::runtime_error("no stressor " + begin);
  return *found;
}

// Tests run in processes of their own, and each takes the whole chart: this one looks at all of it.
TEST(HdrChart, HasMergesThatErrNoMoreThanOpenCvsAndTellTheirDeviation) {
  double least_of_peers = 1e9;
  int peers = 0;
  for (const ChartPoint& p : quick_chart().points) {
    EXPECT_GT(p.time_ms, 0);
    if (!p.peer) continue;
    ++peers;
    least_of_peers = std::min(least_of_peers, p.error);
  }
  EXPECT_EQ(peers, 2);
  for (const ChartPoint& p : quick_chart().points) {
    if (p.peer) continue;
    EXPECT_LE(p.error, least_of_peers) << p.method << " " << p.variant;
    for (const auto& [name, value] : p.figures) {
      if (name != "within_deviation") continue;
      EXPECT_NEAR(value, 0.683, 0.05) << p.variant;
    }
  }
  EXPECT_EQ(std::ranges::count(quick_chart().points, true, &ChartPoint::by_default), 1);
  // What a show merges (RollingBracket::add).
  const auto ours = std::ranges::find(quick_chart().points, true, &ChartPoint::by_default);
  EXPECT_EQ(ours->method, "window");
  EXPECT_EQ(ours->variant, "floats");
}

// The worst sample of each says so: by its status, or by a deviation as large as its error.
TEST(HdrChart, SaysWhereItFails) {
  EXPECT_EQ(quick_chart().stressors.size(), 10U);
  for (const char* wrong : {"light, times what", "members missing, the shortest"}) {
    EXPECT_TRUE(stressor_of(wrong).samples.back().status.starts_with("lower bound")) << wrong;
  }
  for (const char* wrong :
       {"light, times that", "label of", "wave on", "flicker of lamps before a rolling"}) {
    EXPECT_TRUE(stressor_of(wrong).samples.back().status.starts_with("inconsistent")) << wrong;
  }
  for (const char* dark : {"light, down to", "members missing, the longest"}) {
    for (const StressorSample& s : stressor_of(dark).samples) {
      ASSERT_TRUE(s.reported_error) << dark;
      EXPECT_NEAR(*s.reported_error / s.error, 1, 0.15) << dark << " " << s.value;
    }
  }
}

}  // namespace
}  // namespace studio::hdr_chart_test
