// Recordings of shows.
#include "studio/recording.h"

#include <optional>

#include "compositing/timecode.h"
#include "studio/set_files.h"
#include "studio/show.h"

namespace studio {
namespace {

// Stretches of sound that follow each other, as one.
std::optional<capture::Sound> joined(const std::vector<capture::Sound>& pieces) {
  if (pieces.empty()) return std::nullopt;
  capture::Sound whole = pieces.front();
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    const std::vector<float>& more = pieces[i].samples;
    whole.samples.insert(whole.samples.end(), more.begin(), more.end());
  }
  return whole;
}

}  // namespace

compositing::RecorderSettings Recording::settings_of(const RecordSettings& settings) const {
  compositing::RecorderSettings recorder;
  recorder.file = settings.file;
  recorder.exr_dir = settings.exr;
  recorder.fill_file = settings.fill;
  recorder.key_file = settings.key;
  recorder.display = form_.display;
  recorder.rate = form_.rate;
  recorder.width = form_.width;
  recorder.height = form_.height;
  recorder.pixel_aspect = form_.pixel_aspect;
  if (!settings.codec.empty()) recorder.codec = settings.codec;
  if (settings.crf) recorder.crf = *settings.crf;
  if (!settings.exr_compression.empty()) recorder.exr_compression = settings.exr_compression;
  if (!settings.timecode.empty()) {
    recorder.start = compositing::parse_timecode(settings.timecode, form_.rate);
  }
  recorder.transfer = form_.transfer;
  recorder.sound_channels = form_.sound_channels;
  recorder.sound_rate = form_.sound_rate;
  return recorder;
}

void Recording::check(const RecordSettings& settings) const {
  compositing::check(settings_of(settings));
}

void Recording::start(const RecordSettings& settings) {
  const compositing::RecorderSettings recorder = settings_of(settings);
  for (const std::string* written : {&settings.file, &settings.fill, &settings.key}) {
    if (recorder_) spare_take(settings_, *written);
  }
  compositing::check(recorder);  // else the take that runs goes on
  stop();
  recorder_ = std::make_unique<compositing::Recorder>(recorder);
  settings_ = settings;
}

void Recording::stop() {
  if (!recorder_) return;
  recorder_->close();
  last_status_ = recorder_->status();
  recorder_.reset();
}

void Recording::record(const ShownFrame& shown, bool wait) {
  if (!recorder_) return;
  if (wait) recorder_->wait_for_room();
  compositing::RecordedFrame frame;
  frame.number = shown.prepared.job.frame;
  frame.time = shown.prepared.job.time;
  // What waits is kept: only what is written.
  const bool has_pair = !settings_.fill.empty();
  if (has_pair || !settings_.exr.empty()) {
    frame.rgba = {shown.result, &shown.result->rgba};
    frame.matte = {shown.result, &shown.result->matte};
  }
  if (has_pair) frame.plate = shown.prepared.plate;
  if (has_pair || !settings_.file.empty()) frame.display_rgb8 = shown.rgb8;
  frame.tone = compositing::curve_of(shown.prepared.job.tone);
  frame.sound = joined(shown.prepared.sound);
  recorder_->push(std::move(frame));
}

compositing::RecorderStatus Recording::status() const {
  return recorder_ ? recorder_->status() : last_status_;
}

}  // namespace studio
