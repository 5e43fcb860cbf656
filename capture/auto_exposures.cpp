// Exposures that follow the light of a scene.
#include "capture/auto_exposures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace capture {
namespace {

// Exposures are the same within this ratio: of one that is chosen anew, and of a label.
constexpr double same_ratio = 1.02;
constexpr double same_label = 1.005;
// In the shortest exposure, before it is too long.
constexpr double too_full = 0.85;
// Exposures in play that are nearer are hard to tell from each other while light drifts, so what
// is nearer to one in force is left as it is, and new ones leave as much room for other light.
constexpr double apart = 1.5;
constexpr double room_of_dark = 1.52;
constexpr double room_of_bright = 1.25;  // beside that from `fullest` to `too_full`
// What the range must leave beside, if one exposure fewer is to do: half a stop.
constexpr double more_room = 1.4142135623730951;
constexpr double stop = 2;
// An error that is that much smaller is worth other exposures.
constexpr double better_error = 1.2;
// Deviations of reading, up to which the darkest values tell nothing.
constexpr double black_deviations = 3;
// A frame tells of the light for so many brackets.
constexpr int fresh_brackets = 4;

bool same(double a, double b, double ratio = same_ratio) { return a < b * ratio && b < a * ratio; }

bool holds(const std::vector<double>& exposures_s, double exposure_s) {
  return std::ranges::any_of(exposures_s, [=](double other) { return same(other, exposure_s); });
}

bool alike(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(a, b, [](double x, double y) { return same(x, y); });
}

std::vector<double> missing_of(const std::vector<double>& wanted, const std::vector<double>& from) {
  std::vector<double> missing;
  for (const double exposure_s : wanted) {
    if (!holds(from, exposure_s)) missing.push_back(exposure_s);
  }
  return missing;
}

const AutoExposureSettings& checked(const AutoExposureSettings& settings) {
  if (settings.most_exposures == 0 || settings.hold < 0 || settings.most_lag < 0) {
    throw std::invalid_argument(
        "exposures that follow the light: at least one, held 0 frames or "
        "more, with a lag of 0 or more");
  }
  return settings;
}

}  // namespace

void AutoExposures::Held::take(double value) { now = std::max(now.value_or(value), value); }

std::optional<double> AutoExposures::Held::largest() const {
  if (!now || !before) return now ? now : before;
  return std::max(*now, *before);
}

AutoExposures::AutoExposures(const AutoExposureSettings& settings)
    : settings_(checked(settings)),
      least_value_(least_resolved_value(settings.choice)),
      black_value_(
          std::min(least_value_, black_deviations * std::sqrt(settings.choice.noise.read))) {
  const ExposureRange& possible = settings_.choice.possible;
  const ExposureChoice all = choose_at_most(
      settings_.most_exposures,
      {least_value_ / possible.longest_s, settings_.choice.fullest / possible.shortest_s},
      settings_.choice);
  target_s_ = exposures_s_ = all.exposures_s;
  relative_error_ = all.relative_error;
  members_.resize(exposures_s_.size());
}

bool AutoExposures::at_shortest() const {
  return exposures_s_.front() <= settings_.choice.possible.shortest_s * same_ratio;
}

bool AutoExposures::at_longest() const {
  return exposures_s_.back() * same_ratio >= settings_.choice.possible.longest_s;
}

bool AutoExposures::observe(const FrameLight& light,
                            double exposure_s,
                            std::span<const double> taken_s,
                            std::optional<int> lag) {
  if (taken_s.size() != members_.size()) {
    throw std::invalid_argument("the device takes as many exposures as it is asked for");
  }
  ++frames_;
  if (frames_ - held_since_ >= settings_.hold) {
    for (Held* held : {&brightest_, &darkest_}) {
      held->before = held->now;
      held->now.reset();
    }
    held_since_ = frames_;
  }
  for (std::size_t i = 0; i < members_.size(); ++i) members_[i].taken_s = taken_s[i];
  bracket_and_lag_ = static_cast<int>(members_.size()) + lag.value_or(settings_.most_lag);
  if (exposure_s > 0) {
    unlabelled_ = 0;
    if (note_labelled(light, exposure_s) && all_seen()) {
      measure();
      choose();
    }
  } else {
    note_unlabelled(light);
  }
  return step();
}

// Whether it is of the bracket. What a frame contradicts is forgotten: light has changed.
bool AutoExposures::note_labelled(const FrameLight& light, double exposure_s) {
  const bool saturates = light.saturated > 0;
  bool is_member = false;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    Member& member = members_[i];
    if (same(member.taken_s, exposure_s,
             same_label)) {  // two of them, if the device rounds coarsely
      member.light = light;
      member.seen_at = frames_;
      if (awaited_s_ && same(exposures_s_[i], *awaited_s_, same_label)) awaited_s_.reset();
      is_member = true;
    } else {
      const bool saturated = member.light.saturated > 0;
      const bool is_longer = member.taken_s > exposure_s;
      if (saturates != saturated && is_longer == saturates) member.seen_at = -1;
    }
  }
  return is_member;
}

void AutoExposures::note_unlabelled(const FrameLight& light) {
  if (unlabelled_++ == 0) all_saturate_ = all_are_black_ = true;
  all_saturate_ &= light.saturated > 0;
  all_are_black_ &= light.dark < black_value_;
  // The exposures since the last change have been through.
  if (unlabelled_ <= bracket_and_lag_ || frames_ - changed_at_ <= bracket_and_lag_) return;
  unlabelled_ = 0;
  if (!all_saturate_ && !all_are_black_) return;
  saturates_ = all_saturate_;
  is_black_ = all_are_black_;
  too_bright_ = saturates_ && at_shortest();
  too_dark_ = is_black_ && at_longest();
  choose();
}

bool AutoExposures::all_seen() const {
  const std::int64_t oldest = frames_ - fresh_brackets * bracket_and_lag_;
  return std::ranges::all_of(
      members_, [=](const Member& member) { return member.seen_at >= std::max(oldest, {}); });
}

// From the newest frame of each exposure. The longest one that tells tells best.
void AutoExposures::measure() {
  saturates_ = members_.front().light.saturated > 0;
  is_black_ = members_.back().light.dark < black_value_;
  const auto longest = [&](auto tells) -> const Member& {
    const auto found = std::find_if(members_.rbegin(), members_.rend(), tells);
    return found == members_.rend() ? members_.front() : *found;
  };
  const Member& bright = longest([](const Member& m) { return m.light.saturated <= 0; });
  const Member& dark =
      longest([&](const Member& m) { return m.light.dark < settings_.choice.noise.saturation; });
  const double darkest = std::max(dark.light.dark, black_value_) / dark.taken_s;
  if (!saturates_) {
    brightest_.take(std::log(std::max(bright.light.brightest, black_value_) / bright.taken_s));
  }
  if (!is_black_) darkest_.take(-std::log(darkest));
  too_bright_ = saturates_ && at_shortest();
  too_dark_ = at_longest() && (is_black_ || darkest * members_.back().taken_s < least_value_);
}

// The light of the last frames; where it is beyond the bracket, what one exposure more reaches.
RadianceRange AutoExposures::light() const {
  const double fullest = settings_.choice.fullest;
  const double reach = fullest / least_value_;
  const double shortest_s = members_.front().taken_s;
  const double longest_s = members_.back().taken_s;
  const auto brightest = brightest_.largest();
  const auto darkest = darkest_.largest();
  RadianceRange range{darkest ? std::exp(-*darkest) : least_value_ / longest_s,
                      brightest ? std::exp(*brightest) : fullest / shortest_s};
  if (saturates_) range.most = std::max(range.most, fullest * reach / shortest_s);
  if (is_black_) range.least = std::min(range.least, least_value_ / (reach * longest_s));
  return {std::min(range.least, range.most), range.most};
}

bool AutoExposures::covers(const RadianceRange& light) const {
  return (at_shortest() || light.most * members_.front().taken_s <= too_full) &&
         (at_longest() || light.least * members_.back().taken_s >= least_value_);
}

void AutoExposures::choose() {
  const RadianceRange now = light();
  const bool suffices = covers(now);
  const auto choose_with_room = [&](double more) {
    return keep(
        choose_at_most(settings_.most_exposures,
                       {now.least / (room_of_dark * more), now.most * room_of_bright * more},
                       settings_.choice),
        !suffices);
  };
  ExposureChoice choice = choose_with_room(1);
  if (suffices) {
    if (!alike(exposures_s_, target_s_)) return;
    if (choice.exposures_s.size() < exposures_s_.size()) choice = choose_with_room(more_room);
    if (!is_worth_it(choice)) return;
  }
  target_s_ = choice.exposures_s;
  relative_error_ = choice.relative_error;
}

// With exposures in force instead of those chosen, where the error allows it: of the ends only near
// ones, unless they may be wide.
ExposureChoice AutoExposures::keep(ExposureChoice choice, bool wide) const {
  std::vector<double>& chosen = choice.exposures_s;
  // What the longer one of two near ones saturates has room below too_full.
  if (chosen.size() == 2 && same(chosen.front(), chosen.back(), apart)) {
    chosen.erase(chosen.begin());
  }
  const double enough = std::max(choice.relative_error, worst_error(chosen)) * (1 + 1e-6);
  for (double& chosen_s : chosen) {
    const auto near = std::ranges::min_element(
        exposures_s_, {}, [=](double t) { return std::abs(std::log(t / chosen_s)); });
    const bool is_end = &chosen_s == &chosen.front() || &chosen_s == &chosen.back();
    const bool may_be_far = wide || !is_end;
    if (holds(chosen, *near) || !(may_be_far || same(*near, chosen_s, apart))) continue;
    const double given_s = std::exchange(chosen_s, *near);
    if (!std::ranges::is_sorted(chosen) || !(worst_error(chosen) <= enough)) chosen_s = given_s;
  }
  return choice;
}

// Whether other exposures than those in force, which do, are so much better.
bool AutoExposures::is_worth_it(const ExposureChoice& choice) const {
  const std::vector<double>& chosen_s = choice.exposures_s;
  if (choice.relative_error * better_error < relative_error_) return true;
  if (chosen_s.size() != exposures_s_.size()) return chosen_s.size() < exposures_s_.size();
  return !same(chosen_s.front(), exposures_s_.front(), stop) ||
         !same(chosen_s.back(), exposures_s_.back(), stop);
}

double AutoExposures::worst_error(const std::vector<double>& exposures_s) const {
  // Beyond the camera all are alike.
  const ExposureRange& possible = settings_.choice.possible;
  const double most = std::min(light().most, too_full / possible.shortest_s);
  const double least = std::clamp(light().least, least_value_ / possible.longest_s, most);
  const auto error = [&](double radiance) {
    return merged_error(radiance, exposures_s, settings_.choice.noise, too_full);
  };
  // Errors fall with radiance, but where an exposure saturates.
  double worst = error(least);
  for (const double exposure_s : exposures_s) {
    const double radiance = too_full / exposure_s * (1 + 1e-6);
    if (radiance >= least && radiance <= most) worst = std::max(worst, error(radiance));
  }
  return worst;
}

// One step from the exposures in force to those that are wanted, if the one before has been seen.
bool AutoExposures::step() {
  if (awaited_s_ && frames_ - changed_at_ <= 2 * bracket_and_lag_) return false;
  const std::vector<double> missing = missing_of(target_s_, exposures_s_);
  const std::vector<double> surplus = missing_of(exposures_s_, target_s_);
  if (missing.empty() && surplus.empty()) return false;
  Step best;
  double least_error = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Step& step) {
    std::vector<double> exposures_s = exposures_s_;
    if (step.dropped_s) std::erase(exposures_s, *step.dropped_s);
    if (step.added_s) exposures_s.push_back(*step.added_s);
    if (exposures_s.empty()) return;
    const double error = worst_error(exposures_s);
    if (error < least_error || (!best.dropped_s && !best.added_s)) {
      best = step;
      least_error = error;
    }
  };
  const bool grows = exposures_s_.size() < target_s_.size() || surplus.empty();
  for (const double added_s : missing) {
    if (grows) consider({.dropped_s = {}, .added_s = added_s});
    for (const double dropped_s : surplus) {
      if (!grows) consider({.dropped_s = dropped_s, .added_s = added_s});
    }
  }
  for (const double dropped_s : surplus) {
    if (exposures_s_.size() > target_s_.size()) consider({.dropped_s = dropped_s, .added_s = {}});
  }
  take(best);
  return true;
}

void AutoExposures::take(const Step& step) {
  const auto place_of = [&](double exposure_s) {
    return std::ranges::lower_bound(exposures_s_, exposure_s) - exposures_s_.begin();
  };
  if (step.dropped_s) {
    const auto place = place_of(*step.dropped_s);
    exposures_s_.erase(exposures_s_.begin() + place);
    members_.erase(members_.begin() + place);
  }
  if (step.added_s) {
    const auto place = place_of(*step.added_s);
    exposures_s_.insert(exposures_s_.begin() + place, *step.added_s);
    members_.insert(members_.begin() + place,
                    {.light = {}, .seen_at = -1, .taken_s = *step.added_s});
  }
  awaited_s_ = step.added_s;
  changed_at_ = frames_;
  unlabelled_ = 0;
}

}  // namespace capture
