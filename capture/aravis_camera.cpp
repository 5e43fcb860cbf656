// GigE Vision and USB3 Vision cameras.
#include "capture/aravis_camera.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "capture/aravis_search.h"
#include "capture/aravis_stream.h"
#include "capture/crop.h"
#include "capture/device_clock.h"
#include "capture/live_frames.h"
#include "capture/live_reader.h"

namespace capture {
namespace {

using namespace std::chrono_literals;

constexpr Time first_picture_patience = 5s;
constexpr int patience_frames = 3;     // frames' time without a picture: the next one is lost
constexpr Time least_patience = 50ms;  // which a busy machine may take for itself
constexpr Time least_silence = 500ms;  // then the camera is opened anew
constexpr int silence_frames = 8;      // or after so many frames' time, if that is longer
constexpr Time untold_period = 40ms;   // of a camera that does not tell its rate
constexpr std::uint64_t last_of_16_bits = 65535;

Time time_of_seconds(double seconds) {
  return std::chrono::duration_cast<Time>(std::chrono::duration<double>(seconds));
}

// Steps from one frame number to a later one; nothing if it is not later.
std::optional<std::uint64_t> steps_between(std::uint64_t last,
                                           std::uint64_t next,
                                           bool in_16_bits) {
  std::uint64_t steps = next - last;
  std::uint64_t half = std::uint64_t{1} << 63U;
  if (in_16_bits && last <= last_of_16_bits && next <= last_of_16_bits) {
    // 0 is left out.
    if (next < last) steps = next + last_of_16_bits - last;
    half = last_of_16_bits / 2;
  }
  if (steps == 0 || steps > half) return std::nullopt;
  return steps;
}

class AravisCamera final : public Camera {
 public:
  AravisCamera(std::string_view rest, const CameraOptions& options, LightCurves curves);

  const CameraInfo& info() const override { return info_; }
  std::optional<Frame> next() override;
  CameraStatistics statistics() const override { return frames_.statistics(); }
  std::optional<ExposureRange> exposure_range() const override { return exposures_; }
  double set_exposure(double exposure_s) override;

 private:
  [[noreturn]] void fail(const std::string& why) const;
  void open(const CameraOptions& options);
  void keep_settings();
  void wait_for_first();
  void describe();
  void read_next();
  void read_buffer(const AravisBuffer& buffer);
  void count(const AravisBuffer& buffer, Time time);
  void lose_what_is_due(const std::string& note);
  void leave(const std::string& note);
  void await_return();
  Time time_of(const AravisBuffer& buffer, std::string& note);
  Time period() const;
  // When the next frame counts as lost.
  Time due() const {
    return last_sign_ + std::max(patience_frames * period(), least_patience) +
           silent_frames_ * period();
  }

  std::string uri_;
  LiveFrames frames_;
  AravisRequest settings_;  // with what was chosen: for when the camera comes back
  AravisDevice device_;
  std::unique_ptr<AravisStream> stream_;  // null while the camera is away
  std::unique_ptr<AravisSearch> search_;  // then
  Crop crop_;
  CameraInfo info_;
  std::optional<ExposureRange> exposures_;
  std::array<double, 16> set_exposures_s_{};  // the last ones: the camera may be as slow
  std::size_t exposures_set_ = 0;
  double told_exposure_s_ = 0;  // by the last good frame: automatic ones change unasked
  DeviceClock clock_;
  std::optional<std::uint64_t> last_id_;
  Time last_sign_{};       // when the camera was last heard of
  int silent_frames_ = 0;  // lost since then
  Time opened_{};          // when the stream was taken
  std::string away_note_;
};

AravisCamera::AravisCamera(std::string_view rest, const CameraOptions& options, LightCurves curves)
    : uri_("aravis:" + std::string(rest)), frames_(std::move(curves), options.keep_coded) {
  if (options.frame.value_or(0) != 0) fail("a live camera starts at its frame 0 only");
  try {
    settings_ = parse_aravis(rest);
    open(options);
  } catch (const std::runtime_error& error) {
    fail(error.what());
  }
  wait_for_first();
}

void AravisCamera::fail(const std::string& why) const {
  throw std::runtime_error("cannot open " + uri_ + ": " + why);
}

void AravisCamera::open(const CameraOptions& options) {
  stream_ = std::make_unique<AravisStream>(resolve_aravis(settings_.device), settings_);
  device_ = stream_->device();
  keep_settings();
  crop_ = crop_within(options.crop, stream_->layout().width, stream_->layout().height);
  frames_.set_layout(stream_->layout(), crop_);
  info_.width = crop_.width;
  info_.height = crop_.height;
  info_.whole_width = stream_->layout().width;
  info_.whole_height = stream_->layout().height;
  info_.rate = stream_->rate();
  info_.live = true;
  exposures_ = stream_->exposure_range();
  set_exposures_s_[0] = stream_->fixed_exposure_s();
  opened_ = monotonic_now();
  last_sign_ = opened_;
}

void AravisCamera::keep_settings() {
  settings_.format = stream_->format_name();
  settings_.region = stream_->region();
  settings_.size.reset();
  if (stream_->rate().num > 0) settings_.rate = stream_->rate();
}

void AravisCamera::wait_for_first() {
  const Time end = monotonic_now() + first_picture_patience +
                   time_of_seconds(std::ranges::max(set_exposures_s_));
  try {
    while (!frames_.has_picture() && monotonic_now() < end) {
      if (const auto buffer = stream_->next(100ms)) read_buffer(*buffer);
    }
  } catch (const std::runtime_error& error) {
    fail(error.what());
  }
  if (!frames_.has_picture()) {
    fail(stream_->format_name() + " " +
         words_of(PictureSize{frames_.layout().width, frames_.layout().height}) +
         " was asked for, and no picture came: " +
         (frames_.last_note().empty()
              ? "it gave none (does it wait for a trigger, or send pictures in parts?)"
              : frames_.last_note()));
  }
  frames_.begin();  // what came before the first picture is no loss
  describe();
}

void AravisCamera::describe() {
  info_.description = device_.vendor + " " + device_.model + " " + device_.serial + " at " +
                      device_.address + ", " + stream_->format_name() + ": " +
                      frames_.description() +
                      (stream_->tells_exposures() ? ", exposures told with frames" : "") +
                      (stream_->unguarded().empty()
                           ? ""
                           : ", other senders' packets are not kept out: " + stream_->unguarded());
}

Time AravisCamera::period() const {
  const Time told = info_.rate.num > 0 ? time_of_frame(1, info_.rate) : untold_period;
  return std::max(told,
                  time_of_seconds(std::max(std::ranges::max(set_exposures_s_), told_exposure_s_)));
}

std::optional<Frame> AravisCamera::next() {
  while (frames_.empty()) {
    if (stream_) {
      read_next();
    } else {
      await_return();
    }
  }
  return frames_.take();
}

void AravisCamera::read_next() {
  try {
    if (const auto buffer = stream_->next(due() - monotonic_now())) {
      read_buffer(*buffer);
      return;
    }
  } catch (const std::runtime_error& error) {
    leave(error.what());
    return;
  }
  const Time now = monotonic_now();
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now - last_sign_);
  const std::string note = "no picture came for " + std::to_string(ms.count()) + " ms";
  lose_what_is_due(note);
  // One that just returned gets as long for its first picture as any other one.
  const Time silence = now - std::max(last_sign_, opened_);
  if (silence > std::max(least_silence, silence_frames * period())) leave(note);
}

void AravisCamera::lose_what_is_due(const std::string& note) {
  while (due() <= monotonic_now()) {
    const Time last = frames_.last_time().value_or(last_sign_);
    frames_.lose(last + period(), note);
    ++silent_frames_;
  }
}

// Gives the camera up until it can be opened again.
void AravisCamera::leave(const std::string& note) {
  away_note_ = note;
  search_ = std::make_unique<AravisSearch>(std::move(stream_), device_, settings_);
}

void AravisCamera::await_return() {
  const std::chrono::steady_clock::time_point until{
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(due())};
  stream_ = search_->wait_until(until);
  const std::string fault = search_->last_fault();
  lose_what_is_due("the camera is away (" + away_note_ + ")" +
                   (fault.empty() ? "" : "; it cannot be opened again: " + fault));
  if (!stream_) return;
  search_.reset();
  clock_.reset();
  last_id_.reset();
  opened_ = monotonic_now();
  set_exposures_s_[0] = stream_->fixed_exposure_s();
  try {
    frames_.set_layout(stream_->layout(), crop_);
  } catch (const std::runtime_error& error) {
    leave(error.what());
  }
}

double AravisCamera::set_exposure(double exposure_s) {
  if (!stream_) throw std::runtime_error(uri_ + " is away: " + away_note_);
  try {
    const double taken = stream_->set_exposure(exposure_s);
    settings_.exposure_s = taken;
    set_exposures_s_[exposures_set_++ % set_exposures_s_.size()] = taken;
    return taken;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(uri_ + ": " + error.what());
  }
}

void AravisCamera::read_buffer(const AravisBuffer& buffer) {
  Frame frame;
  frame.time = time_of(buffer, frame.note);
  frame.exposure_s = buffer.exposure_s;
  if (buffer.fault.empty()) told_exposure_s_ = buffer.exposure_s;
  count(buffer, frame.time);
  last_sign_ = monotonic_now();
  silent_frames_ = 0;
  if (buffer.bytes.empty()) {
    frames_.lose(frame.time, buffer.fault);
    return;
  }
  frames_.add(buffer.bytes, buffer.fault, std::move(frame));
}

// Frames that the camera counted and did not deliver. Those that were given up already are among
// them.
void AravisCamera::count(const AravisBuffer& buffer, Time time) {
  const auto given_up = static_cast<std::uint64_t>(silent_frames_);
  if (!last_id_) {
    if (buffer.fault.empty()) last_id_ = buffer.id;
    // The camera was away.
    if (const auto last = frames_.last_time(); last && given_up > 0) {
      const auto frames = (time - *last + period() / 2) / period();
      if (frames > 1) {
        frames_.lose_between(static_cast<std::uint64_t>(frames - 1), time, away_note_);
      }
    }
    return;
  }
  const bool in_16_bits = stream_->counts_in_16_bits();
  const auto steps = steps_between(*last_id_, buffer.id, in_16_bits);
  // Where the first packet is missing the number is an old one, or none.
  if (!buffer.fault.empty() && (!steps || (in_16_bits && buffer.id == 0))) {
    last_id_ = in_16_bits && *last_id_ == last_of_16_bits ? 1 : *last_id_ + 1;
    return;
  }
  last_id_ = buffer.id;
  if (steps && *steps - 1 > given_up) {
    frames_.lose_between(*steps - 1 - given_up, time, words_of_missing(*steps - 1));
  }
}

// The middle of the exposure: stamps are taken to be of its start.
Time AravisCamera::time_of(const AravisBuffer& buffer, std::string& note) {
  const Time exposure = time_of_seconds(buffer.exposure_s);
  if (!buffer.stamp) return buffer.arrival - exposure / 2;
  const bool had_clock = frames_.has_picture();
  const auto end = clock_.map(*buffer.stamp + exposure, buffer.arrival);
  if (!end) {
    if (had_clock) note = "its time stamp jumped: the time of its arrival instead";
    return buffer.arrival - exposure / 2;
  }
  return *end - exposure / 2;
}

}  // namespace

std::unique_ptr<Camera> open_aravis(std::string_view rest,
                                    const CameraOptions& options,
                                    const LightCurves& curves) {
  return std::make_unique<AravisCamera>(rest, options, curves);
}

}  // namespace capture
