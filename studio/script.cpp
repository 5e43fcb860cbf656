// Scripts: their reading, and what only opening shows.
#include "studio/script.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "capture/camera.h"
#include "studio/section.h"
#include "studio/set_files.h"
#include "studio/set_sections.h"
#include "studio/show_inputs.h"
#include "studio/timed_source.h"
#include "studio/toml_file.h"

namespace studio {
namespace {

constexpr std::int64_t last_frame = 100'000'000;
constexpr std::size_t most_commands = 100'000;
constexpr const char* what_happens[] = {"move",   "video", "effort",  "view",
                                        "record", "set",   "pause_s", "quit"};

std::string comma_list(const std::vector<std::string>& words) {
  std::string list;
  for (const std::string& word : words) list += (list.empty() ? "" : ", ") + word;
  return list;
}

// Names in the order of the set, those left out that are none.
template <class Things>
std::string names_in(const Things& things) {
  std::vector<std::string> names;
  for (const auto& thing : things) {
    if (!thing.name.empty()) names.push_back(fmt::format("\"{}\"", thing.name));
  }
  return names.empty() ? "none has a name" : "there are " + comma_list(names);
}

PlacementSettings between(const PlacementSettings& from,
                          const PlacementSettings& to,
                          double share) {
  const auto mix = [&](auto a, auto b) { return a + (b - a) * share; };
  return {mix(from.position, to.position), mix(from.tilt_rad, to.tilt_rad),
          mix(from.yaw_rad, to.yaw_rad), mix(from.scale, to.scale)};
}

// One table after the other, by frame: each knows how those before it leave the show.
class ScriptReader {
 public:
  ScriptReader(const std::string& path, const Set& set, const std::function<void(Set&)>& adapt)
      : base_(std::filesystem::absolute(path).parent_path()),
        adapt_(adapt),
        set_(set),
        effort_(set.effort),
        records_(!set.record.is_empty()) {}

  void read(Section at, std::int64_t frame) {
    frame_ = frame;
    place_ = at.place();
    std::vector<const char*> given;
    std::ranges::copy_if(what_happens, std::back_inserter(given),
                         [&](const char* key) { return at.has(key); });
    if (given.empty()) {
      at.fault("",
               "must say what happens: move, video, effort, view, record, set, pause_s or quit");
    } else if (given.size() > 1) {
      at.fault(given[1], fmt::format("comes beside at.{}: one [[at]] for each", given[0]));
    }
    if (quits_) {
      at.fault("", fmt::format("is never reached: the show quits at frame {}, by line {}",
                               quits_->frame, quits_->place.line));
    }
    at.of_use_only(at.has("move"), "pose", "at.move");
    at.of_use_only(at.has("move"), "until", "at.move");
    at.of_use_only(at.has("video"), "source", "at.video");
    read_move(at);
    read_video(at);
    if (auto table = at.table("effort")) {
      effort_ = read_effort_section(*table, effort_);
      add(SetEffort{effort_});
    }
    read_view(at);
    read_record(at);
    read_set_change(at);
    if (double pause_s = 0; at.number("pause_s", pause_s, {0.001, 3600})) {
      add(SetPaused{true, std::chrono::milliseconds(std::llround(1000 * pause_s))});
    }
    if (bool quit = false; at.boolean("quit", quit)) {
      if (!quit) at.fault("quit", "can only be true");
      quits_ = Way{frame, place_};
      add(Quit{});
    }
    at.finish();
  }

  // By frame.
  std::vector<ScriptedCommand> take_commands() {
    std::ranges::stable_sort(commands_, {}, &ScriptedCommand::frame);
    return std::move(commands_);
  }
  // Of the sets that it changes to.
  const std::vector<Diagnostic>& faults_of_sets() const { return faults_of_sets_; }

 private:
  struct Way {
    std::int64_t frame = 0;
    Place place;
  };

  void add(ShowCommand what) { commands_.push_back({frame_, std::move(what), place_}); }

  // Where something is before it is moved: parts by a step from where the model has them.
  PlacementSettings place_of(const std::string& name, const NamedParts& named) const {
    if (const auto moved = moved_.find(name); moved != moved_.end()) return moved->second;
    return named.part ? PlacementSettings{} : set_.objects[named.object].pose;
  }

  void read_move(Section& at) {
    std::string name;
    if (!at.text("move", name)) return;
    at.need("pose", "where to, as the pose of an object");
    const std::optional<NamedParts> named = parts_named(set_, name);
    if (!named) {
      at.fault("move", fmt::format("is \"{}\", but the set has no such object: {}", name,
                                   names_in(set_.objects)));
    }
    const PlacementSettings from = named ? place_of(name, *named) : PlacementSettings{};
    PlacementSettings to = from;
    if (auto table = at.table("pose")) to = read_placement(*table, from);
    std::int64_t until = frame_;
    at.integer("until", until, frame_, last_frame);
    if (const auto before = ways_.find(name);
        before != ways_.end() && frame_ <= before->second.frame) {
      at.fault("move", fmt::format("is \"{}\", which is on its way until frame {}, by line {}",
                                   name, before->second.frame, before->second.place.line));
    }
    ways_[name] = {until, place_};
    moved_[name] = to;
    const auto steps = static_cast<std::size_t>(until - frame_) + 1;
    if (commands_.size() + steps > most_commands) {
      at.fault(at.has("until") ? "until" : "move",
               fmt::format("makes {} commands so far, one a frame, but a script has at most {}",
                           commands_.size() + steps, most_commands));
      return;
    }
    for (std::size_t step = 1; step <= steps; ++step) {
      const double share = static_cast<double>(step) / static_cast<double>(steps);
      commands_.push_back({frame_ + static_cast<std::int64_t>(step) - 1,
                           MoveObject{name, step < steps ? between(from, to, share) : to}, place_});
    }
  }

  void read_video(Section& at) {
    std::string name, source;
    if (!at.text("video", name)) return;
    at.need("source", "what it shows from then on: a file's path or a camera's URI");
    if (std::ranges::find(set_.videos, name, &VideoSettings::name) == set_.videos.end()) {
      at.fault("video", fmt::format("is \"{}\", but the set has no such video: {}", name,
                                    names_in(set_.videos)));
    }
    if (!read_source_key(at, "source", base_, source)) return;
    commands_.push_back({frame_, SetVideo{name, source}, at.place_of("source")});
  }

  void read_view(Section& at) {
    std::string name;
    if (!at.text("view", name)) return;
    const std::optional<render::RayView> view = render::ray_view_named(name);
    if (!view && name != "picture") {
      at.fault("view", fmt::format("is \"{}\", but must be picture, or one of {}", name,
                                   comma_list(render::ray_view_names())));
    }
    add(SetView{view});
  }

  void read_record(Section& at) {
    const TomlValue* value = at.value("record");
    if (value == nullptr) return;
    if (value->kind == TomlValue::Kind::table) {
      const RecordSettings record = read_record_section(*at.table("record"), base_, set_.show);
      if (record.is_empty()) at.fault("record", "names nothing to record: file, exr, fill and key");
      records_ = true;
      add(StartRecording{record});
    } else if (value->kind == TomlValue::Kind::text && value->text == "stop") {
      if (!records_) at.fault("record", "is \"stop\", but nothing is being recorded by then");
      records_ = false;
      add(StopRecording{});
    } else {
      at.fault("record", "must be a table with the keys of a set's [record], or \"stop\"");
    }
  }

  void read_set_change(Section& at) {
    std::string path;
    if (!at.file("set", base_, path)) return;
    try {
      Set changed = read_set(path);
      if (adapt_) adapt_(changed);
      require_same_plate(set_, changed);
      set_ = changed;
      effort_ = changed.effort;
      moved_.clear();
      add(ChangeSet{std::move(changed)});
    } catch (const SetError& error) {
      std::ranges::copy(error.diagnostics(), std::back_inserter(faults_of_sets_));
    } catch (const std::invalid_argument& error) {
      at.fault("set", fmt::format("names {}: {}", path, error.what()));
    }
  }

  std::filesystem::path base_;
  const std::function<void(Set&)>& adapt_;
  Set set_;  // that is on air by then
  render::Effort effort_;
  bool records_;
  std::map<std::string, PlacementSettings> moved_;
  std::map<std::string, Way> ways_;  // the last of each name
  std::optional<Way> quits_;
  std::vector<ScriptedCommand> commands_;
  std::vector<Diagnostic> faults_of_sets_;
  std::int64_t frame_ = 0;
  Place place_;
};

// Files alone: a device may be open already, and need not be there yet.
void try_video(const Set& set, const SetVideo& change) {
  if (capture::is_device(change.uri)) return;
  const auto video = std::ranges::find(set.videos, change.name, &VideoSettings::name);
  if (video == set.videos.end()) return;
  const std::string base = std::filesystem::absolute(set.path).parent_path().string();
  const Source opened(open_video({change.uri, base, video->loop, 0, video->colour}));
}

void check_take(const Set& set,
                const std::optional<RecordSettings>& running,
                const RecordSettings& record,
                const Recording& recording) {
  spare_sources(set, record);
  for (const std::string* written : {&record.file, &record.fill, &record.key}) {
    if (running) spare_take(*running, *written);
  }
  recording.check(record);
}

}  // namespace

Script read_script(const std::string& path,
                   const Set& set,
                   const std::function<void(Set&)>& adapt) {
  Faults faults(path);
  const TomlValue file = read_toml_file(path);
  Section root(file, "", faults);
  std::vector<std::pair<std::int64_t, Section>> tables;
  for (Section& at : root.tables("at")) {
    std::int64_t frame = 0;
    at.need("frame", "from which one on, counted from 0");
    at.integer("frame", frame, std::int64_t{0}, last_frame);
    tables.emplace_back(frame, std::move(at));
  }
  if (tables.empty()) root.need("at", "a script has [[at]] with a frame and what happens then");
  root.finish();
  std::ranges::stable_sort(tables, {}, [](const auto& table) { return table.first; });

  ScriptReader reader(path, set, adapt);
  for (auto& [frame, at] : tables) reader.read(std::move(at), frame);
  std::vector<Diagnostic> diagnostics = faults.sorted();
  std::ranges::copy(reader.faults_of_sets(), std::back_inserter(diagnostics));
  if (!diagnostics.empty()) throw SetError(std::move(diagnostics));
  return {path, reader.take_commands()};
}

std::optional<std::int64_t> end_of(const Script& script) {
  if (script.commands.empty()) return std::nullopt;
  const ScriptedCommand& last = script.commands.back();
  return last.frame + (std::holds_alternative<Quit>(last.what) ? 0 : 1);
}

void check_script(const Script& script,
                  const Set& set,
                  const SetScene& scene,
                  const Recording& recording) {
  std::vector<Diagnostic> faults;
  const Set* on_air = &set;
  const SetScene* of_it = &scene;
  std::optional<SetScene> other;  // what *of_it is after a change
  std::optional<RecordSettings> running;
  if (!set.record.is_empty()) running = set.record;
  std::optional<Place> told;  // of a move: its frames are of one fault
  for (const auto& [frame, what, place] : script.commands) {
    const auto collecting = [&](const auto& act) {
      const auto fault = [&](const std::exception& error) {
        if (told != place) faults.push_back({script.path, place.line, place.column, error.what()});
        told = place;
      };
      try {
        act();
      } catch (const SetError& error) {
        std::ranges::copy(error.diagnostics(), std::back_inserter(faults));
      } catch (const std::invalid_argument& error) {
        fault(error);
      } catch (const std::runtime_error& error) {
        fault(error);
      }
    };
    if (const auto* move = std::get_if<MoveObject>(&what); move != nullptr && of_it != nullptr) {
      const auto named = parts_named(*on_air, move->name);
      if (!named || !named->part) continue;
      collecting([&] { require_part(*on_air, named->object, *named->part, *of_it); });
    } else if (const auto* video = std::get_if<SetVideo>(&what)) {
      collecting([&] { try_video(*on_air, *video); });
    } else if (const auto* start = std::get_if<StartRecording>(&what)) {
      collecting([&] { check_take(*on_air, running, start->record, recording); });
      running = start->record;
    } else if (std::holds_alternative<StopRecording>(what)) {
      running.reset();
    } else if (const auto* change = std::get_if<ChangeSet>(&what)) {
      on_air = &change->set;
      of_it = nullptr;
      collecting([&] { of_it = &other.emplace(describe_scene(change->set)); });
    }
  }
  if (!faults.empty()) throw SetError(std::move(faults));
}

void hold_apart(const Script& script, FrameMaker& maker) {
  std::set<std::string> held;
  for (const ScriptedCommand& command : script.commands) {
    if (std::holds_alternative<ChangeSet>(command.what)) return;
    const auto* move = std::get_if<MoveObject>(&command.what);
    if (move == nullptr || !held.insert(move->name).second) continue;
    const std::optional<NamedParts> named = parts_named(maker.set(), move->name);
    if (!named) continue;
    maker.move_object(move->name,
                      named->part ? PlacementSettings{} : maker.set().objects[named->object].pose);
  }
}

}  // namespace studio
