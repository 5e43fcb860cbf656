// Brackets that agree with their merge, and those that do not.
#include "capture/bracket_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "capture/response.h"
#include "tests/capture/made_bracket.h"

namespace capture::bracket_check_test {
namespace {

struct Bracket {
  std::vector<Still8> shots;
  std::vector<double> exposures_s;
};

// Of patches, at five exposures from the shortest on, with noise.
Bracket made_patches() {
  const made::Scene scene = made::patches(120, 80, 1);
  Bracket bracket;
  for (int i = -2; i <= 2; ++i) {
    bracket.exposures_s.push_back(std::exp2(2 * i));
    bracket.shots.push_back(made::photograph(
        scene, bracket.exposures_s.back(), [](double z) { return z * z; },
        static_cast<unsigned>(i + 20)));
  }
  return bracket;
}

BracketShares shares_of(const Bracket& bracket, double power = 2) {
  Response response;
  for (auto& channel : response.light) {
    for (std::size_t z = 0; z < channel.size(); ++z) {
      channel[z] = std::pow(static_cast<double>(z) / 255, power);
    }
  }
  const std::array channels{response_code_table(response, 0), response_code_table(response, 1),
                            response_code_table(response, 2)};
  MergeTables tables(channels, static_cast<int>(bracket.shots.size()));
  tables.set_exposures(bracket.exposures_s);
  std::vector<const std::uint8_t*> codes;
  for (const Still8& shot : bracket.shots) codes.push_back(shot.texels.data());
  const Still8& first = bracket.shots[0];
  Image radiance = make_image(first.height, first.width, 3);
  tables.merge(codes, first.width, 0, first.height, radiance.pixels.data());
  return check_bracket(codes, bracket.exposures_s, channels, radiance);
}

TEST(CheckBracket, FindsNothingInOneThatIsRight) {
  const BracketShares shares = shares_of(made_patches());
  EXPECT_LT(shares.contradicting, 0.02);
  EXPECT_LT(shares.saturated, 0.3) << "a fifth is";
  EXPECT_LT(shares.black, 0.1);
  Bracket one = made_patches();
  one.shots.resize(1), one.exposures_s.resize(1);
  EXPECT_EQ(shares_of(one).contradicting, 0) << "a single shot contradicts nothing";
}

TEST(CheckBracket, FindsWhatMovedIntoAShot) {
  Bracket bracket = made_patches();
  Still8& shot = bracket.shots[2];
  const std::size_t covered = shot.texels.size() / 5;
  for (std::size_t i = 0; i < covered; ++i) shot.texels[i] = i % 2 == 0 ? 20 : 235;
  EXPECT_NEAR(shares_of(bracket).contradicting, 0.2, 0.05);
  EXPECT_FALSE(warnings_of(shares_of(bracket)).empty());
}

TEST(CheckBracket, FindsWrongExposuresAndResponses) {
  Bracket reversed = made_patches();
  std::ranges::reverse(reversed.exposures_s);
  EXPECT_GT(shares_of(reversed).contradicting, 0.8);
  Bracket wrong_label = made_patches();
  wrong_label.exposures_s[2] *= 4;
  EXPECT_GT(shares_of(wrong_label).contradicting, 0.2);
  EXPECT_GT(shares_of(made_patches(), 1).contradicting, 0.2) << "read as linear";
}

TEST(CheckBracket, CountsWhatIsSaturatedOrBlackInEveryShot) {
  for (const int code : {0, 255}) {
    Bracket bracket = made_patches();
    for (Still8& shot : bracket.shots) {
      std::ranges::fill(shot.texels, static_cast<std::uint8_t>(code));
    }
    const BracketShares shares = shares_of(bracket);
    EXPECT_EQ(shares.saturated, code == 255 ? 1 : 0);
    EXPECT_EQ(shares.black, code == 0 ? 1 : 0);
    const std::vector<std::string> warnings = warnings_of(shares);
    ASSERT_EQ(warnings.size(), 1U) << code;
    EXPECT_NE(warnings[0].find(code == 0 ? "longer exposure" : "shorter exposure"),
              std::string::npos);
  }
}

TEST(CheckBracket, RefusesWhatDoesNotFitTogether) {
  const std::array channels{response_code_table(srgb_response(), 0),
                            response_code_table(srgb_response(), 1),
                            response_code_table(srgb_response(), 2)};
  const std::vector<std::uint8_t> codes(3);
  const std::uint8_t* const shot = codes.data();
  EXPECT_THROW(check_bracket({}, {}, channels, make_image(1, 1, 3)), std::invalid_argument);
  EXPECT_THROW(check_bracket(std::span(&shot, 1), {}, channels, make_image(1, 1, 3)),
               std::invalid_argument);
  const double exposure_s = 1;
  EXPECT_THROW(
      check_bracket(std::span(&shot, 1), std::span(&exposure_s, 1), channels, make_image(1, 1, 1)),
      std::invalid_argument);
}

}  // namespace
}  // namespace capture::bracket_check_test
