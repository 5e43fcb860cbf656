// Charts: the front, the files, and that they say the same always.
#include "studio/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include <nlohmann/json.hpp>

namespace studio::chart_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

Chart made_chart() {
  Chart chart;
  chart.stage = "made";
  chart.title = "Light table: error against time";
  chart.subtitle = "made car, 640 x 480, 2 threads <&> made numbers";
  struct Method {
    const char* name;
    double error, power;
  };
  for (const Method& m : {Method{"split", 0.02, 0.72}, Method{"median cut", 0.028, 0.68},
                          Method{"importance sampling", 0.06, 0.5}}) {
    for (int n = 4; n <= 256; n *= 2) {
      ChartPoint p;
      p.method = m.name;
      p.settings = {{"lights", static_cast<double>(n)}, {"adaptive", true}};
      p.time_ms = 9 + 0.55 * n;
      p.error = m.error * std::pow(n / 16.0, -m.power);
      p.error_p99 = p.error * 4;
      p.figures = {{"flicker", p.error / 8}};
      p.label = "N " + std::to_string(n);
      chart.points.push_back(p);
    }
  }
  for (const auto& [time, error] : {std::pair{240.0, 0.11}, {900.0, 0.039}, {3400.0, 0.016}}) {
    ChartPoint p;
    p.method = "Cycles 3.4";
    p.peer = true;
    p.time_ms = time;
    p.error = error;
    chart.points.push_back(p);
  }
  for (const char* name : {"radius of the sun", "contrast of the sun"}) {
    Stressor s{name, "degrees", true, {}};
    for (double v = 0.1; v < 30; v *= 2) {
      s.samples.push_back(
          {v, 0.002 * (1 + 3 / v), 0.003 * (1 + 4 / v), v < 0.15 ? "refused" : "ok"});
    }
    chart.stressors.push_back(s);
  }
  chart.steps.push_back({"true one after the other",
                         {{"as it runs", 0.05, 0.002}, {"+ light", 0.03, 0.002}, {"+ all", 0, 0}}});
  mark_front(chart);
  return chart;
}

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(MarkFront, KeepsWhatNothingOfOursBeats) {
  std::mt19937 random(1);
  std::lognormal_distribution<double> value(0, 1);
  for (int trial = 0; trial < 50; ++trial) {
    Chart chart;
    for (int i = 0; i < 30; ++i) {
      ChartPoint p;
      p.time_ms = value(random);
      p.error = value(random);
      p.peer = i % 5 == 0;
      chart.points.push_back(p);
    }
    mark_front(chart);
    for (const ChartPoint& p : chart.points) {
      bool beaten = p.peer;
      for (const ChartPoint& q : chart.points) {
        beaten = beaten || (!q.peer && q.time_ms < p.time_ms && q.error < p.error);
      }
      EXPECT_EQ(p.on_front, !beaten);
    }
  }
}

TEST(MarkFront, KeepsAFrontForEveryScene) {
  Chart chart = made_chart();
  const std::size_t points = chart.points.size();
  for (std::size_t i = 0; i < points; ++i) {
    ChartPoint slower = chart.points[i];
    chart.points[i].scene = "car";
    slower.scene = "headlight";
    slower.time_ms *= 10;
    slower.error *= 3;
    chart.points.push_back(slower);
  }
  mark_front(chart);
  for (std::size_t i = 0; i < points; ++i) {
    EXPECT_EQ(chart.points[i].on_front, chart.points[points + i].on_front);
  }
  EXPECT_EQ(nlohmann::json::parse(chart_json(chart))["points"][points]["scene"], "headlight");
  EXPECT_TRUE(chart_csv(chart).starts_with("scene,method,peer,"));
  EXPECT_THAT(chart_svg(chart), HasSubstr(">headlight<"));
}

TEST(ChartSvg, IsTheSameTextEveryTime) {
  EXPECT_EQ(chart_svg(made_chart()), chart_svg(made_chart()));
}

TEST(ChartSvg, EscapesWhatPeopleWrite) {
  EXPECT_THAT(chart_svg(made_chart()), HasSubstr("2 threads &lt;&amp;&gt; made numbers"));
}

TEST(ChartSvg, DrawsAChartWithoutPoints) {
  Chart chart;
  chart.stage = "empty";
  EXPECT_THAT(chart_svg(chart), testing::Not(HasSubstr("nan")));
}

TEST(ChartJson, HasWhatScriptsRelyOn) {
  const auto json = nlohmann::json::parse(chart_json(made_chart()));
  EXPECT_EQ(json["stage"], "made");
  const auto& point = json["points"][0];
  EXPECT_EQ(point["method"], "split");
  EXPECT_EQ(point["peer"], false);
  EXPECT_EQ(point["settings"]["lights"], 4);
  EXPECT_EQ(point["settings"]["adaptive"], true);
  for (const char* key : {"time_ms", "error", "error_p99", "flicker"}) {
    EXPECT_TRUE(point[key].is_number()) << key;
  }
  EXPECT_TRUE(point["on_front"].is_boolean());
  const auto& stressor = json["stressors"][0];
  EXPECT_EQ(stressor["unit"], "degrees");
  EXPECT_EQ(stressor["samples"][0]["status"], "refused");
  EXPECT_TRUE(stressor["samples"][0]["reported_error"].is_number());
  EXPECT_GT(json["machine"]["threads"], 0);
  const auto& split = json["steps"][0];
  EXPECT_EQ(split["steps"][1]["name"], "+ light");
  EXPECT_EQ(split["steps"][1]["standard_error"], 0.002);
}

TEST(ChartCsv, HasARowForEveryPoint) {
  const std::string csv = chart_csv(made_chart());
  EXPECT_EQ(std::ranges::count(csv, '\n'), 1 + 3 * 7 + 3);
  EXPECT_TRUE(csv.starts_with(
      "method,peer,lights,adaptive,time_ms,error,error_p99,flicker,on_front\nsplit,false,4,true,"))
      << csv;
}

TEST(ChartSvg, DrawsNoFigureOf0OnALogarithmicAxis) {
  Chart with = made_chart();
  with.panels.push_back({"flicker", {{"flicker", ""}}});
  Chart without = with;
  with.points[3].figures[0].second = 0;
  without.points[3].figures.clear();
  EXPECT_EQ(chart_svg(with), chart_svg(without));
}

TEST(ChartJson, HasNo99thPercentileOfAnErrorThatWasNotMeasured) {
  const auto points = nlohmann::json::parse(chart_json(made_chart()))["points"];
  EXPECT_TRUE(points[0]["error_p99"].is_number());
  EXPECT_TRUE(points.back()["error_p99"].is_null()) << "Cycles'";
  EXPECT_THAT(chart_csv(made_chart()), HasSubstr("Cycles 3.4,true,,,240,0.11,,,"));
}

TEST(WriteChart, WritesFourFiles) {
  const fs::path dir =
      fs::path(testing::TempDir()) / ("platelight_chart" + std::to_string(getpid()));
  write_chart(made_chart(), (dir / "new").string());
  for (const char* name : {"made.json", "made.csv", "made.svg", "made.png"}) {
    EXPECT_GT(fs::file_size(dir / "new" / name), 500U) << name;
  }
  EXPECT_TRUE(content_of(dir / "new/made.png").starts_with("\x89PNG"));
  fs::remove_all(dir);
}

TEST(WriteChart, RefusesPointsThatAreNoMeasurements) {
  for (const double time : {0.0, -1.0, static_cast<double>(NAN)}) {
    Chart chart = made_chart();
    chart.points[3].time_ms = time;
    EXPECT_THROW(write_chart(chart, testing::TempDir()), std::invalid_argument);
  }
  Chart chart = made_chart();
  chart.stage = "../made";
  EXPECT_THROW(write_chart(chart, testing::TempDir()), std::invalid_argument);
}

TEST(WriteChart, NamesADirectoryThatCannotBeMade) {
  try {
    write_chart(made_chart(), "/proc/nowhere");
    FAIL() << "wrote into /proc";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/proc/nowhere"));
  }
}

}  // namespace
}  // namespace studio::chart_test
