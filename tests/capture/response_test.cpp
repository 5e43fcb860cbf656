// Camera responses: recovered from made and real brackets, read from files.
#include "capture/response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>

#include "capture/colour.h"
#include "capture/exif.h"
#include "capture/files.h"
#include "tests/capture/made_bracket.h"
#include "tests/made_files.h"

namespace capture {
namespace {

using Curve = std::function<double(double)>;

struct MadeCamera {
  const char* name;
  Curve light_of_code;
  double tolerance;  // relative, codes 25 to 235
};

std::vector<MadeCamera> made_cameras() {
  return {
      {"sRGB", [](double z) { return decode(Transfer::srgb, z); }, 0.01},
      {"gamma", [](double z) { return std::pow(z, 1.8); }, 0.01},
      {"film-like",
       [](double z) { return 0.08 * z + 0.25 * z * z + 0.1 * z * z * z + 0.57 * std::pow(z, 5); },
       0.03}};
}

// Eight shots two stops apart, whose true exposures differ from the claimed ones by a few percent.
struct MadeBracket {
  std::vector<CodedShot> shots;
  std::vector<double> true_exposures_s;
};

MadeBracket made_bracket(const Curve& light_of_code, double shutter_error, unsigned seed) {
  const made::Scene scene = made::patches(400, 300, seed);
  std::mt19937 random(seed);
  std::normal_distribution<double> error(0, shutter_error);
  MadeBracket bracket;
  for (int i = -4; i <= 3; ++i) {
    const double claimed_s = std::exp2(2 * i);
    const double true_s = claimed_s * std::exp(error(random));
    bracket.shots.push_back(
        {made::photograph(scene, true_s, light_of_code, seed + static_cast<unsigned>(i + 10)),
         claimed_s});
    bracket.true_exposures_s.push_back(true_s);
  }
  return bracket;
}

double worst_error(const Response& response, const Curve& truth) {
  double worst = 0;
  for (const auto& channel : response.light) {
    for (std::size_t z = 25; z <= 235; ++z) {
      worst = std::max(worst, std::abs(channel[z] / truth(static_cast<double>(z) / 255) - 1));
    }
  }
  return worst;
}

TEST(RecoverResponse, FindsTheCurveOfAnyCamera) {
  for (const MadeCamera& camera : made_cameras()) {
    const ResponseFit fit = recover_response(made_bracket(camera.light_of_code, 0, 1).shots);
    EXPECT_LT(worst_error(fit.response, camera.light_of_code), camera.tolerance) << camera.name;
  }
}

TEST(RecoverResponse, PrefersTheSimplestCurveThatSuffices) {
  const auto cameras = made_cameras();
  EXPECT_EQ(recover_response(made_bracket(cameras[0].light_of_code, 0, 2).shots).response.name,
            "sRGB");
  EXPECT_EQ(recover_response(made_bracket(cameras[1].light_of_code, 0, 2).shots).response.name,
            "gamma");
}

TEST(RecoverResponse, SolvesShuttersThatAreOffBySeveralPercent) {
  const Curve curve = made_cameras()[2].light_of_code;
  for (const unsigned seed : {3U, 4U, 5U}) {
    const MadeBracket bracket = made_bracket(curve, 0.04, seed);
    const ResponseFit fit = recover_response(bracket.shots);
    // The power that the claimed times leave open shows as one factor per stop, and a common scale.
    for (std::size_t i = 1; i + 1 < bracket.shots.size(); ++i) {
      const auto bend = [](const std::vector<double>& t, std::size_t k) {
        return std::log(t[k - 1] * t[k + 1] / (t[k] * t[k]));
      };
      EXPECT_NEAR(bend(fit.exposures_s, i), bend(bracket.true_exposures_s, i), 0.02) << seed;
    }
  }
}

TEST(RecoverResponse, DoesNotMindThatThingsMove) {
  const Curve curve = made_cameras()[2].light_of_code;
  MadeBracket bracket = made_bracket(curve, 0, 6);
  std::mt19937 random(6);
  for (CodedShot& shot : bracket.shots) {  // a grey thing, elsewhere in every shot: 6 % of the area
    const made::Scene grey{80, 90, std::vector<double>(std::size_t{80} * 90 * 3, 0.5)};
    const Still8 thing = made::photograph(grey, shot.exposure_s, curve, 7);
    const auto left = random() % 300;
    const auto top = random() % 200;
    for (std::size_t y = 0; y < 90; ++y) {
      std::copy_n(&thing.texels[y * 80 * 3], 80 * 3,
                  &shot.still.texels[((top + y) * 400 + left) * 3]);
    }
  }
  EXPECT_LT(worst_error(recover_response(bracket.shots).response, curve), 0.04);
}

TEST(RecoverResponse, RisesAndKeepsItsEnds) {
  const ResponseFit fit =
      recover_response(made_bracket(made_cameras()[2].light_of_code, 0, 7).shots);
  for (const auto& channel : fit.response.light) {
    EXPECT_EQ(channel.front(), 0);
    EXPECT_EQ(channel.back(), 1);
    for (std::size_t z = 1; z < channel.size(); ++z) EXPECT_GE(channel[z], channel[z - 1]);
  }
}

TEST(RecoverResponse, GivesTheSameWhateverTheOrder) {
  MadeBracket bracket = made_bracket(made_cameras()[2].light_of_code, 0.03, 8);
  const ResponseFit forth = recover_response(bracket.shots);
  std::reverse(bracket.shots.begin(), bracket.shots.end());
  const ResponseFit back = recover_response(bracket.shots);
  for (std::size_t z = 25; z < 236; ++z) {
    EXPECT_NEAR(back.response.light[1][z] / forth.response.light[1][z], 1, 1e-3);
  }
  EXPECT_NEAR(back.exposures_s.front() / forth.exposures_s.back(), 1, 1e-3);
}

TEST(RecoverResponse, RefusesShotsThatSayNothing) {
  MadeBracket bracket = made_bracket(made_cameras()[0].light_of_code, 0, 9);
  std::vector<CodedShot> two(bracket.shots.begin(), bracket.shots.begin() + 2);
  EXPECT_THROW(recover_response(two), std::invalid_argument);
  std::vector<CodedShot> other_size = bracket.shots;
  other_size[1].still.width = 300;
  EXPECT_THROW(recover_response(other_size), std::invalid_argument);
  std::vector<CodedShot> no_time = bracket.shots;
  no_time[2].exposure_s = 0;
  EXPECT_THROW(recover_response(no_time), std::invalid_argument);
  std::vector<CodedShot> black = bracket.shots;
  for (CodedShot& shot : black) std::fill(shot.still.texels.begin(), shot.still.texels.end(), 0);
  EXPECT_THROW(recover_response(black), std::runtime_error);
  std::vector<CodedShot> equal(3, bracket.shots[4]);
  EXPECT_THROW(recover_response(equal), std::runtime_error);
}

TEST(RecoverResponse, ForetellsHeldOutRealShotsWithin3PercentAndBetterThanTheirRspFile) {
  const auto directory = made::real_data() / "brackets" / "fisheye8mm";
  if (!std::filesystem::exists(directory)) GTEST_SKIP() << "no real data at " << directory;
  std::vector<CodedShot> shots;
  for (int number = 6955; number <= 6971; number += 2) {
    const std::string path = directory / ("IMG_" + std::to_string(number) + ".JPG");
    shots.push_back({decode_still8(read_file(path), path), exposure_s_of(path)});
  }
  const ResponseFit fit = recover_response(shots);
  EXPECT_LT(fit.heldout_error, 0.03);
  EXPECT_LT(fit.heldout_error,
            check_response(read_rsp(directory / "Response_function.rsp"), shots).error);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    EXPECT_NEAR(fit.exposures_s[i] / shots[i].exposure_s, 1, 0.1);
  }
}

TEST(RecoverResponse, CopesWithARealBracketOfUnevenStepsAndAFlickeringScreen) {
  const auto directory = made::real_data() / "brackets" / "room";
  if (!std::filesystem::exists(directory)) GTEST_SKIP() << "no real data at " << directory;
  std::vector<CodedShot> shots;
  for (int number = 0; number < 7; ++number) {
    const std::string path = directory / ("stack_room_exp_" + std::to_string(number) + ".jpg");
    shots.push_back({decode_still8(read_file(path), path), exposure_s_of(path)});
  }
  EXPECT_LT(recover_response(shots).heldout_error, 0.06);
}

TEST(ReadRsp, GivesTheCurveThatWasWritten) {
  const std::string path = made::make_temporary_directory() / "a.rsp";
  Response response;
  response.coefficients = {std::vector<double>{0.5, 0.5, 0}, {1, 0, 0}, {0.25, 0.25, 0.5, 0}};
  write_rsp(path, response);
  const Response back = read_rsp(path);
  EXPECT_EQ(back.coefficients, response.coefficients);
  EXPECT_NEAR(back.light[0][51], 0.5 * 0.04 + 0.5 * 0.2, 1e-12);
  EXPECT_THROW(write_rsp(path, srgb_response()), std::invalid_argument);
}

TEST(ReadRsp, TakesOneLineForAllChannels) {
  const std::string path = made::make_temporary_directory() / "a.rsp";
  const std::string text = "1 1 0\n";
  write_file(path, std::as_bytes(std::span(text)));
  EXPECT_EQ(read_rsp(path).light, linear_response().light);
}

TEST(ReadRsp, RefusesEveryBadFileWithItsReason) {
  made::expect_refusals("rsp_", ".rsp",
                        {{"rsp_word.rsp", ":1: the line is not made of numbers"},
                         {"rsp_two_channels.rsp", "has 2 channels"},
                         {"rsp_four_channels.rsp", ":4: the line is a fourth channel"},
                         {"rsp_too_few_coefficients.rsp", "one coefficient more"},
                         {"rsp_degree_with_fraction.rsp", "degree of 1 to 20"},
                         {"rsp_degree_of_zero.rsp", "degree of 1 to 20"},
                         {"rsp_falls.rsp", "falls at code"},
                         {"rsp_ends_at_two.rsp", "instead of 1"},
                         {"rsp_empty.rsp", "has 0 channels"},
                         {"rsp_nan.rsp", "not made of numbers"}},
                        [](const std::string& path) { read_rsp(path); });
}

}  // namespace
}  // namespace capture
