// platelight key, as its users run it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include <nlohmann/json.hpp>

#include "capture/exr.h"
#include "capture/png.h"
#include "compositing/made_clip.h"
#include "tests/studio/command_line.h"

namespace studio::key_command_test {
namespace {

using testing::HasSubstr;

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
  const Outcome refused = run("key " + in("take_%04d.png") + " --plate " + in("plate.exr") +
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
TEST_F(KeyCommand, BlamesThePlateAndNotTheMaskForThePlatesSize) {
  capture::write_exr(in("small.exr"), capture::make_image(45, 80));
  capture::write_exr(in("core.exr"), capture::make_image(90, 160));
  const Outcome outcome = run("key " + in("take_%04d.png") + " --plate " + in("small.exr") +
                              " --core-mask " + in("core.exr") + " -o " + in("keyed"));
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr("the clean plate " + in("small.exr") + " is 80x45"));
  EXPECT_THAT(outcome.err, HasSubstr("is 160x90"));
  EXPECT_THAT(outcome.err, testing::Not(HasSubstr("mask")));
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
