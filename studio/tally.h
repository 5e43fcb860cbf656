// Counts what a show has done, frame by frame.
#pragma once

#include <array>
#include <chrono>
#include <deque>
#include <utility>

#include "studio/quantiles.h"
#include "studio/show.h"

namespace studio {

// One thread uses it.
class Tally {
 public:
  using Clock = std::chrono::steady_clock;

  // The making of the show begins now.
  Tally() : made_(Clock::now()) {}

  // How long a frame of a live show lasts. Without: as long as frames take.
  void set_period_ms(double period_ms) { period_ms_ = period_ms; }

  // A frame whose picture was done at `displayed`.
  void add(const ShownFrame& shown, Clock::time_point displayed);
  // All that frames tell; the rest is left as it is.
  ShowStatus& status() { return status_; }

 private:
  Clock::time_point made_;
  double period_ms_ = 0;
  Clock::time_point first_shown_;
  Clock::time_point last_shown_;
  Quantiles interval_ms_;
  Quantiles delay_ms_;
  std::deque<std::pair<Clock::time_point, double>> recent_;  // when frames were shown, their delay
  Quantiles light_age_ms_;
  std::array<double, stages> stage_sum_ms_{};
  ShowStatus status_;
};

}  // namespace studio
