// Jobs, scenes and environments survive as bytes, and refuse bytes that are not theirs.
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <string>

#include "render/environment_bytes.h"
#include "render/frame_job.h"
#include "render/scene.h"

namespace render::bytes_test {
namespace {

FrameJob made_job() {
  FrameJob job;
  job.frame = 12345;
  job.time = capture::Time(987654321);
  job.cam_from_set = calibrate::look_at({1, 2, 3}, {0, 0, 0}, 0.2);
  job.lens = 3;
  job.scene_version = 17;
  job.effort.interleave = 4;
  job.effort.bounce_lamps = 12;
  job.effort.caustic_photons = 4096;
  job.effort.adaptive_visibility = false;
  job.effort.soft_lights = false;
  job.effort.aa_tolerance = 0.25F;
  job.effort.glint_contrast = 0.75F;
  job.textures = {{0, capture::Time(1)}, {1, capture::Time(2)}};
  job.lights.lights = {{{0, 0, 1}, {1, 2, 3}, 0.1F}, {{1, 0, 0}, {4, 5, 6}, 0.2F}};
  job.lights.lights[1].compact = 1;
  job.lights.parts.resize(1);
  for (Vec3f& to : job.lights.parts[0].directions) to = {0, 0.6F, 0.8F};
  job.lights.lamps = {{{1, 2, 3}, {0, 0, -1}, {7, 8, 9}, {1, 1, 2}, 0.25F, 1, 4, 5, 1}};
  job.lights.version = 5;
  job.match = {1.5F, 0.1F, -0.2F, 0.3F, 1, -0.1F, 0.05F, 0.15F, 0.5F};
  return job;
}

TileJob made_tile() {
  return {{16, 32, 16, 16}, 2, {14, 30, 20, 20}, std::vector<capture::Half>(20 * 20 * 3, 0x3C00)};
}

SceneDescription made_scene() {
  SceneDescription scene;
  auto mesh = std::make_shared<Mesh>();
  mesh->positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh->triangles = {{0, 1, 2}};
  mesh->materials = {0};
  scene.meshes.push_back(mesh);
  scene.textures.push_back(
      std::make_shared<Texture>(Texture{1, 1, 3, true, {1, 2, 3}, {Wrap::clamp, Wrap::mirror}}));
  scene.materials.push_back({"m", "standard", std::vector<std::byte>(88)});
  Instance instance;
  instance.name = "thing";
  instance.kind = ObjectKind::stand_in;
  instance.blocks_light = false;
  instance.occludes = false;
  instance.mirrored = true;
  scene.instances.push_back(instance);
  scene.videos = {"news", ""};
  scene.version = 9;
  return scene;
}

Environment made_environment() {
  Environment env;
  env.radiance = capture::make_image(2, 4, 3);
  env.radiance.at(1, 2, 0) = 1e9F;
  env.seen.assign(8, 1);
  env.smoothed = {env.radiance};
  env.halved = {capture::make_image(1, 2, 3)};
  env.halved[0].at(0, 1, 1) = 3;
  env.diffused = {env.radiance, env.halved[0]};
  env.compact_apart = true;
  return env;
}

TEST(Serialize, KeepsEveryFieldOfAFrameJob) {
  EXPECT_EQ(parse_frame_job(serialize(made_job())), made_job());
}

TEST(Serialize, KeepsEveryFieldOfATileJob) {
  EXPECT_EQ(parse_tile_job(serialize(made_tile())), made_tile());
}

TEST(Serialize, KeepsAScene) {
  const SceneDescription a = made_scene(), b = parse_scene(serialize(a));
  EXPECT_EQ(b.meshes[0]->positions, a.meshes[0]->positions);
  EXPECT_EQ(b.meshes[0]->triangles, a.meshes[0]->triangles);
  EXPECT_EQ(*b.textures[0], *a.textures[0]);
  EXPECT_EQ(b.materials, a.materials);
  EXPECT_EQ(b.instances, a.instances);
  EXPECT_EQ(b.videos, a.videos);
  EXPECT_EQ(b.background, a.background);
  EXPECT_EQ(b.version, a.version);
}

TEST(Serialize, KeepsAnEnvironment) {
  const Environment a = made_environment(), b = parse_environment(serialize(a));
  EXPECT_EQ(b.radiance.pixels, a.radiance.pixels);
  EXPECT_EQ(b.seen, a.seen);
  ASSERT_EQ(b.smoothed.size(), 1U);
  EXPECT_EQ(b.smoothed[0].pixels, a.smoothed[0].pixels);
  ASSERT_EQ(b.halved.size(), 1U);
  EXPECT_EQ(b.halved[0].pixels, a.halved[0].pixels);
  ASSERT_EQ(b.diffused.size(), 2U);
  EXPECT_EQ(b.diffused[1].pixels, a.diffused[1].pixels);
  EXPECT_TRUE(b.compact_apart);
}

TEST(ParseEnvironment, RefusesLevelsThatPlacesDoNotFit) {
  const auto refuses = [](auto change, const std::string& words) {
    Environment env = made_environment();
    change(env);
    try {
      parse_environment(serialize(env));
      ADD_FAILURE() << "taken: " << words;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  const capture::Image square = capture::make_image(2, 2, 3), high = capture::make_image(4, 8, 3);
  refuses([&](Environment& env) { env.radiance = square, env.seen.assign(4, 1); }, "twice as wide");
  refuses([&](Environment& env) { env.smoothed.push_back(square); }, "smoothed 1");
  refuses([&](Environment& env) { env.smoothed[0] = high; }, "another size than the map");
  refuses([&](Environment& env) { env.halved[0] = high; }, "halved 0");
  refuses([&](Environment& env) { env.halved.assign(2, env.halved[0]); }, "halved 1");
  refuses([&](Environment& env) { env.diffused[0] = square; }, "diffused 0");
  refuses([&](Environment& env) { env.smoothed.resize(200, env.smoothed[0]); }, "more than 128");
  const auto clear = [](Environment& env) {
    env.smoothed.clear(), env.halved.clear(), env.diffused.clear();
  };
  refuses(
      [&](Environment& env) { clear(env), env.halved = {env.radiance}, env.compact_apart = false; },
      "none smoothed");
  refuses([&](Environment& env) { clear(env); }, "no level without");
  refuses([&](Environment& env) { env.diffused.clear(); }, "no level without");
}

TEST(ParseEnvironment, RefusesValuesThatWouldSpoilThePicture) {
  const float inf = std::numeric_limits<float>::infinity();
  for (const float value : {-1.0F, inf, -inf, std::numeric_limits<float>::quiet_NaN()}) {
    Environment level = made_environment();
    level.halved[0].at(0, 1, 2) = value;
    EXPECT_THROW(parse_environment(serialize(level)), std::runtime_error) << value;
    Environment share = made_environment();
    share.unseen_share = value;
    EXPECT_THROW(parse_environment(serialize(share)), std::runtime_error) << value;
    Environment map = made_environment();  // a probe's map may: it is counted where it is read
    map.radiance.at(0, 0, 0) = value;
    EXPECT_NO_THROW(parse_environment(serialize(map))) << value;
    map.smoothed.clear(), map.halved.clear(), map.diffused.clear(), map.compact_apart = false;
    EXPECT_THROW(parse_environment(serialize(map)), std::runtime_error) << "the only level";
  }
}

TEST(ParseEnvironment, RefusesDiffusedLevelsOfOtherSizes) {
  Environment shorter = made_environment();
  shorter.diffused.pop_back();
  EXPECT_THROW(parse_environment(serialize(shorter)), std::runtime_error);
  Environment smaller = made_environment();
  smaller.diffused[0] = smaller.halved[0];
  EXPECT_THROW(parse_environment(serialize(smaller)), std::runtime_error);
  Environment alone = made_environment();
  alone.smoothed.clear();
  EXPECT_THROW(parse_environment(serialize(alone)), std::runtime_error);
}

// Every prefix, and thousands of changed bytes: refused, or read as something of the same kind, but
// never a crash, a hang, or an allocation beyond what the bytes could hold.
template <class Parse>
void survive(std::vector<std::byte> bytes, Parse parse) {
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 64) {
    EXPECT_THROW(parse(std::span(bytes).first(size)), std::runtime_error) << size;
  }
  std::mt19937 random(1);
  for (int i = 0; i < 3000; ++i) {
    std::vector<std::byte> changed = bytes;
    for (int k = 0; k < 3; ++k) {
      changed[random() % changed.size()] = static_cast<std::byte>(random() & 255);
    }
    try {
      parse(changed);
    } catch (const std::runtime_error&) {
    }
  }
  bytes.push_back({});
  EXPECT_THROW(parse(bytes), std::runtime_error);
}

TEST(ParseFrameJob, RefusesDamage) {
  survive(serialize(made_job()), [](auto bytes) { return parse_frame_job(bytes); });
}
TEST(ParseTileJob, RefusesDamage) {
  survive(serialize(made_tile()), [](auto bytes) { return parse_tile_job(bytes); });
}
TEST(ParseScene, RefusesDamage) {
  survive(serialize(made_scene()), [](auto bytes) { return parse_scene(bytes); });
}
TEST(ParseEnvironment, RefusesDamage) {
  survive(serialize(made_environment()), [](auto bytes) { return parse_environment(bytes); });
}

}  // namespace
}  // namespace render::bytes_test
