// Video files as cameras.
#include "capture/video_file.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <stdexcept>
#include <utility>

#include "capture/crop.h"
#include "capture/pool.h"
#include "capture/progressive_video.h"
#include "capture/sound_decoder.h"
#include "capture/stamp_clock.h"
#include "capture/turn.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/frame.h>
}

namespace capture {
namespace {

// So many pictures may be lost before the first good one.
constexpr std::size_t max_lost_at_start = 1000;

// Frames nearer than this are counted from the start; and so far before a frame the decoder starts,
// so that pictures which it cannot yet build are behind it.
constexpr std::int64_t min_jump = 50;
constexpr double most_frames = 1e12;  // a longer length is a broken one

// The rate that the container counts in, if its average agrees; else the average.
Rational rate_of(const AVStream& stream) {
  const AVRational counted = stream.r_frame_rate;
  const AVRational average = stream.avg_frame_rate;
  // Matroska counts in nanoseconds: 60000/1001 comes as 19001/317.
  const auto rational = [](AVRational rate) {
    if (rate.num <= 0 || rate.den <= 0) {
      return Rational{};
    }
    constexpr double of_rounding = 1e-6;
    return nominal_rate(av_q2d(rate), of_rounding).value_or(Rational{rate.num, rate.den});
  };
  if (counted.num > 0 && counted.den > 0 && average.num > 0 && average.den > 0) {
    const double ratio = av_q2d(counted) / av_q2d(average);
    return rational(ratio > 0.98 && ratio < 1.02 ? counted : average);
  }
  return rational(counted.num > 0 ? counted : average);
}

// As the frame or else its stream says.
std::optional<Turn> turn_of(const AVFrame& frame, const AVStream& stream) {
  if (const auto its = display_matrix(frame)) return turn_of_matrix(*its);
  std::size_t size = 0;
  const std::uint8_t* bytes = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, &size);
  std::array<std::int32_t, 9> matrix{};
  if (bytes == nullptr || size < sizeof matrix) return Turn{};
  std::memcpy(matrix.data(), bytes, sizeof matrix);
  return turn_of_matrix(matrix);
}

class VideoFile : public Camera {
 public:
  VideoFile(const std::string& path, const CameraOptions& options, const LightCurves& curves);

  const CameraInfo& info() const override { return info_; }
  std::optional<Frame> next() override { return pass(true); }
  bool skip() override { return pass(false).has_value(); }
  std::optional<Sound> take_sound(Time until) override;
  CameraStatistics statistics() const override { return statistics_; }

 private:
  void open();
  void describe(const ProgressivePicture& first);
  void describe_interlacing(Interlacing interlacing);
  void skip_to(std::int64_t frame);
  bool jump_before(std::int64_t frame);
  std::optional<ProgressivePicture> start_again();
  std::optional<ProgressivePicture> first_again();
  std::optional<Frame> pass(bool makes_picture);
  Frame make_frame(const DecodedPicture& picture);
  void linearise(const DecodedPicture& picture, Frame& frame);
  void judge_end();
  Time end_of_pass() const { return pass_start_ + clock_->end(); }

  std::string path_;
  bool loop_;
  bool rewinds_ = true;  // to the first picture, as far as is known
  bool alpha_;
  std::optional<bool> deinterlace_;
  CameraInfo info_;
  int source_width_ = 0;
  int source_height_ = 0;
  std::optional<Turn> turn_;  // nothing = one that is not made
  Crop crop_;                 // of the source's picture, before it is turned
  std::unique_ptr<MediaFile> file_;
  std::unique_ptr<ProgressiveVideo> decoder_;
  std::unique_ptr<SoundDecoder> sound_;
  std::string sound_note_;
  Lineariser lineariser_;
  Pool<Image> pool_;
  Image lying_;  // before it is turned
  std::optional<StampClock> clock_;

  std::deque<Frame> ahead_;  // made while opening
  std::shared_ptr<const Image> last_image_;
  std::int64_t number_ = 0;       // of the next frame
  std::int64_t pass_first_ = 0;   // of this pass's first
  std::int64_t pass_frames_ = 0;  // in this pass through the file
  Time pass_start_{};
  Time last_time_{};  // of the last frame given
  bool ended_ = false;
  CameraStatistics statistics_;
};

AVCodecID codec_of(const MediaFile& file) { return file.video().codecpar->codec_id; }

// The container's own count; of one that has none, such as Matroska, what its length and rate
// suggest; 0 = it does not tell these either.
std::int64_t count_frames(const MediaFile& file, Rational rate) {
  const AVStream& video = file.video();
  if (video.nb_frames > 0 || rate.num <= 0) return video.nb_frames;
  const AVFormatContext& context = file.context();
  double length_s = 0;
  if (video.duration > 0) {
    length_s = static_cast<double>(video.duration) * av_q2d(video.time_base);
  } else if (context.duration > 0) {
    length_s = static_cast<double>(context.duration) / AV_TIME_BASE;
  }
  const double frames = length_s * rate.value();
  return frames < most_frames ? std::llround(frames) : 0;
}

VideoFile::VideoFile(const std::string& path,
                     const CameraOptions& options,
                     const LightCurves& curves)
    : path_(path),
      loop_(options.loop),
      alpha_(options.alpha),
      deinterlace_(options.deinterlace),
      file_(std::make_unique<MediaFile>(path)),
      lineariser_(curves) {
  open();
  info_.rate = rate_of(file_->video());
  info_.frames = loop_ ? 0 : count_frames(*file_, info_.rate);
  clock_.emplace(Rational{file_->video().time_base.num, file_->video().time_base.den}, info_.rate,
                 file_->length());
  if (options.frame) {
    skip_to(*options.frame);
  }
  for (;;) {
    const std::optional<ProgressivePicture> picture = decoder_->next();
    if (!picture && number_ <= options.frame.value_or(-1)) {
      throw std::runtime_error("cannot open " + path_ + " at frame " +
                               std::to_string(*options.frame) + ": it has " +
                               std::to_string(number_) + " frames, counted from 0");
    }
    if (!picture || ahead_.size() > max_lost_at_start) {
      const std::string why = ahead_.empty() ? "" : ": the last one " + ahead_.back().note;
      throw std::runtime_error("cannot open " + path_ + ": no picture in it can be decoded" + why +
                               "; is the file whole?");
    }
    if (picture->frame != nullptr) {
      const AVFrame& first = *picture->frame;
      try {
        libav::check_size(first.width, first.height);
        source_width_ = first.width;
        source_height_ = first.height;
        turn_ = turn_of(first, file_->video());
        const Turn turn = turn_.value_or(Turn{});
        const auto [width, height] = turned_size(turn, source_width_, source_height_);
        crop_ = crop_before(turn, crop_within(options.crop, width, height), source_width_,
                            source_height_);
        Image probe;
        lineariser_.linearise(first, crop_, probe);
      } catch (const std::runtime_error& error) {
        throw std::runtime_error("cannot open " + path_ + ": " + error.what());
      }
      ahead_.push_back(make_frame(*picture));
      describe(*picture);
      break;
    }
    ahead_.push_back(make_frame(*picture));
  }
  if (sound_) {
    sound_->skip_to(ahead_.front().time);
  }
}

void VideoFile::open() {
  decoder_ = std::make_unique<ProgressiveVideo>(*file_, alpha_, deinterlace_);
  const std::unique_ptr<SoundDecoder> before = std::move(sound_);
  if (file_->sound() != nullptr) {
    try {
      sound_ = std::make_unique<SoundDecoder>(*file_);
      if (before && !sound_->follow(*before)) throw std::runtime_error("it changed");
    } catch (const std::runtime_error& error) {
      sound_.reset();
      sound_note_ = error.what();
      file_->leave_sound_out();
    }
  }
}

void VideoFile::describe(const ProgressivePicture& picture) {
  const AVFrame& first = *picture.frame;
  const Turn turn = turn_.value_or(Turn{});
  const auto [width, height] = turned_size(turn, crop_.width, crop_.height);
  const auto [whole_width, whole_height] = turned_size(turn, source_width_, source_height_);
  info_.width = width;
  info_.height = height;
  info_.whole_width = whole_width;
  info_.whole_height = whole_height;
  // The container's, if it tells one. Not changed, but not const.
  const AVRational told = av_guess_sample_aspect_ratio(&file_->context(), &file_->video(),
                                                       const_cast<AVFrame*>(&first));
  constexpr double most = 16;
  if (told.num > 0 && told.den > 0 && av_q2d(told) <= most && av_q2d(told) >= 1 / most) {
    info_.pixel_aspect =
        turn.transposed ? Rational{told.den, told.num} : Rational{told.num, told.den};
  }
  info_.description =
      std::string(avcodec_get_name(codec_of(*file_))) + ", " + lineariser_.description();
  describe_interlacing(picture.interlacing);
  if (turn.any()) {
    info_.description += ", " + capture::describe(turn);
  } else if (!turn_) {
    info_.description += ", to be turned by no multiple of 90 degrees (taken as it is)";
  }
  if (sound_) {
    info_.sound_channels = sound_->channels();
    info_.sound_rate = sound_->rate();
    info_.description +=
        std::string("; sound ") + avcodec_get_name(file_->sound()->codecpar->codec_id);
  } else if (!sound_note_.empty()) {
    info_.description += "; sound left out: " + sound_note_;
  }
}

void VideoFile::describe_interlacing(Interlacing interlacing) {
  switch (interlacing) {
    case Interlacing::none:
      break;
    case Interlacing::removed:
      info_.description += ", interlaced (deinterlaced)";
      if (deinterlace_) break;  // as was asked for
      info_.doubt =
          "it is marked as interlaced, and is deinterlaced: where things move, every other row is "
          "made from those around it. If both fields are of one moment (PsF), deinterlace = false "
          "keeps all rows";
      break;
    case Interlacing::left:
      info_.description += ", interlaced (taken as it is)";
      if (deinterlace_ == false) break;
      info_.doubt = "it is interlaced, and " + decoder_->why_left() +
                    ". Each frame is taken for a whole picture: unless both fields are of one "
                    "moment (PsF), rows and colours of two are mixed; deinterlace it first, as by "
                    "ffmpeg -vf format=yuv422p10,bwdif";
      break;
    case Interlacing::field:
      info_.description += ", single fields (taken as they are)";
      info_.doubt =
          "its pictures are single fields of interlaced video, and each is taken for a whole "
          "picture; join and deinterlace them first, as by ffmpeg -vf weave,bwdif";
      break;
  }
}

void VideoFile::skip_to(std::int64_t frame) {
  if (frame < 0) {
    throw std::runtime_error("cannot open " + path_ + " at frame " + std::to_string(frame) +
                             ": frames count from 0");
  }
  if (frame > min_jump && !jump_before(frame)) {
    number_ = 0;
    pass_frames_ = 0;
    clock_->restart();
    file_ = std::make_unique<MediaFile>(path_);
    sound_.reset();
    open();
  }
  while (number_ < frame) {
    const std::optional<ProgressivePicture> picture = decoder_->next(false);
    if (!picture) {
      return;  // the constructor finds no picture, and says so
    }
    const Frame skipped = make_frame({nullptr, picture->pts, FrameStatus::good, {}});
    if (sound_) {
      sound_->skip_to(skipped.time);
      sound_->keep_up(skipped.time);
    }
  }
}

// Jumps by the container's index, which is right if its frames lie at the rate without a gap: then
// a picture's time is its number. Returns whether that went well.
bool VideoFile::jump_before(std::int64_t frame) {
  const AVStream& video = file_->video();
  if (info_.rate.num <= 0 || video.start_time == AV_NOPTS_VALUE ||
      video.duration == AV_NOPTS_VALUE) {
    return false;
  }
  const double length_s = static_cast<double>(video.duration) * av_q2d(video.time_base);
  const Time wanted = time_of_frame(frame - min_jump, info_.rate);
  const std::int64_t wanted_pts =
      video.start_time + av_rescale_q(wanted.count(), {1, std::nano::den}, video.time_base);
  if (std::llround(length_s * info_.rate.value()) != video.nb_frames || !file_->seek(wanted_pts)) {
    return false;
  }
  decoder_->restart();
  const std::optional<ProgressivePicture> picture = decoder_->next(false);
  if (!picture || !picture->pts) {
    return false;
  }
  clock_->restart(video.start_time);
  make_frame(DecodedPicture{nullptr, picture->pts, FrameStatus::good, {}});
  const std::optional<std::int64_t> its_number = clock_->frame_at(clock_->last());
  number_ = its_number.value_or(frame) + 1;
  return number_ <= frame;
}

Frame VideoFile::make_frame(const DecodedPicture& picture) {
  Frame frame;
  frame.number = number_++;
  frame.pass_first = pass_first_;
  frame.time = pass_start_ + clock_->time_of(picture.pts);
  frame.status = picture.status;
  frame.note = picture.note;
  if (pass_frames_++ == 0 && sound_) {
    sound_->begin(clock_->first_stamp(), pass_start_);
  }
  if (picture.frame != nullptr) {
    linearise(picture, frame);
  }
  frame.image = last_image_;
  return frame;
}

void VideoFile::linearise(const DecodedPicture& picture, Frame& frame) {
  const AVFrame& decoded = *picture.frame;
  try {
    if (decoded.width != source_width_ || decoded.height != source_height_) {
      throw std::runtime_error("the picture's size changed to " + std::to_string(decoded.width) +
                               " x " + std::to_string(decoded.height));
    }
    std::shared_ptr<Image> image = pool_.lend();
    if (turn_ && turn_->any()) {
      lineariser_.linearise(decoded, crop_, lying_);
      turn_image(*turn_, lying_, *image);
    } else {
      lineariser_.linearise(decoded, crop_, *image);
    }
    last_image_ = std::move(image);
  } catch (const std::runtime_error& error) {
    // The stream turned into something else: the show goes on with what there was.
    frame.status = FrameStatus::lost;
    frame.note = error.what();
  }
}

// The first picture of another pass through the file; nothing if there is none.
std::optional<ProgressivePicture> VideoFile::start_again() {
  if (pass_frames_ == 0) {
    return std::nullopt;
  }
  const Time end = end_of_pass();
  if (sound_) {
    sound_->finish(end);
  }
  std::optional<ProgressivePicture> first = first_again();
  pass_start_ = end;
  pass_first_ = number_;
  pass_frames_ = 0;
  clock_->restart();
  return first;
}

// Rewinds, or opens the file again if that does not lead to the picture that was the first.
std::optional<ProgressivePicture> VideoFile::first_again() {
  if (rewinds_ && file_->rewind()) {
    decoder_->restart();
    std::optional<ProgressivePicture> first = decoder_->next();
    if (first && first->pts == clock_->first_stamp()) return first;
  }
  rewinds_ = false;
  try {
    file_ = std::make_unique<MediaFile>(path_);
    open();
  } catch (const std::runtime_error&) {
    return std::nullopt;  // the file is gone: that is its end
  }
  return decoder_->next();
}

std::optional<Frame> VideoFile::pass(bool makes_picture) {
  if (ended_) {
    return std::nullopt;
  }
  std::optional<Frame> frame;
  if (!ahead_.empty()) {
    frame = std::move(ahead_.front());
    ahead_.pop_front();
  } else {
    std::optional<ProgressivePicture> picture = decoder_->next(makes_picture);
    if (!picture) judge_end();
    if (!picture && loop_) picture = start_again();
    if (!picture) {
      ended_ = true;
      return std::nullopt;
    }
    if (!makes_picture) picture->frame = nullptr;
    frame = make_frame(*picture);
  }
  ++statistics_.delivered;
  statistics_.lost += frame->status == FrameStatus::lost ? 1 : 0;
  statistics_.damaged += frame->status == FrameStatus::damaged ? 1 : 0;
  // What lies between is taken as time goes by: one picture may stand for minutes.
  if (sound_) {
    sound_->keep_up(last_time_);
  }
  last_time_ = frame->time;
  return frame;
}

// What ends early by two pictures or more is no rounding.
void VideoFile::judge_end() {
  const std::optional<Time> missing = file_->missing_pictures();
  const Time least = 2 * time_of_frame(1, info_.rate.num > 0 ? info_.rate : Rational{25, 1});
  if (!missing || *missing < least - std::chrono::milliseconds(1)) return;
  const auto seconds = [](Time time) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.2f", std::chrono::duration<double>(time).count());
    return std::string(text.data());
  };
  statistics_.cut_short = "the last " + seconds(*missing) + " s that it tells of are not there " +
                          "(it ends at " + seconds(clock_->end()) +
                          " s): it is cut short or damaged";
}

std::optional<Sound> VideoFile::take_sound(Time until) {
  if (!sound_ || statistics_.delivered == 0) {
    return std::nullopt;
  }
  return sound_->take(std::min(until, ended_ ? end_of_pass() : last_time_));
}

}  // namespace

std::unique_ptr<Camera> open_video_file(const std::string& path,
                                        const CameraOptions& options,
                                        const LightCurves& curves) {
  return std::make_unique<VideoFile>(path, options, curves);
}

}  // namespace capture
