// Materials of OBJ: what is taken of their libraries, what is noted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "capture/png.h"
#include "tests/render/made_materials.h"

namespace render::material_library_test {
namespace {

using testing::Contains, testing::ElementsAre, testing::HasSubstr;

TEST(MaterialLibrary, PlacesEachMapOfMaterialLibraries) {
  const LoadedModel model =
      load_obj("newmtl m\nKe 1 1 1\nmap_Kd a.png\nmap_Ke -s 2 3 1 -o .5 0 0 b.png\n");
  const StandardParameters p = parameters_of(model);
  EXPECT_EQ(p.base_color_uv, UvTransform{});
  // v runs down here, and up there.
  EXPECT_EQ(p.emission_uv, (UvTransform{{2, 0, 0.5F}, {0, 3, -2}}));
  EXPECT_THAT(notes_of(model), testing::IsEmpty());
}

TEST(MaterialLibrary, BlendsByTheOpacityMapOfObj) {
  const LoadedModel model = load_obj("newmtl m\nmap_Kd a.png\nmap_d b.png\n");
  const StandardParameters p = parameters_of(model);
  ASSERT_GE(p.alpha_texture, 0);
  EXPECT_NE(p.alpha_texture, p.base_color_texture);
  EXPECT_EQ(p.alpha_blend, 1);
  EXPECT_THAT(notes_of(model), testing::IsEmpty());
  EXPECT_EQ(parameters_of(load_obj("newmtl m\nmap_Kd lost.png\nmap_d b.png\n")).alpha_blend, 1);
  const LoadedModel without = load_obj("newmtl m\nmap_d lost.png\n");
  EXPECT_EQ(parameters_of(without).alpha_blend, 0);
}

TEST(MaterialLibrary, TakesOptionsOfMapsInMaterialLibraries) {
  // Up, u goes .5 to 2.5 and v 0 to 3, of which one or two numbers may tell.
  for (const std::string options :
       {"-s 2 3 1 -o .5 0 0", "-s +2 3 -o .5", "-blendu on -o .5 0 -cc on -s 2 3"}) {
    const LoadedModel model = load_obj("newmtl m\nmap_Kd " + options + " a.png \t\n");
    const StandardParameters p = parameters_of(model);
    ASSERT_GE(p.base_color_texture, 0) << options;
    EXPECT_EQ(p.base_color_uv, (UvTransform{{2, 0, 0.5F}, {0, 3, -2}})) << options;
    EXPECT_THAT(p.base_color, ElementsAre(1, 1, 1)) << "its texture is there";
    EXPECT_THAT(notes_of(model), testing::IsEmpty()) << options;
  }
  EXPECT_THAT(notes_of(load_obj("newmtl m\nmap_Kd -mm 0 .5 a.png\n")),
              ElementsAre("material 'm': option -mm of a map is left out"));
  EXPECT_THAT(notes_of(load_obj("newmtl m\nmap_Kd -mm 0 1 a.png\n")), testing::IsEmpty());
}

TEST(MaterialLibrary, CountsAMapInFullWhereItsColourIsNotStated) {
  const StandardParameters alone =
      parameters_of(load_obj("newmtl m\nmap_Kd a.png\nmap_Ke b.png\n"));
  EXPECT_THAT(alone.base_color, ElementsAre(1, 1, 1));
  EXPECT_THAT(alone.emission, ElementsAre(1, 1, 1));
  const StandardParameters stated =
      parameters_of(load_obj("newmtl m\nKd .5 .5 1\nKe 0 0 0\nmap_Kd a.png\nmap_Ke b.png\n"));
  EXPECT_THAT(stated.base_color, ElementsAre(0.5F, 0.5F, 1));
  EXPECT_THAT(stated.emission, ElementsAre(0, 0, 0));
  EXPECT_NEAR(parameters_of(load_obj("newmtl m\nNs 10\n")).base_color[0], 0.6F, 1e-6F);
}

TEST(MaterialLibrary, LeavesOutWhatOfALibraryIsNoNumber) {
  const LoadedModel model = load_obj(
      "newmtl m\nKd spectral a.rfl\nKa xyz .1 .2 .3\nd -halo .5\nNs many\nTf .5 1 1\n"
      "decal a.png\nrefl -type sphere b.png\nKs 1 1 1\nillum 2\n");
  EXPECT_EQ(parameters_of(model).opacity, 0.5F);
  const std::string m = "material 'm': ", out = " is left out";
  EXPECT_THAT(notes_of(model),
              ElementsAre(m + "Kd spectral a.rfl" + out, m + "Ka xyz .1 .2 .3" + out,
                          m + "option -halo of its opacity" + out, m + "Ns many" + out,
                          m + "its filter (Tf)" + out, m + "decal a.png" + out,
                          m + "refl -type sphere b.png" + out));
}

TEST(MaterialLibrary, TakesBlackWithReflectionsOfALibraryForAMetal) {
  const StandardParameters chrome =
      parameters_of(load_obj("newmtl m\nKd 0 0 0\nKs .9 .8 .7\nillum 3\n"));
  EXPECT_EQ(chrome.metallic, 1);
  EXPECT_THAT(chrome.base_color, ElementsAre(0.9F, 0.8F, 0.7F));
  const LoadedModel paint = load_obj("newmtl m\nKd .5 0 0\nKs .9 .9 .9\nillum 3\n");
  EXPECT_EQ(parameters_of(paint).metallic, 0);
  EXPECT_THAT(notes_of(paint), ElementsAre(HasSubstr("its mirror colour (Ks) is left out")));
  const LoadedModel matte = load_obj("newmtl m\nKd 0 0 0\nKs .9 .9 .9\nillum 2\n");
  EXPECT_EQ(parameters_of(matte).metallic, 0);
  EXPECT_THAT(notes_of(matte), testing::IsEmpty());
}

// The picture's red is the mask; its alpha, opaque everywhere, is none.
TEST(MaterialLibrary, CutsHolesByMasksInEveryKindOfPicture) {
  for (const int channels : {1, 2, 3, 4}) {
    const fs::path folder = made_folder();
    std::vector<std::uint8_t> mask;
    for (int i = 0; i < 16; ++i) {
      for (int c = 0; c < channels; ++c) {
        const bool is_alpha = channels % 2 == 0 && c == channels - 1;
        mask.push_back(is_alpha || i % 2 == 0 ? 255 : 0);
      }
    }
    capture::write_png(folder / "mask.png", 4, 4, channels, mask);
    write(folder / "a.mtl", "newmtl m\nmap_d mask.png\n");
    const LoadedModel model =
        load_model(write(folder / "a.obj", "mtllib a.mtl\n" + textured_triangle));
    const StandardParameters p = parameters_of(model);
    ASSERT_GE(p.alpha_texture, 0) << channels;
    const Texture& texture = *model.scene.textures.at(static_cast<std::size_t>(p.alpha_texture));
    EXPECT_EQ(texture.channels, 3);
    EXPECT_EQ(texture.texels.at(0), 255);
    EXPECT_EQ(texture.texels.at(3), 0);
  }
}

TEST(MaterialLibrary, ReadsObjWithByteOrderMarks) {
  const fs::path folder = made_folder();
  const std::string mark = "\xEF\xBB\xBF";
  write(folder / "a.mtl", mark + "newmtl m\nKd 0 .5 0\n");
  const LoadedModel model =
      load_model(write(folder / "a.obj", mark + "mtllib a.mtl\n" + textured_triangle));
  EXPECT_THAT(parameters_of(model).base_color, ElementsAre(0, 0.5F, 0));
  EXPECT_THAT(notes_of(model), testing::IsEmpty());
}

TEST(MaterialLibrary, TakesOneNumberForAGrey) {
  const LoadedModel model = load_obj("newmtl m\nKd 0 0 0\nKe .5\nd .5\n");
  EXPECT_THAT(parameters_of(model).emission, ElementsAre(0.5F, 0.5F, 0.5F));
  EXPECT_EQ(parameters_of(model).opacity, 0.5F);
}

TEST(MaterialLibrary, ReadsSeveralLibrariesOfOneLine) {
  const fs::path folder = made_folder();
  write(folder / "a.mtl", "newmtl other\nKd 1 0 0");
  write(folder / "b.mtl", "newmtl m\nKd 0 0.5 0\n");
  const LoadedModel model =
      load_model(write(folder / "c.obj", "mtllib a.mtl lost.mtl b.mtl\n" + textured_triangle));
  EXPECT_THAT(parameters_of(model).base_color, ElementsAre(0, 0.5F, 0));
  EXPECT_THAT(notes_of(model), ElementsAre("'lost.mtl' is not there"));
}

TEST(MaterialLibrary, NotesMaterialsThatNoLibraryHas) {
  EXPECT_THAT(notes_of(load_obj("newmtl other\nKd 1 0 0\n")),
              ElementsAre(AllOf(HasSubstr("material 'm'"), HasSubstr("none of its libraries"))));
  EXPECT_THAT(notes_of(load_obj("# nothing\n")), ElementsAre(HasSubstr("none of its libraries")));
  const LoadedModel without = load_model(write(made_folder() / "a.obj", textured_triangle));
  EXPECT_THAT(notes_of(without), ElementsAre(HasSubstr("none of its libraries")));
}

}  // namespace
}  // namespace render::material_library_test
