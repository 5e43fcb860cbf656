// The chart of the light table: what it must show whatever the machine.
#include "studio/charts/lights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "studio/charts/bounce_lamps.h"
#include "studio/charts/caustics.h"
#include "studio/charts/screen_lamps.h"
#include "tests/studio/quick_chart.h"

namespace studio::lights_chart_test {
namespace {

const Chart& quick_chart() {
  static const Chart chart = measure_quickly(lights_chart());
  return chart;
}

double lights_of(const ChartPoint& p) { return std::get<double>(p.settings.at(0).second); }

// All but lamps on screens and of bounced light, and caustics, which have tests of their own.
std::vector<ChartPoint> points_of_tables() {
  std::vector<ChartPoint> points = quick_chart().points;
  std::erase_if(points, [](const ChartPoint& p) {
    return p.method == "lamps on a screen" || p.method == "lamps of bounced light" ||
           p.method == "photons through glass";
  });
  return points;
}

double figure(const std::vector<std::pair<std::string, double>>& figures, const std::string& name) {
  const auto found = std::ranges::find(figures, name, &std::pair<std::string, double>::first);
  return found == figures.end() ? -1 : found->second;
}

void expect_less_error_with_more_lights_and_calm_where_light_is_followed() {
  std::map<std::string, std::set<std::string>> variants;
  const std::vector<ChartPoint> points = points_of_tables();
  for (const ChartPoint& p : points) {
    EXPECT_EQ(p.peer, p.method == "per-pixel importance sampling");
    EXPECT_GT(p.error, 0);
    EXPECT_GT(p.error_p99, 0);
    EXPECT_GT(figure(p.figures, "flicker"), 0);
    variants[p.method].insert(p.variant);
  }
  EXPECT_EQ(variants.size(), 3U);
  for (const char* method : {"split", "median cut"}) {
    EXPECT_EQ(variants[method].size(), 5U) << method;
  }
  EXPECT_EQ(std::ranges::count(points, true, &ChartPoint::by_default), 1);

  std::map<std::string, std::map<double, double>> errors;
  for (const ChartPoint& p : points) {
    if (p.peer || p.variant == "every pixel") errors[p.method][lights_of(p)] = p.error;
  }
  for (const auto& [method, by_lights] : errors) {
    EXPECT_LT(by_lights.rbegin()->second, by_lights.begin()->second / 2) << method;
  }
  for (const ChartPoint& p : points) {
    if (p.peer) continue;
    EXPECT_LT(figure(p.figures, "flicker_followed"), figure(p.figures, "flicker") / 10)
        << p.method << p.label;
  }
}

// The promise that a show relies on: the estimate warns before the error comes.
void expect_estimates_above_errors_under_every_sky_and_number_of_lights() {
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
  EXPECT_GE(swept, 19);
  EXPECT_GT(worst, 0.1) << "the sweep must go to where the table fails";

  // So lights that are chosen for an error bound keep it.
  const auto bounds = std::ranges::find_if(quick_chart().stressors, [](const Stressor& s) {
    return s.stressor.starts_with("error bound");
  });
  ASSERT_NE(bounds, quick_chart().stressors.end());
  double before = 1e9;
  for (const StressorSample& s : bounds->samples) {
    EXPECT_EQ(s.status, "ok") << s.value;
    EXPECT_LE(s.error, s.value);
    const double lights = figure(s.figures, "lights"), needed = figure(s.figures, "lights_needed");
    EXPECT_LT(lights, before) << "a wider bound takes fewer";
    EXPECT_LE(needed, lights);
    EXPECT_GT(needed, 0);
    before = lights;
  }
}

// Tests run in processes of their own, and the whole chart takes long: it is looked at once.
TEST(LightsChart, HasLessErrorWithMoreLightsAndExpectsMoreThanThereIs) {
  expect_less_error_with_more_lights_and_calm_where_light_is_followed();
  expect_estimates_above_errors_under_every_sky_and_number_of_lights();
}

TEST(LightsChart, HasScreensErringLessWithMoreLampsAndLittleByDefault) {
  std::map<std::string, std::map<double, double>> errors;
  Chart chart;
  add_screen_lamps(true, chart);
  for (const ChartPoint& p : chart.points) {
    errors[p.scene + p.variant][lights_of(p)] = p.error;
    EXPECT_GT(figure(p.figures, "still_ms"), 0);
  }
  ASSERT_EQ(errors.size(), 3U) << "the bare floor, and the room with two kinds of shadow rays";
  // In the room, what stands just below the screen sees its lamps one by one.
  for (const auto& [scene, by_lamps] : errors) EXPECT_LT(by_lamps.at(25), by_lamps.at(1)) << scene;
  const auto& closed_form = errors.rbegin()->second;
  EXPECT_LT(closed_form.at(25), 0.005);
  EXPECT_LT(closed_form.at(25), closed_form.at(1) / 10);
}

TEST(LightsChart, HasARoomNearTheReferenceWithLampsOfBouncedLightAndFarWithout) {
  Chart chart;
  add_bounce_lamps(true, chart);
  ASSERT_EQ(chart.points.size(), 2U);
  EXPECT_TRUE(chart.points[0].by_default);
  EXPECT_EQ(lights_of(chart.points[0]), 0);
  EXPECT_GT(chart.points[0].error, 0.2) << "the room must need that light";
  EXPECT_LT(chart.points[1].error, 0.6 * chart.points[0].error);
  EXPECT_GT(figure(chart.points[1].figures, "placing_ms"), 0);
}

TEST(LightsChart, HasABallOfGlassNearTheReferenceWithPhotonsAndFarWithout) {
  Chart chart;
  add_caustics(true, chart);
  ASSERT_EQ(chart.points.size(), 2U);
  EXPECT_TRUE(chart.points[0].by_default);
  EXPECT_GT(chart.points[0].error, 0.05) << "straight on";
  EXPECT_LT(chart.points[1].error, 0.4 * chart.points[0].error);
  EXPECT_GT(figure(chart.points[1].figures, "finding_ms"), 0);
}

}  // namespace
}  // namespace studio::lights_chart_test
