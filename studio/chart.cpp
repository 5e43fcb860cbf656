// Charts as data.
#include "studio/chart.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/text_file.h"
#include "studio/machine.h"
#include "studio/svg_png.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const ChartValue& value) {
  return std::visit([](const auto& v) { return Json(v); }, value);
}

void check(const Chart& chart) {
  if (chart.stage.empty() || chart.stage.find('/') != std::string::npos) {
    throw std::invalid_argument("a chart's stage is its files' name");
  }
  for (const ChartPoint& p : chart.points) {
    if (!(p.time_ms > 0) || !std::isfinite(p.time_ms) || !(p.error >= 0) ||
        !std::isfinite(p.error) || !std::isfinite(p.error_p99.value_or(0))) {
      throw std::invalid_argument(
          fmt::format("the point {} of method \"{}\" takes {} ms at error {}", p.label, p.method,
                      p.time_ms, p.error));
    }
  }
  for (const Stressor& s : chart.stressors) {
    for (const StressorSample& sample : s.samples) {
      if (!std::isfinite(sample.value) || (s.logarithmic && !(sample.value > 0))) {
        throw std::invalid_argument(
            fmt::format("the stressor \"{}\" has a sample at {}", s.stressor, sample.value));
      }
    }
  }
}

// Names in the order in which points first have them.
template <class Member>
std::vector<std::string> names_of(const std::vector<ChartPoint>& points, Member member) {
  std::vector<std::string> names;
  for (const ChartPoint& point : points) {
    for (const auto& [name, value] : point.*member) {
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string csv_cell(double value) { return fmt::format("{:.9g}", value); }
std::string csv_cell(bool value) { return value ? "true" : "false"; }
std::string csv_cell(const ChartValue& value) {
  return std::visit([](const auto& v) { return csv_cell(v); }, value);
}

template <class Pairs>
std::string csv_cell_of(const Pairs& pairs, const std::string& name) {
  for (const auto& [key, value] : pairs) {
    if (key == name) return csv_cell(value);
  }
  return "";
}

}  // namespace

void mark_front(Chart& chart) {
  for (ChartPoint& point : chart.points) {
    point.on_front =
        !point.peer && std::ranges::none_of(chart.points, [&](const ChartPoint& other) {
          const bool no_worse = other.time_ms <= point.time_ms && other.error <= point.error;
          const bool better = other.time_ms < point.time_ms || other.error < point.error;
          return !other.peer && other.scene == point.scene && no_worse && better;
        });
  }
}

std::string chart_json(const Chart& chart) {
  Json points = Json::array();
  for (const ChartPoint& p : chart.points) {
    Json settings = Json::object();
    for (const auto& [name, value] : p.settings) settings[name] = to_json(value);
    Json point{
        {"method", p.method},    {"peer", p.peer},
        {"settings", settings},  {"time_ms", p.time_ms},
        {"error", p.error},      {"error_p99", p.error_p99 ? Json(*p.error_p99) : Json(nullptr)},
        {"on_front", p.on_front}};
    if (!p.scene.empty()) point["scene"] = p.scene;
    for (const auto& [name, value] : p.figures) point[name] = value;
    points.push_back(std::move(point));
  }
  Json stressors = Json::array();
  for (const Stressor& s : chart.stressors) {
    Json samples = Json::array();
    for (const StressorSample& sample : s.samples) {
      samples.push_back(
          {{"value", sample.value},
           {"error", sample.error},
           {"reported_error", sample.reported_error ? Json(*sample.reported_error) : Json(nullptr)},
           {"status", sample.status}});
      for (const auto& [name, value] : sample.figures) samples.back()[name] = value;
    }
    Json stressor{{"stressor", s.stressor}, {"unit", s.unit}, {"samples", samples}};
    if (s.floor > 0) stressor["floor"] = s.floor;
    stressors.push_back(std::move(stressor));
  }
  const Machine machine = this_machine();
  Json json{{"stage", chart.stage},
            {"title", chart.title},
            {"subtitle", chart.subtitle},
            {"points", points},
            {"stressors", stressors}};
  if (!chart.set_digest.empty()) json["set_digest"] = chart.set_digest;
  for (const ErrorSteps& s : chart.steps) {
    Json steps = Json::array();
    for (const ErrorStep& step : s.steps) {
      steps.push_back(
          {{"name", step.name}, {"error", step.error}, {"standard_error", step.standard_error}});
    }
    json["steps"].push_back({{"title", s.title}, {"steps", steps}});
  }
  json["machine"] = {{"cpu", machine.cpu}, {"threads", machine.threads}, {"arch", machine.arch}};
  return json.dump(2);
}

std::string chart_csv(const Chart& chart) {
  const std::vector<std::string> settings = names_of(chart.points, &ChartPoint::settings);
  const std::vector<std::string> figures = names_of(chart.points, &ChartPoint::figures);
  const bool scenes =
      std::ranges::any_of(chart.points, [](const ChartPoint& p) { return !p.scene.empty(); });
  std::string csv = scenes ? "scene,method,peer" : "method,peer";
  for (const std::string& name : settings) csv += "," + csv_cell(name);
  csv += ",time_ms,error,error_p99";
  for (const std::string& name : figures) csv += "," + csv_cell(name);
  csv += ",on_front\n";
  for (const ChartPoint& p : chart.points) {
    if (scenes) csv += csv_cell(p.scene) + ",";
    csv += csv_cell(p.method) + "," + csv_cell(p.peer);
    for (const std::string& name : settings) csv += "," + csv_cell_of(p.settings, name);
    csv += "," + csv_cell(p.time_ms) + "," + csv_cell(p.error) + ",";
    if (p.error_p99) csv += csv_cell(*p.error_p99);
    for (const std::string& name : figures) csv += "," + csv_cell_of(p.figures, name);
    csv += "," + csv_cell(p.on_front) + "\n";
  }
  return csv;
}

void write_chart(const Chart& chart, const std::string& directory) {
  check(chart);
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) throw std::runtime_error(directory + ": cannot be made: " + error.message());
  const std::filesystem::path base = std::filesystem::path(directory) / chart.stage;
  const auto named = [&](const char* ending) { return base.string() + ending; };
  const std::string svg = chart_svg(chart);
  calibrate::write_text_file(named(".json"), chart_json(chart) + "\n");
  calibrate::write_text_file(named(".csv"), chart_csv(chart));
  calibrate::write_text_file(named(".svg"), svg);
  write_svg_as_png(svg, named(".png"), 2);
}

}  // namespace studio
