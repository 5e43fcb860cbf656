// Inputs of frames.
#include "studio/frame_maker.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "calibrate/vignetting.h"
#include "studio/set_scene.h"

namespace studio {
namespace {

using Clock = std::chrono::steady_clock;

constexpr capture::Rational rate_of_stills{25, 1};
// Frames by which a live plate's own count may differ from its clock.
constexpr double most_parted = 1.5;
// How long an edit waits for devices that are being closed.
constexpr std::chrono::seconds patience_for_leaving{10};

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

[[noreturn]] void fail(const Set& set, Place place, const std::string& message) {
  throw SetError({{set.path, place.line, place.column, message}});
}

std::shared_ptr<render::Scene> compile(const Set& set,
                                       const PersonFeed& persons,
                                       SetScene& described,
                                       std::uint64_t version) {
  described.description.version = version;
  try {
    return std::make_shared<render::Scene>(described.description, persons.nothing_yet());
  } catch (const std::invalid_argument& error) {
    fail(set, {}, error.what());
  }
}

std::unique_ptr<Source> open_plate(const Set& set) {
  const CameraSettings& camera = set.camera;
  capture::CameraOptions options;
  options.colour.transfer = camera.colour;
  options.frame = camera.frame;
  options.crop = camera.crop;
  options.loop = camera.loop;
  options.response = camera.response;
  if (set.show.fps) options.picture_rate = *set.show.fps;
  std::unique_ptr<Source> source;
  try {
    source = std::make_unique<Source>(capture::open_camera(camera.source, options));
  } catch (const std::runtime_error& error) {
    fail(set, camera.source_place, error.what());
  } catch (const std::invalid_argument& error) {
    fail(set, camera.source_place, error.what());
  }
  const capture::CameraInfo& info = source->info();
  if (info.width != set.show.width || info.height != set.show.height) {
    fail(set, camera.source_place,
         fmt::format("the plate's picture is {}x{}, but the show is {}x{}: set show.width and "
                     "show.height, or camera.crop",
                     info.width, info.height, set.show.width, set.show.height));
  }
  const auto [width, height] = camera.lens_size;
  const bool whole_known = width > 0 && info.whole_width > 0;
  if (camera.crop && whole_known && (width != info.whole_width || height != info.whole_height)) {
    fail(set, camera.source_place,
         fmt::format("the plate's whole picture is {}x{}, but its lens is for {}x{}",
                     info.whole_width, info.whole_height, width, height));
  }
  return source;
}

// Whether a plate that is open serves another set as well.
bool same_plate(const Set& a, const Set& b) {
  return a.camera.source == b.camera.source && a.camera.frame == b.camera.frame &&
         a.camera.crop == b.camera.crop && a.camera.colour == b.camera.colour &&
         a.camera.response == b.camera.response && a.camera.loop == b.camera.loop;
}

calibrate::Lens lens_of(const Set& set) {
  if (set.camera.lens.width > 0) return set.camera.lens;
  // A set without objects needs no lens; the kernel wants directions all the same.
  const auto [width, height] = std::pair(set.show.width, set.show.height);
  return {"pinhole",
          width,
          height,
          {static_cast<double>(width), static_cast<double>(width), (width - 1) / 2.0,
           (height - 1) / 2.0}};
}

std::shared_ptr<const calibrate::DirectionTable> directions_of(const Set& set) {
  auto directions =
      std::make_shared<calibrate::DirectionTable>(calibrate::make_direction_table(lens_of(set)));
  calibrate::add_vignetting(set.camera.vignetting, *directions);
  return directions;
}

std::optional<calibrate::Track> track_of(const Set& set) {
  if (set.camera.pose.track.empty()) return std::nullopt;
  try {
    return calibrate::read_track(set.camera.pose.track);
  } catch (const std::runtime_error& error) {
    fail(set, set.camera.pose_place, error.what());
  }
}

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
  plate_ = open_plate(set_);
  track_ = track_of(set_);
  directions_ = directions_of(set_);
  lens_ = std::make_shared<calibrate::Lens>(lens_of(set_));
  const capture::Rational plate_rate = plate_->info().rate;
  const capture::Rational own = plate_rate.num > 0 ? plate_rate : rate_of_stills;
  rate_ = rate.value_or(set_.show.fps.value_or(own));
  // A live plate shows no more pictures than there are.
  if (plate_->is_live() && plate_rate.num > 0 && rate_.value() > plate_rate.value()) {
    rate_ = plate_rate;
  }
  live_ = live_ || plate_->is_live();
  videos_ = std::make_unique<VideoFeed>(set_, plate_->first().time, plate_->is_live());
  persons_ = std::make_unique<PersonFeed>(set_, plate_->first().time, plate_->is_live());
  set_scene_ = describe_scene(set_);
  scene_ = compile(set_, *persons_, set_scene_, ++scene_version_);
  videos_->place(set_, set_scene_);
  shapes_ = std::make_unique<ShapeFeed>(set_, set_scene_, rate_, plate_->first().time, live_);
  lamps_ = describe_lamps(set_);
  light_ = light.get();
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
    return last_due_;
  }
  // The camera may be the faster one.
  capture::Time soonest = last_due_.time + 3 * period / 4;
  while (true) {
    const capture::Frame newest = plate_->wait_for_newer(until, soonest);
    if (newest.time < soonest) break;
    const std::int64_t number = number_of(newest);
    if (static_cast<double>(number) - place_of(newest.time) <= most_parted) {
      last_due_ = {number, newest.time};
      return last_due_;
    }
    soonest = newest.time + capture::Time{1};  // one picture too many
  }
  // As late as a picture may be that comes now.
  const capture::Time time = std::max(last_due_.time + period, capture::monotonic_now() - patience);
  last_due_ = {std::max<std::int64_t>(std::llround(place_of(time)), last_due_.frame + 1), time};
  return last_due_;
}

std::optional<PreparedFrame> FrameMaker::make_at(const Due& due) {
  const auto [number, time] = due;
  PreparedFrame prepared;
  prepared.arrived = Clock::now();
  if (change_.valid() && change_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    finish_change();
  }

  std::optional<capture::Frame> frame;
  std::vector<VideoFrame> videos;
  {
    const StageTimer timer(prepared, Stage::capture);
    frame = plate_->at(time + plate_->info().jitter);
    if (!frame) return std::nullopt;
    note_plate(*frame);
    prepared.job.cam_from_set = pose_at(*frame);
    if (plate_->is_live()) {
      prepared.arrived =
          Clock::time_point(std::chrono::duration_cast<Clock::duration>(plate_->arrived()));
    }
    prepared.plate = half_plate(*frame);
    prepared.plate_status = frame->status;
    prepared.plate_exposure_s =
        frame->exposure_s > 0 ? frame->exposure_s : set_.camera.exposure_s.value_or(0);
    plate_->read_sound_to(time + capture::time_of_frame(1, rate_));
    prepared.sound = plate_->take_sound();
    videos = videos_->at(time);
    prepared.notes = videos_->take_notes();
    for (auto* notes : {&notes_, &set_scene_.notes}) {
      std::ranges::move(std::exchange(*notes, {}), std::back_inserter(prepared.notes));
    }
  }

  render::FrameJob& job = prepared.job;
  Light light;
  {
    const StageTimer timer(prepared, Stage::probe);
    light = light_->at({time, frame->image.get(), directions_.get(), job.cam_from_set,
                        prepared.plate_exposure_s, set_.effort.light_samples});
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
    prepared.directions = directions_;
    prepared.lens = lens_;
  }
  return prepared;
}

// Tells of the first of frames that are lost in a row.
void FrameMaker::note_plate(const capture::Frame& frame) {
  const bool lost = frame.status == capture::FrameStatus::lost;
  if (lost && !plate_is_lost_) {
    notes_.push_back(fmt::format("the plate's frame {} is lost{}{}", frame.number,
                                 frame.note.empty() ? "" : ": ", frame.note));
  }
  plate_is_lost_ = lost;
}

calibrate::Pose FrameMaker::pose_at(const capture::Frame& frame) {
  if (!track_) return set_.camera.pose.cam_from_set;
  const double time_s = seconds(frame.time);
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

// At once; while an edit is on its way, what cannot be done may be possible with that.
void FrameMaker::command(Command command) {
  if (!change_.valid()) return apply(command);
  try {
    apply(command);
  } catch (const std::runtime_error& error) {
    command.why_not = error.what();
  } catch (const std::invalid_argument& error) {
    command.why_not = error.what();
  }
  keep(std::move(command));
}

// In the place of one that asked the same thing of the same edits.
void FrameMaker::keep(Command command) {
  const auto asks_the_same = [&](const Command& other) {
    if (other.what.index() != command.what.index()) return false;
    if (const auto* move = std::get_if<Move>(&other.what)) {
      return move->name == std::get<Move>(command.what).name;
    }
    const auto* video = std::get_if<VideoChange>(&other.what);
    return video == nullptr || video->name == std::get<VideoChange>(command.what).name;
  };
  const auto since = commands_.begin() + static_cast<std::ptrdiff_t>(of_next_change_);
  commands_.erase(std::remove_if(since, commands_.end(), asks_the_same), commands_.end());
  commands_.push_back(std::move(command));
}

void FrameMaker::apply(const Command& command, const VideoFeed* videos_before) {
  if (const auto* effort = std::get_if<render::Effort>(&command.what)) {
    set_.effort = *effort;
  } else if (const auto* move = std::get_if<Move>(&command.what)) {
    apply(*move);
  } else {
    const auto& [name, uri] = std::get<VideoChange>(command.what);
    leaving_.let_go(videos_->change_source(name, uri, videos_before));
    const auto video = std::ranges::find(set_.videos, name, &VideoSettings::name);
    if (video != set_.videos.end()) video->source = uri;
  }
}

void FrameMaker::apply(const Move& move) {
  const auto& [name, pose] = move;
  const auto index_of = [&](std::string_view wanted) {
    const auto found = std::ranges::find(set_.objects, wanted, &ObjectSettings::name);
    return static_cast<std::size_t>(found - set_.objects.begin());
  };
  const std::size_t slash = name.find('/');
  if (const std::size_t whole = index_of(name); whole < set_.objects.size()) {
    set_.objects[whole].pose = pose;
    place_object(set_, whole, set_scene_);
  } else if (const std::size_t of_part = index_of(std::string_view(name).substr(0, slash));
             slash != std::string::npos && of_part < set_.objects.size()) {
    move_parts(set_, of_part, std::string_view(name).substr(slash + 1), pose, set_scene_);
  } else {
    throw std::invalid_argument(fmt::format("the set has no object named \"{}\"", name));
  }
  videos_->place(set_, set_scene_);
  renew_scene(scene_->pictures());
}

// For the edit that is on air now, which they came after.
void FrameMaker::repeat_commands(const VideoFeed& videos_before) {
  for (Command& command : commands_) {
    command.why_not.clear();
    try {
      apply(command, &videos_before);
    } catch (const std::runtime_error& error) {
      command.why_not = error.what();
    } catch (const std::invalid_argument& error) {
      command.why_not = error.what();
    }
  }
}

// Those of the edit that was on its way. What the next one may make possible is no fault yet.
void FrameMaker::forget_commands() {
  const auto end = next_change_ ? commands_.begin() + static_cast<std::ptrdiff_t>(of_next_change_)
                                : commands_.end();
  for (auto command = commands_.begin(); command != end; ++command) {
    if (!command->why_not.empty()) notes_.push_back(std::move(command->why_not));
  }
  commands_.erase(commands_.begin(), end);
  of_next_change_ = 0;
}

// A device may be held still by what edits before let go of.
template <class Open>
void FrameMaker::open_once_left(const Open& open) const {
  try {
    return open();
  } catch (const std::runtime_error&) {
    if (!leaving_.wait(patience_for_leaving)) throw;
  }
  open();
}

FrameMaker::Change FrameMaker::prepare(Set set,
                                       std::uint64_t scene_version,
                                       const VideoFeed& videos) const {
  const bool live = plate_->is_live();
  Change change;
  open_once_left([&] {
    change.persons = std::make_unique<PersonFeed>(set, std::nullopt, live, persons_.get());
    change.videos = std::make_unique<VideoFeed>(set, std::nullopt, live, &videos);
  });
  change.track = track_of(set);
  change.directions = directions_of(set);
  change.lens = std::make_shared<calibrate::Lens>(lens_of(set));
  change.set_scene = describe_scene(set, &given_up_);
  change.scene = compile(set, *change.persons, change.set_scene, scene_version);
  try {
    change.videos->place(set, change.set_scene);
  } catch (const std::invalid_argument& error) {
    fail(set, {}, error.what());
  }
  // Last, since the frames of a recording go on.
  if (!light_->serves(set)) {
    const std::optional<Moment> now = moment();
    open_once_left([&] {
      change.light = std::make_unique<LightFeed>(set, light_.get(),
                                                 now ? std::optional(now->time) : std::nullopt);
    });
  }
  change.set = std::move(set);
  return change;
}

// So far that the next frame has no more to do for it than those after.
void FrameMaker::begin_light(Change& change) const {
  if (!change.light) return;
  constexpr int steps = 3;  // each over what the one before took
  for (int i = 0; i < steps; ++i) {
    const std::optional<Moment> now = moment();
    if (!now) return;
    const PoseSettings& pose = change.set.camera.pose;
    change.light->begin({now->time, now->plate.get(), change.directions.get(),
                         pose.track.empty() ? pose.cam_from_set : now->cam_from_set,
                         now->exposure_s, change.set.effort.light_samples});
  }
}

std::optional<FrameMaker::Moment> FrameMaker::moment() const {
  const std::lock_guard lock(moment_mutex_);
  return moment_;
}

void FrameMaker::check_change(const Set& set) const {
  const bool same_picture = set.show.width == set_.show.width &&
                            set.show.height == set_.show.height && set.show.fps == set_.show.fps;
  if (!same_picture) {
    throw std::invalid_argument("the picture's size and rate cannot change on air: start anew");
  }
  if (!same_plate(set, set_)) {
    throw std::invalid_argument("the plate's source cannot change on air: start anew");
  }
}

void FrameMaker::take_over(Change change) {
  // All that may fail comes before anything is taken over. Begun where the show is: before the
  // first shape is shown.
  auto shapes = std::make_unique<ShapeFeed>(change.set, change.set_scene, rate_, std::nullopt,
                                            live_, shapes_.get());
  change.persons->take_over();
  shapes_.swap(shapes);
  videos_.swap(change.videos);
  persons_.swap(change.persons);
  if (change.light) light_.swap(change.light);
  set_ = std::move(change.set);
  set_scene_ = std::move(change.set_scene);
  scene_ = std::move(change.scene);
  lamps_ = describe_lamps(set_);
  track_ = std::move(change.track);
  directions_ = std::move(change.directions);
  lens_ = std::move(change.lens);
  repeat_commands(*change.videos);
  // No frame waits for a camera that stalls or a file that is being read.
  leaving_.let_go(std::make_tuple(std::move(shapes), std::move(change.videos),
                                  std::move(change.persons), std::move(change.light)));
}

void FrameMaker::change_set(Set set) {
  check_change(set);
  next_change_.reset();
  finish_change();
  take_over(prepare(std::move(set), ++scene_version_, *videos_));
}

void FrameMaker::change_set_beside(Set set) {
  check_change(set);
  if (change_.valid()) {
    next_change_ = std::move(set);
    of_next_change_ = commands_.size();
  } else {
    begin_change(std::move(set));
  }
}

void FrameMaker::begin_change(Set set) {
  const auto make = [this](Set& changed, std::uint64_t version, VideoFeed& videos) {
    const VideoFeed on_air = std::move(videos);  // what only it holds by the end is closed here
    Change change = prepare(std::move(changed), version, on_air);
    begin_light(change);
    return change;
  };
  try {
    // A copy of the feed, for its videos may be changed by then.
    change_ = std::async(std::launch::async,
                         [make, set = std::move(set), version = ++scene_version_,
                          videos = *videos_]() mutable { return make(set, version, videos); });
  } catch (const std::system_error& error) {
    notes_.emplace_back(error.what());  // no thread can be had
  }
}

// Waits for the change that is on its way.
void FrameMaker::finish_change() {
  if (!change_.valid()) return;
  try {
    take_over(change_.get());
  } catch (const std::exception& error) {  // whatever it is, what is on air goes on
    notes_.emplace_back(error.what());
  }
  forget_commands();
  if (next_change_) begin_change(*std::exchange(next_change_, std::nullopt));
}

}  // namespace studio
