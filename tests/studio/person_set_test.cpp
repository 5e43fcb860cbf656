// Sets in which persons stand: keyed, placed by their feet, seen by the show's camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <span>

#include "calibrate/lens.h"
#include "capture/crop.h"
#include "capture/png.h"
#include "compositing/display.h"
#include "studio/show.h"
#include "tests/studio/made_show.h"

namespace studio::person_set_test {
namespace {

using testing::HasSubstr;

constexpr int video_width = 480, video_height = 360;
constexpr double video_focal_px = 500;
const calibrate::Lens video_lens{
    "pinhole",
    video_width,
    video_height,
    {video_focal_px, video_focal_px, (video_width - 1) / 2.0, (video_height - 1) / 2.0}};
const calibrate::Vec3 video_position{0, -6, 1.5};
constexpr std::array screen{0.05F, 0.45F, 0.08F};
constexpr std::array cloth{0.45F, 0.12F, 0.10F};

// Where the walker's feet are in frame n, before the set's cube: towards the camera, and a little
// to the side.
calibrate::Vec3 feet_at(std::int64_t n) {
  const auto t = static_cast<double>(n) / 25;
  return {-0.4 + 0.3 * t, -1.4 - 1.1 * t, 0};
}

// The walker's shape, cut out of a board: legs, body and head.
bool is_body(double aside, double up) {
  if (up < 0 || up > 1.7) return false;
  if (up < 0.8) return aside > 0.03 && aside < 0.18;
  return up < 1.42 ? aside < 0.23 : aside < 0.10;
}

// An upright board of 1.7 m that walks before a green screen, as its camera sees it, again and
// again.
class Walker final : public capture::Camera {
 public:
  Walker(std::int64_t frames,
         std::int64_t pass,
         const std::optional<std::array<int, 4>>& crop,
         double roll_rad = 0)
      : crop_(capture::crop_within(crop, video_width, video_height)),
        frames_(frames),
        pass_(pass),
        roll_rad_(roll_rad) {
    info_.width = crop_.width;
    info_.height = crop_.height;
    info_.whole_width = video_width;
    info_.whole_height = video_height;
    info_.rate = {25, 1};
    info_.frames = frames;
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return {}; }

  std::optional<capture::Frame> next() override {
    if (number_ == frames_) return std::nullopt;
    const calibrate::Pose cam_from_set = calibrate::look_at(video_position, {0, 0, 1}, roll_rad_);
    const calibrate::Pose set_from_cam = inverse(cam_from_set);
    const calibrate::Vec3 feet = feet_at(number_ % pass_);
    auto image = std::make_shared<capture::Image>(capture::make_image(video_height, video_width));
    constexpr int parts = 3;
    for (int y = 0; y < video_height; ++y) {
      for (int x = 0; x < video_width; ++x) {
        int met = 0;
        for (int i = 0; i < parts * parts; ++i) {
          const auto v = calibrate::unproject(video_lens, {x + (i % parts + 0.5) / parts - 0.5,
                                                           y + (i / parts + 0.5) / parts - 0.5});
          const calibrate::Vec3 d = set_from_cam.R * *v;
          const double k = (feet.y - video_position.y) / d.y;
          const double px = video_position.x + k * d.x, pz = video_position.z + k * d.z;
          met += is_body(std::abs(px - feet.x), pz);
        }
        const float alpha = static_cast<float>(met) / (parts * parts);
        for (int c = 0; c < 3; ++c) {
          const auto i = static_cast<std::size_t>(c);
          image->at(y, x, c) = alpha * cloth[i] + (1 - alpha) * screen[i];
        }
      }
    }
    capture::Frame frame;
    frame.number = number_;
    frame.pass_first = number_ - number_ % pass_;
    frame.time = capture::time_of_frame(number_, info_.rate);
    capture::cut(*image, crop_);
    frame.image = std::move(image);
    ++number_;
    return frame;
  }

 private:
  capture::CameraInfo info_;
  capture::Crop crop_;
  std::int64_t frames_, pass_, number_ = 0;
  double roll_rad_;
};

constexpr const char* walker = R"([[billboard]]
name = "walker"
source = "walker:20"
lens = { model = "pinhole", focal_px = 500, size = [480, 360] }
pose = { position = [0, -6, 1.5], look_at = [0, 0, 1] }
feet = "auto"
key = { plate = "plate.exr" }
)";

class PersonSetTest : public MadeShowTest {
 protected:
  static void SetUpTestSuite() {
    MadeShowTest::SetUpTestSuite();
    // walker:FRAMES, or walker:FRAMES/THOSE OF A PASS
    capture::register_camera("walker", [](std::string_view rest,
                                          const capture::CameraOptions& options) {
      const std::int64_t frames = std::stol(std::string(rest));
      const auto slash = rest.find('/');
      const bool loops = slash != std::string_view::npos;
      return std::make_unique<Walker>(
          frames, loops ? std::stol(std::string(rest.substr(slash + 1))) : frames, options.crop);
    });
    capture::register_camera("rolled", [](std::string_view, const capture::CameraOptions& options) {
      return std::make_unique<Walker>(6, 6, options.crop, std::numbers::pi / 2);
    });
  }
  void SetUp() override {
    MadeShowTest::SetUp();
    write_plate(video_width, video_height);
  }
  void write_plate(int width, int height) const {
    capture::Image plate = capture::make_image(height, width);
    for (std::size_t i = 0; i < plate.pixels.size(); ++i) plate.pixels[i] = screen[i % 3];
    capture::write_exr((dir_ / "plate.exr").string(), plate);
  }
};

TEST_F(PersonSetTest, StandsWhereItsFeetAreAndIsSeenThere) {
  Show show(made_set("grey:20,25,0", walker));
  int frame = 0;
  show.run([&](const ShownFrame& shown) {
    ASSERT_EQ(shown.prepared.persons.size(), 1U);
    const PersonStatus& person = shown.prepared.persons[0];
    EXPECT_EQ(person.feet, "seen") << frame;
    EXPECT_GT(person.confidence, 0.7) << frame;
    const calibrate::Vec3 truth = feet_at(frame);
    EXPECT_NEAR(person.position.x, truth.x, 0.18) << frame << ": one of both feet";
    EXPECT_NEAR(person.position.y, truth.y, 0.04) << frame;
    EXPECT_EQ(person.position.z, 0);
    // The middle of the body, in the show's picture of 64x48 from (0, -8, 4).
    const calibrate::Pose cam_from_set = shown.prepared.job.cam_from_set;
    const auto q = calibrate::project(*shown.prepared.lens,
                                      cam_from_set * calibrate::Vec3{truth.x, truth.y, 1.0});
    ASSERT_TRUE(q);
    const capture::HalfImage& rgba = shown.result->rgba;
    const std::size_t at =
        rgba.index(static_cast<int>(std::lround(q->y)), static_cast<int>(std::lround(q->x)));
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(capture::float_from_half(rgba.pixels[at + c]), cloth[c], 0.03) << frame;
    }
    EXPECT_NEAR(capture::float_from_half(rgba.pixels[at + 3]), 1, 0.02) << frame;
    ++frame;
  });
  EXPECT_EQ(frame, 20);
  EXPECT_TRUE(show.status()->notes.empty()) << show.status()->notes.front();
}

TEST_F(PersonSetTest, StandsWhereItsFeetAreBeforeACameraOnItsSide) {
  std::string rolled = walker;
  rolled.replace(rolled.find("walker:20"), 9, "rolled:");
  rolled.replace(rolled.find("look_at = [0, 0, 1]"), 19, "look_at = [0, 0, 1], roll = 90");
  Show show(made_set("grey:6,25,0", rolled));
  int frame = 0;
  show.run([&](const ShownFrame& shown) {
    const PersonStatus& person = shown.prepared.persons.at(0);
    const calibrate::Vec3 truth = feet_at(frame++);
    EXPECT_EQ(person.feet, "seen");
    EXPECT_NEAR(person.position.x, truth.x, 0.18) << "one of both feet";
    EXPECT_NEAR(person.position.y, truth.y, 0.04);
  });
  EXPECT_EQ(frame, 6);
}

// From the side the board's two feet are .36 m apart: the plane is before both.
TEST_F(PersonSetTest, StandsBeforeBothFeetHoweverItTurns) {
  for (const double side : {-3.0, 3.0}) {
    Set set = made_set("grey:4,25,0", walker);
    set.camera.pose.cam_from_set = calibrate::look_at({side, -6.5, 1.5}, feet_at(0), 0);
    Show show(set);
    int frame = 0;
    show.run([&](const ShownFrame& shown) {
      const auto& m = shown.prepared.scene->description().instances.back().set_from_object;
      const calibrate::Vec3 front{-m[1], -m[5], 0}, on_plane{m[3], m[7], 0};
      const calibrate::Vec3 feet = feet_at(frame++);
      for (const double aside : {-0.18, 0.18}) {
        const calibrate::Vec3 foot = feet + calibrate::Vec3{aside, 0, 0};
        EXPECT_LT(dot(foot - on_plane, front), 0.02) << side;
        EXPECT_GT(dot(foot - on_plane, front), -0.3) << side;
      }
    });
    EXPECT_EQ(frame, 4);
  }
}

TEST_F(PersonSetTest, IsCutOffByAGarbageMaskThatEndsTheLegs) {
  capture::Image mask = capture::make_image(video_height, video_width);
  for (int y = 230; y < video_height; ++y)
    for (int x = 0; x < video_width; ++x)
      for (int c = 0; c < 3; ++c) mask.at(y, x, c) = 1;
  capture::write_exr((dir_ / "mask.exr").string(), mask);
  std::string masked = walker;
  masked.replace(masked.find("key = {"), 7, "key = { garbage = \"mask.exr\", ");
  Show show(made_set("grey:6,25,0", masked));
  std::vector<std::string> told;
  show.run([&](const ShownFrame& shown) {
    EXPECT_EQ(shown.prepared.persons.at(0).feet, "cut off");
    EXPECT_FALSE(shown.prepared.persons.at(0).stands);
    told.insert(told.end(), shown.prepared.notes.begin(), shown.prepared.notes.end());
  });
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0], HasSubstr("walker: its feet are cut off; it is not shown"));
}

// The show's camera is the person's own, but for what a float loses.
TEST_F(PersonSetTest, SaysNothingOfTheSideWhereItNeverTurnsAndIsSeenFromItsCamera) {
  std::string still = walker;
  still.replace(still.find("feet = "), 7, "turn = 0\nfeet = ");
  Set set = made_set("grey:4,25,0", still);
  set.camera.pose.cam_from_set =
      calibrate::look_at(video_position + calibrate::Vec3{0.001, 0, 0}, {0, 0, 1}, 0);
  Show show(set);
  show.run([&](const ShownFrame& shown) {
    EXPECT_THAT(shown.prepared.notes, testing::IsEmpty());
    EXPECT_FALSE(shown.prepared.persons.at(0).shallow);
  });
}

// From one frame to the next it is .8 m away.
TEST_F(PersonSetTest, StandsAtOnceWhereItsFeetAreWhenItsClipBeginsAgain) {
  std::string looped = walker;
  looped.replace(looped.find("walker:20"), 9, "walker:24/20");
  Show show(made_set("grey:24,25,0", looped));
  int frame = 0;
  show.run([&](const ShownFrame& shown) {
    const PersonStatus& person = shown.prepared.persons.at(0);
    EXPECT_EQ(person.feet, "seen") << frame;
    EXPECT_FALSE(person.held) << frame;
    EXPECT_NEAR(person.position.y, feet_at(frame % 20).y, 0.04) << frame;
    ++frame;
  });
  EXPECT_EQ(frame, 24);
}

// Its camera looks up, by the set: whatever it shows is above the horizon.
TEST_F(PersonSetTest, SaysOnceThatAPersonWhoIsSeenCannotBePlaced) {
  std::string upward = walker;
  upward.replace(upward.find("look_at = [0, 0, 1]"), 19, "look_at = [0, 0, 6]");
  Show show(made_set("grey:6,25,0", upward));
  std::vector<std::string> told;
  show.run([&](const ShownFrame& shown) {
    EXPECT_EQ(shown.prepared.persons.at(0).feet, "uncertain");
    told.insert(told.end(), shown.prepared.notes.begin(), shown.prepared.notes.end());
  });
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0], HasSubstr("walker: its feet are uncertain; it is not shown"));
}

// Nowhere, rather than anywhere: its picture lies below the floor, where it is said to stand.
TEST_F(PersonSetTest, SaysOnceThatAPictureMeetsNothingWhereItIsToStand) {
  std::string above = walker;
  above.replace(above.find("feet = \"auto\""), 13, "position = [0, -5.9, 40]");
  above.replace(above.find("look_at = [0, 0, 1]"), 19, "look_at = [0, -5.8, 40]");
  Show show(made_set("grey:6,25,0", above));
  std::vector<std::string> told;
  show.run([&](const ShownFrame& shown) {
    told.insert(told.end(), shown.prepared.notes.begin(), shown.prepared.notes.end());
    const std::array<float, 12>& place =
        shown.prepared.persons.at(0).stands
            ? shown.prepared.scene->description().instances.back().set_from_object
            : std::array<float, 12>{};
    EXPECT_LT(std::abs(place[0]), 1e-3F) << "hidden";
  });
  EXPECT_THAT(told, testing::Contains(HasSubstr("walker: is not shown")));
}

TEST_F(PersonSetTest, GivesTheSameBitsWhateverTheTiming) {
  const Set set = made_set("grey:8,25,0", walker);
  const auto pictures_of = [&](int slow_ms) {
    Show show(set);
    std::vector<std::vector<capture::Half>> pictures;
    show.run([&](const ShownFrame& shown) {
      pictures.push_back(shown.result->rgba.pixels);
      std::this_thread::sleep_for(std::chrono::milliseconds(slow_ms));
    });
    return pictures;
  };
  EXPECT_EQ(pictures_of(0), pictures_of(20));
}

// Its lens and its plate are those of the whole picture; masks may be.
TEST_F(PersonSetTest, LooksTheSameInAPartOfItsVideo) {
  const auto shown_with = [&](const std::string& key, const std::string& more) {
    std::string section = walker;
    section.replace(section.find("plate.exr\""), 10, "plate.exr\"" + key);
    Show show(made_set("grey:4,25,0", section + more));
    std::vector<std::pair<capture::Image, calibrate::Vec3>> frames;
    show.run([&](const ShownFrame& shown) {
      frames.emplace_back(capture::to_float(shown.result->rgba),
                          shown.prepared.persons.at(0).position);
    });
    EXPECT_EQ(frames.size(), 4U);
    return frames;
  };
  // White above the head, which is in the way of nobody.
  std::vector<std::uint8_t> mask(std::size_t{video_width} * video_height * 3);
  std::fill_n(mask.begin(), 3 * video_width * 20, std::uint8_t{255});
  capture::write_png(dir_ / "mask.png", video_width, video_height, 3, mask);
  const std::string masked = ", garbage = \"mask.png\"";
  const auto whole = shown_with(masked, ""),
             part = shown_with(masked, "crop = [120, 30, 200, 330]\n");
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const auto& [picture, feet] = whole[n];
    EXPECT_LT(calibrate::length(part.at(n).second - feet), 0.01) << n;
    double difference = 0;
    for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
      difference += std::abs(picture.pixels[i] - part[n].first.pixels[i]);
    }
    EXPECT_LT(difference / static_cast<double>(picture.pixels.size()), 1e-3) << n;
  }
  try {
    made_set("grey:4,25,0", std::string(walker) + "crop = [300, 0, 200, 300]\n");
    FAIL();
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("reaches beyond the lens's picture of 480x360"));
  }
}

// Keyed before it is filtered, or after: where the person fills many pixels, the same. So it is
// where its camera's pose is not known, and the billboard of what is keyed before is cut to it.
TEST_F(PersonSetTest, LooksTheSameKeyedByFramesAndByTexels) {
  for (const std::string camera : {"lens = ", "height = 2.4\n#"}) {
    SCOPED_TRACE(camera);
    const auto pictures_keyed_by = [&](const std::string& by) {
      std::string section = walker;
      const auto replace = [&](const std::string& from, const std::string& to) {
        section.replace(section.find(from), from.size(), to);
      };
      replace("lens = ", camera);
      if (camera != "lens = ") replace("pose", "#pose");
      replace("feet = \"auto\"", "position = [0, -1.5, 0]");  // feet need the whole matte
      replace("plate.exr\"", "plate.exr\", smoothing = 0, by = \"" + by + "\"");
      Show show(made_set("grey:6,25,0", section));
      std::vector<capture::Image> pictures;
      show.run([&](const ShownFrame& shown) {
        EXPECT_GT(shown.prepared.persons[0].confidence, 0.7);
        pictures.push_back(capture::to_float(shown.result->rgba));
      });
      return pictures;
    };
    const auto frames = pictures_keyed_by("frame"), texels = pictures_keyed_by("texel");
    ASSERT_EQ(frames.size(), 6U);
    ASSERT_EQ(texels.size(), 6U);
    double difference = 0;
    int on_person = 0, clear = 0;
    for (std::size_t n = 0; n < frames.size(); ++n) {
      for (int y = 0; y < 48; ++y) {
        for (int x = 0; x < 64; ++x) {
          const float by_frame = frames[n].at(y, x, 0), by_texel = texels[n].at(y, x, 0);
          // Where red cloth stands out from the grey plate.
          const bool person = frames[n].at(y, x, 0) > 2 * frames[n].at(y, x, 2);
          on_person += person;
          clear += frames[n].at(y, x, 3) == 0 && texels[n].at(y, x, 3) == 0;
          if (person) {
            EXPECT_NEAR(by_texel, by_frame, 0.1) << n << " " << x << " " << y;
          }
          difference += std::abs(by_texel - by_frame);
        }
      }
    }
    EXPECT_GT(on_person, 6 * 20);
    EXPECT_GT(clear, 6 * 64 * 48 / 4);
    EXPECT_LT(difference / (6 * 64 * 48), 0.002);
  }
}

// Of the first frames of a video, row by row.
std::vector<std::uint8_t> codes_of(const std::string& file, const char* format, std::size_t size) {
  std::vector<std::uint8_t> codes(size);
  const std::string command =
      "ffmpeg -v error -i " + file + " -f rawvideo -pix_fmt " + format + " -";
  std::FILE* pipe = ::popen(command.c_str(), "r");
  EXPECT_NE(pipe, nullptr);
  EXPECT_EQ(std::fread(codes.data(), 1, size, pipe), size) << file;
  EXPECT_EQ(std::fgetc(pipe), EOF) << file;
  ::pclose(pipe);
  return codes;
}

// An external keyer's mix of a set with a person, an object, and the shadows of both.
TEST_F(PersonSetTest, IsMixedFromFillAndKeyInEveryCode) {
  constexpr std::size_t frames = 8, pixels = 64 * 48;
  Show show(made_set("grey:8,25,0", walker + std::string("[record]\nfile = \"programme.mkv\"\n"
                                                         "fill = \"fill.mkv\"\nkey = \"key.mkv\"\n"
                                                         "codec = \"lossless\"\n")));
  std::vector<std::uint8_t> plate(pixels * 3 * frames);
  std::size_t frame = 0;
  show.run([&](const ShownFrame& shown) {
    const compositing::Display display;
    capture::HalfImage rgba{48, 64, std::vector<capture::Half>(pixels * 4), 4};
    for (std::size_t i = 0; i < pixels * 3; ++i) {
      rgba.pixels[i / 3 * 4 + i % 3] = shown.prepared.plate->pixels[i];
    }
    display.to_rgb8(rgba, std::span(plate).subspan(pixels * 3 * frame++, pixels * 3));
  });
  ASSERT_EQ(frame, frames);
  EXPECT_EQ(show.status()->recorder.error, "");
  const auto read = [&](const char* name, const char* format, std::size_t channels) {
    return codes_of((dir_ / name).string(), format, pixels * frames * channels);
  };
  const auto programme = read("programme.mkv", "rgb24", 3), fill = read("fill.mkv", "rgb24", 3);
  const auto key = read("key.mkv", "gray", 1);
  std::size_t shadowed = 0, covered = 0, clear = 0;
  for (std::size_t i = 0; i < programme.size(); ++i) {
    const int passing = 255 - key[i / 3];
    ASSERT_EQ(fill[i] + std::lround(passing * plate[i] / 255.0), programme[i]) << i;
    covered += passing == 0;
    clear += passing == 255;
    shadowed += passing > 100 && passing < 230 && fill[i] <= 1;
  }
  EXPECT_GT(covered, programme.size() / 20);
  EXPECT_GT(clear, programme.size() / 20);
  EXPECT_GT(shadowed, programme.size() / 50);
}

TEST_F(PersonSetTest, HoldsItsLastPictureAfterTheEndAndSaysSo) {
  std::string shorter = walker;
  shorter.replace(shorter.find("walker:20"), 9, "walker:4");
  Show show(made_set("grey:12,25,0", shorter));
  calibrate::Vec3 last;
  show.run([&](const ShownFrame& shown) { last = shown.prepared.persons[0].position; });
  EXPECT_NEAR(last.y, feet_at(3).y, 0.06);
  EXPECT_THAT(show.status()->notes, testing::Contains(HasSubstr("has ended")));
}

TEST_F(PersonSetTest, RefusesWhatDoesNotFitTogether) {
  const auto expect_refusal = [&](const std::string& from, const std::string& to,
                                  const std::string& words) {
    std::string section = walker;
    const std::size_t at = section.find(from);
    ASSERT_NE(at, std::string::npos);
    section.replace(at, from.size(), to);
    try {
      Show show(made_set("grey:4,25,0", section));
      ADD_FAILURE() << to << " was accepted";
    } catch (const SetError& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  };
  expect_refusal("size = [480, 360]", "size = [320, 240]", "480x360, but its lens is for 320x240");
  expect_refusal("feet = \"auto\"", "", "either feet = \"auto\" or position");
  expect_refusal("feet = \"auto\"", "feet = \"auto\"\nposition = [0, 0, 0]", "either feet");
  expect_refusal("pose = { position = [0, -6, 1.5], look_at = [0, 0, 1] }", "", "come together");
  expect_refusal("feet = \"auto\"", "feet = \"auto\"\nheight = 2", "told by the camera's lens");
  expect_refusal("feet = \"auto\"", "position = [0, -9, 0]", "own camera does not see");
  expect_refusal("feet = \"auto\"", "position = [0, 0, 0]\nfloor = 1", "floor");
  expect_refusal("key = {",
                 "[[billboard]]\nname = \"walker\"\nsource = \"walker:20\"\nheight = 2\n"
                 "position = [0, 0, 0]\nkey = {",
                 "there are two persons named \"walker\"");
  expect_refusal("plate.exr", "missing.exr", "missing.exr");
  expect_refusal("key = {", "key = { core = 0.2, screen = 0.4, ", "must be more than screen");
  // As many pixels, but turned.
  capture::write_exr((dir_ / "turned.exr").string(), capture::make_image(480, 360));
  expect_refusal("key = {", "key = { garbage = \"turned.exr\", ", "turned.exr is 360x480");
  capture::Image broken = capture::make_image(360, 480);
  broken.at(7, 31) = std::numeric_limits<float>::quiet_NaN();
  capture::write_exr((dir_ / "broken.exr").string(), broken);
  expect_refusal("key = {", "key = { garbage = \"broken.exr\", ", "no number at column 31, row 7");
  expect_refusal("key = {", "key = { core_mask = \"turned.exr\", ", "core mask ");
  capture::write_exr((dir_ / "drawn.exr").string(), capture::make_image(360, 480));
  expect_refusal("key = {", "key = { by = \"texel\", ", "by: feet = \"auto\" needs whole frames");
  expect_refusal("key = {", "key = { by = \"texel\", core_mask = \"drawn.exr\", ",
                 "knows no masks");
  expect_refusal("feet = \"auto\"", "feet = \"auto\"\nlit = true\ntranslucency = 0.5",
                 "not for what is lit");
  write_plate(64, 48);
  expect_refusal("walker\"", "walker\"", "64x48");
  expect_refusal("walker\"", "walker\"", "480x360");
}

}  // namespace
}  // namespace studio::person_set_test
