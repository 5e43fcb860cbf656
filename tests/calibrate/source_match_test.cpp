// Made lamps in the pictures of two made cameras.
#include "calibrate/source_match.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/calibrate/made_lamps.h"

namespace calibrate::source_match_test {
namespace {

using made::degree;
using testing::HasSubstr;

// Towards +y with the camera; angles to the right and up.
Vec3 towards(double right_deg, double up_deg) {
  const double a = right_deg * degree;
  const double b = up_deg * degree;
  return {std::sin(a) * std::cos(b), std::cos(a) * std::cos(b), std::sin(b)};
}

const Mat3 scene_camera = look_at({}, {0, 1, 0}, 0.05).R;

struct Shots {
  Mat3 probe_from_set;
  capture::Image scene;
  capture::Image probe;
};

Shots shoot(const made::LampWorld& world, unsigned seed) {
  made::Random random(seed);
  Shots shots;
  shots.probe_from_set = pose_from_axis({}, {0.2 * random.normal(), 0.6 + 0.2 * random.normal(), 1},
                                        random.uniform(0, 6))
                             .R;
  shots.scene = made::photograph(world, made::scene_lens(), scene_camera, 1, 0.02, random);
  shots.probe =
      made::photograph(world, made::probe_lens(), shots.probe_from_set, 1e9, 0.02, random);
  return shots;
}

SourceMatch match(const Shots& shots, double tolerance_deg = 1.5) {
  static const Lens scene_lens = made::scene_lens();
  static const Lens probe_lens = made::probe_lens();
  return match_sources({&shots.scene, &scene_lens}, scene_camera, {&shots.probe, &probe_lens},
                       tolerance_deg * degree);
}

double error_of(const SourceMatch& match, const Shots& shots) {
  return made::error_of({match.fit.cam_from_set, {}}, {shots.probe_from_set, {}}).turn_rad;
}

std::string refusal(const Shots& shots) {
  try {
    match(shots);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(FindBrightSources, FindsEveryLampWhereItIs) {
  made::Random random(1);
  const made::LampWorld world{
      {{towards(-20, 10)}, {towards(5, -8), 0.03, 5}, {towards(25, 15), 0.012, 300}}};
  const Lens lens = made::scene_lens();
  for (const double white : {1.0, 1e9}) {
    const auto image = made::photograph(world, lens, scene_camera, white, 0.02, random);
    const auto sources = find_bright_sources(image, lens);
    ASSERT_EQ(sources.size(), 3U);
    for (const made::Lamp& lamp : world.lamps) {
      const Vec3 v_cam = scene_camera * lamp.v_set;
      const bool found = std::ranges::any_of(sources, [&](const BrightSource& source) {
        return length(source.v_cam - v_cam) < 4 * source.sigma_rad &&
               (white == 1 || std::abs(source.radius_rad / lamp.radius_rad - 1) < 0.3);
      });
      EXPECT_TRUE(found) << lamp.radiance;
    }
    EXPECT_GT(sources[0].power, sources[1].power);
  }
}

TEST(FindBrightSources, PassesOverWhatIsWideOrCut) {
  made::Random random(2);
  const made::LampWorld world{{{towards(0, 0), 0.25, 20}, {towards(36.5, 0), 0.03, 20}}};
  const Lens lens = made::scene_lens();
  const auto image = made::photograph(world, lens, scene_camera, 1e9, 0.02, random);
  EXPECT_TRUE(find_bright_sources(image, lens).empty());
  EXPECT_TRUE(find_bright_sources(capture::make_image(240, 320), lens).empty());
  EXPECT_THROW(find_bright_sources(capture::make_image(10, 10), lens), std::invalid_argument);
}

TEST(MatchSources, TurnsTheProbeByLampsThatTheSceneCameraSeesClipped) {
  const made::LampWorld world{{{towards(-22, 12)},
                               {towards(6, 16), 0.03, 8},
                               {towards(24, -6), 0.015, 300},
                               {towards(120, 40), 0.03, 50},
                               {towards(-100, 20), 0.02, 30}}};
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Shots shots = shoot(world, seed);
    const SourceMatch found = match(shots);
    EXPECT_EQ(found.probe_sources.size(), 3U);
    EXPECT_LT(error_of(found, shots), 0.2 * degree);
    EXPECT_LT(error_of(found, shots), 4 * found.fit.turn_sigma_rad);
    EXPECT_LT(found.fit.turn_sigma_rad, 0.5 * degree);
    EXPECT_GT(found.likeness, 0.6);
    EXPECT_TRUE(found.warnings.empty());
  }
}

TEST(MatchSources, TellsOfALampThatOneCameraDoesNotShow) {
  made::LampWorld world{
      {{towards(-22, 12)}, {towards(6, 16), 0.03, 8}, {towards(24, -6), 0.015, 300}}};
  const Shots hidden = shoot(world, 1);
  world.lamps.push_back({towards(-8, -14), 0.03, 8});
  Shots shots = shoot(world, 1);
  shots.probe = hidden.probe;
  const SourceMatch found = match(shots);
  EXPECT_LT(error_of(found, shots), 0.3 * degree);
  EXPECT_THAT(found.warnings, testing::ElementsAre(HasSubstr("1 bright source is not where")));
}

TEST(MatchSources, TellsTwoLikeLampsApartByTheRestOfThePictures) {
  const made::LampWorld world{{{towards(-20, 10)}, {towards(20, 10)}}};
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Shots shots = shoot(world, seed);
    const SourceMatch found = match(shots);
    EXPECT_LT(error_of(found, shots), 0.5 * degree);
    EXPECT_THAT(found.warnings, testing::ElementsAre(HasSubstr("only two sources")));
  }
}

TEST(MatchSources, RefusesTwoLikeLampsBeforeAnEvenWall) {
  const made::LampWorld world{{{towards(-20, 0)}, {towards(20, 0)}}, 0};
  EXPECT_THAT(refusal(shoot(world, 3)), HasSubstr("two ways"));
}

TEST(MatchSources, RefusesASingleSourceInCommon) {
  const made::LampWorld world{{{towards(-20, 10)}, {towards(110, 30)}}};
  EXPECT_THAT(refusal(shoot(world, 1)), HasSubstr("a single source in common"));
  EXPECT_THAT(refusal(shoot({}, 1)), HasSubstr("0 bright sources"));
}

TEST(MatchSources, IsLessSureWhereLampsAreNear) {
  // The scene camera sees them shifted, each by another angle, as if it stood elsewhere.
  const made::LampWorld far{{{towards(-22, 12)}, {towards(6, 16)}, {towards(24, -6)}}};
  made::LampWorld shifted = far;
  shifted.lamps[0].v_set = towards(-22.9, 12.2);
  shifted.lamps[2].v_set = towards(24.6, -6.6);
  made::Random random(1);
  Shots shots = shoot(far, 2);
  const double sure = match(shots, 3).fit.turn_sigma_rad;
  shots.scene = made::photograph(shifted, made::scene_lens(), scene_camera, 1, 0.02, random);
  const SourceMatch found = match(shots, 3);
  EXPECT_GT(found.fit.turn_sigma_rad, 2 * sure);
  EXPECT_LT(error_of(found, shots), 4 * found.fit.turn_sigma_rad);
}

}  // namespace
}  // namespace calibrate::source_match_test
