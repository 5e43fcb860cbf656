// V4L2 devices as cameras.
#include "capture/v4l2_camera.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "capture/coded_picture.h"
#include "capture/crop.h"
#include "capture/pool.h"
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
constexpr std::uint32_t most_missing = 250;  // a larger gap is one in the numbers

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
  CameraStatistics statistics() const override { return statistics_; }
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
  void read_picture(const V4l2Buffer& buffer, Frame& frame);
  void count_missing(std::uint32_t sequence, Time time);
  void lose(Time time, const std::string& note);
  void leave(const std::string& note);
  Time time_of(const V4l2Buffer& buffer, std::string& note) const;
  Time period() const;
  Time patience() const { return std::max(least_patience, patience_frames * period()); }
  void push(Frame frame);

  std::string uri_;
  std::shared_ptr<V4l2Io> io_;
  LightCurves curves_;
  bool keep_coded_;
  V4l2Request request_;
  V4l2Request settings_;  // the same with what was chosen: for when the device comes back
  V4l2Identity identity_;
  std::unique_ptr<V4l2Stream> stream_;  // null while the device is away
  std::optional<CodedPictureReader> reader_;
  CodedLayout layout_;
  Crop crop_;
  CameraInfo info_;
  std::optional<ExposureRange> exposures_;
  Pool<Image> pool_;
  Pool<CodedPicture> coded_pool_;

  std::deque<Frame> ready_;
  std::shared_ptr<const Image> last_image_;
  std::optional<std::uint32_t> last_sequence_;
  std::optional<Time> last_time_;
  std::int64_t number_ = 0;
  int time_outs_ = 0;
  std::string away_note_;
  Time next_search_{};
  CameraStatistics statistics_;
};

V4l2Camera::V4l2Camera(std::string_view rest,
                       const CameraOptions& options,
                       LightCurves curves,
                       std::shared_ptr<V4l2Io> io)
    : uri_("v4l2:" + std::string(rest)),
      io_(std::move(io)),
      curves_(std::move(curves)),
      keep_coded_(options.keep_coded) {
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
  layout_ = stream_->layout();
  settings_ = request_;
  settings_.fourcc = layout_.fourcc;
  settings_.size = V4l2Size{layout_.width, layout_.height};
  if (stream_->rate().num > 0) settings_.rate = stream_->rate();
  reader_.emplace(layout_, curves_);
  crop_ = crop_within(options.crop, layout_.width, layout_.height);
  info_.width = crop_.width;
  info_.height = crop_.height;
  info_.rate = stream_->rate();
  info_.live = true;
  exposures_ = capture::exposure_range(stream_->device());
}

void V4l2Camera::wait_for_first() {
  const Time end = io_->now() + first_picture_patience;
  std::string why = "it gave none";
  while (!last_image_ && stream_ && io_->now() < end) {
    read_next();
    if (!ready_.empty() && !ready_.back().note.empty()) why = ready_.back().note;
  }
  if (!last_image_) {
    fail(name_of_fourcc(layout_.fourcc) + " " + words_of(V4l2Size{layout_.width, layout_.height}) +
         " was asked for, and no picture came: " + why);
  }
  // What came before the first picture is no loss.
  ready_.erase(ready_.begin(), ready_.end() - 1);
  ready_.back().number = 0;
  number_ = 1;
  describe();
}

void V4l2Camera::describe() {
  const V4l2Device& device = stream_->device();
  info_.description = device.card + " on " + device.bus + ", " + name_of_fourcc(layout_.fourcc) +
                      ": " + reader_->description();
}

Time V4l2Camera::period() const {
  return info_.rate.num > 0 ? time_of_frame(1, info_.rate) : untold_period;
}

std::optional<Frame> V4l2Camera::next() {
  while (ready_.empty()) {
    if (stream_ || search()) {
      read_next();
    } else {
      io_->sleep(period());
      lose(io_->now(), away_note_);
    }
  }
  Frame frame = std::move(ready_.front());
  ready_.pop_front();
  ++statistics_.delivered;
  statistics_.lost += frame.status == FrameStatus::lost ? 1 : 0;
  statistics_.damaged += frame.status == FrameStatus::damaged ? 1 : 0;
  return frame;
}

// Opens the device again, if it is back. Returns whether it is.
bool V4l2Camera::search() {
  if (io_->now() < next_search_) return false;
  next_search_ = io_->now() + search_period;
  try {
    const auto path = find_v4l2(io_, identity_);
    if (!path) return false;
    auto stream = std::make_unique<V4l2Stream>(io_, *path, settings_);
    layout_ = stream->layout();
    reader_.emplace(layout_, curves_);
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
      time_outs_ = 0;
      read_buffer(*buffer);
      return;
    }
  } catch (const std::runtime_error& error) {
    lose(io_->now(), error.what());
    leave(error.what());
    return;
  }
  const auto waited = std::chrono::duration_cast<std::chrono::milliseconds>(patience());
  const std::string note = "no picture came within " + std::to_string(waited.count()) + " ms";
  lose(io_->now(), note);
  if (++time_outs_ >= most_time_outs) leave(note);
}

double V4l2Camera::set_exposure(double exposure_s) {
  if (!stream_) throw std::runtime_error(uri_ + " is away: " + away_note_);
  try {
    return stream_->set_exposure(exposure_s);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(uri_ + ": " + words_of_error(error));
  }
}

// Gives the device up until it can be opened again.
void V4l2Camera::leave(const std::string& note) {
  stream_.reset();
  away_note_ = note;
  next_search_ = io_->now();
}

void V4l2Camera::read_buffer(const V4l2Buffer& buffer) {
  Frame frame;
  frame.time = time_of(buffer, frame.note);
  count_missing(buffer.sequence, frame.time);
  frame.exposure_s = stream_->exposure_s();
  try {
    read_picture(buffer, frame);
  } catch (const std::runtime_error& error) {
    frame.status = FrameStatus::lost;
    frame.note = error.what();
  }
  push(std::move(frame));
}

void V4l2Camera::read_picture(const V4l2Buffer& buffer, Frame& frame) {
  if (keep_coded_) {
    const std::shared_ptr<CodedPicture> coded = coded_pool_.lend();
    coded->layout = layout_;
    coded->bytes.assign(buffer.bytes.begin(), buffer.bytes.end());
    frame.coded = coded;
  }
  std::shared_ptr<Image> image = pool_.lend();
  std::string wrong = reader_->read(buffer.bytes, crop_, *image);
  if (buffer.marked_faulty && wrong.empty()) wrong = "the driver marked the picture as faulty";
  if (!wrong.empty()) {
    frame.status = FrameStatus::damaged;
    frame.note = wrong;
  }
  last_image_ = std::move(image);
}

// Frames that the device counted and did not deliver, evenly between the last one and `time`.
void V4l2Camera::count_missing(std::uint32_t sequence, Time time) {
  const std::optional<std::uint32_t> last = std::exchange(last_sequence_, sequence);
  if (!last || !last_time_) return;
  const std::uint32_t step = sequence - *last;  // over its wrap
  // Devices that do not count tell 0 always, and counters may start again.
  if (step <= 1 || step > 0x80000000U) return;
  const std::uint32_t missing = step - 1;
  const std::string told =
      "the camera left out " + std::to_string(missing) + (missing == 1 ? " frame" : " frames");
  const Time before = *last_time_;
  const std::uint32_t shown = missing > most_missing ? 1 : missing;
  for (std::uint32_t i = 1; i <= shown; ++i) {
    lose(before + (time - before) * i / (shown + 1), told);
  }
}

void V4l2Camera::lose(Time time, const std::string& note) {
  Frame frame;
  frame.time = time;
  frame.status = FrameStatus::lost;
  frame.note = note;
  push(std::move(frame));
}

// Completes a frame: its number, its picture, and a time after the one before.
void V4l2Camera::push(Frame frame) {
  if (last_time_) frame.time = std::max(frame.time, *last_time_ + Time{1});
  last_time_ = frame.time;
  frame.number = number_++;
  frame.image = last_image_;
  ready_.push_back(std::move(frame));
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
