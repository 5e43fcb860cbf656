// The gain between lightprobe and plate.
#include "render/match.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <stdexcept>

#include "calibrate/angles.h"
#include "tests/render/sun_and_sky.h"

namespace render::match_test {
namespace {

using calibrate::pi_f;

// A plate camera under the sky, and what it films at a gain, with values above 1 clipped.
struct MadePlate {
  calibrate::Lens lens{"pinhole", 320, 240, {150, 150, 159.5, 119.5}};
  calibrate::Pose cam_from_set = calibrate::look_at({0, 0, 0}, {1, 0.2, 0.5}, 0);
  calibrate::DirectionTable directions = calibrate::make_direction_table(lens);

  capture::Image film(const Environment& env, std::array<float, 3> gain, float noise) const {
    std::mt19937 random(7);
    std::normal_distribution<float> normal(0, noise);
    capture::Image plate = capture::make_image(lens.height, lens.width);
    for (int y = 0; y < lens.height; ++y) {
      for (int x = 0; x < lens.width; ++x) {
        const std::size_t i = directions.index(y, x);
        const calibrate::Vec3 v_cam{directions.x[i], directions.y[i], directions.z[i]};
        const Vec3f r = radiance_of(env, to_float(cam_from_set.R.transposed() * v_cam), 0);
        const std::array<float, 3> value{r.x, r.y, r.z};
        for (int c = 0; c < 3; ++c) {
          const auto k = static_cast<std::size_t>(c);
          plate.at(y, x, c) = std::min(value[k] * gain[k] + normal(random), 1.0F);
        }
      }
    }
    return plate;
  }
};

TEST(MatchByOverlap, FindsTheGainOfEachChannelUnderNoiseAndClipping) {
  const Environment env = make_sun_and_sky({}, 128);
  const MadePlate made;
  const std::array<float, 3> gain{0.8F, 0.6F, 0.5F};
  const MatchResult result =
      match_by_overlap(made.film(env, gain, 0.01F), made.directions, made.cam_from_set, env);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(result.gain[c], gain[c], 0.01F * gain[c]);
  EXPECT_GT(result.pixels, 10000);
  EXPECT_LT(result.spread, 0.05);
}

TEST(MatchByOverlap, IsNotMisledByAQuarterOfOtherThings) {
  const Environment env = make_sun_and_sky({}, 128);
  const MadePlate made;
  capture::Image plate = made.film(env, {0.5F, 0.5F, 0.5F}, 0.005F);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      for (int c = 0; c < 3; ++c) plate.at(y, x, c) = 0.9F;
    }
  }
  const MatchResult result = match_by_overlap(plate, made.directions, made.cam_from_set, env);
  EXPECT_NEAR(result.gain[1], 0.5F, 0.03F);
}

TEST(MatchByOverlap, SaysThatTheCamerasSeeNothingInCommon) {
  Environment env = make_sun_and_sky({}, 64);
  const MadePlate made;
  const capture::Image plate = made.film(env, {0.5F, 0.5F, 0.5F}, 0);
  env.seen.assign(env.seen.size(), 0);
  const MatchResult result = match_by_overlap(plate, made.directions, made.cam_from_set, env);
  EXPECT_EQ(result.pixels, 0);
  EXPECT_EQ(result.gain, (std::array<float, 3>{1, 1, 1}));
  EXPECT_NE(result.note.find("no direction is seen by both"), std::string::npos);
}

TEST(MatchByOverlap, DoubtsCamerasThatDisagree) {
  const Environment env = make_sun_and_sky({}, 64);
  const MadePlate made;
  capture::Image plate = made.film(env, {0.5F, 0.5F, 0.5F}, 0);
  std::mt19937 random(3);
  std::lognormal_distribution<float> wild(0, 1);
  for (int y = 0; y < plate.height; ++y) {
    for (int x = 0; x < plate.width; ++x) {
      const float factor = 0.1F + 0.8F * static_cast<float>((x / 30 + y / 30) % 2);
      for (int c = 0; c < 3; ++c) plate.at(y, x, c) *= factor;
    }
  }
  const MatchResult result = match_by_overlap(plate, made.directions, made.cam_from_set, env);
  EXPECT_NE(result.note.find("doubtful"), std::string::npos) << result.spread;
}

TEST(MatchByOverlap, RefusesAPlateOfAnotherSize) {
  const MadePlate made;
  EXPECT_THROW(match_by_overlap(capture::make_image(10, 10), made.directions, made.cam_from_set,
                                make_even_environment(1, 16)),
               std::invalid_argument);
}

TEST(MatchByPatch, FindsTheGainThatGivesThePatchItsAlbedo) {
  capture::Image plate = capture::make_image(50, 60);
  for (int y = 10; y < 20; ++y) {
    for (int x = 20; x < 40; ++x) {
      for (int c = 0; c < 3; ++c) plate.at(y, x, c) = 0.3F;
    }
  }
  plate.at(12, 25, 0) = 1.0F;  // a glint
  const Patch patch{20, 10, 20, 10};
  const Vec3f irradiance{2 * pi_f, pi_f, pi_f / 2};
  MatchResult result = match_by_patch(plate, patch, {0.6F, 0.6F, 0.6F}, irradiance);
  EXPECT_NEAR(result.gain[0], 0.25F, 1e-6F);
  EXPECT_NEAR(result.gain[1], 0.5F, 1e-6F);
  EXPECT_NEAR(result.gain[2], 1.0F, 1e-6F);
  EXPECT_EQ(result.pixels, 199);
  imply_albedo(plate, patch, irradiance, result);
  for (const float albedo : result.implied_albedo) EXPECT_NEAR(albedo, 0.6F, 1e-6F);
}

TEST(MatchByPatch, LeavesLightThatNoGainChangesToItself) {
  capture::Image plate = capture::make_image(8, 8);
  for (float& value : plate.pixels) value = 0.3F;
  const std::array<float, 3> albedo{0.6F, 0.6F, 0.6F};  // irradiance pi / 2
  const Vec3f quarter = Vec3f{1, 1, 1} * (pi_f / 4);
  const MatchResult result =
      match_by_patch(plate, {0, 0, 8, 8}, albedo, Vec3f{1, 1, 1} * pi_f, {}, quarter);
  for (const float gain : result.gain) EXPECT_NEAR(gain, 0.25F, 1e-6F);
  const MatchResult none =
      match_by_patch(plate, {0, 0, 8, 8}, albedo, Vec3f{1, 1, 1} * pi_f, {}, quarter * 2.1F);
  EXPECT_EQ(none.pixels, 0);
  EXPECT_EQ(none.gain, (std::array<float, 3>{1, 1, 1}));
  EXPECT_NE(none.note.find("filled in"), std::string::npos);
}

TEST(MatchByPatch, SaysWhyAPatchIsOfNoUse) {
  capture::Image plate = capture::make_image(8, 8);
  const std::array<float, 3> grey{0.18F, 0.18F, 0.18F};
  EXPECT_EQ(doubt_of_patch(0.5F), "");
  EXPECT_NE(doubt_of_patch(0.03F).find("sees only 3 % of what lights the patch"),
            std::string::npos);
  EXPECT_NE(match_by_patch(plate, {0, 0, 8, 8}, grey, {1, 1, 1}).note.find("clipped or dark"),
            std::string::npos);
  for (float& value : plate.pixels) value = 0.5F;
  EXPECT_NE(match_by_patch(plate, {0, 0, 8, 8}, grey, {}).note.find("no light"), std::string::npos);
}

TEST(MatchByPatch, RefusesPatchesOutsideThePlateAndAlbedosThatAreNone) {
  const capture::Image plate = capture::make_image(8, 8);
  const std::array<float, 3> grey{0.18F, 0.18F, 0.18F};
  for (const Patch& patch : {Patch{-1, 0, 2, 2}, Patch{0, 0, 9, 1}, Patch{7, 7, 2, 1},
                             Patch{0, 0, 0, 1}, Patch{1, 1, std::numeric_limits<int>::max(), 1}}) {
    EXPECT_THROW(match_by_patch(plate, patch, grey, {1, 1, 1}), std::invalid_argument);
  }
  EXPECT_THROW(match_by_patch(plate, {0, 0, 2, 2}, {0, 1, 1}, {1, 1, 1}), std::invalid_argument);
  EXPECT_THROW(match_by_patch(plate, {0, 0, 2, 2}, {1.2F, 1, 1}, {1, 1, 1}), std::invalid_argument);
}

TEST(MatchGiven, IsTheGainTimesTheExposure) {
  EXPECT_EQ(match_given({1, 2, 3}).gain, (std::array<float, 3>{1, 2, 3}));
  EXPECT_EQ(match_given({1, 2, 3}, 0.5).gain, (std::array<float, 3>{0.5F, 1, 1.5F}));
  EXPECT_EQ(matrix_of(match_given({1, 2, 3})), (ColourMatrix{1, 0, 0, 0, 2, 0, 0, 0, 3}));
}

TEST(MatchByMatrix, IsTheMatrixTimesTheExposureAndTheGainOfGrey) {
  const MatchResult match = match_by_matrix({1, 0.5F, 0, 0, 1, 0, 0.25F, 0, 1}, 2);
  EXPECT_EQ(matrix_of(match), (ColourMatrix{2, 1, 0, 0, 2, 0, 0.5F, 0, 2}));
  EXPECT_EQ(match.gain, (std::array<float, 3>{3, 2, 2.5F}));
  EXPECT_EQ(match.exposure, 2);
}

}  // namespace
}  // namespace render::match_test
