// Plain shapes and cameras, for tests of rendering.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "render/mesh.h"
#include "render/scene.h"
#include "render/standard.h"

namespace render {

// A square of the given half width about the origin, facing up.
inline std::shared_ptr<const Mesh> make_square(float half_width, float z = 0) {
  auto mesh = std::make_shared<Mesh>();
  const float w = half_width;
  mesh->positions = {{-w, -w, z}, {w, -w, z}, {w, w, z}, {-w, w, z}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh->materials = {0};
  return mesh;
}

// An axis-aligned box.
inline std::shared_ptr<const Mesh> make_box(Vec3f lower, Vec3f upper) {
  auto mesh = std::make_shared<Mesh>();
  for (int i = 0; i < 8; ++i)
    mesh->positions.push_back({(i & 1) != 0 ? upper.x : lower.x, (i & 2) != 0 ? upper.y : lower.y,
                               (i & 4) != 0 ? upper.z : lower.z});
  mesh->triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                     {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  mesh->materials = {0};
  return mesh;
}

// A smooth sphere of 4 steps^2 triangles about the origin.
inline std::shared_ptr<const Mesh> make_sphere(float radius, int steps) {
  auto mesh = std::make_shared<Mesh>();
  constexpr float pi = std::numbers::pi_v<float>;
  for (int j = 0; j <= steps; ++j) {
    for (int i = 0; i <= 2 * steps; ++i) {
      const float v = pi * static_cast<float>(j) / static_cast<float>(steps);
      const float u = pi * static_cast<float>(i) / static_cast<float>(steps);
      const Vec3f n{std::sin(v) * std::cos(u), std::sin(v) * std::sin(u), std::cos(v)};
      mesh->normals.push_back(n);
      mesh->positions.push_back(n * radius);
    }
  }
  for (int j = 0; j < steps; ++j) {
    for (int i = 0; i < 2 * steps; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (2 * steps + 1) + i);
      const auto below = a + static_cast<std::uint32_t>(2 * steps + 1);
      mesh->triangles.push_back({a, below, below + 1});
      mesh->triangles.push_back({a, below + 1, a + 1});
    }
  }
  mesh->materials = {0};
  return mesh;
}

// One mesh of one standard material, before the environment.
inline SceneDescription make_scene(std::shared_ptr<const Mesh> mesh, const StandardParameters& p) {
  SceneDescription scene;
  scene.meshes.push_back(std::move(mesh));
  scene.materials.push_back(make_standard_material("made", p));
  scene.instances.emplace_back().name = "made";
  return scene;
}

inline calibrate::DirectionTable make_pinhole_directions(int width, int height, double focal_px) {
  calibrate::Lens lens;
  lens.width = width;
  lens.height = height;
  lens.parameters = {focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0};
  return calibrate::make_direction_table(lens);
}

}  // namespace render
