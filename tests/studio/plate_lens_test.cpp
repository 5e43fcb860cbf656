// Clean plates that know the lens that filmed them: on the command line, in sets and on air.
#include "studio/plate_lens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calibrate/camera_model.h"
#include "capture/crop.h"
#include "capture/exr.h"
#include "capture/png.h"
#include "compositing/made_clip.h"
#include "studio/person_feed.h"
#include "tests/made_files.h"
#include "tests/studio/command_line.h"
#include "tests/studio/made_show.h"

namespace studio::plate_lens_test {
namespace {

using testing::HasSubstr;
using testing::Not;

calibrate::Lens pinhole(int width, int height, double focal_px) {
  return {"pinhole", width, height, {focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0}};
}

// Lenses of 1080p: a pinhole, one of mrcal's, a fish-eye.
std::vector<calibrate::Lens> made_lenses() {
  const calibrate::Lens plain = pinhole(1920, 1080, 1400);
  calibrate::Lens opencv = plain, fisheye = plain;
  opencv.model = "LENSMODEL_OPENCV4";
  opencv.parameters.insert(opencv.parameters.end(), {-0.12, 0.08, 4e-4, -3e-4});
  fisheye.model = "kannala_brandt";
  fisheye.parameters = {640, 640, 959.5, 539.5, -0.02, 0.004};
  return {plain, opencv, fisheye};
}

TEST(ApartPx, IsNothingOfTheSameLensHoweverItIsWritten) {
  for (const calibrate::Lens& lens : made_lenses()) {
    EXPECT_EQ(apart_px(lens, lens), std::nullopt) << lens.model;
    EXPECT_EQ(apart_px(lens, calibrate::lens_from_text(calibrate::text_of_lens(lens), "lens")),
              std::nullopt);
  }
  calibrate::Lens named = made_lenses().front();
  named.model = "LENSMODEL_PINHOLE";
  EXPECT_EQ(apart_px(made_lenses().front(), named), std::nullopt);
}

// As calibrations of one lens differ: focal lengths by .1 %, the centre by pixels, which a turn of
// the camera takes back, terms in their third digit.
TEST(ApartPx, IsNothingOfTheSameLensCalibratedAnew) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (const calibrate::Lens& lens : made_lenses()) {
    for (int i = 0; i < 20; ++i) {
      calibrate::Lens anew = lens;
      const double focal = 1 + 5e-4 * normal(random);
      for (const std::size_t k : {0, 1}) anew.parameters[k] *= focal;
      for (const std::size_t k : {2, 3}) anew.parameters[k] += normal(random);
      for (std::size_t k = 4; k < anew.parameters.size(); ++k)
        anew.parameters[k] += 5e-4 * normal(random);
      EXPECT_EQ(apart_px(lens, anew), std::nullopt) << lens.model << " " << i;
    }
  }
}

// mrcal's, of one calibration, as a spline and as a polynomial.
TEST(ApartPx, IsNothingOfTwoModelsOfOneRealLens) {
  const auto dir = made::real_data() / "calib" / "mrcal";
  if (!std::filesystem::exists(dir)) GTEST_SKIP() << "no real data at " << dir;
  const calibrate::Lens spline = calibrate::read_lens(dir / "splined-0.cameramodel");
  calibrate::Lens polynomial = calibrate::read_lens(dir / "opencv8-0.cameramodel");
  EXPECT_EQ(apart_px(spline, polynomial), std::nullopt);
  for (const std::size_t k : {0, 1}) polynomial.parameters[k] *= 1.01;
  EXPECT_GT(apart_px(spline, polynomial), 16);
}

TEST(ApartPx, IsWhatAFocusOfOnePercentDoesToTheMiddle) {
  for (const calibrate::Lens& lens : made_lenses()) {
    for (const double focus : {0.99, 1.01}) {
      calibrate::Lens breathed = lens;
      for (const std::size_t k : {0, 1}) breathed.parameters[k] *= focus;
      const auto apart = apart_px(breathed, lens);
      ASSERT_TRUE(apart) << lens.model;
      EXPECT_NEAR(*apart, 6, 0.4) << lens.model;
    }
  }
}

// Where no board was held, calibrations differ by anything.
TEST(ApartPx, PassesOverTheRim) {
  const calibrate::Lens lens = made_lenses()[1];
  calibrate::Lens rim{"LENSMODEL_OPENCV5", 1920, 1080, lens.parameters};
  rim.parameters.push_back(0.1);
  const auto corner = calibrate::unproject(lens, {0, 0}).value();
  const auto moved = calibrate::project(rim, corner).value();
  EXPECT_GT(std::hypot(moved.x, moved.y), 20);
  EXPECT_EQ(apart_px(lens, rim), std::nullopt);
}

TEST(ApartPx, ComparesWhatBothLensesSee) {
  calibrate::Lens narrow = made_lenses()[2];
  narrow.max_angle_rad = 0.6;
  EXPECT_EQ(apart_px(narrow, made_lenses()[2]), std::nullopt);
  EXPECT_GT(apart_px(made_lenses()[2], made_lenses()[0]), 100);
  EXPECT_GT(apart_px(made_lenses()[0], made_lenses()[2]), 100);
}

// The clips of a camera of 160x90 pixels before a green screen.
class KeyWithLens : public CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    const compositing::MadeClip clip(compositing::made_scene("plain"), 2, 90, 160);
    for (int i = 0; i < 2; ++i) {
      write_picture("empty", i, clip.plate_shot(i));
      write_picture("take", i, clip.frame(i).seen);
    }
    calibrate::write_lens(in("studio.cameramodel"), pinhole(160, 90, 208.6));
    calibrate::write_lens(in("wide.cameramodel"), pinhole(160, 90, 162.4));
  }
  void write_picture(const char* name, int number, const compositing::MadePicture& picture) const {
    const std::string file = std::string(name) + "_000" + std::to_string(number) + ".png";
    capture::write_png(dir_ / file, picture.width, picture.height, 3, picture.codes);
  }
  std::string in(const std::string& name) const { return (dir_ / name).string(); }
  Outcome take_plate(const std::string& lens) const {
    return run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr") +
               " --json " + in("plate.json") + (lens.empty() ? "" : " --lens " + in(lens)));
  }
  Outcome key(const std::string& lens) const {
    fs::remove_all(in("keyed"));
    return run("key " + in("take_%04d.png") + " --colour sRGB --plate " + in("plate.exr") + " -o " +
               in("keyed") + (lens.empty() ? "" : " --lens " + in(lens)));
  }
};

TEST_F(KeyWithLens, NotesTheLensOfAPlate) {
  const Outcome plate = take_plate("studio.cameramodel");
  ASSERT_EQ(plate.status, 0) << plate.err;
  EXPECT_THAT(plate.out, HasSubstr("with a focal length of 208.6 px (LENSMODEL_PINHOLE)"));
  EXPECT_EQ(nlohmann::json::parse(content_of(in("plate.json")))["lens"], in("studio.cameramodel"));
  const auto noted = read_plate_lens(in("plate.exr"));
  ASSERT_TRUE(noted);
  EXPECT_EQ(noted->parameters, pinhole(160, 90, 208.6).parameters);
  ASSERT_EQ(take_plate("").status, 0);
  EXPECT_EQ(read_plate_lens(in("plate.exr")), std::nullopt);
  EXPECT_EQ(read_plate_lens(in("empty_0000.png")), std::nullopt);
}

TEST_F(KeyWithLens, RefusesAPlateOfAnotherLensAndNamesBoth) {
  ASSERT_EQ(take_plate("wide.cameramodel").status, 0);
  const Outcome keyed = key("studio.cameramodel");
  EXPECT_EQ(keyed.status, 1);
  expect_one_line(keyed.err);
  EXPECT_THAT(keyed.err, HasSubstr(in("plate.exr") + " was filmed through a lens with a focal "
                                                     "length of 162.4 px (LENSMODEL_PINHOLE)"));
  EXPECT_THAT(keyed.err, HasSubstr(in("studio.cameramodel") + ", has a focal length of 208.6 px"));
  EXPECT_THAT(keyed.err, testing::ContainsRegex("up to 1[0-9]\\.[0-9]+ px apart"));
  EXPECT_THAT(keyed.err, HasSubstr("platelight key plate CAMERA --lens " +
                                   in("studio.cameramodel") + " -o plate.exr"));
  EXPECT_FALSE(fs::exists(in("keyed")));
}

TEST_F(KeyWithLens, GoesOnWhereOnlyOneLensIsKnown) {
  ASSERT_EQ(take_plate("").status, 0);
  EXPECT_EQ(key("studio.cameramodel").err, "");
  ASSERT_EQ(take_plate("studio.cameramodel").status, 0);
  EXPECT_EQ(key("").err, "");
}

TEST_F(KeyWithLens, AcceptsTheLensAtAnotherPoseAndCalibratedAnew) {
  ASSERT_EQ(take_plate("studio.cameramodel").status, 0);
  EXPECT_EQ(key("studio.cameramodel").err, "");
  calibrate::write_camera_model(
      in("moved.cameramodel"),
      {pinhole(160, 90, 208.6), calibrate::look_at({3, -5, 1.6}, {0, 0, 1}, 0.2)});
  EXPECT_EQ(key("moved.cameramodel").err, "");
  calibrate::write_lens(in("anew.toml"), pinhole(160, 90, 208.9));
  EXPECT_EQ(key("anew.toml").err, "");
}

TEST_F(KeyWithLens, NotesAnotherLensInAPlateThatIsThere) {
  ASSERT_EQ(take_plate("wide.cameramodel").status, 0);
  const auto noise = capture::read_exr_noise(in("plate.exr"));
  ASSERT_TRUE(noise);
  const Outcome noted = run("key plate " + in("plate.exr") + " --lens " + in("studio.cameramodel") +
                            " -o " + in("noted.exr"));
  ASSERT_EQ(noted.status, 0) << noted.err;
  EXPECT_EQ(capture::read_exr(in("noted.exr")).pixels, capture::read_exr(in("plate.exr")).pixels);
  EXPECT_EQ(capture::read_exr_noise(in("noted.exr")), noise);
  EXPECT_EQ(capture::read_exr_transfer(in("noted.exr")), "sRGB");
  fs::rename(in("noted.exr"), in("plate.exr"));
  EXPECT_EQ(key("studio.cameramodel").err, "");
}

TEST_F(KeyWithLens, RefusesALensThatIsNotForThePictureAndSparesItsFile) {
  calibrate::write_lens(in("whole.cameramodel"), pinhole(320, 180, 417));
  const Outcome plate = take_plate("whole.cameramodel");
  EXPECT_EQ(plate.status, 1);
  EXPECT_THAT(plate.err,
              HasSubstr("is 160x90, but the lens " + in("whole.cameramodel") + " is for 320x180"));
  expect_one_line(plate.err);
  EXPECT_FALSE(fs::exists(in("plate.exr")));
  ASSERT_EQ(take_plate("").status, 0);
  EXPECT_THAT(key("whole.cameramodel").err, HasSubstr("is for 320x180"));
  EXPECT_EQ(key("missing.cameramodel").status, 1);
  const Outcome lossy =
      run("key plate " + in("empty_%04d.png") + " --lens " + in("studio.cameramodel") + " -o " +
          in("a.exr") + " --json " + in("studio.cameramodel"));
  EXPECT_EQ(lossy.status, 1);
  EXPECT_THAT(lossy.err, HasSubstr("would be lost"));
}

// Notes that were broken, or made to harm.
TEST_F(KeyWithLens, RefusesANoteThatIsNoLensIfTheClipsIsKnown) {
  const capture::Image light = [&] {
    EXPECT_EQ(take_plate("").status, 0);
    return capture::read_exr(in("plate.exr"));
  }();
  const std::string size = "width = 160\nheight = 90\n";
  const std::string centre = "fy = 200\ncx = 79.5\ncy = 44.5\n";
  std::string deep(100'000, '[');
  for (const auto& [text, why] : std::vector<std::pair<std::string, std::string>>{
           {"a lens of glass", "the lens that it notes:1:"},
           {"model = \"pinhole\"\n" + size, "\"fx\" is missing"},
           {"model = \"pinhole\"\n" + size + "fx = 0\n" + centre, "must be above 0"},
           {"model = \"pinhole\"\n" + size + "fx = nan\n" + centre, "must be finite"},
           {"model = \"pinhole\"\nwidth = 1\nheight = 0\nfx = 9\n" + centre, "\"height\" must be"},
           {"model = \"\\u001b[2J\"\n" + size, "?[2J"},
           {"model = \"" + std::string(200'000, 'x') + "\"\n" + size, "..."},
           {"model = " + deep, "the lens that it notes:1:"},
           {"model = \"LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=2000000000_Ny=2000000000_fov_x_"
            "deg=100\"\nparameters = [1, 2]\n" +
                size,
            "the lens that it notes:"},
           {"model = \"pinhole\"\nwidth = 320\nheight = 180\nfx = 9\n" + centre,
            "notes a lens whose picture is 320x180, but is 160x90"}}) {
    capture::write_exr(in("plate.exr"), light, {.transfer = "sRGB", .lens = text});
    const Outcome keyed = key("studio.cameramodel");
    EXPECT_EQ(keyed.status, 1) << text.substr(0, 99);
    expect_one_line(keyed.err);
    EXPECT_LT(keyed.err.size(), 900U);
    EXPECT_THAT(keyed.err, HasSubstr("the clean plate " + in("plate.exr")));
    EXPECT_THAT(keyed.err, HasSubstr(why));
    EXPECT_THAT(keyed.err, HasSubstr("platelight key plate"));
    EXPECT_THAT(keyed.err, Not(HasSubstr("\x1b")));
    EXPECT_EQ(key("").err, "") << text.substr(0, 99);
  }
}

// Persons before a green screen of 64x48, which nobody leaves or enters.
class PlateLensInSet : public MadeShowTest {
 protected:
  static void SetUpTestSuite() {
    MadeShowTest::SetUpTestSuite();
    capture::register_camera("green", [](std::string_view, const capture::CameraOptions& options) {
      return std::make_unique<Green>(options.crop);
    });
  }

  class Green final : public capture::Camera {
   public:
    explicit Green(const std::optional<std::array<int, 4>>& crop)
        : crop_(capture::crop_within(crop, 64, 48)) {
      info_.width = crop_.width, info_.height = crop_.height;
      info_.whole_width = 64, info_.whole_height = 48;
      info_.rate = {25, 1};
    }
    const capture::CameraInfo& info() const override { return info_; }
    capture::CameraStatistics statistics() const override { return {}; }
    std::optional<capture::Frame> next() override {
      auto image = std::make_shared<capture::Image>(picture());
      capture::cut(*image, crop_);
      capture::Frame frame;
      frame.image = std::move(image);
      frame.number = number_;
      frame.time = capture::time_of_frame(number_++, info_.rate);
      return frame;
    }

   private:
    capture::CameraInfo info_;
    capture::Crop crop_;
    std::int64_t number_ = 0;
  };
  static capture::Image picture() {
    capture::Image image = capture::make_image(48, 64);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
      image.pixels[i] = std::array{0.05F, 0.4F, 0.08F}[i % 3];
    return image;
  }

  void write_plate(const std::string& name, double focal_px) const {
    capture::ExrOptions options;
    if (focal_px > 0) options.lens = calibrate::text_of_lens(pinhole(64, 48, focal_px));
    capture::write_exr(dir_ / name, picture(), options);
  }
  Set set_with(const std::string& lens,
               const std::string& key,
               const std::string& more = "") const {
    return made_set("grey:500,25,0",
                    "[[billboard]]\nname = \"she\"\nposition = [0, -1, 0]\nsource = \"green:\"\n" +
                        lens + "pose = { position = [0, -6, 1.5], look_at = [0, 0, 1] }\n" + more +
                        "key = { " + key + " }\n");
  }
  static std::string lens_of(double focal_px) {
    return "lens = { model = \"pinhole\", size = [64, 48], focal_px = " + std::to_string(focal_px) +
           " }\n";
  }
  static std::string faults_of(const Set& set, const PersonFeed* before = nullptr) {
    try {
      const PersonFeed feed(set, std::nullopt, false, before);
      return "";
    } catch (const SetError& error) {
      return error.what();
    }
  }
};

TEST_F(PlateLensInSet, RefusesAPlateOfAnotherLensAndNamesBoth) {
  write_plate("plate.exr", 80);
  calibrate::write_lens(dir_ / "studio.cameramodel", pinhole(64, 48, 100));
  const std::string file = "lens = \"studio.cameramodel\"\n";
  const std::string faults = faults_of(set_with(file, "plate = \"plate.exr\""));
  EXPECT_THAT(faults, HasSubstr("made.toml:"));
  EXPECT_THAT(faults, HasSubstr((dir_ / "plate.exr").string() + " was filmed through a lens with a "
                                                                "focal length of 80 px (pinhole)"));
  EXPECT_THAT(faults,
              HasSubstr((dir_ / "studio.cameramodel").string() + ", has a focal length of 100 px"));
  EXPECT_THAT(faults, testing::ContainsRegex("up to [0-9]+\\.[0-9]+ px apart"));
  EXPECT_THAT(faults_of(set_with(lens_of(100), "plate = \"plate.exr\"")),
              HasSubstr("but the clip's, as the set has it, has a focal length of 100 px"));
}

TEST_F(PlateLensInSet, AcceptsTheSameLensAndOneThatIsNotKnown) {
  for (const double noted : {0.0, 100.0, 100.2}) {
    write_plate("plate.exr", noted);
    EXPECT_EQ(faults_of(set_with(lens_of(100), "plate = \"plate.exr\"")), "") << noted;
  }
  write_plate("plate.exr", 80);
  EXPECT_EQ(
      faults_of(made_set("grey:500,25,0",
                         "[[billboard]]\nposition = [0, -1, 0]\nsource = \"green:\"\nheight = "
                         "2\nkey = { plate = \"plate.exr\" }\n")),
      "");
}

TEST_F(PlateLensInSet, ComparesTheLensesOfThePartThatIsShown) {
  const std::string crop = "crop = [30, 10, 32, 36]\n";
  write_plate("plate.exr", 100);
  EXPECT_EQ(faults_of(set_with(lens_of(100), "plate = \"plate.exr\"", crop)), "");
  write_plate("plate.exr", 80);
  EXPECT_THAT(faults_of(set_with(lens_of(100), "plate = \"plate.exr\"", crop)),
              HasSubstr("was filmed through a lens"));
}

TEST_F(PlateLensInSet, NamesTheLensOfARig) {
  write_plate("plate.exr", 80);
  calibrate::write_lens(dir_ / "left.cameramodel", pinhole(64, 48, 100));
  std::ofstream(dir_ / "rig.toml") << "[[camera]]\nname = \"left\"\nlens = \"left.cameramodel\"\n"
                                      "position = [0, 0, 0]\n"
                                      "rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";
  const Set set = made_set(
      "grey:500,25,0",
      "[rig]\nfile = \"rig.toml\"\npose = { position = [0, -6, 1.5], look_at = [0, 0, 1] }\n"
      "[[billboard]]\nposition = [0, -1, 0]\nsource = \"green:\"\nrig_camera = \"left\"\n"
      "key = { plate = \"plate.exr\" }\n");
  EXPECT_THAT(faults_of(set), HasSubstr((dir_ / "left.cameramodel").string()));
}

// On air, a plate is of the lens that the set had.
TEST_F(PlateLensInSet, KeepsAPlateThatWasTakenOnAirForItsOwnLensAlone) {
  const std::string take = "plate = \"take\"";
  const Set set = set_with(lens_of(100), take);
  PersonFeed feed(set, std::nullopt, false);
  for (int i = 0; i < 60; ++i)
    feed.at(capture::time_of_frame(i, {25, 1}), set.camera.pose.cam_from_set);
  EXPECT_EQ(faults_of(set_with(lens_of(100.2), take), &feed), "");
  const std::string faults = faults_of(set_with(lens_of(80), take), &feed);
  EXPECT_THAT(faults, HasSubstr("the plate was taken on air through a lens with a focal length of "
                                "100 px (pinhole), but the set's, written there, has a focal "
                                "length of 80 px"));
  EXPECT_THAT(faults, HasSubstr("Give `take` another number"));
  EXPECT_EQ(faults_of(set_with(lens_of(80), take + ", take = 1"), &feed), "");
}

}  // namespace
}  // namespace studio::plate_lens_test
