// A made person who walks.
#include "compositing/made_walker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "capture/parallel_loop.h"

namespace compositing {

MadeFoot MadeWalker::foot(int side, double gone) const {
  const double cycle = 2 * step_m, offset = side * step_m;
  const double n = std::floor((gone - offset + 0.6 * step_m) / cycle);
  const double planted_at = n * cycle + offset, over = gone - (planted_at + 0.6 * step_m);
  double along = planted_at, lift = 0;
  if (over > 0) {
    const double u = std::min(1.0, over / (0.8 * step_m));
    along += cycle * u * u * (3 - 2 * u);
    lift = 0.06 * std::sin(3.14159265358979 * u);
  }
  const Vec3 left{-way.y, way.x, 0};
  const Vec3 ankle =
      start + along * way + (side == 0 ? 0.09 : -0.09) * left + Vec3{0, 0, foot_radius_m + lift};
  return {ankle - 0.07 * way, ankle + 0.14 * way, !(over > 0)};
}

std::vector<Capsule> MadeWalker::shape(double time_s) const {
  const double gone = speed_m_s * time_s;
  const Vec3 left{-way.y, way.x, 0}, body = start + gone * way;
  std::vector<Capsule> capsules;
  for (const int side : {0, 1}) {
    const MadeFoot f = foot(side, gone);
    const double out = side == 0 ? 1 : -1;
    const Vec3 ankle = f.heel + 0.04 * way + Vec3{0, 0, 0.04};
    const Vec3 hip = body + 0.09 * out * left + Vec3{0, 0, 0.92};
    const Vec3 knee = 0.5 * (ankle + hip) + 0.06 * way;
    const Vec3 shoulder = body + 0.2 * out * left + Vec3{0, 0, 1.42};
    const Vec3 other = foot(1 - side, gone).heel;
    const Vec3 hand =
        body + 0.26 * out * left + (0.4 * dot(other - body, way)) * way + Vec3{0, 0, 0.82};
    capsules.insert(capsules.end(), {{f.heel, f.toe, foot_radius_m},
                                     {ankle, knee, 0.05},
                                     {knee, hip, 0.075},
                                     {shoulder, hand, 0.045}});
  }
  capsules.push_back({body + Vec3{0, 0, 0.98}, body + Vec3{0, 0, 1.38}, 0.17});
  capsules.push_back({body + Vec3{0, 0, 1.55}, body + Vec3{0, 0, 1.63}, 0.1});
  return capsules;
}

double lower_edge_rad(const MadeView& view, Vec3 centre) {
  const Vec3 v = centre - view.camera();
  const double level = calibrate::hypotenuse(v.x, v.y);
  return std::atan2(-v.z, level) + std::asin(foot_radius_m / length(v));
}

Lowest lowest_of(const MadeView& view, const MadeWalker& walker, double time_s) {
  Lowest lowest;
  for (const int side : {0, 1}) {
    const MadeFoot foot = walker.foot(side, walker.speed_m_s * time_s);
    for (const Vec3 centre : {foot.heel, foot.toe}) {
      const double below = lower_edge_rad(view, centre);
      if (below > lowest.below_rad) lowest = {centre, below, side, foot.planted};
    }
  }
  return lowest;
}

std::pair<double, double> ray_to(Vec3 v, Vec3 a, Vec3 b) {
  const Vec3 s = b - a;
  const double vs = dot(v, s), ss = dot(s, s), va = dot(v, a), sa = dot(s, a);
  const double det = ss - vs * vs;
  double u = det > 1e-12 ? (va * vs - sa) / det : 0;
  u = std::clamp(u, 0.0, 1.0);
  const Vec3 p = a + u * s;
  const double t = dot(v, p);
  return {length(p - t * v), t};
}

void draw(capture::Image& matte, const MadeView& view, const std::vector<Capsule>& shape) {
  const double focal = view.lens.parameters[0];
  for (const Capsule& c : shape) {
    const Vec3 a = view.cam_from_set * c.a, b = view.cam_from_set * c.b;
    double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
    for (const Vec3 p : {a, b}) {
      const auto q = calibrate::project(view.lens, p);
      if (!q || p.z < 0.1) continue;
      const double margin = 1.3 * focal * c.radius / p.z + 3;
      left = std::min(left, q->x - margin);
      top = std::min(top, q->y - margin);
      right = std::max(right, q->x + margin);
      bottom = std::max(bottom, q->y + margin);
    }
    for (int y = std::max(0, static_cast<int>(top)); y <= std::min(matte.height - 1.0, bottom);
         ++y) {
      for (int x = std::max(0, static_cast<int>(left)); x <= std::min(matte.width - 1.0, right);
           ++x) {
        const std::size_t i = view.directions.index(y, x);
        const Vec3 v = normalize(calibrate::to_double(
            {view.directions.x[i], view.directions.y[i], view.directions.z[i]}));
        const auto [off, along] = ray_to(v, a, b);
        if (!(along > 0.1)) continue;
        const double cover = std::clamp(0.5 + (c.radius - off) * focal / along, 0.0, 1.0);
        float& alpha = matte.at(y, x);
        alpha = std::max(alpha, static_cast<float>(cover));
      }
    }
  }
}

capture::Image matte_of(const MadeView& view, const MadeWalker& walker, double time_s) {
  capture::Image matte = capture::make_image(view.lens.height, view.lens.width, 1);
  draw(matte, view, walker.shape(time_s));
  return matte;
}

namespace {

// Where a ray from `o` along the unit vector `d` enters a capsule.
std::optional<double> entry(Vec3 o, Vec3 d, const Capsule& c) {
  const Vec3 axis = c.b - c.a, from_a = o - c.a;
  const double aa = dot(axis, axis), ad = dot(axis, d), ao = dot(axis, from_a);
  const double r2 = c.radius * c.radius;
  // The round side: A t^2 + 2 B t + C = 0.
  const double A = aa - ad * ad, B = aa * dot(from_a, d) - ao * ad;
  const double C = aa * (dot(from_a, from_a) - r2) - ao * ao;
  const double inside = B * B - A * C;
  if (!(inside >= 0)) return std::nullopt;
  if (A > 1e-12) {
    const double t = (-B - std::sqrt(inside)) / A, along = ao + t * ad;
    if (along > 0 && along < aa) return t > 0 ? std::optional(t) : std::nullopt;
  }
  std::optional<double> nearest;
  for (const Vec3 centre : {c.a, c.b}) {
    const Vec3 v = o - centre;
    const double b = dot(v, d), h = b * b - dot(v, v) + r2;
    if (!(h >= 0)) continue;
    const double t = -b - std::sqrt(h);
    if (t > 0 && (!nearest || t < *nearest)) nearest = t;
  }
  return nearest;
}

struct Colour {
  double r, g, b;
};

// Cloth, skin and leather: `along` metres from the capsule's first end, `round` radians about it
// from the front.
Colour albedo_of(std::size_t part, double along, double round, Vec3 from_head) {
  const auto checks = [&](double length_m, double sectors) {
    const auto even = [](double x) { return (static_cast<long>(std::floor(x)) & 1) == 0; };
    return even(along / length_m) == even(round * sectors / 3.14159265358979);
  };
  if (part == 9) {  // head: hair above and behind, eyes
    if (from_head.z > 0.055 || from_head.x < -0.02) return {0.06, 0.035, 0.02};
    const bool eye =
        std::abs(std::abs(from_head.y) - 0.035) < 0.014 && std::abs(from_head.z - 0.02) < 0.012;
    const bool mouth = std::abs(from_head.y) < 0.03 && std::abs(from_head.z + 0.045) < 0.008;
    if (from_head.x > 0.05 && eye) return {0.03, 0.03, 0.05};
    if (from_head.x > 0.05 && mouth) return {0.45, 0.1, 0.1};
    return {0.62, 0.38, 0.27};
  }
  if (part == 8) {  // shirt
    if (std::abs(round) < 0.12) return {0.85, 0.82, 0.75};
    return checks(0.08, 6) ? Colour{0.62, 0.08, 0.06} : Colour{0.78, 0.3, 0.12};
  }
  switch (part % 4) {
    case 0:
      return {0.09, 0.06, 0.05};
    case 3:
      if (along > 0.42) return {0.62, 0.38, 0.27};
      return checks(0.08, 3) ? Colour{0.62, 0.08, 0.06} : Colour{0.78, 0.3, 0.12};
    default:
      if (std::abs(std::abs(round) - 1.57) < 0.25) return {0.5, 0.5, 0.55};  // seam
      return part < 4 ? Colour{0.1, 0.16, 0.38} : Colour{0.12, 0.2, 0.42};
  }
}

}  // namespace

capture::Image photograph_of(const calibrate::Lens& lens,
                             const calibrate::Pose& cam_from_set,
                             const MadeWalker& walker,
                             double time_s,
                             int detail) {
  if (lens.model != "pinhole" || detail < 1) {
    throw std::invalid_argument("the walker is photographed through pinholes");
  }
  calibrate::check(lens);
  const std::vector<Capsule> shape = walker.shape(time_s);
  const Vec3 camera = calibrate::position_of(cam_from_set);
  const calibrate::Mat3 set_from_cam = cam_from_set.R.transposed();
  const double fx = lens.parameters[0], fy = lens.parameters[1];
  const double cx = lens.parameters[2], cy = lens.parameters[3];
  double left = lens.width, top = lens.height, right = -1, bottom = -1;
  for (const Capsule& c : shape) {
    for (const Vec3 end : {c.a, c.b}) {
      const Vec3 p = cam_from_set * end;
      if (!(p.z > 2 * c.radius)) throw std::invalid_argument("the walker meets the camera");
      const double reach = 1.5 * c.radius * std::max(fx, fy) / (p.z - c.radius) + 2;
      const double x = cx + fx * p.x / p.z, y = cy + fy * p.y / p.z;
      left = std::min(left, x - reach), right = std::max(right, x + reach);
      top = std::min(top, y - reach), bottom = std::max(bottom, y + reach);
    }
  }
  const auto clamped = [](double value, int size) {
    return static_cast<int>(std::clamp(value, -1.0, static_cast<double>(size)));
  };
  const int x0 = std::max(clamped(left, lens.width), 0), x1 = clamped(right + 1, lens.width);
  const int y0 = std::max(clamped(top, lens.height), 0), y1 = clamped(bottom + 1, lens.height);
  const Vec3 up{0, 0, 1}, side = cross(up, walker.way);
  const Vec3 sun = normalize(walker.way + 0.6 * side + 0.8 * up);
  // Light at a place of the body, or nothing where the ray passes by.
  const auto seen = [&](Vec3 d) -> std::optional<Colour> {
    double nearest = 1e9;
    std::size_t part = 0;
    for (std::size_t i = 0; i < shape.size(); ++i) {
      const auto t = entry(camera, d, shape[i]);
      if (t && *t < nearest) nearest = *t, part = i;
    }
    if (nearest == 1e9) return std::nullopt;
    const Capsule& c = shape[part];
    const Vec3 p = camera + nearest * d, axis = c.b - c.a;
    const double u = std::clamp(dot(p - c.a, axis) / dot(axis, axis), 0.0, 1.0);
    const Vec3 normal = normalize(p - c.a - u * axis);
    const double round = std::atan2(dot(normal, side), dot(normal, walker.way));
    const Vec3 h = p - 0.5 * (c.a + c.b);
    const Colour albedo =
        albedo_of(part, u * length(axis), round, {dot(h, walker.way), dot(h, side), h.z});
    const double light = 0.35 + 0.15 * normal.z + 0.6 * std::max(dot(normal, sun), 0.0);
    return Colour{albedo.r * light, albedo.g * light, albedo.b * light};
  };
  capture::Image image = capture::make_image(lens.height, lens.width, 4);
  const double share = 1.0 / (detail * detail);
  capture::parallel_for(y0, std::max(y1, y0), [&](int y) {
    for (int x = x0; x < x1; ++x) {
      std::array<double, 4> sum{};
      for (int i = 0; i < detail * detail; ++i) {
        const double qx = x - 0.5 + (i % detail + 0.5) / detail;
        const double qy = y - 0.5 + (i / detail + 0.5) / detail;
        const auto colour = seen(normalize(set_from_cam * Vec3{(qx - cx) / fx, (qy - cy) / fy, 1}));
        if (!colour) continue;
        sum[0] += colour->r, sum[1] += colour->g, sum[2] += colour->b, sum[3] += 1;
      }
      for (int k = 0; k < 4; ++k) {
        image.at(y, x, k) = static_cast<float>(sum[static_cast<std::size_t>(k)] * share);
      }
    }
  });
  return image;
}

double drawn_height_m(const MadeView& view, Vec3 standing, const Lowest& lowest) {
  const Vec3 to = standing - view.camera(), v = lowest.centre - view.camera();
  const double away = calibrate::hypotenuse(to.x, to.y);
  const double turned = (v.x * to.x + v.y * to.y) / (calibrate::hypotenuse(v.x, v.y) * away);
  return view.camera().z - std::tan(lowest.below_rad) * away / turned;
}

}  // namespace compositing
