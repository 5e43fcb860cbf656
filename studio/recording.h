// The show's recording: started and stopped while the show runs.
#pragma once

#include <memory>

#include "compositing/recorder.h"
#include "render/renderer.h"
#include "studio/set.h"

namespace studio {

struct ShownFrame;

// What every recording of a show has in common.
struct RecordingForm {
  int width = 0;
  int height = 0;
  capture::Rational rate;
  capture::Transfer transfer = capture::Transfer::rec1886;  // of the display's codes
  int sound_channels = 0;
  int sound_rate = 0;
  capture::Rational pixel_aspect{1, 1};
  std::shared_ptr<const compositing::Display> display;  // whose codes are recorded
};

// One thread uses it.
class Recording {
 public:
  explicit Recording(const RecordingForm& form) : form_(form) {}

  // Throws as start(), for all that can be told before.
  void check(const RecordSettings& settings) const;
  // Ends what runs and starts anew. Throws as compositing::Recorder; what runs goes on then.
  void start(const RecordSettings& settings);
  // Finishes the files; nothing if none runs.
  void stop();
  bool running() const { return recorder_ != nullptr; }
  // Hands a frame over if a recording runs. `wait` = for room, rather than to drop the frame.
  void record(const ShownFrame& shown, bool wait);
  // Of the present or last recording.
  compositing::RecorderStatus status() const;

 private:
  compositing::RecorderSettings settings_of(const RecordSettings& settings) const;

  RecordingForm form_;
  RecordSettings settings_;  // of the present or last recording
  std::unique_ptr<compositing::Recorder> recorder_;
  compositing::RecorderStatus last_status_;
};

}  // namespace studio
