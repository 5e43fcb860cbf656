// Lamps of bounced light in pictures: against the reference that follows light between surfaces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "compositing/billboard.h"
#include "compositing/keyed_picture.h"
#include "made_shot.h"
#include "render/bounced_light.h"
#include "render/kept_transport.h"
#include "render/reference.h"

namespace compositing::bounce_lamps_test {
namespace {

using render::Vec3f;

constexpr int width = 64, height = 48;

std::shared_ptr<render::Mesh> wall(Vec3f corner, Vec3f a, Vec3f b, std::uint32_t material) {
  auto mesh = std::make_shared<render::Mesh>();
  mesh->positions = {corner, corner + a, corner + a + b, corner + b};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh->materials = {material};
  return mesh;
}

render::Material matte(float r, float g, float b) {
  render::StandardParameters p;
  p.base_color[0] = r, p.base_color[1] = g, p.base_color[2] = b;
  p.roughness = 1;
  p.specular = 0;
  return make_standard_material("matte", p);
}

// A red wall and a grey one on a floor, with a roof over most of it: half of the light in there
// comes from the walls.
render::SceneDescription shelter(bool real_floor) {
  register_shaders();
  render::SceneDescription scene;
  scene.background = "environment";
  scene.materials = {matte(0.6F, 0.6F, 0.6F), matte(0.7F, 0.1F, 0.1F),
                     make_stand_in_material("floor", {})};
  scene.meshes = {wall({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, real_floor ? 2 : 0),
                  wall({-2, -2, 0}, {0, 4, 0}, {0, 0, 2}, 1),
                  wall({-2, 2, 0}, {4, 0, 0}, {0, 0, 2}, 0),
                  wall({-2, -1, 2}, {4, 0, 0}, {0, 3, 0}, 0)};
  for (std::uint32_t i = 0; i < scene.meshes.size(); ++i) scene.instances.emplace_back().mesh = i;
  if (real_floor) {
    scene.instances[0].kind = render::ObjectKind::stand_in;
    scene.instances[0].blocks_light = false;
  }
  return scene;
}

MadeShot shot_of(render::SceneDescription scene, int lights = 256) {
  MadeShot shot = made_shot(width, height, std::move(scene));
  shot.environment = made_sky(64, 0, 1);
  // A sun, low enough to shine under the roof.
  for (int c = 0; c < 3; ++c) shot.environment.radiance.at(24, 64, c) = 800;
  render::smooth_for_reflections(shot.environment);
  shot.job.lights = render::make_light_table(shot.environment, {.count = lights});
  shot.job.cam_from_set = calibrate::look_at({1.5, -5, 1.6}, {-0.2, 0, 0.8}, 0);
  return shot;
}

void add_lamps(int count, MadeShot& shot) {
  const auto lamps =
      render::BouncedLight(*shot.scene, shot.job.lights, {.lamps = count}).lamps(shot.job.lights);
  shot.job.lights.lamps.insert(shot.job.lights.lamps.end(), lamps.begin(), lamps.end());
}

capture::Image picture_of(const MadeShot& shot, render::KeptTransport* kept = nullptr) {
  render::FrameResult result;
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = kept;
  render::render_frame(inputs, shot.job, shot.plate, result);
  return capture::to_float(result.rgba);
}

double error_of(const MadeShot& shot, const capture::Image& truth) {
  const capture::Image mask = render::affected_mask(truth, capture::to_float(shot.plate));
  return render::picture_error(picture_of(shot), truth, mask).relative_rms;
}

TEST(BounceLampsInAPicture, BringItNearTheReferenceWithAllBounces) {
  MadeShot shot = shot_of(shelter(false));
  const capture::Image truth = render::render_reference(
      shot.inputs(), shot.job, capture::to_float(shot.plate), {.samples = 256, .bounces = true});
  const double without = error_of(shot, truth);
  EXPECT_GT(without, 0.15);
  double before = without;
  for (const int count : {8, 64, 256}) {
    MadeShot with = shot_of(shelter(false));
    add_lamps(count, with);
    const double error = error_of(with, truth);
    EXPECT_LT(error, before) << count;
    before = error;
  }
  EXPECT_LT(before, 0.25 * without);
}

TEST(BounceLampsInAPicture, AreLeftOutOfTheReferenceWhichFollowsThatLightItself) {
  MadeShot shot = shot_of(shelter(false), 16);
  const capture::Image plate = capture::to_float(shot.plate);
  const auto truth =
      render::render_reference(shot.inputs(), shot.job, plate, {.samples = 4, .bounces = true});
  add_lamps(16, shot);
  EXPECT_EQ(render::render_reference(shot.inputs(), shot.job, plate, {.samples = 4}).pixels,
            truth.pixels);
}

// The real floor before a red wall in the sun turns red, and by as much as the reference says.
TEST(BounceLampsInAPicture, ColourTheRealFloor) {
  MadeShot shot = shot_of(shelter(true));
  shot.plate = capture::to_half([] {
    capture::Image grey = capture::make_image(height, width);
    std::ranges::fill(grey.pixels, 0.3F);
    return grey;
  }());
  const capture::Image plain = picture_of(shot);
  const capture::Image truth = render::render_reference(
      shot.inputs(), shot.job, capture::to_float(shot.plate), {.samples = 256, .bounces = true});
  add_lamps(64, shot);
  const capture::Image lit = picture_of(shot);
  Vec3f gained, asked;
  int pixels = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (plain.at(y, x, 3) > 0) continue;
      const auto redder = [&](const capture::Image& i) { return i.at(y, x, 0) - i.at(y, x, 2); };
      if (!(redder(truth) - redder(plain) > 0.005F)) continue;
      gained.x += redder(lit) - redder(plain);
      asked.x += redder(truth) - redder(plain);
      ++pixels;
    }
  }
  ASSERT_GT(pixels, 100);
  EXPECT_NEAR(gained.x / asked.x, 1, 0.15);
}

// What is kept, under light that is live and a roof that moves, is what a cold frame finds.
TEST(BounceLampsInAPicture, AreTheSameWarmAndCold) {
  render::SceneDescription scene = shelter(false);
  scene.instances[3].moves = true;
  MadeShot shot = shot_of(scene, 32);
  for (auto& light : shot.job.lights.lights) light.planned = light.irradiance;
  const render::LightTable table = shot.job.lights;
  render::KeptTransport kept;
  render::BounceFollower follower;
  for (int frame = 0; frame < 8; ++frame) {
    shot.job.lights = table;
    for (auto& light : shot.job.lights.lights) {
      light.irradiance *= 1 + 0.05F * static_cast<float>(frame);
    }
    if (frame == 3 || frame == 5) {
      scene.instances[3].set_from_object[7] += 0.3F;
      shot.scene = std::make_unique<render::Scene>(scene, *shot.scene);
    }
    const auto lamps = follower.follow(*shot.scene, shot.job.lights, {.lamps = 24});
    const auto cold = render::BouncedLight(*shot.scene, shot.job.lights, {.lamps = 24});
    EXPECT_EQ(lamps, cold.lamps(shot.job.lights)) << frame;
    shot.job.lights.lamps = lamps;
    EXPECT_EQ(picture_of(shot, &kept).pixels, picture_of(shot).pixels) << frame;
  }
}

// Persons come and go in every frame: lamps stay where they are, and no cell is found anew for it.
TEST(BounceLampsInAPicture, PassLivePictures) {
  render::SceneDescription scene = shelter(false);
  scene.materials.push_back(make_billboard_material("person", {}));
  scene.meshes.push_back(std::make_shared<render::Mesh>(make_billboard_mesh(3)));
  render::Instance& person = scene.instances.emplace_back();
  person.mesh = 4;
  person.set_from_object = {1, 0, 0, -1, 0, 1, 0, 0, 0, 0, 1.8F, 0};
  person.moves = true;
  const auto whole = [](float alpha) {
    capture::Image image = capture::make_image(8, 4, 4);
    std::ranges::fill(image.pixels, alpha);
    return std::make_shared<KeyedPicture>(make_keyed_texture(image));
  };
  MadeShot shot = shot_of(shelter(false), 32);
  const render::Scene solid(scene, {whole(1)});
  scene.instances[4].set_from_object[3] += 0.5F;
  const render::Scene moved(scene, solid, {whole(0.25F)});
  const render::BounceSettings settings{.lamps = 24};
  render::BounceFollower follower;
  const auto lamps = follower.follow(solid, shot.job.lights, settings);
  EXPECT_EQ(lamps.size(), 24U);
  EXPECT_EQ(follower.follow(moved, shot.job.lights, settings), lamps);
  EXPECT_EQ(render::BouncedLight(moved, shot.job.lights, settings).lamps(shot.job.lights), lamps);
}

// What frames a live picture is a surface like any other, and sends light from where it stands.
TEST(BounceLampsInAPicture, FollowTheFrameOfALivePicture) {
  render::SceneDescription scene = shelter(false);
  scene.materials.push_back(make_billboard_material("person", {}));
  render::Mesh board = make_billboard_mesh(3);
  const auto first = static_cast<std::uint32_t>(board.positions.size());
  const render::Mesh frame = *wall({-1, -0.1F, 0}, {2, 0, 0}, {0, 0, 2}, 1);
  board.materials.assign(board.triangles.size(), 3);
  board.positions.insert(board.positions.end(), frame.positions.begin(), frame.positions.end());
  if (!board.normals.empty()) board.normals.resize(board.positions.size(), {0, -1, 0});
  if (!board.uvs.empty()) board.uvs.resize(board.positions.size());
  if (!board.tangents.empty()) board.tangents.resize(board.positions.size());
  for (const auto& [a, b, c] : frame.triangles) {
    board.triangles.push_back({a + first, b + first, c + first});
    board.materials.push_back(1);
  }
  scene.meshes.push_back(std::make_shared<render::Mesh>(board));
  render::Instance& framed = scene.instances.emplace_back();
  framed.mesh = 4;
  framed.moves = true;
  capture::Image image = capture::make_image(8, 4, 4);
  std::ranges::fill(image.pixels, 1.0F);
  const render::Scene::Pictures pictures{std::make_shared<KeyedPicture>(make_keyed_texture(image))};
  const MadeShot shot = shot_of(shelter(false), 32);
  const render::Scene before(scene, pictures);
  scene.instances[4].set_from_object[7] -= 1;
  const render::Scene moved(scene, before, pictures);
  const render::BounceSettings settings{.lamps = 24};
  render::BounceFollower follower;
  const auto lamps = follower.follow(before, shot.job.lights, settings);
  const auto now = render::BouncedLight(moved, shot.job.lights, settings).lamps(shot.job.lights);
  EXPECT_NE(now, lamps);
  EXPECT_EQ(follower.follow(moved, shot.job.lights, settings), now);
}

}  // namespace
}  // namespace compositing::bounce_lamps_test
