// Points of effort, to and from files.
#include "studio/effort_points.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/files.h"
#include "render/kernel.h"
#include "studio/machine.h"
#include "studio/set_digest.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t most_bytes = std::size_t{16} << 20;

// Of a set's file of points.
std::string with_remedy(const std::string& set_path, const std::string& why) {
  return fmt::format("{} {}; platelight chart set {} measures it anew",
                     effort_points_file(set_path), why, set_path);
}

[[noreturn]] void fail(const std::string& set_path, const std::string& why) {
  throw std::runtime_error(with_remedy(set_path, why));
}

int whole(const Json& settings, const char* name, int low, int high) {
  const int value = settings.at(name).get<int>();
  if (value < low || value > high) {
    throw std::runtime_error(fmt::format("{} is {}, outside {} to {}", name, value, low, high));
  }
  return value;
}

// As short as a float tells it: .95 and not .949999988.
double as_written(float value) { return std::round(static_cast<double>(value) * 1e6) * 1e-6; }

EffortPoint point_of(const Json& point, render::Effort effort) {
  const Json& settings = point.at("settings");
  effort.aa_samples = whole(settings, "aa_samples", 1, render::samples_max);
  effort.aa_tolerance = settings.at("aa_tolerance").get<float>();
  effort.glint_contrast = settings.at("glint_contrast").get<float>();
  effort.light_samples = whole(settings, "light_samples", 1, 4096);
  effort.interleave = whole(settings, "interleave", 1, 4);
  effort.adaptive_visibility = settings.at("adaptive_visibility").get<bool>();
  effort.soft_lights = settings.value("soft_lights", effort.soft_lights);
  effort.accuracy = settings.at("accuracy").get<float>();
  effort.chance_cuts = settings.value("chance_cuts", effort.chance_cuts);
  const EffortPoint result{effort, point.at("time_ms").get<double>(),
                           point.at("error").get<double>()};
  const bool good = effort.interleave != 3 && effort.accuracy >= 0 && effort.accuracy <= 1 &&
                    effort.aa_tolerance >= 0 && effort.glint_contrast >= 0 && result.time_ms > 0 &&
                    result.error >= 0;
  if (!good) throw std::runtime_error("a point's figures cannot be");
  return result;
}

}  // namespace

std::vector<std::pair<std::string, ChartValue>> settings_of(const render::Effort& effort) {
  return {{"aa_samples", static_cast<double>(effort.aa_samples)},
          {"aa_tolerance", as_written(effort.aa_tolerance)},
          {"glint_contrast", as_written(effort.glint_contrast)},
          {"light_samples", static_cast<double>(effort.light_samples)},
          {"interleave", static_cast<double>(effort.interleave)},
          {"adaptive_visibility", effort.adaptive_visibility},
          {"soft_lights", effort.soft_lights},
          {"accuracy", as_written(effort.accuracy)},
          {"chance_cuts", effort.chance_cuts}};
}

std::string effort_points_file(const std::string& set_path) {
  return std::filesystem::path(set_path).replace_extension(".chart.json").string();
}

EffortPoints read_effort_points(const std::string& set_path, const render::Effort& base) {
  const std::string path = effort_points_file(set_path);
  if (!std::filesystem::exists(path)) fail(set_path, "is not there");
  try {
    const std::vector<std::byte> bytes = capture::read_file(path, most_bytes);
    const auto* text = reinterpret_cast<const char*>(bytes.data());
    const Json chart = Json::parse(text, text + bytes.size());
    const Machine machine = this_machine();
    const Json& measured_on = chart.at("machine");
    if (measured_on.at("cpu") != machine.cpu || measured_on.at("threads") != machine.threads) {
      throw std::runtime_error("was measured on another machine");
    }
    EffortPoints read;
    for (const Json& point : chart.at("points")) read.points.push_back(point_of(point, base));
    if (read.points.empty()) throw std::runtime_error("has no points");
    if (chart.value("set_digest", "") != set_digest(set_path)) {
      read.doubt = with_remedy(set_path, "was measured of another set, or before this one changed");
    }
    return read;
  } catch (const Json::exception& error) {
    fail(set_path, std::string("is no chart of a set: ") + error.what());
  } catch (const std::runtime_error& error) {
    fail(set_path, error.what());
  }
}

EffortChoice most_accurate_at(const std::vector<EffortPoint>& points, double fps) {
  const auto fastest = std::ranges::min_element(points, {}, &EffortPoint::time_ms);
  EffortChoice choice{*fastest, false};
  for (const EffortPoint& point : points) {
    if (point.time_ms * fps > 1000) continue;
    if (!choice.holds || point.error < choice.point.error) choice = {point, true};
  }
  return choice;
}

EffortChoice fastest_within(const std::vector<EffortPoint>& points, double error) {
  const auto best = std::ranges::min_element(points, {}, &EffortPoint::error);
  EffortChoice choice{*best, false};
  for (const EffortPoint& point : points) {
    if (point.error > error) continue;
    if (!choice.holds || point.time_ms < choice.point.time_ms) choice = {point, true};
  }
  return choice;
}

}  // namespace studio
