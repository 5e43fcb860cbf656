// When frames are.
#include "capture/frame.h"

#include <stdexcept>

namespace capture {

Time time_of_frame(std::int64_t n, Rational rate) {
  if (rate.num <= 0 || rate.den <= 0) {
    throw std::invalid_argument("a frame has a time only at a rate above 0");
  }
  // 128 bits: 2^40 frames of 1001 units in nanoseconds take 80.
  __extension__ using Wide = __int128;
  const Wide scaled = Wide{n} * rate.den * std::nano::den;
  Wide time_ns = scaled / rate.num;
  if (scaled % rate.num < 0) {
    time_ns -= 1;
  }
  return Time{static_cast<Time::rep>(time_ns)};
}

}  // namespace capture
