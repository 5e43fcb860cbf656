// Meshes that deform: their trees are fitted, only cells that may see them are found anew, and no
// bit shows it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "made_room.h"
#include "render/scene.h"

namespace compositing::deforming_things_test {
namespace {

using render::Mesh;
using render::Scene;
using render::SceneDescription;
using render::Vec3f;

// A cloth of steps x steps squares, 1.2 m wide and 0.8 high, that waves about y = 0.
Mesh made_cloth(int steps, float time, float wave_m, std::uint32_t material) {
  Mesh mesh;
  for (int row = 0; row <= steps; ++row) {
    for (int column = 0; column <= steps; ++column) {
      const float u = static_cast<float>(column) / static_cast<float>(steps);
      const float v = static_cast<float>(row) / static_cast<float>(steps);
      const float phase = 9 * u + 3 * v - time;
      mesh.positions.push_back({1.2F * u - 0.6F, wave_m * u * std::sin(phase), 0.4F + 0.8F * v});
      const Vec3f along{1.2F, wave_m * (std::sin(phase) + 9 * u * std::cos(phase)), 0};
      const Vec3f up{0, wave_m * 3 * u * std::cos(phase), 0.8F};
      mesh.normals.push_back(normalize(cross(along, up)));
      mesh.uvs.push_back({u, v});
    }
  }
  const auto wide = static_cast<std::uint32_t>(steps + 1);
  for (std::uint32_t row = 0; row + 1 < wide; ++row) {
    for (std::uint32_t column = 0; column + 1 < wide; ++column) {
      const std::uint32_t i = row * wide + column;
      mesh.triangles.push_back({i, i + 1, i + wide + 1});
      mesh.triangles.push_back({i, i + wide + 1, i + wide});
    }
  }
  mesh.materials = {material};
  return mesh;
}

std::shared_ptr<const std::vector<Vec3f>> rest_of(const Mesh& mesh) {
  return std::make_shared<const std::vector<Vec3f>>(mesh.positions);
}

// A shape of a thing that is at `rest` otherwise.
std::shared_ptr<const Mesh> shape(Mesh mesh, std::shared_ptr<const std::vector<Vec3f>> rest) {
  mesh.rest = std::move(rest);
  return std::make_shared<const Mesh>(std::move(mesh));
}

render::FrameResult render_cold(const MadeRoom& room, const SceneDescription& scene) {
  const Scene built(scene);
  render::FrameInputs inputs = room.inputs();
  inputs.scene = &built;
  render::FrameResult result;
  render_frame(inputs, room.job, room.plate, result);
  return result;
}

std::uint64_t rays_of(const render::FrameResult& result) {
  const render::RenderStatistics& s = result.statistics;
  return s.primary_rays + s.shadow_rays + s.secondary_rays;
}

// A cloth of one material waves, is torn, folds up, loses vertices, becomes another thing and comes
// back, and moves meanwhile; a mirror, the floor and a glass ball show it. Two scenes before the
// newest stay alive.
void expect_warm_is_cold(std::uint32_t material_of_cloth, bool stand_in) {
  MadeRoom room(128, 96);
  SceneDescription scene = MadeRoom::describe();
  make_floor_real(scene);
  auto rest = rest_of(made_cloth(24, 0, 0, 0));
  const auto cloth_mesh = scene.meshes.size();
  scene.meshes.push_back(shape(made_cloth(24, 0, 0.1F, material_of_cloth), rest));
  for (int i = 0; i < 2; ++i) {  // two of one shape
    render::Instance& cloth = scene.instances.emplace_back();
    cloth.name = "cloth";
    cloth.mesh = static_cast<std::uint32_t>(cloth_mesh);
    cloth.moves = true;
    cloth.set_from_object[3] = i == 0 ? -0.2F : -2.2F;
    if (stand_in) {
      cloth.kind = render::ObjectKind::stand_in;
      cloth.blocks_light = cloth.occludes = i == 1;
    }
  }
  scene.instances[5].moves = true;
  auto newest = std::make_shared<const Scene>(scene);
  std::vector<std::shared_ptr<const Scene>> alive;
  room.job.lights.lights.resize(12);
  render::KeptTransport kept;
  std::mt19937 random(5);
  const auto dice = [&](float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random);
  };
  std::uint64_t warm_rays = 0, cold_rays = 0;
  for (int frame = 0; frame < 14; ++frame) {
    Mesh mesh = made_cloth(24, dice(0, 6), dice(0, 0.3F), material_of_cloth);
    std::size_t skipped = 0;
    if (frame == 3 || frame == 4) {  // one vertex of six triangles
      mesh.positions[25 * 12 + 7].y = std::numeric_limits<float>::quiet_NaN();
      skipped = 6;
    }
    if (frame == 5) {
      for (Vec3f& p : mesh.positions) p.z = std::numeric_limits<float>::infinity();
      skipped = mesh.triangles.size();
    }
    if (frame == 7) std::ranges::shuffle(mesh.positions, random);
    if (frame == 8) mesh.positions[0].x = 1e30F, skipped = 2;
    if (frame == 9) rest = rest_of(mesh = made_cloth(7, 1, 0.2F, material_of_cloth));
    if (frame == 10) mesh = made_cloth(7, 2, 0.2F, material_of_cloth);
    if (frame == 11) rest = rest_of(mesh);
    if (frame == 12) mesh = {}, mesh.materials = {material_of_cloth}, rest = rest_of(mesh);
    if (frame == 13) rest = rest_of(mesh);
    if (frame != 2) scene.meshes[cloth_mesh] = shape(std::move(mesh), rest);
    if (frame % 3 == 0) {
      scene.instances.back().set_from_object[7] = dice(-0.3F, 0.3F);
      scene.instances[5].set_from_object[3] = dice(-0.3F, 0.3F);
    }
    newest = std::make_shared<const Scene>(scene, *newest);
    EXPECT_EQ(newest->skipped_triangles(), frame == 2 ? 0 : skipped) << frame;
    alive.push_back(newest);
    if (alive.size() > 3) alive.erase(alive.begin());
    render::FrameInputs inputs = room.inputs();
    inputs.scene = newest.get();
    inputs.kept = &kept;
    render::FrameResult warm;
    render_frame(inputs, room.job, room.plate, warm);
    const render::FrameResult cold = render_cold(room, scene);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << material_of_cloth << " " << frame;
    EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << material_of_cloth << " " << frame;
    if (frame == 0) continue;
    warm_rays += rays_of(warm);
    cold_rays += rays_of(cold);
  }
  EXPECT_LT(warm_rays, cold_rays);
}

TEST(DeformingMesh, IsTheSameWarmAndColdWhateverItIsMadeOf) {
  for (const std::uint32_t material : {0U, 2U, 4U}) expect_warm_is_cold(material, false);
}

TEST(DeformingMesh, IsTheSameWarmAndColdAsAStandIn) {
  expect_warm_is_cold(5, true);  // the real floor's material
}

// A scene that is alive keeps its shape whatever those after it do.
TEST(DeformingMesh, StaysInScenesThatAreInUse) {
  MadeRoom room(96, 64);
  SceneDescription scene = MadeRoom::describe();
  const auto rest = rest_of(made_cloth(16, 0, 0, 0));
  render::Instance& cloth = scene.instances.emplace_back();
  cloth.mesh = static_cast<std::uint32_t>(scene.meshes.size());
  cloth.moves = true;
  scene.meshes.push_back(shape(made_cloth(16, 0, 0.2F, 0), rest));
  room.job.lights.lights.resize(8);
  std::vector<std::shared_ptr<const Scene>> scenes{std::make_shared<const Scene>(scene)};
  std::vector<render::FrameResult> pictures;
  for (int i = 1; i < 5; ++i) {
    pictures.push_back(render_cold(room, scene));
    scene.meshes.back() = shape(made_cloth(16, static_cast<float>(i), 0.3F, 0), rest);
    scenes.push_back(std::make_shared<const Scene>(scene, *scenes.back()));
  }
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    render::FrameInputs inputs = room.inputs();
    inputs.scene = scenes[i].get();
    render::FrameResult result;
    render_frame(inputs, room.job, room.plate, result);
    EXPECT_EQ(result.rgba.pixels, pictures[i].rgba.pixels) << i;
  }
}

// The tree that was fitted shows what one that was built for the shape does.
TEST(DeformingMesh, LooksAsAMeshThatWasBuiltAsItIs) {
  MadeRoom room(160, 120);
  SceneDescription scene = MadeRoom::describe();
  const auto rest = rest_of(made_cloth(40, 0, 0, 0));
  render::Instance& cloth = scene.instances.emplace_back();
  cloth.mesh = static_cast<std::uint32_t>(scene.meshes.size());
  cloth.moves = true;
  scene.meshes.push_back(nullptr);
  for (int frame = 0; frame < 4; ++frame) {
    const Mesh mesh = made_cloth(40, static_cast<float>(frame), 0.3F, 2);
    scene.meshes.back() = shape(mesh, rest);
    const render::FrameResult fitted = render_cold(room, scene);
    scene.meshes.back() = std::make_shared<const Mesh>(mesh);
    const render::FrameResult built = render_cold(room, scene);
    const capture::Image fitted_picture = capture::to_float(fitted.rgba);
    const capture::Image built_picture = capture::to_float(built.rgba);
    // Rays that meet two triangles at their common edge may take the other one.
    std::size_t differ = 0;
    for (std::size_t i = 0; i < built.rgba.pixels.size(); ++i) {
      const float a = fitted_picture.pixels[i];
      const float b = built_picture.pixels[i];
      if (a != b) ++differ;
      EXPECT_NEAR(a, b, 0.02F) << frame << " " << i;
    }
    EXPECT_LE(differ, 8U) << frame;
  }
}

// What a deformed thing does to what is about it is there in the very same frame.
TEST(DeformingMesh, CastsItsShadowAndIsMirroredInTheSameFrame) {
  SceneDescription scene = shot_scene(false);
  render::StandardParameters chrome;
  chrome.metallic = 1;
  chrome.roughness = 0;
  scene.materials.push_back(render::make_standard_material("chrome", chrome));
  const auto add = [&scene](std::shared_ptr<const Mesh> mesh) -> render::Instance& {
    scene.meshes.push_back(std::move(mesh));
    render::Instance& added = scene.instances.emplace_back();
    added.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    return added;
  };
  const auto mirror = static_cast<std::uint32_t>(scene.materials.size() - 1);
  const Mesh flat = made_cloth(12, 0, 0, 0);
  const auto rest = rest_of(flat);
  add(made_screen({0, 1.5F, 0.7F}, {0, -1, 0}, 3, 1.4F, mirror));
  add(shape(flat, rest)).moves = true;
  const std::size_t cloth = scene.meshes.size() - 1;
  MadeShot shot = made_shot(192, 128, scene, 16);
  shot.job.cam_from_set = calibrate::look_at({0, -4, 2}, {0, 0, 0.5}, 0);
  render::KeptTransport kept;
  const auto show = [&](render::KeptTransport* memory) {
    render::FrameInputs inputs = shot.inputs();
    inputs.kept = memory;
    render::FrameResult result;
    render_frame(inputs, shot.job, shot.plate, result);
    return result;
  };
  const render::FrameResult before = show(&kept);
  // Rolled up to its upper edge: where it hung, and its shadow and mirror image, are free.
  Mesh rolled = flat;
  for (Vec3f& p : rolled.positions) p.z = 1.2F - (1.2F - p.z) * 0.1F;
  scene.meshes[cloth] = shape(rolled, rest);
  shot.scene = std::make_unique<Scene>(scene, *shot.scene);
  const render::FrameResult after = show(&kept);
  EXPECT_EQ(after.rgba.pixels, show(nullptr).rgba.pixels);
  const Scene::Bounds up = shot.scene->bounds();
  EXPECT_GT(up.upper.z, 1.1F);
  std::size_t changed = 0, outside = 0;
  for (std::size_t i = 0; i < after.matte.pixels.size(); ++i) {
    bool differs = false;
    for (std::size_t c = 0; c < 4; ++c) {
      differs |= before.rgba.pixels[4 * i + c] != after.rgba.pixels[4 * i + c];
    }
    changed += differs;
    // Pixels that show neither shape themselves: shadow and mirror image.
    outside += differs && before.rgba.pixels[4 * i + 3] == after.rgba.pixels[4 * i + 3];
  }
  EXPECT_GT(changed, 1000U);
  EXPECT_GT(outside, 300U);
}

// Shadow rays ask no filter in a scene that says it has none.
TEST(DeformingMesh, LetsLightThroughAlsoIfItBeganWithoutTriangles) {
  MadeRoom room(16, 16);
  SceneDescription scene = MadeRoom::describe();
  const auto glass = static_cast<std::uint32_t>(
      std::ranges::find(scene.materials, "glass", &render::Material::shader) -
      scene.materials.begin());
  ASSERT_LT(glass, scene.materials.size());
  std::erase_if(scene.instances, [&](const render::Instance& i) {
    return std::ranges::find(scene.meshes[i.mesh]->materials, glass) !=
           scene.meshes[i.mesh]->materials.end();
  });
  ASSERT_FALSE(Scene(scene).has_filters());
  const Mesh cloth = made_cloth(4, 0, 0.1F, glass);
  Mesh none = cloth;
  none.triangles.clear();
  const auto rest = rest_of(cloth);
  render::Instance& instance = scene.instances.emplace_back();
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size());
  instance.moves = true;
  scene.meshes.push_back(shape(none, rest));
  const Scene before(scene);
  scene.meshes.back() = shape(cloth, rest);
  EXPECT_TRUE(Scene(scene).has_filters());
  EXPECT_TRUE(Scene(scene, before).has_filters());
}

TEST(DeformingMesh, TravelsAsBytes) {
  SceneDescription scene = MadeRoom::describe();
  const auto rest = rest_of(made_cloth(3, 0, 0, 0));
  scene.meshes.push_back(shape(made_cloth(3, 1, 0.2F, 0), rest));
  const SceneDescription back = render::parse_scene(render::serialize(scene));
  ASSERT_NE(back.meshes.back()->rest, nullptr);
  EXPECT_EQ(*back.meshes.back()->rest, *rest);
  EXPECT_EQ(back.meshes.front()->rest, nullptr);
}

TEST(DeformingMesh, MustMoveAndHaveAllItsVerticesAtRest) {
  SceneDescription scene = MadeRoom::describe();
  Mesh cloth = made_cloth(3, 1, 0.2F, 0);
  scene.instances.emplace_back().mesh = static_cast<std::uint32_t>(scene.meshes.size());
  scene.meshes.push_back(shape(cloth, rest_of(cloth)));
  EXPECT_THROW(Scene{scene}, std::invalid_argument);
  scene.instances.back().moves = true;
  EXPECT_NO_THROW(Scene{scene});
  cloth.positions.pop_back();
  scene.meshes.back() = shape(made_cloth(3, 1, 0.2F, 0), rest_of(cloth));
  EXPECT_THROW(Scene{scene}, std::invalid_argument);
}

}  // namespace
}  // namespace compositing::deforming_things_test
