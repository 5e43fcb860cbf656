// Exposure settings from EXIF data.
#include "capture/exif.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <vector>

#include "tests/capture/made_exif.h"
#include "tests/made_files.h"

namespace capture::exif_test {
namespace {

using made::ExifBytes, made::append, made::made_exif;

TEST(SnappedExposureS, IsTheNearestThirdOfAStopForEveryMark) {
  for (const double shown :
       {30.0,       25.0,       20.0,       15.0,       13.0,       10.0,       8.0,
        6.0,        5.0,        4.0,        3.2,        2.5,        2.0,        1.6,
        1.3,        1.0,        0.8,        0.6,        0.5,        0.4,        0.3,
        1 / 4.0,    1 / 5.0,    1 / 6.0,    1 / 8.0,    1 / 10.0,   1 / 13.0,   1 / 15.0,
        1 / 20.0,   1 / 25.0,   1 / 30.0,   1 / 40.0,   1 / 50.0,   1 / 60.0,   1 / 80.0,
        1 / 100.0,  1 / 125.0,  1 / 160.0,  1 / 200.0,  1 / 250.0,  1 / 320.0,  1 / 400.0,
        1 / 500.0,  1 / 640.0,  1 / 800.0,  1 / 1000.0, 1 / 1250.0, 1 / 1600.0, 1 / 2000.0,
        1 / 2500.0, 1 / 3200.0, 1 / 4000.0, 1 / 5000.0, 1 / 6400.0, 1 / 8000.0}) {
    const double thirds = 3 * std::log2(snapped_exposure_s(shown));
    EXPECT_NEAR(thirds, std::round(thirds), 1e-9) << shown;
    EXPECT_EQ(std::round(thirds), std::round(3 * std::log2(shown))) << shown;
  }
}

TEST(SnappedExposureS, KnowsTheMarksOfHalfStops) {
  EXPECT_NEAR(snapped_exposure_s(1 / 45.0), std::exp2(-5.5), 1e-12);
  EXPECT_NEAR(snapped_exposure_s(1 / 350.0), std::exp2(-8.5), 1e-12);
}

TEST(SnappedExposureS, LeavesTimesThatAreNoMarks) {
  for (const double exact : {1 / 33.0, 1 / 121.0, 0.0023, 7.0, 100.0}) {
    EXPECT_EQ(snapped_exposure_s(exact), exact);
  }
}

TEST(SnappedExposureS, RefusesWhatIsNoTime) {
  for (const double wrong : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THROW(snapped_exposure_s(wrong), std::invalid_argument);
  }
}

TEST(ShotSettings, ReadsTimeApertureAndIso) {
  const ShotSettings settings = shot_settings(made_exif(1, 80, 56, 400));
  EXPECT_DOUBLE_EQ(settings.exposure_s, 1 / 80.0);
  EXPECT_DOUBLE_EQ(settings.f_number, 5.6);
  EXPECT_DOUBLE_EQ(settings.iso, 400);
}

TEST(ShotSettings, AreZeroWhereNothingUsableStands) {
  EXPECT_EQ(shot_settings({}).exposure_s, 0);
  EXPECT_EQ(shot_settings(made_exif(1, 0, 56, 400)).exposure_s, 0);
  EXPECT_EQ(shot_settings(made_exif(0, 80, 56, 400)).exposure_s, 0);
}

TEST(ShotSettings, SurviveDamageAnywhere) {
  const ExifBytes good = made_exif(1, 80, 56, 400);
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    ExifBytes bytes = good;
    for (int flips = 0; flips < 3; ++flips) {
      bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    }
    bytes.resize(bytes.size() - random() % (i % 2 == 0 ? 1 : bytes.size()));
    const ShotSettings settings = shot_settings(bytes);
    EXPECT_GE(settings.exposure_s, 0);
    EXPECT_TRUE(std::isfinite(settings.exposure_s));
  }
}

TEST(ExposureValue, DoublesWithTimeIsoAndEveryFullStopOfAperture) {
  const double value = exposure_value({1 / 60.0, 5.6, 100});
  EXPECT_NEAR(exposure_value({1 / 30.0, 5.6, 100}) / value, 2, 1e-9);
  EXPECT_NEAR(exposure_value({1 / 60.0, 5.6, 200}) / value, 2, 1e-9);
  EXPECT_NEAR(exposure_value({1 / 60.0, 4, 100}) / value, 2, 1e-9);
  EXPECT_NEAR(exposure_value({1 / 60.0, 11, 100}) / value, 0.25, 1e-9);
}

TEST(ExposureSOf, ReadsRealBrackets) {
  const auto shots = made::real_data() / "brackets" / "fisheye8mm";
  if (!std::filesystem::exists(shots)) GTEST_SKIP() << "no real data at " << shots;
  EXPECT_NEAR(exposure_s_of(shots / "IMG_6955.JPG"), 12.699, 1e-3);
  EXPECT_NEAR(1 / exposure_s_of(shots / "IMG_6965.JPG"), 80.635, 1e-3);
}

TEST(ExposureSOf, NamesTheFileWithoutATime) {
  const std::string path = PLATELIGHT_SOURCE_DIR "/tests/data/luminance_chroma.exr";
  try {
    exposure_s_of(path);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
  }
}

}  // namespace
}  // namespace capture::exif_test
