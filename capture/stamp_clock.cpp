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
constexpr Time least_jump_back = std::chrono::seconds(1), least_jump_on = std::chrono::seconds(10);

}  // namespace

StampClock::StampClock(Rational tick, Rational rate, const StampRules& rules)
    : tick_(tick),
      rate_(rate),
      rules_(rules),
      last_step_(time_of_frame(1, rate.num > 0 ? rate : assumed_rate)) {}

Time StampClock::period() const { return rate_.num > 0 ? time_of_frame(1, rate_) : last_step_; }

std::int64_t StampClock::nearest_frame(Time time) const {
  return std::llround(static_cast<double>(time.count()) / std::nano::den * rate_.value());
}

// The time that a stamp tells; nothing if it is damaged.
std::optional<Time> StampClock::stamped(std::int64_t stamp) {
  Wide wide_ns = (Wide{stamp} - origin_) * tick_.num * std::nano::den / tick_.den + base_.count();
  const Wide off = last_ ? wide_ns - end().count() : Wide{0};
  if (rules_.may_jump && (off < -least_jump_back.count() || off > least_jump_on.count())) {
    origin_ = stamp;
    base_ = end();
    wide_ns = base_.count();
  }
  const Time limit = last_.value_or(Time{}) + max_step;
  const bool ends_before = rules_.length && off > least_jump_on.count() &&
                           wide_ns > (*rules_.length + least_jump_on).count();
  if (wide_ns < 0 || wide_ns > limit.count() || ends_before) {
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
    origin_ = *stamp;
  }
  std::optional<Time> time = stamp && first_stamp_ ? stamped(*stamp) : std::nullopt;
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
  origin_ = first_stamp.value_or(0);
  base_ = {};
  last_.reset();
}

}  // namespace capture
