// The chart of whole frames: what it must show whatever the machine.
#include "studio/charts/render.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>

#include "tests/studio/quick_chart.h"

namespace studio::render_chart_test {
namespace {

namespace fs = std::filesystem;

double figure(const std::vector<std::pair<std::string, double>>& figures, const std::string& name) {
  const auto found = std::ranges::find(figures, name, &std::pair<std::string, double>::first);
  return found == figures.end() ? -1 : found->second;
}

// One test, since each takes the whole chart.
TEST(RenderChart, TellsErrorAndTimeOfEverySceneAndWhereItErrs) {
  const fs::path out =
      fs::path(testing::TempDir()) / ("platelight_render" + std::to_string(getpid()));
  ChartRequest request;
  request.quick = true;
  request.out = out.string();
  Console console(true, "");
  Chart chart = render_chart().measure(request, console);
  mark_front(chart);

  std::map<std::string, std::map<std::string, const ChartPoint*>> scenes;
  for (const ChartPoint& p : chart.points) scenes[p.scene][p.label] = &p;
  ASSERT_EQ(scenes.size(), 4U) << "two scenes, moving and still";
  for (const auto& [scene, points] : scenes) {
    const ChartPoint& by_default = *points.at("default");
    const ChartPoint& fastest = *points.at("1");
    EXPECT_TRUE(by_default.by_default);
    EXPECT_LT(by_default.error, 0.7 * fastest.error) << scene;
    EXPECT_GT(by_default.error, 0) << scene;
    EXPECT_TRUE(by_default.on_front) << scene << ": nothing here errs less";
    for (const char* share : {"groups_within_5_percent", "groups_rms_within_5_percent"}) {
      EXPECT_GT(figure(by_default.figures, share), figure(fastest.figures, share)) << scene;
      EXPECT_LE(figure(by_default.figures, share), 1) << scene;
    }
    EXPECT_LT(figure(by_default.figures, "worst_group_error"),
              figure(fastest.figures, "worst_group_error"))
        << scene;
    EXPECT_GE(figure(by_default.figures, "worst_group_x"), 0) << scene;
    const bool still = scene.ends_with("still");
    EXPECT_EQ(figure(by_default.figures, "rays") == 0, still);
    EXPECT_EQ(figure(by_default.figures, "kept_mb") > 0, still);
  }
  EXPECT_EQ(scenes.at("glass_sphere, moving").at("default")->error,
            scenes.at("glass_sphere, still").at("default")->error);
  for (const char* name : {"render_glass_sphere.png", "render_glass_sphere_error.png",
                           "render_tv_room_lit.png", "render_tv_room_lit_error.png"}) {
    EXPECT_GT(fs::file_size(out / name), 500U) << name;
  }
  fs::remove_all(out);

  ASSERT_EQ(chart.stressors.size(), 3U);
  for (const Stressor& stressor : chart.stressors) {
    for (const StressorSample& s : stressor.samples) {
      EXPECT_GT(s.error, 0) << stressor.stressor;
      EXPECT_LT(s.error, 1) << stressor.stressor;
    }
  }
  const auto& shells = chart.stressors.back().samples;
  EXPECT_GT(shells.back().error, shells.front().error) << "deep glass is what rays are cut in";
}

}  // namespace
}  // namespace studio::render_chart_test
