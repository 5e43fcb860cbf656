// The headlight's cover: a body of glass, smooth outside, ribbed inside.
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "render/made_headlight.h"
#include "render/made_noise.h"
#include "render/made_shapes.h"

namespace render {
namespace {

constexpr int columns = 410, rows = 160;
constexpr double thickness = 0.0032;
constexpr double rib_pitch = 0.0075, rib_depth = 0.0012;

double place(int i, int count) { return (2.0 * i - count) / count; }

// By how much ribs thicken the glass: upright ones above and to the sides, level ones below, none
// before the bulb.
double rib(double y, double z) {
  const auto wave = [](double way) {
    return 0.5 - 0.5 * std::cos(2 * std::numbers::pi * way / rib_pitch);
  };
  const auto step = [](double low, double high, double value) {
    return static_cast<double>(
        smooth_step(static_cast<float>(low), static_cast<float>(high), static_cast<float>(value)));
  };
  const double outside = step(0.85, 1.1, std::hypot(y / 0.076, z / 0.046));
  const double low = step(-0.036, -0.042, z);
  const double rim = step(0, 0.06, 1 - std::hypot(y / 0.125, z / 0.08));
  return rib_depth * outside * rim * (wave(y) * (1 - low) + wave(z) * low);
}

Vec3f outside(int column, int row) {
  const Vec3f p = headlight_plan(place(column, columns), place(row, rows));
  return {static_cast<float>(headlight_front(p.y, p.z)), p.y, p.z};
}

Vec3f inside(int column, int row) {
  const Vec3f p = headlight_plan(place(column, columns), place(row, rows));
  return {static_cast<float>(headlight_front(p.y, p.z) - thickness - rib(p.y, p.z)), p.y, p.z};
}

}  // namespace

Mesh make_headlight_cover() {
  std::vector<Vec3f> front, back;
  for (int column = 0; column <= columns; ++column) {
    for (int row = 0; row <= rows; ++row) {
      front.push_back(outside(column, row));
      back.push_back(inside(columns - column, row));
    }
  }
  Mesh cover = make_sheet(front, columns + 1, rows + 1);
  append(cover, make_sheet(back, columns + 1, rows + 1));
  // The wall between both, around the edge.
  std::vector<std::array<int, 2>> edge;
  for (int row = 0; row < rows; ++row) edge.push_back({columns, row});
  for (int column = columns; column > 0; --column) edge.push_back({column, rows});
  for (int row = rows; row > 0; --row) edge.push_back({0, row});
  for (int column = 0; column <= columns; ++column) edge.push_back({column, 0});
  constexpr int across = 4;
  std::vector<Vec3f> wall;
  for (const auto& [column, row] : edge) {
    const Vec3f a = inside(column, row), b = outside(column, row);
    for (int k = 0; k <= across; ++k) {
      wall.push_back(k == 0 ? a : k == across ? b : a + (b - a) * (static_cast<float>(k) / across));
    }
  }
  append(cover, make_sheet(wall, static_cast<int>(edge.size()), across + 1));
  return cover;
}

}  // namespace render
