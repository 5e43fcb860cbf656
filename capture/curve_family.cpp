// Response curves by family: values, logarithms, gradients.
#include "capture/curve_family.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace capture {
namespace {

constexpr double white = Response::codes - 1;

double interpolated(const std::array<double, Response::codes>& light, double z) {
  const double code = std::clamp(z, 0.0, 1.0) * white;
  const auto below = std::min(static_cast<std::size_t>(code), std::size_t{Response::codes - 2});
  const double share = code - static_cast<double>(below);
  return light[below] + (light[below + 1] - light[below]) * share;
}

// Coefficients of z + z (1 - z) (p0 + p1 z + ...), highest power first.
std::vector<double> expanded(int degree, const double* p) {
  std::vector<double> lowest_first(static_cast<std::size_t>(degree) + 1, 0.0);
  lowest_first[1] = 1;
  for (std::size_t i = 0; i + 2 < lowest_first.size(); ++i) {
    lowest_first[i + 1] += p[i];
    lowest_first[i + 2] -= p[i];
  }
  return {lowest_first.rbegin(), lowest_first.rend()};
}

// Uniform cubic B-splines over 0..1, as many as the free curve has.
using Basis = std::array<double, CurveFamily::free_parameters>;

Basis spline_basis(double u) {
  constexpr int pieces = CurveFamily::free_parameters - 3;
  const double place = std::clamp(u, 0.0, 1.0) * pieces;
  const int piece = std::min(static_cast<int>(place), pieces - 1);
  const double t = place - piece;
  Basis basis{};
  const auto first = static_cast<std::size_t>(piece);
  basis[first] = (1 - t) * (1 - t) * (1 - t) / 6;
  basis[first + 1] = (3 * t * t * t - 6 * t * t + 4) / 6;
  basis[first + 2] = (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6;
  basis[first + 3] = t * t * t / 6;
  return basis;
}

// The spline less its value at white, so that white has light 1.
Basis free_basis(double z) {
  static const Basis at_white = spline_basis(1);
  Basis basis = spline_basis(CurveFamily::free_place(z));
  for (std::size_t i = 0; i < basis.size(); ++i) basis[i] -= at_white[i];
  return basis;
}

double free_log_light(const double* p, double z) {
  constexpr double least_code = 1e-3;
  const Basis basis = free_basis(z);
  double log_light = 2 * std::log(std::max(least_code, z));
  for (std::size_t i = 0; i < basis.size(); ++i) log_light += p[i] * basis[i];
  return log_light;
}

}  // namespace

double CurveFamily::free_place(double z) {
  constexpr double black = 0.05;  // codes far below it share a place
  return std::log1p(std::max(0.0, z) / black) / std::log1p(1 / black);
}

int CurveFamily::parameters() const {
  switch (kind) {
    case Kind::fixed:
      return 0;
    case Kind::power:
      return 1;
    case Kind::polynomial:
      return degree - 1;
    case Kind::free:
      return free_parameters;
  }
  return 0;
}

std::string CurveFamily::name() const {
  switch (kind) {
    case Kind::fixed:
      return fixed.name;
    case Kind::power:
      return "gamma";
    case Kind::polynomial:
      return "polynomial of degree " + std::to_string(degree);
    case Kind::free:
      return "free curve";
  }
  return "";
}

double CurveFamily::light(int channel, const double* p, double z) const {
  switch (kind) {
    case Kind::fixed:
      return interpolated(fixed.light[static_cast<std::size_t>(channel)], z);
    case Kind::power:
      return std::pow(z, p[0]);
    case Kind::polynomial: {
      double inner = 0;
      for (int i = parameters() - 1; i >= 0; --i) inner = inner * z + p[i];
      return z + z * (1 - z) * inner;
    }
    case Kind::free:
      return z > 0 ? std::exp(free_log_light(p, z)) : 0;
  }
  return 0;
}

LogLight CurveFamily::log_light(int channel, const double* p, double z) const {
  if (kind == Kind::free) {
    LogLight result{free_log_light(p, z), {}};
    const Basis basis = free_basis(z);
    std::copy(basis.begin(), basis.end(), result.gradient.begin());
    return result;
  }
  constexpr double least_light = 1e-6;  // below it a logarithm says nothing
  const double value = std::max(least_light, light(channel, p, z));
  LogLight result{std::log(value), {}};
  if (kind == Kind::power) {
    result.gradient[0] = std::log(z);
  } else if (kind == Kind::polynomial) {
    double basis = z * (1 - z) / value;
    for (std::size_t i = 0; i < static_cast<std::size_t>(parameters()); ++i, basis *= z) {
      result.gradient[i] = basis;
    }
  }
  return result;
}

Response CurveFamily::response(const double* p) const {
  if (kind == Kind::fixed) return fixed;
  Response response;
  response.name = name();
  for (int c = 0; c < channels; ++c, p += parameters()) {
    auto& curve = response.light[static_cast<std::size_t>(c)];
    for (std::size_t z = 0; z < curve.size(); ++z) {
      curve[z] = light(c, p, static_cast<double>(z) / white);
    }
    curve.front() = 0;
    curve.back() = 1;
    for (std::size_t z = 1; z < curve.size(); ++z) curve[z] = std::max(curve[z], curve[z - 1]);
    if (kind == Kind::polynomial) {
      response.coefficients[static_cast<std::size_t>(c)] = expanded(degree, p);
    }
  }
  return response;
}

}  // namespace capture
