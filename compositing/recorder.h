// Records a take beside the show, on a thread of its own: video with sound, fill and key as a pair
// of videos, EXR frames, or all of them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/colour.h"
#include "capture/frame.h"
#include "capture/image.h"
#include "compositing/display.h"
#include "compositing/timecode.h"
#include "compositing/tone.h"

namespace compositing {

struct RecorderSettings {
  std::string file;     // *.mkv, see video_writer.h; "" = no video
  std::string exr_dir;  // see exr_sequence.h; "" = no EXR frames
  // *.mkv, with the same pictures at the same times whatever happens (locked_videos.h), of the
  // codes that fill_and_key.h tells; "" = neither.
  std::string fill_file;
  std::string key_file;
  std::shared_ptr<const Display> display;  // that made display_rgb8; for fill and key
  capture::Rational rate;
  int width = 0;
  int height = 0;
  capture::Rational pixel_aspect{1, 1};  // a pixel's width over its height, for the files' tags
  std::string codec = "h264";            // or "lossless"
  int crf = 18;                          // H.264's constant rate factor
  capture::Transfer transfer = capture::Transfer::rec1886;  // of display_rgb8: for the file's tags
  std::string exr_compression = "none";                     // or "rle", "zip", "piz"
  std::optional<Timecode> start;  // label of the first frame; none: 00:00:00:00 if the rate has it
  int sound_channels = 0;         // 0 = silent
  int sound_rate = 0;
  int queue_frames = 32;  // frames that may wait, at least 1
};

// One frame of the take. Numbers ascend; one left out shows the picture before for longer.
struct RecordedFrame {
  std::int64_t number = 0;
  capture::Time time{};  // of the picture, on the sound's clock; the first frame's is the take's 0
  std::shared_ptr<const capture::HalfImage> rgba;   // (height, width, 4); for EXR and key
  std::shared_ptr<const capture::HalfImage> matte;  // (height, width, 1); for EXR and key
  std::shared_ptr<const std::vector<std::uint8_t>> display_rgb8;  // (height, width, 3); for videos
  std::shared_ptr<const capture::HalfImage> plate;  // (height, width, 3); for fill and key
  ToneCurve tone;                                   // that display_rgb8 has; for fill and key
  std::optional<capture::Sound> sound;              // that came with the frame, if any
};

// What became of one output of a take.
struct RecordedOutput {
  std::string name;          // the file; "FILL and KEY"; the folder of EXR frames
  std::int64_t written = 0;  // frames that it has, once it is closed
  std::string error;         // why it ended before the take, and what goes on; "" = it has not
};

struct RecorderStatus {
  std::int64_t written = 0;  // frames that any output has, once it is closed
  std::int64_t dropped = 0;  // that none has: came while the queue was full, or after an error
  std::vector<RecordedOutput> outputs;
  // Chunks of another form, with a time far after their frame, or of too many dropped frames.
  std::int64_t sounds_left_out = 0;
  double raised_share = 0;   // of pixels whose key is above the matte, see fill_and_key.h
  double worst_write_s = 0;  // longest time that one frame took to write
  double write_s = 0;        // time spent writing, in all
  std::string error;         // why recording stopped: the last output's; "" = it has not
  bool finished = false;     // the files are closed
};

// Why outputs failed, and recording stopped, each said once.
std::vector<std::string> errors_of(const RecorderStatus& status);

// Throws as Recorder's constructor, for all that can be told before anything is written.
void check(const RecorderSettings& settings);

// Never blocks or throws into the show once it runs: what goes wrong then stands in the status, and
// what was recorded until then is kept. An output that fails ends alone: the others go on. One
// thread pushes; any thread may ask for the status.
//
// Sound is laid from the first frame's time on without gaps: what is missing becomes silence, what
// comes twice is left out. The sound of a frame that is dropped is kept.
class Recorder {
 public:
  // Throws std::invalid_argument for settings that cannot be, std::runtime_error with path and
  // reason if video or folder cannot be written.
  explicit Recorder(const RecorderSettings& settings);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();  // closes

  // Hands a frame over. False if it was dropped. Never waits for the disk. Throws
  // std::invalid_argument if the frame lacks what is to be recorded or has another size, or if its
  // number does not ascend.
  bool push(RecordedFrame frame);

  // For runs that are not live: waits until the queue has room or recording has stopped.
  void wait_for_room();

  RecorderStatus status() const;

  // Writes what is queued and finishes the files. Further frames are dropped. Again: does nothing.
  void close();
  // The same, but does not wait for it: status().finished tells when it is done.
  void begin_close();

 private:
  class Take;
  std::unique_ptr<Take> take_;
};

}  // namespace compositing
