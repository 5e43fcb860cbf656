// Our own lens models: symmetric about the optical axis, but for decentring.
#include "calibrate/axial_lens.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace calibrate {
namespace {

using std::numbers::pi;
// Radii this far beyond the largest one are rounding errors of a pixel at the largest angle.
constexpr double radius_slack = 1e-12;
// Closer to the axis than this, sin(angle) / radius is 1 to double precision.
constexpr double paraxial_radius = 1e-9;
// A pinhole's picture plane has no end; beyond this angle its pixels are useless.
constexpr double pinhole_max_angle_rad = pi / 2 - 1e-6;

}  // namespace

std::optional<AxialLens::Kind> AxialLens::kind_of(std::string_view model) {
  if (model == "pinhole") return Kind::pinhole;
  if (model == "equisolid") return Kind::equisolid;
  if (model == "kannala_brandt") return Kind::kannala_brandt;
  if (model == "decentred_kannala_brandt") return Kind::decentred_kannala_brandt;
  return std::nullopt;
}

AxialLens::AxialLens(const Lens& lens) : kind_(kind_of(lens.model).value()) {
  const std::vector<double>& p = lens.parameters;
  if (kind_ == Kind::equisolid) {
    focal_px_ = {p[0], p[0]};
    centre_ = {p[1], p[2]};
  } else {
    focal_px_ = {p[0], p[1]};
    centre_ = {p[2], p[3]};
    if (decentred()) decentring_ = {p[4], p[5]};
    std::copy(p.begin() + (decentred() ? 6 : 4), p.end(), k_.begin());
  }
  max_angle_rad_ = kind_ == Kind::pinhole ? std::min(lens.max_angle_rad, pinhole_max_angle_rad)
                                          : fold_angle(lens.max_angle_rad);
  max_radius_ = radius(max_angle_rad_);
  least_cosine_ = std::cos(std::min(max_angle_rad_ * (1 + radius_slack), pi));
}

double AxialLens::radius(double angle_rad) const {
  switch (kind_) {
    case Kind::pinhole:
      return std::tan(angle_rad);
    case Kind::equisolid:
      return 2 * std::sin(angle_rad / 2);
    case Kind::kannala_brandt:
    case Kind::decentred_kannala_brandt:
      break;
  }
  const double t2 = angle_rad * angle_rad;
  return angle_rad * (1 + t2 * (k_[0] + t2 * (k_[1] + t2 * (k_[2] + t2 * k_[3]))));
}

// Of the Kannala-Brandt polynomial.
double AxialLens::radius_slope(double angle_rad) const {
  const double t2 = angle_rad * angle_rad;
  return 1 + t2 * (3 * k_[0] + t2 * (5 * k_[1] + t2 * (7 * k_[2] + t2 * 9 * k_[3])));
}

// The angle at which the radius stops growing, or max_angle_rad if it grows up to there.
double AxialLens::fold_angle(double max_angle_rad) const {
  if (kind_ != Kind::kannala_brandt && !decentred()) return max_angle_rad;
  if (std::ranges::all_of(k_, [](double k) { return k >= 0; })) return max_angle_rad;
  constexpr int steps = 256;
  double below = 0;
  for (int i = 1; i <= steps; ++i) {
    double above = max_angle_rad * i / steps;
    if (radius_slope(above) <= 0) {
      for (int bisection = 0; bisection < 52; ++bisection) {
        const double middle = 0.5 * (below + above);
        (radius_slope(middle) > 0 ? below : above) = middle;
      }
      return below;
    }
    below = above;
  }
  return max_angle_rad;
}

double AxialLens::angle(double radius_wanted) const {
  switch (kind_) {
    case Kind::pinhole:
      return std::atan(radius_wanted);
    case Kind::equisolid:
      return 2 * std::asin(std::min(radius_wanted / 2, 1.0));
    case Kind::kannala_brandt:
    case Kind::decentred_kannala_brandt:
      break;
  }
  // Newton's steps, and bisection where one would leave the bracket; the radius grows inside it.
  double below = 0;
  double above = max_angle_rad_;
  double t = std::min(radius_wanted, above);
  for (int iteration = 0; iteration < 60; ++iteration) {
    const double excess = radius(t) - radius_wanted;
    (excess < 0 ? below : above) = t;
    double next = t - excess / radius_slope(t);
    if (!(next > below && next < above)) next = 0.5 * (below + above);
    if (std::abs(next - t) <= 4 * std::numeric_limits<double>::epsilon() * t) return next;
    t = next;
  }
  return t;
}

Vec2 AxialLens::ray_of_radius(double r) const {
  if (r < paraxial_radius) return {1, 1};
  if (kind_ == Kind::equisolid) {
    const double s = std::min(r / 2, 1.0);
    return {std::sqrt(1 - s * s), 1 - 2 * s * s};
  }
  if (kind_ == Kind::pinhole) {
    const double cosine = 1 / std::sqrt(1 + r * r);
    return {cosine, cosine};
  }
  const double t = angle(r);
  return {std::sin(t) / r, std::cos(t)};
}

std::optional<Vec2> AxialLens::project(Vec3 v) const {
  const double l = length(v);
  if (!std::isfinite(l) || l == 0) return std::nullopt;
  // Straight behind, every direction in the picture is as good as another.
  if (v.x == 0 && v.y == 0 && v.z < 0) return std::nullopt;
  const std::optional<double> scale =
      kind_ == Kind::equisolid ? equisolid_scale(v, l) : scale_by_angle(v, l);
  if (!scale) return std::nullopt;
  const Vec2 u = decentre({v.x * *scale, v.y * *scale});
  return Vec2{focal_px_.x * u.x + centre_.x, focal_px_.y * u.y + centre_.y};
}

Vec2 AxialLens::decentre(Vec2 s) const {
  if (!decentred()) return s;
  const auto [p1, p2] = decentring_;
  const double r2 = s.x * s.x + s.y * s.y;
  const double twice_xy = 2 * s.x * s.y;
  return {s.x + p1 * twice_xy + p2 * (r2 + 2 * s.x * s.x),
          s.y + p1 * (r2 + 2 * s.y * s.y) + p2 * twice_xy};
}

// By Newton's method; nothing where the decentring has folded the picture.
std::optional<Vec2> AxialLens::recentre(Vec2 d) const {
  if (!decentred()) return d;
  const auto [p1, p2] = decentring_;
  Vec2 s = d;
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Vec2 at = decentre(s);
    const Vec2 miss{d.x - at.x, d.y - at.y};
    const double xx = 1 + 2 * p1 * s.y + 6 * p2 * s.x;
    const double xy = 2 * p1 * s.x + 2 * p2 * s.y;
    const double yy = 1 + 6 * p1 * s.y + 2 * p2 * s.x;
    const double determinant = xx * yy - xy * xy;
    if (!(determinant > 0.1)) return std::nullopt;
    const Vec2 move{(yy * miss.x - xy * miss.y) / determinant,
                    (xx * miss.y - xy * miss.x) / determinant};
    s = {s.x + move.x, s.y + move.y};
    if (hypotenuse(move.x, move.y) < 1e-14 * (1 + hypotenuse(s.x, s.y))) return s;
  }
  return std::nullopt;
}

// The picture radius over the distance from the axis; nothing beyond the largest angle.
std::optional<double> AxialLens::scale_by_angle(Vec3 v, double l) const {
  const double off_axis = std::hypot(v.x, v.y);
  const double angle_rad = std::atan2(off_axis, v.z);
  if (angle_rad > max_angle_rad_ * (1 + radius_slack)) return std::nullopt;
  if (kind_ == Kind::pinhole) return 1 / v.z;
  return angle_rad > paraxial_radius ? radius(angle_rad) / off_axis : 1 / l;
}

// The same without the angle itself: the radius is twice the sine of half of it.
std::optional<double> AxialLens::equisolid_scale(Vec3 v, double l) const {
  const double cosine = v.z / l;
  if (cosine < least_cosine_) return std::nullopt;
  if (cosine >= 0) return std::sqrt(2 / (1 + cosine)) / l;
  return std::sqrt(2 * (1 - cosine)) / std::hypot(v.x, v.y);
}

std::optional<Vec3> AxialLens::unproject(Vec2 q) const {
  const auto symmetric =
      recentre({(q.x - centre_.x) / focal_px_.x, (q.y - centre_.y) / focal_px_.y});
  if (!symmetric) return std::nullopt;
  const auto [x, y] = *symmetric;
  const double r = std::hypot(x, y);
  if (!(r <= max_radius_ * (1 + radius_slack))) return std::nullopt;
  const Vec2 ray = ray_of_radius(std::min(r, max_radius_));
  return normalize(Vec3{x * ray.x, y * ray.x, ray.y});
}

}  // namespace calibrate
