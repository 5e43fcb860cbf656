// V4L2 devices as cameras.
#include "capture/v4l2_camera.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "capture/crop.h"
#include "capture/live_frames.h"
#include "capture/v4l2_format.h"
#include "capture/v4l2_stream.h"

namespace capture {
namespace {

using namespace std::chrono_literals;

constexpr Time first_picture_patience = 5s;
constexpr Time least_patience = 500ms;  // then a frame is lost
constexpr int patience_frames = 4;      // or so many frames' time, if that is longer
constexpr int most_time_outs = 4;       // in a row; then the stream is started anew
constexpr Time untold_period = 40ms;    // of a device that does not tell its rate
constexpr Time search_period = 200ms;   // for a device that is away
constexpr Time most_behind = 10s;       // of a stamp against the clock
constexpr Time most_ahead = 1s;

std::string words_of_error(const std::runtime_error& error) {
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  return system != nullptr ? reason_of(system->code().value()) : error.what();
}

class V4l2Camera final : public Camera {
 public:
  V4l2Camera(std::string_view rest,
             const CameraOptions& options,
             LightCurves curves,
             std::shared_ptr<V4l2Io> io);

  const CameraInfo& info() const override { return info_; }
  std::optional<Frame> next() override;
  CameraStatistics statistics() const override { return frames_.statistics(); }
  std::optional<ExposureRange> exposure_range() const override { return exposures_; }
  double set_exposure(double exposure_s) override;

 private:
  [[noreturn]] void fail(const std::string& why) const;
  void open(const CameraOptions& options);
  std::string path_of(const std::string& device) const;
  void wait_for_first();
  void describe();
  bool search();
  void read_next();
  void read_buffer(const V4l2Buffer& buffer);
  void count_missing(std::uint32_t sequence, Time time);
  void leave(const std::string& note);
  Time time_of(const V4l2Buffer& buffer, std::string& note) const;
  Time period() const;
  Time patience() const { return std::max(least_patience, patience_frames * period()); }

  std::string uri_;
  std::shared_ptr<V4l2Io> io_;
  LiveFrames frames_;
  V4l2Request request_;
  V4l2Request settings_;  // the same with what was chosen: for when the device comes back
  V4l2Identity identity_;
  std::unique_ptr<V4l2Stream> stream_;  // null while the device is away
  Crop crop_;
  CameraInfo info_;
  std::optional<ExposureRange> exposures_;

  std::optional<std::uint32_t> last_sequence_;
  int time_outs_ = 0;  // since the last buffer, a lost frame each
  std::string away_note_;
  Time next_search_{};
  std::optional<double> asked_exposure_s_;  // the last one
};

V4l2Camera::V4l2Camera(std::string_view rest,
                       const CameraOptions& options,
                       LightCurves curves,
                       std::shared_ptr<V4l2Io> io)
    : uri_("v4l2:" + std::string(rest)),
      io_(std::move(io)),
      frames_(std::move(curves), options.keep_coded) {
  if (options.frame.value_or(0) != 0) fail("a live camera starts at its frame 0 only");
  try {
    request_ = parse_v4l2(rest);
    open(options);
  } catch (const std::runtime_error& error) {
    fail(words_of_error(error));
  }
  wait_for_first();
}

void V4l2Camera::fail(const std::string& why) const {
  throw std::runtime_error("cannot open " + uri_ + ": " + why);
}

// The node that the URI names, by its path or its bus.
std::string V4l2Camera::path_of(const std::string& device) const {
  if (device.starts_with('/')) return device;
  if (const auto path = find_v4l2(io_, {device, {}, 0})) return *path;
  std::string there;
  for (const V4l2Device& other : list_v4l2(io_).devices) {
    there += (there.empty() ? "" : ", ") + other.bus + " (" + other.card + ")";
  }
  throw std::runtime_error("no camera is there; there " +
                           (there.empty() ? "is none at all" : "are " + there));
}

void V4l2Camera::open(const CameraOptions& options) {
  const std::string path = path_of(request_.device);
  identity_ = identity_of(io_, path);
  stream_ = std::make_unique<V4l2Stream>(io_, path, request_);
  const CodedLayout& layout = stream_->layout();
  settings_ = request_;
  settings_.fourcc = layout.fourcc;
  settings_.size = PictureSize{layout.width, layout.height};
  crop_ = crop_within(options.crop, layout.width, layout.height);
  frames_.set_layout(layout, crop_);
  info_.width = crop_.width;
  info_.height = crop_.height;
  info_.whole_width = layout.width;
  info_.whole_height = layout.height;
  info_.rate = stream_->rate();
  info_.live = true;
  exposures_ = capture::exposure_range(stream_->device());
}

void V4l2Camera::wait_for_first() {
  const Time end = io_->now() + first_picture_patience;
  while (!frames_.has_picture() && stream_ && io_->now() < end) read_next();
  if (!frames_.has_picture()) {
    const CodedLayout& layout = frames_.layout();
    fail(name_of_fourcc(layout.fourcc) + " " + words_of(PictureSize{layout.width, layout.height}) +
         " was asked for, and no picture came: " +
         (frames_.last_note().empty() ? "it gave none" : frames_.last_note()));
  }
  frames_.begin();  // what came before the first picture is no loss
  describe();
}

void V4l2Camera::describe() {
  const V4l2Device& device = stream_->device();
  info_.description = device.card + " on " + device.bus + ", " +
                      name_of_fourcc(frames_.layout().fourcc) + ": " + frames_.description();
  if (stream_->interlaced()) {
    info_.description += ", interlaced (taken as it is)";
    info_.doubt =
        "it delivers interlaced pictures, which are taken as they are: where things move, rows and "
        "colours of two moments are mixed; have it deliver progressive ones";
  }
}

Time V4l2Camera::period() const {
  return info_.rate.num > 0 ? time_of_frame(1, info_.rate) : untold_period;
}

std::optional<Frame> V4l2Camera::next() {
  while (frames_.empty()) {
    if (stream_ || search()) {
      read_next();
    } else {
      io_->sleep(period());
      frames_.lose(io_->now(), away_note_);
    }
  }
  return frames_.take();
}

// Opens the device again, if it is back. Returns whether it is.
bool V4l2Camera::search() {
  if (io_->now() < next_search_) return false;
  next_search_ = io_->now() + search_period;
  try {
    const auto path = find_v4l2(io_, identity_);
    if (!path) return false;
    auto stream = std::make_unique<V4l2Stream>(io_, *path, settings_);
    if (asked_exposure_s_) stream->set_exposure(*asked_exposure_s_);
    frames_.set_layout(stream->layout(), crop_);
    stream_ = std::move(stream);
  } catch (const std::runtime_error& error) {
    away_note_ = "the camera cannot be opened again: " + words_of_error(error);
    return false;
  }
  last_sequence_.reset();
  time_outs_ = 0;
  return true;
}

void V4l2Camera::read_next() {
  try {
    if (const auto buffer = stream_->next(patience())) {
      read_buffer(*buffer);
      time_outs_ = 0;
      return;
    }
  } catch (const std::runtime_error& error) {
    frames_.lose(io_->now(), error.what());
    leave(error.what());
    return;
  }
  const auto waited = std::chrono::duration_cast<std::chrono::milliseconds>(patience());
  const std::string note = "no picture came within " + std::to_string(waited.count()) + " ms";
  frames_.lose(io_->now(), note);
  if (++time_outs_ >= most_time_outs) leave(note);
}

double V4l2Camera::set_exposure(double exposure_s) {
  if (!stream_) throw std::runtime_error(uri_ + " is away: " + away_note_);
  try {
    const double taken_s = stream_->set_exposure(exposure_s);
    asked_exposure_s_ = taken_s;
    return taken_s;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(uri_ + ": " + words_of_error(error));
  }
}

// Gives the device up until it can be opened again: at once, unless it was just opened.
void V4l2Camera::leave(const std::string& note) {
  stream_.reset();
  away_note_ = note;
  next_search_ = std::max(next_search_, io_->now());
}

void V4l2Camera::read_buffer(const V4l2Buffer& buffer) {
  Frame frame;
  frame.time = time_of(buffer, frame.note);
  count_missing(buffer.sequence, frame.time);
  frame.exposure_s = stream_->exposure_s();
  frames_.add(buffer.bytes,
              buffer.marked_faulty ? "the driver marked the picture as faulty" : std::string(),
              std::move(frame));
}

// Frames that the device counted and did not deliver, evenly between the last one and `time`. Those
// that were given up already are among them.
void V4l2Camera::count_missing(std::uint32_t sequence, Time time) {
  const std::optional<std::uint32_t> last = std::exchange(last_sequence_, sequence);
  if (!last) return;
  const std::uint32_t step = sequence - *last;  // over its wrap
  // Devices that do not count tell 0 always, and counters may start again.
  if (step <= 1 || step > 0x80000000U) return;
  const auto given_up = static_cast<std::uint32_t>(time_outs_);
  if (step - 1 <= given_up) return;
  frames_.lose_between(step - 1 - given_up, time, words_of_missing(step - 1));
}

// The middle of the exposure, as far as stamp and exposure tell it.
Time V4l2Camera::time_of(const V4l2Buffer& buffer, std::string& note) const {
  const Time now = io_->now();
  if (!buffer.stamped) return now;
  if (buffer.stamp > now + most_ahead || buffer.stamp < now - most_behind) {
    note = "its time stamp is off by seconds: the time of its arrival instead";
    return now;
  }
  const Time half =
      std::chrono::duration_cast<Time>(std::chrono::duration<double>(stream_->exposure_s() / 2));
  return buffer.at_start ? buffer.stamp + half : buffer.stamp - half;
}

}  // namespace

std::unique_ptr<Camera> open_v4l2(std::string_view rest,
                                  const CameraOptions& options,
                                  const LightCurves& curves,
                                  std::shared_ptr<V4l2Io> io) {
  return std::make_unique<V4l2Camera>(rest, options, curves, std::move(io));
}

}  // namespace capture
