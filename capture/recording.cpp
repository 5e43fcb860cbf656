// Recordings of cameras.
#include "capture/recording.h"

#include <array>
#include <charconv>
#include <cstdio>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "capture/coded_file.h"

namespace capture {
namespace {

constexpr std::size_t most_waiting = 64;  // frames

std::string_view word_of(FrameStatus status) {
  switch (status) {
    case FrameStatus::good:
      return "good";
    case FrameStatus::damaged:
      return "damaged";
    case FrameStatus::lost:
      return "lost";
  }
  return "lost";
}

// Seconds to the nanosecond, whatever the locale.
std::string seconds_of(Time time) {
  constexpr std::int64_t per_second = 1'000'000'000;
  const std::int64_t whole = time.count() / per_second;
  char text[40];
  std::snprintf(text, sizeof(text), "%lld.%09lld", static_cast<long long>(whole),
                static_cast<long long>(time.count() % per_second));
  return text;
}

// The fewest digits that give the same double again.
std::string exactly(double value) {
  std::array<char, 40> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  return {digits.data(), end};
}

}  // namespace

FrameRecording::FrameRecording(const std::filesystem::path& folder) : folder_(folder) {
  const std::filesystem::path list = folder / "frames.csv";
  const auto fail = [&](const std::string& why) {
    throw std::runtime_error("cannot record into " + folder.string() + ": " + why);
  };
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) fail(error.message());
  if (std::filesystem::exists(list, error)) fail("it holds a recording; name another folder");
  list_.open(list);
  list_ << "file,time_s,exposure_s,status\n" << std::flush;
  if (!list_) fail("frames.csv cannot be written");
  writer_ = std::thread([this] { write_all(); });
}

FrameRecording::~FrameRecording() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  changed_.notify_all();
  if (writer_.joinable()) writer_.join();
}

void FrameRecording::rethrow() const {
  if (!failure_.empty()) throw std::runtime_error(failure_);
}

void FrameRecording::add(const Frame& frame) {
  if (!frame.coded && frame.status != FrameStatus::lost) {
    throw std::invalid_argument("only frames with the bytes that came can be recorded");
  }
  {
    const std::lock_guard lock(mutex_);
    rethrow();
    if (statistics_.frames == 0) first_ = frame.time;
    ++statistics_.frames;
    queue_.push_back(frame);
    Frame& queued = queue_.back();
    queued.image.reset();  // its memory is the camera's
    if (queued.status == FrameStatus::lost) {
      ++statistics_.lost;
      queued.coded.reset();
    } else if (queue_.size() > most_waiting) {
      ++statistics_.skipped;
      queued.status = FrameStatus::lost;
      queued.coded.reset();
    }
  }
  changed_.notify_all();
}

void FrameRecording::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  changed_.notify_all();
  if (writer_.joinable()) writer_.join();
  const std::lock_guard lock(mutex_);
  rethrow();
}

RecordingStatistics FrameRecording::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

void FrameRecording::write_all() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return finishing_ || !queue_.empty(); });
    if (queue_.empty()) return;
    const Frame frame = std::move(queue_.front());
    queue_.pop_front();
    if (!failure_.empty()) continue;
    lock.unlock();
    std::string failure;
    try {
      write(frame);
    } catch (const std::exception& error) {
      failure = error.what();
    }
    lock.lock();
    failure_ = failure;
    if (!failure_.empty()) {  // what is queued will not be written either
      statistics_.frames = kept_;
      continue;
    }
    ++kept_;
    if (frame.coded) statistics_.bytes += static_cast<std::int64_t>(frame.coded->bytes.size());
  }
}

void FrameRecording::write(const Frame& frame) {
  std::string name;
  if (frame.coded) {
    char digits[32];
    std::snprintf(digits, sizeof(digits), "%06lld.coded", static_cast<long long>(written_));
    name = digits;
    write_coded_file((folder_ / name).string(), *frame.coded);
  }
  ++written_;
  list_ << name << ',' << seconds_of(frame.time - first_) << ',' << exactly(frame.exposure_s) << ','
        << word_of(frame.status) << '\n'
        << std::flush;
  if (!list_) {
    throw std::runtime_error("cannot write " + (folder_ / "frames.csv").string() +
                             ": is the disk full?");
  }
}

}  // namespace capture
