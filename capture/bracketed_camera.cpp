// The schedule of a bracket, and the frames' labels.
#include "capture/bracketed_camera.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace capture {
namespace {

std::string seconds(double exposure_s) {
  std::ostringstream text;
  text << exposure_s << " s";
  return text.str();
}

// Exposures nearer than this are one: no light tells them apart.
constexpr double distinct_ratio = 1.05;
// A frame's time may be told rounded.
constexpr double period_slack = 1.001;
// Of a frame's time: a longer exposure arrives so late that the next request, after it, misses a
// frame.
constexpr double longest_share = 0.5;
constexpr double unknown_period_s = 1.0 / 30;

LabelSettings of_thumbnails(LabelSettings settings, const CameraInfo& picture) {
  settings.noise = noise_of_thumbnail(settings.noise, picture.width, picture.height);
  return settings;
}

double ask_for(Camera& camera, const std::string& name, double asked_s) {
  const double taken_s = camera.set_exposure(asked_s);
  if (taken_s > 0 && std::isfinite(taken_s)) return taken_s;
  throw std::runtime_error(name + ": an exposure of " + seconds(asked_s) +
                           " was asked for; the camera tells " + seconds(taken_s) + " then");
}

}  // namespace

BracketedCamera::BracketedCamera(std::unique_ptr<Camera> camera,
                                 std::string name,
                                 std::span<const double> exposures_s,
                                 const LabelSettings& settings)
    : camera_(std::move(camera)),
      name_(std::move(name)),
      labeller_(of_thumbnails(settings, camera_->info())) {
  set_exposures(exposures_s);
  try_all();
}

BracketedCamera::BracketedCamera(std::unique_ptr<Camera> camera,
                                 std::string name,
                                 const AutoExposureSettings& exposures,
                                 LightMeterSettings meter,
                                 const LabelSettings& settings)
    : camera_(std::move(camera)),
      name_(std::move(name)),
      labeller_(of_thumbnails(settings, camera_->info())) {
  AutoExposureSettings possible_ones = exposures;
  possible_ones.choice.possible = possible();
  auto_.emplace(possible_ones);
  meter_.emplace(std::move(meter));
  set_exposures(auto_->exposures_s());
  try_all();
}

// Asks for each exposure once.
void BracketedCamera::try_all() {
  for (Member& member : members_) {
    member.taken_s = ask_for(*camera_, name_, member.asked_s);
    labeller_.requested(-1, member.taken_s);
    for (const Member& other : members_) {
      if (&other == &member) break;
      if (other.asked_s != member.asked_s && other.taken_s < member.taken_s * distinct_ratio &&
          member.taken_s < other.taken_s * distinct_ratio) {
        throw std::runtime_error(name_ + ": exposures of " + seconds(other.asked_s) + " and " +
                                 seconds(member.asked_s) + " are one to the camera, " +
                                 seconds(member.taken_s) + "; choose ones farther apart");
      }
    }
  }
  schedule_members();
}

ExposureRange BracketedCamera::range() const {
  if (const std::optional<ExposureRange> range = camera_->exposure_range()) return *range;
  throw std::runtime_error(name_ +
                           ": its exposure cannot be set from frame to frame; give the set a "
                           "camera with a fixed exposure, or another one");
}

// What frames have room for.
ExposureRange BracketedCamera::possible() const {
  const ExposureRange all = range();
  const Rational rate = camera_->info().rate;
  const double period_s = rate.num > 0 ? 1 / rate.value() : unknown_period_s;
  if (all.shortest_s > period_s) {
    throw std::runtime_error(name_ + ": its shortest exposure, " + seconds(all.shortest_s) +
                             ", is longer than a frame, " + seconds(period_s) +
                             "; choose a lower rate");
  }
  return {all.shortest_s, std::clamp(longest_share * period_s, all.shortest_s, all.longest_s)};
}

void BracketedCamera::check(std::span<const double> exposures_s) const {
  if (exposures_s.empty()) throw std::invalid_argument("a bracket has exposures");
  const ExposureRange possible = range();
  const Rational rate = camera_->info().rate;
  for (const double exposure_s : exposures_s) {
    if (!(exposure_s >= possible.shortest_s && exposure_s <= possible.longest_s)) {
      throw std::runtime_error(name_ + ": an exposure of " + seconds(exposure_s) +
                               " is not possible, only " + seconds(possible.shortest_s) + " to " +
                               seconds(possible.longest_s));
    }
    if (rate.num > 0 && exposure_s * rate.value() > period_slack) {
      throw std::runtime_error(name_ + ": an exposure of " + seconds(exposure_s) +
                               " is longer than a frame, " + seconds(1 / rate.value()) +
                               "; choose shorter ones, or a lower rate");
    }
  }
}

void BracketedCamera::set_exposures(std::span<const double> exposures_s) {
  check(exposures_s);
  std::vector<Member> members;
  std::optional<std::size_t> first_new;
  for (const double exposure_s : exposures_s) {
    const auto known = std::ranges::find(members_, exposure_s, &Member::asked_s);
    if (known == members_.end() && !first_new) first_new = members.size();
    members.push_back(known == members_.end() ? Member{exposure_s, exposure_s} : *known);
  }
  turn_ = first_new.value_or(turn_ % members.size());
  members_ = std::move(members);
  schedule_members();
}

void BracketedCamera::schedule_members() { labeller_.set_schedule(exposures_s()); }

std::vector<double> BracketedCamera::exposures_s() const {
  std::vector<double> taken_s;
  for (const Member& member : members_) taken_s.push_back(member.taken_s);
  return taken_s;
}

CameraStatistics BracketedCamera::statistics() const {
  CameraStatistics statistics = camera_->statistics();
  statistics.damaged += damaged_;
  statistics.exposure_lag = labeller_.lag();
  statistics.exposures_s = exposures_s();
  statistics.refused = refused_;
  statistics.refusal = refusal_;
  statistics.too_bright = auto_ && auto_->too_bright();
  statistics.too_dark = auto_ && auto_->too_dark();
  return statistics;
}

void BracketedCamera::follow_light(const Frame& frame) {
  const std::vector<double> taken_s = exposures_s();
  if (auto_->observe(meter_->measure(*frame.image), frame.exposure_s, taken_s, labeller_.lag())) {
    set_exposures(auto_->exposures_s());
  }
}

void BracketedCamera::request(std::int64_t after_frame) {
  Member& member = members_[turn_];
  turn_ = (turn_ + 1) % members_.size();
  try {
    const double taken_s = ask_for(*camera_, name_, member.asked_s);
    labeller_.requested(after_frame, taken_s);
    if (taken_s != member.taken_s) {
      member.taken_s = taken_s;
      schedule_members();
    }
  } catch (const std::runtime_error& refusal) {
    ++refused_;
    refusal_ = refusal.what();
  }
}

std::optional<Frame> BracketedCamera::next() {
  std::optional<Frame> frame = camera_->next();
  if (!frame || frame->status == FrameStatus::lost || !frame->image) {
    if (frame) frame->exposure_s = 0;
    return frame;
  }
  if (frame->status == FrameStatus::damaged) {
    frame->exposure_s = 0;
  } else {
    const ExposureLabel label =
        labeller_.label(frame->number, thumbnail_of(*frame->image), frame->exposure_s);
    frame->exposure_s = label.exposure_s;
    // Nothing contradicts the lag, and what such a picture holds in a few places (the sun) is
    // wanted.
    if (label.verdict == LabelVerdict::unknown && label.evidence.fit == Fit::silent &&
        labeller_.lag()) {
      frame->exposure_s = label.predicted_s;
    }
    if (label.verdict != LabelVerdict::accepted) frame->note = words_of(label.reason);
    if (label.verdict == LabelVerdict::rejected) {
      frame->status = FrameStatus::damaged;
      ++damaged_;
    }
    if (auto_) follow_light(*frame);
  }
  request(frame->number);
  return frame;
}

}  // namespace capture
