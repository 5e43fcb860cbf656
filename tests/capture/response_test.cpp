// Camera responses: recovered from made and real brackets, read from files.
#include "capture/response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>
#include <utility>

#include "capture/colour.h"
#include "capture/exif.h"
#include "capture/files.h"
#include "tests/capture/made_bracket.h"
#include "tests/made_files.h"

namespace capture::response_test {
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

// A curve that no power or polynomial of few terms comes near: a camera's gamma with a bend where
// its highlights begin, and another one in its shadows.
double bent_curve(double z) {
  const double shadow = 0.4 * std::tanh((std::log(z) + 1.8) / 0.4);
  const double highlight = 0.3 * std::tanh((z - 0.7) / 0.1);
  const double at_white = 0.4 * std::tanh(1.8 / 0.4) + 0.3 * std::tanh(0.3 / 0.1);
  return std::pow(z, 2.4) * std::exp(shadow + highlight - at_white);
}

TEST(RecoverResponse, TakesAFreeCurveOnlyWhereItEarnsIt) {
  const ResponseFit bent = recover_response(made_bracket(bent_curve, 0, 11).shots);
  EXPECT_EQ(bent.response.name, "free curve");
  EXPECT_LT(worst_error(bent.response, bent_curve), 0.12);
  EXPECT_TRUE(bent.warnings.empty());
  for (const ResponseCandidate& candidate : bent.candidates) {
    if (candidate.name != "free curve") {
      EXPECT_GT(candidate.heldout_error, 1.1 * bent.heldout_error);
    }
  }
  for (const MadeCamera& camera : made_cameras()) {
    EXPECT_NE(recover_response(made_bracket(camera.light_of_code, 0, 12).shots).response.name,
              "free curve")
        << camera.name;
  }
}

TEST(RecoverResponse, KnowsALinearCamera) {
  const ResponseFit fit = recover_response(made_bracket([](double z) { return z; }, 0, 13).shots);
  EXPECT_EQ(fit.response.name, "linear");
  EXPECT_EQ(fit.response.coefficients, linear_response().coefficients);
}

// Shots of a camera whose codes fall by `depth` where light passes 1/4 of white.
std::vector<CodedShot> falling_shots(double depth) {
  std::vector<CodedShot> shots = made_bracket([](double z) { return z * z; }, 0, 14).shots;
  for (CodedShot& shot : shots) {
    for (std::uint8_t& code : shot.still.texels) {
      const double fall = depth / (1 + std::exp(-(code - 127.0) / 1.5));  // of codes from 127 on
      const double recovery = depth / (1 + std::exp(-(code - 175.0) / 4.0));
      code = static_cast<std::uint8_t>(std::lround(code - fall + recovery));
    }
  }
  return shots;
}

TEST(RecoverResponse, SaysWhereCodesFallAsLightGrows) {
  EXPECT_TRUE(recover_response(falling_shots(0)).warnings.empty());
  const std::vector<std::string> warnings = recover_response(falling_shots(16)).warnings;
  ASSERT_GE(warnings.size(), 3U);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NE(warnings[c].find("not monotone"), std::string::npos) << warnings[c];
  }
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

TEST(RecoverResponse, TellsALabelThatIsWrong) {
  MadeBracket bracket = made_bracket(made_cameras()[2].light_of_code, 0, 6);
  EXPECT_TRUE(recover_response(bracket.shots).warnings.empty());
  bracket.shots[2].exposure_s *= 2;
  const std::vector<std::string> warnings = recover_response(bracket.shots).warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("as the others have it"), std::string::npos) << warnings[0];
}

TEST(RecoverResponse, RefusesExposuresInReverse) {
  MadeBracket bracket = made_bracket(made_cameras()[2].light_of_code, 0, 6);
  const std::size_t count = bracket.shots.size();
  for (std::size_t i = 0; i < count / 2; ++i) {
    std::swap(bracket.shots[i].exposure_s, bracket.shots[count - 1 - i].exposure_s);
  }
  EXPECT_THROW(recover_response(bracket.shots), std::runtime_error);
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
}

std::string refusal_of(const std::vector<CodedShot>& shots) {
  try {
    recover_response(shots);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(RecoverResponse, SaysWhyShotsTellNothing) {
  const MadeBracket bracket = made_bracket(made_cameras()[0].light_of_code, 0, 9);
  const auto filled = [&](std::uint8_t code) {
    std::vector<CodedShot> shots = bracket.shots;
    for (CodedShot& shot : shots) {
      std::fill(shot.still.texels.begin(), shot.still.texels.end(), code);
    }
    return refusal_of(shots);
  };
  EXPECT_NE(filled(0).find("is black"), std::string::npos);
  EXPECT_NE(filled(255).find("is saturated"), std::string::npos);
  EXPECT_NE(refusal_of(std::vector<CodedShot>(3, bracket.shots[4])).find("one exposure"),
            std::string::npos);
  std::vector<CodedShot> apart{bracket.shots.front(), bracket.shots.back(), bracket.shots.back()};
  std::mt19937 random(9);
  for (CodedShot& shot : apart) {
    for (std::uint8_t& code : shot.still.texels) code = static_cast<std::uint8_t>(random());
  }
  EXPECT_NE(refusal_of(apart).find("share too few flat"), std::string::npos);
}

void report(const char* name, const ResponseFit& fit) {
  std::printf("%s: %s, held-out error %.4f by code, %.4f by pixel but %.3f of them\n", name,
              fit.response.name.c_str(), fit.heldout_error, fit.pixel_error, fit.changed);
  for (const ResponseCandidate& c : fit.candidates) {
    std::printf("  %-24s %2d  %.4f  %.4f\n", c.name.c_str(), c.parameters, c.heldout_error,
                c.pixel_error);
  }
}

// The largest relative difference of light, codes 25 to 235, of two curves that agree at code 128.
double worst_difference(const Response& a, const Response& b) {
  double worst = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double scale = b.light[c][128] / a.light[c][128];
    for (std::size_t z = 25; z <= 235; ++z) {
      worst = std::max(worst, std::abs(a.light[c][z] * scale / b.light[c][z] - 1));
    }
  }
  return worst;
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
  const Response supplied = read_rsp(directory / "Response_function.rsp");
  const ResponseCheck check = check_response(supplied, shots);
  report("fish-eye", fit);
  std::printf("  supplied .rsp: %.4f by code, %.4f by pixel; at most %.3f from ours\n", check.error,
              check.pixel_error, worst_difference(supplied, fit.response));
  EXPECT_LT(fit.heldout_error, 0.03);
  EXPECT_LT(fit.pixel_error, 0.03);
  EXPECT_LT(fit.heldout_error, check.error);
  EXPECT_LT(fit.pixel_error, check.pixel_error);
  EXPECT_TRUE(fit.warnings.empty());
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
  const ResponseFit fit = recover_response(shots);
  report("room", fit);
  EXPECT_LT(fit.pixel_error, 0.03);
  EXPECT_LT(fit.changed, 0.05);
  EXPECT_LT(fit.heldout_error, 0.045);  // by code: the screen's few pixels count as much as others
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
}  // namespace capture::response_test
