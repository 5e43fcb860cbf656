// SMPTE timecode: hours, minutes, seconds and frames of a take, with drop-frame counting.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "capture/frame.h"

namespace compositing {

// The label of one frame within a day. Drop-frame labels leave out the first two numbers of every
// minute but each tenth (four at 60000/1001), so that they follow the clock at 30000/1001.
struct Timecode {
  int hours = 0;
  int minutes = 0;
  int seconds = 0;
  int frames = 0;
  bool drop_frame = false;
  friend bool operator==(const Timecode&, const Timecode&) = default;
};

// Frames counted in one second of timecode: the rate rounded to a whole number (30 at 30000/1001,
// 13 at 12.5). Throws std::invalid_argument unless the result lies in 1..99, the two digits' range.
int timecode_base(capture::Rational rate);

// Whether there is timecode at this rate: from 1 to 99 frames in a second of it.
bool allows_timecode(capture::Rational rate);

// Whether labels may be dropped: only at 30000/1001 and 60000/1001.
bool allows_drop_frame(capture::Rational rate);

// Frames since 00:00:00:00, and the label of that many frames; labels start again after 24 hours,
// and negative counts lead back into the day before. SMPTE ST 12-1, "Time and Control Code". Both
// throw std::invalid_argument for a label that does not exist at this rate, or for drop-frame
// counting at a rate that does not have it.
std::int64_t frames_since_midnight(const Timecode& timecode, capture::Rational rate);
Timecode timecode_at(std::int64_t frames, capture::Rational rate, bool drop_frame);

// The label `frames` frames after `start`.
Timecode advance(const Timecode& start, std::int64_t frames, capture::Rational rate);

// "01:00:00:00", and "01:00:00;00" with drop-frame. Reading throws std::invalid_argument with the
// text and the reason when it is malformed or does not exist at this rate.
std::string to_string(const Timecode& timecode);
Timecode parse_timecode(std::string_view text, capture::Rational rate);

}  // namespace compositing
