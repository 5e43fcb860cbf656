// Camera models in files: ours, mrcal's own, and broken ones.
#include "calibrate/camera_model.h"

#include <gtest/gtest.h>

#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "tests/made_files.h"

extern "C" {
#include <mrcal/mrcal.h>
}

namespace calibrate::camera_model_test {
namespace {

CameraModel made_model() {
  CameraModel model;
  model.lens = {"LENSMODEL_OPENCV4",
                768,
                576,
                {1184.97, 1194.57, 324.222, 282.566, -0.15662, 0.06178, 0, 1.0 / 3}};
  model.lens.error_px = 0.1 / 3;
  model.cam_from_ref = look_at({-28.94, -19.529, 7.066}, {-9.54, -5.61, 0}, 0.05);
  return model;
}

void expect_near(const Pose& a, const Pose& b, double tolerance) {
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(a.R.m[i], b.R.m[i], tolerance);
  EXPECT_LE(length(a.t - b.t), tolerance);
}

TEST(CameraModel, ComesBackFromItsFileWithEveryDigit) {
  const std::string path = made::make_temporary_directory() / "made.cameramodel";
  const CameraModel written = made_model();
  write_camera_model(path, written);
  const CameraModel read = read_camera_model(path);
  EXPECT_EQ(read.lens, written.lens);
  ASSERT_TRUE(read.cam_from_ref);
  expect_near(*read.cam_from_ref, *written.cam_from_ref, 1e-12);
}

TEST(CameraModel, ComesBackAfterEveryTurnUpToHalfAround) {
  const std::string path = made::make_temporary_directory() / "made.cameramodel";
  CameraModel model = made_model();
  for (const Vec3 axis : {Vec3{0, 0, -1}, Vec3{0, 0, 1}, Vec3{0, -1, 0}, Vec3{1e-7, 0, 1},
                          Vec3{1, 1, 1}, Vec3{-1, 0, 1e-9}}) {
    model.cam_from_ref = pose_from_axis({1, 2, 3}, axis, 0);
    write_camera_model(path, model);
    expect_near(*read_camera_model(path).cam_from_ref, *model.cam_from_ref, 1e-9);
  }
}

TEST(CameraModel, IsReadByMrcalAsItWasMeant) {
  const std::string path = made::make_temporary_directory() / "made.cameramodel";
  const CameraModel written = made_model();
  write_camera_model(path, written);
  mrcal_cameramodel_t* theirs = mrcal_read_cameramodel_file(path.c_str());
  ASSERT_NE(theirs, nullptr);
  EXPECT_EQ(theirs->lensmodel.type, MRCAL_LENSMODEL_OPENCV4);
  EXPECT_EQ(theirs->imagersize[0], 768U);
  EXPECT_EQ(theirs->imagersize[1], 576U);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(theirs->intrinsics[i], written.lens.parameters[i]);
  }
  EXPECT_NEAR(theirs->rt_cam_ref[5], written.cam_from_ref->t.z, 1e-12);
  mrcal_free_cameramodel(&theirs);
}

TEST(CameraModel, IsReadAlikeUnderALocaleOfCommas) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const std::string path = directory / "made.cameramodel";
  const std::string toml = directory / "made.toml";
  // A locale of our own: machines seldom have one.
  const std::string made = "localedef -i de_DE -f UTF-8 " + (directory / "commas").string();
  ASSERT_EQ(std::system(made.c_str()), 0);
  setenv("LOCPATH", directory.c_str(), 1);
  const std::string before = std::setlocale(LC_NUMERIC, nullptr);
  ASSERT_NE(std::setlocale(LC_NUMERIC, "commas"), nullptr);
  char half[8] = "";
  std::snprintf(half, sizeof half, "%.1f", 0.5);
  write_camera_model(path, made_model());
  write_lens(toml, made_model().lens);
  const Lens read = read_camera_model(path).lens;
  const Lens read_toml = read_lens(toml);
  std::setlocale(LC_NUMERIC, before.c_str());
  unsetenv("LOCPATH");
  EXPECT_STREQ(half, "0,5");
  EXPECT_EQ(read, made_model().lens);
  EXPECT_EQ(read_toml, made_model().lens);
}

TEST(CameraModel, AgreesWithMrcalOnItsOwnFiles) {
  const auto directory = made::real_data() / "calib" / "mrcal";
  if (!std::filesystem::exists(directory)) GTEST_SKIP() << "no real data at " << directory;
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    if (entry.path().extension() != ".cameramodel") continue;
    SCOPED_TRACE(entry.path());
    ++files;
    const CameraModel ours = read_camera_model(entry.path());
    mrcal_cameramodel_t* theirs = mrcal_read_cameramodel_file(entry.path().c_str());
    ASSERT_NE(theirs, nullptr);
    EXPECT_EQ(static_cast<unsigned>(ours.lens.width), theirs->imagersize[0]);
    const auto n = static_cast<std::size_t>(mrcal_lensmodel_num_params(&theirs->lensmodel));
    ASSERT_EQ(ours.lens.parameters.size(), n);
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_EQ(ours.lens.parameters[i], theirs->intrinsics[i]);
    }
    ASSERT_TRUE(ours.cam_from_ref);
    EXPECT_EQ(ours.cam_from_ref->t.x, theirs->rt_cam_ref[3]);
    mrcal_free_cameramodel(&theirs);
    for (double fx = 0.05; fx < 1; fx += 0.15) {
      const Vec2 q{fx * ours.lens.width, 0.4 * ours.lens.height};
      const auto v = unproject(ours.lens, q);
      ASSERT_TRUE(v) << q.x;
      const auto back = project(ours.lens, *v);
      ASSERT_TRUE(back);
      EXPECT_LE(std::hypot(back->x - q.x, back->y - q.y), 1e-6);
    }
  }
  EXPECT_EQ(files, 5);
}

TEST(WriteCameraModel, RefusesLensesThatMrcalDoesNotKnow) {
  const std::string path = made::make_temporary_directory() / "made.cameramodel";
  CameraModel model = made_model();
  model.lens = {"equisolid", 640, 480, {200, 320, 240}};
  EXPECT_THROW(write_camera_model(path, model), std::invalid_argument);
  model = made_model();
  model.lens.max_angle_rad = 1;
  EXPECT_THROW(write_camera_model(path, model), std::invalid_argument);
}

TEST(ReadCameraModel, RefusesEveryBadFileWithLineAndReason) {
  made::expect_refusals(
      "", ".cameramodel",
      {{"empty.cameramodel", ":1: expected '{'"},
       {"truncated.cameramodel", ":3: intrinsics must be a list of numbers"},
       {"no_lensmodel.cameramodel", ": 'lensmodel' is missing"},
       {"no_imagersize.cameramodel", ": 'imagersize' is missing"},
       {"no_intrinsics.cameramodel", ": 'intrinsics' is missing"},
       {"unknown_model.cameramodel", ":2: lens model LENSMODEL_OPENCV7: not supported"},
       {"cahvore_would_abort.cameramodel", ":2: lens model LENSMODEL_CAHVORE"},
       {"spline_of_three_knots.cameramodel", "Nx and Ny must be from 5 to 1000"},
       {"spline_without_configuration.cameramodel", "its name must end in"},
       {"spline_of_order_one.cameramodel", "order must be 2 or 3"},
       {"too_few_intrinsics.cameramodel", ":3: lens model LENSMODEL_OPENCV8 takes 12"},
       {"nan_intrinsics.cameramodel", ":3: intrinsics holds \"nan\""},
       {"focal_length_of_zero.cameramodel", ":3: a focal length must be above 0"},
       {"negative_size.cameramodel", ":5: 'imagersize' must be"},
       {"size_of_three.cameramodel", ":5: 'imagersize' must be"},
       {"five_extrinsics.cameramodel", ":4: 'extrinsics' must be 6 numbers"},
       {"extrinsics_in_degrees.cameramodel", ":4: 'extrinsics' turn by more than a full turn"},
       {"negative_error.cameramodel", ":5: platelight_error_px must be 0 or above"},
       {"too_large_error.cameramodel", ":5: platelight_error_px must be at most"},
       {"open_quote.cameramodel", ":2: a string has no closing quote"},
       {"key_twice.cameramodel", ":4: 'intrinsics' stands here for the second time"},
       {"text_after_the_end.cameramodel", ":7: something follows"},
       {"word_among_numbers.cameramodel", ":3: intrinsics holds \"wide\""}},
      read_camera_model);
}

TEST(ReadCameraModel, EndsAtEveryTruncationAndEveryFlippedByte) {
  const auto directory = made::make_temporary_directory();
  const std::string whole = directory / "whole.cameramodel";
  write_camera_model(whole, made_model());
  std::ifstream file(whole, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string damaged = directory / "damaged.cameramodel";
  for (std::size_t i = 0; i < 2 * text.size(); ++i) {
    std::string changed = i < text.size() ? text.substr(0, i) : text;
    if (i >= text.size()) changed[i - text.size()] ^= '\x15';
    std::ofstream(damaged, std::ios::binary) << changed;
    Lens lens = made_model().lens;
    try {
      lens = read_camera_model(damaged).lens;
    } catch (const std::runtime_error&) {
    }
    EXPECT_NO_THROW(check(lens));
  }
}

TEST(ReadCameraModel, RefusesExtrinsicsThatAreNoPose) {
  const std::string path = made::make_temporary_directory() / "lens.cameramodel";
  std::ofstream(path) << "{ 'lensmodel': 'LENSMODEL_PINHOLE', 'intrinsics': [ 500, 500, 320, 240 "
                         "],\n'extrinsics': [ 1e308, 1e308, 0, 0, 0, 0 ], 'imagersize': [ 640, 480 "
                         "] }\n";
  EXPECT_THROW(read_camera_model(path), std::runtime_error);
}

}  // namespace
}  // namespace calibrate::camera_model_test
