// Stills on the command line whose picture is the reference.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/camera.h"
#include "capture/png.h"
#include "tests/independent_plate.h"
#include "tests/studio/command_line.h"
#include "tests/studio/made_show.h"

namespace studio::still_test {
namespace {

using testing::HasSubstr;

class Stills : public CommandLine {
 protected:
  std::string write_set(const std::string& more = "") const {
    capture::write_png(dir_ / "plate.png", 64, 48, 3, std::vector<std::uint8_t>(64 * 48 * 3, 120));
    return write_made_set(dir_, "file:plate.png", more);
  }
  // Light of a picture's pixels.
  static std::vector<float> read(const std::string& png) {
    return capture::open_camera("file:" + png)->next()->image->pixels;
  }
};

TEST_F(Stills, ShowTheReferenceThroughTheSameDisplay) {
  for (const std::string more :
       {"", "[display]\ndisplay = \"sRGB\"\ntone = \"schlick\"\nkey = 0.4\n"}) {
    const std::string set = write_set(more);
    const std::string kernel = (dir_ / "kernel.png").string();
    const std::string truth = (dir_ / "truth.png").string(), json = (dir_ / "still.json").string();
    ASSERT_EQ(run("still " + set + " -o " + kernel).status, 0);
    const Outcome outcome = run("still " + set + " -o " + truth + " --reference 63 --json " + json);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("64 paths a pixel in "));

    const auto figures = nlohmann::json::parse(content_of(json));
    EXPECT_EQ(figures["reference"]["paths"], 64) << "as many in each half";
    EXPECT_GT(figures["reference"]["seconds"], 0);
    EXPECT_GT(figures["error"]["relative_rms"], 0);
    EXPECT_LT(figures["error"]["relative_rms"], 0.5);
    EXPECT_GT(figures["error"]["reference_noise"], 0);

    const std::vector<float> a = read(kernel), b = read(truth);
    ASSERT_EQ(a.size(), b.size());
    double difference = 0;
    for (std::size_t i = 0; i < a.size(); ++i) difference += std::abs(a[i] - b[i]);
    EXPECT_GT(difference, 0);
    EXPECT_LT(difference / static_cast<double>(a.size()), 0.02);
    // Above the ground there is the plate alone.
    for (std::size_t i = 0; i < 64 * 3; ++i) ASSERT_EQ(a[i], b[i]) << i;
  }
}

TEST_F(Stills, HaveThePlatesShapeOfPixels) {
  independent::ffmpeg("-f lavfi -i color=c=gray:size=64x48,setsar=4/3 -frames:v 1 -c:v ffv1 '" +
                      (dir_ / "wide.mkv").string() + "'");
  const std::string set = write_made_set(dir_, "file:wide.mkv", "");
  const std::string still = (dir_ / "still.png").string(), shown = (dir_ / "shown.png").string();
  ASSERT_EQ(run("still " + set + " -o " + still).status, 0);
  ASSERT_EQ(run("run " + set + " --view-png " + shown).status, 0);
  for (const std::string& png : {still, shown}) {
    // Pixels in a unit across and down.
    EXPECT_THAT(content_of(png), HasSubstr(std::string("pHYs\0\0\0\3\0\0\0\4", 12))) << png;
  }
}

TEST_F(Stills, RefuseNumbersOfPathsThatAreNone) {
  const std::string words = "still " + write_set() + " -o " + (dir_ / "truth.png").string();
  for (const char* paths : {"0", "1", "-8", "2000000", "many", "1.5"}) {
    const Outcome outcome = run(words + " --reference " + paths);
    EXPECT_EQ(outcome.status, 2) << paths;
    EXPECT_THAT(outcome.err, HasSubstr("--reference")) << paths;
  }
  const Outcome both = run(words + " --reference 8 --view rays");
  EXPECT_EQ(both.status, 2);
  EXPECT_THAT(both.err, HasSubstr("--reference and --view"));
  EXPECT_FALSE(fs::exists(dir_ / "truth.png"));
}

}  // namespace
}  // namespace studio::still_test
