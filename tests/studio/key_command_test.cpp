// platelight key, as its users run it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/exr.h"
#include "capture/png.h"
#include "compositing/made_clip.h"
#include "studio/clean_plates.h"
#include "tests/independent_plate.h"
#include "tests/studio/command_line.h"

namespace studio::key_command_test {
namespace {

using testing::HasSubstr;
using testing::Not;

class KeyCommand : public CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    const compositing::MadeClip clip(compositing::made_scene("plain"), 4, 90, 160);
    for (int i = 0; i < 4; ++i) {
      write_picture("empty", i, clip.plate_shot(i));
      write_picture("take", i, clip.frame(i).seen);
    }
    truth_ = clip.frame(3).truth;
  }
  void write_picture(const char* name, int number, const compositing::MadePicture& picture) const {
    const std::string file = std::string(name) + "_000" + std::to_string(number) + ".png";
    capture::write_png(dir_ / file, picture.width, picture.height, 3, picture.codes);
  }
  std::string in(const std::string& name) const { return (dir_ / name).string(); }

  capture::Image truth_;
};

VideoSource srgb_video() {
  VideoSource video;
  video.colour = capture::Transfer::srgb;
  return video;
}

TEST_F(KeyCommand, TakesAPlateAndKeysAClipWithIt) {
  const Outcome plate =
      run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr"));
  ASSERT_EQ(plate.status, 0) << plate.err;
  EXPECT_THAT(plate.out, HasSubstr("green screen"));
  const Outcome keyed = run("key " + in("take_%04d.png") + " --colour sRGB --plate " +
                            in("plate.exr") + " -o " + in("keyed") + " --json " + in("key.json"));
  ASSERT_EQ(keyed.status, 0) << keyed.err;
  const auto figures = nlohmann::json::parse(content_of(in("key.json")));
  EXPECT_EQ(figures["frames"], 4);
  EXPECT_EQ(figures["rows"].size(), 4U);
  EXPECT_GT(figures["confidence_least"], 0.5);
  ASSERT_TRUE(fs::exists(dir_ / "keyed" / "frame.000003.exr"));
  const capture::Image last = capture::read_exr(in("keyed/frame.000003.exr"));
  ASSERT_EQ(last.width, truth_.width);
  double squares = 0;
  for (int y = 0; y < truth_.height; ++y) {
    for (int x = 0; x < truth_.width; ++x) {
      for (int c = 0; c < 3; ++c) squares += std::pow(last.at(y, x, c) - truth_.at(y, x, c), 2);
    }
  }
  EXPECT_LT(squares / (3.0 * truth_.height * truth_.width), 1e-3);
}

TEST_F(KeyCommand, APlatesFileTellsTheNoiseOfItsFrames) {
  const Outcome plate = run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " +
                            in("plate.exr") + " --json " + in("plate.json"));
  ASSERT_EQ(plate.status, 0) << plate.err;
  const auto told = nlohmann::json::parse(content_of(in("plate.json")));
  const compositing::CleanPlate read = read_clean_plate(in("plate.exr"), srgb_video());
  EXPECT_GT(read.noise_floor, compositing::least_noise_floor);
  EXPECT_FLOAT_EQ(read.noise_gain, told["noise_gain"]);
  EXPECT_FLOAT_EQ(read.noise_floor, told["noise_floor"]);
  // Frames that are all the same tell nothing of it.
  for (int i = 1; i < 4; ++i) {
    fs::copy_file(in("empty_0000.png"), in("empty_000" + std::to_string(i) + ".png"),
                  fs::copy_options::overwrite_existing);
  }
  ASSERT_EQ(
      run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr")).status, 0);
  const compositing::CleanPlate still = read_clean_plate(in("plate.exr"), srgb_video());
  EXPECT_EQ(still.noise_gain, compositing::CleanPlate{}.noise_gain);
  EXPECT_EQ(still.noise_floor, compositing::CleanPlate{}.noise_floor);
}

// What is keyed blurs it: twice would be once too often.
TEST_F(KeyCommand, WritesAPlateOfOneFrameAsItIs) {
  const Outcome plate =
      run("key plate " + in("empty_0000.png") + " --colour sRGB -o " + in("plate.exr"));
  ASSERT_EQ(plate.status, 0) << plate.err;
  const capture::Image light = capture::read_exr(in("plate.exr"));
  const capture::Image shot = compositing::light_of(
      compositing::MadeClip(compositing::made_scene("plain"), 4, 90, 160).plate_shot(0));
  ASSERT_EQ(light.pixels.size(), shot.pixels.size());
  for (std::size_t i = 0; i < light.pixels.size(); ++i)
    ASSERT_NEAR(light.pixels[i], shot.pixels[i], 1e-3F) << i;
}

TEST_F(KeyCommand, SparesWhatItReads) {
  ASSERT_EQ(
      run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr")).status, 0);
  ASSERT_EQ(run("key " + in("take_%04d.png") + " --colour sRGB --plate " + in("plate.exr") +
                " -o " + in("keyed"))
                .status,
            0);
  const std::string keyed = in("keyed/frame.%06d.exr"), plate = " --plate " + in("plate.exr");
  fs::copy_file(in("plate.exr"), in("keyed/frame.000009.exr"));
  fs::create_hard_link(in("plate.exr"), in("other.exr"));
  const std::string before = content_of(in("plate.exr"));
  const std::string frame = content_of(in("keyed/frame.000001.exr"));
  for (const std::string& lossy :
       {"key " + keyed + plate + " -o " + in("keyed"),
        "key " + in("take_%04d.png") + plate + " -o " + in("out") + " --json " + in("plate.exr"),
        "key " + in("take_%04d.png") + plate + " -o " + in("out") + " --json " + in("other.exr"),
        "key " + in("take_%04d.png") + " --plate " + in("keyed/frame.000009.exr") + " -o " +
            in("keyed"),
        "key plate " + keyed + " -o " + in("keyed/frame.000001.exr")}) {
    const Outcome refused = run(lossy);
    EXPECT_EQ(refused.status, 1) << lossy;
    EXPECT_THAT(refused.err, HasSubstr("would be lost")) << lossy;
  }
  EXPECT_EQ(content_of(in("plate.exr")), before);
  EXPECT_EQ(content_of(in("keyed/frame.000001.exr")), frame);
}

TEST_F(KeyCommand, TellsOfLostFramesAndOfFramesThatWereThere) {
  ASSERT_EQ(
      run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr")).status, 0);
  const std::string key = "key " + in("take_%04d.png") + " --colour sRGB --plate " +
                          in("plate.exr") + " -o " + in("keyed") + " --json " + in("key.json");
  ASSERT_EQ(run(key).err, "");
  fs::remove(in("take_0001.png"));
  fs::remove(in("empty_0001.png"));
  const Outcome keyed = run(key);
  EXPECT_EQ(keyed.status, 0);
  EXPECT_THAT(keyed.err, HasSubstr("1 of 4 frames were lost"));
  EXPECT_THAT(keyed.err, HasSubstr("had 4 frames already"));
  const auto figures = nlohmann::json::parse(content_of(in("key.json")));
  EXPECT_EQ(figures["lost"], 1);
  EXPECT_EQ(figures["rows"].size(), 4U);
  EXPECT_EQ(figures["rows"][1]["status"], "lost");
  EXPECT_LE(figures["confidence_least"], figures["confidence_mean"]);
  const Outcome plate =
      run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr"));
  EXPECT_THAT(plate.err, HasSubstr("1 of 4 frames were lost or damaged"));
  EXPECT_THAT(plate.out, HasSubstr("mean of 3 frames"));
}

// A wall of two colours, half of it green: a ball crosses it.
TEST_F(KeyCommand, FindsAnyStillBackgroundInFootageAlone) {
  constexpr int width = 80, height = 48, frames = 12;
  const auto is_ball = [](int x, int y, int i) { return std::hypot(x - 6 * i - 6, y - 24) < 6; };
  for (int i = 0; i < frames; ++i) {
    std::vector<std::uint8_t> codes;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const bool left = x < width / 2;
        const auto grain = static_cast<std::uint8_t>((x * 7 + y * 3 + i) % 2);
        for (const int code : left ? std::array{40, 200, 50} : std::array{120, 80, 40}) {
          codes.push_back(is_ball(x, y, i) ? 230 : static_cast<std::uint8_t>(code + grain));
        }
      }
    }
    capture::write_png(dir_ / fmt::format("wall_{:04}.png", i), width, height, 3, codes);
  }
  const Outcome keyed =
      run("key " + in("wall_%04d.png") + " --colour sRGB --method difference -o " + in("wall") +
          " --json " + in("wall.json"));
  ASSERT_EQ(keyed.status, 0) << keyed.err;
  EXPECT_THAT(keyed.out, HasSubstr("before a still background"));
  EXPECT_TRUE(nlohmann::json::parse(content_of(in("wall.json")))["colour"].is_null());
  const Outcome plate =
      run("key plate " + in("wall_%04d.png") + " --colour sRGB --person" +
          " --method difference -o " + in("plate.exr") + " --json " + in("plate.json"));
  EXPECT_EQ(plate.status, 0) << plate.err;
  EXPECT_THAT(plate.out, HasSubstr("12 frames, no screen, noise"));
  EXPECT_TRUE(nlohmann::json::parse(content_of(in("plate.json")))["colour"].is_null());
  EXPECT_GT(nlohmann::json::parse(content_of(in("wall.json")))["plate_known"], 0.99);
  const capture::Image middle = capture::read_exr(in("wall/frame.000006.exr"));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double off = std::hypot(x - 42, y - 24);
      if (off < 4) {
        ASSERT_GT(middle.at(y, x, 3), 0.99F) << x << " " << y;
      }
      if (off > 8) {
        ASSERT_LT(middle.at(y, x, 3), 0.01F) << x << " " << y;
      }
    }
  }
}

TEST_F(KeyCommand, SaysThatSomebodyStandsInThePlateAndWhatToDo) {
  const Outcome plate =
      run("key plate " + in("take_%04d.png") + " --colour sRGB -o " + in("plate.exr"));
  EXPECT_THAT(plate.err, HasSubstr("of the plate is not screen"));
  const Outcome keyed = run("key " + in("empty_%04d.png") + " --colour sRGB --plate " +
                            in("plate.exr") + " -o " + in("keyed") + " --json " + in("key.json"));
  ASSERT_EQ(keyed.status, 0) << keyed.err;
  EXPECT_THAT(keyed.err, HasSubstr("of the plate is not screen"));
  EXPECT_THAT(keyed.err, HasSubstr("the key is unsure (ghost) in 4 of 4 frames"));
  EXPECT_THAT(keyed.err, HasSubstr("is screen where the clean plate shows something else"));
  EXPECT_THAT(keyed.err, HasSubstr("Take the plate anew, or cut it away by a garbage mask"));
  const auto figures = nlohmann::json::parse(content_of(in("key.json")));
  EXPECT_GT(figures["rows"][0]["ghost"], 0.02);
}

TEST_F(KeyCommand, SaysOnceThatTheCameraWasPushed) {
  constexpr int width = 240, height = 160, frames = 24;
  constexpr std::array panels{89, 115, 135, 152, 167, 180, 192};
  for (int i = 0; i < frames; ++i) {
    const int right = i < 10 ? 0 : 8;
    std::vector<std::uint8_t> codes;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int u = x - right + width;  // a cloth between panels
        const bool cloth = u > width + 60 && u < width + 180;
        const int panel = panels[static_cast<std::size_t>((u / 14 * 3 + y / 11 * 5) % 7)];
        for (const int code : {40, 180, 60})
          codes.push_back(static_cast<std::uint8_t>(cloth ? code : panel));
      }
    }
    capture::write_png(dir_ / fmt::format("room_{:04}.png", i), width, height, 3, codes);
  }
  ASSERT_EQ(run("key plate " + in("room_0000.png") + " --colour sRGB -o " + in("room.exr")).status,
            0);
  const std::string key = "key " + in("room_%04d.png") + " --colour sRGB --plate " +
                          in("room.exr") + " -o " + in("keyed") + " --json " + in("key.json");
  const Outcome still = run(key + " --frames 10");
  EXPECT_THAT(still.err, Not(HasSubstr("was moved")));
  EXPECT_TRUE(nlohmann::json::parse(content_of(in("key.json")))["moved"].is_null());
  const Outcome keyed = run(key);
  ASSERT_EQ(keyed.status, 0) << keyed.err;
  EXPECT_THAT(keyed.err, HasSubstr("the key is unsure (moved) in "));
  EXPECT_THAT(
      keyed.err,
      HasSubstr("the camera was moved, from frame 12 on or up to 3 before: the picture is "));
  EXPECT_THAT(keyed.err,
              testing::ContainsRegex("is (7.9|8.0|8.1) px further right and 0.0 px further down"));
  EXPECT_EQ(keyed.err.find("was moved"), keyed.err.rfind("was moved"));
  const auto figures = nlohmann::json::parse(content_of(in("key.json")));
  EXPECT_EQ(figures["moved"]["frame"], 12);
  EXPECT_NEAR(figures["moved"]["right_px"], 8, 0.2);
  EXPECT_EQ(figures["unsure"], 8);  // known from the second look on
}

TEST_F(KeyCommand, SaysThatThePlateSeemsToBeOfAnotherLens) {
  constexpr int width = 480, height = 320;
  const auto write_room = [&](const std::string& name, double scale) {
    std::vector<std::uint8_t> codes;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double u = (x - 0.5 * width) / scale, v = (y - 0.5 * height) / scale;
        const bool cloth = std::abs(u) < 120 && v > -100;
        const double panel = 140 + 50 * std::sin(0.11 * u + 0.5 * std::sin(0.05 * v)) +
                             45 * std::cos(0.09 * v + 0.7 * std::sin(0.04 * u));
        for (const int code : {40, 180, 60})
          codes.push_back(static_cast<std::uint8_t>(cloth ? code : panel));
      }
    }
    capture::write_png(in(name), width, height, 3, codes);
  };
  write_room("near.png", 1);
  ASSERT_EQ(run("key plate " + in("near.png") + " --colour sRGB -o " + in("near.exr")).status, 0);
  for (const double scale : {1.0, 1.03, 0.95}) {
    for (int i = 0; i < 6; ++i) write_room(fmt::format("lens_{:04}.png", i), scale);
    const Outcome keyed = run("key " + in("lens_%04d.png") + " --colour sRGB --plate " +
                              in("near.exr") + " -o " + in("keyed"));
    ASSERT_EQ(keyed.status, 0) << keyed.err;
    if (scale == 1.0) {
      EXPECT_THAT(keyed.err, Not(HasSubstr("lens")));
      continue;
    }
    EXPECT_THAT(keyed.err, HasSubstr("the plate seems to be of another lens")) << scale;
    EXPECT_THAT(keyed.err, testing::ContainsRegex(scale > 1 ? "(2.9|3.0|3.1) % larger"
                                                            : "(4.9|5.0|5.1) % smaller"));
  }
}

TEST_F(KeyCommand, SaysOfAShiftWhatShows) {
  compositing::PlateShift shift;
  shift.right_px = 8.04F, shift.down_px = -0.02F;
  EXPECT_EQ(words_for_shift(shift),
            "the picture is 8.0 px further right and 0.0 px further down than its clean plate");
  shift.roll_rad = -0.01746F, shift.scale = 1.021F;
  EXPECT_EQ(words_for_shift(shift),
            "the picture is 8.0 px further right and 0.0 px further down, turned by 1.0 degrees "
            "counter-clockwise, 2.1 % larger than its clean plate");
}

TEST_F(KeyCommand, IsUnsureOfAScreenAtTheCamerasLimit) {
  const compositing::MadeClip clip(compositing::made_scene("over-exposed"), 4, 90, 160);
  for (int i = 0; i < 4; ++i) write_picture("empty", i, clip.plate_shot(i));
  for (int i = 0; i < 4; ++i) write_picture("take", i, clip.frame(i).seen);
  ASSERT_EQ(
      run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr")).status, 0);
  const Outcome keyed = run("key " + in("take_%04d.png") + " --colour sRGB --plate " +
                            in("plate.exr") + " -o " + in("keyed"));
  EXPECT_THAT(keyed.err, HasSubstr("the key is unsure (clipped) in 4 of 4 frames"));
}

// A lamp has dimmed since the plate was taken.
TEST_F(KeyCommand, FollowsTheLightOrNotAndKeysByTheTableOrNot) {
  const compositing::MadeClip clip(compositing::made_scene("plain"), 4, 90, 160);
  for (int i = 0; i < 4; ++i) {
    compositing::MadePicture dim = clip.frame(i).seen;
    for (std::uint8_t& code : dim.codes) code = static_cast<std::uint8_t>(code * 9 / 10);
    write_picture("dim", i, dim);
  }
  ASSERT_EQ(
      run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr")).status, 0);
  const auto alpha_of = [&](const std::string& flags) {
    const Outcome keyed = run("key " + in("dim_%04d.png") + " --colour sRGB --plate " +
                              in("plate.exr") + " -o " + in("keyed") + flags);
    EXPECT_EQ(keyed.status, 0) << keyed.err;
    const capture::Image last = capture::read_exr(in("keyed/frame.000003.exr"));
    std::vector<float> alpha;
    for (std::size_t i = 3; i < last.pixels.size(); i += 4) alpha.push_back(last.pixels[i]);
    return alpha;
  };
  const auto error_of = [&](const std::vector<float>& alpha) {
    double squares = 0;
    for (std::size_t i = 0; i < alpha.size(); ++i) {
      squares += std::pow(alpha[i] - truth_.pixels[4 * i + 3], 2);
    }
    return squares / static_cast<double>(alpha.size());
  };
  const std::vector<float> followed = alpha_of("");
  const double error = error_of(followed);
  EXPECT_LT(error, 2e-3);
  EXPECT_GT(error_of(alpha_of(" --steady-light")), 3 * error);
  const std::vector<float> plain = alpha_of(" --plain-ratio");
  EXPECT_NE(plain, followed);
  EXPECT_LT(error_of(plain), 0.02);
}

TEST_F(KeyCommand, SaysThatAGreyWallIsNoScreen) {
  capture::write_png(dir_ / "grey.png", 40, 20, 3, std::vector<std::uint8_t>(2400, 130));
  const Outcome plate =
      run("key plate " + in("grey.png") + " -o " + in("plate.exr") + " --json " + in("plate.json"));
  EXPECT_EQ(plate.status, 0);
  EXPECT_THAT(plate.err, HasSubstr("no screen"));
  EXPECT_THAT(plate.out, HasSubstr("no screen, noise not measured"));
  const auto figures = nlohmann::json::parse(content_of(in("plate.json")));
  EXPECT_EQ(figures["colour"], "no");
  EXPECT_TRUE(figures["noise_floor"].is_null());
  const Outcome keyed = run("key " + in("grey.png") + " --plate " + in("plate.exr") + " -o " +
                            in("keyed") + " --json " + in("key.json"));
  EXPECT_EQ(keyed.status, 0) << keyed.err;
  EXPECT_THAT(keyed.out, HasSubstr("no screen"));
  const auto clip = nlohmann::json::parse(content_of(in("key.json")));
  EXPECT_EQ(clip["colour"], "no");
  EXPECT_EQ(clip["confidence_mean"], 0);
}

// Half of the picture is as red as the rest is green.
TEST_F(KeyCommand, TakesTheColourThatItIsTold) {
  std::vector<std::uint8_t> halves;
  for (int i = 0; i < 40 * 20; ++i) {
    halves.insert(halves.end(), {i % 40 < 20 ? std::uint8_t{190} : std::uint8_t{40},
                                 i % 40 < 20 ? std::uint8_t{40} : std::uint8_t{190}, 40});
  }
  capture::write_png(dir_ / "halves.png", 40, 20, 3, halves);
  for (const std::string colour : {"any", "red", "green"}) {
    const Outcome plate = run("key plate " + in("halves.png") + " -o " + in("plate.exr") +
                              " --screen-colour " + colour);
    EXPECT_THAT(plate.out, HasSubstr(colour == "red" ? "a red screen" : "a green screen"));
    // Of footage, and of a plate in a file.
    for (const std::string& with : {std::string(), " --plate " + in("plate.exr")}) {
      const Outcome keyed = run("key " + in("halves.png") + with + " --screen-colour " + colour +
                                " -o " + in("keyed_" + colour));
      EXPECT_EQ(keyed.status, 0) << keyed.err;
      const capture::Image matte = capture::read_exr(in("keyed_" + colour + "/frame.000000.exr"));
      const float left = matte.at(10, 5, matte.channels - 1);
      EXPECT_EQ(left < 0.1F, colour == "red") << colour << with << left;
    }
  }
  const Outcome pink = run("key " + in("halves.png") + " --screen-colour pink -o " + in("keyed"));
  EXPECT_NE(pink.status, 0);
  EXPECT_THAT(pink.err, HasSubstr("pink"));
}

TEST_F(KeyCommand, TakesAPlateOfAScreenWithSomebodyBeforeIt) {
  const Outcome plate =
      run("key plate " + in("take_%04d.png") + " --colour sRGB --person -o " + in("plate.exr"));
  EXPECT_EQ(plate.status, 0) << plate.err;
  EXPECT_THAT(plate.out, HasSubstr("middle of 4 frames, a green screen, noise in black 0.00"));
  const compositing::CleanPlate read = read_clean_plate(in("plate.exr"), srgb_video());
  EXPECT_TRUE(read.knows_noise);
  EXPECT_NEAR(read.noise_gain, 1.1e-4, 2e-5);  // variance of the made camera, rounding too
}

// The plate is of what is keyed, not of what comes before.
TEST_F(KeyCommand, JudgesAClipByWhatItBeginsWith) {
  for (int i = 0; i < 4; ++i) {
    fs::rename(in("take_000" + std::to_string(i) + ".png"),
               in("late_0" + std::to_string(500 + i) + ".png"));
  }
  capture::write_png(dir_ / "late_0000.png", 160, 90, 3, std::vector<std::uint8_t>(43200, 20));
  for (int i = 1; i < 500; ++i) {
    fs::create_hard_link(in("late_0000.png"), in(fmt::format("late_{:04}.png", i)));
  }
  const Outcome keyed = run("key " + in("late_%04d.png") + " --colour sRGB --first 500 -o " +
                            in("keyed") + " --json " + in("key.json"));
  EXPECT_EQ(keyed.status, 0) << keyed.err;
  EXPECT_THAT(keyed.out, HasSubstr("4 frames before a green screen"));
  // Files and figures have the clip's numbers.
  EXPECT_EQ(nlohmann::json::parse(content_of(in("key.json")))["rows"][0]["frame"], 500);
  EXPECT_TRUE(fs::exists(in("keyed/frame.000500.exr")));
  EXPECT_FALSE(fs::exists(in("keyed/frame.000000.exr")));
}

// As an operator ends a camera that has no end.
TEST_F(KeyCommand, EndsOnASignalWithItsFigures) {
  capture::Image screen = capture::make_image(32, 24);
  for (std::size_t i = 0; i < screen.pixels.size(); ++i) {
    screen.pixels[i] = std::array{0.04F, 0.42F, 0.1F}[i % 3];
  }
  capture::write_exr(in("screen.exr"), screen);
  const std::string until_keyed =
      write("end.sh", "\"$@\" & program=$!\nuntil [ -e '" + in("keyed/frame.000001.exr") +
                          "' ]; do kill -0 $program || break; sleep 0.02; done\n"
                          "kill -TERM $program\nwait $program\n");
  const Outcome keyed =
      run("key 'made_walker:width=24&height=32&detail=1' --colour sRGB --plate " +
              in("screen.exr") + " -o " + in("keyed") + " --json " + in("key.json"),
          "sh " + until_keyed);
  ASSERT_EQ(keyed.status, 0) << keyed.err;
  const auto figures = nlohmann::json::parse(content_of(in("key.json")));
  EXPECT_GE(figures["frames"], 2);
  EXPECT_EQ(figures["rows"].size(), figures["frames"]);
}

TEST_F(KeyCommand, WritesTheClipsPixelAspect) {
  run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr"));
  independent::ffmpeg("-i '" + in("take_%04d.png") + "' -vf setsar=2 -c:v ffv1 '" + in("wide.mkv") +
                      "'");
  const Outcome keyed = run("key " + in("wide.mkv") + " --colour sRGB --frames 1 --plate " +
                            in("plate.exr") + " -o " + in("keyed"));
  ASSERT_EQ(keyed.status, 0) << keyed.err;
  const std::string file = content_of(dir_ / "keyed" / "frame.000000.exr");
  using namespace std::string_literals;
  const std::string attribute = "pixelAspectRatio\0float\0\4\0\0\0"s;
  const std::size_t at = file.find(attribute);
  ASSERT_NE(at, std::string::npos);
  float aspect = 0;
  std::memcpy(&aspect, &file[at + attribute.size()], sizeof aspect);
  EXPECT_EQ(aspect, 2);
}

TEST_F(KeyCommand, KeepsToMasks) {
  run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr"));
  // The left third is the person, the right third is not.
  capture::Image core = capture::make_image(90, 160), garbage = core;
  for (int y = 0; y < 90; ++y) {
    for (int x = 0; x < 160; ++x) {
      for (int c = 0; c < 3; ++c) {
        core.at(y, x, c) = x < 53 ? 1.0F : 0.0F;
        garbage.at(y, x, c) = x >= 106 ? 1.0F : 0.0F;
      }
    }
  }
  capture::write_exr(in("core.exr"), core);
  capture::write_exr(in("garbage.exr"), garbage);
  const Outcome keyed = run("key " + in("take_%04d.png") + " --colour sRGB --frames 2 --plate " +
                            in("plate.exr") + " --core-mask " + in("core.exr") + " --garbage " +
                            in("garbage.exr") + " -o " + in("keyed"));
  ASSERT_EQ(keyed.status, 0) << keyed.err;
  const capture::Image last = capture::read_exr(in("keyed/frame.000001.exr"));
  ASSERT_EQ(last.channels, 4);
  for (int y = 0; y < 90; ++y) {
    for (int x = 0; x < 160; ++x) {
      if (x < 53) {
        ASSERT_EQ(last.at(y, x, 3), 1) << x << " " << y;
      }
      if (x >= 106) {
        ASSERT_EQ(last.at(y, x, 3), 0) << x << " " << y;
      }
    }
  }
  const Outcome refused =
      run("key " + in("take_%04d.png") + " --colour sRGB --plate " + in("plate.exr") +
          " --core-mask " + in("missing.exr") + " -o " + in("keyed"));
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.err, HasSubstr("missing.exr"));
}

TEST_F(KeyCommand, RefusesAPlateOfAnotherSizeAndNamesBoth) {
  capture::write_exr(in("small.exr"), capture::make_image(45, 80));
  const Outcome outcome =
      run("key " + in("take_%04d.png") + " --plate " + in("small.exr") + " -o " + in("keyed"));
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr("80x45"));
  EXPECT_THAT(outcome.err, HasSubstr("160x90"));
  expect_one_line(outcome.err);
}

// A mask that fits the video is not to blame.
TEST_F(KeyCommand, RefusesAPlateOfAnotherCurveAndNamesBoth) {
  ASSERT_EQ(
      run("key plate " + in("empty_%04d.png") + " --colour sRGB -o " + in("plate.exr")).status, 0);
  const Outcome keyed =
      run("key " + in("take_%04d.png") + " --plate " + in("plate.exr") + " -o " + in("keyed"));
  EXPECT_EQ(keyed.status, 1);
  expect_one_line(keyed.err);
  EXPECT_THAT(keyed.err, HasSubstr(in("plate.exr") + " was taken as \"sRGB\""));
  EXPECT_THAT(keyed.err, HasSubstr("is read as \"Rec.1886\""));
  EXPECT_FALSE(fs::exists(in("keyed")));
}

TEST_F(KeyCommand, TakesLightByACamerasResponse) {
  std::ofstream(in("camera.rsp")) << "2 1 0 0\n2 1 0 0\n2 1 0 0\n";  // light is the code's square
  const std::string response = " --response " + in("camera.rsp");
  const auto key = [&](const std::string& plate, const std::string& options) {
    return run("key " + in("take_%04d.png") + " --plate " + in(plate) + options + " -o " +
               in("keyed"));
  };
  ASSERT_EQ(run("key plate " + in("empty_%04d.png") + response + " -o " + in("plate.exr")).status,
            0);
  const Outcome keyed = key("plate.exr", response);
  EXPECT_EQ(keyed.status, 0) << keyed.err;
  const Outcome by_curve = key("plate.exr", "");
  EXPECT_EQ(by_curve.status, 1);
  EXPECT_THAT(by_curve.err, HasSubstr("was taken by a response"));
  const Outcome of_codes = key("empty_0000.png", response);
  EXPECT_EQ(of_codes.status, 1);
  EXPECT_THAT(of_codes.err, HasSubstr("holds codes"));
  expect_one_line(of_codes.err);
}

TEST_F(KeyCommand, BlamesThePlateAndNotTheMaskForThePlatesSize) {
  capture::write_exr(in("small.exr"), capture::make_image(45, 80));
  capture::write_exr(in("core.exr"), capture::make_image(90, 160));
  const Outcome outcome = run("key " + in("take_%04d.png") + " --plate " + in("small.exr") +
                              " --core-mask " + in("core.exr") + " -o " + in("keyed"));
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr("the clean plate " + in("small.exr") + " is 80x45"));
  EXPECT_THAT(outcome.err, HasSubstr("is 160x90"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("mask")));
  expect_one_line(outcome.err);
}

TEST_F(KeyCommand, RefusesWhatIsNoVideo) {
  EXPECT_EQ(run("key").status, 2);
  EXPECT_EQ(run("key a b c -o x").status, 2);
  const Outcome outcome = run("key " + in("missing.mkv") + " -o " + in("keyed"));
  EXPECT_EQ(outcome.status, 1);
  expect_one_line(outcome.err);
}

}  // namespace
}  // namespace studio::key_command_test
