// The greatest value of a function of one number.
#pragma once

#include <cmath>

namespace calibrate {

// Where it is, to a tolerance, between two bounds within which there is one maximum: by golden
// sections.
template <class Function>
double maximize(double low, double high, double tolerance, const Function& f) {
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double x1 = high - golden * (high - low);
  double x2 = low + golden * (high - low);
  double f1 = f(x1);
  double f2 = f(x2);
  while (high - low > tolerance) {
    if (f1 >= f2) {
      high = x2;
      x2 = x1;
      f2 = f1;
      x1 = high - golden * (high - low);
      f1 = f(x1);
    } else {
      low = x1;
      x1 = x2;
      f1 = f2;
      x2 = low + golden * (high - low);
      f2 = f(x2);
    }
  }
  return (low + high) / 2;
}

}  // namespace calibrate
