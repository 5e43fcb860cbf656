// Families of response curves, with the parameters that a fit may choose.
#pragma once

#include <array>
#include <string>

#include "capture/response.h"

namespace capture {

// The logarithm of a curve's light, and its derivatives by the curve's parameters.
struct LogLight {
  double value = 0;
  std::array<double, 16> gradient{};
};

// Curves from codes z = 0..1 to light 0..1, through (0, 0) and (1, 1), a set of parameters per
// channel: one known response; z^p; z + z (1 - z) (p0 + p1 z + ...), any polynomial of the degree
// that has these ends; or z^2 times the exponential of a cubic spline over free_place(z), whose
// parameters are the values of its B-splines, free of any form.
struct CurveFamily {
  static constexpr int channels = 3;
  static constexpr int highest_degree = 9;
  static constexpr int free_parameters = 14;
  enum class Kind { fixed, power, polynomial, free };
  Kind kind = Kind::fixed;
  int degree = 0;  // of polynomials, 2 to highest_degree
  Response fixed;

  int parameters() const;  // of one channel
  std::string name() const;
  // Where a code lies on the free curve's spline, 0..1: evenly by its logarithm, but near black.
  static double free_place(double z);
  // `p` points at one channel's parameters. The logarithm stays finite at and below black.
  double light(int channel, const double* p, double z) const;
  LogLight log_light(int channel, const double* p, double z) const;
  // The table of all channels, whose parameters follow each other at `p`; made to rise where a
  // polynomial does not.
  Response response(const double* p) const;
};

}  // namespace capture
