// The show's recording: started and stopped while the show runs.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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

// One thread uses it. The show never waits for the end of a take: its files are finished beside it.
class Recording {
 public:
  explicit Recording(const RecordingForm& form) : form_(form) {}

  // Throws as start(), for all that can be told before.
  void check(const RecordSettings& settings) const;
  // Ends what runs and starts anew. Throws as compositing::Recorder; what runs goes on then, unless
  // its frames go to the same folder. Waits only for an earlier take that is still being finished,
  // if it is of the same files or one of many.
  void start(const RecordSettings& settings);
  // Ends the take that runs, if one does; its files are finished while the show goes on.
  void stop();
  // Until the files of all takes that have ended are finished.
  void finish();
  bool running() const { return take_.has_value(); }
  // Whether files of a take that has ended are not finished yet.
  bool finishing() const { return !ended_.empty(); }
  // Hands a frame over if a recording runs. `wait` = for room, rather than to drop the frame.
  void record(const ShownFrame& shown, bool wait);
  // Of the present or last recording.
  compositing::RecorderStatus status();
  // Why takes failed that the status tells nothing of any more, for another one runs.
  std::vector<std::string> take_notes();

 private:
  struct Take {
    RecordSettings settings;
    std::unique_ptr<compositing::Recorder> recorder;
    std::int64_t frame = 0;                        // the last one of the show
    bool frames_told = false, sound_told = false;  // to be missing
  };

  compositing::RecorderSettings settings_of(const RecordSettings& settings) const;
  void forget_finished();
  void note_last_errors();
  void note_missing();
  void finish_oldest();
  void finish_those_in_the_way(const RecordSettings& settings);

  RecordingForm form_;
  std::optional<Take> take_;
  std::deque<Take> ended_;  // the latest last
  compositing::RecorderStatus last_status_;
  bool told_ = true;  // it, by status() or a note
  std::vector<std::string> notes_;
};

}  // namespace studio
