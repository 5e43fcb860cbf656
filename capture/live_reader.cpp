// Live cameras read ahead.
#include "capture/live_reader.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace capture {

Time monotonic_now() {
  return std::chrono::duration_cast<Time>(std::chrono::steady_clock::now().time_since_epoch());
}

LiveReader::LiveReader(std::unique_ptr<Camera> camera, std::size_t most_waiting)
    : camera_(std::move(camera)), info_(camera_->info()), most_waiting_(most_waiting) {
  if (most_waiting_ == 0) throw std::invalid_argument("a live reader keeps at least one frame");
  thread_ = std::thread([this] { read_all(); });
}

LiveReader::~LiveReader() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  thread_.join();
}

void LiveReader::read_all() {
  Frame last;
  last.number = -1;
  while (true) {
    std::optional<Frame> frame;
    bool fails = false;
    try {
      frame = camera_->next();
    } catch (const std::exception& error) {
      // Ends like a camera that has no more frames: the show goes on without it.
      fails = true;
      frame = last;
      ++frame->number;
      frame->time = std::max(monotonic_now(), last.time + Time{1});
      frame->status = FrameStatus::lost;
      frame->note = error.what();
    }
    if (frame) last = *frame;
    const Time now = monotonic_now();
    const std::lock_guard lock(mutex_);
    statistics_ = camera_->statistics();
    if (!frame || stopping_) {
      ended_ = true;
      came_.notify_all();
      return;
    }
    waiting_.push_back({std::move(*frame), now});
    if (waiting_.size() > most_waiting_) {
      waiting_.pop_front();
      ++passed_over_;
    }
    ended_ = fails;
    came_.notify_all();
    if (fails) return;
  }
}

std::vector<Arrival> LiveReader::take(Time until) {
  std::unique_lock lock(mutex_);
  const std::chrono::steady_clock::time_point end{
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(until)};
  came_.wait_until(lock, end, [&] { return !waiting_.empty() || ended_; });
  std::vector<Arrival> taken{std::make_move_iterator(waiting_.begin()),
                             std::make_move_iterator(waiting_.end())};
  waiting_.clear();
  return taken;
}

bool LiveReader::ended() const {
  const std::lock_guard lock(mutex_);
  return ended_ && waiting_.empty();
}

CameraStatistics LiveReader::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

std::int64_t LiveReader::passed_over() const {
  const std::lock_guard lock(mutex_);
  return passed_over_;
}

}  // namespace capture
