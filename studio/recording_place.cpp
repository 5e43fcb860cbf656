// Places in recordings.
#include "studio/recording_place.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "studio/source.h"

namespace studio {
namespace {

// A frame of a recording.
struct Stamp {
  std::int64_t frame = 0;
  capture::Time time{};
  std::optional<capture::Time> next{};  // of the frame after it
};

class OpenedAnywhere {
 public:
  OpenedAnywhere(const std::string& uri, const capture::CameraOptions& options)
      : uri_(uri), options_(options) {
    options_.loop = false;  // so that it tells its length
    const Source source(open(0));
    frames_ = source.info().frames;
    begin_ = source.first().time;
  }

  std::int64_t frames() const { return frames_; }
  capture::Time begin() const { return begin_; }
  // Nothing where it cannot begin with that frame.
  std::optional<Stamp> stamp(std::int64_t frame) {
    try {
      const Source source(open(frame));
      if (source.first().number != frame) return std::nullopt;
      return Stamp{frame, source.first().time, source.next_time()};
    } catch (const std::runtime_error&) {
      return std::nullopt;
    }
  }

 private:
  std::unique_ptr<capture::Camera> open(std::int64_t frame) {
    if (frame > 0) options_.frame = frame;
    return capture::open_camera(uri_, options_);
  }

  std::string uri_;
  capture::CameraOptions options_;
  std::int64_t frames_ = 0;
  capture::Time begin_{};
};

// Between two frames, as far as the time is.
std::int64_t frame_between(const Stamp& before, const Stamp& after, capture::Time time) {
  const double share = std::chrono::duration<double>(time - before.time) /
                       std::chrono::duration<double>(after.time - before.time);
  const auto frames = static_cast<double>(after.frame - before.frame);
  return std::clamp(before.frame + static_cast<std::int64_t>(std::floor(share * frames)),
                    before.frame + 1, after.frame - 1);
}

}  // namespace

RecordingPlace find_place(const std::string& uri,
                          const capture::CameraOptions& options,
                          capture::Time time) {
  OpenedAnywhere recording(uri, options);
  const std::int64_t frames = recording.frames();
  if (frames < 3 || time <= recording.begin()) return {};
  const std::optional<Stamp> last_but_one = recording.stamp(frames - 2);
  if (!last_but_one || !last_but_one->next) return {};
  const Stamp last{frames - 1, *last_but_one->next};
  RecordingPlace place;
  if (options.loop) {
    const capture::Time pass = last.time + (last.time - last_but_one->time);
    place.passed = time / pass * pass;
    time -= place.passed;
  }
  if (time >= last.time) {
    place.frame = last.frame;
    return place;
  }
  // Most have an even rate, and are found at once.
  constexpr int most_guesses = 4;
  Stamp before{0, recording.begin()}, after = last;
  for (int n = 0; after.frame - before.frame > 1; ++n) {
    const std::optional<Stamp> middle = recording.stamp(
        n < most_guesses ? frame_between(before, after, time) : (before.frame + after.frame) / 2);
    if (!middle) return {};
    if (middle->time > time) {
      after = *middle;
    } else {
      before = *middle;
      if (before.next && *before.next > time) break;
    }
  }
  place.frame = before.frame;
  return place;
}

}  // namespace studio
