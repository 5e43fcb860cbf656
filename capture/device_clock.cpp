// Camera clocks.
#include "capture/device_clock.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace capture {
namespace {

using namespace std::chrono_literals;

constexpr Time window = 2s;
constexpr Time most_jump = 1s;
constexpr Time largest_stamp = 24h * 36500;  // later ones are broken

}  // namespace

std::optional<Time> DeviceClock::map(Time stamp, Time arrival) {
  if (stamp <= Time{} || stamp > largest_stamp) {
    reset();
    return std::nullopt;
  }
  if (last_stamp_ &&
      std::chrono::abs((stamp - *last_stamp_) - (arrival - last_arrival_)) > most_jump) {
    reset();
    last_stamp_ = stamp;
    last_arrival_ = arrival;
    return std::nullopt;
  }
  last_stamp_ = stamp;
  last_arrival_ = arrival;
  if (!least_ || arrival - window_begin_ > window) {
    least_before_ = std::exchange(least_, std::nullopt);
    window_begin_ = arrival;
  }
  const Time difference = arrival - stamp;
  least_ = std::min(least_.value_or(difference), difference);
  return stamp + std::min(*least_, least_before_.value_or(*least_));
}

}  // namespace capture
