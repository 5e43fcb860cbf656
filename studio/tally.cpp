// Figures of a running show.
#include "studio/tally.h"

#include <vector>

#include "capture/median.h"

namespace studio {
namespace {

double ms_between(Tally::Clock::time_point from, Tally::Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

}  // namespace

void Tally::add(const ShownFrame& shown, Clock::time_point displayed) {
  const PreparedFrame& frame = shown.prepared;
  ShowStatus& s = status_;
  if (s.frames == 0) {
    first_shown_ = displayed;
    s.first_frame_ms = ms_between(made_, displayed);
  } else {
    interval_ms_.add(ms_between(last_shown_, displayed));
  }
  const double delay_ms = ms_between(frame.arrived, displayed);
  delay_ms_.add(delay_ms);
  constexpr std::chrono::seconds lately{2};
  recent_.emplace_back(displayed, delay_ms);
  while (displayed - recent_.front().first > lately && recent_.size() > 2) recent_.pop_front();
  last_shown_ = displayed;
  ++s.frames;
  s.frame = frame.job.frame;
  const double elapsed_s = ms_between(first_shown_, displayed) / 1000;
  s.fps = elapsed_s > 0 ? static_cast<double>(s.frames - 1) / elapsed_s : 0;
  const double recent_s = ms_between(recent_.front().first, displayed) / 1000;
  s.fps_now = recent_s > 0 ? static_cast<double>(recent_.size() - 1) / recent_s : 0;
  s.frame_ms_p50 = interval_ms_.at(0.5);
  s.frame_ms_p99 = interval_ms_.at(0.99);
  if (frame.probe.live) {
    light_age_ms_.add(std::chrono::duration<double, std::milli>(frame.probe.age).count());
  }
  s.kept_light_frames += frame.probe.kept_because.empty() ? 0 : 1;
  s.held_shapes += frame.held_shapes;
  s.probe = frame.probe;
  s.persons = frame.persons;
  const double period_ms = period_ms_ > 0 ? period_ms_ : interval_ms_.mean();
  if (period_ms > 0) {
    s.delay_frames = delay_ms_.at(0.5) / period_ms;
    s.delay_frames_p99 = delay_ms_.at(0.99) / period_ms;
    std::vector<double> delays;
    for (const auto& [time, ms] : recent_) delays.push_back(ms);
    s.delay_now_frames = capture::median_in_place(delays) / period_ms;
    s.light_age_frames = light_age_ms_.at(0.5) / period_ms;
    s.light_age_frames_p99 = light_age_ms_.at(0.99) / period_ms;
  }
  for (std::size_t i = 0; i < stages; ++i) {
    stage_sum_ms_[i] += frame.stage_ms[i];
    s.stage_ms[i] = stage_sum_ms_[i] / static_cast<double>(s.frames);
  }
  s.statistics += shown.result->statistics;
  s.match = frame.match;
  s.unseen_share = frame.job.lights.unseen_share;
  s.light_error_estimate = frame.job.lights.error_estimate;
  s.lights = frame.job.lights.lights.size();
  s.effort = frame.job.effort;
  s.tone = frame.job.tone;
}

}  // namespace studio
