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
#include <libavutil/dict.h>
#include <libavutil/parseutils.h>
}

namespace capture {
namespace {

// Packets that may wait for the other track's turn. Badly interleaved files need some; a hostile
// one gets no more.
constexpr std::int64_t max_waiting_bytes = 64 << 20;

// What the stamps of joined recordings jump by, back and on.
constexpr Time least_jump_back = std::chrono::seconds(1), least_jump_on = std::chrono::seconds(10);
bool is_jump(Time by) { return by < -least_jump_back || by > least_jump_on; }
// Of stamps and times in nanoseconds: 36 years. Sums of a few stay numbers.
bool is_sane(std::int64_t value) {
  constexpr std::int64_t most = std::int64_t{1} << 60;
  return value > -most && value < most;
}
// So many packets may lie between a track's and the other's.
constexpr std::size_t most_ahead = 500;

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

std::optional<Track> MediaFile::track_of(const AVPacket& packet) const {
  if (packet.stream_index == video_->index) return Track::video;
  if (sound_ != nullptr && packet.stream_index == sound_->index) return Track::sound;
  return std::nullopt;
}

// When a packet is, before it is moved; nothing if its stamp is none, or absurd.
std::optional<Time> MediaFile::time_of(const AVPacket& packet, Track track) const {
  const std::int64_t stamp = packet.dts != AV_NOPTS_VALUE ? packet.dts : packet.pts;
  if (stamp == AV_NOPTS_VALUE) return std::nullopt;
  const AVRational base = track == Track::video ? video_->time_base : sound_->time_base;
  const std::int64_t time_ns = av_rescale_q(stamp, base, {1, std::nano::den});
  return is_sane(time_ns) ? std::optional(Time{time_ns}) : std::nullopt;
}

// From where the track's last packet ended.
Time MediaFile::jump_of(const AVPacket& packet, Track track) const {
  const std::optional<Time> time = time_of(packet, track);
  const std::optional<Time>& end = ends_[index(track)];
  return time && end ? *time + moved_by_ - *end : Time{};
}

// The first packet of a track that is still to come; null if it is not near.
const AVPacket* MediaFile::look_ahead(Track track) {
  for (std::size_t i = 0;; ++i) {
    if (i == ahead_.size()) {
      if (i == most_ahead) return nullptr;
      libav::PacketHandle packet = read_as_stamped();
      if (!packet) return nullptr;
      ahead_.push_back(std::move(packet));
    }
    if (track_of(*ahead_[i]) == track) return ahead_[i].get();
  }
}

// A jump of both tracks is a join. Of one alone it is a gap, or a picture that stands for long.
void MediaFile::find_join(const AVPacket& packet, Track track) {
  const AVPacket* const picture = track == Track::video ? &packet : look_ahead(Track::video);
  if (picture == nullptr) return;
  const Time by = jump_of(*picture, Track::video);
  if (!is_jump(by)) return;
  if (by > Time{} && ends_[index(Track::sound)]) {
    const AVPacket* const sound = track == Track::sound ? &packet : look_ahead(Track::sound);
    if (sound != nullptr && !is_jump(jump_of(*sound, Track::sound))) return;
  }
  if (is_sane((moved_by_ - by).count())) moved_by_ -= by;
}

void MediaFile::move(AVPacket& packet, Track track) {
  const std::optional<Time> time = time_of(packet, track);
  if (!time) return;
  const AVStream& stream = track == Track::video ? *video_ : *sound_;
  constexpr AVRational ns{1, std::nano::den};
  const std::int64_t by = av_rescale_q(moved_by_.count(), ns, stream.time_base);
  for (std::int64_t* stamp : {&packet.dts, &packet.pts}) {
    if (*stamp != AV_NOPTS_VALUE && is_sane(*stamp) && is_sane(by)) *stamp += by;
  }
  if (packet.duration <= 0 && stream.r_frame_rate.num > 0 && track == Track::video) {
    packet.duration = av_rescale_q(1, av_inv_q(stream.r_frame_rate), stream.time_base);
  }
  const Time length{av_rescale_q(packet.duration, stream.time_base, ns)};
  ends_[index(track)] = *time + moved_by_ + std::clamp(length, Time{}, least_jump_back);
}

// The next packet of the file, moved.
libav::PacketHandle MediaFile::read() {
  libav::PacketHandle packet;
  if (ahead_.empty()) {
    packet = read_as_stamped();
  } else {
    packet = std::move(ahead_.front());
    ahead_.pop_front();
  }
  at_end_ = !packet;
  if (!packet) return nullptr;
  const std::optional<Track> track = track_of(*packet);
  if (track && stamps_may_jump()) {
    if (is_jump(jump_of(*packet, *track))) find_join(*packet, *track);
    move(*packet, *track);
  }
  if (track == Track::video && packet->pts != AV_NOPTS_VALUE) {
    latest_picture_ = std::max(latest_picture_.value_or(packet->pts), packet->pts);
    if (is_sane(packet->pts) && is_sane(packet->duration))
      pictures_end_ = std::max(pictures_end_, packet->pts + packet->duration);
  }
  return packet;
}

libav::PacketHandle MediaFile::read_as_stamped() {
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
  // Of joined streams, the last part's.
  if (stamps_may_jump()) return std::nullopt;
  if (context_->duration_estimation_method == AVFMT_DURATION_FROM_BITRATE) return std::nullopt;
  const std::int64_t length = context_->duration;  // of any track; AV_NOPTS_VALUE is below 0
  constexpr std::int64_t longest = std::int64_t{AV_TIME_BASE} * 3600 * 24 * 365;
  if (length <= 0 || length > longest) return std::nullopt;
  return Time{length * (std::nano::den / AV_TIME_BASE)};
}

std::optional<Time> MediaFile::missing_pictures() const {
  const std::optional<Time> whole = length();
  if (!whole) return std::nullopt;
  const auto time_ns = [this](std::int64_t stamp) {
    return av_rescale_q(stamp, video_->time_base, {1, std::nano::den});
  };
  const std::int64_t start = video_->start_time == AV_NOPTS_VALUE ? 0 : time_ns(video_->start_time);
  const std::int64_t seen = time_ns(pictures_end_);
  if (!is_sane(start) || !is_sane(seen)) return std::nullopt;
  constexpr std::int64_t rounding_ns = 1'000'000;
  const std::int64_t last = start + whole->count() + rounding_ns;
  std::int64_t end = start + whole->count();  // on the file's own clock
  std::int64_t told_us = 0;
  const AVDictionaryEntry* tag = av_dict_get(video_->metadata, "DURATION", nullptr, 0);
  if (tag != nullptr && av_parse_time(&told_us, tag->value, 1) >= 0) {  // Matroska's
    if (told_us < 0 || told_us > last / 1000) return std::nullopt;
    end = told_us * 1000;
  } else if (video_->nb_frames > 0) {
    const std::int64_t lasts = time_ns(video_->duration);
    if (lasts < 0 || lasts > last - start) return std::nullopt;
    end = start + lasts;
  } else if (sound_ != nullptr || context_->nb_streams != 1) {
    return std::nullopt;
  }
  return Time{end - seen};
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
  ahead_.clear();
  ends_ = {};
  moved_by_ = {};
  latest_picture_.reset();
  return avformat_seek_file(context_.get(), video_->index, INT64_MIN, pts, pts, 0) >= 0;
}

}  // namespace capture
