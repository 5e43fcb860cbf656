// Families of response curves, with the parameters that a fit may choose.
#pragma once

#include <array>
#include <string>

#include "capture/response.h"

namespace capture {

// The logarithm of a curve's light, and its derivatives by the curve's parameters.
struct LogLight {
  double value = 0;
  std::array<double, 8> gradient{};
};

// Curves from codes z = 0..1 to light 0..1, through (0, 0) and (1, 1), a set of parameters per
// channel: one known response; z^p; or z + z (1 - z) (p0 + p1 z + ...), any polynomial of the
// degree that has these ends.
struct CurveFamily {
  static constexpr int channels = 3;
  static constexpr int highest_degree = 9;
  enum class Kind { fixed, power, polynomial };
  Kind kind = Kind::fixed;
  int degree = 0;  // of polynomials, 2 to highest_degree
  Response fixed;

  int parameters() const;  // of one channel
  std::string name() const;
  // `p` points at one channel's parameters. The logarithm stays finite at and below black.
  double light(int channel, const double* p, double z) const;
  LogLight log_light(int channel, const double* p, double z) const;
  // The table of all channels, whose parameters follow each other at `p`; made to rise where a
  // polynomial does not.
  Response response(const double* p) const;
};

}  // namespace capture
