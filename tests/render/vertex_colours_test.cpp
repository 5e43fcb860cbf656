// Colours of vertices: read from every format that has them, and shown.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "capture/colour.h"
#include "render/join_vertices.h"
#include "render/load_shape.h"
#include "render/scene.h"
#include "render/srgb_codes.h"
#include "render/standard.h"
#include "render/trace.h"
#include "tests/made_fbx.h"
#include "tests/made_model_bytes.h"
#include "tests/render/made_materials.h"

namespace render::vertex_colours_test {
namespace {

using Codes = std::array<std::uint8_t, 3>;
using testing::Contains, testing::ElementsAre, testing::HasSubstr, testing::IsEmpty, testing::Not;

constexpr Codes red{200, 10, 0}, green{0, 128, 60}, blue{5, 0, 255};

// The colour of each corner of a model's first mesh, in the order of its triangles.
std::vector<Codes> by_corners(const LoadedModel& model) {
  const Mesh& mesh = *model.scene.meshes.at(0);
  std::vector<Codes> found;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) found.push_back(mesh.colours.at(corner));
  }
  return found;
}

LoadedModel load(const std::string& name, const std::string& bytes) {
  return load_model(write(made_folder("a") / name, bytes));
}

// A triangle whose colours are `bytes`, of that glTF type, `stride` bytes from one to the next.
std::string gltf(int component, const char* type, std::size_t stride, const std::string& bytes) {
  const std::string binary = made::bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}) + bytes;
  return made::glb(
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1},"material":0}]}],
"materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,1,1,1]}}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],
"max":[1,1,0]},{"bufferView":1,"componentType":)" +
          std::to_string(component) + R"(,"count":3,"normalized":)" +
          (component == 5126 ? "false" : "true") + R"(,"type":")" + type +
          R"("}],"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,
"byteLength":)" +
          std::to_string(bytes.size()) + R"(,"byteStride":)" + std::to_string(stride) +
          R"(}],"buffers":[{"byteLength":)" + std::to_string(binary.size()) + "}]}",
      binary);
}

TEST(VertexColours, OfGltfAreLinearInAnyOfItsTypes) {
  const std::array<std::array<double, 4>, 3> light{
      {{1, 0, 0.5, 1}, {0.25, 1, 0, 1}, {0, 0.5, 1, 1}}};
  const auto wanted = [&](std::size_t vertex) {
    Codes codes;
    for (std::size_t c = 0; c < 3; ++c) {
      const double code = capture::encode(capture::Transfer::srgb, light[vertex][c]);
      codes[c] = static_cast<std::uint8_t>(std::lround(255 * code));
    }
    return codes;
  };
  const auto bytes_of = [&]<class T>(std::size_t components, std::size_t stride, T one) {
    std::string bytes;
    for (const auto& vertex : light) {
      for (std::size_t c = 0; c < components; ++c) {
        const double value = vertex[c] * static_cast<double>(one);
        made::put(bytes, static_cast<T>(one > 1 ? std::round(value) : value));
      }
      bytes.resize((bytes.size() + stride - 1) / stride * stride);
    }
    return bytes;
  };
  const std::uint8_t byte = 255;
  const std::uint16_t word = 65535;
  for (const std::string& file :
       {gltf(5126, "VEC3", 12, bytes_of(3, 12, 1.0F)),
        gltf(5126, "VEC4", 16, bytes_of(4, 16, 1.0F)), gltf(5121, "VEC3", 4, bytes_of(3, 4, byte)),
        gltf(5121, "VEC4", 4, bytes_of(4, 4, byte)), gltf(5123, "VEC3", 8, bytes_of(3, 8, word)),
        gltf(5123, "VEC4", 8, bytes_of(4, 8, word))}) {
    const LoadedModel model = load("a.glb", file);
    EXPECT_EQ(parameters_of(model).base_color[0], 0.5F) << "the material's own colour stays";
    const std::vector<Codes> found = by_corners(model);
    ASSERT_EQ(found.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[i][c], wanted(i)[c], 1) << i << c;
    }
  }
}

TEST(VertexColours, OfPlyAreCodesAndTakeThePlaceOfTheGrey) {
  const std::string places[] = {"0 0 0", "1 0 0", "0 1 0"};
  const std::string codes[] = {"200 10 0", "0 128 60", "5 0 255"};
  std::string file =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 3; ++i) file += places[i] + " " + codes[i] + "\n";
  const LoadedModel model = load("a.ply", file + "3 0 1 2\n");
  EXPECT_THAT(by_corners(model), ElementsAre(red, green, blue));
  EXPECT_THAT(parameters_of(model).base_color, ElementsAre(1, 1, 1));
  EXPECT_THAT(notes_of(model), Not(Contains(HasSubstr("colours"))));
}

TEST(VertexColours, OfObjStandBehindThePlaces) {
  const LoadedModel model = load("a.obj",
                                 "v 0 0 0 0.784314 0.0392157 0\nv 1 0 0 0 0.501961 0.235294\n"
                                 "v 0 1 0 0.0196078 0 1\nf 1 2 3\n");
  EXPECT_THAT(by_corners(model), ElementsAre(red, green, blue));
  EXPECT_THAT(parameters_of(model).base_color, ElementsAre(1, 1, 1));
  EXPECT_THAT(load("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").scene.meshes.at(0)->colours,
              IsEmpty());
}

// assimp gives them to the vertices that come first.
TEST(VertexColours, OfSomeVerticesOfAnObjAreLeftOut) {
  const LoadedModel model = load("a.obj",
                                 "o plain\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
                                 "o red\nv 0 0 1 1 0 0\nv 1 0 1 1 0 0\nv 0 1 1 1 0 0\nf 4 5 6\n");
  for (const auto& mesh : model.scene.meshes) EXPECT_THAT(mesh->colours, IsEmpty());
  EXPECT_THAT(parameters_of(model).base_color, testing::Each(0.6F));
  EXPECT_THAT(notes_of(model), Contains(HasSubstr("not all of its vertices have one")));
}

TEST(VertexColours, ThatAreAllBlackAreLeftOut) {
  const LoadedModel model =
      load("a.glb", gltf(5126, "VEC3", 12, made::bytes_of(std::vector<float>(9, 0))));
  EXPECT_THAT(model.scene.meshes.at(0)->colours, IsEmpty());
  EXPECT_THAT(notes_of(model), ElementsAre(HasSubstr("all black")));
}

TEST(VertexColours, OfX3dAreLinearAndTakeThePlaceOfTheMaterials) {
  const LoadedModel model =
      load("a.x3d", made::x3d("<Shape><Appearance><Material diffuseColor=\".1 .2 .3\"/>"
                              "</Appearance><IndexedFaceSet coordIndex=\"0 1 2 -1\" "
                              "colorPerVertex=\"true\"><Coordinate point=\"0 0 0 1 0 0 0 1 0\"/>"
                              "<Color color=\"1 0 0 0 1 0 0 0.214041 1\"/>"
                              "</IndexedFaceSet></Shape>"));
  EXPECT_THAT(by_corners(model),
              ElementsAre(Codes{255, 0, 0}, Codes{0, 255, 0}, Codes{0, 128, 255}));
  EXPECT_THAT(parameters_of(model).base_color, ElementsAre(1, 1, 1));
}

Mesh coloured_triangle() {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.normals.assign(3, {0, 0, 1});
  mesh.uvs = {{0, 0}, {1, 0}, {0, 1}};
  mesh.triangles = {{0, 1, 2}};
  mesh.colours = {red, green, blue};
  mesh.materials = {0};
  return mesh;
}

TEST(VertexColours, OfFbxAreCodesThatTintTheMaterial) {
  const LoadedModel model =
      load("a.fbx", made::made_fbx({{"part", coloured_triangle(), {0.5, 0.5, 1}, ""}}));
  EXPECT_THAT(by_corners(model), ElementsAre(red, green, blue));
  EXPECT_THAT(parameters_of(model).base_color, ElementsAre(0.5F, 0.5F, 1));
}

// A binary STL with colours of facets, five bits each, as VisCAM and SolidView write them.
TEST(VertexColours, OfStlAreThoseOfItsFacets) {
  std::string file(80, ' ');
  made::put(file, std::uint32_t{2});
  for (const auto& [x, colour] : {std::pair(0.0F, 0xFC00), {2.0F, 0x801F}}) {
    for (const float value : {0.F, 0.F, 1.F, x, 0.F, 0.F, x + 1, 0.F, 0.F, x, 1.F, 0.F}) {
      made::put(file, value);
    }
    made::put(file, static_cast<std::uint16_t>(colour));
  }
  const LoadedModel model = load("a.stl", file);
  EXPECT_THAT(parameters_of(model).base_color, ElementsAre(1, 1, 1));
  const std::vector<Codes> found = by_corners(model);
  ASSERT_EQ(found.size(), 6U);
  for (std::size_t corner = 0; corner < 3; ++corner) {
    EXPECT_EQ(found[corner], (Codes{255, 0, 0}));
    EXPECT_EQ(found[3 + corner], (Codes{0, 0, 255}));
  }
}

// And second texture coordinates, where a mesh without normals becomes flat, and at the seam of
// what a normal map has mirrored.
TEST(VertexColours, StayWhereVerticesAreParted) {
  const std::string square =
      made::bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) +
      made::bytes_of(std::vector<float>{0, 0, 1, 0, 1, 1, 2, 0}) +  // the second one is mirrored
      made::bytes_of(std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1}) +
      made::bytes_of(std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3}) +
      made::bytes_of(std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  const auto file = [&](const std::string& normals) {
    return made::glb(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1,
"TEXCOORD_1":1,"COLOR_0":2)" +
                         normals + R"(},"indices":3,"material":0}]}],
"materials":[{"normalTexture":{"index":0},
"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1}}}],
"images":[{"uri":"a.png"}],"textures":[{"source":0}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],
"max":[1,1,0]},{"bufferView":0,"byteOffset":48,"componentType":5126,"count":4,"type":"VEC2"},
{"bufferView":0,"byteOffset":80,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":0,"byteOffset":128,"componentType":5125,"count":6,"type":"SCALAR"},
{"bufferView":0,"byteOffset":152,"componentType":5126,"count":4,"type":"VEC3"}],
"bufferViews":[{"buffer":0,"byteLength":200}],"buffers":[{"byteLength":200}]})",
                     square);
  };
  const Codes r{255, 0, 0}, g{0, 255, 0}, b{0, 0, 255}, white{255, 255, 255};
  for (const bool smooth : {false, true}) {
    const LoadedModel model = load("a.glb", file(smooth ? R"(,"NORMAL":4)" : ""));
    EXPECT_THAT(by_corners(model), ElementsAre(r, g, b, r, b, white));
    const Mesh& mesh = *model.scene.meshes.at(0);
    EXPECT_EQ(mesh.positions.size(), 6U) << "two of them have twins, or all are apart";
    EXPECT_EQ(mesh.colours.size(), 6U);
    EXPECT_EQ(mesh.second_uvs, mesh.uvs);
  }
}

TEST(VertexColours, KeepApartWhatIsNotOfOneColour) {
  Mesh mesh = coloured_triangle();
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {1, 0, 0}, {0, -1, 0}};
  mesh.normals.assign(6, {0, 0, 1});
  mesh.uvs.clear();
  mesh.second_uvs = {{0, 0}, {1, 0}, {0, 1}, {0, 0}, {1, 0}, {0, 1}};
  mesh.colours = {red, green, blue, red, blue, blue};
  mesh.triangles = {{0, 1, 2}, {3, 5, 4}};
  join_vertices(mesh);
  EXPECT_EQ(mesh.positions.size(), 5U) << "one is shared, and one place has two colours";
  ASSERT_EQ(mesh.colours.size(), 5U);
  EXPECT_EQ(mesh.second_uvs.size(), 5U);
  EXPECT_EQ(mesh.colours[mesh.triangles[0][1]], green);
  EXPECT_EQ(mesh.colours[mesh.triangles[1][2]], blue);
}

// ... and second coordinates grow as their corners say.
TEST(VertexColours, TintTheBaseColourByTheirLight) {
  StandardParameters parameters;
  parameters.base_color[1] = 0.5F;
  SceneDescription description;
  auto mesh = std::make_shared<Mesh>(coloured_triangle());
  mesh->second_uvs = {{0, 0}, {2, 0}, {0, 4}};
  description.meshes.push_back(mesh);
  description.materials.push_back(make_standard_material("m", parameters));
  description.instances.emplace_back().mesh = 0;
  const Scene scene(parse_scene(serialize(description)));
  for (const auto& [x, y] : {std::pair(0.25F, 0.25F), {0.7F, 0.1F}, {0.02F, 0.9F}}) {
    const auto hit = closest_hit(scene, {x, y, 1}, {0, 0, -1}, 0, ~0U, RayKind::camera);
    ASSERT_TRUE(hit);
    const HitPoint point =
        scene.hit_point(hit->geom_id, hit->prim_id, hit->inst_id, hit->u, hit->v, {0, 0, -1});
    ASSERT_TRUE(point.has_second_uvs);
    EXPECT_NEAR(point.second_uv[0], 2 * x, 1e-5F);
    EXPECT_NEAR(point.second_uv[1], 4 * y, 1e-5F);
    EXPECT_NEAR(length(point.second_u_slope - Vec3f{2, 0, 0}), 0, 1e-5F);
    EXPECT_NEAR(length(point.second_v_slope - Vec3f{0, 4, 0}), 0, 1e-5F);
    const Vec3f base = standard_surface(parameters, description, point).base;
    const auto wanted = [&](std::size_t c) {
      const auto light = [&](const Codes& codes) {
        return capture::decode(capture::Transfer::srgb, codes[c] / 255.0);
      };
      return light(red) * static_cast<double>(1 - x - y) + light(green) * static_cast<double>(x) +
             light(blue) * static_cast<double>(y);
    };
    EXPECT_NEAR(base.x, wanted(0), 1e-4);
    EXPECT_NEAR(base.y, 0.5 * wanted(1), 1e-4);
    EXPECT_NEAR(base.z, wanted(2), 1e-4);
  }
}

TEST(VertexColours, StayOnShapesThatDeform) {
  const auto file = [](const char* height) {
    return "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 " + std::string(height) + " 0 0 1\nf 1 2 3\n";
  };
  const std::string first = write(made_folder() / "a0.obj", file("0"));
  const LoadedModel model = load_deforming_model(first, {}, {});
  const Mesh& mesh = *model.scene.meshes.at(0);
  EXPECT_THAT(mesh.colours, ElementsAre(Codes{255, 0, 0}, Codes{0, 255, 0}, Codes{0, 0, 255}));
  MeshShape shape{mesh.positions, mesh.normals, mesh.tangents};
  EXPECT_EQ(in_shape(mesh, shape)->colours, mesh.colours);
}

TEST(VertexColours, OfLightAndBackAreTheSameCodes) {
  for (int code = 0; code < 256; ++code) {
    const auto c = static_cast<std::uint8_t>(code);
    EXPECT_EQ(codes_of_light(light_of_codes({c, c, c})), (Codes{c, c, c}));
  }
  const float nan = std::nanf("");
  EXPECT_EQ(codes_of_light({-1, 7, nan}), (Codes{0, 255, 0}));
}

}  // namespace
}  // namespace render::vertex_colours_test
