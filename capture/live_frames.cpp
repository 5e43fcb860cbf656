// Frames of live cameras.
#include "capture/live_frames.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace capture {
namespace {

constexpr std::uint64_t most_missing = 250;  // a larger gap is one in the numbers

}  // namespace

std::string words_of_missing(std::uint64_t missing) {
  return "the camera left out " + std::to_string(missing) + (missing == 1 ? " frame" : " frames");
}

void LiveFrames::set_layout(const CodedLayout& layout, const Crop& crop) {
  reader_.emplace(layout, curves_);
  layout_ = layout;
  crop_ = crop;
}

void LiveFrames::add(std::span<const std::byte> bytes, const std::string& fault, Frame frame) {
  try {
    read(bytes, fault, frame);
  } catch (const std::runtime_error& error) {
    frame.status = FrameStatus::lost;
    frame.note = error.what();
  }
  push(std::move(frame));
}

void LiveFrames::read(std::span<const std::byte> bytes, const std::string& fault, Frame& frame) {
  if (keep_coded_) {
    const std::shared_ptr<CodedPicture> coded = coded_pool_.lend();
    coded->layout = layout_;
    coded->bytes.assign(bytes.begin(), bytes.end());
    frame.coded = coded;
  }
  std::shared_ptr<Image> image = pool_.lend();
  std::string wrong = reader_->read(bytes, crop_, *image);
  if (wrong.empty()) wrong = fault;
  if (!wrong.empty()) {
    frame.status = FrameStatus::damaged;
    frame.note = wrong;
  }
  last_image_ = std::move(image);
}

void LiveFrames::lose(Time time, const std::string& note) {
  Frame frame;
  frame.time = time;
  frame.status = FrameStatus::lost;
  frame.note = note;
  push(std::move(frame));
}

void LiveFrames::lose_between(std::uint64_t missing, Time time, const std::string& note) {
  if (!last_time_) return;
  const Time before = *last_time_;
  const auto shown = static_cast<std::int64_t>(missing > most_missing ? 1 : missing);
  for (std::int64_t i = 1; i <= shown; ++i) {
    lose(before + (time - before) * i / (shown + 1), note);
  }
}

// Completes a frame: its number, its picture, and a time after the one before.
void LiveFrames::push(Frame frame) {
  if (last_time_) frame.time = std::max(frame.time, *last_time_ + Time{1});
  last_time_ = frame.time;
  last_note_ = frame.note;
  frame.number = number_++;
  frame.image = last_image_;
  ready_.push_back(std::move(frame));
}

void LiveFrames::begin() {
  ready_.erase(ready_.begin(), ready_.end() - (ready_.empty() ? 0 : 1));
  for (Frame& frame : ready_) frame.number = 0;
  number_ = static_cast<std::int64_t>(ready_.size());
}

Frame LiveFrames::take() {
  Frame frame = std::move(ready_.front());
  ready_.pop_front();
  ++statistics_.delivered;
  statistics_.lost += frame.status == FrameStatus::lost ? 1 : 0;
  statistics_.damaged += frame.status == FrameStatus::damaged ? 1 : 0;
  return frame;
}

}  // namespace capture
