// A Matroska file with one picture track, maybe one sound track, and a timecode.
#include "compositing/video_writer.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>
#include <vector>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
#include <libavutil/opt.h>
}

#include "capture/libav.h"
#include "compositing/output_file.h"
#include "compositing/yuv420.h"

namespace compositing {
namespace {

// A killed writer, or a full disk, loses at most the cluster that is being gathered.
constexpr int cluster_limit_ms = 500;
constexpr int cluster_limit_bytes = 1 << 20;
constexpr std::size_t checkpoints_kept = 8;

AVRational av_rational(capture::Rational rate) {
  return {static_cast<int>(rate.num), static_cast<int>(rate.den)};
}

void require(bool holds, const std::string& reason) {
  if (!holds) throw std::invalid_argument(reason);
}

bool is_lossless(const VideoSettings& settings) { return settings.codec == "lossless"; }
bool is_grey(const VideoSettings& settings) { return settings.channels == 1; }
bool is_rgb(const VideoSettings& settings) { return is_lossless(settings) && !is_grey(settings); }

AVPixelFormat pixel_format(const VideoSettings& settings) {
  if (is_grey(settings)) return AV_PIX_FMT_GRAY8;
  return is_rgb(settings) ? AV_PIX_FMT_RGB24 : AV_PIX_FMT_YUV420P;
}

capture::libav::CodecContext open_encoder(const VideoSettings& settings) {
  const bool rgb = is_rgb(settings), full_range = rgb || is_grey(settings);
  const AVCodec* const codec = avcodec_find_encoder_by_name(rgb ? "libx264rgb" : "libx264");
  if (codec == nullptr) {
    throw std::runtime_error(settings.file +
                             ": this libavcodec has no libx264: install one that has");
  }
  capture::libav::CodecContext encoder(avcodec_alloc_context3(codec));
  if (!encoder) throw std::bad_alloc();
  encoder->width = settings.width;
  encoder->height = settings.height;
  encoder->pix_fmt = pixel_format(settings);
  encoder->sample_aspect_ratio = av_rational(settings.pixel_aspect);
  encoder->framerate = av_rational(settings.rate);
  encoder->time_base = av_inv_q(encoder->framerate);
  encoder->gop_size = std::max(1, static_cast<int>(std::lround(settings.rate.value())));
  encoder->thread_count = 1;  // the show needs the other cores; ultrafast keeps up
  encoder->color_primaries = AVCOL_PRI_BT709;
  encoder->color_trc =
      settings.transfer == capture::Transfer::srgb ? AVCOL_TRC_IEC61966_2_1 : AVCOL_TRC_BT709;
  encoder->colorspace = rgb ? AVCOL_SPC_RGB : AVCOL_SPC_BT709;
  encoder->color_range = full_range ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
  encoder->chroma_sample_location = full_range ? AVCHROMA_LOC_UNSPECIFIED : AVCHROMA_LOC_LEFT;
  encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  av_opt_set(encoder->priv_data, "preset", "ultrafast", 0);
  av_opt_set(encoder->priv_data, "tune", "zerolatency", 0);
  if (is_lossless(settings)) {
    av_opt_set(encoder->priv_data, "qp", "0", 0);
  } else {
    av_opt_set(encoder->priv_data, "crf", std::to_string(settings.crf).c_str(), 0);
  }
  capture::libav::forget_log();
  if (const int error = avcodec_open2(encoder.get(), codec, nullptr); error < 0) {
    throw std::runtime_error(settings.file +
                             ": the encoder does not start: " + capture::libav::reason(error));
  }
  return encoder;
}

// Interleaved floats as little-endian integers of 24 bits.
void append_24_bits(std::span<const float> samples, std::uint8_t* out) {
  constexpr float full_scale = 8388608.0F;
  for (const float sample : samples) {
    const float scaled = std::isnan(sample) ? 0.0F : std::round(sample * full_scale);
    const auto code = static_cast<std::int32_t>(std::clamp(scaled, -full_scale, full_scale - 1));
    *out++ = static_cast<std::uint8_t>(code & 0xff);
    *out++ = static_cast<std::uint8_t>(code >> 8 & 0xff);
    *out++ = static_cast<std::uint8_t>(code >> 16 & 0xff);
  }
}

}  // namespace

void validate(const VideoSettings& settings) {
  constexpr int largest_side = 16384;  // H.264 ends there
  const std::string& file = settings.file;
  require(std::filesystem::path(file).extension() == ".mkv",
          "\"" + file + "\": takes are Matroska files, name it *.mkv");
  constexpr std::int64_t largest = std::numeric_limits<int>::max();
  const capture::Rational rate = settings.rate;
  require(rate.num > 0 && rate.den > 0 && rate.num <= largest && rate.den <= largest &&
              rate.value() <= 1000 && rate.value() >= 0.001,
          "a take has 0.001 to 1000 frames per second, not " + std::to_string(rate.num) + "/" +
              std::to_string(rate.den));
  require(settings.width >= 1 && settings.height >= 1 && settings.width <= largest_side &&
              settings.height <= largest_side,
          "a take has 1 to 16384 rows and columns, not " + std::to_string(settings.width) + " x " +
              std::to_string(settings.height));
  const capture::Rational aspect = settings.pixel_aspect;
  require(aspect.num > 0 && aspect.den > 0 && aspect.num <= largest && aspect.den <= largest,
          "a pixel's aspect is above 0, not " + std::to_string(aspect.num) + "/" +
              std::to_string(aspect.den));
  require(settings.codec == "h264" || settings.codec == "lossless",
          "no codec \"" + settings.codec + "\"; there are \"h264\" and \"lossless\"");
  require(settings.channels == 1 || settings.channels == 3,
          "a take's pictures have 1 or 3 channels, not " + std::to_string(settings.channels));
  require(is_lossless(settings) || (settings.width % 2 == 0 && settings.height % 2 == 0),
          "H.264 needs an even width and height, not " + std::to_string(settings.width) + " x " +
              std::to_string(settings.height) + "; [record] codec = \"lossless\" takes any");
  require(settings.crf >= 0 && settings.crf <= 51,
          "H.264's rate factor lies in 0..51, not " + std::to_string(settings.crf));
  require(
      settings.transfer == capture::Transfer::rec1886 ||
          settings.transfer == capture::Transfer::srgb,
      "a take is tagged Rec.1886 or sRGB, not " + std::string(capture::name_of(settings.transfer)));
  require(settings.sound_channels >= 0 && settings.sound_channels <= 64,
          "sound has up to 64 channels, not " + std::to_string(settings.sound_channels));
  require(
      settings.sound_channels == 0 ||
          (settings.sound_rate >= 1000 && settings.sound_rate <= 768000),
      "sound has 1000 to 768000 samples per second, not " + std::to_string(settings.sound_rate));
}

// All pictures up to `index` are whole in the file's first `place` bytes.
struct Checkpoint {
  std::int64_t index = 0;
  std::int64_t place = 0;
  std::int64_t pictures = 0;
};

struct VideoWriter::State {
  struct FreeOutput {
    void operator()(AVFormatContext* context) const { avformat_free_context(context); }
  };

  explicit State(const VideoSettings& given)
      : settings(given), encoder(open_encoder(given)), file(given.file) {}

  void begin();
  bool is_open() const { return begun && !finished; }
  void open_streams();
  void write_packet(AVPacket* packet, const AVStream* stream, AVRational time_base);
  void encode(const AVFrame* picture_or_end);
  void write_gathered();
  void give_gathered_up();
  std::int64_t room_for_index() const;
  void end_shortened(std::int64_t place);
  [[noreturn]] void fail(const char* what, int error) const {
    throw std::runtime_error(settings.file + ": " + what + ": " + capture::libav::reason(error));
  }

  VideoSettings settings;
  capture::libav::CodecContext encoder;
  OutputFile file;  // outlives the muxer
  std::unique_ptr<AVFormatContext, FreeOutput> muxer;
  AVStream* picture_stream = nullptr;
  AVStream* sound_stream = nullptr;
  capture::libav::FrameHandle picture = capture::libav::make_frame();
  capture::libav::PacketHandle packet = capture::libav::make_packet();
  std::optional<Yuv420Converter> converter;
  std::int64_t last_index = -1;
  std::int64_t next_sample = 0;
  std::vector<Checkpoint> checkpoints;  // the last few
  std::int64_t pictures = 0;            // that the muxer has; after a failure, that the file has
  std::int64_t end = 0;                 // the index after the last of them
  bool begun = false, drained = false, finished = false;
};

// The header. Until then what was in the file stays.
void VideoWriter::State::begin() {
  if (begun) return;
  open_streams();
  begun = true;
}

void VideoWriter::State::open_streams() {
  AVFormatContext* context = nullptr;
  if (avformat_alloc_output_context2(&context, nullptr, "matroska", nullptr) < 0) {
    throw std::bad_alloc();
  }
  muxer.reset(context);
  muxer->pb = file.context();
  muxer->flags |= AVFMT_FLAG_CUSTOM_IO | AVFMT_FLAG_FLUSH_PACKETS;
  if (settings.repeatable) muxer->flags |= AVFMT_FLAG_BITEXACT;

  picture_stream = avformat_new_stream(context, nullptr);
  if (picture_stream == nullptr) throw std::bad_alloc();
  if (avcodec_parameters_from_context(picture_stream->codecpar, encoder.get()) < 0) {
    throw std::bad_alloc();
  }
  picture_stream->sample_aspect_ratio = encoder->sample_aspect_ratio;
  picture_stream->time_base = encoder->time_base;
  picture_stream->avg_frame_rate = encoder->framerate;
  picture_stream->r_frame_rate = encoder->framerate;
  if (!settings.timecode.empty()) {
    av_dict_set(&picture_stream->metadata, "timecode", settings.timecode.c_str(), 0);
    av_dict_set(&muxer->metadata, "timecode", settings.timecode.c_str(), 0);
  }
  if (!settings.comment.empty()) {
    av_dict_set(&muxer->metadata, "comment", settings.comment.c_str(), 0);
  }
  if (settings.sound_channels > 0) {
    sound_stream = avformat_new_stream(context, nullptr);
    if (sound_stream == nullptr) throw std::bad_alloc();
    AVCodecParameters* const sound = sound_stream->codecpar;
    sound->codec_type = AVMEDIA_TYPE_AUDIO;
    sound->codec_id = AV_CODEC_ID_PCM_S24LE;
    sound->bits_per_coded_sample = 24;
    sound->sample_rate = settings.sound_rate;
    sound->block_align = 3 * settings.sound_channels;
    av_channel_layout_default(&sound->ch_layout, settings.sound_channels);
    sound_stream->time_base = {1, settings.sound_rate};
  }
  AVDictionary* options = nullptr;
  av_dict_set_int(&options, "cluster_time_limit", cluster_limit_ms, 0);
  av_dict_set_int(&options, "cluster_size_limit", cluster_limit_bytes, 0);
  capture::libav::forget_log();
  const int error = avformat_write_header(context, &options);
  av_dict_free(&options);
  if (error < 0) fail("the header cannot be written", error);
  file.mark({});
}

void VideoWriter::State::write_packet(AVPacket* ready,
                                      const AVStream* stream,
                                      AVRational time_base) {
  const std::int64_t pts = ready->pts;
  ready->stream_index = stream->index;
  av_packet_rescale_ts(ready, time_base, stream->time_base);
  // Not interleaved by libav: it would hold pictures back until sound comes, and sound may end.
  const int error = av_write_frame(muxer.get(), ready);
  av_packet_unref(ready);
  if (error < 0) fail("writing failed", error);
  // The muxer gathers a cluster, and writes it at once when the next one starts: now, perhaps.
  file.mark({pictures, end});
  if (stream == picture_stream) {
    ++pictures;
    end = std::max(end, pts + 1);
  }
  file.require_there(false);
}

void VideoWriter::State::encode(const AVFrame* picture_or_end) {
  capture::libav::forget_log();
  int error = avcodec_send_frame(encoder.get(), picture_or_end);
  if (error < 0) fail("encoding failed", error);
  while ((error = avcodec_receive_packet(encoder.get(), packet.get())) >= 0) {
    packet->duration = 1;
    write_packet(packet.get(), picture_stream, encoder->time_base);
  }
  if (error != AVERROR(EAGAIN) && error != AVERROR_EOF) fail("encoding failed", error);
}

void VideoWriter::State::write_gathered() {
  capture::libav::forget_log();
  if (const int error = av_write_frame(muxer.get(), nullptr); error < 0) {
    fail("writing failed", error);
  }
  file.mark({pictures, end});
}

// What the muxer still holds refers to pictures that were lost.
void VideoWriter::State::give_gathered_up() {
  file.discard(true);
  av_write_frame(muxer.get(), nullptr);
  file.discard(false);
}

// Some 30 bytes per second of the take, and what is fixed.
std::int64_t VideoWriter::State::room_for_index() const {
  constexpr std::int64_t fixed_room = 16 << 10;
  const double seconds = static_cast<double>(last_index + 1) / settings.rate.value();
  return fixed_room + static_cast<std::int64_t>(30 * seconds);
}

// Writes the index after what was cut back to `place`. The muxer counts what was cut off, too.
void VideoWriter::State::end_shortened(std::int64_t place) {
  if (av_write_trailer(muxer.get()) < 0 || pictures == 0) return;
  file.shorten(place, static_cast<double>(end) / settings.rate.value());
}

VideoWriter::VideoWriter(const VideoSettings& settings) {
  validate(settings);
  capture::libav::gather_log();
  state_ = std::make_unique<State>(settings);
  State& state = *state_;
  state.picture->format = state.encoder->pix_fmt;
  state.picture->width = settings.width;
  state.picture->height = settings.height;
  if (av_frame_get_buffer(state.picture.get(), 0) < 0) throw std::bad_alloc();
  if (!is_lossless(settings) && !is_grey(settings))
    state.converter.emplace(settings.width, settings.height);
}

VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;
VideoWriter& VideoWriter::operator=(VideoWriter&&) noexcept = default;
VideoWriter::~VideoWriter() = default;

void VideoWriter::write_picture(std::int64_t index, std::span<const std::uint8_t> codes) {
  State& state = *state_;
  const auto row_bytes = static_cast<std::size_t>(state.settings.width) *
                         static_cast<std::size_t>(state.settings.channels);
  const auto height = static_cast<std::size_t>(state.settings.height);
  require(index > state.last_index,
          "picture " + std::to_string(index) + " after " + std::to_string(state.last_index));
  require(codes.size() == row_bytes * height, "the picture has " + std::to_string(codes.size()) +
                                                  " values, not " +
                                                  std::to_string(row_bytes * height));
  AVFrame& picture = *state.picture;
  if (av_frame_make_writable(&picture) < 0) throw std::bad_alloc();
  if (state.converter) {
    state.converter->convert(
        codes, {picture.data[0], picture.data[1], picture.data[2], picture.linesize[0],
                picture.linesize[1], picture.linesize[2]});
  } else {
    for (std::size_t y = 0; y < height; ++y) {
      std::copy_n(codes.data() + y * row_bytes, row_bytes,
                  picture.data[0] + static_cast<std::ptrdiff_t>(y) * picture.linesize[0]);
    }
  }
  state.begin();
  state.last_index = index;
  picture.pts = index;
  state.encode(&picture);
}

void VideoWriter::write_sound(std::int64_t first, std::span<const float> samples) {
  State& state = *state_;
  require(state.settings.sound_channels > 0, "this take was opened without sound");
  const auto channels = static_cast<std::size_t>(state.settings.sound_channels);
  require(samples.size() % channels == 0 && first == state.next_sample,
          "sound from sample " + std::to_string(first) + " does not follow sample " +
              std::to_string(state.next_sample));
  if (samples.empty()) return;
  state.begin();
  if (av_new_packet(state.packet.get(), static_cast<int>(samples.size() * 3)) < 0) {
    throw std::bad_alloc();
  }
  append_24_bits(samples, state.packet->data);
  const auto length = static_cast<std::int64_t>(samples.size() / channels);
  state.packet->pts = first;
  state.packet->dts = first;
  state.packet->duration = length;
  state.packet->flags |= AV_PKT_FLAG_KEY;
  state.next_sample = first + length;
  capture::libav::forget_log();
  state.write_packet(state.packet.get(), state.sound_stream, {1, state.settings.sound_rate});
}

void VideoWriter::checkpoint() {
  State& state = *state_;
  if (state.finished) return;
  state.begin();
  state.write_gathered();
  std::vector<Checkpoint>& kept = state.checkpoints;
  if (kept.size() == checkpoints_kept) kept.erase(kept.begin());
  kept.push_back({state.last_index, state.file.place(), state.pictures});
}

void VideoWriter::drain() {
  State& state = *state_;
  if (state.drained || !state.begun) return;
  state.encode(nullptr);
  state.write_gathered();
  state.drained = true;
}

void VideoWriter::close() {
  State& state = *state_;
  if (!state.is_open()) return;
  drain();
  state.finished = true;
  if (const int error = av_write_trailer(state.muxer.get()); error < 0) {
    state.file.cut_back(0);
    state.fail("the index cannot be written, the rest is there", error);
  }
  state.file.require_there(true);
}

void VideoWriter::salvage() noexcept {
  State& state = *state_;
  if (!state.is_open()) return;
  state.finished = true;
  state.give_gathered_up();
  const bool has_room = state.file.cut_back(state.room_for_index());
  state.pictures = state.file.whole().pictures;
  state.end = state.file.whole().end;
  if (has_room) state.end_shortened(state.file.place());
}

std::int64_t VideoWriter::pictures() const {
  return state_->file.is_removed() ? 0 : state_->pictures;
}

void VideoWriter::salvage_together(VideoWriter& a, VideoWriter& b) noexcept {
  State& one = *a.state_;
  State& other = *b.state_;
  if (!one.is_open() || !other.is_open()) return;
  one.finished = other.finished = true;
  one.give_gathered_up();
  other.give_gathered_up();
  // They may share a disk: each has to leave room for both.
  const std::int64_t room = one.room_for_index() + other.room_for_index();
  for (auto last = one.checkpoints.rbegin(); last != one.checkpoints.rend(); ++last) {
    const auto same = std::ranges::find(other.checkpoints, last->index, &Checkpoint::index);
    if (same == other.checkpoints.end()) continue;
    const bool fits = one.file.cut_to(last->place, room) & other.file.cut_to(same->place, room);
    one.pictures = last->pictures, other.pictures = same->pictures;
    one.end = other.end = last->index + 1;
    if (!fits) continue;
    one.end_shortened(last->place);
    other.end_shortened(same->place);
    return;
  }
}

}  // namespace compositing
