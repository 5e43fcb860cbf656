// The lag, and with it labels, from what frames show.
#include "capture/exposure_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace capture {
namespace {

// Requests whose exposures are in play: of a bracket of eight, twice, and the lag.
constexpr std::size_t kept_requests = 24;
// Exposures are the same within this ratio.
constexpr double same_ratio = 1.01;
// Values that are neither black nor saturated, from which a picture is not featureless.
constexpr int least_seen = 32;
// Two pictures of the same light are not the same, value by value: even if the noise at black is
// but that of rounding to the camera's codes, a value whose shot noise has a share s of its
// variance changes in sqrt(s) / 3 of all cases or more. The sum of sqrt(s), at which chance is out.
constexpr double least_noisy = 48;
// Frames in a row that what is known does not explain, until it is held for true no longer where it
// tells but roughly.
constexpr int most_contradictions = 3;
// The share of values that agree with the known light where a part of the picture does.
constexpr double least_agreeing_in_part = 0.3;
// Stands for an exposure that is not known, but stays the same.
constexpr double unknown_s = 1;
// The share of a picture's values that agree, where frames before it were wrong and it tells but
// roughly.
constexpr double least_agreeing_in_doubt = 0.66;
// Deviations from black.
constexpr double seen_deviations = 32;

bool same(double a_s, double b_s) { return a_s < b_s * same_ratio && b_s < a_s * same_ratio; }

bool holds(std::span<const double> exposures_s, double exposure_s) {
  return std::ranges::any_of(exposures_s, [=](double known) { return same(known, exposure_s); });
}

void add(std::vector<double>& exposures_s, double exposure_s) {
  if (!holds(exposures_s, exposure_s)) exposures_s.push_back(exposure_s);
}

}  // namespace

const char* words_of(LabelReason reason) {
  switch (reason) {
    case LabelReason::none:
      return "";
    case LabelReason::lag_unknown:
      return "the camera's exposure lag is not known yet";
    case LabelReason::mislabelled:
      return "its light does not fit the exposure asked for";
    case LabelReason::mixed:
      return "mixed: some rows do not fit the exposure asked for";
    case LabelReason::repeated:
      return "repeated: the picture before it, once more";
    case LabelReason::unchecked:
      return "frames to check its exposure against are too old";
    case LabelReason::dark:
      return "too dark to tell its exposure";
    case LabelReason::saturated:
      return "too bright to tell its exposure";
  }
  return "";
}

ExposureLabeller::ExposureLabeller(const LabelSettings& settings)
    : settings_(settings),
      known_(settings.noise, settings.light_drift),
      before_(settings.noise, settings.light_drift) {
  if (settings.most_lag < 0 || settings.most_lost < 0) {
    throw std::invalid_argument("the longest lag, and the most lost frames, are 0 or more");
  }
  runs_.assign(static_cast<std::size_t>(settings.most_lag) + 1, Run(settings));
}

void ExposureLabeller::set_schedule(std::span<const double> exposures_s) {
  if (exposures_s.empty() ||
      std::ranges::any_of(exposures_s, [](double t) { return !(t > 0) || !std::isfinite(t); })) {
    throw std::invalid_argument("a schedule has exposures, each above 0 s");
  }
  schedule_s_.assign(exposures_s.begin(), exposures_s.end());
  note_in_play();
}

void ExposureLabeller::requested(std::int64_t after_frame, double exposure_s) {
  if (!(exposure_s > 0) || !std::isfinite(exposure_s)) {
    throw std::invalid_argument("an exposure is above 0 s");
  }
  requests_.push_back({after_frame, exposure_s});
  if (requests_.size() > kept_requests) requests_.pop_front();
  note_in_play();
}

void ExposureLabeller::note_in_play() {
  in_play_s_.clear();
  for (const double exposure_s : schedule_s_) add(in_play_s_, exposure_s);
  for (const Request& request : requests_) add(in_play_s_, request.exposure_s);
  std::ranges::sort(in_play_s_);
}

void ExposureLabeller::restart() {
  requests_.clear();
  note_in_play();
  if (!known_.empty()) before_ = known_;
  known_.clear();
  lags_.clear();
  searching_ = false;
  contradictions_ = 0;
  explained_before_ = false;
  explained_s_ = 0;
  accepted_.reset();
  last_number_.reset();
  last_.values.clear();
}

std::optional<int> ExposureLabeller::lag() const {
  if (lags_.empty()) return std::nullopt;
  return lags_.front();
}

// The exposure of a frame if the lag is this one; 0 = not foretold.
double ExposureLabeller::predicted(std::int64_t number, int lag) const {
  for (auto request = requests_.rbegin(); request != requests_.rend(); ++request) {
    if (request->after_frame <= number - 1 - lag) return request->exposure_s;
  }
  return 0;
}

TriedExposure ExposureLabeller::tried(std::int64_t number, int lag, double exposure_s) const {
  TriedExposure tried{.exposure_s = exposure_s};
  for (const double other : in_play_s_) {
    if (same(other, exposure_s)) continue;
    if (other < exposure_s) tried.shorter_s = other;
    if (other > exposure_s && tried.longer_s == 0) tried.longer_s = other;
  }
  const auto add_partner = [&](std::array<double, 8>& partners_s, double partner_s) {
    if (partner_s <= 0 || same(partner_s, exposure_s) || holds(partners_s, partner_s)) return;
    const auto free = std::ranges::find(partners_s, 0.0);
    if (free != partners_s.end()) *free = partner_s;
  };
  const auto add_partners = [&](int of_lag) {
    const double now_s = predicted(number, of_lag);
    add_partner(tried.before_s, predicted(number - 1, of_lag));
    add_partner(tried.before_s, now_s);
    add_partner(tried.after_s, predicted(number + 1, of_lag));
    add_partner(tried.after_s, now_s);
  };
  add_partners(lag);
  if (!before_sure_) {
    for (const double other : in_play_s_) add_partner(tried.before_s, other);
  }
  // Those that foretold the same until now need not have for the frame before or after.
  if (std::ranges::find(lags_, lag) != lags_.end()) std::ranges::for_each(lags_, add_partners);
  return tried;
}

bool ExposureLabeller::repeats(const Thumbnail& thumbnail) const {
  if (thumbnail.values != last_.values) return false;
  double noisy = 0;
  for (const float value : thumbnail.values) {
    if (!(value > 0) || value >= settings_.noise.saturation) continue;
    noisy += std::sqrt(std::min(settings_.noise.shot * value / settings_.noise.read, 1.0));
  }
  return noisy >= least_noisy;
}

// Tries what the believed lags foretell. Where they foretell several exposures and one of them
// agrees, the others' lags are dropped.
std::optional<FitResult> ExposureLabeller::check_known(std::int64_t number,
                                                       const Thumbnail& thumbnail,
                                                       double told_s,
                                                       double& label_s) {
  std::optional<FitResult> best;
  std::vector<double> tried_s;
  for (const int lag : lags_) {
    const double exposure_s = told_s > 0 ? told_s : predicted(number, lag);
    if (exposure_s <= 0 || holds(tried_s, exposure_s)) continue;
    tried_s.push_back(exposure_s);
    const FitResult fit = known_.check(thumbnail, number, tried(number, lag, exposure_s));
    const auto rank = [](const FitResult& result) {
      return result.fit == Fit::agrees ? 2 : result.fit == Fit::silent ? 1 : 0;
    };
    if (!best || rank(fit) > rank(*best)) {
      best = fit;
      label_s = exposure_s;
    }
  }
  if (best && best->fit == Fit::agrees && tried_s.size() > 1) {
    std::erase_if(lags_, [&](int lag) { return !same(predicted(number, lag), label_s); });
  }
  return best;
}

void ExposureLabeller::extend_run(
    Run& run, int lag, std::int64_t number, const Thumbnail& thumbnail, double label_s) {
  // Before the first request acts, the camera keeps some exposure of its own.
  const bool foretold = label_s > 0;
  if (foretold && run.current_s <= 0) run.light.clear();
  run.current_s = label_s;
  run.fit = {};
  if (!run.light.empty()) {
    run.fit = run.light.check(
        thumbnail, number,
        foretold ? tried(number, lag, label_s) : TriedExposure{.exposure_s = unknown_s});
    if (run.fit.fit == Fit::contradicts) {
      run.light.clear();
      run.failed.push_back(number);
    }
  }
  const auto bracket = static_cast<std::int64_t>(in_play_s_.size());
  while (!run.failed.empty() && number - run.failed.front() > 2 * bracket + settings_.most_lag) {
    run.failed.pop_front();
  }
  if (!foretold) {
    run.light.take(thumbnail, unknown_s, number);
    return;
  }
  if (run.light.empty()) {
    run.since = number;
    run.first_s = label_s;
    run.frames = 0;
    run.moved_on = false;
    run.cycles = 0;
    run.labelled_s.clear();
    run.agreed_s.clear();
  }
  run.moved_on |= !same(label_s, run.first_s);
  // A camera that was just opened may begin a run with an exposure of its own.
  const bool opened = known_.empty() && in_play_s_.size() > 1;
  if (run.since == number) {
    run.first_seen = !opened && without_lag(thumbnail).verdict != LabelVerdict::unknown;
  } else if (run.moved_on || !opened) {
    add(run.labelled_s, label_s);
    if (run.fit.fit == Fit::agrees) {
      ++run.agreed;
      if (run.agreed_s.empty()) {
        run.cycles = 0;
        run.labelled_s.clear();
      }
      add(run.agreed_s, label_s);
      if (run.frames == 1 && run.first_seen && run.fit.near) add(run.agreed_s, run.first_s);
    }
    if (std::ranges::all_of(in_play_s_, [&](double t) { return holds(run.labelled_s, t); })) {
      ++run.cycles;
      run.labelled_s.clear();
    }
  }
  ++run.frames;
  run.light.take(thumbnail, label_s, number);
}

// Whether the known light tells what is wrong with a frame that contradicts it: mixed, or made by
// another exposure in play. Then nothing is wrong with the light.
bool ExposureLabeller::explains(const FitResult& fit,
                                std::int64_t number,
                                const Thumbnail& thumbnail,
                                double label_s) const {
  if (fit.in_part) return true;
  return std::ranges::any_of(in_play_s_, [&](double exposure_s) {
    if (same(exposure_s, label_s)) return false;
    const FitResult other =
        known_.check(thumbnail, number, tried(number, lags_.front(), exposure_s));
    return other.fit == Fit::agrees;
  });
}

void ExposureLabeller::extend_runs(std::int64_t number, const Thumbnail& thumbnail, double told_s) {
  if (!searching_) {
    for (Run& run : runs_) {
      run.light.clear();
      run.failed.clear();
      run.agreed = 0;
    }
    searching_ = true;
  }
  for (std::size_t lag = 0; lag < runs_.size(); ++lag) {
    const auto frames = static_cast<int>(lag);
    extend_run(runs_[lag], frames, number, thumbnail,
               told_s > 0 ? told_s : predicted(number, frames));
  }
}

// Whether the light is that which was known before the camera was opened anew, rather than that of
// a label beside the true one. Where nothing tells, it is.
bool ExposureLabeller::as_before(const Run& run) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < in_play_s_.size(); ++i) {
    least = std::min(least, in_play_s_[i + 1] / in_play_s_[i]);
  }
  const double ratio = run.light.brighter_than(before_);
  return ratio * ratio < least && 1 < ratio * ratio * least;
}

// Whether no other run has failed as seldom, of those that agreed with frames, and with the light
// before as well as this one.
bool ExposureLabeller::fails_least(std::size_t lag) const {
  const Run& run = runs_[lag];
  const bool known_light = as_before(run);
  return std::ranges::none_of(runs_, [&](const Run& other) {
    return other.current_s > 0 && !same(other.current_s, run.current_s) && other.agreed > 1 &&
           other.failed.size() <= run.failed.size() && (!known_light || as_before(other));
  });
}

bool ExposureLabeller::complete(std::size_t lag) const {
  const Run& run = runs_[lag];
  if (run.light.empty() || run.current_s <= 0 || in_play_s_.empty()) return false;
  const bool known = std::ranges::find(lags_, static_cast<int>(lag)) != lags_.end();
  if (!known && !fails_least(lag)) return false;
  // Frames lost or repeated without being counted shift labels for as many frames as the lag.
  if (!known && !lags_.empty() && *last_number_ - run.since <= settings_.most_lag) return false;
  if (holds(run.agreed_s, in_play_s_.front()) && holds(run.agreed_s, in_play_s_.back())) {
    return run.fit.fit == Fit::agrees;
  }
  // A frame gone wrong among black or saturated ones may hide where a wrong lag fails: not every
  // time.
  const bool better = std::ranges::all_of(lags_, [&](int believed) {
    return runs_[static_cast<std::size_t>(believed)].failed.size() >= run.failed.size() + 2;
  });
  int cycles = 1;
  if (!known && !better) cycles = 4;
  if (lags_.empty() && !as_before(run)) cycles = 2;
  return run.cycles >= cycles && !run.agreed_s.empty();
}

std::optional<std::size_t> ExposureLabeller::believed_run() const {
  std::optional<std::size_t> oldest;
  for (std::size_t lag = 0; lag < runs_.size(); ++lag) {
    if (!runs_[lag].light.empty() && runs_[lag].current_s > 0 &&
        (!oldest || runs_[lag].since < runs_[*oldest].since)) {
      oldest = lag;
    }
  }
  if (!oldest || !complete(*oldest)) return std::nullopt;
  for (const Run& run : runs_) {
    if (!run.light.empty() && run.current_s > 0 && run.since == runs_[*oldest].since &&
        !same(run.current_s, runs_[*oldest].current_s)) {
      return std::nullopt;
    }
  }
  return oldest;
}

// From here on the lag is known: this one, and those that have foretold the same for a bracket.
void ExposureLabeller::believe(std::size_t lag, std::int64_t number, double told_s) {
  known_ = runs_[lag].light;
  contradictions_ = 0;
  searching_ = false;
  const std::int64_t first = number - static_cast<std::int64_t>(in_play_s_.size());
  lags_ = {static_cast<int>(lag)};
  for (int other = 0; told_s <= 0 && other <= settings_.most_lag; ++other) {
    bool alike = other != static_cast<int>(lag);
    for (std::int64_t n = first; alike && n <= number; ++n) {
      const double exposure_s = predicted(n, other);
      alike = exposure_s <= 0 || same(exposure_s, predicted(n, lags_.front()));
    }
    if (alike) lags_.push_back(other);
  }
}

ExposureLabel ExposureLabeller::verdict_of(const FitResult& fit,
                                           const Thumbnail& thumbnail,
                                           double label_s) const {
  ExposureLabel label;
  // Where the frame before was wrong, more is asked of a picture that tells but roughly; and much
  // more if its light was unknown.
  const bool surely = fit.agreeing >= least_agreeing_in_doubt;
  const bool coarse_enough = contradictions_ == 0
                                 ? surely || !explained_before_
                                 : surely && contradictions_ < most_contradictions &&
                                       without_lag(thumbnail).verdict != LabelVerdict::unknown;
  if (fit.fit == Fit::agrees && (fit.near || coarse_enough)) {
    label.verdict = LabelVerdict::accepted;
    label.reason = LabelReason::none;
    label.exposure_s = label_s;
  } else {
    label = without_lag(thumbnail);
    if (label.verdict == LabelVerdict::rejected) {
      label.reason = !fit.tells || fit.fit == Fit::agrees ? LabelReason::unchecked
                     : fit.in_part                        ? LabelReason::mixed
                                                          : LabelReason::mislabelled;
    }
  }
  label.predicted_s = label_s;
  label.evidence = fit;
  return label;
}

// Of a frame that nothing is known about: black, saturated, or not checked.
ExposureLabel ExposureLabeller::without_lag(const Thumbnail& thumbnail) const {
  const double black = seen_deviations * std::sqrt(settings_.noise.read);
  int seen = 0;
  int bright = 0;
  for (const float value : thumbnail.values) {
    bright += value >= settings_.noise.saturation / 2;
    seen += value > black && value < settings_.noise.saturation / 2;
  }
  if (seen >= least_seen) return {};
  ExposureLabel label;
  label.verdict = LabelVerdict::unknown;
  label.reason = bright * 2 > static_cast<int>(thumbnail.values.size()) ? LabelReason::saturated
                                                                        : LabelReason::dark;
  return label;
}

ExposureLabel ExposureLabeller::label(std::int64_t number,
                                      const Thumbnail& thumbnail,
                                      double told_s) {
  if (last_number_ &&
      (number <= *last_number_ || number - *last_number_ - 1 > settings_.most_lost)) {
    restart();
  }
  before_sure_ = accepted_ == number - 1;
  last_number_ = number;
  if (repeats(thumbnail)) {
    ExposureLabel label;
    label.reason = LabelReason::repeated;
    return label;
  }
  last_ = thumbnail;
  double label_s = 0;
  const std::optional<FitResult> fit = check_known(number, thumbnail, told_s, label_s);
  const bool contradicts = fit && fit->fit == Fit::contradicts;
  const bool explained = contradicts && explains(*fit, number, thumbnail, label_s);
  if (contradicts && !explained) ++contradictions_;
  ExposureLabel label = fit ? verdict_of(*fit, thumbnail, label_s) : without_lag(thumbnail);
  const bool accepted = label.verdict == LabelVerdict::accepted;
  if (accepted) {
    known_.take(thumbnail, label_s, number);
    accepted_ = number;
    contradictions_ = 0;
    if (same(explained_s_, label_s)) explained_s_ = 0;
  }
  // What explains one frame may be chance, but not that of the next one, or of the next that has
  // the same label. Where the known light is in doubt, what it explains counts for nothing.
  const bool once =
      explained && contradictions_ == 0 && !explained_before_ && !same(explained_s_, label_s);
  explained_before_ = explained;
  if (explained) explained_s_ = label_s;
  if (once || (accepted && !searching_)) return label;

  extend_runs(number, thumbnail, told_s);
  const std::optional<std::size_t> found = believed_run();
  if (!found) return label;
  const Run& run = runs_[*found];
  if (accepted) {
    if (same(run.current_s, label_s)) {
      // Its light also has what rejected frames saw; one such frame may have been mixed.
      if (run.frames > 2 || !fit->near) believe(*found, number, told_s);
      return label;
    }
    searching_ = false;
    lags_.clear();
    return {};
  }
  // Two frames in a row, wrong in the same part, explain each other.
  if (run.frames < 3 && fit && fit->agreeing > least_agreeing_in_part) return label;
  contradictions_ = 0;
  label = verdict_of(run.fit, thumbnail, run.current_s);
  believe(*found, number, told_s);
  return label;
}

}  // namespace capture
