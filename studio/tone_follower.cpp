// The tone curve, followed.
#include "studio/tone_follower.h"

#include <chrono>
#include <cmath>

namespace studio {
namespace {

constexpr float cut_octaves = 1;
constexpr float near = 1e-3F;  // of a level

// `level` on its way to `target`.
float towards(float level, float target, float share) {
  const float ratio = target / level;
  if (std::abs(ratio - 1) <= near) return target;
  return level * std::pow(ratio, share);
}

bool is_usable(const compositing::PictureLevels& l) {
  const auto good = [](float level) { return std::isfinite(level) && level > 0; };
  return good(l.darkest) && good(l.middle) && good(l.brightest);
}

}  // namespace

std::optional<compositing::ToneCurve> ToneFollower::curve() const {
  if (!followed_) return std::nullopt;
  return compositing::curve_for(*followed_, settings_.key);
}

void ToneFollower::follow(const std::optional<compositing::PictureLevels>& levels,
                          capture::Time time) {
  if (!levels || !is_usable(*levels)) return;
  const bool cut = followed_ && std::abs(std::log2(levels->middle / last_middle_)) >= cut_octaves;
  if (!followed_ || cut) {
    followed_ = levels;
  } else {
    const double passed_s = std::chrono::duration<double>(time - last_time_).count();
    const auto share =
        passed_s > 0 ? static_cast<float>(-std::expm1(-passed_s / settings_.seconds)) : 0.0F;
    followed_->darkest = towards(followed_->darkest, levels->darkest, share);
    followed_->middle = towards(followed_->middle, levels->middle, share);
    followed_->brightest = towards(followed_->brightest, levels->brightest, share);
  }
  last_middle_ = levels->middle;
  last_time_ = time;
}

}  // namespace studio
