// glTF that assimp reads wrongly: read as its standard says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "render/glass.h"
#include "render/load_mesh.h"
#include "render/standard.h"
#include "render/transform.h"
#include "tests/made_files.h"
#include "tests/made_gltf.h"

namespace render::gltf_mend_test {
namespace {

using made::GltfMaker;
using testing::Contains, testing::ElementsAre, testing::HasSubstr, testing::IsEmpty;
using namespace std::string_literals;

class GltfMendTest : public testing::Test {
 protected:
  void SetUp() override { dir_ = made::make_temporary_directory(); }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  LoadedModel load(const std::string& glb) const {
    const std::string path = (dir_ / "a.glb").string();
    std::ofstream(path, std::ios::binary) << glb;
    return load_model(path);
  }
  std::string refusal_of(const std::string& glb) const {
    try {
      load(glb);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path dir_;
};

std::string text(int number) { return std::to_string(number); }

// A mesh of one triangle with these attributes.
std::string triangle(const std::string& attributes, const std::string& more = "") {
  return R"("meshes":[{"primitives":[{"attributes":{)" + attributes + "}" + more + "}]}]";
}
std::string of_mesh(const std::string& attributes, const std::string& more = "") {
  return R"("nodes":[{"name":"part","mesh":0}],)" + triangle(attributes, more);
}

const std::vector<float> corners{0, 0, 0, 1, 0, 0, 0, 0, 1};  // x, y, z; y is up

// Where the corners of an instance stand in the set.
std::vector<Vec3f> places(const LoadedModel& model, std::size_t index = 0) {
  const Instance& instance = model.scene.instances.at(index);
  std::vector<Vec3f> all;
  for (const Vec3f p : model.scene.meshes[instance.mesh]->positions) {
    all.push_back(transform_point(instance.set_from_object, p));
  }
  return all;
}
testing::Matcher<Vec3f> near(Vec3f expected) {
  return testing::ResultOf([expected](Vec3f p) { return length(p - expected); },
                           testing::Lt(1e-5F));
}

TEST_F(GltfMendTest, TakesQuantizedVerticesForWhatTheyMean) {
  GltfMaker maker;
  const int position = maker.values<std::int16_t>(3, {0, 0, 0, 32767, 0, 0, 0, 0, -32768},
                                                  R"(,"normalized":true)", 8);
  const int normal =
      maker.values<std::int8_t>(3, {0, 127, 0, 0, 127, 0, 0, 127, 0}, R"(,"normalized":true)", 4);
  const int shorts =
      maker.values<std::uint16_t>(2, {0, 0, 65535, 0, 13107, 65535}, R"(,"normalized":true)");
  const int bytes =
      maker.values<std::uint8_t>(2, {0, 0, 255, 0, 51, 255}, R"(,"normalized":true)", 4);
  for (const int uv : {shorts, bytes}) {
    const LoadedModel model =
        load(maker.glb(R"("extensionsRequired":["KHR_mesh_quantization"],)" +
                       of_mesh("\"POSITION\":" + text(position) + ",\"NORMAL\":" + text(normal) +
                               ",\"TEXCOORD_0\":" + text(uv))));
    EXPECT_THAT(places(model), ElementsAre(near({0, 0, 0}), near({1, 0, 0}), near({0, 1, 0})));
    const Mesh& mesh = *model.scene.meshes[0];
    EXPECT_THAT(mesh.normals, testing::Each(near({0, 1, 0})));
    ASSERT_EQ(mesh.uvs.size(), 3U);
    EXPECT_NEAR(mesh.uvs[1][0], 1, 1e-5);
    EXPECT_NEAR(mesh.uvs[2][0], 0.2, 1e-5);
    EXPECT_NEAR(mesh.uvs[2][1], 1, 1e-5);
    EXPECT_THAT(model.report.notes, IsEmpty());
  }
}

TEST_F(GltfMendTest, TakesIntegersThatAreNotNormalizedAsTheyAre) {
  GltfMaker maker;
  const int position = maker.values<std::uint16_t>(3, {0, 0, 0, 16383, 0, 0, 0, 0, 300}, "", 8);
  const LoadedModel model = load(maker.glb(of_mesh("\"POSITION\":" + text(position))));
  EXPECT_THAT(places(model), ElementsAre(near({0, 0, 0}), near({16383, 0, 0}), near({0, -300, 0})));
}

TEST_F(GltfMendTest, PutsSparseValuesIntoInterleavedOnes) {
  GltfMaker maker;
  const int places_view = maker.view("\2\0"s),
            values_view = maker.view(made::bytes_of(std::vector<float>{0, 0, 5}));
  const auto sparse = [&](int count) {
    return R"(,"sparse":{"count":)" + text(count) + R"(,"indices":{"bufferView":)" +
           text(places_view) + R"(,"componentType":5123},"values":{"bufferView":)" +
           text(values_view) + "}}";
  };
  const int position = maker.values<float>(3, corners, sparse(1), 24);
  const LoadedModel model = load(maker.glb(of_mesh("\"POSITION\":" + text(position))));
  EXPECT_THAT(places(model), ElementsAre(near({0, 0, 0}), near({1, 0, 0}), near({0, -5, 0})));
  for (const int count : {2, 4, 1000000000}) {
    const int wrong = maker.values<float>(3, corners, sparse(count), 24);
    EXPECT_NE(refusal_of(maker.glb(of_mesh("\"POSITION\":" + text(wrong)))), "") << count;
  }
}

TEST_F(GltfMendTest, TakesTheCoordinatesThatATextureTransformNames) {
  GltfMaker maker;
  const int position = maker.values<float>(3, corners),
            first = maker.values<float>(2, {0, 0, 0, 0, 0, 0}),
            second = maker.values<float>(2, {0, 0, 1, 0, 0.25F, 0.5F});
  std::filesystem::copy_file(made::bad_files().parent_path() / "one_texel.png", dir_ / "one.png");
  const LoadedModel model =
      load(maker.glb(of_mesh("\"POSITION\":" + text(position) + ",\"TEXCOORD_0\":" + text(first) +
                                 ",\"TEXCOORD_1\":" + text(second),
                             ",\"material\":0") +
                     R"(,"extensionsUsed":["KHR_texture_transform"],"textures":[{"source":0}],
"images":[{"uri":"one.png"}],"materials":[{"emissiveTexture":{"index":0,
"extensions":{"KHR_texture_transform":{"texCoord":1}}}}])"));
  ASSERT_EQ(model.scene.meshes[0]->uvs.size(), 3U);
  EXPECT_EQ(model.scene.meshes[0]->uvs[2][0], 0.25F);
  EXPECT_EQ(model.scene.meshes[0]->uvs[2][1], 0.5F);
}

TEST_F(GltfMendTest, GlowsByFactorTimesStrength) {
  GltfMaker maker;
  const int position = maker.values<float>(3, corners);
  const auto emission = [&](const std::string& factor, const std::string& strength) {
    const LoadedModel model = load(maker.glb(
        of_mesh("\"POSITION\":" + text(position), ",\"material\":0") +
        R"(,"extensionsUsed":["KHR_materials_emissive_strength"],
"extensionsRequired":["KHR_materials_emissive_strength"],"materials":[{)" +
        factor + R"("extensions":{"KHR_materials_emissive_strength":{)" + strength + "}}}]"));
    EXPECT_THAT(model.report.notes, IsEmpty());
    const StandardParameters p = standard_parameters(model.scene.materials.at(0), 0);
    return std::array{p.emission[0] * p.emission_gain, p.emission[1] * p.emission_gain,
                      p.emission[2] * p.emission_gain};
  };
  const std::string orange = R"("emissiveFactor":[1,0.5,0],)";
  EXPECT_THAT(emission(orange, ""), ElementsAre(1, 0.5F, 0));
  EXPECT_THAT(emission(orange, "\"emissiveStrength\":1"), ElementsAre(1, 0.5F, 0));
  EXPECT_THAT(emission(orange, "\"emissiveStrength\":20"), ElementsAre(20, 10, 0));
  EXPECT_THAT(emission(orange, "\"emissiveStrength\":-1"), ElementsAre(0, 0, 0));
  EXPECT_THAT(emission("", "\"emissiveStrength\":20"), ElementsAre(0, 0, 0));
  EXPECT_THROW(emission(orange, "\"emissiveStrength\":\"20\""), std::runtime_error);
}

TEST_F(GltfMendTest, DispersesByAbbesNumberInSolidGlass) {
  GltfMaker maker;
  const int position = maker.values<float>(3, corners);
  const auto load_glass = [&](const std::string& dispersion) {
    const std::string glass = R"("pbrMetallicRoughness":{"roughnessFactor":0},"extensions":{
"KHR_materials_transmission":{"transmissionFactor":1},"KHR_materials_volume":{"thicknessFactor":1})";
    // Of two, so that it tells whose it is.
    return load(maker.glb(R"("nodes":[{"mesh":0,"children":[1]},{"mesh":1}],)"
                          R"("meshes":[{"primitives":[{"material":1,"attributes":{"POSITION":)" +
                          text(position) +
                          R"(}}]},{"primitives":[{"material":0,"attributes":{"POSITION":)" +
                          text(position) + R"(}}]}],
"extensionsUsed":["KHR_materials_transmission","KHR_materials_volume","KHR_materials_dispersion"],
"materials":[{"name":"plain",)" +
                          glass + R"(}},{"name":"prism",)" + glass +
                          R"(,"KHR_materials_dispersion":{"dispersion":)" + dispersion + "}}}]"));
  };
  const auto abbe = [&](const std::string& dispersion) {
    for (const Material& material : load_glass(dispersion).scene.materials) {
      const float own = glass_parameters(material).abbe;
      if (material.name == "prism") return own;
      EXPECT_EQ(material.name, "plain");
      EXPECT_EQ(own, 0);
    }
    return -1.0F;
  };
  EXPECT_EQ(abbe("0"), 0);
  EXPECT_EQ(abbe("-0.5"), 0);
  EXPECT_NEAR(abbe("0.33"), 60.6, 0.01);
  EXPECT_EQ(abbe("2"), 10);
  EXPECT_THAT(load_glass("4").report.notes, IsEmpty());
  EXPECT_EQ(abbe("1e300"), 5);
  EXPECT_THAT(load_glass("5").report.notes, ElementsAre(HasSubstr("'prism': it disperses")));
  EXPECT_EQ(abbe("1e-9"), 10000);
  EXPECT_THROW(abbe("\"strong\""), std::runtime_error);
}

TEST_F(GltfMendTest, MorphsByTheWeightsOfMeshAndNode) {
  GltfMaker maker;
  const int position = maker.values<float>(3, corners),
            rise = maker.values<float>(3, {0, 2, 0, 0, 2, 0, 0, 2, 0}),
            slide = maker.values<std::int8_t>(3, {4, 0, 0, 4, 0, 0, 4, 0, 0}, "", 4);
  const LoadedModel model = load(maker.glb(
      R"("nodes":[{"children":[1,2,3]},{"mesh":0},{"mesh":0,"weights":[0,1]},
{"mesh":0,"weights":[0,0]}],"meshes":[{"weights":[0.5,0],"primitives":[{"attributes":{"POSITION":)" +
      text(position) + R"(},"targets":[{"POSITION":)" + text(rise) + R"(},{"POSITION":)" +
      text(slide) + "}]}]}]"));
  ASSERT_EQ(model.scene.instances.size(), 3U);
  EXPECT_THAT(places(model, 0), ElementsAre(near({0, 0, 1}), near({1, 0, 1}), near({0, -1, 1})));
  EXPECT_THAT(places(model, 1), ElementsAre(near({4, 0, 0}), near({5, 0, 0}), near({4, -1, 0})));
  EXPECT_THAT(places(model, 2), ElementsAre(near({0, 0, 0}), near({1, 0, 0}), near({0, -1, 0})));
  EXPECT_THAT(model.report.notes, IsEmpty());
}

TEST_F(GltfMendTest, BendsSkinsToTheJointsAsTheyStand) {
  GltfMaker maker;
  const int position = maker.values<float>(3, {0, 0, 0, 100, 0, 0, 0, 0, 100}),
            normal = maker.values<float>(3, {0, 1, 0, 0, 1, 0, 0, 1, 0}),
            joints = maker.values<std::uint8_t>(4, {0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}),
            weights = maker.values<std::uint8_t>(4, {102, 153, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0},
                                                 R"(,"normalized":true)"),
            // The second joint was bound 100 to the right.
      bound = maker.values<float>(16, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,    0, 0, 1,
                                       1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -100, 0, 0, 1});
  // The mesh's own node does nothing; the joints stand in a frame of centimetres, the second one
  // turned by a right angle about x: z goes to -y, y to z.
  const auto file = [&](int second) {
    return maker.glb(
        R"("nodes":[{"children":[1,2]},{"name":"body","mesh":0,"skin":0,"translation":[7,8,9]},
{"scale":[0.01,0.01,0.01],"children":[3,4]},{},{"translation":[0,10,0],"rotation":[1,0,0,1]}],
"skins":[{"joints":[3,)" +
        text(second) + R"(],"inverseBindMatrices":)" + text(bound) + "}]," +
        triangle("\"POSITION\":" + text(position) + ",\"NORMAL\":" + text(normal) +
                 ",\"JOINTS_0\":" + text(joints) + ",\"WEIGHTS_0\":" + text(weights)));
  };
  const LoadedModel model = load(file(4));
  ASSERT_EQ(model.scene.instances.size(), 1U);
  EXPECT_EQ(model.scene.instances[0].name, "body");
  // In the file: (-0.6, 0.06, 0), (0, 0.1, 0), (-1, 0.1 - 1, 0).
  EXPECT_THAT(places(model),
              ElementsAre(near({-0.6F, 0, 0.06F}), near({0, 0, 0.1F}), near({-1, 0, -0.9F})));
  EXPECT_THAT(model.scene.meshes[0]->normals[1], near({0, 0, 1}));
  EXPECT_THAT(model.report.notes, IsEmpty());
  EXPECT_THAT(refusal_of(file(9)), HasSubstr("a joint that is not there"));
}

TEST_F(GltfMendTest, ShowsEveryInstanceOfANode) {
  GltfMaker maker;
  const int position = maker.values<float>(3, corners),
            shift = maker.values<float>(3, {-2, 0, 0, 2, 0, 0}),
            turn = maker.values<std::int16_t>(4, {0, 0, 0, 32767, 0, 32767, 0, 0},
                                              R"(,"normalized":true)");
  const auto file = [&](int of_turns) {
    return maker.glb(R"("extensionsUsed":["EXT_mesh_gpu_instancing"],
"nodes":[{"name":"tree","mesh":0,"scale":[0.5,0.5,0.5],"extensions":
{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":)" +
                     text(shift) + ",\"ROTATION\":" + text(of_turns) + "}}}}]," +
                     triangle("\"POSITION\":" + text(position)));
  };
  const LoadedModel model = load(file(turn));
  ASSERT_EQ(model.scene.instances.size(), 2U);
  EXPECT_THAT(places(model, 0),
              ElementsAre(near({-1, 0, 0}), near({-0.5F, 0, 0}), near({-1, -0.5F, 0})));
  EXPECT_THAT(places(model, 1),
              ElementsAre(near({1, 0, 0}), near({0.5F, 0, 0}), near({1, 0.5F, 0})));
  EXPECT_THAT(model.report.nodes, ElementsAre("tree 0", "tree 1"));
  EXPECT_THAT(model.report.notes, IsEmpty());
  EXPECT_THAT(refusal_of(file(position)), HasSubstr("its instances"));
}

TEST_F(GltfMendTest, HidesWhatTheFileHides) {
  GltfMaker maker;
  const int position = maker.values<float>(3, corners);
  const LoadedModel model = load(maker.glb(
      R"("extensionsUsed":["KHR_node_visibility"],"nodes":[{"name":"shown","mesh":0,"children":[1]},
{"name":"hidden","mesh":1,"children":[2],"extensions":{"KHR_node_visibility":{"visible":false}}},
{"name":"below","mesh":1}],"meshes":[{"primitives":[{"attributes":{"POSITION":)" +
      text(position) + R"(}}]},{"primitives":[{"attributes":{"POSITION":)" + text(position) +
      "}}]}]"));
  EXPECT_EQ(model.report.triangles, 1U);
  EXPECT_THAT(model.report.nodes, ElementsAre("shown"));
}

TEST_F(GltfMendTest, NotesEveryExtensionThatIsNotShown) {
  GltfMaker maker;
  const int position = maker.values<float>(3, corners);
  const auto notes = [&](const std::string& used, const std::string& material) {
    return load(maker.glb(of_mesh("\"POSITION\":" + text(position), ",\"material\":0") +
                          R"(,"extensionsUsed":[)" + used + "],\"materials\":[" + material + "]"))
        .report.notes;
  };
  EXPECT_THAT(
      notes(R"("KHR_materials_diffuse_transmission","X_of_tomorrow",
"KHR_materials_clearcoat","KHR_xmp","KHR_xmp_json_ld")",
            "{}"),
      ElementsAre("KHR_materials_diffuse_transmission is left out", "X_of_tomorrow is left out"));
  const std::string index = R"("KHR_materials_ior":{"ior":1.3})";
  EXPECT_THAT(notes(R"("KHR_materials_dispersion")",
                    R"({"extensions":{"KHR_materials_dispersion":{"dispersion":0.4}}})"),
              ElementsAre(HasSubstr("KHR_materials_dispersion is left out")));
  EXPECT_THAT(notes(R"("KHR_materials_ior")", "{\"extensions\":{" + index + "}}"),
              ElementsAre(HasSubstr("KHR_materials_ior is left out")));
  EXPECT_THAT(notes(R"("KHR_materials_ior","KHR_materials_volume","KHR_materials_transmission")",
                    R"({"pbrMetallicRoughness":{"roughnessFactor":0},"extensions":{
"KHR_materials_transmission":{"transmissionFactor":1},"KHR_materials_volume":{"thicknessFactor":1},)" +
                        index + "}}"),
              IsEmpty());
  EXPECT_THAT(notes(R"("KHR_materials_ior","KHR_materials_volume","KHR_materials_transmission")",
                    R"({"pbrMetallicRoughness":{"roughnessFactor":0},"extensions":{
"KHR_materials_transmission":{"transmissionFactor":1},"KHR_materials_volume":{},)" +
                        index + "}}"),
              ElementsAre(HasSubstr("KHR_materials_ior is left out")));
}

// Tens of thousands of parts, as assemblies have: in a time that grows as their number.
TEST_F(GltfMendTest, ReadsManyParts) {
  GltfMaker maker;
  const std::string position = text(maker.values<float>(3, corners));
  constexpr int count = 30'000;
  std::string parts, children;
  for (int i = 1; i <= count; ++i) {
    parts += ",{\"mesh\":0,\"translation\":[" + text(i) + ",0,0]}";
    children += (i > 1 ? "," : "") + text(i);
  }
  const LoadedModel model = load(maker.glb("\"nodes\":[{\"children\":[" + children + "]}" + parts +
                                           "]," + triangle("\"POSITION\":" + position)));
  EXPECT_EQ(model.report.triangles, std::size_t{count});
}

TEST_F(GltfMendTest, RefusesBuffersThatHoldLessThanTheFileSays) {
  GltfMaker maker;
  const int position = maker.values<std::uint16_t>(3, {0, 0, 0, 1, 0, 0, 0, 0, 1}, "", 8);
  std::string file = maker.glb(of_mesh("\"POSITION\":" + text(position)));
  file.resize(file.size() - 8);
  const auto length = static_cast<std::uint32_t>(file.size());
  file.replace(8, 4, reinterpret_cast<const char*>(&length), 4);
  EXPECT_THAT(refusal_of(file), HasSubstr("beyond its buffer"));
}

}  // namespace
}  // namespace render::gltf_mend_test
