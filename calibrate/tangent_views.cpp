// Planes that touch the sphere of directions.
#include "calibrate/tangent_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "calibrate/angles.h"

namespace calibrate {
namespace {

constexpr double ring_rad = 55 * degree;
constexpr int ring_views = 8;
constexpr double half_angle_rad = 45 * degree;
constexpr int min_side = 200;
constexpr int max_side = 900;
constexpr std::uint8_t unseen = 128;

bool is_inside(const GreyPicture& picture, const std::optional<Vec2>& q) {
  return q && q->x >= 0 && q->y >= 0 && q->x <= picture.width - 1 && q->y <= picture.height - 1;
}

// Pixels per radian around a direction, along the finer axis; 0 if the lens does not see it.
double pixels_per_radian(const Lens& lens, const TangentView& view) {
  constexpr double step = 1e-3;
  const std::array rays{view.axis, view.axis + view.right * step, view.axis + view.down * step};
  const auto q = project_all(lens, rays);
  if (!q[0] || !q[1] || !q[2]) return 0;
  return std::max(hypotenuse(q[1]->x - q[0]->x, q[1]->y - q[0]->y),
                  hypotenuse(q[2]->x - q[0]->x, q[2]->y - q[0]->y)) /
         step;
}

// Whether enough of what the view shows lies in the picture.
bool is_seen(const GreyPicture& picture, const Lens& lens, const TangentView& view) {
  constexpr double half = 0.5;
  int seen = 0;
  for (const double y : {-half, 0.0, half}) {
    for (const double x : {-half, 0.0, half}) {
      const Vec3 ray = view.axis + view.right * x + view.down * y;
      seen += is_inside(picture, project(lens, ray)) ? 1 : 0;
    }
  }
  return seen >= 4;
}

void draw(const GreyPicture& picture, const Lens& lens, TangentView& view, int side) {
  view.picture = {side, side, {}};
  view.picture.pixels.reserve(view.picture.index(side, 0));
  std::vector<Vec3> rays(static_cast<std::size_t>(side));
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      rays[static_cast<std::size_t>(x)] =
          view.ray({static_cast<double>(x), static_cast<double>(y)});
    }
    for (const auto& q : project_all(lens, rays)) {
      const float value = is_inside(picture, q) ? value_at(picture, *q) : unseen;
      view.picture.pixels.push_back(
          static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L)));
    }
  }
}

}  // namespace

Vec3 TangentView::ray(Vec2 q) const {
  const double x = (q.x - (picture.width - 1) / 2.0) / focal_px;
  const double y = (q.y - (picture.height - 1) / 2.0) / focal_px;
  return axis + right * x + down * y;
}

std::vector<TangentView> tangent_views(const GreyPicture& picture,
                                       const Lens& lens,
                                       std::chrono::steady_clock::time_point deadline) {
  std::vector<TangentView> views;
  for (int i = 0; i <= ring_views && std::chrono::steady_clock::now() < deadline; ++i) {
    const double azimuth = 2 * std::numbers::pi * i / ring_views;
    const double off_axis = i < ring_views ? ring_rad : 0;
    TangentView view;
    view.axis = {std::sin(off_axis) * std::cos(azimuth), std::sin(off_axis) * std::sin(azimuth),
                 std::cos(off_axis)};
    view.right = normalize(cross(Vec3{0, 1, 0}, view.axis));
    view.down = cross(view.axis, view.right);
    const double scale = pixels_per_radian(lens, view);
    if (scale <= 0 || !is_seen(picture, lens, view)) continue;
    const double side = std::clamp(2 * std::tan(half_angle_rad) * scale,
                                   static_cast<double>(min_side), static_cast<double>(max_side));
    view.focal_px = side / (2 * std::tan(half_angle_rad));
    draw(picture, lens, view, static_cast<int>(side));
    views.push_back(std::move(view));
  }
  return views;
}

}  // namespace calibrate
