// Efforts picked from a chart: the best of those that do what was asked.
#include "studio/effort_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "studio/charts/set.h"
#include "studio/machine.h"
#include "studio/set.h"
#include "studio/set_digest.h"
#include "tests/studio/made_show.h"

namespace studio::effort_points_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

EffortPoint point(int lights, double time_ms, double error) {
  EffortPoint p{{}, time_ms, error};
  p.effort.light_samples = lights;
  p.effort.aa_samples = 4 * lights / 16;
  p.effort.aa_tolerance = 1.6F / static_cast<float>(lights);
  p.effort.glint_contrast = 0.3F;
  p.effort.adaptive_visibility = lights < 256;
  return p;
}

const std::vector<EffortPoint> points{point(16, 20, 0.04), point(32, 45, 0.05), point(64, 38, 0.02),
                                      point(256, 90, 0.008)};

TEST(MostAccurateAt, TakesTheLeastErrorAmongThoseThatAreFastEnough) {
  EXPECT_EQ(most_accurate_at(points, 25).point.effort.light_samples, 64);
  EXPECT_EQ(most_accurate_at(points, 40).point.effort.light_samples, 16);
  EXPECT_EQ(most_accurate_at(points, 1).point.effort.light_samples, 256);
  EXPECT_TRUE(most_accurate_at(points, 50).holds) << "20 ms hold 50 fps";
}

TEST(MostAccurateAt, TakesTheFastestAndSaysSoIfNoneIsFastEnough) {
  const EffortChoice choice = most_accurate_at(points, 60);
  EXPECT_FALSE(choice.holds);
  EXPECT_EQ(choice.point.effort.light_samples, 16);
}

TEST(FastestWithin, TakesTheLeastTimeAmongThoseThatAreAccurateEnough) {
  EXPECT_EQ(fastest_within(points, 0.01).point.effort.light_samples, 256);
  EXPECT_EQ(fastest_within(points, 0.02).point.effort.light_samples, 64);
  EXPECT_EQ(fastest_within(points, 0.5).point.effort.light_samples, 16);
}

TEST(FastestWithin, TakesTheMostAccurateAndSaysSoIfNoneIsAccurateEnough) {
  const EffortChoice choice = fastest_within(points, 0.001);
  EXPECT_FALSE(choice.holds);
  EXPECT_EQ(choice.point.effort.light_samples, 256);
}

class EffortPointsFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    dir_ = fs::path(testing::TempDir()) /
           (std::string("platelight_effort_") + info->name() + std::to_string(getpid()));
    fs::create_directories(dir_);
  }
  void TearDown() override { fs::remove_all(dir_); }
  std::string set() const { return (dir_ / "car.toml").string(); }
  void write_set(const std::string& content) const { std::ofstream(set()) << content; }
  // As `chart set` writes it.
  Chart chart_of_set() const {
    Chart chart;
    chart.stage = "car.chart";
    chart.set_digest = set_digest(set());
    for (const EffortPoint& p : points) {
      ChartPoint measured;
      measured.settings = settings_of(p.effort);
      measured.time_ms = p.time_ms;
      measured.error = p.error;
      chart.points.push_back(measured);
    }
    return chart;
  }
  void write(const std::string& content) const {
    std::ofstream(effort_points_file(set())) << content;
  }

  fs::path dir_;
};

TEST_F(EffortPointsFile, GivesBackWhatTheChartMeasured) {
  render::Effort base;
  base.max_depth = 5;
  write_set("[show]\nwidth = 640\n");
  write_chart(chart_of_set(), dir_.string());
  const auto [read, doubt] = read_effort_points(set(), base);
  EXPECT_EQ(doubt, "");
  ASSERT_EQ(read.size(), points.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    render::Effort effort = points[i].effort;
    effort.max_depth = 5;
    EXPECT_EQ(read[i].effort, effort) << i;
    EXPECT_EQ(read[i].time_ms, points[i].time_ms);
    EXPECT_EQ(read[i].error, points[i].error);
  }
}

TEST_F(EffortPointsFile, IsDoubtedOnceItsSetSaysAnythingElse) {
  const std::string said =
      "[show]\nwidth = 640\n[[object]]\nname = \"car\"\n[effort]\nmax_depth = 9\n";
  write_set(said);
  write_chart(chart_of_set(), dir_.string());
  for (const char* same :
       {"# a car\n[show]\nwidth=640.0 # wide\n\n[[object]]\nname = 'car'\n[effort]\nmax_depth = "
        "9\n",
        "[effort]\nmax_depth = 9\nlight_samples = 8\naa_tolerance = 0.3\n[show]\nwidth = 640\n"
        "[[object]]\nname = \"car\"\n"}) {
    write_set(same);
    EXPECT_EQ(read_effort_points(set(), {}).doubt, "") << same;
  }
  for (const char* other :
       {"", "[show]\nwidth = 641\n[[object]]\nname = \"car\"\n[effort]\nmax_depth = 9\n",
        "[show]\nwidth = 640\n[[object]]\nname = \"car\"\n[effort]\nmax_depth = 8\n",
        "[show]\nwidth = 640\n[[object]]\nname = \"car\"\n[[object]]\n[effort]\nmax_depth = 9\n"}) {
    write_set(other);
    const EffortPoints read = read_effort_points(set(), {});
    EXPECT_EQ(read.points.size(), points.size());
    EXPECT_THAT(read.doubt, HasSubstr("another set")) << other;
    EXPECT_THAT(read.doubt, HasSubstr("platelight chart set " + set())) << other;
  }
  write_set(said);
  Chart old = chart_of_set();
  old.set_digest.clear();
  write_chart(old, dir_.string());
  EXPECT_THAT(read_effort_points(set(), {}).doubt, HasSubstr("another set"));
}

TEST_F(EffortPointsFile, IsRefusedWithTheCommandThatMakesItAnew) {
  const std::string here = "\"machine\": {\"cpu\": \"" + this_machine().cpu +
                           "\", \"threads\": " + std::to_string(this_machine().threads) + "}";
  const std::string settings =
      "\"settings\": {\"aa_samples\": 4, \"aa_tolerance\": 0.1, \"glint_contrast\": 0.1, "
      "\"light_samples\": 99999, \"interleave\": 1, \"adaptive_visibility\": true, "
      "\"accuracy\": 0.95}";
  for (const auto& [content, reason] : {
           std::pair<std::string, std::string>{"{", "is no chart of a set"},
           {"{\"points\": []}", "is no chart of a set"},
           {"{\"points\": [], " + here + "}", "has no points"},
           {"{\"points\": [{}], " + here + "}", "is no chart of a set"},
           {"{\"points\": [{" + settings + "}], " + here + "}", "light_samples is 99999"},
           {"{\"points\": [], \"machine\": {\"cpu\": \"another\", \"threads\": 2}}",
            "was measured on another machine"},
       }) {
    write(content);
    const auto read = [&] { read_effort_points(set(), {}); };
    EXPECT_THAT(read, ThrowsMessage<std::runtime_error>(HasSubstr(reason))) << content;
    EXPECT_THAT(read, ThrowsMessage<std::runtime_error>(HasSubstr("platelight chart set")));
  }
}

using LiveSets = MadeShowTest;

// Each take would be of other moments, and as fast as the camera.
TEST_F(LiveSets, AreChartedOnceTheyAreRecorded) {
  Console console(true, "");
  SetChartSettings settings;
  settings.samples = 2;
  settings.quick = true;
  const std::string live_plate = write_made_set(dir_, "live_grey:1000,50");
  EXPECT_THAT(
      [&] { static_cast<void>(chart_set(live_plate, settings, console)); },
      ThrowsMessage<SetError>(testing::AllOf(
          HasSubstr("made.toml:5:10: the plate is a live camera"), HasSubstr("capture record"))));
  const std::string live_probe = (dir_ / "probe.toml").string();
  std::ofstream(live_probe) << "[show]\nwidth = 64\nheight = 48\n"
                               "[camera]\nsource = \"grey:9,25,0\"\n"
                               "[probe]\nsource = \"live_grey:1000,50\"\n"
                               "lens = { model = \"pinhole\", focal_px = 60, size = [64, 48] }\n"
                               "pose = { axis = [0, 0, 1] }\nmatch = [1, 1, 1]\n";
  EXPECT_THAT(
      [&] { static_cast<void>(chart_set(live_probe, settings, console)); },
      ThrowsMessage<SetError>(testing::AllOf(
          HasSubstr("probe.toml:7:10: the probe is a live camera"), HasSubstr("capture record"))));
  for (const char* more :
       {"[[object]]\nname = \"set\"\nmade = \"tv\"\n"
        "[[video]]\nobject = \"set/tv\"\nsource = \"live_grey:1000,50\"\n",
        "[[billboard]]\nheight = 2\nposition = [0, 0, 0]\nsource = \"live_grey:1000,50\"\n"}) {
    const std::string live_video = write_made_set(dir_, "grey:9,25,0", more);
    EXPECT_THAT(
        [&] { static_cast<void>(chart_set(live_video, settings, console)); },
        ThrowsMessage<SetError>(testing::AllOf(HasSubstr(":10: live_grey:1000,50 is a live camera"),
                                               HasSubstr("capture record"))));
  }
}

}  // namespace
}  // namespace studio::effort_points_test
