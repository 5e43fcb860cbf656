// Containers of video and sound.
#include "capture/media_file.h"

#include <unistd.h>
#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

namespace capture {
namespace {

// Packets that may wait for the other track's turn. Badly interleaved files need some; a hostile
// one gets no more.
constexpr std::int64_t max_waiting_bytes = 64 << 20;

// After so many errors in a row a damaged file is at its end.
constexpr int max_read_errors = 32;

// Demuxers that open other files or devices, or take any text for a picture.
constexpr std::array<std::string_view, 12> refused_formats{
    "hls", "concat", "dash", "imf", "sdp", "rtsp", "tty", "adf", "bin", "idf", "xbin", "image2"};

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw std::runtime_error("cannot open " + path + ": " + why);
}

// Keeps the decoders that probe the streams within the bounds of ours.
void find_streams(const std::string& path, AVFormatContext& context) {
  std::vector<AVDictionary*> options(context.nb_streams, nullptr);
  for (AVDictionary*& option : options) {
    av_dict_set_int(&option, "max_pixels", libav::max_image_bytes / std::int64_t{3 * sizeof(float)},
                    0);
    av_dict_set(&option, "threads", "1", 0);
  }
  const int error = avformat_find_stream_info(&context, options.data());
  for (AVDictionary*& option : options) {
    av_dict_free(&option);
  }
  if (error < 0) {
    fail(path, libav::reason(error) + "; is the file whole, and a video?");
  }
}

}  // namespace

void check_is_file(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    fail(path, "no such file");
  }
  if (std::filesystem::is_directory(status)) {
    fail(path, "a folder; for the pictures in it use replay:" + path);
  }
  if (!std::filesystem::is_regular_file(status)) {
    fail(path, "not a plain file");
  }
  if (::access(path.c_str(), R_OK) != 0) {
    fail(path, "no permission to read it");
  }
  if (std::filesystem::file_size(path, error) == 0) {
    fail(path, "it is empty");
  }
}

MediaFile::MediaFile(const std::string& path) : path_(path) {
  check_is_file(path);
  libav::gather_log();
  libav::forget_log();
  AVFormatContext* context = nullptr;
  AVDictionary* options = nullptr;
  av_dict_set(&options, "protocol_whitelist", "file", 0);
  const int error = avformat_open_input(&context, ("file:" + path).c_str(), nullptr, &options);
  av_dict_free(&options);
  if (error < 0) {
    fail(path, libav::reason(error) + "; is the file whole, and a picture or video?");
  }
  context_.reset(context);
  const std::string_view format = context->iformat->name;
  if (std::find(refused_formats.begin(), refused_formats.end(), format) != refused_formats.end()) {
    fail(path, "it is no video by itself, but " + std::string(context->iformat->long_name));
  }
  find_streams(path, *context);

  const int video = av_find_best_stream(context, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (video < 0) {
    fail(path, "there is no video in it that can be decoded");
  }
  video_ = context->streams[video];
  const int sound = av_find_best_stream(context, AVMEDIA_TYPE_AUDIO, -1, video, nullptr, 0);
  if (sound >= 0) {
    sound_ = context->streams[sound];
  }
  for (unsigned i = 0; i < context->nb_streams; ++i) {
    AVStream* stream = context->streams[i];
    if (stream != video_ && stream != sound_) {
      stream->discard = AVDISCARD_ALL;
    }
  }
}

libav::PacketHandle MediaFile::read() {
  libav::PacketHandle packet = libav::make_packet();
  for (int errors = 0; errors < max_read_errors; ++errors) {
    const int error = av_read_frame(context_.get(), packet.get());
    if (error >= 0) {
      return packet;
    }
    if (error == AVERROR_EOF) {
      break;
    }
  }
  at_end_ = true;
  return nullptr;
}

libav::PacketHandle MediaFile::next_packet(Track track) {
  std::deque<libav::PacketHandle>& mine = waiting_[index(track)];
  if (!mine.empty()) {
    libav::PacketHandle packet = std::move(mine.front());
    mine.pop_front();
    waiting_bytes_ -= packet->size;
    return packet;
  }
  const AVStream* wanted = track == Track::video ? video_ : sound_;
  const Track other_track = track == Track::video ? Track::sound : Track::video;
  const AVStream* other = track == Track::video ? sound_ : video_;
  // Sound that nobody reads does not end the video.
  const bool drops = track == Track::video;
  while (wanted != nullptr && (drops || waiting_bytes_ < max_waiting_bytes)) {
    libav::PacketHandle packet = read();
    if (!packet) {
      return nullptr;
    }
    if (packet->stream_index == wanted->index) {
      return packet;
    }
    if (other != nullptr && packet->stream_index == other->index) {
      std::deque<libav::PacketHandle>& others = waiting_[index(other_track)];
      waiting_bytes_ += packet->size;
      others.push_back(std::move(packet));
      while (drops && waiting_bytes_ > max_waiting_bytes) {
        waiting_bytes_ -= others.front()->size;
        others.pop_front();
      }
    }
  }
  return nullptr;
}

void MediaFile::leave_sound_out() {
  if (sound_ == nullptr) return;
  sound_->discard = AVDISCARD_ALL;
  sound_ = nullptr;
  for (const libav::PacketHandle& packet : waiting_[index(Track::sound)]) {
    waiting_bytes_ -= packet->size;
  }
  waiting_[index(Track::sound)].clear();
}

bool MediaFile::stamps_may_jump() const {
  return (context_->iformat->flags & AVFMT_TS_DISCONT) != 0;
}

std::optional<Time> MediaFile::length() const {
  if (context_->duration_estimation_method == AVFMT_DURATION_FROM_BITRATE) return std::nullopt;
  const std::int64_t length = context_->duration;  // of any track; AV_NOPTS_VALUE is below 0
  constexpr std::int64_t longest = std::int64_t{AV_TIME_BASE} * 3600 * 24 * 365;
  if (length <= 0 || length > longest) return std::nullopt;
  return Time{length * (std::nano::den / AV_TIME_BASE)};
}

bool MediaFile::rewind() {
  // These seek by decoding times, and land behind the first picture.
  if (stamps_may_jump()) return false;
  return seek(video_->start_time == AV_NOPTS_VALUE ? 0 : video_->start_time);
}

bool MediaFile::seek(std::int64_t pts) {
  waiting_ = {};
  waiting_bytes_ = 0;
  at_end_ = false;
  return avformat_seek_file(context_.get(), video_->index, INT64_MIN, pts, pts, 0) >= 0;
}

}  // namespace capture
