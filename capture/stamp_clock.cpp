// From a container's time stamps to the times of frames.
#include "capture/stamp_clock.h"

#include <algorithm>
#include <cmath>

namespace capture {
namespace {

__extension__ using Wide = __int128;

constexpr Rational assumed_rate{25, 1};

// A jump that no recording has: such stamps are damage.
constexpr std::chrono::hours max_step{24};
// By how much one that goes beyond the end is on, and beyond the end, at least.
constexpr std::chrono::seconds least_jump{10};

}  // namespace

StampClock::StampClock(Rational tick, Rational rate, std::optional<Time> length)
    : tick_(tick),
      rate_(rate),
      length_(length),
      last_step_(time_of_frame(1, rate.num > 0 ? rate : assumed_rate)) {}

Time StampClock::period() const { return rate_.num > 0 ? time_of_frame(1, rate_) : last_step_; }

std::int64_t StampClock::nearest_frame(Time time) const {
  return std::llround(static_cast<double>(time.count()) / std::nano::den * rate_.value());
}

std::optional<Time> StampClock::since_first(std::int64_t stamp) const {
  const Wide ticks = Wide{stamp} - first_stamp_.value_or(stamp);
  const Wide wide_ns = ticks * tick_.num * std::nano::den / tick_.den;
  const Time limit = last_.value_or(Time{}) + max_step;
  const bool is_beyond = length_ && wide_ns > Time(*length_ + least_jump).count() &&
                         wide_ns > Time(end() + least_jump).count();
  if (wide_ns < 0 || wide_ns > limit.count() || is_beyond) {
    return std::nullopt;
  }
  const Time stamped{static_cast<Time::rep>(wide_ns)};
  if (rate_.num <= 0) {
    return stamped;
  }
  const Time nominal = time_of_frame(nearest_frame(stamped), rate_);
  // A tick, rounded up.
  const Time tick{static_cast<Time::rep>(Wide{tick_.num} * std::nano::den / tick_.den) + 1};
  const Time near = std::clamp(tick, period() / 8, period() / 3);
  return std::chrono::abs(stamped - nominal) <= near ? nominal : stamped;
}

Time StampClock::time_of(std::optional<std::int64_t> stamp) {
  if (stamp && !first_stamp_ && !last_) {
    first_stamp_ = stamp;
  }
  std::optional<Time> time = stamp && first_stamp_ ? since_first(*stamp) : std::nullopt;
  if (!time || (last_ && *time <= *last_)) {
    time = end();
  }
  if (last_) {
    last_step_ = *time - *last_;
  }
  last_ = time;
  return *time;
}

Time StampClock::end() const {
  if (!last_) {
    return Time{};
  }
  const std::optional<std::int64_t> last_frame = frame_at(*last_);
  return last_frame ? time_of_frame(*last_frame + 1, rate_) : *last_ + period();
}

std::optional<std::int64_t> StampClock::frame_at(Time time) const {
  if (rate_.num <= 0) {
    return std::nullopt;
  }
  const std::int64_t n = nearest_frame(time);
  return time_of_frame(n, rate_) == time ? std::optional(n) : std::nullopt;
}

void StampClock::restart(std::optional<std::int64_t> first_stamp) {
  first_stamp_ = first_stamp;
  last_.reset();
}

}  // namespace capture
