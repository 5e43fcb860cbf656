// Takes: what is pushed waits in a queue, and is written from there.
#include "compositing/recorder.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "compositing/output_file.h"
#include "compositing/recorder_outputs.h"
#include "compositing/sound_track.h"

namespace compositing {
namespace {

// Sound of dropped frames that waits for the next frame; at 25 frames per second, 40 s.
constexpr std::size_t most_waiting_sounds = 1024;
// Sound may lie this far ahead of its picture; what lies further has a damaged time.
constexpr capture::Time most_sound_ahead = std::chrono::seconds(10);

void require(bool holds, const std::string& reason) {
  if (!holds) throw std::invalid_argument(reason);
}

bool has_pair(const RecorderSettings& settings) { return !settings.fill_file.empty(); }

void validate_pair(const RecorderSettings& settings) {
  require(settings.fill_file.empty() == settings.key_file.empty(),
          "fill and key come together: " +
              (settings.fill_file.empty()
                   ? "there is no file for the fill of the key " + settings.key_file
                   : "there is no file for the key of the fill " + settings.fill_file));
  if (!has_pair(settings)) return;
  validate(fill_settings(settings));
  validate(key_settings(settings));
  require(settings.display != nullptr, "fill and key need the display whose codes they are");
  const std::string& fill = settings.fill_file;
  const std::string& key = settings.key_file;
  require(!is_one_file(fill, key), fill + ": fill and key cannot be one file");
  for (const std::string& of_pair : {fill, key}) {
    require(settings.file.empty() || !is_one_file(of_pair, settings.file),
            of_pair + ": is the programme's file already");
  }
}

bool has_form(const capture::HalfImage* image, const RecorderSettings& settings, int channels) {
  return image != nullptr && image->width == settings.width && image->height == settings.height &&
         image->channels == channels &&
         image->pixels.size() == static_cast<std::size_t>(settings.width) *
                                     static_cast<std::size_t>(settings.height) *
                                     static_cast<std::size_t>(channels);
}

void validate(const RecorderSettings& settings) {
  validate_pair(settings);
  require(
      !settings.file.empty() || !settings.exr_dir.empty() || has_pair(settings),
      "nothing to record: name a video file, a folder for EXR frames, or files for fill and key");
  require(
      settings.queue_frames >= 1 && settings.queue_frames <= 4096,
      "the recorder's queue holds 1 to 4096 frames, not " + std::to_string(settings.queue_frames));
  require(settings.width >= 1 && settings.height >= 1,
          "a take has at least one row and column, not " + std::to_string(settings.width) + " x " +
              std::to_string(settings.height));
  if (!settings.file.empty()) validate(video_settings(settings));
  require(settings.rate.num > 0 && settings.rate.den > 0, "a take needs a positive frame rate");
  if (settings.start) frames_since_midnight(*settings.start, settings.rate);
}

}  // namespace

void check(const RecorderSettings& settings) {
  validate(settings);
  for (const std::string& file : {settings.file, settings.fill_file, settings.key_file}) {
    if (!file.empty()) require_writable(file);
  }
  if (!settings.exr_dir.empty()) require_writable_folder(settings.exr_dir);
}

std::vector<std::string> errors_of(const RecorderStatus& status) {
  std::vector<std::string> errors;
  for (const RecordedOutput& output : status.outputs) {
    if (!output.error.empty()) errors.push_back(output.error);
  }
  if (!status.error.empty() && std::ranges::find(errors, status.error) == errors.end()) {
    errors.push_back(status.error);
  }
  return errors;
}

class Recorder::Take {
 public:
  explicit Take(const RecorderSettings& settings);
  ~Take() { close(); }

  bool push(RecordedFrame frame);
  void wait_for_room();
  RecorderStatus status() const;
  void begin_close();
  void close();

 private:
  // A frame with the sound that came with it, and with dropped frames before it.
  struct Item {
    RecordedFrame frame;
    std::vector<capture::Sound> sounds;
  };

  void require_complete(const RecordedFrame& frame) const;
  bool has_room() const { return static_cast<int>(queue_.size()) < settings_.queue_frames; }
  bool has_stopped() const { return closing_ || !status_.error.empty(); }
  void run();
  bool write_next();
  void write(const Item& item);
  std::vector<capture::Sound> take_waiting_sounds();
  void write_sounds(const std::vector<capture::Sound>& sounds, capture::Time latest);
  void write_sound(std::int64_t first, std::span<const float> samples);
  void close_outputs();
  template <class Act>
  void for_each_output(const Act& act);
  void give_up(std::size_t output, std::string error);
  void stop(const std::string& error);

  const RecorderSettings settings_;

  // The recording thread's own.
  std::vector<NamedOutput> outputs_;  // one that failed is nothing any more
  std::optional<SoundTrack> sound_;
  std::optional<std::int64_t> first_number_;
  capture::Time start_{};
  capture::Time latest_sound_{};
  std::int64_t taken_ = 0;  // frames from the queue: written, or not told as dropped yet

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable work_;
  std::condition_variable room_;
  std::deque<Item> queue_;
  std::vector<capture::Sound> waiting_sounds_;
  std::optional<std::int64_t> last_number_;
  bool closing_ = false;
  RecorderStatus status_;

  std::thread thread_;
};

Recorder::Take::Take(const RecorderSettings& settings) : settings_(settings) {
  check(settings);  // so that no take is lost to the start of one that cannot be
  outputs_ = open_outputs(settings);
  for (const NamedOutput& output : outputs_) status_.outputs.push_back({output.name, 0, ""});
  const bool has_video = !settings.file.empty() || has_pair(settings);
  if (has_video && settings.sound_channels > 0) {
    sound_.emplace(settings.sound_channels, settings.sound_rate);
  }
  thread_ = std::thread([this] { run(); });
}

void Recorder::Take::require_complete(const RecordedFrame& frame) const {
  const std::string name = "frame " + std::to_string(frame.number);
  require(
      (settings_.exr_dir.empty() && !has_pair(settings_)) ||
          (has_form(frame.rgba.get(), settings_, 4) && has_form(frame.matte.get(), settings_, 1)),
      name + " lacks a picture and matte of the take's size");
  require(!has_pair(settings_) || has_form(frame.plate.get(), settings_, 3),
          name + " lacks a plate of the take's size for fill and key");
  require((settings_.file.empty() && !has_pair(settings_)) ||
              (frame.display_rgb8 &&
               frame.display_rgb8->size() == static_cast<std::size_t>(settings_.width) *
                                                 static_cast<std::size_t>(settings_.height) * 3),
          name + " lacks display codes of the take's size for the video");
}

bool Recorder::Take::push(RecordedFrame frame) {
  require_complete(frame);
  std::unique_lock lock(mutex_);
  require(!last_number_ || frame.number > *last_number_,
          "frame " + std::to_string(frame.number) + " came after frame " +
              std::to_string(last_number_.value_or(0)));
  last_number_ = frame.number;
  if (has_stopped()) {
    ++status_.dropped;
    return false;
  }
  if (frame.sound && waiting_sounds_.size() < most_waiting_sounds) {
    waiting_sounds_.push_back(std::move(*frame.sound));
  } else if (frame.sound && sound_) {
    ++status_.sounds_left_out;
  }
  frame.sound.reset();
  if (!has_room()) {
    ++status_.dropped;
    return false;
  }
  queue_.push_back({std::move(frame), std::exchange(waiting_sounds_, {})});
  lock.unlock();
  work_.notify_one();
  return true;
}

void Recorder::Take::wait_for_room() {
  std::unique_lock lock(mutex_);
  room_.wait(lock, [this] { return has_room() || has_stopped(); });
}

RecorderStatus Recorder::Take::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void Recorder::Take::begin_close() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  work_.notify_one();
  room_.notify_all();
}

void Recorder::Take::close() {
  begin_close();
  if (thread_.joinable()) thread_.join();
}

void Recorder::Take::run() {
  try {
    while (write_next()) continue;
    write_sounds(take_waiting_sounds(), latest_sound_);
  } catch (const std::exception& error) {
    stop(error.what());
  }
  close_outputs();
  outputs_.clear();  // others may write there from now on
  const std::lock_guard lock(mutex_);
  status_.finished = true;
}

std::vector<capture::Sound> Recorder::Take::take_waiting_sounds() {
  const std::lock_guard lock(mutex_);
  return std::exchange(waiting_sounds_, {});
}

// Writes the next frame once there is one; false at the end of the take.
bool Recorder::Take::write_next() {
  Item item;
  {
    std::unique_lock lock(mutex_);
    work_.wait(lock, [this] { return !queue_.empty() || closing_; });
    if (queue_.empty()) return false;
    item = std::move(queue_.front());
    queue_.pop_front();
    ++taken_;
  }
  room_.notify_all();
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  write(item);
  const double taken_s = std::chrono::duration<double>(Clock::now() - begin).count();
  const std::lock_guard lock(mutex_);
  status_.write_s += taken_s;
  status_.worst_write_s = std::max(status_.worst_write_s, taken_s);
  return status_.error.empty();
}

void Recorder::Take::write(const Item& item) {
  const RecordedFrame& frame = item.frame;
  if (!first_number_) {
    first_number_ = frame.number;
    start_ = frame.time;
  }
  const std::int64_t index = frame.number - *first_number_;
  latest_sound_ = start_ + capture::time_of_frame(index, settings_.rate) + most_sound_ahead;
  for_each_output([&](TakeOutput& output, RecordedOutput& told) {
    output.write(index, frame);
    const std::lock_guard lock(mutex_);
    ++told.written;
    status_.written = std::max(status_.written, told.written);
    if (const auto share = output.raised_share()) status_.raised_share = *share;
  });
  write_sounds(item.sounds, latest_sound_);
}

void Recorder::Take::write_sound(std::int64_t first, std::span<const float> samples) {
  for_each_output([&](TakeOutput& output, RecordedOutput&) { output.write_sound(first, samples); });
}

void Recorder::Take::write_sounds(const std::vector<capture::Sound>& sounds, capture::Time latest) {
  if (!sound_) return;
  for (const capture::Sound& chunk : sounds) {
    std::int64_t next = sound_->length();
    const std::optional<LaidSound> laid = sound_->lay(chunk, start_, latest);
    if (!laid) {
      const std::lock_guard lock(mutex_);
      ++status_.sounds_left_out;
      continue;
    }
    const auto channels = static_cast<std::size_t>(settings_.sound_channels);
    const std::vector<float> silence(
        std::min<std::size_t>(static_cast<std::size_t>(laid->silence),
                              static_cast<std::size_t>(settings_.sound_rate)) *
        channels);
    for (std::int64_t left = laid->silence; left > 0;) {
      const std::int64_t count = std::min<std::int64_t>(left, settings_.sound_rate);
      write_sound(next, std::span(silence).first(static_cast<std::size_t>(count) * channels));
      next += count;
      left -= count;
    }
    write_sound(next, laid->samples);
  }
}

void Recorder::Take::close_outputs() {
  for_each_output([](TakeOutput& output, RecordedOutput&) { output.close(); });
}

// Of those that have not failed. One that does is given up, and the others go on.
template <class Act>
void Recorder::Take::for_each_output(const Act& act) {
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    if (!outputs_[i].output) continue;
    try {
      act(*outputs_[i].output, status_.outputs[i]);
    } catch (const std::exception& error) {
      give_up(i, error.what());
    }
  }
}

void Recorder::Take::give_up(std::size_t output, std::string error) {
  const std::unique_ptr<TakeOutput> failed = std::move(outputs_[output].output);
  failed->give_up();
  std::string others;
  for (const NamedOutput& other : outputs_) {
    if (other.output) others += (others.empty() ? "" : ", ") + other.name;
  }
  if (!others.empty()) error += "; the take goes on in " + others;
  {
    const std::lock_guard lock(mutex_);
    RecordedOutput& told = status_.outputs[output];
    told.written = std::min(told.written, failed->pictures());
    told.error = error;
  }
  if (others.empty()) stop(error);
}

// The take as a whole.
void Recorder::Take::stop(const std::string& error) {
  {
    const std::lock_guard lock(mutex_);
    status_.error = error;
    status_.written = 0;
    for (const RecordedOutput& output : status_.outputs) {
      status_.written = std::max(status_.written, output.written);
    }
    // The frame that failed, if it was one, and those behind it.
    status_.dropped += taken_ - status_.written + static_cast<std::int64_t>(queue_.size());
    taken_ = status_.written;
    queue_.clear();
  }
  room_.notify_all();
}

Recorder::Recorder(const RecorderSettings& settings) : take_(std::make_unique<Take>(settings)) {}
Recorder::~Recorder() = default;
bool Recorder::push(RecordedFrame frame) { return take_->push(std::move(frame)); }
void Recorder::wait_for_room() { take_->wait_for_room(); }
RecorderStatus Recorder::status() const { return take_->status(); }
void Recorder::begin_close() { take_->begin_close(); }
void Recorder::close() { take_->close(); }

}  // namespace compositing
