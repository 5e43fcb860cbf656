// The schedule of a bracket, and the frames' labels.
#include "capture/bracketed_camera.h"

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

LabelSettings of_thumbnails(LabelSettings settings, const CameraInfo& picture) {
  settings.noise = noise_of_thumbnail(settings.noise, picture.width, picture.height);
  return settings;
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
  for (Member& member : members_) {
    member.taken_s = camera_->set_exposure(member.asked_s);
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

void BracketedCamera::check(std::span<const double> exposures_s) const {
  if (exposures_s.empty()) throw std::invalid_argument("a bracket has exposures");
  const std::optional<ExposureRange> range = camera_->exposure_range();
  if (!range) {
    throw std::runtime_error(name_ +
                             ": its exposure cannot be set from frame to frame; give the set a "
                             "camera with a fixed exposure, or another one");
  }
  const Rational rate = camera_->info().rate;
  for (const double exposure_s : exposures_s) {
    if (!(exposure_s >= range->shortest_s && exposure_s <= range->longest_s)) {
      throw std::runtime_error(name_ + ": an exposure of " + seconds(exposure_s) +
                               " is not possible, only " + seconds(range->shortest_s) + " to " +
                               seconds(range->longest_s));
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
  for (const double exposure_s : exposures_s) {
    Member member{exposure_s, exposure_s};
    for (const Member& known : members_) {
      if (known.asked_s == exposure_s) member = known;
    }
    members.push_back(member);
  }
  members_ = std::move(members);
  turn_ %= members_.size();
  schedule_members();
}

void BracketedCamera::schedule_members() { labeller_.set_schedule(exposures_s()); }

std::vector<double> BracketedCamera::exposures_s() const {
  std::vector<double> taken_s;
  for (const Member& member : members_) taken_s.push_back(member.taken_s);
  return taken_s;
}

BracketStatistics BracketedCamera::bracket_statistics() const {
  BracketStatistics statistics = counts_;
  statistics.lag = labeller_.lag();
  return statistics;
}

CameraStatistics BracketedCamera::statistics() const {
  CameraStatistics statistics = camera_->statistics();
  statistics.damaged += damaged_;
  statistics.rejected = counts_.rejected;
  statistics.unknown = counts_.unknown;
  statistics.exposure_lag = labeller_.lag();
  return statistics;
}

void BracketedCamera::request(std::int64_t after_frame) {
  Member& member = members_[turn_];
  turn_ = (turn_ + 1) % members_.size();
  try {
    const double taken_s = camera_->set_exposure(member.asked_s);
    labeller_.requested(after_frame, taken_s);
    if (taken_s != member.taken_s) {
      member.taken_s = taken_s;
      schedule_members();
    }
  } catch (const std::runtime_error& refusal) {
    ++counts_.refused;
    counts_.refusal = refusal.what();
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
    counts_.accepted += label.verdict == LabelVerdict::accepted;
    counts_.rejected += label.verdict == LabelVerdict::rejected;
    counts_.unknown += label.verdict == LabelVerdict::unknown;
    if (label.verdict != LabelVerdict::accepted) frame->note = words_of(label.reason);
    if (label.verdict == LabelVerdict::rejected) {
      frame->status = FrameStatus::damaged;
      ++damaged_;
    }
  }
  request(frame->number);
  return frame;
}

}  // namespace capture
