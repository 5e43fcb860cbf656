// platelight check: names every fault of a set file.
#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/camera.h"
#include "studio/commands/commands.h"
#include "studio/json_text.h"
#include "studio/set.h"
#include "studio/set_files.h"
#include "studio/set_scene.h"
#include "studio/show.h"

namespace studio {
namespace {

nlohmann::ordered_json to_json(const std::vector<Diagnostic>& diagnostics) {
  auto list = nlohmann::ordered_json::array();
  for (const Diagnostic& d : diagnostics) {
    list.push_back(
        {{"file", d.file}, {"line", d.line}, {"column", d.column}, {"message", d.message}});
  }
  return list;
}

nlohmann::ordered_json to_json(const std::vector<ModelReport>& models) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& [name, file, report] : models) {
    const auto [lower, upper] = std::pair(report.lower, report.upper);
    list.push_back({{"name", name},
                    {"file", file},
                    {"triangles", report.triangles},
                    {"vertices", report.vertices},
                    {"materials", report.materials},
                    {"textures", report.textures},
                    {"texture_bytes", report.texture_bytes},
                    {"lower", {lower.x, lower.y, lower.z}},
                    {"upper", {upper.x, upper.y, upper.z}},
                    {"nodes", report.nodes},
                    {"notes", report.notes}});
  }
  return list;
}

void say(const ModelReport& model, Console& console) {
  const render::LoadReport& r = model.report;
  console.say(fmt::format("{}: {}", model.name, model.file));
  console.say(fmt::format("  {} triangles, {} vertices, {} materials, {} textures ({:.1f} MB)",
                          r.triangles, r.vertices, r.materials, r.textures,
                          static_cast<double>(r.texture_bytes) * 1e-6));
  console.say(fmt::format("  x {:.4g} to {:.4g}, y {:.4g} to {:.4g}, z {:.4g} to {:.4g} m",
                          r.lower.x, r.upper.x, r.lower.y, r.upper.y, r.lower.z, r.upper.z));
  std::string parts;
  constexpr std::size_t enough = 12;
  for (std::size_t i = 0; i < r.nodes.size() && i < enough; ++i) {
    parts += (i > 0 ? ", " : "") + r.nodes[i];
  }
  if (r.nodes.size() > enough) parts += fmt::format(", and {} more", r.nodes.size() - enough);
  console.say(fmt::format("  parts: {}", parts));
  for (const std::string& note : r.notes) console.say("  note: " + note);
}

std::vector<std::string> sources_of(const Set& set) {
  std::vector<std::string> sources{set.camera.source};
  if (set.probe) sources.push_back(set.probe->source);
  for (const VideoSettings& video : set.videos) sources.push_back(video.source);
  for (const PersonSettings& person : set.persons) {
    for (const PersonCamera& camera : person.cameras) sources.push_back(camera.source);
  }
  return sources;
}

// Cameras that a set wants, which need not be there while it is written.
std::vector<std::string> devices_of(const Set& set) {
  std::vector<std::string> sources = sources_of(set);
  std::erase_if(sources, [](const std::string& uri) { return !capture::is_device(uri); });
  return sources;
}

// What of its sources is no fault, but will be missed on air.
std::vector<std::string> notes_of_sources(const Set& set) {
  std::vector<std::string> notes;
  for (const std::string& source : sources_of(set)) {
    const std::string missing = capture::missing_pictures(source);
    if (missing.empty()) continue;
    std::string note = fmt::format(
        "{}: there is no file with the numbers {}: those frames are lost", source, missing);
    if (std::ranges::find(notes, note) == notes.end()) notes.push_back(std::move(note));
  }
  return notes;
}

// What the show would note, but for what is said of the models.
void add_unsaid(const std::vector<std::string>& of_show,
                const std::vector<ModelReport>& models,
                std::vector<std::string>& notes) {
  for (const std::string& note : of_show) {
    const bool said = std::ranges::any_of(models, [&](const ModelReport& model) {
      return std::ranges::any_of(model.report.notes, [&](const std::string& of_model) {
        return note.ends_with(of_model);
      });
    });
    if (!said) notes.push_back(note);
  }
}

void check(const std::string& path, Console& console) {
  spare_set_file(path, console.figures_file());
  try {
    const Set set = read_set(path);
    spare_sources(set, console.figures_file());
    const std::vector<ModelReport> models = check_models(set);
    const std::vector<std::string> devices = devices_of(set);
    std::vector<std::string> notes = notes_of_sources(set);
    if (devices.empty()) add_unsaid(check_show(set), models, notes);
    console.figures(json_text(nlohmann::ordered_json{
        {"diagnostics", nlohmann::json::array()}, {"models", to_json(models)}, {"notes", notes}}));
    for (const ModelReport& model : models) say(model, console);
    console.say(fmt::format("{}: good ({} objects, {} stand-ins)", path, set.objects.size(),
                            set.stand_ins.size()));
    for (const std::string& note : notes) console.say("  note: " + note);
    for (const std::string& device : devices) {
      console.say(
          fmt::format("  {} was not opened, and so no other source, nor the recording", device));
    }
  } catch (const SetError& error) {
    console.figures(
        json_text(nlohmann::ordered_json{{"diagnostics", to_json(error.diagnostics())}}));
    throw;
  }
}

}  // namespace

Command check_command() {
  return {"check", "Check a set file, its models and its sources, and name all their faults",
          "platelight check demo/car.toml",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto path = std::make_shared<std::string>();
            arguments.positional("SET", *path, "set file");
            return [path](Console& console) { check(*path, console); };
          }};
}

}  // namespace studio
