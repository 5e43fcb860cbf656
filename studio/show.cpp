// The loop: inputs on one thread, pictures on another.
#include "studio/show.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <future>
#include <mutex>
#include <thread>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "capture/pool.h"
#include "compositing/display.h"
#include "compositing/exr_sequence.h"
#include "render/kept_transport.h"
#include "studio/display_png.h"
#include "studio/handover.h"
#include "studio/notes.h"
#include "studio/recording.h"
#include "studio/script.h"
#include "studio/set_files.h"
#include "studio/sharpening.h"
#include "studio/tally.h"
#include "studio/tone_follower.h"

namespace studio {
namespace {

using Clock = std::chrono::steady_clock;

// How often a show that stands still looks for an edit that is on its way.
constexpr std::chrono::milliseconds look_again{20};

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};

// What the recording is to do from a frame on.
using RecorderCommand = std::variant<StartRecording, StopRecording>;

// Throws SetError at `place` for what goes wrong in `make`.
template <class Make>
auto at_place(const Set& set, Place place, const Make& make) {
  try {
    return make();
  } catch (const std::runtime_error& error) {
    throw SetError({{set.path, place.line, place.column, error.what()}});
  } catch (const std::invalid_argument& error) {
    throw SetError({{set.path, place.line, place.column, error.what()}});
  }
}

std::shared_ptr<const compositing::Display> make_display(const Set& set) {
  return at_place(set, set.display.place, [&] {
    return std::make_shared<const compositing::Display>(display_settings(set));
  });
}

RecordingForm form_of(const FrameMaker& maker,
                      std::shared_ptr<const compositing::Display> display) {
  const Set& set = maker.set();
  const capture::CameraInfo& plate = maker.plate().info();
  const bool srgb = display_settings(set).display == "sRGB";
  return {set.show.width,       set.show.height,
          maker.rate(),         srgb ? capture::Transfer::srgb : capture::Transfer::rec1886,
          plate.sound_channels, plate.sound_rate,
          plate.pixel_aspect,   std::move(display)};
}

}  // namespace

class Show::Stages {
 public:
  Stages(Set set, const ShowOptions& options)
      : options_(options),
        maker_(std::move(set), options.rate, options.live),
        display_(make_display(maker_.set())),
        pixel_aspect_(maker_.plate().info().pixel_aspect),
        recording_(form_of(maker_, display_)) {
    const Set& s = maker_.set();
    if (maker_.plate().is_live()) options_.live = true;
    if (options_.live) tally_.set_period_ms(1000 / maker_.rate().value());
    if (s.display.tone) tone_.emplace(*s.display.tone);
    if (s.show.sharpen.value_or(options_.live)) {
      sharpening_.emplace(maker_.rate(), options_.live);
    }
    frames_ = options.frames ? options.frames : s.show.frames;
    check_script(options.script, s, maker_.set_scene(), recording_);
    hold_apart(options.script, maker_);
    if (!frames_ && !options_.live && maker_.is_endless()) {
      frames_ = std::max<std::int64_t>(end_of(options.script).value_or(0) - options.first, 1);
    }
    planned_frames_ = frames_ ? frames_ : frames_of_plate();
    if (options.record && !s.record.is_empty()) {
      at_place(s, s.record.place, [&] {
        spare_sources(s, s.record);
        start_recording(s.record);
      });
    }
    tally_.status().effort = s.effort;
    publish(false);
  }

  bool is_live() const { return options_.live; }
  capture::Rational pixel_aspect() const { return pixel_aspect_; }
  std::optional<std::int64_t> planned_frames() const { return planned_frames_; }

  void post(ShowCommand command) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(std::move(command));
    posted_.notify_all();
  }

  std::shared_ptr<const ShowStatus> status() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }

  void run(const std::function<void(const ShownFrame&)>& on_frame) {
    std::future<void> inputs = std::async(std::launch::async, [this] { make_inputs(); });
    {
      const Ending ending{*this};  // however this ends, the other thread must not wait for ever
      while (std::optional<Work> work = work_.take()) {
        const Clock::time_point begin = Clock::now();
        show_frame(std::move(*work), on_frame);
        rendering_ = (Clock::now() - begin).count();
      }
    }
    recording_.stop();
    recording_.finish();
    inputs.wait();
    changing_ = maker_.is_changing();
    publish(true);
    inputs.get();
  }

 private:
  // What travels from the thread that makes inputs to the one that makes pictures.
  struct Work {
    PreparedFrame frame;
    std::int64_t dropped = 0;  // frames left out so far
    capture::CameraStatistics plate;
    std::optional<render::RayView> view;
    std::vector<RecorderCommand> recorder;  // before this frame
  };

  struct Closing {
    Handover<Work>& work;
    ~Closing() { work.close(); }
  };

  struct Ending {
    Stages& stages;
    ~Ending() {
      stages.post(Quit{});  // it may be paused
      stages.work_.close();
    }
  };

  std::optional<std::int64_t> frames_of_plate() const {
    const capture::CameraInfo& plate = maker_.plate().info();
    if (plate.frames <= 0 || plate.rate.num <= 0 || maker_.is_endless()) return std::nullopt;
    const std::int64_t left = plate.frames - maker_.set().camera.frame.value_or(0);
    const double seconds = static_cast<double>(left) / plate.rate.value();
    return std::llround(seconds * maker_.rate().value());
  }

  // On the thread that makes inputs.

  void make_inputs() {
    const Closing closing{work_};
    const Clock::time_point start = Clock::now();
    std::int64_t made = 0;
    std::int64_t dropped = 0;
    for (std::int64_t number = options_.first; !frames_ || made < *frames_; ++number, ++made) {
      Work work;
      if (!apply_script(number, work) || !apply_commands(work)) return;
      const FrameMaker::Due due = next_due(number, start + paused_for_);
      if (!apply_script(due.frame, work)) return;  // where frames were left out
      dropped += due.frame - number;
      number = due.frame;
      const Clock::time_point begin = Clock::now();
      std::optional<PreparedFrame> frame = maker_.make_at(due);
      if (!frame) {
        if (frames_) note(ended_early(made));
        return;
      }
      const Clock::duration making = Clock::now() - begin;
      work.frame = std::move(*frame);
      work.dropped = dropped;
      work.view = view_;
      work.plate = maker_.plate().statistics();
      if (!work_.give(std::move(work))) return;
      // What is made sooner than it can be rendered only waits, and grows old. The first frame is
      // rendered with nothing kept, several times as long as the next ones.
      if (made == 0 && !work_.wait_for_taker()) return;
      if (!work_.wait_for_taker(start_of_next(making))) return;
    }
  }

  std::string ended_early(std::int64_t made) const {
    return "the plate ended after " + std::to_string(made) + " of " + std::to_string(*frames_) +
           " frames: with camera.loop it begins again";
  }

  // When the frame after the one just taken is to be begun, so that it is ready in time if
  // rendering and making take as long as last time.
  Clock::time_point start_of_next(Clock::duration making) const {
    constexpr double margin = 1.5;
    const auto early = std::chrono::duration_cast<Clock::duration>(margin * making);
    return Clock::now() + Clock::duration(rendering_.load()) - early;
  }

  // The frame that is to be made in the place of `number`: in a live show a later one where that
  // is late. Waits for its time, or for the picture of a live plate.
  FrameMaker::Due next_due(std::int64_t number, Clock::time_point start) {
    if (maker_.plate().is_live()) {
      FrameMaker::Due due = maker_.wait_for_plate();
      while (due.frame < options_.first) due = maker_.wait_for_plate();
      return due;
    }
    if (options_.live) number = wait_until_due(number, start);
    return {number, maker_.time_of(number)};
  }

  // Waits for a live frame's time. A frame whose successor is due as well is left out: returns the
  // one that is to be made.
  std::int64_t wait_until_due(std::int64_t number, Clock::time_point start) {
    const auto due = [&](std::int64_t n) {
      return start + capture::time_of_frame(n - options_.first, maker_.rate());
    };
    if (const Clock::duration late = Clock::now() - due(number); late > options_.longest_gap) {
      start += late;
      paused_for_ += late;
      note(fmt::format("held up for {:.1f} s before frame {}: the show goes on where it was",
                       std::chrono::duration<double>(late).count(), number));
    }
    while (Clock::now() >= due(number + 1)) ++number;
    std::this_thread::sleep_until(due(number));
    return number;
  }

  // What the script has up to a frame. False on Quit.
  bool apply_script(std::int64_t frame, Work& work) {
    std::vector<ScriptedCommand>& commands = options_.script.commands;
    for (; scripted_ < commands.size() && commands[scripted_].frame <= frame; ++scripted_) {
      if (std::holds_alternative<Quit>(commands[scripted_].what)) return false;
      apply(commands[scripted_].what, work);
    }
    return true;
  }

  // Takes what was posted. Waits while paused, and takes over what is on its way when it is there.
  // False on Quit.
  bool apply_commands(Work& work) {
    while (true) {
      std::vector<ShowCommand> commands;
      {
        std::unique_lock lock(mutex_);
        if (paused_) {
          const Clock::time_point before = Clock::now();
          const auto any = [&] { return !commands_.empty(); };
          if (maker_.is_changing() || pause_ends_) {
            posted_.wait_for(lock, look_again, any);
          } else {
            posted_.wait(lock, any);
          }
          const Clock::time_point now = Clock::now();
          paused_for_ += now - before;
          if (pause_ends_ && now >= *pause_ends_) pause(false);
        }
        commands = std::exchange(commands_, {});
      }
      for (ShowCommand& command : commands) {
        if (std::holds_alternative<Quit>(command)) return false;
        apply(command, work);
      }
      if (paused_) {
        maker_.take_what_is_there();
        for (std::string& what : maker_.take_notes()) note(std::move(what));
      }
      changing_ = maker_.is_changing();
      if (!paused_) return true;
      publish_pause();
    }
  }

  void pause(bool paused, std::optional<std::chrono::milliseconds> lasting = {}) {
    paused_ = paused;
    pause_ends_.reset();
    if (paused && lasting) pause_ends_ = Clock::now() + *lasting;
  }

  // A live show goes on while models are read and videos opened; in others frames depend on no
  // timing.
  void change_set(Set set) {
    if (options_.live) {
      maker_.change_set_beside(std::move(set));
    } else {
      maker_.change_set(std::move(set));
    }
  }

  void change_video(const SetVideo& video) {
    if (options_.live) {
      maker_.change_video_beside(video.name, video.uri);
    } else {
      maker_.change_video(video.name, video.uri);
    }
  }

  void apply(ShowCommand& command, Work& work) {
    noting([&] {
      std::visit(
          Overloaded{[&](const SetEffort& c) { maker_.set_effort(c.effort); },
                     [&](const StartRecording& c) {
                       spare_sources(maker_.set(), c.record);
                       work.recorder.emplace_back(c);
                     },
                     [&](const StopRecording& c) { work.recorder.emplace_back(c); },
                     [&](const MoveObject& c) { maker_.move_object(c.name, c.pose); },
                     [&](const SetView& c) { view_ = c.view; },
                     [&](const SetVideo& c) { change_video(c); },
                     [&](const SetPaused& c) { pause(c.paused, c.lasting); },
                     [&](ChangeSet& c) { change_set(std::move(c.set)); }, [](const Quit&) {}},
          command);
    });
  }

  // On the caller's thread.

  void show_frame(Work work, const std::function<void(const ShownFrame&)>& on_frame) {
    for (const RecorderCommand& command : work.recorder) apply(command);
    ShownFrame shown;
    shown.prepared = std::move(work.frame);
    const std::shared_ptr<render::FrameResult> result = results_.lend();
    set_tone(shown.prepared.job);
    timed(shown, Stage::render, [&] {
      render::FrameInputs inputs = shown.prepared.inputs();
      inputs.kept = &kept_;
      inputs.count_rays = work.view.has_value();
      render::FrameJob& job = shown.prepared.job;
      const capture::HalfImage& plate = *shown.prepared.plate;
      if (sharpening_) {
        render_sharpening(*sharpening_, inputs, job, plate, *result);
        tally_.status().sharpness = sharpening_->share();
        note_sharpness();
      } else {
        render::render_frame(inputs, job, plate, *result);
      }
    });
    shown.result = result;

    const auto rgb8 = pictures_.lend();
    timed(shown, Stage::display, [&] {
      const capture::HalfImage& rgba = result->rgba;
      rgb8->resize(rgba.pixels.size() / 4 * 3);
      follow_tone(rgba, shown.prepared.job);
      const compositing::ToneCurve curve = compositing::curve_of(shown.prepared.job.tone);
      tally_.status().display_nan += display_->to_rgb8(rgba, *rgb8, curve);
      if (work.view) shown.view_rgb8 = draw_view(result->rays, *work.view);
    });
    shown.rgb8 = rgb8;
    const Clock::time_point displayed = Clock::now();

    timed(shown, Stage::record, [&] { recording_.record(shown, !options_.live); });
    note_probe(shown.prepared);
    for (const std::string& what : shown.prepared.notes) note(what);
    tally_.add(shown, displayed);
    tally_.status().dropped = work.dropped;
    tally_.status().lost_plate_frames = work.plate.lost;
    tally_.status().damaged_plate_frames = work.plate.damaged;
    publish(false);
    shown.notes = notes_.take_new();
    if (on_frame) on_frame(shown);
  }

  // The curve by the pictures before this frame, so that it goes with all tiles of the job.
  void set_tone(render::FrameJob& job) const {
    const auto curve = tone_ ? tone_->curve() : std::nullopt;
    if (curve) job.tone = compositing::parameters_of(*curve);
  }

  // For the next frame; where there was none before, for this one too.
  void follow_tone(const capture::HalfImage& rgba, render::FrameJob& job) {
    if (!tone_) return;
    const bool first = !tone_->curve();
    tone_->follow(compositing::measure_levels(rgba), job.time);
    if (first) set_tone(job);
  }

  std::shared_ptr<const std::vector<std::uint8_t>> draw_view(const render::RayCounts& counts,
                                                             render::RayView view) {
    const auto rgb8 = pictures_.lend();
    rgb8->resize(counts.pixels.size() * 3);
    render::draw_false_colour(counts, view, *rgb8);
    render::draw_legend(view, counts.width, counts.height, *rgb8);
    tally_.status().pixel_figures = render::figures_of(counts);
    return rgb8;
  }

  // Once whenever the light ceases to be renewed.
  void note_sharpness() {
    if (sharpening_->lost_share() > 0) stays_coarse_ = false;
    const std::string why = sharpening_->why_coarse();
    if (!why.empty() && !std::exchange(stays_coarse_, true)) note(why);
  }

  void note_probe(const PreparedFrame& frame) {
    const std::string& why = frame.probe.kept_because;
    if (!why.empty() && light_kept_because_.empty()) {
      note("from frame " + std::to_string(frame.job.frame) +
           " on the last good light stays: " + why);
    }
    light_kept_because_ = why;
    const std::int64_t refused = frame.probe.refused;
    if (refused > 0 && refused_exposures_ == 0) {
      note("by frame " + std::to_string(frame.job.frame) +
           " the probe's camera has refused an exposure: " + frame.probe.refusal);
    }
    refused_exposures_ = refused;
  }

  template <class Act>
  static void timed(ShownFrame& shown, Stage stage, const Act& act) {
    const Clock::time_point start = Clock::now();
    act();
    const std::chrono::duration<double, std::milli> ms = Clock::now() - start;
    shown.prepared.stage_ms[static_cast<std::size_t>(stage)] = ms.count();
  }

  void start_recording(const RecordSettings& record) {
    const std::int64_t before =
        record.exr.empty() ? 0 : compositing::ExrSequence::frames_in(record.exr);
    std::vector<std::string> replaced;
    for (const std::string& file : {record.file, record.fill, record.key}) {
      std::error_code none;  // where nothing is there
      const auto size = std::filesystem::file_size(file, none);
      if (!none && size > 0) replaced.push_back(file);
    }
    recording_.start(record);
    for (const std::string& file : replaced) {
      note(file + " was there already: it is replaced from the first frame on");
    }
    if (before == 0) return;
    note(record.exr + " has " + std::to_string(before) +
         " frames already: those with numbers that are not recorded now stay among them");
  }

  void apply(const RecorderCommand& command) {
    noting([&] {
      if (const auto* start = std::get_if<StartRecording>(&command)) {
        start_recording(start->record);
      } else {
        recording_.stop();
      }
      if (!options_.live) recording_.finish();  // its frames depend on no timing
    });
  }

  void publish(bool finished) {
    const std::lock_guard publishing(publishing_);
    ShowStatus& status = tally_.status();
    status.finished = finished;
    status.recording = recording_.running();
    status.recorder = recording_.status();
    for (std::string& what : recording_.take_notes()) note(std::move(what));
    publish(status);
  }

  // On either thread.

  // Of a show that stands still: no frame comes that would tell it.
  void publish_pause() {
    const std::lock_guard publishing(publishing_);
    ShowStatus status = *this->status();
    publish(status);
  }

  // While publishing_ is held.
  void publish(ShowStatus& status) {
    status.paused = paused_;
    status.changing = changing_;
    std::tie(status.notes, status.noted) = notes_.told();
    auto told = std::make_shared<const ShowStatus>(status);
    const std::lock_guard lock(mutex_);
    status_.swap(told);
  }

  // What a command cannot do is noted, and the show goes on.
  template <class Act>
  void noting(const Act& act) {
    try {
      act();
    } catch (const std::exception& error) {
      note(error.what());
    }
  }

  void note(std::string what) { notes_.add(std::move(what)); }

  ShowOptions options_;  // live wherever the plate is
  std::optional<std::int64_t> frames_;
  std::optional<std::int64_t> planned_frames_;

  // Of the caller's thread.
  Tally tally_;
  std::optional<ToneFollower> tone_;
  std::optional<Sharpening> sharpening_;
  render::KeptTransport kept_;
  bool stays_coarse_ = false;
  std::string light_kept_because_;
  std::int64_t refused_exposures_ = 0;  // of the probe's camera, by the last frame
  capture::Pool<render::FrameResult> results_;
  capture::Pool<std::vector<std::uint8_t>> pictures_;

  // Of the thread that makes inputs, once it runs.
  FrameMaker maker_;
  std::optional<render::RayView> view_;
  std::size_t scripted_ = 0;  // commands of the script that were taken
  Clock::duration paused_for_{};
  std::optional<Clock::time_point> pause_ends_;

  // Of the caller's thread.
  std::shared_ptr<const compositing::Display> display_;
  capture::Rational pixel_aspect_;
  Recording recording_;

  // Shared.
  mutable std::mutex mutex_;
  std::condition_variable posted_;
  std::vector<ShowCommand> commands_;
  Notes notes_;
  std::mutex publishing_;  // before mutex_
  std::atomic<bool> paused_ = false;
  std::atomic<bool> changing_ = false;
  std::atomic<Clock::rep> rendering_ = 0;  // how long the last frame took from hand to hand
  Handover<Work> work_;
  std::shared_ptr<const ShowStatus> status_;  // what was published last; by mutex_
};

std::vector<std::string> check_show(const Set& set) {
  std::vector<Diagnostic> faults;
  const auto collecting = [&](const auto& act) {
    try {
      act();
    } catch (const SetError& error) {
      faults.insert(faults.end(), error.diagnostics().begin(), error.diagnostics().end());
    }
  };
  std::shared_ptr<const compositing::Display> display;
  std::optional<FrameMaker> maker;
  collecting([&] { display = make_display(set); });
  collecting([&] { maker.emplace(set); });
  if (display && maker && !set.record.is_empty()) {
    collecting([&] {
      at_place(set, set.record.place, [&] {
        spare_sources(set, set.record);
        Recording(form_of(*maker, display)).check(set.record);
      });
    });
  }
  if (!faults.empty()) throw SetError(std::move(faults));
  return maker->take_notes();
}

Show::Show(Set set, ShowOptions options)
    : stages_(std::make_unique<Stages>(std::move(set), options)) {}
Show::~Show() = default;

void Show::post(ShowCommand command) { stages_->post(std::move(command)); }
std::shared_ptr<const ShowStatus> Show::status() const { return stages_->status(); }
void Show::run(const std::function<void(const ShownFrame&)>& on_frame) { stages_->run(on_frame); }
capture::Rational Show::pixel_aspect() const { return stages_->pixel_aspect(); }
bool Show::is_live() const { return stages_->is_live(); }
std::optional<std::int64_t> Show::planned_frames() const { return stages_->planned_frames(); }

}  // namespace studio
