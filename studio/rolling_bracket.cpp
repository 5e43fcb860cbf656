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
constexpr std::int64_t longest_cycles = 8;

}  // namespace

RollingBracket::RollingBracket(std::size_t cycle, capture::WindowMergeSettings settings)
    : settings_(settings), longest_stay_(longest_cycles * static_cast<std::int64_t>(cycle)) {
  if (cycle < 1 || cycle > most_shots) {
    throw std::invalid_argument("a bracket has 1 to 16 exposures");
  }
}

void RollingBracket::add(std::shared_ptr<const capture::Image> linear,
                         double exposure_s,
                         std::int64_t number) {
  if (!(exposure_s > 0)) throw std::invalid_argument("a shot's exposure is above 0");
  if (linear == nullptr || linear->channels != 3 ||
      (!shots_.empty() && (linear->width != shots_.front().linear->width ||
                           linear->height != shots_.front().linear->height))) {
    throw std::invalid_argument("the shots of a bracket must have one size and three channels");
  }
  std::erase_if(shots_, [&](const Member& shot) {
    return std::abs(shot.exposure_s / exposure_s - 1) <= same_exposure ||
           shot.number < number - longest_stay_;
  });
  if (shots_.size() == most_shots) shots_.erase(shots_.begin());
  shots_.push_back({std::move(linear), exposure_s, number});
}

double RollingBracket::least_radiance() const {
  double longest_s = 0;
  for (const Member& shot : shots_) longest_s = std::max(longest_s, shot.exposure_s);
  return 2 * std::sqrt(settings_.noise.read) / longest_s;
}

std::shared_ptr<const capture::MergedFrame> RollingBracket::merge() {
  std::vector<capture::LiveShot> window;
  for (const Member& shot : shots_) window.push_back({shot.linear.get(), shot.exposure_s});
  std::shared_ptr<capture::MergedFrame> merged = pool_.lend();
  capture::merge_window(window, settings_, *merged);
  return merged;
}

}  // namespace studio
