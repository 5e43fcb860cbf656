// Textures far away, straight on and after bounces: filtered as wide as what a sample sees.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "made_shot.h"
#include "render/reference.h"
#include "render/texture.h"

namespace compositing::mirrored_texture_test {
namespace {

constexpr int width = 64, height = 48;

std::shared_ptr<render::Mesh> square(std::array<render::Vec3f, 4> corners,
                                     float repeats,
                                     std::uint32_t material) {
  auto mesh = std::make_shared<render::Mesh>();
  mesh->positions.assign(corners.begin(), corners.end());
  mesh->uvs = {{0, 0}, {repeats, 0}, {repeats, repeats}, {0, repeats}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh->materials = {material};
  return mesh;
}

// Before a black plate; light and camera are the caller's.
MadeShot shot_of(render::SceneDescription scene) {
  MadeShot shot;
  shot.scene = std::make_unique<render::Scene>(std::move(scene));
  const double f = width * 0.9;
  shot.directions = calibrate::make_direction_table(
      {"pinhole", width, height, {f, f, (width - 1) / 2.0, (height - 1) / 2.0}});
  shot.plate = capture::to_half(capture::make_image(height, width));
  return shot;
}

// A glowing chequered wall 24 m behind a viewer who sees it in `mirrors` mirrors, one after the
// other. Its squares of a few centimetres are much finer than the pixels there.
struct ChequeredShot {
  MadeShot shot;

  explicit ChequeredShot(int mirrors, float roughness = 0, float repeats = 331.7F) {
    register_shaders();
    std::vector<std::uint8_t> texels;
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        for (int c = 0; c < 3; ++c) texels.push_back((x / 8 + y / 8) % 2 == 0 ? 255 : 0);
      }
    }
    render::SceneDescription scene;
    scene.background = "environment";
    scene.textures = {
        std::make_shared<render::Texture>(render::make_texture(16, 16, 3, true, texels))};
    render::StandardParameters wall;
    std::fill_n(wall.base_color, 3, 0.0F);
    wall.specular = 0;
    std::fill_n(wall.emission, 3, 1.0F);
    wall.emission_texture = 0;
    render::StandardParameters chrome;
    chrome.metallic = 1;
    chrome.roughness = roughness;
    scene.materials = {make_standard_material("wall", wall),
                       make_standard_material("chrome", chrome)};
    const auto add = [&](std::shared_ptr<render::Mesh> mesh) {
      scene.meshes.push_back(std::move(mesh));
      scene.instances.emplace_back().mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    };
    const float s = 30, far = -24;
    add(square({{{-s, far, -s}, {s, far, -s}, {s, far, s}, {-s, far, s}}}, repeats, 0));
    if (mirrors == 2) {  // a corner of two, which sends back where it comes from
      add(square({{{0, 4, -9}, {9, -5, -9}, {9, -5, 9}, {0, 4, 9}}}, 1, 1));
      add(square({{{0, 4, -9}, {-9, -5, -9}, {-9, -5, 9}, {0, 4, 9}}}, 1, 1));
    } else {
      add(square({{{-9, 3, -9}, {9, 3, -9}, {9, 3, 9}, {-9, 3, 9}}}, 1, 1));
    }
    shot = shot_of(std::move(scene));
    shot.environment = made_sky(16, 0, 0);
    const calibrate::Vec3 towards =
        mirrors == 0 ? calibrate::Vec3{0.3, -24, 0.2} : calibrate::Vec3{0.6, 4, 0.3};
    shot.job.cam_from_set = calibrate::look_at({0.1, 0, 0.1}, towards, 0);
    shot.job.effort.aa_samples = 1;  // one ray a pixel: nothing but the filter smooths
  }
};

TEST(MirroredTexture, DoesNotAliasWhereverItIsSeen) {
  for (const int mirrors : {0, 1, 2}) {
    const ChequeredShot made(mirrors);
    const MadeShot& shot = made.shot;
    const capture::Image black = capture::make_image(height, width);
    const capture::Image truth = render_reference(shot.inputs(), shot.job, black, {.samples = 256});
    render::FrameResult result;
    render_frame(shot.inputs(), shot.job, shot.plate, result);
    const capture::Image shown = capture::to_float(result.rgba);
    capture::Image all = capture::make_image(height, width, 1);
    std::ranges::fill(all.pixels, 1.0F);
    const render::PictureError error = render::picture_error(shown, truth, all);
    EXPECT_LT(error.relative_rms, 0.06) << mirrors << " mirrors; unfiltered it would be about 1";
    double mean = 0;
    for (const float value : truth.pixels) mean += value / static_cast<double>(truth.pixels.size());
    EXPECT_GT(mean, 0.4) << mirrors << " mirrors must show the wall (and alpha)";
  }
}

// Against two references of 128 paths a pixel, over all of the picture.
double error_of(const MadeShot& shot) {
  const capture::Image black = capture::make_image(height, width);
  std::array<capture::Image, 2> truth;
  for (std::uint32_t i = 0; i < 2; ++i) {
    truth[i] = render_reference(shot.inputs(), shot.job, black, {.samples = 128, .seed = i + 1});
  }
  render::FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  capture::Image all = capture::make_image(height, width, 1);
  std::ranges::fill(all.pixels, 1.0F);
  return render::picture_error(capture::to_float(result.rgba), truth, all).relative_rms;
}

// Squares of .6 m, ten times as wide as pixels are there, and a lobe as wide as many of them.
TEST(MirroredTexture, IsAsBlurredAsTheLobeOfARoughMirror) {
  EXPECT_LT(error_of(ChequeredShot(1, 0.3F, 50).shot), 0.12) << "sharp, it would be about 1";
}

// A floor of tiles that reaches far away: pixels see strips of it, up to ten times as long as wide.
TEST(Texture, OfAFloorSeenAtASlantIsAsInTheReference) {
  register_shaders();
  std::vector<std::uint8_t> texels;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) texels.push_back(x < 6 || y < 6 ? 30 : 200);
  }
  render::SceneDescription scene;
  scene.background = "environment";
  scene.textures = {
      std::make_shared<render::Texture>(render::make_texture(64, 64, 1, false, texels))};
  render::StandardParameters tiles;
  tiles.specular = 0;
  std::fill_n(tiles.emission, 3, 1.0F);
  std::fill_n(tiles.base_color, 3, 0.0F);
  tiles.emission_texture = 0;
  scene.materials = {make_standard_material("tiles", tiles)};
  scene.meshes = {square({{{-20, 0, -1}, {20, 0, -1}, {20, 40, -1}, {-20, 40, -1}}}, 40, 0)};
  scene.instances.emplace_back();
  MadeShot shot = shot_of(std::move(scene));
  shot.environment = made_sky(16, 0, 0);
  // Along the tiles, and across them; the horizon lies above the picture.
  for (const double aside : {0.0, 4.0, -9.0}) {
    shot.job.cam_from_set = calibrate::look_at({0.2, 0, 0.2}, {aside, 8, -3.5}, 0);
    shot.job.effort.aa_samples = 1;
    const double error = error_of(shot);
    RecordProperty("error", std::to_string(error));
    EXPECT_LT(error, 0.06) << aside;
  }
}

// A wall of random greys that glows, or lies in even light, right before a lens of 110 degrees:
// towards its corners pixels are less than half as wide as in the middle.
MadeShot wide_view_of_a_wall(bool glows) {
  register_shaders();
  std::mt19937 random(8);
  std::vector<std::uint8_t> texels;
  for (int i = 0; i < 256 * 256; ++i) texels.push_back(random() & 1U ? 230 : 20);
  render::SceneDescription scene;
  scene.background = "environment";
  scene.textures = {
      std::make_shared<render::Texture>(render::make_texture(256, 256, 1, false, texels))};
  render::StandardParameters greys;
  greys.specular = 0;
  if (glows) {
    std::fill_n(greys.base_color, 3, 0.0F);
    std::fill_n(greys.emission, 3, 1.0F);
    greys.emission_texture = 0;
  } else {
    greys.base_color_texture = 0;
  }
  scene.materials = {make_standard_material("greys", greys)};
  scene.meshes = {square({{{-9, 3, -9}, {9, 3, -9}, {9, 3, 9}, {-9, 3, 9}}}, 1, 0)};
  scene.instances.emplace_back();
  MadeShot shot = shot_of(std::move(scene));
  const double f = width * 0.35;
  shot.directions = calibrate::make_direction_table(
      {"pinhole", width, height, {f, f, (width - 1) / 2.0, (height - 1) / 2.0}});
  shot.environment = made_sky(16, 1, 1);
  shot.job.lights = even_lights(64);
  shot.job.cam_from_set = calibrate::look_at({0, 0, 0}, {0, 3, 0}, 0);
  return shot;
}

TEST(Texture, TowardsTheCornersOfAWideLensIsAsInTheReference) {
  MadeShot shot = wide_view_of_a_wall(true);
  shot.job.effort.aa_samples = 1;
  EXPECT_LT(error_of(shot), 0.05) << "with cones as wide everywhere as in the middle it is .19";
}

// What one surface's texture differs by is no edge: its pixels' own rays have its mean already.
TEST(Texture, TakesNoFurtherRaysHoweverItContrasts) {
  for (const bool glows : {false, true}) {
    const MadeShot shot = wide_view_of_a_wall(glows);
    ASSERT_GT(shot.job.effort.aa_samples, 1);
    render::FrameResult result;
    render_frame(shot.inputs(), shot.job, shot.plate, result);
    EXPECT_EQ(result.statistics.primary_rays, static_cast<std::uint64_t>(width * height)) << glows;
    const capture::Image shown = capture::to_float(result.rgba);
    float least = 1e9F, most = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        least = std::min(least, shown.at(y, x, 0)), most = std::max(most, shown.at(y, x, 0));
      }
    }
    EXPECT_GT(most - least, 0.3F * most) << "the texture must show";
  }
}

// Metal flakes in a clear coat, as models of cars have them: a normal map of small tilted facets.
// Far away each pixel holds many, which together are a rough metal.
MadeShot flaky_paint(float tilt) {
  register_shaders();
  std::mt19937 random(3);
  std::normal_distribution<float> slope(0, tilt);
  constexpr int side = 64;
  std::vector<std::uint8_t> texels;
  for (int i = 0; i < side * side; ++i) {
    const render::Vec3f n = normalize(render::Vec3f{slope(random), slope(random), 1});
    for (const float value : {n.x, n.y, n.z}) {
      texels.push_back(static_cast<std::uint8_t>(std::lround(127.5F * (value + 1))));
    }
  }
  render::SceneDescription scene;
  scene.background = "environment";
  scene.textures = {
      std::make_shared<render::Texture>(render::make_texture(side, side, 3, false, texels))};
  render::StandardParameters paint;
  paint.base_color[1] = paint.base_color[2] = 0.4F;
  paint.metallic = 1;
  paint.roughness = 0.2F;
  paint.clearcoat = 1;
  paint.normal_texture = 0;
  scene.materials = {make_standard_material("paint", paint)};
  auto panel = square({{{-4, 5, -3}, {4, 5, -3}, {4, 5, 3}, {-4, 5, 3}}}, 60, 0);
  panel->normals.assign(4, {0, -1, 0});
  panel->tangents.assign(4, {1, 0, 0, 1});
  scene.meshes = {panel};
  scene.instances.emplace_back();
  MadeShot shot = shot_of(std::move(scene));
  // A soft box behind the viewer, whose reflection the flakes blur.
  shot.environment.radiance = capture::make_image(64, 128, 3);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 128; ++x) {
      const render::Vec3f d =
          render::direction_of_texel(static_cast<float>(x), static_cast<float>(y), 128, 64);
      const bool box = d.y < -0.8F && std::abs(d.x) < 0.25F && std::abs(d.z) < 0.25F;
      for (int c = 0; c < 3; ++c) shot.environment.radiance.at(y, x, c) = box ? 5.0F : 0.3F;
    }
  }
  render::smooth_for_reflections(shot.environment);
  shot.job.cam_from_set = calibrate::look_at({0.3, 0, 0.2}, {0, 5, 0}, 0);
  return shot;
}

// As a plain mirror under the mean of their normals, flakes of these tilts would err by 24 and 83
// %.
TEST(NormalMap, FarAwayIsARougherSurfaceAsInTheReference) {
  for (const auto& [tilt, most] : {std::pair{0.0F, 0.02}, {0.1F, 0.1}, {0.25F, 0.16}}) {
    const MadeShot shot = flaky_paint(tilt);
    EXPECT_LT(error_of(shot), most) << tilt;
  }
}

// Not even where all light comes back may flakes add any.
TEST(NormalMap, NeverSendsBackMoreThanItGets) {
  MadeShot shot = flaky_paint(0.25F);
  std::ranges::fill(shot.environment.radiance.pixels, 1.0F);
  render::smooth_for_reflections(shot.environment);
  render::FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  for (const float value : capture::to_float(result.rgba).pixels) ASSERT_LE(value, 1.002F);
}

}  // namespace
}  // namespace compositing::mirrored_texture_test
