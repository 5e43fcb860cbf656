// Lightprobes as sources of radiance.
#include "studio/probe_source.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "calibrate/lens.h"
#include "capture/bracketed_camera.h"
#include "capture/camera_response.h"
#include "capture/make_hdr.h"
#include "capture/picture_camera.h"
#include "studio/recording_place.h"

namespace studio {
namespace {

constexpr std::size_t longest_cycle = 16;  // exposures of a bracket
constexpr std::size_t at_once = 16;        // frames that are held together
constexpr std::size_t most_untold = 4;     // pictures without an exposure, for one to be waited for
constexpr double same_exposure = 0.02;     // relative
// A recording that has light so much later has its clock wrong, or began so late.
constexpr capture::Time soonest_told = std::chrono::milliseconds(500);
constexpr capture::Time bracket_patience = std::chrono::seconds(5);  // for a live camera's first
constexpr capture::Time next_patience = std::chrono::seconds(2);  // for a live camera's next frame
// From these shares of pixels on, of those that the lens sees, the shots tell nothing.
constexpr double all_saturated = 0.5;
constexpr double least_told = 1e-4;

bool about_equal(double a, double b) { return std::abs(a - b) <= same_exposure * b; }

// The share of values above a radiance, of every seventh.
double share_above(const capture::Image& radiance, double least) {
  constexpr std::size_t step = 7;
  std::size_t above = 0;
  for (std::size_t i = 0; i < radiance.pixels.size(); i += step) {
    above += radiance.pixels[i] > least ? 1 : 0;
  }
  return static_cast<double>(above * step) / static_cast<double>(radiance.pixels.size());
}

// Which stays as it is, whatever else begins again.
bool is_one_picture(std::string_view uri) {
  constexpr std::string_view scheme = "file:";
  if (!uri.starts_with(scheme) || uri.find('%') != std::string_view::npos) return false;
  return capture::is_picture(std::string(uri.substr(scheme.size())));
}

// The camera's noise, where calibration has told it.
capture::NoiseModel noise_of(const ProbeSettings& probe) {
  if (!probe.response.ends_with(".toml")) return {};
  const capture::CameraResponse response = capture::read_response(probe.response);
  return response.linear ? response.linear->noise : capture::NoiseModel{};
}

// Pixels that the lens sees.
capture::LightMeterSettings meter_of(const ProbeSettings& probe, const capture::CameraInfo& info) {
  capture::LightMeterSettings meter;
  meter.width = info.width;
  meter.height = info.height;
  if (!probe.lens || probe.lens->width != info.width || probe.lens->height != info.height) {
    return meter;
  }
  for (int y = 0; y < info.height; ++y) {
    for (int x = 0; x < info.width; ++x) {
      const calibrate::Vec2 q{static_cast<double>(x), static_cast<double>(y)};
      meter.counts.push_back(calibrate::unproject(*probe.lens, q) ? 1 : 0);
    }
  }
  return meter;
}

// Of the pixels that the lens sees, or all if none is known, one in so many rows and columns that
// they are some ten thousands. All where it sees none.
std::vector<std::size_t> pixels_seen(const ProbeSettings& probe, const capture::CameraInfo& info) {
  constexpr int steps = 128;  // along the shorter side
  const int step = std::max(std::min(info.width, info.height) / steps, 1);
  const bool has_lens =
      probe.lens && probe.lens->width == info.width && probe.lens->height == info.height;
  std::vector<std::size_t> all, seen;
  for (int y = 0; y < info.height; y += step) {
    for (int x = 0; x < info.width; x += step) {
      const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(info.width) +
                         static_cast<std::size_t>(x);
      all.push_back(pixel);
      const calibrate::Vec2 q{static_cast<double>(x), static_cast<double>(y)};
      if (has_lens && calibrate::unproject(*probe.lens, q)) seen.push_back(pixel);
    }
  }
  return seen.empty() ? all : seen;
}

double share_of(capture::MergeStatus status,
                const capture::MergedFrame& merged,
                const std::vector<std::size_t>& pixels) {
  const auto count =
      std::ranges::count_if(pixels, [&](std::size_t i) { return merged.status[i] == status; });
  return static_cast<double>(count) / static_cast<double>(pixels.size());
}

// Light that has gone is expected back for half a second.
int hold_of(const capture::CameraInfo& info) {
  return info.rate.num > 0 ? static_cast<int>(std::lround(info.rate.value() / 2)) : 30;
}

struct Bracketed {
  std::unique_ptr<capture::Camera> camera;
  std::size_t cycle = 0;  // exposures at first; 0 = it is left as it is
};

// A live camera that takes exposures in turn: those of the set, or what the light asks for. One
// whose exposure cannot be set stays as it is, unless the set asks for it.
Bracketed bracket(std::unique_ptr<capture::Camera> camera,
                  const ProbeSettings& probe,
                  const capture::NoiseModel& noise) {
  capture::LabelSettings labels;
  labels.noise = noise;
  if (!probe.exposures_s.empty()) {
    return {std::make_unique<capture::BracketedCamera>(std::move(camera), probe.source,
                                                       probe.exposures_s, labels),
            probe.exposures_s.size()};
  }
  if (!probe.asks_auto && !camera->exposure_range()) return {std::move(camera)};
  capture::AutoExposureSettings exposures;
  exposures.choice.noise = noise;
  exposures.choice.relative_error = probe.exposure_error;
  exposures.hold = hold_of(camera->info());
  capture::LightMeterSettings meter = meter_of(probe, camera->info());
  auto bracketed = std::make_unique<capture::BracketedCamera>(std::move(camera), probe.source,
                                                              exposures, std::move(meter), labels);
  const std::size_t cycle = bracketed->exposures_s().size();
  return {std::move(bracketed), cycle};
}

[[noreturn]] void fail(const Set& set, const std::string& message) {
  const Place place = set.probe->source_place;
  throw SetError({{set.path, place.line, place.column, message}});
}

}  // namespace

ProbeSource::ProbeSource(const Set& set, std::optional<capture::Time> from)
    : settings_(*set.probe), loop_(set.camera.loop), times_(file_times({settings_.response})) {
  open(set, from);
  height_ = newest_.image->height;
  width_ = newest_.image->width;
}

bool ProbeSource::serves(const Set& set) const {
  if (!camera_ || !set.probe || set.camera.loop != loop_) return false;
  // All but what the light is made of: that concerns the camera.
  ProbeSettings asked = *set.probe;
  asked.source_place = settings_.source_place;
  asked.probe_from_set = settings_.probe_from_set;
  asked.yaw_rad = settings_.yaw_rad;
  asked.unseen = settings_.unseen;
  asked.match = settings_.match;
  asked.albedo_patch = settings_.albedo_patch;
  asked.vignetting = settings_.vignetting;
  return asked == settings_ && file_times({asked.response}) == times_;
}

bool ProbeSource::holds_camera_of(const Set& set) const {
  return camera_ && camera_->is_live() && set.probe && set.probe->source == settings_.source;
}

void ProbeSource::open(const Set& set, std::optional<capture::Time> from) {
  const ProbeSettings& probe = *set.probe;
  exposures_s_ = probe.exposures_s;
  offset_ =
      std::chrono::duration_cast<capture::Time>(std::chrono::duration<double>(probe.offset_s));
  try {
    if (probe.shots.empty()) {
      open_camera(set, probe, from);
      return;
    }
    capture::HdrOptions options;
    options.exposures_s = probe.exposures_s;
    if (!probe.response.empty()) options.response = probe.response;
    capture::HdrResult merged = capture::make_hdr(probe.shots, options);
    newest_.image = std::make_shared<capture::Image>(std::move(merged.radiance));
    using capture::MergeStatus;
    const auto share_of = [&](MergeStatus status) -> double& {
      return status_.shares[static_cast<std::size_t>(status)];
    };
    share_of(MergeStatus::inconsistent) = merged.shares.contradicting;
    share_of(MergeStatus::lower_bound) = merged.shares.saturated;
    share_of(MergeStatus::dark) = merged.shares.black;
    for (const std::string& warning : merged.warnings) notes_.push_back("the probe: " + warning);
  } catch (const std::runtime_error& error) {
    fail(set, error.what());
  } catch (const std::invalid_argument& error) {
    fail(set, error.what());
  }
}

void ProbeSource::open_camera(const Set& set,
                              const ProbeSettings& probe,
                              std::optional<capture::Time> from) {
  capture::CameraOptions options;
  options.colour.transfer = probe.colour;
  options.response = probe.response;
  options.loop = loop_ && !is_one_picture(probe.source);
  options.mark_saturated = true;
  if (set.show.fps) options.picture_rate = *set.show.fps;
  merging_.noise = noise_of(probe);
  std::unique_ptr<capture::Camera> camera = capture::open_camera(probe.source, options);
  // One that loops tells no length.
  const bool may_have_place = options.loop || camera->info().frames > 1;
  if (from && !camera->info().live && may_have_place) {
    camera.reset();
    const RecordingPlace place = find_place(probe.source, options, *from + offset_);
    const std::int64_t first = place.frame - static_cast<std::int64_t>(longest_cycle);
    if (first > 0) options.frame = first;  // so that the first bracket is whole
    passed_ = place.passed;
    camera = capture::open_camera(probe.source, options);
  }
  std::size_t cycle = 0;
  if (camera->info().live) {
    auto bracketed = bracket(std::move(camera), probe, merging_.noise);
    camera = std::move(bracketed.camera);
    cycle = bracketed.cycle;
  }
  camera_ = std::make_unique<Source>(std::move(camera));
  if (camera_->first().image == nullptr && (camera_->is_live() || camera_->is_still())) {
    throw std::runtime_error("its first frame is lost");
  }
  if (camera_->is_still()) {
    newest_ = {camera_->first().image, camera_->first().time};
    const std::string warning = capture::warning_of_nan(*newest_.image);
    if (!warning.empty()) notes_.push_back("the probe: " + warning);
    camera_.reset();
    return;
  }
  status_.live = true;
  seen_ = pixels_seen(probe, camera_->info());
  if (cycle > 0) {
    prime_live(cycle);
    return;
  }
  prime();
  if (newest_.image == nullptr) throw std::runtime_error("its first frames are all lost");
}

double ProbeSource::exposure_s_of(const capture::Frame& frame) const {
  if (exposures_s_.empty() || camera_->is_live()) return frame.exposure_s;
  const auto place = static_cast<std::size_t>(frame.number - frame.pass_first);
  return exposures_s_[place % exposures_s_.size()];
}

// The frame after those that were taken; of a live camera, waits for it.
capture::Frame ProbeSource::wait_for_next() {
  if (camera_->is_live()) camera_->wait_for_newer(capture::monotonic_now() + next_patience);
  // Of a live one, others may have come meanwhile.
  const std::optional<capture::Time> time =
      camera_->is_live() ? capture::Time::max() : camera_->next_time();
  if (!time) return {};
  std::vector<capture::Frame> next = camera_->advance(*time, 1);
  return next.empty() ? capture::Frame{} : std::move(next.front());
}

// The first cycle is taken at once, so that no frame is lit by half a bracket. It ends with an
// exposure that was known and is not the last one's, which may have been sent again. Frames that
// tell no exposure are passed over, but a live camera is not waited for. A recording that does not
// bracket is shown from its first picture on, each at its time.
void ProbeSource::prime() {
  std::vector<double> exposures_s;
  double last_s = 0;
  std::optional<capture::Time> fresh;
  std::vector<capture::Frame> read;
  std::size_t untold = 0;
  capture::Frame frame = camera_->first();
  while (true) {
    read.push_back(frame);
    if (add(frame)) fresh = frame.time;
    const bool tells = tells_exposure(frame);
    const double exposure_s = tells ? exposure_s_of(frame) : 0;
    const bool known = tells && std::ranges::any_of(exposures_s, [&](double other) {
                         return about_equal(exposure_s, other);
                       });
    if (tells && !known) exposures_s.push_back(exposure_s);
    const bool cycle_ends =
        camera_->is_live() ? known || !tells : known && !about_equal(exposure_s, last_s);
    if (tells) last_s = exposure_s;
    if (frame.image != nullptr && !tells) ++untold;
    const bool gives_up = exposures_s.empty() && untold == most_untold;
    if (cycle_ends || gives_up || read.size() == longest_cycle) break;
    frame = wait_for_next();
    if (frame.image == nullptr && frame.status != capture::FrameStatus::lost) break;
  }
  if (bracket_) {
    bracket_->set_cycle(exposures_s.size());
    if (fresh) merge(*fresh);
  } else if (!camera_->is_live()) {
    status_ = {};
    status_.live = true;
    single_ = {};
    newest_ = {};
    auto next = read.begin();
    while (next != read.end() && newest_.image == nullptr) take({*next++});
    ahead_.assign(next, read.end());
  }
  note_camera();
}

// What came by then, after those that were read ahead.
void ProbeSource::take_until(capture::Time time) {
  note_camera();
  Taken taken;
  const auto due = std::ranges::find_if(
      ahead_, [&](const capture::Frame& frame) { return frame.time > time + camera_->early(); });
  for (auto frame = ahead_.begin(); frame != due; ++frame) take(*frame, taken);
  ahead_.erase(ahead_.begin(), due);
  while (ahead_.empty()) {
    const std::vector<capture::Frame> frames = camera_->advance(time, at_once);
    if (frames.empty()) break;
    for (const capture::Frame& frame : frames) take(frame, taken);
  }
  show(taken);
}

// Waits for a whole bracket, or what comes of it in time.
void ProbeSource::prime_live(std::size_t cycle) {
  bracket_ = std::make_unique<RollingBracket>(cycle, merging_);
  const capture::Time end = capture::monotonic_now() + bracket_patience;
  std::string why = camera_->first().note;
  while (bracket_->shots() < cycle && capture::monotonic_now() < end) {
    camera_->wait_for_newer(end);
    const std::vector<capture::Frame> frames = camera_->advance(capture::Time::max(), at_once);
    if (frames.empty()) break;
    take(frames);
    // Exposures that follow the light may have become fewer.
    cycle = std::min(cycle, status_.exposures_s.size());
    if (!frames.back().note.empty()) why = frames.back().note;
  }
  if (bracket_->shots() == 0) {
    throw std::runtime_error("of no frame within 5 s the exposure could be told" +
                             (why.empty() ? "" : ": " + why) +
                             "; on a machine that is busy with other things, start again");
  }
}

// Whether it is good for a bracket.
bool ProbeSource::tells_exposure(const capture::Frame& frame) const {
  return frame.image != nullptr && frame.status == capture::FrameStatus::good &&
         exposure_s_of(frame) > 0;
}

// Whether the frame tells new light.
bool ProbeSource::add(const capture::Frame& frame) {
  ++status_.frames;
  if (frame.status == capture::FrameStatus::lost || frame.image == nullptr) {
    ++status_.lost;
    return false;
  }
  const bool tells = tells_exposure(frame);
  const double exposure_s = tells ? exposure_s_of(frame) : 0;
  if (!bracket_ && tells) {
    const double single_s = single_.image ? exposure_s_of(single_) : exposure_s;
    if (about_equal(exposure_s, single_s)) {
      single_ = frame;
    } else {
      bracket_ = std::make_unique<RollingBracket>(2, merging_);
      bracket_->add(single_.image, single_s, single_.number, single_.time);
      single_ = {};
      newest_ = {};  // it was a shot alone, in other units
    }
  }
  if (!bracket_) {
    newest_ = {frame.image, frame.time};
    return true;
  }
  if (!tells) {
    ++status_.rejected;
    return false;
  }
  bracket_->add(frame.image, exposure_s, frame.number, frame.time);
  return true;
}

void ProbeSource::merge(capture::Time time) {
  if (!status_.exposures_s.empty()) bracket_->set_cycle(status_.exposures_s);
  const std::shared_ptr<const capture::MergedFrame> merged = bracket_->merge();
  status_.shots = bracket_->shots();
  status_.flicker = bracket_->flicker();
  status_.shares = merged->status_shares();
  const bool saturated =
      share_of(capture::MergeStatus::lower_bound, *merged, seen_) > all_saturated;
  const double told = share_above(merged->radiance, bracket_->least_radiance());
  const bool first = newest_.image == nullptr;
  status_.kept_because = first               ? ""
                         : saturated         ? "the probe's shots are all saturated"
                         : told < least_told ? "the probe's shots are all black"
                                             : "";
  if (!status_.kept_because.empty()) return;
  newest_ = {{merged, &merged->radiance}, time};
}

void ProbeSource::note_camera() {
  capture::CameraStatistics camera = camera_->statistics();
  status_.exposure_lag = camera.exposure_lag;
  status_.exposures_s = std::move(camera.exposures_s);
  status_.too_bright = camera.too_bright;
  status_.too_dark = camera.too_dark;
  status_.refused = camera.refused;
  status_.refusal = std::move(camera.refusal);
}

void ProbeSource::take(const capture::Frame& frame, Taken& taken) {
  if (add(frame)) taken.fresh = frame.time;
  taken.any = true;
  taken.last_note = frame.note;
}

void ProbeSource::take(const std::vector<capture::Frame>& frames) {
  note_camera();
  Taken taken;
  for (const capture::Frame& frame : frames) take(frame, taken);
  show(taken);
}

void ProbeSource::show(const Taken& taken) {
  if (taken.fresh && bracket_) {
    merge(*taken.fresh);
  } else if (taken.fresh) {
    status_.kept_because.clear();
  } else if (taken.any) {
    const std::string& why = taken.last_note;
    status_.kept_because = "the probe's last shot told nothing" + (why.empty() ? "" : ": " + why);
  }
}

ProbeSource::Radiance ProbeSource::at(capture::Time time, bool on_clock) {
  if (camera_) {
    const bool by_itself = camera_->is_live() && !on_clock;
    // A recording begins with a show on the monotonic clock.
    if (on_clock && !camera_->is_live() && !begun_) begun_ = time - camera_->first().time;
    const capture::Time begun = begun_.value_or(capture::Time{});
    const capture::Time on_its_clock =
        by_itself ? capture::monotonic_now() : time - begun + offset_ - passed_;
    take_until(on_its_clock);
    if (ahead_.empty() && camera_->has_ended(on_its_clock))
      status_.kept_because = "the probe has ended";
    status_.age = on_its_clock - newest_.time;
    const capture::Time ahead = camera_->first().time - on_its_clock;
    if (!camera_->is_live() && ahead > soonest_told && !std::exchange(is_told_ahead_, true)) {
      notes_.push_back(fmt::format(
          "the probe's recording begins {:.2f} s later: its first light stands until then; is "
          "probe.offset_s right?",
          std::chrono::duration<double>(ahead).count()));
    }
  }
  return {newest_.image, newest_.time + passed_ + begun_.value_or(capture::Time{})};
}

}  // namespace studio
