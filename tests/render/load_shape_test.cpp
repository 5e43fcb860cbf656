// Shapes of models that deform: whatever a file joins, its corners go where they belong.
#include "render/load_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "tests/made_files.h"
#include "tests/made_gltf.h"

namespace render::load_shape_test {
namespace {

using testing::AllOf, testing::HasSubstr;

// A square grid of `squares` a side with its corners at height(x, y), as OBJ with y up.
std::string grid(int squares,
                 const std::function<double(double, double)>& height,
                 const std::string& first_vertex = "") {
  std::string text = "o cloth\n";
  for (int j = 0; j <= squares; ++j) {
    for (int i = 0; i <= squares; ++i) {
      const double x = static_cast<double>(i) / squares, y = static_cast<double>(j) / squares;
      text += first_vertex.empty() || i + j > 0
                  ? "v " + std::to_string(x) + " " + std::to_string(height(x, y)) + " " +
                        std::to_string(-y) + "\n"
                  : "v " + first_vertex + "\n";
    }
  }
  const int wide = squares + 1;
  for (int j = 0; j < squares; ++j) {
    for (int i = 0; i < squares; ++i) {
      const int a = j * wide + i + 1;
      for (const int corner : {a + 1, a + wide}) {
        text += "f " + std::to_string(a) + " " +
                std::to_string(corner == a + 1 ? a + 1 : a + wide + 1) + " " +
                std::to_string(corner == a + 1 ? a + wide + 1 : a + wide) + "\n";
      }
    }
  }
  return text;
}

double wave(double x, double y) { return 0.2 * std::sin(5 * x + 2 * y); }
double flat(double, double) { return 0; }

class LoadShapeTest : public testing::Test {
 protected:
  void SetUp() override { dir_ = made::make_temporary_directory(); }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  std::string write(const std::string& name, const std::string& text) const {
    const std::string path = (dir_ / name).string();
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }

  static std::vector<DeformingPart> parts_of(const LoadedModel& model) {
    std::vector<DeformingPart> parts;
    for (const Instance& instance : model.scene.instances) {
      parts.push_back({instance.name, model.scene.meshes[instance.mesh]});
    }
    return parts;
  }

  // What load_shape says against a file, for the parts of the first.
  std::string refusal(const std::string& first, const std::string& other) const {
    const auto parts = parts_of(load_deforming_model(write("first.obj", first)));
    try {
      load_shape(write("other.obj", other), {}, parts);
      return "";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr((dir_ / "other.obj").string()));
      return error.what();
    }
  }

  std::filesystem::path dir_;
};

TEST_F(LoadShapeTest, PutsEachCornerWhereItsOwnFileHasIt) {
  // Flat, vertices are joined otherwise than in the wave.
  const std::string first = write("1.obj", grid(8, flat)), second = write("2.obj", grid(8, wave));
  const auto parts = parts_of(load_deforming_model(first));
  const auto shapes = load_shape(second, {}, parts);
  ASSERT_EQ(shapes.size(), 1U);
  const Mesh& mesh = *parts[0].mesh;
  ASSERT_EQ(shapes[0].positions.size(), mesh.positions.size());
  ASSERT_EQ(shapes[0].normals.size(), mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3f before = mesh.positions[i], now = shapes[0].positions[i];
    EXPECT_NEAR(now.x, before.x, 1e-5F);
    EXPECT_NEAR(now.y, before.y, 1e-5F);
    EXPECT_NEAR(now.z, wave(before.x, before.y), 1e-5F);
  }
}

TEST_F(LoadShapeTest, GivesTheShapeThatItsFileHasAlone) {
  const std::string file = write("2.obj", grid(8, wave));
  const auto parts = parts_of(load_deforming_model(write("1.obj", grid(8, flat))));
  const auto mesh = in_shape(*parts[0].mesh, load_shape(file, {}, parts)[0]);
  const LoadedModel alone = load_deforming_model(file);
  EXPECT_EQ(mesh->positions, alone.scene.meshes[0]->positions);
  EXPECT_EQ(mesh->normals, alone.scene.meshes[0]->normals);
  EXPECT_EQ(mesh->triangles, alone.scene.meshes[0]->triangles);
  EXPECT_EQ(mesh->rest, parts[0].mesh->rest);
}

TEST_F(LoadShapeTest, IsSmoothWhereVerticesAreApartThoughFilesHaveNoNormals) {
  const LoadedModel model = load_deforming_model(write("1.obj", grid(12, wave)));
  const Mesh& mesh = *model.scene.meshes[0];
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (mesh.positions[i] == mesh.positions[k]) {
        ASSERT_EQ(mesh.normals[i], mesh.normals[k]) << i << " " << k;
      }
    }
  }
}

TEST_F(LoadShapeTest, KeepsTheNormalMapOfAMirroredPart) {
  std::filesystem::copy_file(made::bad_files().parent_path() / "one_texel.png", dir_ / "one.png");
  made::GltfMaker maker;
  const int position = maker.values<float>(3, {0, 0, 0, 1, 0, 0, 0, 1, 0}),
            normal = maker.values<float>(3, {0, 0, 1, 0, 0, 1, 0, 0, 1}),
            uv = maker.values<float>(2, {0, 0, 1, 0, 0, 1});
  const LoadedModel model = load_deforming_model(
      write("1.glb", maker.glb(R"("nodes":[{"mesh":0,"scale":[-1,1,1]}],"meshes":[{"primitives":[
{"material":0,"attributes":{"POSITION":)" +
                               std::to_string(position) + ",\"NORMAL\":" + std::to_string(normal) +
                               ",\"TEXCOORD_0\":" + std::to_string(uv) +
                               R"(}}]}],"materials":[{"normalTexture":{"index":0}}],
"textures":[{"source":0}],"images":[{"uri":"one.png"}])")));
  const Mesh& mesh = *model.scene.meshes[0];
  ASSERT_EQ(mesh.tangents.size(), 3U);
  // Mirrored, u runs to the set's -x, v to z, and the sheet looks to -y.
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT(length(mesh.normals[i] - Vec3f{0, -1, 0}), 1e-5F);
    EXPECT_NEAR(mesh.tangents[i][0], -1, 1e-5);
    EXPECT_EQ(mesh.tangents[i][3], 1);
  }
}

TEST_F(LoadShapeTest, RefusesOtherTrianglesThanTheFirstFileHas) {
  EXPECT_THAT(refusal(grid(4, flat), grid(3, flat)),
              AllOf(HasSubstr("'cloth' has 18 triangles, but in the first file 32"),
                    HasSubstr("the same triangles, in the same order")));
  const std::string whole = grid(4, wave);
  const std::string shorter = whole.substr(0, whole.rfind("\nf") + 1);
  EXPECT_THAT(refusal(whole, shorter), HasSubstr("has 31 triangles, but in the first file 32"));
  EXPECT_NE(refusal(whole, whole.substr(0, whole.size() - 40)), "") << "cut within a line";
  EXPECT_THAT(refusal(whole, whole + "o more\nf 1 2 3\n"), HasSubstr("it has 2 parts, but"));
  EXPECT_NE(refusal(whole, ""), "");
}

TEST_F(LoadShapeTest, RefusesPositionsThatAreNoNumbersOrTooFar) {
  for (const char* vertex : {"nan 0 0", "0 inf 0", "0 1e20 0"}) {
    EXPECT_THAT(refusal(grid(4, flat), grid(4, flat, vertex)),
                HasSubstr("it has 2 triangles with positions that are not finite"))
        << vertex;
    EXPECT_THROW(load_deforming_model(write("first.obj", grid(4, flat, vertex))),
                 std::runtime_error)
        << vertex;
  }
}

TEST_F(LoadShapeTest, RefusesAFileThatIsNotThere) {
  const auto parts = parts_of(load_deforming_model(write("1.obj", grid(2, flat))));
  const std::string missing = (dir_ / "2.obj").string();
  try {
    load_shape(missing, {}, parts);
    FAIL() << "was accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr(missing));
  }
}

}  // namespace
}  // namespace render::load_shape_test
