// Pictures of a video stream, deinterlaced.
#include "capture/progressive_video.h"

#include <new>
#include <utility>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/frame.h>
}

namespace capture {
namespace {

// So many lost pictures may lie between one and the next that it is made whole from.
constexpr std::size_t most_between = 8;

bool shows_bottom_first(const AVStream& stream) {
  const AVFieldOrder order = stream.codecpar->field_order;
  return order == AV_FIELD_BB || order == AV_FIELD_TB;
}

libav::FrameHandle share(const AVFrame& frame) {
  libav::FrameHandle shared(av_frame_clone(&frame));
  if (!shared) throw std::bad_alloc();
  return shared;
}

}  // namespace

ProgressiveVideo::ProgressiveVideo(MediaFile& file, bool alpha, std::optional<bool> deinterlace)
    : decoder_(file, alpha),
      deinterlace_(deinterlace),
      bottom_first_(shows_bottom_first(file.video())),
      codes_fields_(file.video().codecpar->codec_id == AV_CODEC_ID_HEVC) {}

bool ProgressiveVideo::is_interlaced(const AVFrame& picture) const {
  return deinterlace_.value_or(false) || picture.interlaced_frame != 0;
}

bool ProgressiveVideo::has_top_field_first(const AVFrame& picture) const {
  return picture.interlaced_frame != 0 ? picture.top_field_first != 0 : !bottom_first_;
}

// Reads a picture ahead. Returns false at the end.
bool ProgressiveVideo::read() {
  if (ended_) return false;
  const std::optional<DecodedPicture> picture = decoder_.next();
  ended_ = !picture;
  if (!picture) return false;
  Held& held = ahead_.emplace_back(Held{*picture, nullptr});
  held.picture.frame = nullptr;
  if (picture->frame == nullptr) return true;
  held.frame = share(*picture->frame);
  return true;
}

// The shown picture made whole; null if it cannot be.
const AVFrame* ProgressiveVideo::make_whole() {
  libav::FrameHandle* after = nullptr;  // the next picture that is not lost, if it is near
  for (std::size_t i = 0; i < most_between && after == nullptr; ++i) {
    if (i == ahead_.size() && !read()) break;
    if (ahead_[i].frame) after = &ahead_[i].frame;
  }
  for (libav::FrameHandle* picture : {&before_, &shown_, after}) {
    if (picture != nullptr && *picture) deinterlacer_.unpack(*picture);
  }
  return deinterlacer_.make_whole(before_.get(), *shown_, after == nullptr ? nullptr : after->get(),
                                  has_top_field_first(*shown_));
}

std::optional<ProgressivePicture> ProgressiveVideo::next(bool wanted) {
  if (ahead_.empty() && !read()) return std::nullopt;
  Held held = std::move(ahead_.front());
  ahead_.pop_front();
  ProgressivePicture picture{std::move(held.picture), Interlacing::none};
  if (!held.frame) return picture;
  before_ = std::exchange(shown_, std::move(held.frame));
  picture.frame = shown_.get();
  if (!is_interlaced(*shown_)) return picture;
  picture.interlacing =
      codes_fields_ && shown_->interlaced_frame != 0 ? Interlacing::field : Interlacing::left;
  if (picture.interlacing == Interlacing::field || !wanted || !deinterlace_.value_or(true))
    return picture;
  const AVFrame* const whole = make_whole();
  picture.frame = whole == nullptr ? shown_.get() : whole;
  if (whole != nullptr) picture.interlacing = Interlacing::removed;
  return picture;
}

void ProgressiveVideo::restart() {
  decoder_.restart();
  ahead_.clear();
  ended_ = false;
  shown_.reset();
  before_.reset();
}

}  // namespace capture
