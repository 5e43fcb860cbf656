// The sound of a container on the clock of its frames.
#include "capture/sound_decoder.h"

#include <algorithm>
#include <stdexcept>
#include <string>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswresample/swresample.h>
}

namespace capture {
namespace {

constexpr std::chrono::seconds max_untaken{10};
// Of one piece at most; longer ones begin later.
constexpr std::int64_t longest_piece_s = 60, most_samples = std::int64_t{1} << 26;

// Sound is no farther than this ahead of the pictures that lie beside it, and no later after the
// end of the file.
constexpr std::int64_t most_ahead_s = 30, most_behind_end_s = 10;

// Time stamps are rounded (to 1 ms in Matroska): what lies so close to the end of the sound before
// it follows without a gap.
constexpr int joins_per_second = 200;

constexpr int max_channels = 64;
constexpr int max_rate = 768'000;  // twice what any recorder has; memory goes with it

}  // namespace

SoundDecoder::SoundDecoder(MediaFile& file)
    : file_(file), frame_(libav::make_frame()), resampled_from_(libav::make_frame()) {
  const AVStream& stream = *file.sound();
  context_ = libav::make_decoder(stream.codecpar->codec_id, 1, nullptr);
  int error = avcodec_parameters_to_context(context_.get(), stream.codecpar);
  context_->pkt_timebase = stream.time_base;
  if (error >= 0) {
    error = avcodec_open2(context_.get(), context_->codec, nullptr);
  }
  if (error < 0) {
    throw std::runtime_error(libav::reason(error));
  }
  channels_ = stream.codecpar->ch_layout.nb_channels;
  rate_ = stream.codecpar->sample_rate;
  if (channels_ < 1 || channels_ > max_channels || rate_ < 1) {
    throw std::runtime_error("it names no rate or channels");
  }
  if (rate_ > max_rate) {
    throw std::runtime_error("its rate is " + std::to_string(rate_) + " Hz, above the limit of " +
                             std::to_string(max_rate) + " Hz");
  }
}

std::int64_t SoundDecoder::sample_at(Time time) const {
  return av_rescale_rnd(time.count(), rate_, std::nano::den, AV_ROUND_DOWN);
}

// Of a stamp, whatever it is: sums of a few stay numbers.
std::int64_t SoundDecoder::samples_of(std::int64_t stamp, const AVStream& stream) const {
  constexpr std::int64_t most = std::int64_t{1} << 60;
  return std::clamp(av_rescale_q(stamp, stream.time_base, {1, rate_}), -most, most);
}

std::int64_t SoundDecoder::length(const Segment& segment) const {
  return static_cast<std::int64_t>(segment.samples.size()) / channels_;
}

void SoundDecoder::begin(std::int64_t first_pts, Time start) {
  avcodec_flush_buffers(context_.get());
  floor_ = sample_at(start);
  offset_ = floor_ - samples_of(first_pts, file_.video());
  decoded_ = floor_;
  at_end_ = false;
}

bool SoundDecoder::follow(SoundDecoder& before) {
  if (before.channels_ != channels_ || before.rate_ != rate_) return false;
  taken_ = before.taken_;
  segments_ = std::move(before.segments_);
  return true;
}

void SoundDecoder::skip_to(Time from) { taken_ = std::max(taken_, sample_at(from)); }

void SoundDecoder::drop_taken() {
  while (!segments_.empty() && segments_.front().position + length(segments_.front()) <= taken_) {
    segments_.pop_front();
  }
}

void SoundDecoder::keep_up(Time until) {
  skip_to(until - max_untaken);
  const std::int64_t end = sample_at(until);
  while (decoded_ <= end && decode_packet(true)) drop_taken();
  drop_taken();
}

std::optional<Sound> SoundDecoder::take(Time until) {
  const std::int64_t end = sample_at(until) + 1;
  taken_ = std::max(taken_, end - std::min(longest_piece_s * rate_, most_samples / channels_));
  while (decoded_ < end && decode_packet(false)) {
  }
  if (end <= taken_) {
    return std::nullopt;
  }
  Sound sound{Time{av_rescale(taken_, std::nano::den, rate_)}, channels_, rate_, {}};
  sound.samples.resize(static_cast<std::size_t>((end - taken_) * channels_), 0.0F);
  for (const Segment& segment : segments_) {
    const std::int64_t from = std::max(segment.position, taken_);
    const std::int64_t to = std::min(segment.position + length(segment), end);
    if (from < to) {
      std::copy(segment.samples.begin() + (from - segment.position) * channels_,
                segment.samples.begin() + (to - segment.position) * channels_,
                sound.samples.begin() + (from - taken_) * channels_);
    }
  }
  taken_ = end;
  drop_taken();
  return sound;
}

void SoundDecoder::finish(Time end_time) {
  const std::int64_t end = sample_at(end_time);
  while (decoded_ < end && decode_packet(false)) {
  }
  while (!segments_.empty() && segments_.back().position >= end) {
    segments_.pop_back();
  }
  if (!segments_.empty()) {
    Segment& last = segments_.back();
    const std::int64_t kept = std::min(length(last), end - last.position);
    last.samples.resize(static_cast<std::size_t>(kept * channels_));
  }
}

// Returns whether there was anything to decode.
bool SoundDecoder::decode_packet(bool only_waiting) {
  if (at_end_ || (only_waiting && !file_.has_packet(Track::sound))) {
    return false;
  }
  const libav::PacketHandle packet = file_.next_packet(Track::sound);
  if (!packet && !file_.at_end()) {
    return false;  // so many pictures lie before it that they are to be read first
  }
  at_end_ = !packet;
  // Damaged packets leave silence.
  if (avcodec_send_packet(context_.get(), packet.get()) < 0) {
    return true;
  }
  while (avcodec_receive_frame(context_.get(), frame_.get()) >= 0) {
    take_frame(*frame_);
  }
  return true;
}

void SoundDecoder::take_frame(const AVFrame& frame) {
  const AVFrame& made_for = *resampled_from_;
  if (!resampler_ || made_for.sample_rate != frame.sample_rate || made_for.format != frame.format ||
      av_channel_layout_compare(&made_for.ch_layout, &frame.ch_layout) != 0) {
    SwrContext* resampler = nullptr;
    AVChannelLayout wanted = file_.sound()->codecpar->ch_layout;  // not changed, but not const
    AVChannelLayout given = frame.ch_layout;
    const int error = swr_alloc_set_opts2(&resampler, &wanted, AV_SAMPLE_FMT_FLT, rate_, &given,
                                          static_cast<AVSampleFormat>(frame.format),
                                          frame.sample_rate, 0, nullptr);
    resampler_.reset(resampler);
    if (error < 0 || swr_init(resampler) < 0) {
      resampler_.reset();
      return;
    }
    resampled_from_->sample_rate = frame.sample_rate;
    resampled_from_->format = frame.format;
    av_channel_layout_copy(&resampled_from_->ch_layout, &given);
  }
  const int room = swr_get_out_samples(resampler_.get(), frame.nb_samples);
  if (room < 1) {
    return;
  }
  std::vector<float> samples(static_cast<std::size_t>(room) * static_cast<std::size_t>(channels_));
  auto* to = reinterpret_cast<std::uint8_t*>(samples.data());
  const int count =
      swr_convert(resampler_.get(), &to, room,
                  const_cast<const std::uint8_t**>(frame.extended_data), frame.nb_samples);
  if (count < 1) {
    return;
  }
  samples.resize(static_cast<std::size_t>(count) * static_cast<std::size_t>(channels_));
  const std::int64_t stamp = frame.best_effort_timestamp;
  add(stamp != AV_NOPTS_VALUE ? position_of(stamp) : decoded_, std::move(samples));
}

// Where stamps are damaged it follows the sound before.
std::int64_t SoundDecoder::position_of(std::int64_t stamp) const {
  const std::int64_t stamped = offset_ + samples_of(stamp, *file_.sound());
  if (std::abs(stamped - decoded_) <= rate_ / joins_per_second) return decoded_;
  if (const auto picture = file_.latest_picture()) {
    const std::int64_t beside = offset_ + samples_of(*picture, file_.video());
    if (stamped > beside + most_ahead_s * rate_) return decoded_;
  }
  if (const auto length = file_.length()) {
    if (stamped > floor_ + sample_at(*length) + most_behind_end_s * rate_) return decoded_;
  }
  return stamped;
}

void SoundDecoder::add(std::int64_t position, std::vector<float> samples) {
  const std::int64_t count = static_cast<std::int64_t>(samples.size()) / channels_;
  const std::int64_t before = std::clamp(floor_ - position, std::int64_t{0}, count);
  samples.erase(samples.begin(), samples.begin() + before * channels_);
  decoded_ = position + count;
  if (!samples.empty()) {
    segments_.push_back({position + before, std::move(samples)});
  }
}

}  // namespace capture
