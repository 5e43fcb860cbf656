// Cameras read by the show's clock.
#include "studio/source.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

namespace studio {
namespace {

using namespace std::chrono_literals;

constexpr capture::Time first_patience = 5s;  // for a live camera's first frame
constexpr std::size_t most_waiting = 16;      // live frames that nobody has asked for
constexpr capture::Time of_rounding = 1us;    // a file's frame is due so much before its time

}  // namespace

Source::Source(std::unique_ptr<capture::Camera> camera) : camera_(std::move(camera)) {
  const capture::Rational rate = camera_->info().rate;
  if (rate.num > 0) period_ = capture::time_of_frame(1, rate);
  if (camera_->info().live) {
    live_ = std::make_unique<capture::LiveReader>(std::move(camera_), most_waiting);
    fetch(capture::monotonic_now() + first_patience);
  } else {
    read_ahead();
  }
  if (next_.empty()) {
    throw std::runtime_error(
        live_ ? "no frame came within 5 s"
              : "the source ends before its first frame: is it empty, or is the frame "
                "that it is to begin with after its end?");
  }
  current_ = std::move(next_.front());
  next_.pop_front();
  first_ = current_.frame;
  if (live_) return;
  read_ahead();
  still_ = next_.empty();
}

const capture::CameraInfo& Source::info() const { return live_ ? live_->info() : camera_->info(); }

capture::CameraStatistics Source::statistics() const {
  return live_ ? live_->statistics() : camera_->statistics();
}

void Source::read_ahead() {
  if (auto frame = camera_->next()) next_.push_back({std::move(*frame), {}});
}

// Takes over what has come of a live camera.
void Source::fetch(capture::Time until) {
  for (capture::Arrival& arrival : live_->take(until)) next_.push_back(std::move(arrival));
}

// Goes on to the next frame, if that is due by then. Of a live camera, also if more have come than
// there is room for: one that is ahead of who asks, as of one with a longer delay, shows what is
// least ahead rather than standing still.
bool Source::step(capture::Time time) {
  const bool is_due = !next_.empty() && next_.front().frame.time <= time + early();
  if (!is_due && next_.size() <= most_waiting) return false;
  period_ = std::max(next_.front().frame.time - current_.frame.time, capture::Time{1});
  current_ = std::move(next_.front());
  next_.pop_front();
  if (!live_) read_ahead();
  return true;
}

std::vector<capture::Frame> Source::advance(capture::Time time, std::size_t most) {
  if (live_) fetch({});
  std::vector<capture::Frame> passed;
  while (passed.size() < most && step(time)) passed.push_back(current_.frame);
  while (next_.size() > 2 * most_waiting) next_.pop_front();
  return passed;
}

std::optional<capture::Frame> Source::at(capture::Time time) {
  if (live_) fetch({});
  while (step(time)) {
  }
  if (has_ended(time)) return std::nullopt;
  return current_.frame;
}

bool Source::has_ended(capture::Time time) const {
  const bool last = next_.empty() && (live_ ? live_->ended() : !still_);
  return last && time + early() >= current_.frame.time + period_;
}

// Frames' times are rounded to nanoseconds, and so are those that are asked for: of a video that
// does not begin with its first frame, some would come a nanosecond late, and others twice.
capture::Time Source::early() const { return live_ ? capture::Time{} : of_rounding; }

std::optional<capture::Time> Source::next_time() const {
  return next_.empty() ? std::nullopt : std::optional(next_.front().frame.time);
}

const capture::Frame& Source::newest() const {
  return next_.empty() ? current_.frame : next_.back().frame;
}

const capture::Frame& Source::wait_for_newer(capture::Time until, capture::Time soonest) {
  fetch({});
  while ((next_.empty() || newest().time < soonest) && !live_->ended() &&
         capture::monotonic_now() < until) {
    fetch(until);
    while (next_.size() > most_waiting) next_.pop_front();
  }
  return newest();
}

void Source::read_sound_to(capture::Time time) {
  if (live_ || info().sound_channels == 0) return;
  while (!next_.empty() && next_.back().frame.time < time && next_.size() < most_waiting) {
    const std::size_t before = next_.size();
    read_ahead();
    if (next_.size() == before) return;  // the end
  }
}

std::optional<capture::Sound> Source::take_sound(capture::Time until) {
  return live_ ? std::nullopt : camera_->take_sound(until);
}

}  // namespace studio
