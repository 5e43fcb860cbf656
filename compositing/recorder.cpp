// Takes: what is pushed waits in a queue, and is written from there.
#include "compositing/recorder.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "compositing/exr_sequence.h"
#include "compositing/fill_and_key.h"
#include "compositing/locked_videos.h"
#include "compositing/output_file.h"
#include "compositing/sound_track.h"
#include "compositing/video_writer.h"

namespace compositing {
namespace {

// Sound of dropped frames that waits for the next frame; at 25 frames per second, 40 s.
constexpr std::size_t most_waiting_sounds = 1024;
// Sound may lie this far ahead of its picture; what lies further has a damaged time.
constexpr capture::Time most_sound_ahead = std::chrono::seconds(10);

// The first frame's label, if there is timecode at this rate.
std::optional<Timecode> first_label(const RecorderSettings& settings) {
  if (settings.start || !allows_timecode(settings.rate)) return settings.start;
  return Timecode{};
}

VideoSettings video_settings(const RecorderSettings& settings) {
  const std::optional<Timecode> first = first_label(settings);
  return {.file = settings.file,
          .rate = settings.rate,
          .width = settings.width,
          .height = settings.height,
          .pixel_aspect = settings.pixel_aspect,
          .codec = settings.codec,
          .crf = settings.crf,
          .transfer = settings.transfer,
          .timecode = first ? to_string(*first) : std::string(),
          .comment = {},
          .sound_channels = settings.sound_channels,
          .sound_rate = settings.sound_rate};
}

bool has_pair(const RecorderSettings& settings) { return !settings.fill_file.empty(); }

VideoSettings fill_settings(const RecorderSettings& settings) {
  VideoSettings fill = video_settings(settings);
  fill.file = settings.fill_file;
  fill.comment =
      "fill of " + std::filesystem::path(settings.key_file).filename().string() +
      ": programme = fill + (1 - key) * plate, in display codes; shaped: do not multiply by key";
  return fill;
}

VideoSettings key_settings(const RecorderSettings& settings) {
  VideoSettings key = video_settings(settings);
  key.file = settings.key_file;
  key.channels = 1;
  key.sound_channels = 0;
  key.comment = "key of " + std::filesystem::path(settings.fill_file).filename().string() +
                ": share of the plate's display codes that is hidden, linear, 0 to 255";
  return key;
}

void require(bool holds, const std::string& reason) {
  if (!holds) throw std::invalid_argument(reason);
}

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
  void write_pair(std::int64_t index, const RecordedFrame& frame);
  std::vector<capture::Sound> take_waiting_sounds();
  void write_sounds(const std::vector<capture::Sound>& sounds, capture::Time latest);
  void write_sound(std::int64_t first, std::span<const float> samples);
  void finish_videos() noexcept;
  void stop(const std::string& what);
  std::string with_all_that_ends(std::string error) const;

  const RecorderSettings settings_;

  // The recording thread's own.
  std::optional<ExrSequence> exr_;
  std::optional<VideoWriter> video_;
  std::optional<LockedVideos> pair_;
  std::optional<FillAndKey> fill_and_key_;
  std::vector<std::uint8_t> fill_, key_;  // of the frame that is written
  std::int64_t raised_pixels_ = 0;
  std::optional<SoundTrack> sound_;
  std::optional<std::int64_t> first_number_;
  capture::Time start_{};
  capture::Time latest_sound_{};
  std::int64_t taken_ = 0;  // frames from the queue, whatever became of them

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
  if (!settings.exr_dir.empty()) {
    exr_.emplace(ExrSequenceSettings{settings.exr_dir, settings.rate, settings.exr_compression,
                                     settings.pixel_aspect});
  }
  if (!settings.file.empty()) video_.emplace(video_settings(settings));
  if (has_pair(settings)) {
    pair_.emplace(fill_settings(settings), key_settings(settings));
    fill_and_key_.emplace(settings.display);
    key_.resize(static_cast<std::size_t>(settings.width) *
                static_cast<std::size_t>(settings.height));
    fill_.resize(key_.size() * 3);
  }
  if ((video_ || pair_) && settings.sound_channels > 0) {
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
    if (video_) video_->close();
    if (pair_) pair_->close();
  } catch (const std::exception& error) {
    stop(error.what());
  }
  // Others may write there from now on.
  video_.reset();
  pair_.reset();
  exr_.reset();
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
  ++status_.written;
  if (!key_.empty()) {
    status_.raised_share =
        static_cast<double>(raised_pixels_) / static_cast<double>(status_.written * key_.size());
  }
  status_.write_s += taken_s;
  status_.worst_write_s = std::max(status_.worst_write_s, taken_s);
  return true;
}

void Recorder::Take::write(const Item& item) {
  const RecordedFrame& frame = item.frame;
  if (!first_number_) {
    first_number_ = frame.number;
    start_ = frame.time;
  }
  const std::int64_t index = frame.number - *first_number_;
  latest_sound_ = start_ + capture::time_of_frame(index, settings_.rate) + most_sound_ahead;
  if (video_) video_->write_picture(index, *frame.display_rgb8);
  if (pair_) write_pair(index, frame);
  write_sounds(item.sounds, latest_sound_);
  if (exr_) {
    const std::optional<Timecode> first = first_label(settings_);
    exr_->write(frame.number, *frame.rgba, *frame.matte,
                first ? std::optional(advance(*first, index, settings_.rate)) : std::nullopt);
  }
}

void Recorder::Take::write_pair(std::int64_t index, const RecordedFrame& frame) {
  raised_pixels_ += fill_and_key_->split(*frame.display_rgb8, *frame.rgba, *frame.plate,
                                         *frame.matte, frame.tone, fill_, key_);
  pair_->write_pictures(index, fill_, key_);
}

void Recorder::Take::write_sound(std::int64_t first, std::span<const float> samples) {
  if (video_) video_->write_sound(first, samples);
  if (pair_) pair_->write_sound(first, samples);
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

// After a failure, which may be another file's: the first error is the one to tell.
void Recorder::Take::finish_videos() noexcept {
  if (pair_) pair_->salvage();
  if (!video_) return;
  try {
    video_->close();
  } catch (const std::exception&) {
    video_->salvage();
  }
}

// What else ends where one output of a take fails.
std::string Recorder::Take::with_all_that_ends(std::string error) const {
  std::string others;
  for (const std::string* file :
       {&settings_.file, &settings_.fill_file, &settings_.key_file, &settings_.exr_dir}) {
    if (file->empty() || error.find(*file) != std::string::npos) continue;
    others += (others.empty() ? "" : ", ") + *file;
  }
  if (others.empty()) return error;
  return error + "; with it the whole take ends: " + others + " too";
}

void Recorder::Take::stop(const std::string& what) {
  const std::string error = with_all_that_ends(what);
  finish_videos();
  {
    const std::lock_guard lock(mutex_);
    status_.error = error;
    if (video_) status_.written = std::min(status_.written, video_->pictures());
    if (pair_) status_.written = std::min(status_.written, pair_->pictures());
    // The frame that failed, if it was one, and those behind it.
    status_.dropped += taken_ - status_.written + static_cast<std::int64_t>(queue_.size());
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
