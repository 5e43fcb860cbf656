// Blended alpha: pictures that cover what is behind them by shares.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "made_shot.h"
#include "render/kept_transport.h"
#include "render/reference.h"
#include "render/texture.h"

namespace compositing::blended_alpha_test {
namespace {

using render::Vec3f;

constexpr int width = 128, height = 96;

// A decal that stands on the floor before a ball: rings of green, whose alpha goes from 0 outside
// to 1 in soft steps; below it the ball's red, and the plate.
render::SceneDescription with_decal(std::int32_t blend) {
  render::SceneDescription scene = shot_scene();
  constexpr int size = 64;
  std::vector<std::uint8_t> texels;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double r = std::hypot(x + 0.5 - size / 2, y + 0.5 - size / 2) / (size / 2);
      const double ring = r < 0.9 ? 0.5 + 0.5 * std::cos(r * 12) : 0;
      for (const double value : {0.2, 0.9, 0.3, ring}) {
        texels.push_back(static_cast<std::uint8_t>(std::lround(255 * value)));
      }
    }
  }
  scene.textures = {
      std::make_shared<render::Texture>(render::make_texture(size, size, 4, true, texels))};
  render::StandardParameters decal;
  decal.base_color_texture = 0;
  decal.alpha_blend = blend;
  decal.roughness = 0.3F;
  scene.materials.push_back(render::make_standard_material("decal", decal));
  auto mesh = std::make_shared<render::Mesh>();
  const Vec3f corner{0.6F, -1.5F, 0.05F}, along{1.1F, 0.6F, 0}, up{0, 0, 1.1F};
  mesh->positions = {corner, corner + along, corner + along + up, corner + up};
  mesh->uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh->materials = {static_cast<std::uint32_t>(scene.materials.size() - 1)};
  scene.meshes.push_back(mesh);
  render::Instance instance;
  instance.name = "decal";
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  scene.instances.push_back(instance);
  return scene;
}

TEST(BlendedAlpha, LooksAsTheReferenceHasIt) {
  MadeShot shot = made_shot(width, height, with_decal(1), 64);
  shot.environment = made_sky(32, 0, 1);  // its lights are all of it
  render::FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  const capture::Image shown = capture::to_float(result.rgba),
                       plate = capture::to_float(shot.plate);
  const capture::Image truth = render_reference(shot.inputs(), shot.job, plate, {.samples = 256});
  const capture::Image mask = render::affected_mask(truth, plate);
  const double error = render::picture_error(shown, truth, mask).relative_rms;
  EXPECT_LT(error, 0.02);
  // It would tell.
  const MadeShot solid = made_shot(width, height, with_decal(0), 64);
  render_frame(solid.inputs(), solid.job, solid.plate, result);
  EXPECT_GT(render::picture_error(capture::to_float(result.rgba), truth, mask).relative_rms, 0.1);
}

TEST(BlendedAlpha, IsTheSameColdAndWarm) {
  const MadeShot shot = made_shot(width, height, with_decal(1));
  render::FrameResult cold, warm;
  render_frame(shot.inputs(), shot.job, shot.plate, cold);
  render::KeptTransport kept;
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = &kept;
  for (int i = 0; i < 2; ++i) render_frame(inputs, shot.job, shot.plate, warm);
  EXPECT_EQ(cold.rgba.pixels, warm.rgba.pixels);
}

// Where alpha is 0 nothing of the decal is left: no mirrored light, no shadow.
TEST(BlendedAlpha, LeavesNothingWhereItIsClear) {
  render::SceneDescription scene = with_decal(1);
  std::vector<std::uint8_t> clear(4, 255);
  clear[3] = 0;
  scene.textures = {std::make_shared<render::Texture>(render::make_texture(1, 1, 4, true, clear))};
  render::SceneDescription without = scene;
  without.instances.pop_back();
  const MadeShot with = made_shot(width, height, std::move(scene));
  const MadeShot bare = made_shot(width, height, std::move(without));
  render::FrameResult a, b;
  render_frame(with.inputs(), with.job, with.plate, a);
  render_frame(bare.inputs(), bare.job, bare.plate, b);
  const capture::Image shown = capture::to_float(a.rgba), wanted = capture::to_float(b.rgba);
  double worst = 0, sum = 0;
  for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
    const double off = std::abs(static_cast<double>(shown.pixels[i] - wanted.pixels[i]));
    worst = std::max(worst, off), sum += off;
  }
  EXPECT_LT(sum / static_cast<double>(shown.pixels.size()), 1e-3);
  EXPECT_LT(worst, 0.1) << "edges take other rays";
}

}  // namespace
}  // namespace compositing::blended_alpha_test
