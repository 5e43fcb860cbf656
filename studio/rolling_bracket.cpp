// Windows of shots.
#include "studio/rolling_bracket.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace studio {
namespace {

constexpr double same_exposure = 0.02;  // relative
constexpr std::size_t most_shots = 16;  // of a window
// How long a shot stays: while its exposure is to come again, and if it is not.
constexpr std::int64_t longest_cycles = 8;
constexpr std::int64_t last_cycles = 2;
// Up to which lamps' flicker is levelled, and ratios of light, times those that it makes.
constexpr double largest_modulation = 0.7;
constexpr double beyond_swing = 1.3;

bool same(double a, double b) { return std::abs(a / b - 1) <= same_exposure; }

std::int64_t checked(std::size_t cycle) {
  if (cycle < 1 || cycle > most_shots) {
    throw std::invalid_argument("a bracket has 1 to 16 exposures");
  }
  return static_cast<std::int64_t>(cycle);
}

}  // namespace

RollingBracket::RollingBracket(std::size_t cycle, capture::WindowMergeSettings settings)
    : settings_(settings), cycle_(checked(cycle)) {}

void RollingBracket::set_cycle(std::size_t cycle) { cycle_ = checked(cycle); }

void RollingBracket::set_cycle(std::span<const double> exposures_s) {
  cycle_ = checked(exposures_s.size());
  exposures_s_.assign(exposures_s.begin(), exposures_s.end());
}

bool RollingBracket::comes_again(double exposure_s) const {
  return exposures_s_.empty() ||
         std::ranges::any_of(exposures_s_, [=](double other) { return same(other, exposure_s); });
}

void RollingBracket::add(std::shared_ptr<const capture::Image> linear,
                         double exposure_s,
                         std::int64_t number,
                         capture::Time time) {
  if (!(exposure_s > 0)) throw std::invalid_argument("a shot's exposure is above 0");
  if (linear == nullptr || linear->channels != 3 ||
      (!shots_.empty() && (linear->width != shots_.front().linear->width ||
                           linear->height != shots_.front().linear->height))) {
    throw std::invalid_argument("the shots of a bracket must have one size and three channels");
  }
  std::erase_if(shots_, [&](const Member& shot) {
    const std::int64_t cycles = comes_again(shot.exposure_s) ? longest_cycles : last_cycles;
    return same(shot.exposure_s, exposure_s) || shot.number < number - cycles * cycle_;
  });
  if (shots_.size() == most_shots) shots_.erase(shots_.begin());
  shots_.push_back({std::move(linear), exposure_s, number, time});
}

double RollingBracket::least_radiance() const {
  double longest_s = 0;
  for (const Member& shot : shots_) longest_s = std::max(longest_s, shot.exposure_s);
  return 2 * std::sqrt(settings_.noise.read) / longest_s;
}

std::shared_ptr<const capture::MergedFrame> RollingBracket::merge() {
  window_.clear();
  for (const Member& shot : shots_) window_.push_back({shot.linear.get(), shot.exposure_s});
  std::shared_ptr<capture::MergedFrame> merged = pool_.lend();
  capture::merge_window(window_, settings_, *merged);
  watch(*merged);
  return merged;
}

// Looks at the shots that came one after the other since the last time.
void RollingBracket::watch(const capture::MergedFrame& merged) {
  for (std::size_t i = 1; i < shots_.size(); ++i) {
    const Member& before = shots_[i - 1];
    const Member& shot = shots_[i];
    if (shot.number <= watched_ || shot.number != before.number + 1) continue;
    watch_.add({before.time, before.exposure_s, merged.gains[i - 1]},
               {shot.time, shot.exposure_s, merged.gains[i]});
  }
  watched_ = shots_.back().number;
  flicker_ = watch_.found();
  settings_.level_flicker = flicker_.has_value();
  if (flicker_) {
    const double swing = std::min(flicker_->modulation, largest_modulation);
    settings_.most_levelled = beyond_swing * (1 + swing) / (1 - swing);
  }
}

}  // namespace studio
