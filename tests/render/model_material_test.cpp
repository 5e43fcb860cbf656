// Materials and textures of models: what is taken, what is noted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "capture/png.h"
#include "render/glass.h"
#include "render/load_mesh.h"
#include "render/standard.h"
#include "tests/made_files.h"
#include "tests/made_model_bytes.h"
#include "tests/render/made_materials.h"

namespace render::model_material_test {
namespace {

using made::GlbParts, made::make_glb;
using testing::AllOf, testing::Contains, testing::ElementsAre, testing::HasSubstr, testing::Not;
using namespace std::string_literals;

// Of one triangle, with pictures a to d as textures 0 to 3.
LoadedModel load_glb(const std::string& material, const std::string& samplers = "") {
  GlbParts parts;
  parts.material = material;
  parts.more = R"(,"extensionsUsed":["KHR_materials_pbrSpecularGlossiness",
"KHR_materials_transmission","KHR_materials_volume","KHR_texture_transform",
"KHR_materials_clearcoat"],
"images":[{"uri":"a.png"},{"uri":"b.png"},{"uri":"c.png"},{"uri":"d.png"}],
"textures":[{"source":0)" +
               (samplers.empty() ? ""s : R"(,"sampler":0)") +
               R"(},{"source":1},{"source":2},{"source":3}])" +
               (samplers.empty() ? ""s : R"(,"samplers":[)" + samplers + "]");
  return load_model(write(made_folder("abcd") / "a.glb", make_glb(parts)));
}

// Ascii: a triangle with one material of properties `material`, and textures on its properties.
std::string made_fbx(const std::string& material,
                     const std::vector<std::pair<std::string, std::string>>& textures,
                     const std::string& of_texture = "",
                     const std::string& objects = "",
                     const std::string& connections = "") {
  std::string file = R"(; FBX 7.3.0 project file
FBXHeaderExtension:  {
FBXHeaderVersion: 1003
FBXVersion: 7300
}
Objects:  {
Geometry: 1, "Geometry::", "Mesh" {
Vertices: *9 {
a: 0,0,0,1,0,0,0,1,0
}
PolygonVertexIndex: *3 {
a: 0,1,-3
}
GeometryVersion: 124
LayerElementUV: 0 {
Version: 101
Name: "UVMap"
MappingInformationType: "ByPolygonVertex"
ReferenceInformationType: "Direct"
UV: *6 {
a: 0,0,1,0,0,1
}
}
LayerElementMaterial: 0 {
Version: 101
MappingInformationType: "AllSame"
ReferenceInformationType: "IndexToDirect"
Materials: *1 {
a: 0
}
}
Layer: 0 {
Version: 100
LayerElement:  {
Type: "LayerElementMaterial"
TypedIndex: 0
}
LayerElement:  {
Type: "LayerElementUV"
TypedIndex: 0
}
}
}
Model: 2, "Model::part", "Mesh" {
Version: 232
Shading: T
Culling: "CullingOff"
}
Material: 3, "Material::m", "" {
Version: 102
ShadingModel: "lambert"
MultiLayer: 0
Properties70:  {
)" + material + "}\n}\n";
  std::string links = "C: \"OO\",2,0\nC: \"OO\",1,2\nC: \"OO\",3,2\n";
  int id = 10;
  for (const auto& [property, picture] : textures) {
    const std::string number = std::to_string(id++);
    file += "Texture: " + number + ", \"Texture::t" + number +
            "\", \"\" {\nType: \"TextureVideoClip\"\nVersion: 202\nFileName: \"" + picture +
            "\"\nRelativeFilename: \"" + picture + "\"\nProperties70:  {\n" + of_texture + "}\n}\n";
    links += "C: \"OP\"," + number + ",3, \"" + property + "\"\n";
  }
  return file + objects + "}\nConnections:  {\n" + links + connections + "}\n";
}
std::string fbx_colour(const std::string& name, const std::string& rgb) {
  return "P: \"" + name + "\", \"Color\", \"\", \"A\"," + rgb + "\n";
}
std::string fbx_number(const std::string& name, const std::string& value) {
  return "P: \"" + name + "\", \"Number\", \"\", \"A\"," + value + "\n";
}

LoadedModel load_fbx(const std::string& bytes) {
  return load_model(write(made_folder("abc") / "a.fbx", bytes));
}

LoadedModel load_x3d(const std::string& appearance) {
  const std::string shape = made::x3d(
      "<Shape><Appearance>" + appearance +
      "</Appearance><IndexedFaceSet coordIndex=\"0 1 2 -1\" texCoordIndex=\"0 1 2 -1\">"
      "<Coordinate point=\"0 0 0 1 0 0 0 1 0\"/><TextureCoordinate point=\"0 0 1 0 0 1\"/>"
      "</IndexedFaceSet></Shape>");
  return load_model(write(made_folder("a") / "a.x3d", shape));
}

TEST(ModelMaterial, LetsLightThroughUntintedByItsOpacity) {
  const LoadedModel obj = load_obj("newmtl m\nKd 0 0 0\nd 0.25\n");
  const LoadedModel fbx = load_fbx(made_fbx(
      fbx_colour("TransparentColor", "1,1,1") + fbx_number("TransparencyFactor", ".75"), {}));
  const LoadedModel x3d = load_x3d("<Material diffuseColor=\"0 0 0\" transparency=\".75\"/>");
  for (const LoadedModel* model : {&obj, &fbx, &x3d}) {
    const StandardParameters p = parameters_of(*model);
    EXPECT_NEAR(p.opacity, 0.25, 1e-6);
    EXPECT_EQ(p.transmission, 0);
  }
}

TEST(ModelMaterial, HasTwoSidesWhateverGltfSays) {
  const LoadedModel one = load_glb(R"({"name":"m","doubleSided":false})");
  const LoadedModel two = load_glb(R"({"name":"m","doubleSided":true})");
  EXPECT_EQ(one.scene.materials, two.scene.materials);
}

TEST(ModelMaterial, WrapsTexturesAsTheFileSays) {
  const std::string glowing = R"({"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0}})";
  const auto wrap_of = [](const LoadedModel& model) { return model.scene.textures.at(0)->wrap; };
  EXPECT_THAT(wrap_of(load_glb(glowing)), ElementsAre(Wrap::repeat, Wrap::repeat));
  EXPECT_THAT(wrap_of(load_glb(glowing, R"({"wrapS":33071,"wrapT":33648})")),
              ElementsAre(Wrap::clamp, Wrap::mirror));
  const std::string picture = "<Material/><ImageTexture url='\"a.png\"' ";
  EXPECT_THAT(wrap_of(load_x3d(picture + "/>")), ElementsAre(Wrap::repeat, Wrap::repeat));
  EXPECT_THAT(wrap_of(load_x3d(picture + "repeatS=\"false\"/>")),
              ElementsAre(Wrap::clamp, Wrap::repeat));
  const LoadedModel obj = load_obj("newmtl m\nKe 1 1 1\nmap_Ke -clamp on a.png\n");
  EXPECT_THAT(wrap_of(obj), ElementsAre(Wrap::clamp, Wrap::clamp));
}

TEST(ModelMaterial, SharesATextureOnlyWhereItWrapsAlike) {
  GlbParts parts;
  parts.material = R"({"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0},
"pbrMetallicRoughness":{"baseColorTexture":{"index":1}},"normalTexture":{"index":2}})";
  parts.more = R"(,"images":[{"uri":"a.png"}],"samplers":[{"wrapS":33071},{}],"textures":
[{"source":0,"sampler":0},{"source":0,"sampler":1},{"source":0,"sampler":1}])";
  const LoadedModel model = load_model(write(made_folder("a") / "a.glb", make_glb(parts)));
  EXPECT_EQ(model.scene.textures.size(), 3U) << "two ways, and one is no colour";
}

TEST(ModelMaterial, NotesWhatTexturesAskForAndDoNotGet) {
  const std::string glowing = R"({"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0}})";
  EXPECT_THAT(notes_of(load_glb(glowing, R"({"magFilter":9728})")),
              Contains(HasSubstr("nearest texel")));
  EXPECT_THAT(notes_of(load_glb(glowing, R"({"magFilter":9729})")), testing::IsEmpty());
  const std::vector<std::pair<std::string, std::string>> textures{{"DiffuseColor", "a.png"}};
  const auto clamping = [&](const std::string& mode) {
    return made_fbx("", textures, "P: \"WrapModeU\", \"enum\", \"\", \"\"," + mode + "\n");
  };
  EXPECT_THAT(notes_of(load_fbx(clamping("1"))), Contains(HasSubstr("clamps at their edges")));
  EXPECT_THAT(notes_of(load_fbx(clamping("0"))), testing::IsEmpty());
}

// A texture of glTF with members of its KHR_texture_transform.
std::string placed(int texture, const std::string& transform) {
  return R"({"index":)" + std::to_string(texture) + R"(,"extensions":{"KHR_texture_transform":{)" +
         transform + "}}}";
}
std::string base_map(const std::string& texture) {
  return R"("pbrMetallicRoughness":{"baseColorTexture":)" + texture + "}";
}

TEST(ModelMaterial, GivesEachTextureItsOwnTransform) {
  // The second is the extension's own example: the lower left quarter, turned by a right angle.
  const LoadedModel model =
      load_glb("{" + base_map(R"({"index":0})") + R"(,"normalTexture":)" +
               placed(1, "\"scale\":[40,20]") + R"(,"emissiveFactor":[1,1,1],"emissiveTexture":)" +
               placed(2, R"("offset":[0,1],"rotation":1.57079632679,"scale":[0.5,0.5])") + "}");
  EXPECT_THAT(notes_of(model), testing::IsEmpty());
  const StandardParameters p = parameters_of(model);
  EXPECT_EQ(p.base_color_uv, UvTransform{});
  EXPECT_EQ(p.normal_uv, (UvTransform{{40, 0, 0}, {0, 20, 0}}));
  const auto is_at = [](std::array<float, 2> place, float u, float v) {
    EXPECT_NEAR(place[0], u, 1e-6);
    EXPECT_NEAR(place[1], v, 1e-6);
  };
  is_at(p.emission_uv.of_place({0, 0}), 0, 1);
  is_at(p.emission_uv.of_place({1, 0}), 0, 0.5F);
  is_at(p.emission_uv.of_place({0, 1}), 0.5F, 1);
  is_at(p.emission_uv.of_place({1, 1}), 0.5F, 0.5F);
  const auto& uvs = model.scene.meshes.at(0)->uvs;
  EXPECT_THAT(uvs, ElementsAre(ElementsAre(0, 0), ElementsAre(1, 0), ElementsAre(0, 1)));
}

// Turned, and wider one way than the other: first scaled, then turned about the upper left corner.
TEST(ModelMaterial, TransformsAllMapsOfGltf) {
  const auto map = [](int k) {
    return placed(k % 4,
                  R"("rotation":0.5,"offset":[3,0.25],"scale":[2,)" + std::to_string(k) + "]");
  };
  const LoadedModel model = load_glb(
      R"({"pbrMetallicRoughness":{"baseColorTexture":)" + map(1) +
      R"(,"metallicRoughnessTexture":)" + map(2) + R"(},"normalTexture":)" + map(3) +
      R"(,"emissiveFactor":[1,1,1],"emissiveTexture":)" + map(4) +
      R"(,"extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":1,"clearcoatTexture":)" +
      map(5) + R"(,"clearcoatRoughnessTexture":)" + map(6) +
      R"(},"KHR_materials_transmission":{"transmissionFactor":1,"transmissionTexture":)" + map(7) +
      "}}}");
  EXPECT_THAT(notes_of(model), testing::IsEmpty());
  const StandardParameters p = parameters_of(model);
  const std::vector<UvTransform> found{
      p.base_color_uv, p.metallic_roughness_uv,  p.normal_uv,      p.emission_uv,
      p.clearcoat_uv,  p.clearcoat_roughness_uv, p.transmission_uv};
  const float c = std::cos(0.5F), s = std::sin(0.5F);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto k = static_cast<float>(i + 1);
    const std::array<float, 6> expected{2 * c, k * s, 3, -2 * s, k * c, 0.25F};
    for (std::size_t n = 0; n < 3; ++n) {
      EXPECT_NEAR(found[i].u[n], expected[n], 2e-6) << i;
      EXPECT_NEAR(found[i].v[n], expected[n + 3], 2e-6) << i;
    }
  }
}

// Live video lies on them.
TEST(ModelMaterial, LeavesTheMeshItsCoordinatesWhereAllTexturesShareATransform) {
  const std::string shift = R"("offset":[0.25,0.5],"scale":[2,4])";
  const LoadedModel model =
      load_glb("{" + base_map(placed(0, shift)) + R"(,"normalTexture":)" + placed(1, shift) + "}");
  const StandardParameters p = parameters_of(model);
  EXPECT_EQ(p.base_color_uv, (UvTransform{{2, 0, 0.25F}, {0, 4, 0.5F}}));
  EXPECT_EQ(p.normal_uv, p.base_color_uv);
  EXPECT_THAT(model.scene.meshes.at(0)->uvs,
              ElementsAre(ElementsAre(0, 0), ElementsAre(1, 0), ElementsAre(0, 1)));
}

// The mesh has u along x and v along y, where z looks to the viewer.
TEST(ModelMaterial, TurnsTheFrameOfNormalMapsWithThem) {
  const auto tangent = [](const std::string& transform, bool shared) {
    const std::string base = shared ? placed(0, transform) : R"({"index":0})";
    const LoadedModel model =
        load_glb("{" + base_map(base) + R"(,"normalTexture":)" + placed(1, transform) + "}");
    return model.scene.meshes.at(0)->tangents.at(0);
  };
  const auto near = [](float x) { return testing::FloatNear(x, 1e-6F); };
  for (const bool shared : {false, true}) {
    EXPECT_THAT(tangent(R"("scale":[3,3])", shared), ElementsAre(near(1), near(0), near(0), -1));
    EXPECT_THAT(tangent(R"("rotation":1.5707963)", shared),
                ElementsAre(near(0), near(1), near(0), -1));
    EXPECT_THAT(tangent(R"("scale":[-2,2])", shared), ElementsAre(near(-1), near(0), near(0), 1));
    // Of no width: as if it had no transform.
    if (!shared) {
      EXPECT_THAT(tangent(R"("scale":[0,2])", shared), ElementsAre(near(1), near(0), near(0), -1));
    }
  }
}

TEST(ModelMaterial, NotesTransformsAndSetsOfCoordinatesThatItDoesNotTake) {
  const LoadedModel far = load_glb(R"({"name":"m",)" + base_map(R"({"index":0})") +
                                   R"(,"normalTexture":)" + placed(1, "\"scale\":[1e39,1]") + "}");
  EXPECT_THAT(notes_of(far), ElementsAre(HasSubstr("the transform of a texture")));
  EXPECT_EQ(parameters_of(far).normal_uv, UvTransform{});
  const LoadedModel three = load_glb(R"({"name":"m",)" + base_map(R"({"index":0})") +
                                     R"(,"normalTexture":{"index":1,"texCoord":1},
"emissiveTexture":{"index":2,"texCoord":2}})");
  EXPECT_THAT(notes_of(three), ElementsAre(HasSubstr("more than two sets of coordinates")));
}

// Of the second set u runs up where that of the first runs to the right.
TEST(ModelMaterial, LooksEachTextureUpInItsSetOfCoordinates) {
  const std::string data =
      made::bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}) +  // places
      made::bytes_of(std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1}) +  // normals
      made::bytes_of(std::vector<float>{0, 1, 1, 1, 0, 0}) +
      made::bytes_of(std::vector<float>{0.5F, 0, 0.5F, 0.25F, 1, 0});
  const auto load = [&](const std::string& textures) {
    const std::string accessor = R"({"bufferView":0,"componentType":5126,"count":3,"byteOffset":)";
    return load_model(write(
        made_folder("ab") / "a.glb",
        made::glb(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2,
"TEXCOORD_1":3},"material":0}]}],"materials":[{)" +
                      textures +
                      R"(}],"images":[{"uri":"a.png"},{"uri":"b.png"}],
"textures":[{"source":0},{"source":1}],"accessors":[)" +
                      accessor + R"(0,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},)" + accessor +
                      R"(36,"type":"VEC3"},)" + accessor + R"(72,"type":"VEC2"},)" + accessor +
                      R"(96,"type":"VEC2"}],
"bufferViews":[{"buffer":0,"byteLength":120}],"buffers":[{"byteLength":120}]})",
                  data)));
  };
  const auto on = [](const char* base, const char* normal) {
    return base_map(std::string(R"({"index":0,"texCoord":)") + base + "}") +
           R"(,"normalTexture":{"index":1,"texCoord":)" + normal + "}";
  };
  const LoadedModel mixed = load(on("0", "1"));
  EXPECT_THAT(notes_of(mixed), testing::IsEmpty());
  EXPECT_EQ(parameters_of(mixed).base_color_uv.second, 0);
  EXPECT_EQ(parameters_of(mixed).normal_uv.second, 1);
  const Mesh& mesh = *mixed.scene.meshes.at(0);
  EXPECT_THAT(mesh.uvs, ElementsAre(ElementsAre(0, 1), ElementsAre(1, 1), ElementsAre(0, 0)));
  EXPECT_THAT(mesh.second_uvs,
              ElementsAre(ElementsAre(0.5F, 0), ElementsAre(0.5F, 0.25F), ElementsAre(1, 0)));
  ASSERT_EQ(mesh.tangents.size(), 3U);
  EXPECT_NEAR(mesh.tangents[0][1], 1, 1e-6) << "along u of the normal map";
  // The same, the first named first.
  const LoadedModel turned = load(on("1", "0"));
  EXPECT_EQ(turned.scene.meshes.at(0)->uvs, mesh.second_uvs);
  EXPECT_EQ(turned.scene.meshes.at(0)->second_uvs, mesh.uvs);
  EXPECT_NEAR(turned.scene.meshes.at(0)->tangents.at(0)[0], 1, 1e-6);
  // One set alone is no second one.
  EXPECT_THAT(load(on("1", "1")).scene.meshes.at(0)->second_uvs, testing::IsEmpty());
}

TEST(ModelMaterial, NotesEveryMapThatIsLeftOut) {
  const LoadedModel glb = load_glb(R"({"name":"m","occlusionTexture":{"index":0},
"pbrMetallicRoughness":{"baseColorTexture":{"index":1},"metallicRoughnessTexture":{"index":2}}})");
  EXPECT_THAT(notes_of(glb), ElementsAre("material 'm': the occlusion map is left out"));
  const LoadedModel fbx = load_fbx(
      made_fbx(fbx_colour("DiffuseColor", ".5,.5,.5"), {{"Maya|TEX_color_map", "a.png"},
                                                        {"Maya|TEX_normal_map", "b.png"},
                                                        {"Maya|TEX_roughness_map", "c.png"}}));
  EXPECT_THAT(notes_of(fbx), ElementsAre("material 'm': the roughness map is left out"));
  const StandardParameters p = parameters_of(fbx);
  EXPECT_GE(p.base_color_texture, 0);
  EXPECT_GE(p.normal_texture, 0);
  EXPECT_THAT(notes_of(load_fbx(made_fbx("", {{"TransparentColor", "a.png"}}))),
              Contains(HasSubstr("the opacity map is left out")));
  EXPECT_THAT(notes_of(load_obj("newmtl m\nmap_Ks a.png\nmap_Bump b.png\n")),
              AllOf(Contains(HasSubstr("specular map")), Contains(HasSubstr("height map"))));
}

TEST(ModelMaterial, TakesSpecularGlossinessForPaintOrMetal) {
  const auto load = [](const std::string& extension) {
    return load_glb(R"({"name":"m","extensions":{"KHR_materials_pbrSpecularGlossiness":)" +
                    extension + "}}");
  };
  const LoadedModel paint =
      load(R"({"diffuseFactor":[0.5,0.25,0,1],"specularFactor":[0,0,0],"glossinessFactor":0.25})");
  StandardParameters p = parameters_of(paint);
  EXPECT_THAT(p.base_color, ElementsAre(0.5F, 0.25F, 0));
  EXPECT_EQ(p.metallic, 0);
  EXPECT_EQ(p.specular, 0);
  EXPECT_NEAR(p.roughness, 0.75, 1e-6);
  const LoadedModel metal =
      load(R"({"diffuseFactor":[0,0,0,1],"specularFactor":[1,0.5,0.25],"glossinessFactor":1})");
  p = parameters_of(metal);
  EXPECT_THAT(p.base_color, ElementsAre(1, 0.5F, 0.25F));
  EXPECT_EQ(p.metallic, 1);
  const LoadedModel mapped =
      load(R"({"diffuseTexture":{"index":0},"specularGlossinessTexture":{"index":1}})");
  p = parameters_of(mapped);
  EXPECT_GE(p.base_color_texture, 0);
  EXPECT_THAT(p.base_color, ElementsAre(1, 1, 1));
  EXPECT_EQ(p.metallic, 0);
  EXPECT_THAT(notes_of(mapped), AllOf(Contains(HasSubstr("mirrors as paint does")),
                                      Contains(HasSubstr("specular map is left out"))));
}

LoadedModel load_clear(const std::string& more, double roughness, bool volume) {
  return load_glb(
      R"({"name":"m","extensions":{"KHR_materials_transmission":{"transmissionFactor":1)" +
      (more.starts_with("+") ? more.substr(1) : "") + "}" +
      (volume ? R"(,"KHR_materials_volume":{"thicknessFactor":0.01}})" : "}") +
      (more.starts_with("+") ? "" : more) +
      (more.find("pbr") != std::string::npos
           ? "}"
           : R"(,"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":)" +
                 std::to_string(roughness) + "}}"));
}

TEST(ModelMaterial, NotesWhatSolidGlassGoesWithout) {
  const auto lost = [](const std::string& more) {
    const LoadedModel model = load_clear(more, 0, true);
    EXPECT_EQ(model.scene.materials.at(0).shader, "glass");
    std::string all;
    for (const std::string& note : model.report.notes) all += note + "\n";
    return all;
  };
  EXPECT_EQ(lost(""), "");
  EXPECT_EQ(lost(R"(,"normalTexture":{"index":0},"emissiveFactor":[0,1,0])"),
            "material 'm': it is solid glass, which goes without its normal map, emission\n");
  EXPECT_THAT(
      lost(R"(,"alphaMode":"MASK","pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0,
"baseColorFactor":[1,0.5,1,1],"baseColorTexture":{"index":0}})"),
      HasSubstr("without its base colour map, alpha"));
  const LoadedModel by_map = load_clear(R"(+,"transmissionTexture":{"index":0})", 0, true);
  EXPECT_EQ(by_map.scene.materials.at(0).shader, "standard");
  EXPECT_THAT(notes_of(by_map), Contains(HasSubstr("the volume (thickness")));
}

TEST(ModelMaterial, TintsSolidGlassByItsBaseColour) {
  const LoadedModel model = load_clear(
      R"(,"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0,
"baseColorFactor":[0.75,0.25,0,1]})",
      0, true);
  const GlassParameters glass = glass_parameters(model.scene.materials.at(0));
  EXPECT_THAT(glass.tint, ElementsAre(0.75F, 0.25F, 0));
  EXPECT_THAT(glass.shadow, ElementsAre(0.92F, 0.92F, 0.92F)) << "its tint comes on top";
  EXPECT_THAT(notes_of(model), testing::IsEmpty());
}

TEST(ModelMaterial, NotesThatFrostedGlassIsClear) {
  for (const bool volume : {false, true}) {
    EXPECT_THAT(notes_of(load_clear("", 0.25, volume)),
                Contains(HasSubstr("not as rough as its surface")));
    EXPECT_THAT(notes_of(load_clear("", 0.05, volume)), testing::IsEmpty());
  }
}

TEST(ModelMaterial, PutsTexturesOfFbxInThePlaceOfColours) {
  const LoadedModel model = load_fbx(
      made_fbx(fbx_colour("DiffuseColor", ".5,.5,.5") + fbx_colour("EmissiveColor", "0,0,0") +
                   fbx_number("EmissiveFactor", "1"),
               {{"DiffuseColor", "a.png"}, {"EmissiveColor", "b.png"}}));
  const StandardParameters p = parameters_of(model);
  EXPECT_THAT(p.base_color, ElementsAre(1, 1, 1));
  EXPECT_THAT(p.emission, ElementsAre(1, 1, 1));
  const LoadedModel plain = load_fbx(made_fbx(fbx_colour("DiffuseColor", ".5,.5,.5"), {}));
  EXPECT_THAT(parameters_of(plain).base_color, ElementsAre(0.5F, 0.5F, 0.5F));
}

// Of glTF, a picture inside may have the name of one that lies outside.
TEST(ModelMaterial, TellsAFileFromAPictureInsideOfTheSameName) {
  GlbParts parts;
  parts.material = R"({"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0},
"pbrMetallicRoughness":{"baseColorTexture":{"index":1}}})";
  parts.more =
      R"(,"images":[{"name":"a.png","mimeType":"image/png","uri":"data:image/png;base64,AAAA"},
{"uri":"a.png"}],"textures":[{"source":0},{"source":1}])";
  const LoadedModel model = load_model(write(made_folder("a") / "a.glb", make_glb(parts)));
  const StandardParameters p = parameters_of(model);
  EXPECT_GE(p.base_color_texture, 0);
  EXPECT_EQ(p.emission_texture, -1) << "what lies inside is no picture";
}

// Two pictures of one name in two folders.
TEST(ModelMaterial, TellsPicturesInFbxByTheirWholeNames) {
  std::ifstream picture(made::bad_files().parent_path() / "one_texel.png", std::ios::binary);
  const std::string png((std::istreambuf_iterator<char>(picture)), {});
  constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < png.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (i + k < png.size() ? static_cast<unsigned char>(png[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k > png.size() ? '=' : digits[bits >> (18 - 6 * k) & 63U];
    }
  }
  std::string objects, connections;
  for (int i = 0; i < 2; ++i) {
    const std::string id = std::to_string(20 + i), folder = i == 0 ? "one" : "two";
    const std::string name = folder + "/x.png";
    objects += "Video: " + id + ", \"Video::v" + id +
               "\", \"Clip\" {\nType: \"Clip\"\nFileName: \"" + name + "\"\nRelativeFilename: \"" +
               name + "\"\nContent: ,\n\"" + text + "\"\n}\n";
    connections += "C: \"OO\"," + id + "," + std::to_string(10 + i) + "\n";
  }
  const LoadedModel model = load_fbx(made_fbx(
      fbx_colour("EmissiveColor", "1,1,1"),
      {{"DiffuseColor", "one/x.png"}, {"EmissiveColor", "two/x.png"}}, "", objects, connections));
  EXPECT_EQ(model.scene.textures.size(), 2U);
  const StandardParameters p = parameters_of(model);
  EXPECT_NE(p.base_color_texture, p.emission_texture);
}

TEST(ModelMaterial, TakesBlendedAlphaWithoutAPictureForOpacity) {
  const LoadedModel pane = load_glb(
      R"({"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,0.5,1,0.25]}})");
  const StandardParameters p = parameters_of(pane);
  EXPECT_EQ(p.opacity, 0.25F);
  EXPECT_EQ(p.base_color_alpha, 1);
  EXPECT_EQ(p.alpha_cutoff, 0);
  EXPECT_THAT(notes_of(pane), testing::IsEmpty());
}

TEST(ModelMaterial, BlendsByThePictureThatHasAlpha) {
  const auto load = [](std::uint8_t alpha) {
    GlbParts parts;
    parts.material =
        R"({"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25],
"baseColorTexture":{"index":0}}})";
    parts.more = R"(,"images":[{"uri":"p.png"}],"textures":[{"source":0}])";
    const fs::path folder = made_folder();
    const std::vector<std::uint8_t> texels{9, 99, 199, alpha, 9, 99, 199, 255};
    capture::write_png(folder / "p.png", 2, 1, 4, texels);
    return load_model(write(folder / "a.glb", make_glb(parts)));
  };
  const LoadedModel decal = load(100);
  const StandardParameters p = parameters_of(decal);
  EXPECT_EQ(p.alpha_blend, 1);
  EXPECT_EQ(p.base_color_alpha, 0.25F);
  EXPECT_EQ(p.alpha_cutoff, 0);
  EXPECT_EQ(p.opacity, 1);
  EXPECT_THAT(notes_of(decal), testing::IsEmpty());
  // Exporters that say so of all materials: without alpha it is as without a picture.
  const StandardParameters opaque = parameters_of(load(255));
  EXPECT_EQ(opaque.alpha_blend, 0);
  EXPECT_EQ(opaque.opacity, 0.25F);
}

TEST(ModelMaterial, CountsTheShininessOfX3dAsAShare) {
  const LoadedModel x3d = load_x3d("<Material shininess=\".5\"/>");
  const LoadedModel obj = load_obj("newmtl m\nNs 64\n");
  EXPECT_NEAR(parameters_of(x3d).roughness, parameters_of(obj).roughness, 1e-5);
}

TEST(ModelMaterial, NotesPicturesWithoutBytes) {
  GlbParts parts;
  parts.material = R"({"name":"m","emissiveTexture":{"index":0}})";
  parts.more = R"(,"images":[{"uri":"data:image/png,%89PNG"}],"textures":[{"source":0}])";
  const LoadedModel model = load_model(write(made_folder() / "a.glb", make_glb(parts)));
  EXPECT_THAT(notes_of(model), Contains(HasSubstr("neither a file nor base64")));
}

}  // namespace
}  // namespace render::model_material_test
