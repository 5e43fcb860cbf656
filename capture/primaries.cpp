// RGB to XYZ to Rec.709, with Bradford adaptation of white.
#include "capture/primaries.h"

#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace capture {
namespace {

using Matrix = std::array<double, 9>;  // row-major
using Vector = std::array<double, 3>;

Vector operator*(const Matrix& m, const Vector& v) {
  Vector product{};
  for (std::size_t row = 0; row < 3; ++row) {
    product[row] = m[3 * row] * v[0] + m[3 * row + 1] * v[1] + m[3 * row + 2] * v[2];
  }
  return product;
}

Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      for (std::size_t k = 0; k < 3; ++k) {
        product[3 * row + column] += a[3 * row + k] * b[3 * k + column];
      }
    }
  }
  return product;
}

Matrix inverse(const Matrix& m) {
  const Matrix cofactors{
      m[4] * m[8] - m[5] * m[7], m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
      m[5] * m[6] - m[3] * m[8], m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
      m[3] * m[7] - m[4] * m[6], m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3]};
  const double determinant = m[0] * cofactors[0] + m[1] * cofactors[3] + m[2] * cofactors[6];
  // Real colour spaces have determinants from 0.05 (Rec.709's chromaticities) to 1 (XYZ).
  constexpr double flat = 1e-6;
  if (!(std::abs(determinant) > flat)) {
    throw std::invalid_argument("the primaries lie on a line and span no colour space");
  }
  Matrix result{};
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = cofactors[i] / determinant;
  return result;
}

Vector with_luminance_one(const std::array<double, 2>& xy) {
  if (!(std::abs(xy[1]) > 1e-6)) {
    throw std::invalid_argument("a white with y = 0 has no luminance");
  }
  return {xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]};
}

Matrix diagonal(const Vector& v) { return {v[0], 0, 0, 0, v[1], 0, 0, 0, v[2]}; }

Matrix xyz_from(const Primaries& p) {
  const Matrix columns{p.red[0],
                       p.green[0],
                       p.blue[0],
                       p.red[1],
                       p.green[1],
                       p.blue[1],
                       1 - p.red[0] - p.red[1],
                       1 - p.green[0] - p.green[1],
                       1 - p.blue[0] - p.blue[1]};
  return columns * diagonal(inverse(columns) * with_luminance_one(p.white));
}

// Lam, "Metamerism and Colour Constancy", PhD thesis, Bradford 1985: white scaled in a space of
// sharpened cone responses.
Matrix adaptation(const Vector& from_white, const Vector& to_white) {
  constexpr Matrix cone_from_xyz{0.8951, 0.2664, -0.1614, -0.7502, 1.7135,
                                 0.0367, 0.0389, -0.0685, 1.0296};
  const Vector from = cone_from_xyz * from_white;
  const Vector to = cone_from_xyz * to_white;
  return inverse(cone_from_xyz) * diagonal({to[0] / from[0], to[1] / from[1], to[2] / from[2]}) *
         cone_from_xyz;
}

bool is_xyz(const Primaries& p) {
  constexpr double close = 1e-3;
  const auto near = [](const std::array<double, 2>& a, const std::array<double, 2>& b) {
    return std::abs(a[0] - b[0]) < close && std::abs(a[1] - b[1]) < close;
  };
  return near(p.red, xyz.red) && near(p.green, xyz.green) && near(p.blue, xyz.blue);
}

}  // namespace

std::array<double, 9> rec709_from(const Primaries& primaries) {
  const Matrix rec709_from_xyz = inverse(xyz_from(rec709));
  const Matrix xyz_from_rgb = xyz_from(primaries);
  const Matrix result = is_xyz(primaries) ? rec709_from_xyz * xyz_from_rgb
                                          : rec709_from_xyz *
                                                adaptation(with_luminance_one(primaries.white),
                                                           with_luminance_one(rec709.white)) *
                                                xyz_from_rgb;
  for (const double element : result) {
    if (!std::isfinite(element)) {
      throw std::invalid_argument("the primaries span no colour space");
    }
  }
  return result;
}

void convert_to_rec709(Image& image, const Primaries& primaries) {
  if (image.channels < 3 || primaries == rec709) return;
  std::array<float, 9> m{};
  const Matrix exact = rec709_from(primaries);
  for (std::size_t i = 0; i < m.size(); ++i) m[i] = static_cast<float>(exact[i]);
  const auto step = static_cast<std::size_t>(image.channels);
  for (std::size_t i = 0; i + step <= image.pixels.size(); i += step) {
    float* rgb = &image.pixels[i];
    const float r = rgb[0];
    const float g = rgb[1];
    const float b = rgb[2];
    rgb[0] = m[0] * r + m[1] * g + m[2] * b;
    rgb[1] = m[3] * r + m[4] * g + m[5] * b;
    rgb[2] = m[6] * r + m[7] * g + m[8] * b;
  }
}

}  // namespace capture
