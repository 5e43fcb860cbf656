// Makes what each frame is rendered from: the show's side before the kernel.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/track.h"
#include "capture/image.h"
#include "render/bounced_light.h"
#include "render/picture_stalls.h"
#include "render/renderer.h"
#include "studio/file_times.h"
#include "studio/leaving.h"
#include "studio/light_feed.h"
#include "studio/person_feed.h"
#include "studio/set.h"
#include "studio/set_scene.h"
#include "studio/shape_feed.h"
#include "studio/source.h"
#include "studio/video_feed.h"

namespace studio {

// Stages of a frame, in their order.
enum class Stage { capture, probe, job, render, display, record };
inline constexpr std::size_t stages = 6;
std::string_view name_of(Stage stage);

// All that a frame is rendered from, and its way so far. Immutable once made.
struct PreparedFrame {
  render::FrameJob job;
  std::shared_ptr<const capture::HalfImage> plate;
  std::shared_ptr<const render::Environment> environment;
  std::shared_ptr<const render::Environment> planned;  // see render::FrameInputs
  std::shared_ptr<const render::Scene> scene;
  std::shared_ptr<const calibrate::DirectionTable> directions;
  std::shared_ptr<const calibrate::Lens> lens;
  std::vector<std::shared_ptr<const render::VideoTexture>> videos;
  std::vector<const render::VideoTexture*> video_frames;  // the same, for inputs()
  render::PictureStalls stalls;                           // of the persons
  std::vector<PersonStatus> persons;                      // of the set, in its order
  std::int64_t held_shapes = 0;    // objects that deform, whose shape is not the one due
  std::vector<std::string> notes;  // what went wrong while it was made
  std::optional<capture::Sound> sound;
  std::chrono::steady_clock::time_point arrived;  // of the plate
  render::MatchResult match;
  ProbeStatus probe;
  double plate_exposure_s = 0;            // 0 = not told
  std::array<double, stages> stage_ms{};  // capture, probe and job are set

  render::FrameInputs inputs() const {
    return {.scene = scene.get(),
            .directions = directions.get(),
            .environment = environment.get(),
            .planned = planned.get(),
            .videos = video_frames,
            .plate = plate.get(),
            .lens = lens.get(),
            .stalls = &stalls};
  }
};

// One thread uses it. All memory across frames (sources, followed light, match) lives here, so the
// frames depend on the set and the commands, and not on timing.
class FrameMaker {
 public:
  // Opens the set's sources and builds its scene. `rate` replaces the set's. `live`: the show does
  // not wait for what comes late; so it is with a live plate. Throws SetError with all faults that
  // only opening shows, each at its place.
  explicit FrameMaker(Set set,
                      std::optional<capture::Rational> rate = std::nullopt,
                      bool live = false);

  // Gives up an edit that is on its way, and the model that is being read for it.
  ~FrameMaker() { given_up_.request_stop(); }
  FrameMaker(const FrameMaker&) = delete;
  FrameMaker& operator=(const FrameMaker&) = delete;

  const Set& set() const { return set_; }
  capture::Rational rate() const { return rate_; }
  const SetScene& set_scene() const { return set_scene_; }
  const Source& plate() const { return *plate_; }
  // Whether the plate is a single picture, so that frames never end by themselves.
  bool is_endless() const;

  // Time of show frame n on the plate's clock.
  capture::Time time_of(std::int64_t frame) const;
  // Frames must ascend. Nothing after the plate's end.
  std::optional<PreparedFrame> make(std::int64_t frame) { return make_at({frame, time_of(frame)}); }

  // A frame and its time on the plate's clock.
  struct Due {
    std::int64_t frame = 0;
    capture::Time time{};
  };
  // Of a live plate: the frame that shows its newest picture. Waits for a picture that has not been
  // due yet, but not for ever: then the last one is due once more, as a later frame. Numbers count
  // the show's frames from the first call on, those included whose pictures were passed over or
  // never came: frame n is n frame times after the first, to a frame and a half.
  Due wait_for_plate();
  // As make(), with a time of its own.
  std::optional<PreparedFrame> make_at(const Due& due);

  // Commands hold from the next frame on, and none waits for an edit that is on its way: they count
  // for that one as well, since they came after it. What cannot be done then, nor by now, is a note
  // of the frame by which the edit is on air.
  void set_effort(const render::Effort& effort) { command({effort}); }
  // Throws std::invalid_argument if no object has that name.
  void move_object(const std::string& name, const PlacementSettings& pose) {
    command({Move{name, pose}});
  }
  // Another source for one of the set's videos. Throws std::invalid_argument if none has that name,
  // std::runtime_error if the source cannot be opened.
  void change_video(const std::string& name, const std::string& uri) {
    command({VideoChange{name, uri}});
  }
  // The same, but a source that is not open yet is opened beside the frames that follow, one after
  // the other; the old one is shown until then, and on where it cannot be opened, which is a note
  // of the next frame. Throws std::invalid_argument.
  void change_video_beside(const std::string& name, const std::string& uri) {
    command({VideoChange{name, uri, true}});
  }
  // Takes over another set file's content. Sources that stay the same run on. Throws SetError and
  // changes nothing if it cannot be used, std::invalid_argument if the picture's size or rate
  // differ.
  void change_set(Set set);
  // The same, but what takes long, the reading of models above all, is done beside the frames that
  // follow, and taken over when it is there. While one, or a video before it, is on its way, only
  // the newest of those that come is kept, and begun then. What goes wrong by then is a note of the
  // next frame.
  void change_set_beside(Set set);
  // Whether an edit or a video is on its way.
  bool is_changing() const { return awaits_edit() || !openings_.empty(); }
  // What the next frame begins with: takes over what is on its way and there by now. For shows that
  // stand still.
  void take_what_is_there();
  // What the next frame would note of edits; it does not then.
  std::vector<std::string> take_notes();

 private:
  // A set that is ready to be taken over.
  struct Change {
    Set set;
    SetScene set_scene;
    std::shared_ptr<render::Scene> scene;
    std::unique_ptr<LightFeed> light;  // null = that of the set before
    std::unique_ptr<PersonFeed> persons;
    std::unique_ptr<VideoFeed> videos;
    std::optional<calibrate::Track> track;
    std::vector<std::string> track_doubts;
    std::shared_ptr<const calibrate::DirectionTable> directions;
    std::shared_ptr<const calibrate::Lens> lens;
  };
  struct Move {
    std::string name;
    PlacementSettings pose;
  };
  struct VideoChange {
    std::string name, uri;
    bool beside = false;
  };
  // What the light of an edit begins with: of the last frame.
  struct Moment {
    capture::Time time{};
    std::shared_ptr<const capture::Image> plate;
    calibrate::Pose cam_from_set;
    double exposure_s = 0;
  };
  // What is asked for while an edit is on its way.
  struct Command {
    std::variant<render::Effort, Move, VideoChange> what;
    std::string why_not{};  // it could not be done so far; "" = it was
  };
  void command(Command command);
  void apply(const Command& command, const VideoFeed* videos_before = nullptr);
  void apply(const Move& move);
  void apply(const VideoChange& change, const VideoFeed* videos_before);
  void show_video(const VideoChange& change, std::shared_ptr<VideoFeed::Player> player);
  void open_next();
  void finish_opening();
  void tell_failure(const VideoChange& change, const std::string& why);
  bool awaits_edit() const { return change_.valid() || next_change_; }
  void begin_next();
  void keep(Command command);
  void repeat_commands(const VideoFeed& videos_before);
  void forget_commands();
  void begin_change(Set set);
  // Beside the frames: of what they use it only reads what does not change. `videos`: those on air.
  Change prepare(Set set, std::uint64_t scene_version, const VideoFeed& videos) const;
  void begin_light(Change& change) const;
  std::optional<Moment> moment() const;
  bool deform_objects(capture::Time time, PreparedFrame& frame);
  render::Scene::Pictures stand_persons(capture::Time time, PreparedFrame& frame);
  void renew_scene(render::Scene::Pictures pictures);
  void check_change(const Set& set) const;
  void take_over(Change change);
  template <class Open>
  void open_once_left(const Open& open) const;
  void finish_change();
  void note_plate(const capture::Frame& frame);
  void note_track(std::vector<std::string> doubts);
  calibrate::Pose pose_at(capture::Time time);
  double place_of(capture::Time time) const;
  std::int64_t number_of(const capture::Frame& picture);
  std::shared_ptr<const capture::HalfImage> half_plate(const capture::Frame& frame);

  Set set_;
  capture::Rational rate_;
  bool live_;
  std::unique_ptr<Source> plate_;
  FileTimes response_times_;  // of the plate's response, when it was opened
  std::unique_ptr<LightFeed> light_;
  std::unique_ptr<VideoFeed> videos_;
  std::unique_ptr<PersonFeed> persons_;
  std::unique_ptr<ShapeFeed> shapes_;
  std::optional<calibrate::Track> track_;
  std::shared_ptr<const render::Scene> scene_;
  render::StallFollower stalls_;
  SetScene set_scene_;
  std::shared_ptr<const calibrate::DirectionTable> directions_;
  std::shared_ptr<const calibrate::Lens> lens_;
  std::vector<render::LocalLight> lamps_;
  render::BounceFollower bounces_;
  std::uint64_t scene_version_ = 0;
  mutable std::mutex moment_mutex_;
  std::optional<Moment> moment_;  // nothing = there was no frame yet
  std::stop_source given_up_;
  Leaving leaving_;                   // of sets before
  std::future<Change> change_;        // on its way
  std::optional<Set> next_change_;    // after that, and after all openings_
  std::vector<Command> commands_;     // since change_ came
  std::size_t of_next_change_ = 0;    // from which of them on they came after next_change_ as well
  std::deque<VideoChange> openings_;  // of one video none twice but the first, which is on its way
  std::future<std::shared_ptr<VideoFeed::Player>> opening_;  // of the first
  std::vector<std::string> notes_;                           // for the next frame
  std::int64_t plate_frames_lost_ = 0;                       // in a row
  bool plate_is_told_gone_ = false, plate_is_told_damaged_ = false, plate_is_cut_short_ = false;
  bool is_off_track_ = false;
  std::vector<std::string> track_doubts_;           // as noted
  std::optional<capture::Time> live_track_begins_;  // beside a live plate
  std::optional<capture::Frame> first_due_;         // of a live plate
  Due last_due_;
  capture::Time last_picture_{};  // stamp of its newest one that was due
  capture::Time plate_delay_{};   // from the stamp of its last picture to its arrival
  std::int64_t uncounted_ = 0;    // frames of the show that a live plate's count leaves out
  std::shared_ptr<const capture::Image> last_image_;  // that last_plate_ was made from
  std::shared_ptr<const capture::HalfImage> last_plate_;
};

}  // namespace studio
