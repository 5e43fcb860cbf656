// The chart of the light table: what it must show whatever the machine.
#include "studio/charts/lights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "tests/studio/quick_chart.h"

namespace studio {
namespace {

const Chart& quick_chart() {
  static const Chart chart = measure_quickly(lights_chart());
  return chart;
}

double lights_of(const ChartPoint& p) { return std::get<double>(p.settings.at(0).second); }

double figure(const ChartPoint& p, const std::string& name) {
  const auto found = std::ranges::find(p.figures, name, &std::pair<std::string, double>::first);
  return found == p.figures.end() ? -1 : found->second;
}

// Tests run in processes of their own, and each takes the whole chart: this one looks at all
// points.
TEST(LightsChart, HasEveryMethodErringLessWithMoreLightsAndCalmWhereLightIsFollowed) {
  std::map<std::string, std::set<std::string>> variants;
  for (const ChartPoint& p : quick_chart().points) {
    EXPECT_EQ(p.peer, p.method == "per-pixel importance sampling");
    EXPECT_GT(p.error, 0);
    EXPECT_GT(p.error_p99, 0);
    EXPECT_GT(figure(p, "flicker"), 0);
    variants[p.method].insert(p.variant);
  }
  EXPECT_EQ(variants.size(), 3U);
  for (const char* method : {"split", "median cut"}) {
    EXPECT_EQ(variants[method].size(), 4U) << method;
  }
  EXPECT_EQ(std::ranges::count(quick_chart().points, true, &ChartPoint::by_default), 1);

  std::map<std::string, std::map<double, double>> errors;
  for (const ChartPoint& p : quick_chart().points) {
    if (p.peer || p.variant == "every pixel") errors[p.method][lights_of(p)] = p.error;
  }
  for (const auto& [method, by_lights] : errors) {
    EXPECT_LT(by_lights.rbegin()->second, by_lights.begin()->second / 2) << method;
  }
  for (const ChartPoint& p : quick_chart().points) {
    if (p.peer) continue;
    EXPECT_LT(figure(p, "flicker_followed"), figure(p, "flicker") / 10) << p.method << p.label;
  }
}

// The promise that a show relies on: the estimate warns before the error comes.
TEST(LightsChart, ExpectsMoreErrorThanThereIsUnderEverySkyAndNumberOfLights) {
  int swept = 0;
  double worst = 0;
  for (const Stressor& stressor : quick_chart().stressors) {
    for (const StressorSample& s : stressor.samples) {
      ASSERT_TRUE(s.reported_error) << stressor.stressor;
      const double light_alone =
          std::sqrt(std::max(0.0, s.error * s.error - stressor.floor * stressor.floor));
      EXPECT_GE(*s.reported_error, light_alone) << stressor.stressor << " " << s.value;
      worst = std::max(worst, s.error);
      ++swept;
    }
  }
  EXPECT_GE(swept, 15);
  EXPECT_GT(worst, 0.1) << "the sweep must go to where the table fails";
}

}  // namespace
}  // namespace studio
