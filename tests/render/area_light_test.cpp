// Glowing surfaces as lamps.
#include "render/area_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "plain_shapes.h"

namespace render::area_light_test {
namespace {

using std::numbers::pi;

// A sheet of width x height metres in the plane z = `z`, facing down, in steps x steps squares.
SceneDescription sheet(float width, float height, float z, int steps = 1) {
  auto mesh = std::make_shared<Mesh>();
  for (int j = 0; j <= steps; ++j) {
    for (int i = 0; i <= steps; ++i) {
      const float u = static_cast<float>(i) / static_cast<float>(steps);
      const float v = static_cast<float>(j) / static_cast<float>(steps);
      mesh->positions.push_back({(u - 0.5F) * width, (v - 0.5F) * height, z});
      mesh->uvs.push_back({u, v});
    }
  }
  const auto row = static_cast<std::uint32_t>(steps + 1);
  for (std::uint32_t j = 0; j + 1 < row; ++j) {
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t a = j * row + i;
      mesh->triangles.push_back({a, a + row, a + 1});
      mesh->triangles.push_back({a + 1, a + row, a + row + 1});
    }
  }
  mesh->materials = {0};
  return make_scene(mesh, {});
}

VideoTexture even(float value) {
  capture::Image image = capture::make_image(10, 16);
  for (float& pixel : image.pixels) pixel = value;
  return make_video_texture(image);
}

Vec3f irradiance(const std::vector<LocalLight>& lamps, Vec3f position, Vec3f normal) {
  Vec3f sum;
  for (const LocalLight& lamp : lamps) {
    const auto ray = ray_to_lamp({position, normal, normal}, lamp);
    if (ray) sum += lamp.intensity * ray->per_intensity;
  }
  return sum;
}

double area_of(const AreaLight& light) {
  double sum = 0;
  for (const AreaSample& s : light.samples) sum += s.area_m2;
  return sum;
}

// Irradiance on a point that faces the middle of a parallel square of radiance 1: four times that
// under a corner of a quarter of it (Howell, "A Catalog of Radiation Heat Transfer Configuration
// Factors", B-3).
double under_square(double side, double distance) {
  const double x = side / 2 / distance, root = std::sqrt(1 + x * x);
  return pi * 4 * (2 * x / root * std::atan(x / root)) / (2 * pi);
}

TEST(AreaLight, NearsTheIrradianceUnderASquareTheMoreSamplesItTakes) {
  for (const float distance : {0.25F, 0.5F, 1.0F, 3.0F}) {
    const SceneDescription scene = sheet(1, 1, distance);
    const double truth = under_square(1, distance);
    double before = 0.015;
    for (const int n : {3, 9, 27}) {
      const AreaLight light = sample_area_light(scene, 0, 0, {n, n});
      const double e = irradiance(lamps_of(light, even(1), {}), {0, 0, 0}, {0, 0, 1}).x;
      const double error = std::abs(e / truth - 1);
      EXPECT_LT(error, std::max(before, 2e-5)) << distance << " " << n;
      before = error;
    }
    EXPECT_LT(before, 2e-4) << distance;
    const AreaLight five = sample_area_light(scene, 0, 0, {5, 5});
    const double e = irradiance(lamps_of(five, even(1), {}), {0, 0, 0}, {0, 0, 1}).x;
    EXPECT_NEAR(e / truth, 1, 0.005) << distance;
  }
}

TEST(AreaLight, HasAnEndWhereItTouchesASurface) {
  const AreaLight light = sample_area_light(sheet(1, 1, 0), 0, 0, {5, 5});
  const double e = irradiance(lamps_of(light, even(1), {}), {0, 0, -1e-4F}, {0, 0, 1}).x;
  EXPECT_GT(e, 0.8 * pi);
  EXPECT_LT(e, 1.2 * pi) << "all that one sees is of radiance 1";
}

TEST(SampleAreaLight, PutsSamplesInTheMiddleOfTheirParts) {
  for (const int steps : {1, 4}) {
    const AreaLight light = sample_area_light(sheet(2, 1, 3, steps), 0, 0, {4, 2});
    ASSERT_EQ(light.samples.size(), 8U);
    for (const AreaSample& s : light.samples) {
      EXPECT_NEAR(s.position.x, 2 * (0.5F * (s.u0 + s.u1) - 0.5F), 1e-5F);
      EXPECT_NEAR(s.position.y, 0.5F * (s.v0 + s.v1) - 0.5F, 1e-5F);
      EXPECT_NEAR(s.position.z, 3, 1e-5F);
      EXPECT_NEAR(s.normal.z, -1, 1e-5F);
      EXPECT_NEAR(s.area_m2, 0.25F, 1e-5F);
    }
  }
}

TEST(SampleAreaLight, CoversAllOfACurvedSurface) {
  SceneDescription scene = make_scene(make_sphere(0.5F, 24), {});
  auto mesh = std::make_shared<Mesh>(*scene.meshes[0]);
  for (int j = 0; j <= 24; ++j) {
    for (int i = 0; i <= 48; ++i)
      mesh->uvs.push_back({static_cast<float>(i) / 48, static_cast<float>(j) / 24});
  }
  scene.meshes[0] = mesh;
  scene.instances[0].set_from_object = {2, 0, 0, 5, 0, 2, 0, 6, 0, 0, 2, 7};
  const AreaLight light = sample_area_light(scene, 0, 0, {6, 5});
  EXPECT_NEAR(area_of(light), 4 * pi, 0.1);
  for (const AreaSample& s : light.samples) {
    const Vec3f out = s.position - Vec3f{5, 6, 7};
    EXPECT_NEAR(length(out), 1, 0.02F);
    EXPECT_GT(dot(s.normal, normalize(out)), 0.95F) << "faces outwards";
  }
}

TEST(SampleAreaLight, StaysOutsideOfAMirroredObject) {
  SceneDescription scene = sheet(1, 1, 1);
  scene.instances[0].set_from_object = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  for (const AreaSample& s : sample_area_light(scene, 0, 0, {3, 3}).samples)
    EXPECT_NEAR(s.normal.z, -1, 1e-5F);
}

TEST(SampleAreaLight, LeavesOutWhatTheSurfaceDoesNotShow) {
  SceneDescription scene = sheet(1, 1, 1);
  auto mesh = std::make_shared<Mesh>(*scene.meshes[0]);
  for (auto& [u, v] : mesh->uvs) u = 0.5F * u;  // the left half of the picture
  scene.meshes[0] = mesh;
  const AreaLight light = sample_area_light(scene, 0, 0, {4, 4});
  EXPECT_EQ(light.samples.size(), 8U);
  EXPECT_NEAR(area_of(light), 1, 1e-5);
  for (auto& [u, v] : mesh->uvs) u += 3;
  EXPECT_THROW(sample_area_light(scene, 0, 0, {4, 4}), std::invalid_argument);
}

TEST(SampleAreaLight, RefusesWhatItCannotSample) {
  const SceneDescription scene = sheet(1, 1, 1);
  EXPECT_THROW(sample_area_light(scene, 0, 0, {0, 5}), std::invalid_argument);
  EXPECT_THROW(sample_area_light(scene, 0, 0, {5, most_area_samples + 1}), std::invalid_argument);
  EXPECT_THROW(sample_area_light(scene, 0, 1, {5, 5}), std::invalid_argument) << "no such material";
  EXPECT_THROW(sample_area_light(make_scene(make_square(1), {}), 0, 0, {5, 5}),
               std::invalid_argument)
      << "no texture coordinates";
}

TEST(LampsOf, SendAllOfThePicturesLight) {
  capture::Image image = capture::make_image(90, 161);
  double mean = 0;
  for (int y = 0; y < 90; ++y) {
    for (int x = 0; x < 161; ++x) {
      image.at(y, x, 1) = x < 40 ? 5.0F : 0.1F * static_cast<float>(y % 7);
      mean += image.at(y, x, 1) / (90.0 * 161.0);
    }
  }
  const AreaLight light = sample_area_light(sheet(1.6F, 0.9F, 2), 0, 0, {5, 5});
  const auto lamps = lamps_of(light, make_video_texture(image), {{1, 3, 1}, 0});
  double sum = 0;
  for (const LocalLight& lamp : lamps) {
    sum += lamp.intensity.y;
    EXPECT_EQ(lamp.intensity.x, 0);
    EXPECT_NE(lamp.planned, Vec3f{});
  }
  EXPECT_NEAR(sum, 3 * mean * 1.6 * 0.9, 1e-3 * sum);
  EXPECT_GT(lamps[0].intensity.y, 5 * lamps[2].intensity.y) << "the left is bright";
}

TEST(LampsOf, LightEveryPlaceAlikeByTheirMeanWhereAsked) {
  const AreaLight light = sample_area_light(sheet(1, 1, 2), 0, 0, {2, 2});
  const auto lamps = lamps_of(light, even(3), {{1, 1, 1}, 0.1F});
  ASSERT_EQ(lamps.size(), 5U);
  EXPECT_NEAR(irradiance({lamps.back()}, {9, 9, 9}, {0, 0, -1}).x, 0.1 * pi * 3, 1e-4);
}

TEST(LampsOf, TakeNoLightAwayWhereVideoIsBelowBlack) {
  const AreaLight light = sample_area_light(sheet(1, 1, 2), 0, 0, {2, 2});
  for (const LocalLight& lamp : lamps_of(light, even(-0.1F), {{1, 1, 1}, 0.1F}))
    EXPECT_EQ(lamp.intensity, Vec3f{});
}

}  // namespace
}  // namespace render::area_light_test
