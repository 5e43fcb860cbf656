// The made car: its number of triangles, its size, and that all of it can be seen.
#include "render/made_car.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "capture/parallel_loop.h"
#include "render/standard.h"
#include "render/trace.h"

namespace render::made_car_test {
namespace {

const SceneDescription& car() {
  static const SceneDescription description = made_car();
  return description;
}

std::array<Vec3f, 3> corners_of(const Mesh& mesh,
                                std::size_t triangle,
                                const std::array<float, 12>& m) {
  std::array<Vec3f, 3> corners;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3f p = mesh.positions[mesh.triangles[triangle][i]];
    corners[i] = {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3],
                  m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
                  m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
  }
  return corners;
}

// Corners of every triangle, in the set.
template <class F>
void for_each_triangle(const SceneDescription& scene, F&& call) {
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = *scene.meshes[instance.mesh];
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      call(corners_of(mesh, t, instance.set_from_object));
  }
}

// Directions evenly over the sphere.
std::vector<Vec3f> make_directions(int count) {
  std::vector<Vec3f> directions;
  for (int i = 0; i < count; ++i) {
    const float z = 1 - (2 * static_cast<float>(i) + 1) / static_cast<float>(count);
    const float azimuth = static_cast<float>(i) * 2.39996323F;
    const float r = std::sqrt(1 - z * z);
    directions.push_back({r * std::cos(azimuth), r * std::sin(azimuth), z});
  }
  return directions;
}

TEST(MadeCar, HasAsManyTrianglesAsThePapersCar) {
  EXPECT_EQ(triangle_count(car()), 208259U);
  std::size_t without_area = 0;
  for_each_triangle(car(), [&](const std::array<Vec3f, 3>& c) {
    without_area += length(cross(c[1] - c[0], c[2] - c[0])) > 0 ? 0 : 1;
  });
  EXPECT_EQ(without_area, 0U);
}

TEST(MadeCar, StandsOnTheGroundAtRealSize) {
  Vec3f lower{9, 9, 9}, upper{-9, -9, -9};
  for_each_triangle(car(), [&](const std::array<Vec3f, 3>& corners) {
    for (const Vec3f c : corners) {
      lower = {std::min(lower.x, c.x), std::min(lower.y, c.y), std::min(lower.z, c.z)};
      upper = {std::max(upper.x, c.x), std::max(upper.y, c.y), std::max(upper.z, c.z)};
    }
  });
  EXPECT_NEAR(lower.z, 0, 0.002);
  EXPECT_NEAR(upper.z, 1.4, 0.05);
  EXPECT_NEAR(upper.x - lower.x, 4.2, 0.05);
  EXPECT_NEAR(upper.x, -lower.x, 0.05);
  EXPECT_NEAR(upper.y - lower.y, 2.15, 0.1) << "with mirrors";
  EXPECT_NEAR(upper.y, -lower.y, 0.001);
}

struct Place {
  std::size_t instance, triangle;
};

// Those of `places` that no line along `directions` leaves, from their middle or near their
// corners.
std::vector<Place> hidden_ones(const Scene& scene,
                               const std::vector<Place>& places,
                               const std::vector<Vec3f>& directions) {
  const SceneDescription& description = scene.description();
  std::vector<std::uint8_t> seen(places.size(), 0);
  capture::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
    prepare_thread();
    const Instance& instance = description.instances[places[i].instance];
    const std::array<Vec3f, 3> c = corners_of(*description.meshes[instance.mesh],
                                              places[i].triangle, instance.set_from_object);
    const Vec3f normal = normalize(cross(c[1] - c[0], c[2] - c[0]));
    constexpr float near_corner = 0.9F, rest = 0.05F;
    const std::array<Vec3f, 4> points{(c[0] + c[1] + c[2]) * (1.0F / 3),
                                      c[0] * near_corner + c[1] * rest + c[2] * rest,
                                      c[1] * near_corner + c[0] * rest + c[2] * rest,
                                      c[2] * near_corner + c[0] * rest + c[1] * rest};
    for (const Vec3f point : points) {
      for (const Vec3f direction : directions) {
        const float side = dot(direction, normal) < 0 ? -1.0F : 1.0F;
        const Vec3f origin = point + normal * (side * 2e-5F);
        if (transmittance(scene, origin, direction, 0, ray_far, mask_virtual) != Vec3f{}) {
          seen[i] = 1;
          return;
        }
      }
    }
  });
  std::vector<Place> hidden;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (seen[i] == 0) hidden.push_back(places[i]);
  return hidden;
}

TEST(MadeCar, HidesNoTriangle) {
  const Scene scene(car());
  EXPECT_EQ(scene.skipped_triangles(), 0U);
  SceneDescription turned = car();
  for (std::size_t i = 1; i < turned.instances.size(); ++i)
    for (const std::size_t entry : {0U, 10U}) turned.instances[i].set_from_object[entry] = -1;
  const Scene turned_scene(turned);
  std::vector<Place> places;
  for (std::size_t i = 0; i < car().instances.size(); ++i)
    for (std::size_t t = 0; t < car().meshes[i]->triangles.size(); ++t) places.push_back({i, t});
  ASSERT_EQ(places.size(), made_car_triangles);
  std::vector<Place> hidden = hidden_ones(scene, places, make_directions(200));
  hidden = hidden_ones(turned_scene, hidden, make_directions(400));
  hidden = hidden_ones(scene, hidden, make_directions(4000));
  RecordProperty("hidden", static_cast<int>(hidden.size()));
  EXPECT_LT(hidden.size(), made_car_triangles / 1000);
}

TEST(MadeCar, IsTheSameEveryTime) {
  const SceneDescription again = made_car();
  ASSERT_EQ(again.meshes.size(), car().meshes.size());
  for (std::size_t i = 0; i < again.meshes.size(); ++i) {
    EXPECT_EQ(again.meshes[i]->positions, car().meshes[i]->positions);
    EXPECT_EQ(again.meshes[i]->triangles, car().meshes[i]->triangles);
    EXPECT_EQ(again.meshes[i]->materials, car().meshes[i]->materials);
  }
}

TEST(MadeCar, HasUnitNormalsAndAllItsMaterials) {
  std::set<std::uint32_t> used;
  for (const auto& mesh : car().meshes) {
    ASSERT_EQ(mesh->normals.size(), mesh->positions.size());
    ASSERT_EQ(mesh->materials.size(), mesh->triangles.size());
    for (const Vec3f n : mesh->normals) ASSERT_NEAR(length(n), 1, 1e-4);
    used.insert(mesh->materials.begin(), mesh->materials.end());
  }
  EXPECT_EQ(used.size(), car().materials.size());
  const auto paint = standard_parameters(car().materials[0], 0);
  EXPECT_EQ(paint.clearcoat, 1);
  EXPECT_EQ(paint.clearcoat_roughness, 0);
}

TEST(MadeCar, TakesTheGainOfItsLamps) {
  MadeCarSettings settings;
  settings.head_lamp_gain = 7;
  const SceneDescription bright = made_car(settings);
  const auto lamp =
      standard_parameters(bright.materials[static_cast<std::size_t>(CarMaterial::head_lamp)], 0);
  EXPECT_EQ(lamp.emission_gain, 7);
}

}  // namespace
}  // namespace render::made_car_test
