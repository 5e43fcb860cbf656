// The surfaces of the made car.
#include "render/made_car_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/made_car.h"

namespace render {
namespace {

using std::numbers::pi;
constexpr int angles = 8192;  // of half the outline

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * t * (t * (6 * t - 15) + 10);
}
double bell(double x, double width) { return std::exp(-(x / width) * (x / width)); }

// The plan's outline is a superellipse, rounder in front.
double exponent(double x) { return x > 0 ? 3.5 : 4.4; }
std::array<double, 2> outline_at_angle(double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double n = exponent(c);
  const double r = std::pow(std::pow(std::abs(c) / CarShape::half_length, n) +
                                std::pow(std::abs(s) / CarShape::half_width, n),
                            -1 / n);
  return {r * c, r * s};
}

}  // namespace

CarShape::CarShape()
    : shoulder_({{-2.10, 0.900},
                 {-1.90, 0.945},
                 {-1.40, 0.955},
                 {-0.80, 0.935},
                 {0.00, 0.905},
                 {0.50, 0.885},
                 {1.00, 0.850},
                 {1.50, 0.785},
                 {1.90, 0.705},
                 {2.10, 0.655}}),
      crown_({{-1.958, 0.0},
              {-1.85, 0.028},
              {-1.50, 0.05},
              {0.50, 0.06},
              {1.10, 0.085},
              {1.55, 0.075},
              {1.80, 0.038},
              {1.908, 0.0}}),
      height_({{-1.80, 0.0},
               {-1.66, 0.100},
               {-1.46, 0.225},
               {-1.22, 0.340},
               {-0.95, 0.405},
               {-0.40, 0.440},
               {0.00, 0.420},
               {0.25, 0.365},
               {0.55, 0.240},
               {0.85, 0.085},
               {1.02, 0.0}}),
      inset_({{-0.05, 0.070},
              {0.00, 0.055},
              {0.10, 0.024},
              {0.30, 0.004},
              {0.45, 0.0},
              {0.62, 0.006},
              {0.78, 0.022},
              {0.90, 0.045},
              {0.97, 0.072},
              {1.00, 0.092}}) {
  ways_.push_back(0);
  std::array<double, 2> before = outline_at_angle(0);
  for (int i = 1; i <= angles; ++i) {
    const std::array<double, 2> at = outline_at_angle(pi * i / angles);
    ways_.push_back(ways_.back() + std::hypot(at[0] - before[0], at[1] - before[1]));
    before = at;
  }
  length_ = 2 * ways_.back();
  for (int i = 0; i <= 4000; ++i) {
    const double way = ways_.back() * i / 4000;
    const Vec3 p = band(way, shoulder_z(x_at_way(way)));
    if (shoulders_.empty() || p.x < shoulders_.back()[0]) shoulders_.push_back({p.x, p.y, p.z});
  }
}

double CarShape::angle_at_way(double way) const {
  const auto above = std::upper_bound(ways_.begin(), ways_.end() - 1, way);
  const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, above - ways_.begin()));
  const double share = (way - ways_[i - 1]) / (ways_[i] - ways_[i - 1]);
  return pi * (static_cast<double>(i - 1) + share) / angles;
}

std::array<double, 2> CarShape::outline(double way, std::array<double, 2>& normal) const {
  way -= length_ * std::floor(way / length_ + 0.5);
  const std::array<double, 2> left = outline_at_angle(angle_at_way(std::abs(way)));
  const double n = exponent(left[0]);
  const double nx =
      std::copysign(std::pow(std::abs(left[0]) / half_length, n - 1), left[0]) / half_length;
  const double ny = std::pow(std::max(0.0, left[1]) / half_width, n - 1) / half_width;
  const double l = std::hypot(nx, ny);
  const double side = way < 0 ? -1 : 1;
  normal = {nx / l, side * ny / l};
  return {left[0], side * left[1]};
}

double CarShape::x_at_way(double way) const {
  std::array<double, 2> normal;
  return outline(way, normal)[0];
}

double CarShape::way_at_x(double x) const {
  double low = 0, high = length_ / 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (x_at_way(middle) > x ? low : high) = middle;
  }
  return (low + high) / 2;
}

double CarShape::sill_z(double x) const {
  for (const double axle :
       {static_cast<double>(car_front_axle_x), static_cast<double>(car_rear_axle_x)}) {
    const double d = std::abs(x - axle);
    if (d <= arch_radius)
      return car_wheel_radius_m + std::sqrt(std::max(0.0, arch_radius * arch_radius - d * d));
  }
  return floor_z;
}

double CarShape::shoulder_z(double x) const { return shoulder_(x); }

Vec3 CarShape::band(double way, double z) const {
  std::array<double, 2> normal;
  const auto [x, y] = outline(way, normal);
  const double q = (z - floor_z) / (shoulder_z(x) - floor_z);
  const double front = smooth_step(1.45, 2.05, x);
  const double rear = smooth_step(1.6, 2.08, -x);
  const double side = (1 - front) * (1 - rear);
  double inset = inset_(q);
  // The nose leans back over its bumper; the tail leans forward.
  inset += front * (0.10 * smooth_step(0.45, 1.0, q) + 0.05 * (1 - smooth_step(0.0, 0.3, q)));
  inset += rear * (0.05 * smooth_step(0.5, 1.0, q) + 0.04 * (1 - smooth_step(0.0, 0.3, q)));
  // A line along the flank, and a hollow in the doors below it.
  inset -= 0.011 * side * bell(q - 0.71, 0.055) * smooth_step(-2.0, -1.5, x);
  inset += 0.020 * side * bell(q - 0.30, 0.15) * smooth_step(-0.95, -0.55, x) *
           (1 - smooth_step(0.55, 0.95, x));
  // Flared arches.
  for (const double axle :
       {static_cast<double>(car_front_axle_x), static_cast<double>(car_rear_axle_x)}) {
    const double d = std::hypot(x - axle, z - car_wheel_radius_m) - arch_radius;
    if (z > 0.12 && d > -0.05) inset -= 0.030 * bell(std::max(0.0, d), 0.075);
  }
  return {x - normal[0] * inset, y - normal[1] * inset, z};
}

std::array<double, 2> CarShape::shoulder_at(double x) const {
  const auto found =
      std::lower_bound(shoulders_.begin(), shoulders_.end(), x,
                       [](const std::array<double, 3>& s, double at) { return s[0] > at; });
  if (found == shoulders_.begin()) return {0, shoulders_.front()[2]};
  if (found == shoulders_.end()) return {0, shoulders_.back()[2]};
  const auto& a = *(found - 1);
  const auto& b = *found;
  const double share = (a[0] - x) / (a[0] - b[0]);
  return {a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])};
}

Vec3 CarShape::deck(double x, double share) const {
  const double swell = 1 - std::pow(std::abs(share), 2.4);
  // Two soft creases along the bonnet.
  const double crease = 0.008 * bell(std::abs(share) - 0.52, 0.10) * smooth_step(0.7, 1.0, x) *
                        (1 - smooth_step(1.6, 1.95, x));
  const auto [half_width, z] = shoulder_at(x);
  return {x, share * half_width, z + crown_(x) * swell + crease};
}

double CarShape::cabin_height(double foot_x) const { return height_(foot_x); }

Vec3 CarShape::cabin(double foot_x, double share) const {
  const double angle = pi * share;
  const double c = std::cos(angle), s = std::sin(angle);
  constexpr double n = 3.4;
  const double r = std::pow(std::pow(std::abs(c), n) + std::pow(std::abs(s), n), -1 / n);
  const double across = r * c, up = r * std::max(0.0, s);
  const double h = height_(foot_x);
  // Sides lean in; in front and behind, glass swings forward and back in the middle.
  const double lean = 1 - 0.22 * up * smooth_step(0.0, 0.3, h) - 0.06 * up;
  const double swing_front = 0.16 * smooth_step(-0.2, 0.95, foot_x);
  const double swing_rear = 0.12 * smooth_step(1.0, 1.75, -foot_x);
  const double x = foot_x + (swing_front - swing_rear) * (1 - across * across) - 0.10 * swing_front;
  const double half = shoulder_at(x)[0];
  const double foot_z = deck(x, across * lean).z;
  const double roof_curve = -0.035 * std::abs(across) * up * smooth_step(0.0, 0.3, h);
  return {x, -across * lean * half, foot_z + h * up + roof_curve};
}

}  // namespace render
