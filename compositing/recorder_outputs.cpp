// Outputs of a take.
#include "compositing/recorder_outputs.h"

#include <exception>
#include <filesystem>
#include <optional>
#include <utility>

#include "compositing/exr_sequence.h"
#include "compositing/fill_and_key.h"
#include "compositing/locked_videos.h"

namespace compositing {
namespace {

// The first frame's label, if there is timecode at this rate.
std::optional<Timecode> first_label(const RecorderSettings& settings) {
  if (settings.start || !allows_timecode(settings.rate)) return settings.start;
  return Timecode{};
}

class VideoOutput final : public TakeOutput {
 public:
  explicit VideoOutput(const RecorderSettings& settings) : video_(video_settings(settings)) {}

  void write(std::int64_t index, const RecordedFrame& frame) override {
    video_.write_picture(index, *frame.display_rgb8);
  }
  void write_sound(std::int64_t first, std::span<const float> samples) override {
    video_.write_sound(first, samples);
  }
  void close() override { video_.close(); }
  void give_up() noexcept override { video_.salvage(); }
  std::int64_t pictures() const override { return video_.pictures(); }

 private:
  VideoWriter video_;
};

class PairOutput final : public TakeOutput {
 public:
  explicit PairOutput(const RecorderSettings& settings)
      : videos_(fill_settings(settings), key_settings(settings)),
        fill_and_key_(settings.display),
        key_(static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height)),
        fill_(key_.size() * 3) {}

  void write(std::int64_t index, const RecordedFrame& frame) override {
    raised_pixels_ += fill_and_key_.split(*frame.display_rgb8, *frame.rgba, *frame.plate,
                                          *frame.matte, frame.tone, fill_, key_);
    videos_.write_pictures(index, fill_, key_);
    ++split_;
  }
  void write_sound(std::int64_t first, std::span<const float> samples) override {
    videos_.write_sound(first, samples);
  }
  void close() override { videos_.close(); }
  void give_up() noexcept override { videos_.salvage(); }
  std::int64_t pictures() const override { return videos_.pictures(); }
  std::optional<double> raised_share() const override {
    if (split_ == 0) return std::nullopt;
    return static_cast<double>(raised_pixels_) /
           (static_cast<double>(split_) * static_cast<double>(key_.size()));
  }

 private:
  LockedVideos videos_;
  FillAndKey fill_and_key_;
  std::vector<std::uint8_t> key_, fill_;  // of the frame that is written
  std::int64_t raised_pixels_ = 0;
  std::int64_t split_ = 0;  // frames
};

class ExrOutput final : public TakeOutput {
 public:
  explicit ExrOutput(const RecorderSettings& settings)
      : rate_(settings.rate),
        first_label_(first_label(settings)),
        frames_(
            {settings.exr_dir, settings.rate, settings.exr_compression, settings.pixel_aspect}) {}

  void write(std::int64_t index, const RecordedFrame& frame) override {
    std::optional<Timecode> label = first_label_;
    if (label) label = advance(*label, index, rate_);
    frames_.write(frame.number, *frame.rgba, *frame.matte, label);
    ++written_;
  }
  std::int64_t pictures() const override { return written_; }

 private:
  capture::Rational rate_;
  std::optional<Timecode> first_label_;
  ExrSequence frames_;
  std::int64_t written_ = 0;
};

}  // namespace

VideoSettings video_settings(const RecorderSettings& settings) {
  const std::optional<Timecode> first = first_label(settings);
  return {.file = settings.file,
          .rate = settings.rate,
          .width = settings.width,
          .height = settings.height,
          .pixel_aspect = settings.pixel_aspect,
          .codec = settings.codec,
          .crf = settings.crf,
          .transfer = settings.transfer,
          .timecode = first ? to_string(*first) : std::string(),
          .comment = {},
          .sound_channels = settings.sound_channels,
          .sound_rate = settings.sound_rate};
}

VideoSettings fill_settings(const RecorderSettings& settings) {
  VideoSettings fill = video_settings(settings);
  fill.file = settings.fill_file;
  fill.comment =
      "fill of " + std::filesystem::path(settings.key_file).filename().string() +
      ": programme = fill + (1 - key) * plate, in display codes; shaped: do not multiply by key";
  return fill;
}

VideoSettings key_settings(const RecorderSettings& settings) {
  VideoSettings key = video_settings(settings);
  key.file = settings.key_file;
  key.channels = 1;
  key.sound_channels = 0;
  key.comment = "key of " + std::filesystem::path(settings.fill_file).filename().string() +
                ": share of the plate's display codes that is hidden, linear, 0 to 255";
  return key;
}

std::vector<NamedOutput> open_outputs(const RecorderSettings& settings) {
  std::vector<NamedOutput> outputs;
  if (!settings.file.empty()) {
    outputs.push_back({settings.file, std::make_unique<VideoOutput>(settings)});
  }
  if (!settings.fill_file.empty()) {
    outputs.push_back(
        {settings.fill_file + " and " + settings.key_file, std::make_unique<PairOutput>(settings)});
  }
  if (!settings.exr_dir.empty()) {
    outputs.push_back({settings.exr_dir, std::make_unique<ExrOutput>(settings)});
  }
  return outputs;
}

}  // namespace compositing
