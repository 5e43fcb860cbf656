// A Matroska file with one picture track, maybe one sound track, and a timecode.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "capture/colour.h"
#include "capture/frame.h"

namespace compositing {

struct VideoSettings {
  std::string file;        // *.mkv; an older file of that name is replaced
  capture::Rational rate;  // pictures per second
  int width = 0;
  int height = 0;
  capture::Rational pixel_aspect{1, 1};  // a pixel's width over its height: for the tags
  int channels = 3;                      // 3 = RGB; 1 = grey of full range, as one plane (4:0:0)
  std::string codec = "h264";  // "h264": 8 bits 4:2:0; "lossless": RGB or grey kept bit for bit
  int crf = 18;                // H.264's constant rate factor: 0 finest, 51 coarsest
  capture::Transfer transfer =
      capture::Transfer::rec1886;  // of the pictures; or srgb: for the tags
  std::string timecode;            // of picture 0; "" = none
  std::string comment;             // what the pictures are, in the file's tags; "" = none
  int sound_channels = 0;          // 0 = silent
  int sound_rate = 0;
  bool repeatable = false;  // the same pictures and sound give the same bytes: no random numbers
};

// Throws std::invalid_argument with the reason if the settings cannot be.
void validate(const VideoSettings& settings);

// Writes on the calling thread. Clusters are short and each is written as soon as it is whole, so
// that a file whose writer was killed plays up to about its last half second.
class VideoWriter {
 public:
  // Opens the file, in which what was there stays until the first picture. Throws like validate;
  // std::runtime_error with path and reason if it cannot be written, or another program writes it.
  explicit VideoWriter(const VideoSettings& settings);
  VideoWriter(VideoWriter&&) noexcept;
  VideoWriter& operator=(VideoWriter&&) noexcept;
  // Without close() the file stays as it is, as after a kill.
  ~VideoWriter();

  // Adds picture `index`, (height, width, channels). Indices ascend; a gap shows the picture before
  // for longer. Throws std::runtime_error with path and reason if it cannot be written (disk full):
  // then only salvage() makes sense. Throws std::invalid_argument for a wrong size or index.
  void write_picture(std::int64_t index, std::span<const std::uint8_t> codes);

  // Adds interleaved sound from sample `first` on, at which the last call must have ended; values
  // beyond -1..1 are clipped to 24 bits. Throws like write_picture.
  void write_sound(std::int64_t first, std::span<const float> samples);

  // Writes out what is gathered, so that salvage_together() can go back to here. Throws like
  // write_picture.
  void checkpoint();

  // Writes all that is held back: no pictures or sound may follow. Throws like write_picture.
  void drain();

  // Finishes the file, if there is anything in it. Throws std::runtime_error like write_picture.
  void close();

  // Pictures that the file has; of what was written last, only once it is finished.
  std::int64_t pictures() const;

  // After a failure: keeps what was written whole, gives up the rest, and finishes the file.
  void salvage() noexcept;

  // The same for two whose checkpoints had the same pictures: both keep those up to the last
  // checkpoint that is whole in both of them.
  static void salvage_together(VideoWriter& a, VideoWriter& b) noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace compositing
