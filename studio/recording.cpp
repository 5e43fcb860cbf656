// Recordings of shows.
#include "studio/recording.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "compositing/output_file.h"
#include "compositing/timecode.h"
#include "studio/set_files.h"
#include "studio/show.h"

namespace studio {
namespace {

// Takes that are being finished: more would only slow each other and the show.
constexpr std::size_t most_ended = 2;

bool share_files(const RecordSettings& a, const RecordSettings& b) {
  for (const std::string* of_a : {&a.file, &a.fill, &a.key, &a.exr}) {
    for (const std::string* of_b : {&b.file, &b.fill, &b.key, &b.exr}) {
      if (!of_a->empty() && !of_b->empty() && compositing::is_one_file(*of_a, *of_b)) return true;
    }
  }
  return false;
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
    if (take_) spare_take(take_->settings, *written);
  }
  if (take_ && share_files(take_->settings, settings)) stop();  // into a folder of frames
  finish_those_in_the_way(settings);
  compositing::check(recorder);  // else the take that runs goes on
  stop();
  while (ended_.size() > most_ended) finish_oldest();
  note_last_errors();
  auto opened = std::make_unique<compositing::Recorder>(recorder);
  take_.emplace();
  take_->settings = settings;
  take_->recorder = std::move(opened);
}

void Recording::stop() {
  if (!take_) return;
  note_missing();
  take_->recorder->begin_close();
  ended_.push_back(std::move(*take_));
  take_.reset();
}

void Recording::finish() {
  while (!ended_.empty()) finish_oldest();
}

void Recording::finish_oldest() {
  Take take = std::move(ended_.front());
  ended_.pop_front();
  take.recorder->close();
  last_status_ = take.recorder->status();
  told_ = compositing::errors_of(last_status_).empty();
  if (!take_ && ended_.empty()) return;
  note_last_errors();
  if (last_status_.dropped == 0) return;
  for (const compositing::RecordedOutput& output : last_status_.outputs) {
    if (!output.error.empty()) continue;
    notes_.push_back(output.name + ": " + std::to_string(last_status_.dropped) +
                     " frames are not in it");
  }
}

void Recording::note_last_errors() {
  if (!told_) std::ranges::move(compositing::errors_of(last_status_), std::back_inserter(notes_));
  told_ = true;
}

void Recording::finish_those_in_the_way(const RecordSettings& settings) {
  const auto is_in_the_way = [&](const Take& take) { return share_files(take.settings, settings); };
  while (std::ranges::any_of(ended_, is_in_the_way)) finish_oldest();
}

void Recording::forget_finished() {
  while (!ended_.empty() && ended_.front().recorder->status().finished) finish_oldest();
}

void Recording::record(const ShownFrame& shown, bool wait) {
  if (!take_) return;
  const RecordSettings& settings = take_->settings;
  take_->frame = shown.prepared.job.frame;
  if (wait) take_->recorder->wait_for_room();
  compositing::RecordedFrame frame;
  frame.number = shown.prepared.job.frame;
  frame.time = shown.prepared.job.time;
  // What waits is kept: only what is written.
  const bool has_pair = !settings.fill.empty();
  if (has_pair || !settings.exr.empty()) {
    frame.rgba = {shown.result, &shown.result->rgba};
    frame.matte = {shown.result, &shown.result->matte};
  }
  if (has_pair) frame.plate = shown.prepared.plate;
  if (has_pair || !settings.file.empty()) frame.display_rgb8 = shown.rgb8;
  frame.tone = compositing::curve_of(shown.prepared.job.tone);
  frame.sound = shown.prepared.sound;
  take_->recorder->push(std::move(frame));
}

compositing::RecorderStatus Recording::status() {
  forget_finished();
  if (take_) return take_->recorder->status();
  if (!ended_.empty()) return ended_.back().recorder->status();
  told_ = true;
  return last_status_;
}

// What is missing in the take that runs, each once.
void Recording::note_missing() {
  if (!take_) return;
  const compositing::RecorderStatus status = take_->recorder->status();
  const std::string by = "by frame " + std::to_string(take_->frame);
  if (status.dropped > 0 && status.error.empty() && !std::exchange(take_->frames_told, true)) {
    notes_.push_back(by +
                     " frames are missing in the recording: the disk, or this machine, is too slow "
                     "for it");
  }
  if (status.sounds_left_out > 0 && !std::exchange(take_->sound_told, true)) {
    notes_.push_back(by +
                     " sound is missing in the recording: it has another form than the plate told, "
                     "a time far after its picture, or came while no frame could be written");
  }
}

std::vector<std::string> Recording::take_notes() {
  forget_finished();
  note_missing();
  return std::exchange(notes_, {});
}

}  // namespace studio
