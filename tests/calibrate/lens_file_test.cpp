// Lenses in files.
#include <gtest/gtest.h>

#include <numbers>

#include "calibrate/lens.h"
#include "tests/made_files.h"

namespace calibrate::lens_file_test {
namespace {

TEST(WriteLens, IsUndoneByReadLens) {
  const auto directory = made::make_temporary_directory();
  const std::vector<Lens> lenses{
      {"pinhole", 640, 480, {500.5, 501.25, 319.5, 1.0 / 3}},
      {"equisolid", 2808, 1872, {622.4, 1412.5, 932.0}, 1.62},
      {"kannala_brandt", 1024, 1024, {331, 332, 513.3, 509.1, -.02, .003}, 1.5, 0.1 / 3},
      {"kannala_brandt", 1024, 1024, {331, 332, 513.3, 509.1}},
      {"decentred_kannala_brandt", 640, 480, {200, 201, 320, 240, 1e-4, 2e-4, -.02}, 1.4},
      {"LENSMODEL_OPENCV4", 768, 576, {1184.97, 1194.57, 324.222, 282.566, -.15662, .06178, 0, 0}},
  };
  for (const Lens& lens : lenses) {
    const std::string path = directory / "lens.toml";
    write_lens(path, lens);
    Lens read = read_lens(path);
    EXPECT_NEAR(read.max_angle_rad, lens.max_angle_rad, 1e-14);
    read.max_angle_rad = lens.max_angle_rad;
    EXPECT_EQ(read, lens);
  }
}

TEST(WriteLens, WritesAPinholeThatAlsoMrcalReads) {
  const std::string path = made::make_temporary_directory() / "pinhole.cameramodel";
  const Lens lens{"pinhole", 640, 480, {500, 501, 319.5, 239.5}};
  write_lens(path, lens);
  const Lens read = read_lens(path);
  EXPECT_EQ(read.model, "LENSMODEL_PINHOLE");
  EXPECT_EQ(read.parameters, lens.parameters);
}

TEST(LensFromText, IsTheLensThatTheTextIsOf) {
  for (const Lens& lens :
       {Lens{"pinhole", 640, 480, {500, 501, 319.5, 239.5}, Lens{}.max_angle_rad, 0.25},
        Lens{"kannala_brandt", 1280, 720, {700, 700, 639.5, 359.5, -0.02, 0.004}, 1.5},
        Lens{"LENSMODEL_OPENCV4", 1280, 720, {1e3, 1e3, 639.5, 359.5, -0.1, 1e-3, 0, 1.0 / 3}}}) {
    Lens read = lens_from_text(text_of_lens(lens), "the note");
    EXPECT_NEAR(read.max_angle_rad, lens.max_angle_rad, 1e-14);
    read.max_angle_rad = lens.max_angle_rad;
    EXPECT_EQ(read, lens);
  }
  EXPECT_THROW(text_of_lens({"pinhole", 640, 480, {0, 501, 319.5, 239.5}}), std::invalid_argument);
  try {
    lens_from_text("model = \"pinhole\"\nwidth = 0\n", "the note");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).find("the note:2:9: \"width\" must be"), 0U)
        << error.what();
  }
}

TEST(ReadLens, TakesAnglesInDegreesUpToHalfTheSphere) {
  const std::string path = made::make_temporary_directory() / "lens.toml";
  std::ofstream(path) << "model = \"equisolid\"\nwidth = 640\nheight = 480\nf = 100\ncx = 320\n"
                         "cy = 240\nmax_angle = 180\n";
  EXPECT_NEAR(read_lens(path).max_angle_rad, std::numbers::pi, 1e-15);
}

TEST(ReadLens, RefusesFilesOfOtherKindsAndMissingOnes) {
  EXPECT_THROW(read_lens("lens.json"), std::runtime_error);
  EXPECT_THROW(read_lens("/nowhere/lens.toml"), std::runtime_error);
  EXPECT_THROW(read_lens("/nowhere/lens.cameramodel"), std::runtime_error);
}

TEST(ReadLens, RefusesEveryBadTomlFileWithLineColumnAndReason) {
  made::expect_refusals(
      "lens_", ".toml",
      {{"lens_syntax.toml", ":2:14: "},
       {"lens_unknown_key.toml", ":8:1: unknown key \"focal\""},
       {"lens_unknown_model.toml", ":1:9: unknown lens model \"equisolidus\""},
       {"lens_missing_centre.toml", ": the key \"cx\" is missing"},
       {"lens_text_for_number.toml", ":4:5: \"f\" must be a number"},
       {"lens_number_for_text.toml", ":1:9: \"model\" must be a string"},
       {"lens_size_with_fraction.toml", ":2:9: \"width\" must be a whole number"},
       {"lens_size_negative.toml", ":3:10: \"height\" must be a whole number"},
       {"lens_error_negative.toml", ":7:12: \"error_px\" must be 0 or above"},
       {"lens_error_too_large.toml", ":7:12: \"error_px\" must be at most the picture's diagonal"},
       {"lens_angle_too_large.toml", ":7:13: \"max_angle\" must be above 0 and at most 180"},
       {"lens_not_finite.toml", ":4:5: \"f\" must be finite"},
       {"lens_focal_length_negative.toml", ":1:9: a focal length must be above 0"},
       {"lens_k2_without_k1.toml", ":8:1: unknown key \"k2\""},
       {"lens_parameters_of_text.toml", ":4:18: \"parameters\" must hold numbers only"},
       {"lens_too_few_parameters.toml", ":1:9: lens model LENSMODEL_OPENCV4 takes 8"}},
      read_lens);
}

}  // namespace
}  // namespace calibrate::lens_file_test
