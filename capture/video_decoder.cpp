// Pictures of a video stream in order.
#include "capture/video_decoder.h"

#include <stdexcept>
#include <string_view>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

namespace capture {
namespace {

constexpr int decoder_threads = 2;

// More packets than any codec holds back; older ones will never come out.
constexpr std::size_t max_awaited = 48;

// A decoder that reports so many errors without taking a packet will not go on.
constexpr int max_stalled = 16;

// Matroska has the alpha of VP8 and VP9 as a second stream beside each packet, which libav's own
// decoders pass over.
const char* decoder_with_alpha(const AVStream& stream) {
  const AVDictionaryEntry* mode = av_dict_get(stream.metadata, "alpha_mode", nullptr, 0);
  if (mode == nullptr || std::string_view(mode->value) != "1") return nullptr;
  if (stream.codecpar->codec_id == AV_CODEC_ID_VP8) return "libvpx";
  return stream.codecpar->codec_id == AV_CODEC_ID_VP9 ? "libvpx-vp9" : nullptr;
}

}  // namespace

VideoDecoder::VideoDecoder(MediaFile& file, bool alpha) : file_(file), frame_(libav::make_frame()) {
  const AVStream& stream = file.video();
  const auto fail = [&](const std::string& why) {
    throw std::runtime_error("cannot open " + file.path() + ": " + why);
  };
  try {
    context_ = libav::make_decoder(stream.codecpar->codec_id, decoder_threads, &complaints_,
                                   alpha ? decoder_with_alpha(stream) : nullptr);
    if (stream.codecpar->width > 0 && stream.codecpar->height > 0) {
      libav::check_size(stream.codecpar->width, stream.codecpar->height);
    }
  } catch (const std::runtime_error& error) {
    fail(error.what());
  }
  int error = avcodec_parameters_to_context(context_.get(), stream.codecpar);
  context_->pkt_timebase = stream.time_base;
  // Pictures with errors are better than none.
  context_->flags |= AV_CODEC_FLAG_OUTPUT_CORRUPT;
  if (error >= 0) {
    error = avcodec_open2(context_.get(), context_->codec, nullptr);
  }
  if (error < 0) {
    fail(libav::reason(error));
  }
}

void VideoDecoder::note_error(int error) {
  ++errors_;
  error_note_ = "could not be decoded: " + libav::reason(error);
  const std::string complaint = complaints_.take();
  if (!complaint.empty()) {
    error_note_ += " (" + complaint + ")";
  }
  libav::forget_log();
}

bool VideoDecoder::feed() {
  if (drained_) {
    return false;
  }
  const libav::PacketHandle packet = file_.next_packet(Track::video);
  if (!packet) {
    drained_ = true;
    avcodec_send_packet(context_.get(), nullptr);
    return true;
  }
  if (!in_decoding_order_) {
    in_decoding_order_ = context_->has_b_frames > 0 && packet->pts == packet->dts;
  }
  const bool shown = (packet->flags & AV_PKT_FLAG_DISCARD) == 0;
  if (shown && packet->pts != AV_NOPTS_VALUE) {
    awaited_.insert(packet->pts);
    if (awaited_.size() > max_awaited) {
      lose_before(*awaited_.begin() + 1);
    }
  }
  const int error = avcodec_send_packet(context_.get(), packet.get());
  stalled_ = 0;
  if (error < 0 && error != AVERROR(EAGAIN) && shown) {
    note_error(error);
    if (packet->pts == AV_NOPTS_VALUE) {
      lose_before(std::nullopt);
    } else if (*in_decoding_order_) {
      lose_before(*awaited_.begin() + 1);
    }
  }
  return true;
}

// Packets to be shown before `pts` that have not come out by now never will. Those that errors were
// reported for are lost; the others had nothing to show. Without times, an error is a lost picture.
void VideoDecoder::lose_before(std::optional<std::int64_t> pts) {
  const auto lose = [&](std::optional<std::int64_t> lost_pts) {
    ready_.push_back({nullptr, lost_pts, FrameStatus::lost, error_note_});
    --errors_;
  };
  if (!pts) {
    while (errors_ > 0) {
      lose(std::nullopt);
    }
    return;
  }
  const auto end = awaited_.lower_bound(*pts);
  for (auto packet = awaited_.begin(); packet != end; ++packet) {
    if (errors_ > 0) {
      lose(*packet);
    }
  }
  awaited_.erase(awaited_.begin(), end);
}

void VideoDecoder::take(AVFrame& frame) {
  DecodedPicture picture{&frame, std::nullopt, FrameStatus::good, {}};
  if (*in_decoding_order_ && !awaited_.empty()) {
    picture.pts = *awaited_.begin();
    awaited_.erase(awaited_.begin());
  } else if (frame.pts != AV_NOPTS_VALUE) {
    lose_before(frame.pts);
    const auto its = awaited_.find(frame.pts);
    if (its != awaited_.end()) {
      awaited_.erase(its);
    }
  }
  if (!picture.pts && frame.best_effort_timestamp != AV_NOPTS_VALUE) {
    picture.pts = frame.best_effort_timestamp;
  }
  const std::string complaint = complaints_.take();
  if ((frame.flags & AV_FRAME_FLAG_CORRUPT) != 0 || frame.decode_error_flags != 0 ||
      !complaint.empty()) {
    picture.status = FrameStatus::damaged;
    picture.note = "decoded with errors" + (complaint.empty() ? "" : ": " + complaint);
  }
  ready_.push_back(picture);
}

std::optional<DecodedPicture> VideoDecoder::next() {
  while (ready_.empty()) {
    const int error = avcodec_receive_frame(context_.get(), frame_.get());
    if (error >= 0) {
      take(*frame_);
    } else if (error == AVERROR(EAGAIN)) {
      feed();
    } else if (error == AVERROR_EOF) {
      if (awaited_.empty() || errors_ == 0) {
        return std::nullopt;
      }
      lose_before(*awaited_.rbegin() + 1);
    } else {
      note_error(error);
      if (awaited_.empty()) {
        lose_before(std::nullopt);
      }
      if (++stalled_ > max_stalled) {
        return std::nullopt;
      }
    }
  }
  DecodedPicture picture = std::move(ready_.front());
  ready_.pop_front();
  return picture;
}

void VideoDecoder::restart() {
  avcodec_flush_buffers(context_.get());
  ready_.clear();
  awaited_.clear();
  errors_ = 0;
  stalled_ = 0;
  drained_ = false;
}

}  // namespace capture
