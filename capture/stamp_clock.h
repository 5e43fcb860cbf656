// From a container's time stamps to the times of frames.
#pragma once

#include <cstdint>
#include <optional>

#include "capture/frame.h"

namespace capture {

// Times since the first frame, always rising. Containers and recorders round their stamps, often to
// 1 ms: a stamp within an eighth of a frame, or one tick, of a frame's time at the nominal rate is
// taken to be exactly that, so that frames neither drift nor jitter. Frames without a stamp follow
// the one before at the rate.
class StampClock {
 public:
  // Ticks of num/den seconds; rate 0/1 = unknown (25/1 where a frame has no stamp). Where the
  // `length` is known, stamps that jump beyond it are damage.
  StampClock(Rational tick, Rational rate, std::optional<Time> length = {});

  // Of the next frame. Stamps that do not rise, or are absurd, count as missing.
  Time time_of(std::optional<std::int64_t> stamp);
  // The stamp that time 0 stands for; 0 before the first frame.
  std::int64_t first_stamp() const { return first_stamp_.value_or(0); }
  // Of the last frame; 0 before the first.
  Time last() const { return last_.value_or(Time{}); }
  // Where the frame after the last one would be.
  Time end() const;
  // The number of the frame at exactly this time; nothing if there is none, or no rate.
  std::optional<std::int64_t> frame_at(Time time) const;
  // From time 0 again, which the next frame's stamp, or this one, stands for.
  void restart(std::optional<std::int64_t> first_stamp = std::nullopt);

 private:
  std::optional<Time> since_first(std::int64_t stamp) const;
  std::int64_t nearest_frame(Time time) const;
  Time period() const;

  Rational tick_;
  Rational rate_;
  std::optional<Time> length_;
  std::optional<std::int64_t> first_stamp_;
  std::optional<Time> last_;
  Time last_step_;
};

}  // namespace capture
