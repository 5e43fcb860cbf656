// One picture of a camera, with when and how it was taken.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "capture/image.h"

namespace capture {

struct CodedPicture;

// Instants on the monotonic clock, or, for files, since the file's first frame.
using Time = std::chrono::nanoseconds;

// num / den, both > 0: 25/1, 30000/1001.
struct Rational {
  std::int64_t num = 0;
  std::int64_t den = 1;
  double value() const { return static_cast<double>(num) / static_cast<double>(den); }
  friend bool operator==(const Rational&, const Rational&) = default;
};

// Time of frame n at a rate, without drift: n * den / num seconds, rounded down to nanoseconds.
// Exact for |n| up to 2^40 and any broadcast rate.
Time time_of_frame(std::int64_t n, Rational rate);

// The last frame whose time is not after `time`, exactly as time_of_frame has it; below 0 before
// frame 0. Exact for times of centuries at any broadcast rate.
std::int64_t frame_at(Time time, Rational rate);

// The rate that a measured one is meant to be: whole, or a multiple of 24 or 30 times 1000/1001,
// whichever is nearer, if that is it to a relative `tolerance`.
std::optional<Rational> nominal_rate(double rate, double tolerance);

enum class FrameStatus {
  good,
  damaged,  // decoded, but the source reported errors inside it
  lost,     // did not arrive: the image is the previous one, or none
};

struct Frame {
  std::shared_ptr<const Image> image;  // scene-linear; null only if nothing ever arrived
  std::int64_t number = 0;             // counts the source's frames, lost ones included
  std::int64_t pass_first = 0;  // of a file that loops: the number of its first frame in this pass
  Time time{};                  // middle of the exposure
  double exposure_s = 0;        // 0 = unknown
  FrameStatus status = FrameStatus::good;
  std::string note;  // what happened, in words, if not good
  // What the image was made from; null unless CameraOptions::keep_coded, of live cameras.
  std::shared_ptr<const CodedPicture> coded;
};

}  // namespace capture
