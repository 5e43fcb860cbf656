// Inputs of frames.
#include "studio/frame_maker.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "calibrate/track_check.h"
#include "studio/set_scene.h"
#include "studio/show_inputs.h"

namespace studio {
namespace {

using Clock = std::chrono::steady_clock;

constexpr capture::Rational rate_of_stills{25, 1};
// Frames by which a live plate's own count may differ from its clock.
constexpr double most_parted = 1.5;
constexpr double of_rounding = 1e-4;  // cameras tell rates to a few digits

// Measures a stage from its making to its end.
class StageTimer {
 public:
  StageTimer(PreparedFrame& frame, Stage stage)
      : ms_(&frame.stage_ms[static_cast<std::size_t>(stage)]), start_(Clock::now()) {}
  ~StageTimer() { *ms_ = std::chrono::duration<double, std::milli>(Clock::now() - start_).count(); }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  double* ms_;
  Clock::time_point start_;
};

double seconds(capture::Time time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

std::string_view name_of(Stage stage) {
  switch (stage) {
    case Stage::capture:
      return "capture";
    case Stage::probe:
      return "probe";
    case Stage::job:
      return "job";
    case Stage::render:
      return "render";
    case Stage::display:
      return "display";
    case Stage::record:
      return "record";
  }
  return "";
}

FrameMaker::FrameMaker(Set set, std::optional<capture::Rational> rate, bool live)
    : set_(std::move(set)), live_(live) {
  // Beside all else: the probe's pictures take the longest.
  std::future<std::unique_ptr<LightFeed>> light =
      std::async(std::launch::async, [this] { return std::make_unique<LightFeed>(set_); });
  Faults faults(set_.path);
  const auto collecting = [&](const auto& act) {
    try {
      act();
    } catch (const SetError& error) {
      for (const Diagnostic& d : error.diagnostics()) faults.add({d.line, d.column}, d.message);
    }
  };
  response_times_ = file_times({set_.camera.response});
  collecting([&] { plate_ = open_plate(set_); });
  collecting([&] { track_ = track_of(set_); });
  collecting([&] { directions_ = directions_of(set_); });
  lens_ = std::make_shared<calibrate::Lens>(lens_of(set_));
  // What else has faults is found without a plate too.
  const capture::Time start = plate_ ? plate_->first().time : capture::Time{};
  const bool live_plate = plate_ && plate_->is_live();
  collecting([&] { videos_ = std::make_unique<VideoFeed>(set_, start, live_plate); });
  collecting([&] { persons_ = std::make_unique<PersonFeed>(set_, start, live_plate); });
  collecting([&] {
    set_scene_ = describe_scene(set_);
    if (persons_) scene_ = compile(set_, *persons_, set_scene_, ++scene_version_);
    if (videos_) videos_->place(set_, set_scene_);
  });
  collecting([&] { light_ = light.get(); });
  if (const auto all = faults.sorted(); !all.empty()) throw SetError(all);
  if (track_) note_track(calibrate::doubts_of(*track_));
  if (!plate_->info().doubt.empty()) notes_.push_back("the plate: " + plate_->info().doubt);

  const capture::Rational plate_rate = plate_->info().rate;
  const capture::Rational own = plate_rate.num > 0 ? plate_rate : rate_of_stills;
  rate_ = rate.value_or(set_.show.fps.value_or(own));
  // A live plate shows no more pictures than there are.
  if (plate_->is_live() && plate_rate.num > 0 &&
      rate_.value() > plate_rate.value() * (1 + of_rounding)) {
    notes_.push_back(fmt::format(
        "the show has {:.6g} frames a second, as many as its plate: {:.6g} were asked for",
        plate_rate.value(), rate_.value()));
    rate_ = plate_rate;
  }
  live_ = live_ || live_plate;
  shapes_ = std::make_unique<ShapeFeed>(set_, set_scene_, rate_, start, live_);
  lamps_ = describe_lamps(set_);
}

bool FrameMaker::is_endless() const { return plate_->is_still() || set_.camera.loop; }

capture::Time FrameMaker::time_of(std::int64_t frame) const {
  return plate_->first().time + capture::time_of_frame(frame, rate_);
}

std::shared_ptr<const capture::HalfImage> FrameMaker::half_plate(const capture::Frame& frame) {
  if (frame.image == last_image_ && last_plate_ != nullptr) return last_plate_;
  auto plate = std::make_shared<capture::HalfImage>();
  if (frame.image != nullptr) {
    *plate = capture::to_half(*frame.image);
  } else {  // nothing has ever arrived
    *plate = capture::to_half(capture::make_image(set_.show.height, set_.show.width));
  }
  last_image_ = frame.image;
  last_plate_ = std::move(plate);
  return last_plate_;
}

// Where a time lies among the show's frames of a live plate: whole numbers are frames.
double FrameMaker::place_of(capture::Time time) const {
  return seconds(time - first_due_->time) * rate_.value();
}

// The number of a live plate's picture. Cameras count more evenly than they stamp; but where count
// and clock part, since pictures come at another rate than the camera says, or none came for a
// while, the clock is right.
std::int64_t FrameMaker::number_of(const capture::Frame& picture) {
  const double place = place_of(picture.time);
  std::int64_t counted = picture.number - first_due_->number + uncounted_;
  const bool parted = std::abs(static_cast<double>(counted) - place) > most_parted;
  if (parted || rate_ != plate_->info().rate) {
    uncounted_ += std::llround(place) - counted;
    counted = std::llround(place);
  }
  return std::max(counted, last_due_.frame + 1);
}

FrameMaker::Due FrameMaker::wait_for_plate() {
  const capture::Time period = capture::time_of_frame(1, rate_);
  const capture::Time patience = 5 * period / 2;
  const capture::Time until = capture::monotonic_now() + patience;
  if (!first_due_) {
    first_due_ = plate_->wait_for_newer(until);
    last_due_ = {0, first_due_->time};
    last_picture_ = first_due_->time;
    return last_due_;
  }
  // The camera may be the faster one. If it is not, each of its pictures is due, however unevenly
  // they are stamped.
  const double told = plate_->info().rate.value();
  const bool own_rate = std::abs(rate_.value() - told) <= of_rounding * told;
  capture::Time soonest =
      own_rate ? last_picture_ + capture::Time{1} : last_due_.time + 3 * period / 4;
  while (true) {
    const capture::Frame newest = plate_->wait_for_newer(until, soonest);
    if (newest.time < soonest) break;
    const std::int64_t number = number_of(newest);
    if (static_cast<double>(number) - place_of(newest.time) <= most_parted) {
      // Time never falls, though a frame without a picture was ahead of this one's.
      last_due_ = {number, std::max(newest.time, last_due_.time + capture::Time{1})};
      last_picture_ = newest.time;
      return last_due_;
    }
    soonest = newest.time + capture::Time{1};  // one picture too many
  }
  // Before the stamp of a picture that comes now, or later ones would come too late for ever.
  const capture::Time time =
      std::max(last_due_.time + period, capture::monotonic_now() - plate_delay_ - period);
  last_due_ = {std::max<std::int64_t>(std::llround(place_of(time)), last_due_.frame + 1), time};
  return last_due_;
}

std::optional<PreparedFrame> FrameMaker::make_at(const Due& due) {
  const auto [number, time] = due;
  PreparedFrame prepared;
  prepared.arrived = Clock::now();
  take_what_is_there();

  std::optional<capture::Frame> frame;
  std::vector<VideoFrame> videos;
  {
    const StageTimer timer(prepared, Stage::capture);
    frame = plate_->at(time + plate_->info().jitter);
    if (!frame) return std::nullopt;
    note_plate(*frame);
    // A picture is of the camera's place then; a still stands for all times.
    prepared.job.cam_from_set = pose_at(plate_->is_still() ? time : frame->time);
    if (plate_->is_live()) {
      if (frame->status != capture::FrameStatus::lost) {
        plate_delay_ = std::max(plate_->arrived() - frame->time, capture::Time{});
      }
      prepared.arrived =
          Clock::time_point(std::chrono::duration_cast<Clock::duration>(plate_->arrived()));
    }
    prepared.plate = half_plate(*frame);
    prepared.plate_exposure_s =
        frame->exposure_s > 0 ? frame->exposure_s : set_.camera.exposure_s.value_or(0);
    const capture::Time next = time + capture::time_of_frame(1, rate_);
    plate_->read_sound_to(next);
    prepared.sound = plate_->take_sound(next);
    videos = videos_->at(time, *frame);
    prepared.notes = videos_->take_notes();
  }

  render::FrameJob& job = prepared.job;
  Light light;
  {
    const StageTimer timer(prepared, Stage::probe);
    light = light_->at({time, frame->image.get(), directions_.get(), job.cam_from_set,
                        prepared.plate_exposure_s, set_.effort.light_samples, plate_->is_live()});
    std::ranges::move(take_notes(), std::back_inserter(prepared.notes));
    const std::lock_guard lock(moment_mutex_);
    moment_ = {time, frame->image, job.cam_from_set, prepared.plate_exposure_s};
  }

  {
    const StageTimer timer(prepared, Stage::job);
    job.frame = number;
    job.time = time;
    const bool deformed = deform_objects(time, prepared);
    if (!persons_->empty()) {
      renew_scene(stand_persons(time, prepared));
    } else if (deformed) {
      renew_scene(scene_->pictures());
    }
    job.scene_version = scene_->description().version;
    job.effort = set_.effort;
    job.textures = {{0, frame->time}, {1, light.time}};
    job.lights = std::move(light.table);
    job.lights.lamps.insert(job.lights.lamps.end(), lamps_.begin(), lamps_.end());
    const auto shining = videos_->lamps(videos);
    job.lights.lamps.insert(job.lights.lamps.end(), shining.begin(), shining.end());
    const auto bounced = bounces_.follow(*scene_, job.lights, {.lamps = job.effort.bounce_lamps});
    job.lights.lamps.insert(job.lights.lamps.end(), bounced.begin(), bounced.end());
    for (VideoFrame& video : videos) {
      job.textures.push_back({static_cast<std::uint32_t>(job.textures.size()), video.time});
      prepared.video_frames.push_back(video.texture.get());
      prepared.videos.push_back(std::move(video.texture));
    }
    job.match = render::matrix_of(light.match);
    prepared.match = std::move(light.match);
    prepared.probe = std::move(light.probe);
    prepared.environment = std::move(light.environment);
    prepared.planned = std::move(light.planned);
    prepared.scene = scene_;
    prepared.stalls = stalls_.follow(scene_->places());
    prepared.directions = directions_;
    prepared.lens = lens_;
  }
  return prepared;
}

std::vector<std::string> FrameMaker::take_notes() {
  std::vector<std::string> notes = std::exchange(notes_, {});
  std::ranges::move(std::exchange(set_scene_.notes, {}), std::back_inserter(notes));
  std::ranges::move(light_->take_notes(), std::back_inserter(notes));
  return notes;
}

// Tells of the first of frames that are lost in a row, of rows that are long, and of their ends.
void FrameMaker::note_plate(const capture::Frame& frame) {
  constexpr double long_s = 1;
  const bool lost = frame.status == capture::FrameStatus::lost;
  const auto why = [&] { return frame.note.empty() ? "" : ": " + frame.note; };
  const double lost_s = rate_.num > 0 ? static_cast<double>(plate_frames_lost_) / rate_.value() : 0;
  if (lost && plate_frames_lost_ == 0) {
    notes_.push_back(fmt::format("the plate's frame {} is lost{}", frame.number, why()));
    plate_is_told_gone_ = false;
  } else if (lost && lost_s >= long_s && !plate_is_told_gone_) {
    notes_.push_back(fmt::format("the plate is gone, and its last picture stays{}", why()));
    plate_is_told_gone_ = true;
  } else if (!lost && plate_is_told_gone_) {
    notes_.push_back(fmt::format("the plate is back after {:.1f} s", lost_s));
    plate_is_told_gone_ = false;
  }
  plate_frames_lost_ = lost ? plate_frames_lost_ + 1 : 0;
  if (frame.status == capture::FrameStatus::damaged && !plate_is_told_damaged_) {
    notes_.push_back(fmt::format("the plate's frame {} is damaged{}", frame.number, why()));
    plate_is_told_damaged_ = true;
  }
  if (plate_->is_live() || plate_is_cut_short_) return;
  const std::string how = plate_->statistics().cut_short;
  plate_is_cut_short_ = !how.empty();
  if (plate_is_cut_short_) notes_.push_back("the plate: " + how);
}

// Notes what is to be doubted of the camera's track, unless it was noted before.
void FrameMaker::note_track(std::vector<std::string> doubts) {
  if (doubts == track_doubts_) return;
  for (const std::string& doubt : doubts) {
    notes_.push_back(
        fmt::format("the camera's track is doubtful: {} ({})", doubt, set_.camera.pose.track));
  }
  track_doubts_ = std::move(doubts);
}

calibrate::Pose FrameMaker::pose_at(capture::Time time) {
  if (!track_) return set_.camera.pose.cam_from_set;
  // A track begins with a live plate, as with a file.
  if (plate_->is_live() && !live_track_begins_) live_track_begins_ = time;
  const double time_s = seconds(time - live_track_begins_.value_or(capture::Time{}));
  const calibrate::TrackedPose at = calibrate::pose_at(*track_, time_s);
  if (!at.inside && !is_off_track_) {
    notes_.push_back(
        fmt::format("the camera's track has no pose at {:.3f} s: it stays at the "
                    "nearest one ({})",
                    time_s, set_.camera.pose.track));
  }
  is_off_track_ = !at.inside;
  return at.cam_from_set;
}

// Gives the objects that deform the frame's shapes; whether any changed.
bool FrameMaker::deform_objects(capture::Time time, PreparedFrame& frame) {
  const bool changed = shapes_->at(time, set_scene_);
  frame.held_shapes = shapes_->held();
  std::ranges::move(shapes_->take_notes(), std::back_inserter(frame.notes));
  return changed;
}

// Lets the persons of the frame's time stand in its scene; their pictures.
render::Scene::Pictures FrameMaker::stand_persons(capture::Time time, PreparedFrame& frame) {
  render::Scene::Pictures pictures;
  std::size_t instance = set_scene_.first_person, number = 0;
  for (PersonFrame& person : persons_->at(time, frame.job.cam_from_set)) {
    for (const auto& place : person.places) {
      set_scene_.description.instances[instance++].set_from_object = place;
    }
    std::ranges::move(person.pictures, std::back_inserter(pictures));
    frame.persons.push_back(std::move(person.status));
    const auto hull = std::ranges::find(set_scene_.hulls, number, &PersonHull::person);
    if (!person.hull_cameras.empty() && hull->cameras != person.hull_cameras) {
      see_hull_by(set_, number, person.hull_cameras, set_scene_);
    }
    ++number;
  }
  std::ranges::move(persons_->take_notes(), std::back_inserter(frame.notes));
  return pictures;
}

// Compiles the scene as it is described now.
void FrameMaker::renew_scene(render::Scene::Pictures pictures) {
  set_scene_.description.version = ++scene_version_;
  scene_ = std::make_shared<render::Scene>(set_scene_.description, *scene_, std::move(pictures));
}

}  // namespace studio
