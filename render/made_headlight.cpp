// The made headlight, put together: reflector, rings, housing.
#include "render/made_headlight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "render/glass.h"
#include "render/made_scene.h"
#include "render/made_shapes.h"
#include "render/standard.h"
#include "render/surface_patches.h"

namespace render {
namespace {

constexpr double half_width = 0.125, half_height = 0.08;
constexpr double vertex_x = -0.1, focal_m = 0.032;
constexpr double reflector_scale = 0.9;  // of the plan: the bezel is around it
constexpr double hole_radius = 0.0185;
constexpr int around = 720;  // steps along the edge

double paraboloid(double y, double z) { return vertex_x + (y * y + z * z) / (4 * focal_m); }

Vec3f with_x(Vec3f p, double x) { return {static_cast<float>(x), p.y, p.z}; }

// A sheet that goes once around the edge: point(share of the way, share across). It faces (on
// around) x (across).
Mesh make_band(int across, const std::function<Vec3f(double along, double share)>& point) {
  std::vector<Vec3f> points;
  for (int i = 0; i <= around; ++i) {
    for (int k = 0; k <= across; ++k) {
      points.push_back(point(static_cast<double>(i) / around, static_cast<double>(k) / across));
    }
  }
  return make_sheet(points, around + 1, across + 1);
}

// A round bar around the edge, `middle(along)` its middle. Of its section only what is seen is
// there: from one angle to another, in turns from behind (0) over outside (1/4) to ahead (1/2).
Mesh make_ring(double radius,
               double from,
               double to,
               const std::function<Vec3f(double along)>& middle) {
  return make_band(14, [&](double along, double share) {
    const Vec3f p = middle(along);
    const double angle = 2 * std::numbers::pi * (from + (to - from) * share);
    const Vec3f out = normalize(Vec3f{0, p.y / static_cast<float>(half_width * half_width),
                                      p.z / static_cast<float>(half_height * half_height)});
    const Vec3f section = Vec3f{-1, 0, 0} * static_cast<float>(std::cos(angle)) +
                          out * static_cast<float>(std::sin(angle));
    return p + section * static_cast<float>(radius);
  });
}

// Facets, each a bulge on the paraboloid that spreads the light, with a crease at its edges.
Mesh make_reflector() {
  constexpr int columns = 14, rows = 8, steps = 28;
  Mesh reflector;
  for (int column = 0; column < columns; ++column) {
    for (int row = 0; row < rows; ++row) {
      const double bulge = 0.00025 + 0.00006 * ((column * 7 + row * 5) % 5);
      std::vector<Vec3f> points;
      for (int i = 0; i <= steps; ++i) {
        for (int k = 0; k <= steps; ++k) {
          const double s = 2.0 * i / steps - 1, t = 2.0 * k / steps - 1;
          const Vec3f p =
              headlight_plan(reflector_scale * ((column * steps + i) * 2.0 / (columns * steps) - 1),
                             reflector_scale * ((row * steps + k) * 2.0 / (rows * steps) - 1));
          points.push_back(with_x(p, paraboloid(p.y, p.z) + bulge * (1 - s * s) * (1 - t * t)));
        }
      }
      append(reflector, make_sheet(points, steps + 1, steps + 1));
    }
  }
  std::erase_if(reflector.triangles, [&](const std::array<std::uint32_t, 3>& t) {
    const Vec3f middle =
        (reflector.positions[t[0]] + reflector.positions[t[1]] + reflector.positions[t[2]]) *
        (1.0F / 3);
    return std::hypot(middle.y, middle.z) < hole_radius;
  });
  return reflector;
}

// The edge of the reflector, as a place of the plan.
Vec3f reflector_edge(double along) {
  const double side = 4 * along;
  const int corner = std::min(static_cast<int>(side), 3);
  const double way = reflector_scale * (2 * (side - corner) - 1);
  const double end = reflector_scale;
  const Vec3f p = corner == 0   ? headlight_plan(end, way)
                  : corner == 1 ? headlight_plan(-way, end)
                  : corner == 2 ? headlight_plan(-end, -way)
                                : headlight_plan(way, -end);
  return with_x(p, paraboloid(p.y, p.z));
}

// A point of the bezel: from the cover, `share` 0, in to the reflector.
Vec3f bezel_point(double along, double share) {
  const Vec3f inner = reflector_edge(along < 1 ? along : 0);
  const Vec3f rim = headlight_edge(along, 0.985);
  const Vec3f outer = with_x(rim, headlight_front(rim.y, rim.z) - 0.007);
  const double bend = 0.004 * std::sin(std::numbers::pi * share);
  const Vec3f p = outer + (inner - outer) * static_cast<float>(share);
  return p + Vec3f{0, p.y, p.z} * static_cast<float>(bend / half_width);
}

Mesh make_housing() {
  Mesh housing = make_band(60, [](double along, double share) {
    // From the back to the front, with fins.
    const double fins = 0.012 *
                        std::pow(0.5 + 0.5 * std::cos(2 * std::numbers::pi * 36 * along), 4) *
                        std::sin(std::numbers::pi * share);
    const double scale = 0.42 + 0.62 * std::pow(std::sin(0.5 * std::numbers::pi * share), 0.25);
    const Vec3f edge = headlight_edge(along, 1.04);
    const double front = headlight_front(edge.y, edge.z) - 0.008;
    return with_x(headlight_edge(along, scale + fins), -0.118 + (front + 0.118) * share);
  });
  append(housing, make_band(16, [](double along, double share) {
           // Its back, from the bulb's hole outwards.
           const Vec3f edge = headlight_edge(along, 0.42);
           const float angle = std::atan2(edge.z, edge.y);
           const Vec3f hole = Vec3f{0, std::cos(angle), std::sin(angle)} * 0.0135F;
           return with_x(hole + (edge - hole) * static_cast<float>(share), -0.118);
         }));
  return housing;
}

Material surface(const std::string& name,
                 std::array<float, 3> base,
                 float roughness,
                 float metallic,
                 float coat = 0) {
  StandardParameters p;
  std::ranges::copy(base, p.base_color);
  p.roughness = roughness;
  p.metallic = metallic;
  p.clearcoat = coat;
  if (coat > 0) p.specular = 0.1F;
  return make_standard_material(name, p);
}

// The bulb's tip from +z to +x, and its middle to the focus.
constexpr std::array<float, 12> set_from_bulb{
    0, 0, 1, headlight_focus.x, 1, 0, 0, headlight_focus.y, 0, 1, 0, headlight_focus.z};

}  // namespace

Vec3f headlight_plan(double u, double v) {
  // Nowell, "Mapping a Square to a Circle", 2005; less than all the way, so that corners stay
  // regular.
  constexpr double roundness = 0.96;
  return {0, static_cast<float>(half_width * u * std::sqrt(1 - roundness * v * v / 2)),
          static_cast<float>(half_height * v * std::sqrt(1 - roundness * u * u / 2))};
}

double headlight_front(double y, double z) {
  return 0.044 - 1.1 * y * y - 1.5 * z * z - 0.12 * z + 0.03 * y;
}

Vec3f headlight_edge(double share, double scale) {
  const double side = share < 1 ? 4 * share : 0;
  const int corner = static_cast<int>(side);
  const double way = 2 * (side - corner) - 1;
  const Vec3f p = corner == 0   ? headlight_plan(1, way)
                  : corner == 1 ? headlight_plan(-way, 1)
                  : corner == 2 ? headlight_plan(-1, -way)
                                : headlight_plan(way, -1);
  return p * static_cast<float>(scale);
}

SceneDescription make_headlight() {
  MadeSceneBuilder light;
  light.add("reflector", make_reflector(), surface("reflector", {0.92F, 0.92F, 0.93F}, 0, 1));
  light.add("bezel", make_band(30, bezel_point),
            surface("bezel", {0.02F, 0.02F, 0.022F}, 0.5F, 0, 1));
  const Material chrome = surface("chrome", {0.83F, 0.84F, 0.86F}, 0, 1);
  light.add("reflector ring",
            make_ring(0.0022, 0.36, 0.85,
                      [](double along) {
                        const Vec3f p = reflector_edge(along < 1 ? along : 0);
                        return with_x(p, p.x + 0.001);
                      }),
            chrome);
  light.add("bezel ring",
            make_ring(0.0013, 0.46, 0.92, [](double along) { return bezel_point(along, 0.35); }),
            chrome);
  light.add("gasket",
            make_ring(0.0042, 0.06, 0.72,
                      [](double along) {
                        const Vec3f p = headlight_edge(along, 1.03);
                        return with_x(p, headlight_front(p.y, p.z) - 0.006);
                      }),
            surface("gasket", {0.015F, 0.015F, 0.015F}, 0.7F, 0));
  light.add("cover", make_headlight_cover(), make_glass_material("cover", {.index = 1.52F}));
  HeadlightBulb bulb = make_headlight_bulb();
  light.add("bulb envelope", std::move(bulb.envelope),
            make_glass_material("bulb envelope", {.index = 1.47F, .priority = 1}));
  light.add("bulb capsule", std::move(bulb.capsule),
            make_glass_material("bulb capsule", {.index = 1.46F, .priority = 2}));
  StandardParameters glow;
  std::fill_n(glow.base_color, 3, 0.1F);
  std::ranges::copy(std::array<float, 3>{30, 21, 11}, glow.emission);
  glow.specular = 0;
  light.add("bulb filament", std::move(bulb.filament),
            make_standard_material("bulb filament", glow));
  light.add("bulb wires", std::move(bulb.wires), surface("bulb wires", {0.6F, 0.58F, 0.55F}, 0, 1));
  light.add("bulb base", std::move(bulb.base), surface("bulb base", {0.78F, 0.76F, 0.72F}, 0, 1));
  light.add("housing", make_housing(), surface("housing", {0.03F, 0.03F, 0.032F}, 0.6F, 0));

  SceneDescription scene = light.take();
  const std::size_t made = triangle_count(scene);
  if (made > made_headlight_triangles)
    throw std::logic_error("the made headlight has " + std::to_string(made) + " triangles");
  for (Instance& instance : scene.instances) {
    if (instance.name.starts_with("bulb")) instance.set_from_object = set_from_bulb;
    if (instance.name != "housing") continue;
    Mesh housing = *scene.meshes[instance.mesh];
    halve_largest(housing, made_headlight_triangles - made);
    scene.meshes[instance.mesh] = std::make_shared<const Mesh>(std::move(housing));
  }
  return scene;
}

}  // namespace render
