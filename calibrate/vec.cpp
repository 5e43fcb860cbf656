// 3x3 matrices.
#include "calibrate/vec.h"

namespace calibrate {

Mat3 Mat3::operator*(const Mat3& b) const {
  Mat3 c;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      c.m[i * 3 + j] = m[i * 3] * b.m[j] + m[i * 3 + 1] * b.m[3 + j] + m[i * 3 + 2] * b.m[6 + j];
    }
  }
  return c;
}

}  // namespace calibrate
