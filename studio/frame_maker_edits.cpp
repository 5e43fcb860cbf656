// Edits of a set on air, and commands beside them.
#include <algorithm>
#include <chrono>
#include <exception>
#include <future>
#include <iterator>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "calibrate/track_check.h"
#include "studio/file_times.h"
#include "studio/frame_maker.h"
#include "studio/set_scene.h"
#include "studio/show_inputs.h"

namespace studio {
namespace {

// How long an edit waits for devices that are being closed.
constexpr std::chrono::seconds patience_for_leaving{10};

}  // namespace

// At once; while an edit is on its way, what cannot be done may be possible with that.
void FrameMaker::command(Command command) {
  if (!awaits_edit()) return apply(command);
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
    apply(std::get<VideoChange>(command.what), videos_before);
  }
}

void FrameMaker::apply(const VideoChange& change, const VideoFeed* videos_before) {
  const auto& [name, uri, beside] = change;
  auto player = videos_->find_source(name, uri, videos_before);
  if (!beside && videos_before == nullptr) {
    while (opening_.valid()) finish_opening();
    return show_video(change, player ? std::move(player) : videos_->open_source(name, uri));
  }
  // What was asked of it before, and has not begun, is passed over.
  const auto waiting = openings_.begin() + (opening_.valid() ? 1 : 0);
  openings_.erase(std::remove_if(waiting, openings_.end(),
                                 [&](const VideoChange& other) { return other.name == name; }),
                  openings_.end());
  const bool comes = !openings_.empty() && openings_.front().name == name;
  if (player && !comes) return show_video(change, std::move(player));
  if (comes && openings_.front().uri == uri) return;
  openings_.push_back(change);
  begin_next();
}

// Opens it anew where an edit since has it read in another way.
void FrameMaker::show_video(const VideoChange& change, std::shared_ptr<VideoFeed::Player> player) {
  auto before = videos_->take_source(change.name, player);
  if (before == nullptr) {
    leaving_.let_go(std::move(player));
    openings_.push_back(change);
    return;
  }
  leaving_.let_go(std::move(before));
  const auto video = std::ranges::find(set_.videos, change.name, &VideoSettings::name);
  if (video != set_.videos.end()) video->source = change.uri;
}

// Begins to open the first of openings_.
void FrameMaker::open_next() {
  const auto open = [this](const VideoChange& change, VideoFeed& videos) {
    const VideoFeed on_air = std::move(videos);  // what only it holds by the end is closed here
    std::shared_ptr<VideoFeed::Player> player;
    open_once_left([&] { player = on_air.open_source(change.name, change.uri); });
    return player;
  };
  try {
    // A copy of the feed, as for an edit.
    opening_ = std::async(std::launch::async,
                          [open, change = openings_.front(), videos = *videos_]() mutable {
                            return open(change, videos);
                          });
  } catch (const std::system_error& error) {
    notes_.emplace_back(error.what());  // no thread can be had
    openings_.pop_front();
  }
}

// Waits for the video that is on its way.
void FrameMaker::finish_opening() {
  const VideoChange change = std::move(openings_.front());
  openings_.pop_front();
  try {
    auto player = opening_.get();
    if (std::ranges::find(openings_, change.name, &VideoChange::name) == openings_.end()) {
      show_video(change, std::move(player));
    } else {  // another one was asked for since
      leaving_.let_go(std::move(player));
    }
  } catch (const std::exception& error) {  // whatever it is, what is on air goes on
    tell_failure(change, error.what());
  }
  begin_next();
}

// An edit that is on its way may make it possible.
void FrameMaker::tell_failure(const VideoChange& change, const std::string& why) {
  for (Command& command : commands_) {
    const auto* kept = std::get_if<VideoChange>(&command.what);
    if (kept == nullptr || kept->name != change.name || kept->uri != change.uri) continue;
    command.why_not = why;
    return;
  }
  notes_.push_back(why);
}

void FrameMaker::apply(const Move& move) {
  const auto& [name, pose] = move;
  const std::optional<NamedParts> named = parts_named(set_, name);
  if (!named) throw std::invalid_argument(fmt::format("the set has no object named \"{}\"", name));
  ObjectSettings& object = set_.objects[named->object];
  const auto pose_before = object.pose;
  std::vector<decltype(ObjectPart::moved)> moved_before;
  for (const ObjectPart& part : set_scene_.parts) {
    if (part.object == named->object) moved_before.push_back(part.moved);
  }
  try {
    if (named->part) {
      move_parts(set_, named->object, *named->part, pose, set_scene_);
    } else {
      object.pose = pose;
      place_object(set_, named->object, set_scene_);
    }
    videos_->place(set_, set_scene_);
  } catch (...) {  // what is refused changes nothing
    object.pose = pose_before;
    auto moved = moved_before.begin();
    for (ObjectPart& part : set_scene_.parts) {
      if (part.object == named->object) part.moved = *moved++;
    }
    place_object(set_, named->object, set_scene_);
    throw;
  }
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
  // Asked before, since it may be gone just when the device is found busy.
  const bool leaves = leaving_.wait(std::chrono::milliseconds(0));
  try {
    return open();
  } catch (const std::runtime_error&) {
    if (!leaving_.wait(patience_for_leaving) && !leaves) throw;
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
  if (change.track) change.track_doubts = calibrate::doubts_of(*change.track);
  change.directions = directions_of(set);
  change.lens = std::make_shared<calibrate::Lens>(lens_of(set));
  change.set_scene = describe_scene(set, given_up_.get_token());
  change.scene = compile(set, *change.persons, change.set_scene, scene_version);
  try {
    change.videos->place(set, change.set_scene);
  } catch (const std::invalid_argument& error) {
    throw SetError({{set.path, 0, 0, error.what()}});
  }
  // Last, since the frames of a recording go on.
  if (!light_->serves(set)) {
    // Beside a live plate a recording begins when it goes on air.
    std::optional<capture::Time> from;
    if (const std::optional<Moment> now = moment(); now && !plate_->is_live()) from = now->time;
    open_once_left([&] { change.light = std::make_unique<LightFeed>(set, light_.get(), from); });
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
                         now->exposure_s, change.set.effort.light_samples, plate_->is_live()});
  }
}

std::optional<FrameMaker::Moment> FrameMaker::moment() const {
  const std::lock_guard lock(moment_mutex_);
  return moment_;
}

void FrameMaker::check_change(const Set& set) const {
  require_same_plate(set_, set);
  if (file_times({set.camera.response}) != response_times_) {
    throw std::invalid_argument("the plate's response " + set.camera.response +
                                " was written anew, and cannot change on air: start anew");
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
  note_track(std::move(change.track_doubts));
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
  if (change_.valid()) finish_change();
  forget_commands();
  while (opening_.valid()) finish_opening();
  take_over(prepare(std::move(set), ++scene_version_, *videos_));
}

void FrameMaker::change_set_beside(Set set) {
  check_change(set);
  next_change_ = std::move(set);
  of_next_change_ = commands_.size();
  if (!change_.valid()) forget_commands();
  begin_next();
}

// Of what waits: a video after the one before it, an edit after all that came before it.
void FrameMaker::begin_next() {
  if (!opening_.valid() && !openings_.empty()) open_next();
  if (next_change_ && !change_.valid() && openings_.empty()) {
    begin_change(*std::exchange(next_change_, std::nullopt));
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

void FrameMaker::take_what_is_there() {
  const auto is_there = [](const auto& coming) {
    return coming.valid() && coming.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  };
  if (is_there(opening_)) finish_opening();
  if (is_there(change_)) finish_change();
}

// Waits for the change that is on its way.
void FrameMaker::finish_change() {
  try {
    take_over(change_.get());
  } catch (const std::exception& error) {  // whatever it is, what is on air goes on
    notes_.emplace_back(error.what());
  }
  forget_commands();
  begin_next();
}

}  // namespace studio
