// platelight run: puts a set on air.
#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "compositing/output_file.h"
#include "studio/commands/commands.h"
#include "studio/commands/interruptible.h"
#include "studio/effort_points.h"
#include "studio/figures.h"
#include "studio/notes.h"
#include "studio/picture_error.h"
#include "studio/picture_file.h"
#include "studio/script.h"
#include "studio/set_files.h"
#include "studio/set_watch.h"
#include "studio/show.h"

namespace studio {
namespace {

struct RunOptions {
  std::string set;
  bool live = false;
  bool watch = false;
  std::optional<std::int64_t> frames;
  std::optional<double> fps;
  std::optional<double> error;
  std::optional<std::int64_t> check_error;
  std::string record;
  std::string exr;
  std::string fill;
  std::string key;
  std::string view;
  std::string view_png;
  std::string script;
};

std::string absolute(const std::string& path) { return std::filesystem::absolute(path).string(); }

void apply_options(const RunOptions& options, Set& set) {
  if (!(options.record + options.exr + options.fill).empty()) {
    for (std::string* place :
         {&set.record.file, &set.record.exr, &set.record.fill, &set.record.key}) {
      place->clear();
    }
  }
  if (!options.record.empty()) set.record.file = absolute(options.record);
  if (!options.exr.empty()) set.record.exr = absolute(options.exr);
  if (!options.fill.empty()) {
    set.record.fill = absolute(options.fill);
    set.record.key = absolute(options.key);
  }
}

// The effort that a chart of the set found best for what was asked.
void choose_effort(const RunOptions& options, Set& set, Console& console) {
  const auto [points, doubt] = read_effort_points(options.set, set.effort);
  if (!doubt.empty()) console.warn(doubt);
  const EffortChoice choice =
      options.fps ? most_accurate_at(points, *options.fps) : fastest_within(points, *options.error);
  const auto& [effort, time_ms, error] = choice.point;
  const std::string chosen = fmt::format(
      "{} rays at edges and glints (contrast {:.3g}, tolerance {:.3g}), {} lights, interleave {}, "
      "accuracy {:.3g}: {:.1f} ms a frame at error {:.2f} %",
      effort.aa_samples, effort.glint_contrast, effort.aa_tolerance, effort.light_samples,
      effort.interleave, effort.accuracy, time_ms, error * 100);
  if (choice.holds) {
    console.say(chosen);
  } else if (options.fps) {
    console.warn(fmt::format("no measured setting holds {} fps here; the fastest is {}",
                             *options.fps, chosen));
  } else {
    console.warn(fmt::format("no measured setting is within {} %; the most accurate is {}",
                             *options.error * 100, chosen));
  }
  set.effort = effort;
}

void report_progress(const ShowStatus& status,
                     std::optional<std::int64_t> planned,
                     Console& console) {
  const double share =
      planned ? static_cast<double>(status.frames) / static_cast<double>(*planned) : 0;
  std::string text = fmt::format("frame {}", status.frames);
  if (planned) text += fmt::format(" of {}", *planned);
  text += fmt::format("  {:.1f} fps  delay {:.1f}", status.fps_now, status.delay_now_frames);
  if (status.dropped > 0) text += fmt::format("  dropped {}", status.dropped);
  if (status.recorder.dropped > 0)
    text += fmt::format("  not recorded {}", status.recorder.dropped);
  if (status.lost_plate_frames > 0) text += fmt::format("  lost {}", status.lost_plate_frames);
  console.progress(share, text);
}

// Tells what goes wrong, each thing once and as soon as the show tells it, and once more after
// every edit. Of those that differ in their numbers alone only the first few, and at the end how
// many more there were.
class Warnings {
 public:
  explicit Warnings(Console& console) : console_(console) {}

  void tell(const ShownFrame& shown, const ShowStatus& status) {
    const std::lock_guard lock(mutex_);
    for (const std::string& what : compositing::errors_of(status.recorder)) tell(what);
    for (const std::string& what : shown.notes) tell(what);
    seen_ += static_cast<std::int64_t>(shown.notes.size());
  }
  // What came after the last frame, and how many were not told.
  void tell_rest(const ShowStatus& status) {
    const std::lock_guard lock(mutex_);
    for (const std::string& what : compositing::errors_of(status.recorder)) tell(what);
    tell_last(status);
    for (const auto& [kind, count] : kinds_) {
      if (count > most_of_kind) {
        console_.warn(fmt::format("{} more like: {}", count - most_of_kind, kind));
      }
    }
  }
  // From any thread: what an edit leads to is told although one before led to it as well.
  void tell_again() {
    const std::lock_guard lock(mutex_);
    told_.clear();
    kinds_.clear();
  }

 private:
  void tell_last(const ShowStatus& status) {
    const std::vector<std::string>& notes = status.notes;
    const auto fresh = static_cast<std::ptrdiff_t>(std::min(
        static_cast<std::size_t>(std::max<std::int64_t>(status.noted - seen_, 0)), notes.size()));
    for (auto note = notes.end() - fresh; note != notes.end(); ++note) tell(*note);
  }
  void tell(const std::string& what) {
    if (std::ranges::find(told_, what) != told_.end()) return;
    told_.push_back(what);
    if (told_.size() > most_told) told_.erase(told_.begin());
    if (++kinds_[kind_of_note(what)] <= most_of_kind) console_.warn(what);
  }

  static constexpr std::size_t most_told = 100;
  static constexpr int most_of_kind = 5;

  Console& console_;
  std::mutex mutex_;
  std::vector<std::string> told_;     // the last of them
  std::map<std::string, int> kinds_;  // how many of each
  std::int64_t seen_ = 0;             // notes of the frames so far
};

// Sections of a set whose changes a running show does not take over.
std::vector<const char*> changed_at_start(const Set& on_air, const Set& changed) {
  std::vector<const char*> sections;
  const DisplayChoice &d = on_air.display, &e = changed.display;
  if (d.display != e.display || d.view != e.view || d.tone != e.tone) sections.push_back("display");
  const RecordSettings &r = on_air.record, &s = changed.record;
  if (r.file != s.file || r.exr != s.exr || r.fill != s.fill || r.key != s.key ||
      r.codec != s.codec || r.crf != s.crf || r.exr_compression != s.exr_compression ||
      r.timecode != s.timecode) {
    sections.push_back("record");
  }
  if (on_air.show.frames != changed.show.frames || on_air.show.sharpen != changed.show.sharpen) {
    sections.push_back("show");
  }
  return sections;
}

void report_end(const ShowStatus& status, Console& console) {
  console.say(fmt::format(
      "{} frames at {:.2f} fps, {} dropped, {} lost in the plate{}; frame time "
      "{:.1f} ms (p99 {:.1f}), delay {:.1f} frames",
      status.frames, status.fps, status.dropped, status.lost_plate_frames,
      status.damaged_plate_frames > 0 ? fmt::format(", {} damaged", status.damaged_plate_frames)
                                      : "",
      status.frame_ms_p50, status.frame_ms_p99, status.delay_frames));
  std::string match;
  for (const float gain : status.match.gain) match += fmt::format(" {:.4g}", gain);
  if (status.match.matrix) {
    match += " (of grey; by the matrix";
    for (const float value : *status.match.matrix) match += fmt::format(" {:.4g}", value);
    match += ")";
  }
  console.say(fmt::format("match{}, {} lights, {:.1f} % of the light unseen", match, status.lights,
                          status.unseen_share * 100));
  if (status.probe.live) {
    console.say(fmt::format(
        "light {:.1f} frames old (p99 {:.1f}) of {} shots a bracket; of {} probe frames {} lost, "
        "{} rejected; {} frames with light that was kept",
        status.light_age_frames, status.light_age_frames_p99, status.probe.shots,
        status.probe.frames, status.probe.lost, status.probe.rejected, status.kept_light_frames));
  }
  if (!status.match.note.empty()) console.say(status.match.note);
  for (const compositing::RecordedOutput& output : status.recorder.outputs) {
    console.say(fmt::format("recorded {} frames to {}", output.written, output.name));
  }
  if (status.recorder.dropped > 0) {
    console.warn(fmt::format("{} frames are not in the recording", status.recorder.dropped));
  }
}

// Throws if what this run writes is something that its show, or a set of its script, is made from
// or records to.
void spare_all(const Set& set, const Script& script, const std::string& written) {
  spare_sources(set, written);
  spare_take(set.record, written);
  const ReadFile file{"the script", script.path};
  if (!script.path.empty()) spare_files(std::span(&file, 1), written);
  for (const ScriptedCommand& command : script.commands) {
    if (const auto* start = std::get_if<StartRecording>(&command.what)) {
      spare_take(start->record, written);
    } else if (const auto* change = std::get_if<ChangeSet>(&command.what)) {
      spare_sources(change->set, written);
    }
  }
}

// Of what a script's sets change.
void warn_of_sections(const Set& set, const Script& script, Console& console) {
  for (const ScriptedCommand& command : script.commands) {
    const auto* change = std::get_if<ChangeSet>(&command.what);
    if (change == nullptr) continue;
    for (const char* section : changed_at_start(set, change->set)) {
      console.warn(fmt::format("{}:{}:{}: [{}] of {} does not count: it is the first set's",
                               script.path, command.place.line, command.place.column, section,
                               change->set.path));
    }
  }
}

void warn_of_rest(const Script& script, const ShowStatus& status, Console& console) {
  const auto rest = std::ranges::find_if(script.commands, [&](const ScriptedCommand& command) {
    return command.frame > status.frame && !std::holds_alternative<Quit>(command.what);
  });
  if (rest == script.commands.end()) return;
  console.warn(
      fmt::format("{}:{}:{}: frame {} was not reached, and nothing of the script from then on",
                  script.path, rest->place.line, rest->place.column, rest->frame));
}

// Of a show that an error ended. That one is to be told, even where these cannot be written.
void write_figures_so_far(const Set& set, const ShowStatus& status, Console& console) {
  try {
    console.figures(show_figures(set, status, {}));
  } catch (const std::exception& error) {
    console.warn(error.what());
  }
}

void run(const RunOptions& options, Console& console) {
  // Before it is read: what is saved while the scene loads is a change.
  std::error_code unreadable;
  const auto saved = std::filesystem::last_write_time(options.set, unreadable);
  Set set = read_set(options.set);
  apply_options(options, set);
  render::Effort of_file = set.effort;
  if (options.fps || options.error) choose_effort(options, set, console);
  const render::Effort effort = set.effort;
  ShowOptions show_options;
  show_options.live = options.live;
  show_options.frames = options.frames;
  if (!options.view_png.empty() && !options.view_png.ends_with(".png"))
    throw UsageError("--view-png names a .png file");
  if (!options.view_png.empty()) compositing::require_writable(options.view_png);
  if (!options.view_png.empty() &&
      compositing::is_one_file(options.view_png, console.figures_file()))
    throw UsageError("--view-png and --json name one file");
  const auto adapt = [&](Set& changed) {
    apply_options(options, changed);
    if (options.fps || options.error) changed.effort = effort;
  };
  Script& script = show_options.script;
  if (!options.script.empty()) script = read_script(options.script, set, adapt);
  for (const std::string& written : {options.view_png, console.figures_file()}) {
    spare_all(set, script, written);
  }
  warn_of_sections(set, script, console);
  if (!options.view.empty()) {
    script.commands.insert(script.commands.begin(),
                           {0, SetView{render::ray_view_named(options.view)}, {}});
  }
  Show show(set, show_options);
  const std::optional<std::int64_t> planned = show.planned_frames();

  Warnings warnings(console);
  std::unique_ptr<SetWatch> watch;
  if (options.watch) {
    watch = std::make_unique<SetWatch>(
        options.set, saved,
        [&](Set changed) {
          const render::Effort now = std::exchange(of_file, changed.effort);
          adapt(changed);
          console.say(fmt::format("{} has changed", options.set));
          warnings.tell_again();
          if ((options.fps || options.error) && of_file != now)
            console.warn("[effort] does not count: --fps or --error has chosen it");
          for (const char* section : changed_at_start(set, changed)) {
            console.warn(fmt::format("[{}] counts from the next start on", section));
          }
          show.post(ChangeSet{std::move(changed)});
        },
        [&](const SetError& error) { console.warn(error.what()); });
  }

  std::unique_ptr<PictureFile> picture;
  if (!options.view_png.empty()) {
    picture = std::make_unique<PictureFile>(
        options.view_png, set.show.width, set.show.height, std::chrono::seconds(1),
        [&](const std::string& why) { console.warn(why + "; the show goes on"); },
        show.pixel_aspect());
  }

  ShownFrame last;
  bool was_interrupted = false;
  try {
    const Interruptible ctrl_c;
    // Also while the show is paused and shows nothing.
    const std::jthread stopping([&](const std::stop_token& done) {
      while (!done.stop_requested() && !ctrl_c.is_interrupted()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
      if (ctrl_c.is_interrupted()) show.post(Quit{});
    });
    show.run([&](const ShownFrame& shown) {
      const auto status = show.status();
      report_progress(*status, planned, console);
      warnings.tell(shown, *status);
      // A show that is not live is there for its recording.
      const bool in_vain = !status->recorder.error.empty() && !show.is_live();
      if (in_vain) show.post(Quit{});
      if (picture) picture->show(shown.view_rgb8 ? shown.view_rgb8 : shown.rgb8);
      last = shown;
    });
    was_interrupted = ctrl_c.is_interrupted();
  } catch (const std::exception&) {
    warnings.tell_rest(*show.status());
    write_figures_so_far(set, *show.status(), console);
    throw;
  }
  watch.reset();

  const ShowStatus status = *show.status();
  warnings.tell_rest(status);
  warn_of_rest(script, status, console);
  report_end(status, console);
  if (status.changing) {
    console.say("the last edit was not on air yet, and is given up");
  }
  std::optional<render::PictureError> error;
  if (options.check_error && last.result) {
    error = error_against(truth_of(last, static_cast<int>(*options.check_error)), last);
    console.say(
        fmt::format("error {:.3f} % (p99 {:.3f} %, delta E {:.2f}) over {} pixels; the "
                    "reference's own noise is {:.3f} %",
                    error->relative_rms * 100, error->p99 * 100, error->delta_e_mean, error->pixels,
                    error->reference_noise * 100));
  }
  console.figures(show_figures(set, status, error));
  if (status.frames == 0 && !was_interrupted && options.script.empty())
    throw std::runtime_error(set.path + ": the show ended before its first picture");
  if (picture) picture->finish();
  std::string errors;
  for (const std::string& error : compositing::errors_of(status.recorder)) {
    errors += (errors.empty() ? "" : "; ") + error;
  }
  if (!errors.empty()) throw std::runtime_error(errors);
}

}  // namespace

Command run_command() {
  return {
      "run", "Put a set on air, and record it",
      "platelight run demo/car.toml --record take.mkv --json run.json",
      [](Arguments& arguments) -> std::function<void(Console&)> {
        auto o = std::make_shared<RunOptions>();
        arguments.positional("SET", o->set, "set file");
        arguments.flag("--live", o->live, "keep to the clock: leave late frames out");
        arguments.option("--frames", o->frames, 1, 100'000'000, "show so many frames");
        arguments.option("--record", o->record,
                         "record video to this .mkv file, which is replaced; the set's [record] "
                         "then names no other");
        arguments.option("--exr", o->exr, "record EXR frames to this directory");
        arguments.option("--fill", o->fill,
                         "record what an external keyer adds to the plate to this .mkv file; "
                         "with --key");
        arguments.option("--key", o->key, "record what of the plate it hides to this .mkv file");
        arguments.option("--script", o->script,
                         "do what this file says at which frame: moves, effort, takes, ...");
        arguments.flag("--watch", o->watch, "take the set file over whenever it changes");
        arguments.option("--check-error", o->check_error, 2, 1 << 20,
                         "render the reference of the last frame with so many samples and "
                         "report the error");
        arguments.option("--fps", o->fps, 0.01, 1000,
                         "the most accurate effort that holds so many frames per second here, "
                         "by the chart of this set");
        arguments.option("--error", o->error, 0, 1,
                         "the fastest effort within this error (.01 = 1 %), by the chart of "
                         "this set");
        arguments.choice("--view", o->view, render::ray_view_names(),
                         "show what pixels take, in false colours, in place of the picture; "
                         "what is recorded stays");
        arguments.option("--view-png", o->view_png,
                         "write what the operator sees to this file, once a second and at the end");
        return [o](Console& console) {
          if (o->fill.empty() != o->key.empty()) {
            throw UsageError("--fill and --key: only both make a pair");
          }
          if (o->fps && o->error) throw UsageError("--fps and --error: only one can be held");
          run(*o, console);
        };
      }};
}

}  // namespace studio
