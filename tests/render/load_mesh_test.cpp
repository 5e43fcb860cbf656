// Models: what is read, what is refused.
#include "render/load_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "render/glass.h"
#include "render/standard.h"
#include "tests/made_files.h"
#include "tests/made_gltf.h"

namespace render::load_mesh_test {
namespace {

namespace fs = std::filesystem;
using render::load_model;
using render::LoadedModel;
using testing::HasSubstr;

std::string data_folder() {
  const char* folder = std::getenv("PLATELIGHT_DATA");
  return folder != nullptr ? folder : PLATELIGHT_SOURCE_DIR "/../shared/data";
}
std::string bad(const std::string& name) { return PLATELIGHT_SOURCE_DIR "/tests/data/bad/" + name; }
std::string good(const std::string& name) { return PLATELIGHT_SOURCE_DIR "/tests/data/" + name; }

#define SKIP_WITHOUT(path) \
  if (!fs::exists(path)) GTEST_SKIP() << "needs real data: " << (path)

render::LoadOptions hiding(const std::string& node) {
  render::LoadOptions options;
  options.hide = {node};
  return options;
}

std::string refusal_of(const std::string& path) {
  try {
    load_model(path);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(LoadModel, TurnsYUpToZUpAndScales) {
  render::LoadOptions twice;
  twice.scale = 2;
  const LoadedModel model = load_model(good("quad.gltf"), twice);
  EXPECT_EQ(model.report.triangles, 2U);
  // The file's quad spans x 0..1, y 0..3, at z = 5.
  EXPECT_EQ(model.report.lower, (render::Vec3f{0, -10, 0}));
  EXPECT_EQ(model.report.upper, (render::Vec3f{2, -10, 6}));
  ASSERT_EQ(model.scene.instances.size(), 1U);
  EXPECT_EQ(model.scene.instances[0].name, "Sign");
  const auto p = render::standard_parameters(model.scene.materials.at(0), 0);
  EXPECT_FLOAT_EQ(p.base_color[0], 0.25F);
  EXPECT_FLOAT_EQ(p.metallic, 0);
  EXPECT_FLOAT_EQ(p.roughness, 0.75F);
  EXPECT_FLOAT_EQ(p.emission[1], 0.5F);
}

TEST(LoadModel, TakesThePlainFormatsToo) {
  const LoadedModel obj = load_model(good("quad.obj"));
  EXPECT_EQ(obj.report.triangles, 2U);
  EXPECT_EQ(obj.report.upper.z, 3) << "OBJ is y up";
  const LoadedModel ply = load_model(good("quad.ply"));
  EXPECT_EQ(ply.report.triangles, 2U);
  EXPECT_EQ(ply.report.upper.z, 5) << "PLY is z up";
  render::LoadOptions z_up;
  z_up.up = render::UpAxis::z;
  EXPECT_EQ(load_model(good("quad.obj"), z_up).report.upper.z, 5);
}

TEST(LoadModel, ListsTheNodesWhenOneToHideIsNotThere) {
  try {
    load_model(good("quad.gltf"), hiding("Bonnet"));
    FAIL() << "hid what is not there";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("Bonnet"));
    EXPECT_THAT(error.what(), HasSubstr("Sign"));
  }
}

TEST(LoadModel, RefusesEveryBadFileWithItsName) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(PLATELIGHT_SOURCE_DIR "/tests/data/bad")) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".gltf" && extension != ".glb" && extension != ".obj" && extension != ".ply" &&
        extension != ".stl" && extension != ".fbx" && extension != ".x3d")
      continue;
    ++count;
    const std::string refusal = refusal_of(entry.path().string());
    EXPECT_THAT(refusal, HasSubstr(entry.path().filename().string())) << entry.path();
    EXPECT_GT(refusal.size(), entry.path().string().size() + 5) << "no reason: " << refusal;
  }
  EXPECT_GE(count, 12);
}

TEST(LoadModel, ReachesNothingOutsideItsFolder) {
  EXPECT_THAT(refusal_of(bad("texture_outside.gltf")), HasSubstr("outside"));
  EXPECT_THAT(refusal_of(bad("buffer_outside.gltf")), HasSubstr("outside"));
  EXPECT_THAT(refusal_of(bad("texture_url.gltf")), HasSubstr("not a file"));
  const fs::path folder = fs::path(testing::TempDir()) / "platelight_model_link";
  fs::create_directories(folder);
  fs::copy_file(good("quad.obj"), folder / "quad.obj", fs::copy_options::overwrite_existing);
  fs::remove(folder / "quad.mtl");
  fs::create_symlink("/etc/hostname", folder / "quad.mtl");
  EXPECT_THAT(refusal_of((folder / "quad.obj").string()), HasSubstr("outside"));
  fs::remove_all(folder);
}

TEST(LoadModel, SurvivesDamageAnywhere) {
  const std::string path = data_folder() + "/models/ClearCoatCarPaint/ClearCoatCarPaint.glb";
  SKIP_WITHOUT(path);
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  const fs::path folder = fs::path(testing::TempDir()) / "platelight_model_damage";
  fs::create_directories(folder);
  std::uint32_t state = 7;
  const auto random = [&state] { return state = state * 1664525U + 1013904223U; };
  int refused = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::string damaged = bytes;
    if (trial % 3 == 0) damaged.resize(random() % bytes.size());
    for (int k = 0; k < 8 && !damaged.empty(); ++k) {
      const std::size_t reach =
          trial % 2 == 0 ? std::min<std::size_t>(4096, damaged.size()) : damaged.size();
      damaged[random() % reach] = static_cast<char>(random() >> 16);
    }
    const std::string target = (folder / "damaged.glb").string();
    std::ofstream(target, std::ios::binary) << damaged;
    try {
      const LoadedModel model = load_model(target);
      for (const auto& mesh : model.scene.meshes)
        for (const auto& triangle : mesh->triangles)
          for (const std::uint32_t corner : triangle) ASSERT_LT(corner, mesh->positions.size());
    } catch (const std::runtime_error& error) {
      ++refused;
      EXPECT_THAT(error.what(), HasSubstr("damaged.glb"));
    }
  }
  EXPECT_GT(refused, 10);
  fs::remove_all(folder);
}

TEST(LoadModel, TakesClearVolumesForSolidGlass) {
  const auto load = [](const std::string& material) {
    const fs::path path = made::make_temporary_directory() / "glass.gltf";
    std::ofstream(path)
        << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"extensionsUsed":["KHR_materials_transmission","KHR_materials_volume","KHR_materials_ior"],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
"materials":[{"name":"bottle",)"
        << material << "}]}";
    return load_model(path).scene.materials[0];
  };
  const render::Material bottle = load(
      R"("pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0},"extensions":{
"KHR_materials_transmission":{"transmissionFactor":1},"KHR_materials_ior":{"ior":1.45},
"KHR_materials_volume":{"thicknessFactor":0.01,"attenuationDistance":0.02,"attenuationColor":[0.5,1,0.25]}})");
  ASSERT_EQ(bottle.shader, "glass");
  const render::GlassParameters glass = render::glass_parameters(bottle);
  EXPECT_NEAR(glass.index, 1.45F, 1e-6F);
  EXPECT_NEAR(glass.absorption[0], std::log(2.0) / 0.02, 1e-3);
  EXPECT_NEAR(glass.absorption[1], 0, 1e-6);
  EXPECT_LT(glass.shadow[2], glass.shadow[0]);
  // A colour of no stated distance is never reached, in the shadow neither.
  const render::GlassParameters clear = render::glass_parameters(
      load(R"("pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0},"extensions":{
"KHR_materials_transmission":{"transmissionFactor":1},
"KHR_materials_volume":{"thicknessFactor":0.01,"attenuationColor":[0.5,1,0.25]}})"));
  EXPECT_EQ(clear.absorption[2], 0);
  EXPECT_EQ(clear.shadow[2], clear.shadow[1]);
  // Without a volume it is a thin sheet; rough, it is not glass.
  EXPECT_EQ(load(R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":1}})").shader,
            "standard");
  EXPECT_EQ(load(R"("pbrMetallicRoughness":{"roughnessFactor":0.8},"extensions":{
"KHR_materials_transmission":{"transmissionFactor":1},"KHR_materials_volume":{"thicknessFactor":0.01}})")
                .shader,
            "standard");
}

// A sheet of a left and a right half, u being the distance from the seam between them, with a
// normal map.
LoadedModel load_mirrored_sheet(bool normals) {
  const fs::path folder = made::make_temporary_directory();
  fs::copy_file(good("one_texel.png"), folder / "one.png");
  made::GltfMaker maker;
  const int position =
                maker.values<float>(3, {-1, -1, 0, 0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0, -1, 1, 0}),
            normal = maker.values<float>(3, {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}),
            uv = maker.values<float>(2, {1, 1, 0, 1, 1, 1, 1, 0, 0, 0, 1, 0}),
            corners = maker.values<std::uint16_t>(1, {0, 1, 4, 0, 4, 5, 1, 2, 3, 1, 3, 4});
  const std::string path = folder / "sheet.glb";
  std::ofstream(path, std::ios::binary)
      << maker.glb(R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[{"material":0,"indices":)" +
                   std::to_string(corners) + R"(,"attributes":{"POSITION":)" +
                   std::to_string(position) + ",\"TEXCOORD_0\":" + std::to_string(uv) +
                   (normals ? ",\"NORMAL\":" + std::to_string(normal) : "") +
                   R"(}}]}],"materials":[{"normalTexture":{"index":0}}],"textures":[{"source":0}],
"images":[{"uri":"one.png"}])");
  return load_model(path);
}

TEST(LoadModel, KeepsNormalMapsUprightAlongAMirroredSeam) {
  for (const bool normals : {true, false}) {
    const LoadedModel model = load_mirrored_sheet(normals);
    const render::Mesh& mesh = *model.scene.meshes[0];
    ASSERT_EQ(mesh.triangles.size(), 4U);
    ASSERT_EQ(mesh.tangents.size(), mesh.positions.size());
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    EXPECT_EQ(mesh.positions.size(), normals ? 8U : 12U);
    for (const auto& triangle : mesh.triangles) {
      float side = 0;
      for (const std::uint32_t corner : triangle) side += mesh.positions[corner].x;
      side = side > 0 ? 1.0F : -1.0F;
      for (const std::uint32_t corner : triangle) {
        const auto& t = mesh.tangents[corner];
        EXPECT_NEAR(t[0], side, 1e-5);
        EXPECT_EQ(t[3], side) << "v runs down on both sides";
        EXPECT_EQ(mesh.normals[corner], (render::Vec3f{0, 0, 1}));
      }
    }
  }
}

TEST(LoadModel, ReadsTheToyCar) {
  const std::string path = data_folder() + "/models/ToyCar/ToyCar.gltf";
  SKIP_WITHOUT(path);
  EXPECT_EQ(load_model(path).report.triangles, 108936U);
  render::LoadOptions options = hiding("Fabric");
  options.emission_gain = 3;
  const auto start = std::chrono::steady_clock::now();
  const LoadedModel car = load_model(path, options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  RecordProperty("load_ms", static_cast<int>(seconds.count() * 1000));
  EXPECT_THAT(car.report.nodes, testing::ElementsAre("ToyCar", "Fabric", "Glass"));
  // 38.38 x 18.71 x 11.62 mm, the wheels at z = .99 mm.
  EXPECT_NEAR(car.report.upper.y - car.report.lower.y, 0.03838, 2e-5);
  EXPECT_NEAR(car.report.upper.x - car.report.lower.x, 0.01871, 2e-5);
  EXPECT_NEAR(car.report.upper.z - car.report.lower.z, 0.01162, 2e-5);
  EXPECT_NEAR(car.report.lower.z, 0.00099, 2e-5);
  ASSERT_EQ(car.scene.materials.size(), 2U);
  const auto paint = render::standard_parameters(car.scene.materials[0], car.report.textures);
  EXPECT_EQ(paint.clearcoat, 1);
  EXPECT_EQ(paint.metallic, 1);
  EXPECT_EQ(paint.emission_gain, 3);
  EXPECT_GE(paint.normal_texture, 0);
  EXPECT_GE(paint.metallic_roughness_texture, 0);
  EXPECT_GE(paint.clearcoat_texture, 0);
  EXPECT_FALSE(car.scene.meshes[0]->tangents.empty());
  const auto glass = render::standard_parameters(car.scene.materials[1], car.report.textures);
  EXPECT_EQ(glass.transmission, 1);
  EXPECT_NEAR(glass.base_color[1], 0.8, 1e-6);
  for (const auto& n : car.scene.meshes[0]->normals) ASSERT_NEAR(length(n), 1, 1e-4);
}

TEST(LoadModel, ReadsDracoAndHidesParts) {
  const std::string path = data_folder() + "/models/ferrari458/ferrari.glb";
  SKIP_WITHOUT(path);
  const LoadedModel whole = load_model(path);
  EXPECT_NEAR(static_cast<double>(whole.report.triangles), 357909, 1000);
  const LoadedModel bare = load_model(path, hiding("body"));
  EXPECT_LT(bare.report.triangles, whole.report.triangles);
  const std::string truck = data_folder() + "/models/CesiumMilkTruck/CesiumMilkTruck.gltf";
  SKIP_WITHOUT(truck);
  EXPECT_EQ(load_model(truck).scene.instances.size(), 5U) << "two axles of one mesh";
}

TEST(LoadModel, CutsMaskedAlphaAndLetsThinGlassThrough) {
  const std::string path = data_folder() + "/models/TransmissionTest/TransmissionTest.glb";
  SKIP_WITHOUT(path);
  const LoadedModel model = load_model(path);
  int masked = 0;
  int clear = 0;
  for (const auto& material : model.scene.materials) {
    const auto p = render::standard_parameters(material, model.report.textures);
    masked += p.alpha_cutoff > 0 ? 1 : 0;
    clear += p.transmission > 0 ? 1 : 0;
  }
  EXPECT_EQ(masked, 6);
  EXPECT_EQ(clear, 12);
}

}  // namespace
}  // namespace render::load_mesh_test
