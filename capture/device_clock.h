// From the time stamps of a camera's own clock to the monotonic clock.
#pragma once

#include <optional>

#include "capture/frame.h"

namespace capture {

// Stamps arrive with a delay that is never negative and often small: the smallest difference
// between arrival and stamp of the last 2 to 4 seconds is taken for what lies between the clocks.
// So times do not jitter as arrivals do, and follow a clock that drifts by 100 ppm to 0.4 ms. What
// the smallest delay itself is cannot be seen.
class DeviceClock {
 public:
  // The stamp on the monotonic clock, never after its arrival. Nothing, and all is forgotten, if
  // the stamp has moved a second more or less than the arrival since the last one.
  std::optional<Time> map(Time stamp, Time arrival);
  void reset() { *this = {}; }

 private:
  std::optional<Time> last_stamp_;
  Time last_arrival_{};
  Time window_begin_{};
  std::optional<Time> least_before_;  // of the window before
  std::optional<Time> least_;
};

}  // namespace capture
