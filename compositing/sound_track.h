// Chunks of sound with times, laid one after another without gaps.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "capture/camera.h"

namespace compositing {

// What continues the track: so much silence, then these samples of the chunk.
struct LaidSound {
  std::int64_t silence = 0;        // samples per channel
  std::span<const float> samples;  // interleaved, of the chunk
};

class SoundTrack {
 public:
  // Throws std::invalid_argument unless both are positive.
  SoundTrack(int channels, int rate);

  // Lays a chunk at its time after `start`, and counts it as written: silence fills what is missing
  // before it, what was there before or lies before the start is left out. A shift of up to 5 ms
  // counts as rounding of times. Nothing if it would begin after `latest`, or has another number of
  // channels or another rate than the track.
  std::optional<LaidSound> lay(const capture::Sound& chunk,
                               capture::Time start,
                               capture::Time latest);

  // Samples per channel so far.
  std::int64_t length() const { return length_; }

 private:
  int channels_;
  int rate_;
  std::int64_t length_ = 0;
};

}  // namespace compositing
