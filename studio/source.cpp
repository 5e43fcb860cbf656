// Cameras read by the show's clock.
#include "studio/source.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace studio {

Source::Source(std::unique_ptr<capture::Camera> camera) : camera_(std::move(camera)) {
  read_ahead();
  if (!next_) throw std::runtime_error("the source ends before its first frame: is it empty?");
  first_ = current_ = *next_;
  const capture::Rational rate = info().rate;
  if (rate.num > 0) period_ = capture::time_of_frame(1, rate);
  read_ahead();
  still_ = !next_;
}

void Source::read_ahead() {
  next_ = camera_->next();
  if (auto sound = camera_->take_sound()) sound_.push_back(std::move(*sound));
}

std::vector<capture::Frame> Source::advance(capture::Time time) {
  std::vector<capture::Frame> passed;
  while (next_ && next_->time <= time) {
    period_ = std::max(next_->time - current_.time, capture::Time{1});
    current_ = std::move(*next_);
    passed.push_back(current_);
    read_ahead();
  }
  return passed;
}

std::optional<capture::Frame> Source::at(capture::Time time) {
  static_cast<void>(advance(time));
  const bool ended = !next_ && !still_;
  if (ended && time >= current_.time + period_) return std::nullopt;
  return current_;
}

std::optional<capture::Time> Source::next_time() const {
  return next_ ? std::optional(next_->time) : std::nullopt;
}

std::vector<capture::Sound> Source::take_sound() { return std::exchange(sound_, {}); }

}  // namespace studio
