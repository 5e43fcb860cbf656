// Damaged and hostile models: refused with file and reason, in bounded memory and time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "render/load_mesh.h"
#include "render/scene.h"
#include "render/standard.h"
#include "tests/made_files.h"
#include "tests/made_model_bytes.h"

namespace render::model_faults_test {
namespace {

namespace fs = std::filesystem;
using made::GlbParts, made::make_glb, made::put;
using testing::HasSubstr;
using namespace std::string_literals;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

struct File {
  std::string name;
  std::string bytes;
  std::string reason = {};  // words of the refusal
};

std::string write(const fs::path& folder, const File& file) {
  const fs::path path = folder / file.name;
  std::ofstream(path, std::ios::binary) << file.bytes;
  return path.string();
}

// What load_model says against a file, after its path; "" if it loads.
std::string refusal_of(const std::string& path) {
  try {
    load_model(path);
    return "";
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    EXPECT_TRUE(what.starts_with(path)) << what;
    return what.substr(std::min(what.size(), path.size()));
  }
}

// Peak memory of all helper programs that have ended, megabytes.
long helpers_peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  return usage.ru_maxrss / 1024;
}

#ifdef __SANITIZE_ADDRESS__
constexpr long most_mb = 1024;  // what it has freed is kept for a while
#else
constexpr long most_mb = 256;
#endif

// Expects every file to be refused with its reason, its reader taking little memory.
void expect_refused(const std::vector<File>& files) {
  const fs::path folder = made::make_temporary_directory();
  for (const File& file : files) {
    SCOPED_TRACE(file.name + ", " + file.reason);
    EXPECT_THAT(refusal_of(write(folder, file)), HasSubstr(file.reason));
    EXPECT_LT(helpers_peak_mb(), most_mb);
  }
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

std::vector<File> with_apex(const std::vector<float>& apex, const std::string& reason) {
  GlbParts parts;
  std::copy(apex.begin(), apex.end(), parts.positions.begin() + 6);
  const std::string point =
      made::number(apex[0]) + " " + made::number(apex[1]) + " " + made::number(apex[2]);
  return {{"a.glb", make_glb(parts), reason},
          {"a.stl", made::stl(apex), reason},
          {"text.stl",
           "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex " + point +
               "\nendloop\nendfacet\nendsolid a\n",
           reason},
          {"a.ply", made::ascii_ply(apex), reason},
          {"b.ply", made::binary_ply(apex), reason},
          {"a.obj", made::obj(apex), reason},
          {"a.x3d", made::x3d_triangle("0 1 2 -1", "0 0 0 1 0 0 " + point), reason}};
}

TEST(ModelFaults, SoundFilesOfTheseAreRead) {
  const fs::path folder = made::make_temporary_directory();
  for (const File& file : with_apex({0, 1, 0}, "")) {
    EXPECT_EQ(refusal_of(write(folder, file)), "") << file.name;
  }
}

TEST(ModelFaults, RefusesPositionsThatAreNotFiniteOrTooFar) {
  expect_refused(with_apex({nan, 1, 0}, "no triangles"));
  expect_refused(with_apex({0, infinity, 0}, "no triangles"));
  std::vector<File> far = with_apex({0, 3e15F, 0}, "no triangles");
  expect_refused(far);
  expect_refused(with_apex({0, 3e10F, 0}, "farther away"));
}

TEST(ModelFaults, RefusesPlacesThatAreNoNumbers) {
  GlbParts parts;
  parts.positions = {0, 0, 0, 10, 1, 10, 20, -3, 20};  // of x, infinity less infinity
  std::string file = make_glb(parts);
  const std::string node = R"("name":"part")", placed = R"("name":"part","matrix":
[1e38,0,0,0,0,1,0,0,-1e38,0,0.1,0,0,0,0,1])";
  const std::size_t length = file.find("BIN\0"s) - 4 - 20;
  file = made::glb(file.substr(20, length).replace(file.find(node) - 20, node.size(), placed),
                   file.substr(file.find("BIN\0"s) + 4));
  expect_refused({{"a.glb", file, "farther away"}});
}

TEST(ModelFaults, LeavesOutTrianglesThatAreNotFiniteAndSaysSo) {
  const fs::path folder = made::make_temporary_directory();
  const LoadedModel model = load_model(
      write(folder, {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n"}));
  EXPECT_EQ(model.report.triangles, 1U);
  EXPECT_THAT(model.report.notes, testing::Contains(HasSubstr("1 triangles with positions")));
  EXPECT_EQ(model.report.upper, (Vec3f{1, 0, 1}));
}

TEST(ModelFaults, MendsNormalsAndTextureCoordinates) {
  const fs::path folder = made::make_temporary_directory();
  GlbParts parts;
  parts.normals = {nan, 0, 1, 0, 0, 0, infinity, 1, 0};
  parts.uvs = {nan, 0, 1e30F, 0, 0.5F, 0.5F};
  parts.material = R"({"normalTexture":{"index":0}})";
  parts.more = R"(,"textures":[{"source":0}],"images":[{"uri":"one.png"}])";
  fs::copy_file(made::bad_files().parent_path() / "one_texel.png", folder / "one.png");
  for (const bool one_point : {false, true}) {
    if (one_point) parts.uvs.assign(6, 0.25F);
    const LoadedModel model = load_model(write(folder, {"a.glb", make_glb(parts)}));
    const Mesh& mesh = *model.scene.meshes.at(0);
    for (const Vec3f& n : mesh.normals) EXPECT_NEAR(length(n), 1, 1e-5);
    for (const auto& [u, v] : mesh.uvs) EXPECT_TRUE(std::abs(u) <= 1 && std::abs(v) <= 1);
    ASSERT_EQ(mesh.tangents.size(), 3U);
    for (const auto& t : mesh.tangents) EXPECT_NEAR(length(Vec3f{t[0], t[1], t[2]}), 1, 1e-5);
    EXPECT_NO_THROW(Scene{model.scene});
  }
}

TEST(ModelFaults, RefusesEmptyAndSenselessFiles) {
  std::vector<File> files;
  for (const char* ending : {"glb", "gltf", "obj", "ply", "stl", "fbx", "x3d"}) {
    files.push_back({"empty."s + ending, "", "the file is empty"});
    files.push_back({"zeros."s + ending, std::string(1000, '\0'), ": "});
    files.push_back({"lines."s + ending, std::string(100000, '\n'), ": "});
  }
  expect_refused(files);
}

TEST(ModelFaults, RefusesTruncatedFiles) {
  std::vector<File> files = with_apex({0, 1, 0}, "");
  for (File& file : files) {
    file.reason = ": ";
    if (file.name == "a.glb") file.reason = "truncated";
    if (file.name == "a.stl") file.reason = "cut short";
    if (file.name.ends_with(".ply")) file.reason = "cut short: it ends at row";
    const std::size_t size = file.bytes.size();
    file.bytes.resize(file.name == "a.obj"      ? file.bytes.find('f')
                      : file.name == "text.stl" ? size / 2
                      : file.name == "a.ply"    ? size - 5
                      : file.name == "b.ply"    ? size - 2
                                                : size * 3 / 4);
  }
  expect_refused(files);
}

TEST(ModelFaults, RefusesIndicesOutOfRange) {
  GlbParts parts;
  parts.indices = {0, 1, 77};
  expect_refused({{"a.glb", make_glb(parts), ": "},
                  {"b.ply", made::binary_ply({0, 1, 0}, 77), "out of range"},
                  {"c.ply", made::binary_ply({0, 1, 0}, ~0U), "out of range"},
                  {"d.ply", made::ply_head("3", "1", "ascii") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 77\n",
                   "out of range"},
                  {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 77\n", "out of range"},
                  {"b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -77\n", ": "},
                  {"a.x3d", made::x3d_triangle("0 1 77 -1", "0 0 0 1 0 0 0 1 0"), "out of range"}});
}

std::string claiming(const std::string& accessor, std::uint64_t bytes) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"componentType":5126,"type":"VEC3",)" +
         accessor + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + std::to_string(bytes) +
         R"(}],"buffers":[{"byteLength":)" + std::to_string(bytes) + R"(,"uri":"b.bin"}]})";
}

TEST(ModelFaults, RefusesClaimsOfMoreThanThereIs) {
  const std::string little = "binary_little_endian";
  std::string fbx = "Kaydara FBX Binary  \0\x1a\0"s;
  // A node that ends beyond the file, of one array of a thousand million doubles.
  for (const std::uint32_t word : {7400U, 1000000000U, 1U, 1000U}) put(fbx, word);
  fbx += "\4Noded";
  for (const std::uint32_t word : {1000000000U, 0U, 1000000000U}) put(fbx, word);
  expect_refused(
      {{"a.ply", made::ply_head("1000000000", "1", "ascii") + "0 0 0\n", "cut short"},
       {"b.ply", made::ply_head("4000000000", "1", little) + "abc", "cut short"},
       {"c.ply", made::ply_head("99999999999999999999", "1", little) + "abc", "whole number"},
       {"d.ply", made::ply_head("0", "1000000000", little) + "abc", "cut short"},
       {"e.ply",
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list uint float x\n"
        "end_header\n\xff\xff\xff\x7f",
        "cut short"},
       {"a.stl", made::stl({0, 1, 0}, 1000000000), "1000000000 triangles"},
       {"b.stl", made::stl({0, 1, 0}, ~0U), "triangles"},
       {"a.gltf", claiming(R"("bufferView":0,"count":1000000000)", 12000000000), "2 GB"},
       {"b.gltf", claiming(R"("bufferView":0,"count":100000000)", 1200000000), ": "},
       {"c.gltf", claiming(R"("bufferView":0,"count":1000000)", 36), "beyond"},
       {"d.gltf", claiming(R"("count":100000000)", 36), ": "},
       {"a.fbx", fbx, "out of range"},
       {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf" + repeated(" 1 2 3", 200000) + "\n", "too many"},
       {"a.x3d", made::x3d_triangle("0 1 1000000000 -1", "0 0 0 1 0 0 0 1 0"), "out of range"}});
}

TEST(ModelFaults, RefusesFormsThatAreNotRead) {
  GlbParts parts;
  const std::string glb = make_glb(parts);
  const std::string json = claiming(R"("bufferView":0,"count":3)", 36);
  std::string first = json;
  first.replace(first.find("2.0"), 3, "1.0");
  expect_refused({{"a.gltf", glb, "let it end in .glb"},
                  {"a.glb", json, "let it end in .gltf"},
                  {"b.gltf", first, "it is glTF 1.0, of which only version 2 is read"},
                  {"a.ply",
                   "ply\nformat ascii 1.0\nelement label 1\nproperty int x\nelement vertex 3\n"
                   "property float x\nproperty float y\nproperty float z\nelement face 1\n"
                   "property list uchar int vertex_indices\nend_header\n7\n0 0 0\n1 0 0\n0 1 0\n"
                   "3 0 1 2\n",
                   "'label' stands before its vertices"}});
}

TEST(ModelFaults, RefusesNestingAndCycles) {
  GlbParts nested;
  nested.more = ",\"x\":" + std::string(100000, '[') + std::string(100000, ']');
  // Thirty groups, each holding the one before it twice: a thousand million triangles.
  std::string doubling =
      "<Group DEF='g0'><Shape><IndexedFaceSet coordIndex='0 1 2 -1'>"
      "<Coordinate point='0 0 0 1 0 0 0 1 0'/></IndexedFaceSet></Shape></Group>";
  for (int i = 1; i <= 30; ++i) {
    const std::string use = "<Group USE='g" + std::to_string(i - 1) + "'/>";
    doubling += "<Group DEF='g" + std::to_string(i) + "'>" + use + use + "</Group>";
  }
  expect_refused(
      {{"a.glb", make_glb(nested), "nested too deeply"},
       {"a.x3d", made::x3d(repeated("<Group>", 50000) + repeated("</Group>", 50000)), ": "},
       {"b.x3d", made::x3d("<Group DEF='a'><Group USE='a'/></Group>"), made::crashed_helper},
       {"c.x3d", made::x3d(doubling), "damaged"},
       {"a.fbx", "; FBX 7.4.0 project file\n" + repeated("A: {\n", 100000), made::crashed_helper}});
}

// A buffer inside of it may be megabytes: what is wrong is told in a line.
TEST(ModelFaults, TellsOfATruncatedGltfShortly) {
  const fs::path folder = made::make_temporary_directory();
  const std::string path =
      write(folder, {"a.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"uri":"data:,)" +
                                   repeated("\u00e4\u00c4", 20000)});
  try {
    load_model(path);
    FAIL() << "read";
  } catch (const std::exception& error) {
    const std::string why = error.what();
    EXPECT_NE(why.find("a.gltf: its JSON is damaged"), std::string::npos) << why;
    EXPECT_LT(why.size(), path.size() + 300);
  }
}

// One instance of `material`, with texture `uri` in each of its maps.
LoadedModel with_texture(const fs::path& folder, const std::string& uri) {
  GlbParts parts;
  parts.material = R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],
"baseColorTexture":{"index":0},"metallicRoughnessTexture":{"index":0},"metallicFactor":0.25,
"roughnessFactor":0.75},"normalTexture":{"index":0},"emissiveTexture":{"index":0},
"emissiveFactor":[1,1,1]})";
  parts.more = R"(,"textures":[{"source":0}],"images":[{"uri":")" + uri + "\"}]";
  return load_model(write(folder, {"a.glb", make_glb(parts)}));
}

TEST(ModelFaults, PutsMagentaInThePlaceOfLostTextures) {
  const fs::path folder = made::make_temporary_directory();
  for (const char* picture :
       {"picture_of_gigabytes.png", "side_of_a_million.png", "truncated.jpg", "empty.png"}) {
    fs::copy_file(made::bad_files() / picture, folder / picture);
  }
  for (const std::string picture :
       {"missing.png", "picture_of_gigabytes.png", "side_of_a_million.png", "truncated.jpg",
        "empty.png", "a.glb"}) {
    SCOPED_TRACE(picture);
    const LoadedModel model = with_texture(folder, picture);
    EXPECT_TRUE(model.scene.textures.empty());
    EXPECT_EQ(model.report.textures, 0U);
    const StandardParameters p = standard_parameters(model.scene.materials.at(0), 0);
    EXPECT_THAT(p.base_color, testing::ElementsAre(1, 0, 1));
    EXPECT_THAT(p.emission, testing::ElementsAre(0, 0, 0));
    EXPECT_EQ(p.metallic, 0.25F);
    EXPECT_EQ(p.roughness, 0.75F);
    EXPECT_EQ(p.normal_texture, -1);
    for (const std::string instead : {"magenta", "left out"}) {
      EXPECT_THAT(model.report.notes, testing::Contains(testing::AllOf(
                                          HasSubstr("'" + picture + "'"), HasSubstr(instead))));
    }
  }
}

TEST(ModelFaults, KeepsTheTexturesBesideALostOne) {
  const fs::path folder = made::make_temporary_directory();
  fs::copy_file(made::bad_files().parent_path() / "one_texel.png", folder / "one.png");
  GlbParts parts;
  parts.material =
      R"({"normalTexture":{"index":0},"pbrMetallicRoughness":{"baseColorTexture":{"index":1}}})";
  parts.more =
      R"(,"textures":[{"source":0},{"source":1}],"images":[{"uri":"lost.png"},{"uri":"one.png"}])";
  const LoadedModel model = load_model(write(folder, {"a.glb", make_glb(parts)}));
  ASSERT_EQ(model.scene.textures.size(), 1U);
  const StandardParameters p = standard_parameters(model.scene.materials.at(0), 1);
  EXPECT_EQ(p.base_color_texture, 0);
  EXPECT_EQ(p.normal_texture, -1);
}

TEST(ModelFaults, LeavesOutALostMapOfTheCoat) {
  const fs::path folder = made::make_temporary_directory();
  fs::copy_file(made::bad_files().parent_path() / "one_texel.png", folder / "one.png");
  for (const bool lost : {true, false}) {
    GlbParts parts;
    parts.material = R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}},
"extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":1,"clearcoatRoughnessFactor":0.5,
"clearcoatRoughnessTexture":{"index":1}}}})";
    parts.more = R"(,"extensionsUsed":["KHR_materials_clearcoat"],
"textures":[{"source":0},{"source":1}],"images":[{"uri":")" +
                 (lost ? "one.png\"},{\"uri\":\"lost.png"s : "lost.png\"},{\"uri\":\"one.png"s) +
                 "\"}]";
    const LoadedModel model = load_model(write(folder, {"a.glb", make_glb(parts)}));
    ASSERT_EQ(model.scene.textures.size(), 1U);
    const StandardParameters p = standard_parameters(model.scene.materials.at(0), 1);
    EXPECT_EQ(p.clearcoat_roughness_texture, lost ? -1 : 0);
    EXPECT_EQ(p.base_color_texture, lost ? 0 : -1);
    EXPECT_THAT(model.report.notes, testing::Contains(HasSubstr(lost ? "left out" : "magenta")));
  }
}

TEST(ModelFaults, RefusesTexturesThatTogetherTakeTooMuch) {
  const fs::path folder = made::make_temporary_directory();
  GlbParts parts;
  parts.material = "";
  std::string textures, images;
  for (int i = 0; i < 16; ++i) {
    const std::string comma = i > 0 ? "," : "", name = "t" + std::to_string(i) + ".png";
    // Nothing but a header, of 9000 x 9000 pixels.
    write(folder, {name, "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x23\x28\0\0\x23\x28\x8\x6\0\0\0"s});
    textures += comma + R"({"source":)" + std::to_string(i) + "}";
    images += comma + R"({"uri":")" + name + "\"}";
    parts.material += comma + R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":)" +
                      std::to_string(i) + "}}}";
  }
  // One primitive a material.
  parts.more = ",\"textures\":[" + textures + "],\"images\":[" + images + "]";
  std::string file = make_glb(parts);
  const std::string primitive = R"({"attributes":
{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2},"indices":3,"material":0})";
  std::string primitives;
  for (int i = 0; i < 16; ++i) {
    primitives +=
        (i > 0 ? "," : "") + primitive.substr(0, primitive.size() - 2) + std::to_string(i) + "}";
  }
  const std::size_t at = file.find(primitive);
  file.replace(at, primitive.size(), primitives);
  const auto grown = static_cast<std::uint32_t>(primitives.size() - primitive.size());
  const std::uint32_t padding = (4 - grown % 4) % 4;
  file.insert(file.find("BIN\0"s) - 4, std::string(padding, ' '));
  for (const std::size_t word : {std::size_t{8}, std::size_t{12}}) {
    std::uint32_t length = 0;
    std::memcpy(&length, &file[word], 4);
    length += grown + padding;
    std::memcpy(&file[word], &length, 4);
  }
  EXPECT_THAT(refusal_of(write(folder, {"a.glb", file})), HasSubstr("more than 4 GB"));
}

}  // namespace
}  // namespace render::model_faults_test
