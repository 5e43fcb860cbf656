// Transfer curves as polynomials.
#include "compositing/key_lanes.h"

#include <array>

namespace compositing {
namespace {

constexpr std::size_t terms = 6;

// Least squares of v * p(v) at 1024 values, by Gauss without pivoting: the matrix is positive.
LightPolynomial fit(capture::Transfer transfer) {
  std::array<std::array<double, terms + 1>, terms> rows{};
  for (int i = 0; i < 1024; ++i) {
    const double v = (i + 0.5) / 1024, light = capture::decode(transfer, v);
    std::array<double, terms> basis{};
    double power = v;
    for (double& b : basis) b = power, power *= v;
    for (std::size_t r = 0; r < terms; ++r) {
      for (std::size_t c = 0; c < terms; ++c) rows[r][c] += basis[r] * basis[c];
      rows[r][terms] += basis[r] * light;
    }
  }
  for (std::size_t p = 0; p < terms; ++p) {
    for (std::size_t r = p + 1; r < terms; ++r) {
      const double by = rows[r][p] / rows[p][p];
      for (std::size_t c = p; c <= terms; ++c) rows[r][c] -= by * rows[p][c];
    }
  }
  LightPolynomial polynomial;
  std::array<double, terms> solved{};
  for (std::size_t r = terms; r-- > 0;) {
    double sum = rows[r][terms];
    for (std::size_t c = r + 1; c < terms; ++c) sum -= rows[r][c] * solved[c];
    solved[r] = sum / rows[r][r];
    polynomial.factors[r] = static_cast<float>(solved[r]);
  }
  return polynomial;
}

}  // namespace

LightPolynomial light_polynomial(capture::Transfer transfer) {
  static const std::array<LightPolynomial, 4> all{
      fit(capture::Transfer::rec1886), fit(capture::Transfer::srgb),
      fit(capture::Transfer::rec709_camera), fit(capture::Transfer::linear)};
  return all[static_cast<std::size_t>(transfer)];
}

}  // namespace compositing
