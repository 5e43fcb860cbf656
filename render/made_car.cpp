// The made car, put together and brought to its number of triangles.
#include "render/made_car.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include "render/standard.h"
#include "render/surface_patches.h"

namespace render {
namespace {

using std::numbers::pi;

StandardParameters plain(float r, float g, float b, float roughness, float metallic = 0) {
  StandardParameters p;
  p.base_color[0] = r;
  p.base_color[1] = g;
  p.base_color[2] = b;
  p.roughness = roughness;
  p.metallic = metallic;
  return p;
}

StandardParameters glowing(float r, float g, float b, float radiance, float gain) {
  StandardParameters p = plain(r, g, b, 0.3F);
  p.clearcoat = 1;
  p.emission[0] = r * radiance;
  p.emission[1] = g * radiance;
  p.emission[2] = b * radiance;
  p.emission_gain = gain;
  return p;
}

std::vector<Material> make_materials(const MadeCarSettings& settings) {
  std::vector<Material> materials(static_cast<std::size_t>(CarMaterial::count));
  const auto set = [&](CarMaterial which, const char* name, const StandardParameters& p) {
    materials[index(which)] = make_standard_material(name, p);
  };
  StandardParameters paint = plain(settings.paint[0], settings.paint[1], settings.paint[2], 0.45F);
  paint.clearcoat = 1;
  set(CarMaterial::paint, "paint", paint);
  set(CarMaterial::plastic, "plastic", plain(0.018F, 0.018F, 0.019F, 0.45F));
  set(CarMaterial::rubber, "rubber", plain(0.016F, 0.016F, 0.016F, 0.75F));
  set(CarMaterial::alloy, "alloy", plain(0.62F, 0.63F, 0.65F, 0.22F, 1));
  set(CarMaterial::glass, "glass", plain(0.006F, 0.008F, 0.009F, 0));
  set(CarMaterial::lens, "lens", plain(0.012F, 0.012F, 0.014F, 0));
  set(CarMaterial::head_lamp, "head lamp", glowing(0.95F, 0.97F, 1.0F, 3, settings.head_lamp_gain));
  set(CarMaterial::tail_lamp, "tail lamp",
      glowing(0.5F, 0.008F, 0.006F, 0.6F, settings.tail_lamp_gain));
  set(CarMaterial::chrome, "chrome", plain(0.83F, 0.84F, 0.85F, 0.05F, 1));
  set(CarMaterial::brake, "brake", plain(0.35F, 0.34F, 0.33F, 0.3F, 1));
  set(CarMaterial::caliper, "caliper", plain(0.5F, 0.02F, 0.01F, 0.35F));
  set(CarMaterial::plate, "plate", plain(0.75F, 0.75F, 0.72F, 0.35F));
  set(CarMaterial::seam, "seam", plain(0.004F, 0.004F, 0.004F, 1));
  return materials;
}

}  // namespace

Mesh make_car_mirror() {
  Mesh mirror;
  // A housing, rounded in front and flat behind.
  const SmoothSurface housing = [](double u, double v) {
    const double around = 2 * pi * u;
    const double c = std::cos(around), s = std::sin(around);
    const double r = std::pow(std::pow(std::abs(c), 3.0) + std::pow(std::abs(s), 3.0), -1 / 3.0);
    const double size = std::pow(std::sin(0.5 * pi * v), 0.7);
    return Vec3{0.60 + 0.115 * std::cos(0.5 * pi * v), 0.985 + 0.105 * r * c * size,
                0.985 + 0.070 * r * s * size - 0.02 * r * c * size};
  };
  GridPatch grid;
  grid.rows = 49;
  grid.columns = 17;
  grid.parameters = [](int row, int column) {
    return std::array<double, 2>{(row % 48) / 48.0, column / 16.0};
  };
  grid.material = [](int, int column) {
    return index(column > 14 ? CarMaterial::plastic : CarMaterial::paint);
  };
  add_grid(mirror, housing, grid);
  const SmoothSurface face = [&housing](double u, double share) {
    const Vec3 edge = housing(u, 1);
    const Vec3 middle{0.60, 0.985, 0.985};
    return middle + (edge - middle) * share + Vec3{share < 0.9 ? 0.006 : 0.0, 0, 0};
  };
  grid.columns = 7;
  grid.parameters = [](int row, int column) {
    return std::array<double, 2>{(row % 48) / 48.0, column / 6.0};
  };
  grid.material = [](int, int column) {
    return index(column >= 5 ? CarMaterial::plastic : CarMaterial::chrome);
  };
  Mesh glass;
  add_grid(glass, face, grid);
  for (Vec3f& n : glass.normals) n = {-1, 0, 0};
  append_mesh(mirror, glass);
  // Its foot, from the door's corner.
  const SmoothSurface foot = [](double u, double v) {
    const double around = 2 * pi * u;
    return Vec3{0.645 + 0.030 * std::cos(around), 0.78 + 0.135 * v,
                0.925 + 0.016 * std::sin(around) + 0.025 * v};
  };
  grid.rows = 25;
  grid.columns = 5;
  grid.parameters = [](int row, int column) {
    return std::array<double, 2>{(row % 24) / 24.0, column / 4.0};
  };
  grid.material = [](int, int) { return index(CarMaterial::plastic); };
  add_grid(mirror, foot, grid);
  return mirror;
}

SceneDescription made_car(const MadeCarSettings& settings) {
  SceneDescription scene;
  scene.materials = make_materials(settings);
  Mesh body = make_car_body();
  const Mesh mirror = make_car_mirror();
  append_mesh(body, mirror);
  add_mirrored(body, mirror);
  const Mesh left_wheel = make_car_wheel();
  Mesh right_wheel;
  add_mirrored(right_wheel, left_wheel);
  const std::size_t made = body.triangles.size() + 4 * left_wheel.triangles.size();
  if (made > made_car_triangles)
    throw std::logic_error("the made car has " + std::to_string(made) + " triangles, more than " +
                           std::to_string(made_car_triangles));
  halve_largest(body, made_car_triangles - made);
  const auto add = [&](const char* name, Mesh mesh, Vec3f at) {
    scene.meshes.push_back(std::make_shared<const Mesh>(std::move(mesh)));
    Instance& instance = scene.instances.emplace_back();
    instance.name = name;
    instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    instance.set_from_object = {1, 0, 0, at.x, 0, 1, 0, at.y, 0, 0, 1, at.z};
  };
  add("body", std::move(body), {});
  add("wheel front left", left_wheel, {car_front_axle_x, car_wheel_y, car_wheel_radius_m});
  add("wheel front right", right_wheel, {car_front_axle_x, -car_wheel_y, car_wheel_radius_m});
  add("wheel rear left", left_wheel, {car_rear_axle_x, car_wheel_y, car_wheel_radius_m});
  add("wheel rear right", std::move(right_wheel),
      {car_rear_axle_x, -car_wheel_y, car_wheel_radius_m});
  return scene;
}

}  // namespace render
