// Glass at the edge: bodies that are none, that coincide, or are far away. Whatever their shape,
// glass neither makes nor loses light: in an even environment every pixel shows it, or the picture
// is wrong.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/compositing/made_glass.h"
#include "tests/render/plain_shapes.h"

namespace compositing::glass_stability_test {
namespace {

using render::GlassParameters;
using render::Mesh;
using render::Vec3f;

std::shared_ptr<const Mesh> moved(const Mesh& mesh, float scale, Vec3f by) {
  auto result = std::make_shared<Mesh>(mesh);
  for (Vec3f& p : result->positions) p = p * scale + by;
  return result;
}

std::shared_ptr<const Mesh> turned_inside_out(const Mesh& mesh) {
  auto result = std::make_shared<Mesh>(mesh);
  for (auto& [a, b, c] : result->triangles) std::swap(b, c);
  for (Vec3f& n : result->normals) n = -n;
  return result;
}

// Every third triangle is missing.
std::shared_ptr<const Mesh> torn(const Mesh& mesh) {
  auto result = std::make_shared<Mesh>(mesh);
  result->triangles.clear();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (i % 3 != 0) result->triangles.push_back(mesh.triangles[i]);
  }
  return result;
}

capture::Image in_a_furnace(std::vector<std::shared_ptr<const Mesh>> meshes,
                            const std::vector<GlassParameters>& glass,
                            calibrate::Vec3 from) {
  GlassShot shot = glass_shot(
      bodies(std::move(meshes), glass), [](Vec3f) { return 1.0F; }, 32, 40, from);
  shot.job.effort.accuracy = 0.99F;
  return shot.kernel();
}

void expect_even(const capture::Image& picture, bool is_there = true) {
  int wrong = 0, covered = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    if (i % 4 == 3) {
      covered += picture.pixels[i] > 0.5F;
      continue;
    }
    wrong += !(std::abs(picture.pixels[i] - 1) < 0.01F);
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(covered > 0, is_there);
}

TEST(GlassAtTheEdge, KeepsLightWithAnyIndex) {
  for (const float index : {1.0F, 1.000001F, 1.5F, 3.0F, 4.0F}) {
    SCOPED_TRACE(index);
    expect_even(in_a_furnace({render::make_sphere(1, 24)}, {{.index = index}}, {0, -4, 1}),
                index > 1.001F);
  }
}

// What a ray that is followed by chance adds is what it meets less what was taken for it: nothing,
// where all is alike.
TEST(GlassAtTheEdge, KeepsLightWhateverIsFollowedByChance) {
  for (const float accuracy : {0.0F, 0.5F, 0.95F}) {
    SCOPED_TRACE(accuracy);
    GlassShot shot = glass_shot(bodies({render::make_sphere(1, 24), render::make_sphere(0.6F, 24)},
                                       {{.index = 1.5F}, {.index = 2, .priority = 1}}),
                                [](Vec3f) { return 1.0F; }, 32, 40, {0, -4, 1});
    shot.job.effort.accuracy = accuracy;
    shot.job.effort.chance_cuts = true;
    expect_even(shot.kernel());
  }
}

TEST(GlassAtTheEdge, KeepsLightWhereFacesCoincide) {
  const auto box = render::make_box({-1, -1, -1}, {1, 1, 1});
  const auto beside = render::make_box({1, -1, -1}, {3, 1, 1});
  for (const int priority : {0, 1}) {
    const GlassParameters one{.index = 1.5F}, other{.index = 1.8F, .priority = priority};
    expect_even(in_a_furnace({box, box}, {one, one}, {0, -6, 2}));
    expect_even(in_a_furnace({box, box}, {one, other}, {0, -6, 2}));
    expect_even(in_a_furnace({box, beside}, {one, other}, {1, -6, 2}));
  }
}

TEST(GlassAtTheEdge, KeepsLightInOpenAndInsideOutMeshes) {
  const auto sphere = render::make_sphere(1, 24);
  expect_even(in_a_furnace({torn(*sphere)}, {{.index = 1.5F}}, {0, -4, 1}));
  expect_even(in_a_furnace({turned_inside_out(*sphere)}, {{.index = 1.5F}}, {0, -4, 1}));
  auto flat = std::make_shared<Mesh>(*render::make_square(1));
  expect_even(in_a_furnace({flat}, {{.index = 1.5F}}, {0, -4, 1}));
}

TEST(GlassAtTheEdge, KeepsLightAroundACameraInside) {
  for (const double y : {-0.9999, -0.5, 0.0}) {
    expect_even(in_a_furnace({render::make_sphere(1, 24)}, {{.index = 1.5F}}, {0, y, 0.01}));
    expect_even(in_a_furnace({render::make_box({-1, -1, -1}, {1, 1, 1})}, {{.index = 1.5F}},
                             {0.1, y, 0.2}));
  }
}

TEST(GlassAtTheEdge, KeepsLightInMoreBodiesThanItCanCount) {
  std::vector<std::shared_ptr<const Mesh>> shells;
  std::vector<GlassParameters> glass;
  for (int i = 0; i < 10; ++i) {
    shells.push_back(render::make_sphere(1 - 0.05F * static_cast<float>(i), 16));
    glass.push_back({.index = 1.2F + 0.1F * static_cast<float>(i % 3)});
  }
  expect_even(in_a_furnace(shells, glass, {0, -4, 1}));
}

TEST(GlassAtTheEdge, KeepsLightThatRunsAlongARod) {
  expect_even(in_a_furnace({render::make_box({-0.05F, -50, -0.05F}, {0.05F, 0, 0.05F})},
                           {{.index = 1.5F}}, {0.4, 1, 0.3}));
}

// A ball of a millimetre, and one ten kilometres away, bend light as one of a metre does.
TEST(GlassAtTheEdge, BendsAlikeAtAnyScaleAndFarFromTheOrigin) {
  const auto slope = [](Vec3f d) { return 1 + 0.5F * d.z; };
  const auto sphere = render::make_sphere(1, 48);
  const capture::Image truth =
      glass_shot(bodies({sphere}, {{.index = 1.5F}}), slope, 32, 40, {0, -4, 0}).kernel();
  const auto expect_alike = [&](float scale, Vec3f by, double tolerance) {
    GlassShot shot = glass_shot(bodies({moved(*sphere, scale, by)}, {{.index = 1.5F}}), slope, 32,
                                40, {0, -4, 0});
    const calibrate::Vec3 middle = calibrate::to_double(by);
    shot.job.cam_from_set =
        calibrate::look_at(middle + calibrate::Vec3{0, -4.0 * scale, 0}, middle, 0);
    const capture::Image picture = shot.kernel();
    double squares = 0, differences = 0;
    for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
      EXPECT_TRUE(std::isfinite(picture.pixels[i]));
      squares += truth.pixels[i] * truth.pixels[i];
      differences += std::pow(truth.pixels[i] - picture.pixels[i], 2);
    }
    EXPECT_LT(std::sqrt(differences / squares), tolerance) << scale;
  };
  expect_alike(1e-3F, {}, 0.003);
  expect_alike(100, {}, 0.003);
  expect_alike(100, {10000, 0, 0}, 0.02);
  expect_alike(1, {10000, 0, 0}, 0.15);  // single precision: a ball of a metre to 1 mm
}

TEST(GlassAtTheEdge, StaysFiniteWhenLightJumpsByAMillion) {
  GlassShot shot =
      glass_shot(bodies({render::make_sphere(1, 24)}, {{.index = 1.5F}}),
                 [](Vec3f d) { return d.z > 0.95F ? 1e6F : 1.0F; }, 32, 40, {0, -4, 1});
  const capture::Image picture = shot.kernel();
  for (const float value : picture.pixels) {
    EXPECT_TRUE(std::isfinite(value));
    EXPECT_GE(value, 0);
    EXPECT_LE(value, 65504);
  }
}

}  // namespace
}  // namespace compositing::glass_stability_test
