// The show: a set on air. Commands go in, an immutable status comes out; everything that drives a
// show (command line, window, remote control, tests) uses only these.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "compositing/recorder.h"
#include "render/false_colour.h"
#include "render/renderer.h"
#include "studio/frame_maker.h"
#include "studio/set.h"

namespace studio {

struct SetEffort {
  render::Effort effort;
};
struct StartRecording {
  RecordSettings record;
};
struct StopRecording {};
// An object to a place in the set; or, by the name "OBJECT/PART", its parts whose names begin so by
// a step in the object's own frame from where the model has them.
struct MoveObject {
  std::string name;
  PlacementSettings pose;
};
// What the operator sees in place of the picture, from now on; nothing = the picture. What is
// recorded and sent out stays.
struct SetView {
  std::optional<render::RayView> view;
};
// Another camera or file for one of the set's videos. A live show goes on with the old one until it
// is open.
struct SetVideo {
  std::string name;
  std::string uri;
};
struct SetPaused {
  bool paused = false;
  std::optional<std::chrono::milliseconds> lasting{};  // nothing = until the next such command
};
struct ChangeSet {
  Set set;
};
struct Quit {};
using ShowCommand = std::variant<SetEffort,
                                 StartRecording,
                                 StopRecording,
                                 MoveObject,
                                 SetView,
                                 SetVideo,
                                 SetPaused,
                                 ChangeSet,
                                 Quit>;

// A command that holds from a frame on, whatever the timing: that frame shows it, or the first one
// after it where that is left out.
struct ScriptedCommand {
  std::int64_t frame = 0;
  ShowCommand what;
  Place place;
};
struct Script {
  std::string path;                       // of the file that it is from (script.h)
  std::vector<ScriptedCommand> commands;  // by frame
};

// How the show stands after a frame, or after commands of one that is paused.
struct ShowStatus {
  std::int64_t frames = 0;                    // shown so far
  std::int64_t dropped = 0;                   // left out because the show was late
  std::int64_t frame = -1;                    // number of the last one
  double fps = 0;                             // since the first frame was shown
  double fps_now = 0, delay_now_frames = 0;   // of the last two seconds; the delay's median
  double frame_ms_p50 = 0, frame_ms_p99 = 0;  // from one shown frame to the next
  double first_frame_ms = 0;                  // from the show's making to its first picture
  std::array<double, stages> stage_ms{};      // mean of each stage
  double delay_frames = 0;  // plate's arrival to its picture, in show frames: median
  double delay_frames_p99 = 0;
  render::RenderStatistics statistics;  // sums over all frames
  render::MatchResult match;
  ProbeStatus probe;
  std::vector<PersonStatus> persons;  // of the last frame
  double light_age_frames = 0;        // of the newest shot in the light when it is used: median
  double light_age_frames_p99 = 0;
  std::int64_t kept_light_frames = 0;  // shown with a light that was kept since the probe failed
  float unseen_share = 0;
  float light_error_estimate = 0;
  std::size_t lights = 0;
  std::int64_t lost_plate_frames = 0;
  std::int64_t damaged_plate_frames = 0;
  std::int64_t held_shapes = 0;  // of objects that deform: times that one was not there when due
  std::int64_t display_nan = 0;  // pixels that reached the display without a number
  render::Effort effort;
  double sharpness = 1;             // of the last frame: 0 = coarse, 1 = as the effort asks
  std::array<float, 2> tone{1, 0};  // of the last frame, as render::FrameJob has it
  // What pixels took, by view, in the last frame that had one.
  std::optional<std::array<render::RayViewFigures, render::ray_views>> pixel_figures;
  bool paused = false;
  bool changing = false;  // an edit, or a video's source, is on its way, and not on air yet
  bool recording = false;
  compositing::RecorderStatus recorder;  // of the present or last recording
  bool finished = false;
  std::vector<std::string> notes;  // what went wrong without ending the show; the last ten
  std::int64_t noted = 0;          // notes so far
};

// A finished picture with all that it came from.
struct ShownFrame {
  PreparedFrame prepared;
  std::shared_ptr<const render::FrameResult> result;
  std::shared_ptr<const std::vector<std::uint8_t>> rgb8;       // (height, width, 3) display codes
  std::shared_ptr<const std::vector<std::uint8_t>> view_rgb8;  // the view asked for, or null
  std::vector<std::string> notes;  // all that the show noted since the frame before
};

struct ShowOptions {
  // Paced by the clock, or by a live plate, late frames left out; else every frame is made. A live
  // plate makes the show so.
  bool live = false;
  std::int64_t first = 0;                 // begins with this frame; those before are passed over
  std::optional<std::int64_t> frames;     // show at most so many; nothing = as the set says
  std::optional<capture::Rational> rate;  // in place of the set's
  bool record = true;                     // as the set says, from the first frame on
  Script script;  // before what is posted; without `frames`, shows of a still end with it
  // Of a live show of files: what it is held up for longer is no time of it, and left out is
  // nothing then. Else sources that are read more slowly than time goes by would be later in each
  // frame.
  std::chrono::milliseconds longest_gap{5000};
};

// Opens all that a show of the set would, and looks whether it could be displayed and recorded.
// Shows and writes nothing. Returns what it would note before the first frame. Throws SetError with
// the faults that only this finds.
std::vector<std::string> check_show(const Set& set);

// Inputs of a frame are made on a thread of the show's own while the frame before is rendered on
// the caller's and oneTBB's. When not live, the frames are the same bits whatever the timing.
class Show {
 public:
  // Throws SetError as FrameMaker, also for what cannot be displayed or recorded, and as
  // check_script.
  explicit Show(Set set, ShowOptions options = {});
  Show(const Show&) = delete;
  Show& operator=(const Show&) = delete;
  ~Show();

  // From any thread, at any time. Takes effect with the next frame whose inputs are made.
  void post(ShowCommand command);
  // From any thread; never null.
  std::shared_ptr<const ShowStatus> status() const;

  // Shows frames until the set's end or Quit, then closes the recording. `on_frame` is called after
  // each, on this thread. Once only. Throws what a stage threw for reasons outside the show's
  // power.
  void run(const std::function<void(const ShownFrame&)>& on_frame = {});

  // Paced by the clock or a live plate.
  bool is_live() const;
  // A pixel's width over its height, as the plate tells.
  capture::Rational pixel_aspect() const;
  // Frames that run() will show; nothing if it does not know.
  std::optional<std::int64_t> planned_frames() const;

 private:
  class Stages;
  std::unique_ptr<Stages> stages_;
};

}  // namespace studio
