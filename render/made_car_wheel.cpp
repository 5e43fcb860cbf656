// The made car's wheel: tyre with tread, rim with twin spokes, brake.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "render/made_car.h"
#include "render/surface_patches.h"

namespace render {
namespace {

using std::numbers::pi;

// Turned about y: profile of (radius, y), angle 0 at +x, from outside (large y) to inside.
struct ProfilePoint {
  double radius, y;
};

void add_lathe(Mesh& mesh,
               const std::vector<ProfilePoint>& profile,
               int segments,
               CarMaterial material,
               bool faces_axis = false) {
  Mesh part;
  for (int s = 0; s <= segments; ++s) {
    const double angle = 2 * pi * (s % segments) / segments;
    for (const auto& [radius, y] : profile)
      part.positions.push_back(
          calibrate::to_float(Vec3{radius * std::cos(angle), y, radius * std::sin(angle)}));
  }
  const auto n = static_cast<std::uint32_t>(profile.size());
  for (std::uint32_t s = 0; s < static_cast<std::uint32_t>(segments); ++s) {
    for (std::uint32_t i = 0; i + 1 < n; ++i) {
      const std::uint32_t next = (s + 1) % static_cast<std::uint32_t>(segments);
      const std::uint32_t a = s * n + i, b = a + 1, c = next * n + i + 1, d = next * n + i;
      // At the axis one of the two triangles has no area.
      const auto add = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
        if (faces_axis) std::swap(q, r);
        part.triangles.push_back({p, q, r});
        part.materials.push_back(index(material));
      };
      if (profile[i + 1].radius > 0) add(a, c, b);
      if (profile[i].radius > 0) add(a, d, c);
    }
  }
  smooth_normals(part);
  append_mesh(mesh, part);
}

constexpr int tyre_segments = 176;
// Across the tread, outer half: flanks and floors of two grooves around, then the shoulder's
// blocks.
constexpr std::array tread_y{0.086, 0.074,  0.0612, 0.0595, 0.0525, 0.0508,
                             0.037, 0.0272, 0.0255, 0.0185, 0.0168};

// Depth of the tread's pattern, metres.
double groove(int segment, double y) {
  const double from_groove = std::min(std::abs(std::abs(y) - 0.022), std::abs(std::abs(y) - 0.056));
  if (from_groove < 0.0036) return 0.0025;
  // A block is four segments long, the last one a cut across; neighbouring rows are staggered.
  const int row = std::abs(y) > 0.058 ? 0 : std::abs(y) > 0.024 ? 1 : 2;
  const int shift = (y > 0 ? 0 : 2) + row;
  return row < 2 && (segment + shift) % 4 == 3 ? 0.002 : 0;
}

void add_tyre(Mesh& mesh) {
  // Sidewall and shoulder, the outer half; the inner half mirrors it.
  const MonotoneCurve bulge({{0.2265, 0.098},
                             {0.236, 0.106},
                             {0.262, 0.1125},
                             {0.290, 0.110},
                             {0.308, 0.103},
                             {0.318, 0.094}});
  std::vector<ProfilePoint> profile;
  for (const double radius : {0.2265, 0.232, 0.246, 0.266, 0.288, 0.306, 0.318})
    profile.push_back({radius, bulge(radius)});
  const auto tread_radius = [](double y) { return car_wheel_radius_m - 0.6 * y * y; };
  for (const double y : tread_y) profile.push_back({tread_radius(y), y});
  for (std::size_t i = profile.size(); i-- > 0;)
    profile.push_back({profile[i].radius, -profile[i].y});
  Mesh tyre;
  const auto n = static_cast<std::uint32_t>(profile.size());
  for (int s = 0; s < tyre_segments; ++s) {
    const double angle = 2 * pi * s / tyre_segments;
    for (const auto& [radius, y] : profile) {
      const bool on_tread = std::abs(y) < 0.0801;
      const double r = radius - (on_tread ? groove(s, y) : 0);
      tyre.positions.push_back(
          calibrate::to_float(Vec3{r * std::cos(angle), y, r * std::sin(angle)}));
    }
  }
  for (std::uint32_t s = 0; s < tyre_segments; ++s) {
    const std::uint32_t next = (s + 1) % tyre_segments;
    for (std::uint32_t i = 0; i + 1 < n; ++i) {
      tyre.triangles.push_back({s * n + i, next * n + i + 1, s * n + i + 1});
      tyre.triangles.push_back({s * n + i, next * n + i, next * n + i + 1});
      tyre.materials.insert(tyre.materials.end(), 2, index(CarMaterial::rubber));
    }
  }
  smooth_normals(tyre);
  append_mesh(mesh, tyre);
}

// A spoke from the hub to the rim: open at its back, which nobody sees.
void add_spoke(Mesh& mesh, double angle, double lean) {
  const SmoothSurface spoke = [=](double along, double across) {
    const double radius = 0.0665 + 0.145 * along;
    const double half_width = 0.0155 - 0.005 * along + 0.006 * along * along;
    const double face = 0.072 + 0.022 * along - 0.020 * along * (1 - along);
    // Across: flanks fall away from a flat face.
    const double t = 2 * across - 1;
    const double drop = 0.030 * std::pow(std::abs(t), 6.0);
    const double side = half_width * (t < 0 ? -1 : 1) * std::pow(std::abs(t), 0.75);
    const double at = angle + lean * (0.0165 + 0.010 * along) / radius;
    return Vec3{radius * std::cos(at) - side * std::sin(at), face - drop,
                radius * std::sin(at) + side * std::cos(at)};
  };
  GridPatch grid;
  grid.rows = 12;
  grid.columns = 17;
  grid.parameters = [](int row, int column) {
    return std::array<double, 2>{column / 16.0, row / 11.0};
  };
  grid.material = [](int, int) { return index(CarMaterial::alloy); };
  Mesh part;
  add_grid(part, spoke, grid);
  // Outside is +y.
  for (Vec3f& n : part.normals)
    if (n.y < 0) n = -n;
  append_mesh(mesh, part);
}

// The caliper holds the disc behind the spokes, at the side away from the car's middle.
void add_caliper(Mesh& mesh) {
  const SmoothSurface caliper = [](double around, double across) {
    const double angle = 0.9 * (around - 0.5);
    const double t = 2 * across - 1;
    const double radius = 0.1425 + 0.0345 * t;
    const double end = std::pow(std::abs(2 * around - 1), 8.0);
    const double y = 0.004 + 0.026 * (1 - std::pow(std::abs(t), 6.0)) * (1 - end);
    return Vec3{radius * std::cos(angle), y, radius * std::sin(angle)};
  };
  GridPatch grid;
  grid.rows = 17;
  grid.columns = 9;
  grid.parameters = [](int row, int column) {
    return std::array<double, 2>{row / 16.0, column / 8.0};
  };
  grid.material = [](int, int) { return index(CarMaterial::caliper); };
  Mesh part;
  add_grid(part, caliper, grid);
  smooth_normals(part);
  append_mesh(mesh, part);
}

// Brake disc, its edge and bell; what the caliper covers is left out.
void add_brake(Mesh& mesh) {
  Mesh disc;
  add_lathe(disc,
            {{0.158, -0.022},
             {0.158, -0.004},
             {0.154, 0.000},
             {0.125, 0.000},
             {0.092, 0.000},
             {0.088, 0.004},
             {0.085, 0.022},
             {0.070, 0.030}},
            120, CarMaterial::brake, true);
  const auto covered = [&disc](std::uint32_t vertex) {
    const Vec3f p = disc.positions[vertex];
    return std::hypot(p.x, p.z) > 0.12F && std::abs(std::atan2(p.z, p.x)) < 0.42F;
  };
  std::erase_if(disc.triangles,
                [&](const auto& t) { return covered(t[0]) && covered(t[1]) && covered(t[2]); });
  disc.materials.resize(disc.triangles.size());  // all of one material
  append_mesh(mesh, disc);
}

}  // namespace

Mesh make_car_wheel() {
  Mesh wheel;
  add_tyre(wheel);
  // Rim: lip, then the barrel that shows between the spokes, then a shield at the back.
  add_lathe(wheel,
            {{0.2275, 0.101},
             {0.2265, 0.1035},
             {0.223, 0.104},
             {0.219, 0.103},
             {0.214, 0.097},
             {0.211, 0.088},
             {0.207, 0.070},
             {0.204, 0.045},
             {0.202, 0.015},
             {0.200, -0.020}},
            112, CarMaterial::alloy, true);
  add_lathe(wheel, {{0.200, -0.020}, {0.170, -0.022}, {0.158, -0.022}}, 96, CarMaterial::plastic,
            true);
  add_lathe(wheel, {{0.2265, -0.098}, {0.205, -0.075}, {0.120, -0.070}, {0, -0.070}}, 96,
            CarMaterial::plastic);
  add_brake(wheel);
  add_caliper(wheel);
  for (int i = 0; i < 5; ++i) {
    const double angle = 2 * pi * (i + 0.25) / 5;
    add_spoke(wheel, angle, -1);
    add_spoke(wheel, angle, 1);
  }
  // Hub with its cap.
  add_lathe(wheel,
            {{0.070, 0.030},
             {0.066, 0.052},
             {0.062, 0.066},
             {0.056, 0.074},
             {0.046, 0.078},
             {0.036, 0.079}},
            96, CarMaterial::alloy, true);
  add_lathe(wheel,
            {{0.036, 0.079},
             {0.035, 0.083},
             {0.031, 0.086},
             {0.020, 0.088},
             {0.010, 0.0885},
             {0, 0.0887}},
            72, CarMaterial::plastic, true);
  return wheel;
}

}  // namespace render
