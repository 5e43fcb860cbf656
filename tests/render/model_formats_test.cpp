// One model in every format: the same triangles, places, materials.
#include <assimp/material.h>
#include <assimp/mesh.h>
#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <assimp/Exporter.hpp>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "render/load_mesh.h"
#include "render/made_headlight.h"
#include "render/made_model_file.h"
#include "render/made_shapes.h"
#include "render/standard.h"
#include "tests/made_fbx.h"
#include "tests/made_files.h"
#include "tests/made_model_bytes.h"

namespace render::model_formats_test {
namespace {

namespace fs = std::filesystem;
using testing::Contains, testing::HasSubstr;

// A box from (0, 0, 0) to (1, 2, 3), painted with a picture, and a green wedge before its face of
// low x: no two axes can be taken for one another.
constexpr std::array<float, 3> box_size{1, 2, 3};

void add_quad(Mesh& mesh, Vec3f corner, Vec3f along, Vec3f up) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const Vec3f normal = normalize(cross(along, up));
  for (const auto& [u, v] : {std::array{0.F, 0.F}, {1.F, 0.F}, {1.F, 1.F}, {0.F, 1.F}}) {
    mesh.positions.push_back(corner + along * u + up * v);
    mesh.normals.push_back(normal);
    mesh.uvs.push_back({u, 1 - v});
  }
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

Mesh made_box() {
  const Vec3f x{box_size[0], 0, 0}, y{0, box_size[1], 0}, z{0, 0, box_size[2]};
  Mesh box;
  add_quad(box, {}, y, x), add_quad(box, z, x, y);
  add_quad(box, {}, x, z), add_quad(box, y, z, x);
  add_quad(box, {}, z, y), add_quad(box, x, y, z);
  box.materials = {0};
  return box;
}

Mesh made_wedge() {
  Mesh wedge;
  add_quad(wedge, {-0.5F, 0.5F, 0.25F}, {0, 1, 0}, {0.25F, 0, 1});
  wedge.materials = {1};
  return wedge;
}

aiMesh* library_mesh(const Mesh& mesh, const std::string& name) {
  auto result = std::make_unique<aiMesh>();
  result->mName = name;
  result->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  result->mMaterialIndex = mesh.materials[0];
  result->mNumVertices = static_cast<unsigned>(mesh.positions.size());
  result->mVertices = new aiVector3D[mesh.positions.size()];
  result->mNormals = new aiVector3D[mesh.positions.size()];
  result->mTextureCoords[0] = new aiVector3D[mesh.positions.size()];
  result->mNumUVComponents[0] = 2;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3f p = mesh.positions[i], n = mesh.normals[i];
    result->mVertices[i] = {p.x, p.y, p.z};
    result->mNormals[i] = {n.x, n.y, n.z};
    result->mTextureCoords[0][i] = {mesh.uvs[i][0], 1 - mesh.uvs[i][1], 0};
  }
  result->mNumFaces = static_cast<unsigned>(mesh.triangles.size());
  result->mFaces = new aiFace[mesh.triangles.size()];
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    result->mFaces[t].mNumIndices = 3;
    result->mFaces[t].mIndices =
        new unsigned[3]{mesh.triangles[t][0], mesh.triangles[t][1], mesh.triangles[t][2]};
  }
  return result.release();
}

aiMaterial* library_material(const char* name, aiColor3D colour, const char* picture) {
  auto material = std::make_unique<aiMaterial>();
  const aiString text(name);
  material->AddProperty(&text, AI_MATKEY_NAME);
  material->AddProperty(&colour, 1, AI_MATKEY_COLOR_DIFFUSE);
  const aiColor4D with_alpha(colour.r, colour.g, colour.b, 1);
  material->AddProperty(&with_alpha, 1, AI_MATKEY_BASE_COLOR);
  if (picture != nullptr) {
    const aiString file(picture);
    material->AddProperty(&file, AI_MATKEY_TEXTURE_DIFFUSE(0));
    material->AddProperty(&file, AI_MATKEY_TEXTURE(aiTextureType_BASE_COLOR, 0));
  }
  return material.release();
}

// The scene in a file of the library's format `id`, or of ours.
std::string export_scene(const fs::path& folder, const std::string& id, const std::string& name) {
  fs::copy_file(made::bad_files().parent_path() / "one_texel.png", folder / "paint.png",
                fs::copy_options::overwrite_existing);
  const std::string path = folder / name;
  if (id == "made_fbx") {
    std::ofstream(path, std::ios::binary)
        << made::made_fbx({{"box", made_box(), {1, 1, 1}, "paint.png"},
                           {"wedge", made_wedge(), {0.25, 0.75, 0.5}, ""}});
    return path;
  }
  aiScene scene;
  scene.mNumMeshes = 2;
  scene.mMeshes =
      new aiMesh* [2] { library_mesh(made_box(), "box"), library_mesh(made_wedge(), "wedge") };
  scene.mNumMaterials = 2;
  scene.mMaterials = new aiMaterial* [2] {
    library_material("paint", {1, 1, 1}, "paint.png"),
        library_material("leaf", {0.25F, 0.75F, 0.5F}, nullptr)
  };
  scene.mRootNode = new aiNode("root");
  for (unsigned i = 0; i < 2; ++i) {
    auto* node = new aiNode(i == 0 ? "box" : "wedge");
    node->mNumMeshes = 1;
    node->mMeshes = new unsigned[1]{i};
    scene.mRootNode->addChildren(1, &node);
  }
  Assimp::Exporter exporter;
  EXPECT_EQ(exporter.Export(&scene, id, path), aiReturn_SUCCESS) << exporter.GetErrorString();
  return path;
}

struct FormatCase {
  const char* id;  // the exporter's
  const char* file;
  bool y_up;
  bool materials;  // it carries them
  bool textures;
  float scale = 1;  // metres per unit
};

constexpr FormatCase formats[] = {
    {"gltf2", "a.gltf", true, true, true},      {"glb2", "a.glb", true, true, true},
    {"obj", "a.obj", true, true, true},         {"made_fbx", "a.fbx", true, true, true, 0.01F},
    {"fbxa", "b.fbx", true, true, true, 0.01F}, {"x3d", "a.x3d", true, true, true},
    {"ply", "a.ply", false, false, false},      {"plyb", "b.ply", false, false, false},
    {"stl", "a.stl", false, false, false},      {"stlb", "b.stl", false, false, false},
};

class EveryFormat : public testing::TestWithParam<FormatCase> {};

Vec3f placed(const Instance& instance, Vec3f p) {
  const auto& m = instance.set_from_object;
  return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
          m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
}

TEST_P(EveryFormat, KeepsTrianglesBoundsAxesAndMaterials) {
  const FormatCase format = GetParam();
  const std::string path = export_scene(made::make_temporary_directory(), format.id, format.file);
  const LoadedModel model = load_model(path);
  const LoadReport& report = model.report;
  std::string notes;
  for (const auto& note : report.notes) notes += note + "\n";
  SCOPED_TRACE(notes);
  EXPECT_EQ(report.triangles, 14U);
  EXPECT_EQ(report.vertices, 28U);
  const float s = format.scale;
  // From -.5, 0, 0 to 1, 2, 3 in the file's axes.
  const Vec3f lower = format.y_up ? Vec3f{-0.5F, -3, 0} : Vec3f{-0.5F, 0, 0};
  const Vec3f upper = format.y_up ? Vec3f{1, 0, 2} : Vec3f{1, 2, 3};
  EXPECT_LT(length(report.lower - lower * s), 1e-5F) << report.lower.y;
  EXPECT_LT(length(report.upper - upper * s), 1e-5F) << report.upper.y;

  // Every side of the box looks away from its middle.
  const Vec3f middle = format.y_up ? Vec3f{0.5F, -1.5F, 1} * s : Vec3f{0.5F, 1, 1.5F} * s;
  int sides = 0;
  for (const Instance& instance : model.scene.instances) {
    const Mesh& mesh = *model.scene.meshes[instance.mesh];
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    for (const auto& triangle : mesh.triangles) {
      std::array<Vec3f, 3> p;
      for (std::size_t k = 0; k < 3; ++k) p[k] = placed(instance, mesh.positions[triangle[k]]);
      const Vec3f face = cross(p[1] - p[0], p[2] - p[0]);
      const Vec3f out = (p[0] + p[1] + p[2]) * (1.0F / 3) - middle;
      if (p[0].x < 0 || p[1].x < 0 || p[2].x < 0) continue;  // the wedge
      ++sides;
      EXPECT_GT(dot(face, out), 0);
      const Vec3f tip = placed(instance, mesh.positions[triangle[0]] + mesh.normals[triangle[0]]);
      EXPECT_GT(dot(tip - p[0], face), 0);
    }
  }
  EXPECT_EQ(sides, 12);

  if (!format.materials) return;
  EXPECT_EQ(report.materials, 2U);
  EXPECT_EQ(report.textures, format.textures ? 1U : 0U);
  int painted = 0, green = 0;
  for (const Material& material : model.scene.materials) {
    const StandardParameters p = standard_parameters(material, report.textures);
    if (p.base_color_texture >= 0) ++painted;
    const float* c = p.base_color;
    if (std::abs(c[0] - 0.25F) < 1e-3F && std::abs(c[1] - 0.75F) < 1e-3F &&
        std::abs(c[2] - 0.5F) < 1e-3F) {
      ++green;
    }
  }
  EXPECT_EQ(painted, format.textures ? 1 : 0);
  EXPECT_EQ(green, 1);
  // The picture stands upright: where the file's box has u, v so has ours, v counted down.
  for (const Instance& instance : model.scene.instances) {
    const Mesh& mesh = *model.scene.meshes[instance.mesh];
    const auto p = standard_parameters(model.scene.materials[mesh.materials[0]], report.textures);
    if (p.base_color_texture < 0) continue;
    const Mesh box = made_box();
    ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
    std::size_t met = 0;
    for (std::size_t i = 0; i < box.positions.size(); ++i) {
      const Vec3f b = box.positions[i];
      const Vec3f expected = Vec3f{b.x, -b.z, b.y} * s;
      for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
        const Vec3f q = placed(instance, mesh.positions[k]);
        met += length(q - expected) < 1e-4F * s &&
                       std::abs(mesh.uvs[k][0] - box.uvs[i][0]) < 1e-4F &&
                       std::abs(mesh.uvs[k][1] - box.uvs[i][1]) < 1e-4F
                   ? 1
                   : 0;
      }
    }
    EXPECT_GE(met, 24U);
  }
}

INSTANTIATE_TEST_SUITE_P(LoadModel,
                         EveryFormat,
                         testing::ValuesIn(formats),
                         [](const auto& format) { return std::string(format.param.id); });

TEST(LoadModel, ReadsTheMadeHeadlightBackFromGlb) {
  const SceneDescription headlight = make_headlight();
  const std::string path = made::make_temporary_directory() / "headlight.glb";
  write_glb(path, headlight);
  const LoadedModel model = load_model(path);
  EXPECT_EQ(model.report.triangles, triangle_count(headlight));
  ASSERT_EQ(model.scene.instances.size(), headlight.instances.size());
  for (std::size_t i = 0; i < headlight.instances.size(); ++i) {
    const Instance &before = headlight.instances[i], &after = model.scene.instances[i];
    EXPECT_EQ(after.name, before.name);
    const Mesh &a = *headlight.meshes[before.mesh], &b = *model.scene.meshes[after.mesh];
    ASSERT_EQ(a.triangles, b.triangles);
    for (std::size_t k = 0; k < a.positions.size(); k += 97) {
      EXPECT_LT(length(placed(before, a.positions[k]) - placed(after, b.positions[k])), 1e-6F);
    }
    EXPECT_EQ(headlight.materials[a.materials[0]].shader,
              model.scene.materials[b.materials[0]].shader);
  }
}

TEST(LoadModel, ReadsTheMadeHeadlightBackFromPly) {
  const SceneDescription headlight = make_headlight();
  const std::string path = made::make_temporary_directory() / "headlight.ply";
  write_ply(path, headlight);
  const LoadReport report = load_model(path).report;
  EXPECT_EQ(report.triangles, triangle_count(headlight));
}

class FormatsTest : public testing::Test {
 protected:
  void SetUp() override { folder_ = made::make_temporary_directory(); }
  void TearDown() override { fs::remove_all(folder_); }

  LoadedModel load(const std::string& name, const std::string& bytes) const {
    const std::string path = folder_ / name;
    std::ofstream(path, std::ios::binary) << bytes;
    return load_model(path);
  }
  std::vector<std::string> notes(const std::string& name, const std::string& bytes) const {
    return load(name, bytes).report.notes;
  }

  fs::path folder_;
};

TEST_F(FormatsTest, TurnsFbxByTheAxesThatItStates) {
  struct Case {
    int up, up_sign, front, front_sign, right, right_sign;
    Vec3f corner;  // where (1, 2, 3) comes to stand
  };
  for (const Case& c : {Case{1, 1, 2, 1, 0, 1, {1, -3, 2}},
                        {2, 1, 1, -1, 0, 1, {1, 2, 3}},
                        {1, 1, 2, -1, 0, -1, {-1, 3, 2}},
                        {0, 1, 2, 1, 1, -1, {-2, -3, 1}},
                        // Left-handed: only what is up counts.
                        {0, 1, 2, 1, 1, 1, {2, 3, 1}},
                        {1, -1, 2, 1, 0, 1, {1, 3, -2}},
                        {2, -1, 1, -1, 0, 1, {1, -2, -3}},
                        {1, 1, 1, 1, 7, 1, {1, -3, 2}}}) {
    std::string settings;
    const auto state = [&](const std::string& name, int value) {
      settings += "P: \"" + name + "\", \"int\", \"Integer\", \"\"," + std::to_string(value) + "\n";
    };
    state("UpAxis", c.up), state("UpAxisSign", c.up_sign);
    state("FrontAxis", c.front), state("FrontAxisSign", c.front_sign);
    state("CoordAxis", c.right), state("CoordAxisSign", c.right_sign);
    SCOPED_TRACE(settings);
    const LoadedModel model = load("a.fbx", made::ascii_fbx(settings));
    const Instance& instance = model.scene.instances.at(0);
    float nearest = 1;
    for (const Vec3f p : model.scene.meshes[0]->positions) {
      nearest = std::min(nearest, length(placed(instance, p) - c.corner));
    }
    EXPECT_LT(nearest, 1e-5F);
  }
}

TEST_F(FormatsTest, TellsWhatOfAnFbxIsNotShownAsItSays) {
  EXPECT_THAT(notes("a.fbx", made::ascii_fbx("")), testing::IsEmpty());
  const std::string visible = R"(P: "Visibility", "Visibility", "", "A",)",
                    show = R"(P: "Show", "bool", "", "",)";
  EXPECT_THAT(notes("a.fbx", made::ascii_fbx("", visible + "1\n" + show + "1\n")),
              testing::IsEmpty());
  EXPECT_THAT(notes("a.fbx", made::ascii_fbx("", visible + "0\n")),
              Contains(HasSubstr("Visibility is shown")));
  EXPECT_THAT(notes("a.fbx", made::ascii_fbx("", show + "0\n")),
              Contains(HasSubstr("node 'part': the file hides it")));
  for (const double visibility : {0., 1.}) {
    EXPECT_THAT(notes("a.fbx", made::made_fbx({{"box", made_box(), {1, 1, 1}, "", visibility}})),
                testing::Contains(HasSubstr("Visibility is shown")).Times(visibility == 0 ? 1 : 0));
  }
  EXPECT_THAT(notes("a.fbx", made::ascii_fbx("", "", R"(Geometry: 60, "Geometry::sh", "Shape" {
Version: 100
Indexes: *1 {
a: 2
}
Vertices: *3 {
a: 0,1,0
}
Normals: *3 {
a: 0,0,0
}
}
Deformer: 61, "Deformer::bs", "BlendShape" {
Version: 100
}
Deformer: 62, "SubDeformer::ch", "BlendShapeChannel" {
Version: 100
DeformPercent: 100
FullWeights: *1 {
a: 100
}
}
)",
                                             R"(C: "OO",60,62
C: "OO",62,61
C: "OO",61,1
)")),
              Contains(HasSubstr("morph targets are left out")));
  EXPECT_THAT(notes("a.fbx", made::ascii_fbx("", "", R"(AnimationStack: 70, "AnimStack::Take", "" {
}
AnimationLayer: 71, "AnimLayer::Base", "" {
}
AnimationCurveNode: 72, "AnimCurveNode::T", "" {
Properties70:  {
P: "d|X", "Number", "", "A",1
}
}
AnimationCurve: 73, "AnimCurve::", "" {
KeyVer: 4008
KeyTime: *2 {
a: 0,46186158000
}
KeyValueFloat: *2 {
a: 1,1
}
}
)",
                                             R"(C: "OO",71,70
C: "OO",72,71
C: "OP",72,2, "Lcl Translation"
C: "OP",73,72, "d|X"
)")),
              Contains("animations are left out"));
}

TEST_F(FormatsTest, TellsWhatOfAPlyIsNotShownAsItSays) {
  const auto ply = [](const std::string& faces, const std::string& rows) {
    return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
           "property float z\nelement " +
           faces + "\nend_header\n0 0 0\n1 0 0\n0 1 0\n" + rows;
  };
  const std::string corners = "face 1\nproperty list uchar int vertex_indices";
  EXPECT_THAT(notes("a.ply", ply(corners, "3 0 1 2\n")), testing::IsEmpty());
  EXPECT_THAT(notes("a.ply", ply(corners + "\nproperty list uchar float texcoord",
                                 "3 0 1 2 6 0 0 1 0 0 1\n")),
              Contains(HasSubstr("texture coordinates of faces")));
  EXPECT_THAT(notes("a.ply", ply(corners + "\nproperty uchar red\nproperty uchar green\n"
                                           "property uchar blue",
                                 "3 0 1 2 255 0 0\n")),
              Contains("colours of faces are left out"));
  try {
    load("a.ply", ply("tristrips 1\nproperty list int int vertex_indices", "3 0 1 2\n"));
    FAIL() << "strips were taken for polygons";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("triangle strips, which are not read"));
  }
}

TEST_F(FormatsTest, TellsWhatOfAnX3dIsLeftOut) {
  const std::string shape =
      "<Shape><IndexedFaceSet coordIndex='0 1 2 -1'><Coordinate point='0 0 0 1 0 0 0 1 0'/>"
      "</IndexedFaceSet></Shape>";
  EXPECT_THAT(notes("a.x3d", made::x3d("<!-- <Inline/> -->" + shape)), testing::IsEmpty());
  for (const std::string inlined :
       {"<Inline url='\"b.x3d\" \"c>.x3d\"'/>", "<Inline url='b.x3d'><MetadataSet/></Inline>"}) {
    const LoadedModel model = load("a.x3d", made::x3d(inlined + shape));
    EXPECT_EQ(model.report.triangles, 1U);
    EXPECT_THAT(model.report.notes, testing::ElementsAre(HasSubstr("Inline nodes")));
  }
  EXPECT_THAT(
      notes("a.x3d", made::x3d("<ProtoDeclare name='P'><ProtoBody>" + shape +
                               "</ProtoBody></ProtoDeclare><ProtoInstance name='P'/>" + shape)),
      testing::ElementsAre(HasSubstr("(ProtoInstance) are left out")));
}

TEST_F(FormatsTest, TellsWhatAssimpPassesOverInAnX3d) {
  const std::string shape =
      "<Shape><IndexedFaceSet coordIndex='0 1 2 -1'><Coordinate point='0 0 0 1 0 0 0 1 0'/>"
      "</IndexedFaceSet></Shape>";
  EXPECT_THAT(notes("a.x3d", made::x3d("<LOD>" + shape + "</LOD>" + shape)),
              testing::ElementsAre("what is below LOD nodes is left out"));
  const auto with_unit = [&](const std::string& unit) {
    std::string file = made::x3d(shape);
    return notes("a.x3d", file.insert(file.find("<Scene"), "<head>" + unit + "</head>"));
  };
  EXPECT_THAT(with_unit("<unit category='angle' conversionFactor='1'/>"), testing::IsEmpty());
  EXPECT_THAT(with_unit("<unit category='length' conversionFactor='.001'/>"),
              testing::ElementsAre(HasSubstr("set the object's scale")));
}

// All of the bytes that a file's data may begin with.
TEST_F(FormatsTest, ReadsBinaryPlyWhateverItsFirstByteIs) {
  for (const char first : {'\n', '\r', ' ', '\0', 'e'}) {
    std::string file =
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
        "property float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n";
    const std::array<float, 9> places{1, 0, 0, 1, 1, 0, 0, 1, 0};
    const std::size_t begin = file.size();
    file.append(reinterpret_cast<const char*>(places.data()), sizeof places);
    file[begin] = file[begin + 1] = first;  // 1, but for its last bits
    const std::array<std::int32_t, 3> corners{0, 1, 2};
    file.push_back(3);
    file.append(reinterpret_cast<const char*>(corners.data()), sizeof corners);
    const LoadedModel model = load("a.ply", file);
    EXPECT_EQ(model.report.triangles, 1U) << int{first};
    EXPECT_NEAR(model.report.upper.x, 1, 0.01F);
    EXPECT_EQ(model.scene.meshes.at(0)->positions.size(), 3U);
  }
}

TEST_F(FormatsTest, ReadsAsciiStlInCapitalsAndBehindBlanks) {
  const std::string words =
      "solid part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
      "endloop\nendfacet\nendsolid part\n";
  std::string capitals = words;
  for (char& c : capitals) c = static_cast<char>(std::toupper(c));
  for (const std::string& file :
       {words, " \n" + words, "\xEF\xBB\xBF" + words, capitals, "\t" + capitals}) {
    EXPECT_EQ(load("a.stl", file).report.triangles, 1U) << file.substr(0, 10);
  }
}

TEST_F(FormatsTest, PaintsGreyWhatTellsNoColour) {
  const auto base = [](const LoadedModel& model) {
    return standard_parameters(model.scene.materials.at(0), model.scene.textures.size())
        .base_color[0];
  };
  const std::string ply =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\n";
  const std::string rows = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", head = "ply\nformat ascii 1.0\n";
  EXPECT_EQ(base(load("a.ply", head + ply + "end_header\n" + rows)), 0.6F);
  EXPECT_EQ(base(load("a.stl", made::stl({0, 0, 1}))), 0.6F);
  const std::string material =
      "element material 1\nproperty uchar diffuse_red\nproperty uchar diffuse_green\n"
      "property uchar diffuse_blue\n";
  EXPECT_EQ(base(load("a.ply", head + ply + material + "end_header\n" + rows + "255 0 0\n")), 1);
}

TEST_F(FormatsTest, TellsOfPointsAndLines) {
  const LoadedModel model =
      load("a.obj", "o sheet\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no rod\nl 1 2\n");
  EXPECT_EQ(model.report.triangles, 1U);
  EXPECT_THAT(model.report.nodes, testing::ElementsAre("sheet"));
  EXPECT_THAT(model.report.notes, testing::ElementsAre("points and lines are left out"));
}

TEST_F(FormatsTest, StaysSmoothWhereTheMaterialChanges) {
  const std::string corners =
      "v 0 0 0\nv 1 0 0\nv 2 0.3 0\nv 0 0 1\nv 1 0 1\nv 2 0.3 1\n"
      "usemtl red\nf 1 4 5 2\nusemtl blue\nf 2 5 6 3\n";
  const LoadedModel model = load("a.obj", corners);
  ASSERT_EQ(model.scene.meshes.size(), 2U);
  std::vector<Vec3f> met;
  for (const auto& mesh : model.scene.meshes) {
    for (std::size_t i = 0; i < mesh->positions.size(); ++i) {
      if (mesh->positions[i].x == 1) met.push_back(mesh->normals[i]);
    }
  }
  ASSERT_EQ(met.size(), 4U);
  EXPECT_GT(std::abs(met[0].x), 0.05F);
  for (const Vec3f n : met) EXPECT_LT(length(n - met[0]), 1e-5F);
}

TEST_F(FormatsTest, TurnsStlFacetsAsTheirCornersRun) {
  // The file says +z, the order of its corners -y.
  const LoadedModel model = load("a.stl", made::stl({0, 0, 1}));
  EXPECT_THAT(model.scene.meshes[0]->normals, testing::Each(Vec3f{0, -1, 0}));
}

}  // namespace
}  // namespace render::model_formats_test
