// When frames are.
#include "capture/frame.h"

#include <cmath>
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

std::int64_t frame_at(Time time, Rational rate) {
  if (rate.num <= 0 || rate.den <= 0) {
    throw std::invalid_argument("a time has a frame only at a rate above 0");
  }
  // n den 1e9 / num < time + 1 is what rounding down to nanoseconds leaves of n's time <= time.
  __extension__ using Wide = __int128;
  const Wide scaled = (Wide{time.count()} + 1) * rate.num - 1;
  const Wide step = Wide{rate.den} * std::nano::den;
  Wide n = scaled / step;
  if (scaled % step < 0) {
    n -= 1;
  }
  return static_cast<std::int64_t>(n);
}

std::optional<Rational> nominal_rate(double rate, double tolerance) {
  constexpr double largest = 1e6;
  if (!(rate > 0) || !(rate < largest)) {
    return std::nullopt;
  }
  const std::int64_t of_ntsc = std::llround(rate * 1.001);
  const bool is_known = of_ntsc % 24 == 0 || of_ntsc % 30 == 0;  // there is no 49.95
  const Rational whole{std::llround(rate), 1}, ntsc{is_known ? 1000 * of_ntsc : 0, 1001};
  const auto off = [&](const Rational& named) {
    return named.num > 0 ? std::abs(rate / named.value() - 1) : HUGE_VAL;
  };
  const Rational nearer = off(ntsc) < off(whole) ? ntsc : whole;
  return off(nearer) <= tolerance ? std::optional(nearer) : std::nullopt;
}

}  // namespace capture
