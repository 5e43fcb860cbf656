// The sound of a container on the clock of its frames. For the files that wrap libav.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "capture/camera.h"
#include "capture/media_file.h"

struct AVFrame;

namespace capture {

// Decodes the sound track of `file`, which must outlive it and must not be silent. Where the track
// has nothing there is silence, so that what is taken is continuous.
class SoundDecoder {
 public:
  // Throws std::runtime_error, without a file name, if it cannot be decoded.
  explicit SoundDecoder(MediaFile& file);

  int channels() const { return channels_; }
  int rate() const { return rate_; }

  // Puts the clock: the video's `first_pts` (its time base) is at `start`. Sound before `start` is
  // left out.
  void begin(std::int64_t first_pts, Time start);

  // Goes on with what `before`, of the same track opened earlier, decoded and was taken of it.
  // Returns false, and changes nothing, if channels or rate are others.
  bool follow(SoundDecoder& before);

  // Sound before `from` will not be taken.
  void skip_to(Time from);

  // Decodes packets that already lie in memory, up to `until`; what is 10 s older and was not taken
  // is dropped.
  void keep_up(Time until);

  // The sound from where the last one ended, up to and including `until`.
  std::optional<Sound> take(Time until);

  // Decodes all sound before `end`, and drops the rest; after this the file may be rewound and
  // `begin` called again.
  void finish(Time end);

 private:
  // Samples count from the frames' time 0; `position` is that of the first.
  struct Segment {
    std::int64_t position = 0;
    std::vector<float> samples;
  };
  std::int64_t sample_at(Time time) const;
  std::int64_t samples_of(std::int64_t stamp, const AVStream& stream) const;
  std::int64_t length(const Segment& segment) const;
  std::int64_t position_of(std::int64_t stamp) const;
  void drop_taken();
  bool decode_packet(bool only_waiting);
  void take_frame(const AVFrame& frame);
  void add(std::int64_t position, std::vector<float> samples);

  MediaFile& file_;
  libav::CodecContext context_;
  libav::Resampler resampler_;
  libav::FrameHandle frame_;
  libav::FrameHandle resampled_from_;  // rate, layout and format that the resampler was made for
  int channels_ = 0;
  int rate_ = 0;
  std::int64_t offset_ = 0;   // position minus the track's own sample count
  std::int64_t floor_ = 0;    // no sound before it
  std::int64_t taken_ = 0;    // position up to which sound was taken
  std::int64_t decoded_ = 0;  // position up to which sound was decoded
  bool at_end_ = false;
  std::deque<Segment> segments_;
};

}  // namespace capture
