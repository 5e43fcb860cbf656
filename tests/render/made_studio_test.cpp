// The made studio: plate, probe and truth are of one world.
#include "render/made_studio.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "capture/hdr.h"
#include "render/environment.h"
#include "render/made_scene.h"
#include "render/made_shapes.h"
#include "render/standard.h"

namespace render::made_studio_test {
namespace {

MadeStudioSettings small() {
  return {.width = 64, .height = 48, .probe_size = 128, .sky_height = 256, .texture_size = 64};
}

const MadeStudio& shared_studio() {
  static const MadeStudio studio = make_studio(small());
  return studio;
}

const Scene& shared_court() {
  static const Scene scene(shared_studio().place);
  return scene;
}

const LightParts& probe_parts() {
  static const LightParts parts = photograph_parts(
      shared_studio(), shared_court(), calibrate::make_direction_table(shared_studio().probe.lens),
      shared_studio().probe.cam_from_set, {.samples = 32});
  return parts;
}

// Light on a level surface from above: the truth.
Vec3f true_irradiance(float strength) {
  static const LightParts around = [] {
    const MadeStudio& studio = shared_studio();
    const calibrate::Pose unturned{{}, -calibrate::position_of(studio.probe.cam_from_set)};
    return photograph_parts(studio, shared_court(), latlong_directions(64), unturned,
                            {.samples = 16});
  }();
  Environment environment;
  environment.radiance = add_light(around, strength);
  return irradiance_of(environment, {0, 0, 1});
}

// The same from a fish-eye's picture: an equisolid lens gives every pixel the same solid angle.
std::array<double, 3> irradiance_of_probe(const MadeCamera& probe, const capture::Image& radiance) {
  const auto directions = calibrate::make_direction_table(probe.lens);
  const double solid_angle = 1 / (probe.lens.parameters[0] * probe.lens.parameters[0]);
  std::array<double, 3> sum{};
  for (int y = 0; y < radiance.height; ++y) {
    for (int x = 0; x < radiance.width; ++x) {
      const double cosine = std::max(0.0F, directions.z[directions.index(y, x)]);
      for (int c = 0; c < 3; ++c) {
        sum[static_cast<std::size_t>(c)] += solid_angle * cosine * radiance.at(y, x, c);
      }
    }
  }
  return sum;
}

TEST(MadeProbe, MergesToTheIrradianceOfTheStudioWithinTwoPercent) {
  const MadeStudio& studio = shared_studio();
  const MadeCamera& probe = studio.probe;
  const capture::Image seen = add_light(probe_parts(), 1);
  std::vector<capture::Shot> shots;
  for (std::uint64_t n = 0; n < 3; ++n) {
    const double exposure_s = exposure_of_picture(probe, static_cast<std::int64_t>(n));
    const capture::MadeShot codes = capture::expose(probe.sensor, seen, exposure_s, n);
    capture::Shot shot;
    shot.linear = capture::make_image(codes.height, codes.width);
    shot.exposure_s = exposure_s;
    for (std::size_t i = 0; i < codes.codes.size(); ++i) {
      shot.linear.pixels[i] =
          static_cast<float>(capture::light_of_code(probe.sensor, codes.codes[i]));
    }
    shots.push_back(std::move(shot));
  }
  capture::Image merged = capture::merge_shots(shots);
  for (float& value : merged.pixels) value *= static_cast<float>(probe.sensor.saturation);
  const auto found = irradiance_of_probe(probe, merged);
  const Vec3f truth = true_irradiance(1);
  EXPECT_NEAR(found[0] / truth.x, 1, 0.02);
  EXPECT_NEAR(found[1] / truth.y, 1, 0.02);
  EXPECT_NEAR(found[2] / truth.z, 1, 0.02);
}

TEST(MadeProbe, DoesNotClipTheSunInItsShortestExposure) {
  const MadeCamera& probe = shared_studio().probe;
  const double shortest = *std::ranges::min_element(probe.exposures_s);
  const capture::Image seen = add_light(probe_parts(), 1);
  EXPECT_LT(*std::ranges::max_element(seen.pixels) * shortest, probe.sensor.saturation);
}

// The card reflects what the probe says that it receives: plate and probe share units.
TEST(MadePlate, ShowsTheGreyCardAsBrightAsTheProbesLightMakesIt) {
  const MadeStudio& studio = shared_studio();
  const calibrate::Lens lens{"pinhole", 8, 8, {400, 400, 3.5, 3.5}};
  const calibrate::Vec3 card = to_double(court_card.middle);
  const auto camera = calibrate::look_at(card + calibrate::Vec3{0, 0, 3}, card, 0);
  const LightParts parts = photograph_parts(
      studio, shared_court(), calibrate::make_direction_table(lens), camera, {.samples = 256});
  for (const float strength : {1.0F, 0.65F}) {
    const capture::Image picture = add_light(parts, strength);
    double mean = 0;
    for (std::size_t i = 1; i < picture.pixels.size(); i += 3) mean += picture.pixels[i] / 64;
    const double expected = court_card.albedo * true_irradiance(strength).y / 3.14159265;
    EXPECT_NEAR(mean / expected, 1, 0.02) << strength;
  }
}

TEST(PhotographParts, AddUpToThePictureUnderBothLights) {
  MadeStudio studio = shared_studio();
  const auto directions = calibrate::make_direction_table(studio.plate.lens);
  const capture::Image sum = add_light(photograph_parts(studio, shared_court(), directions,
                                                        studio.plate.cam_from_set, {.samples = 24}),
                                       1);
  for (std::size_t i = 0; i < studio.sky.sun.pixels.size(); ++i) {
    studio.sky.rest.pixels[i] += studio.sky.sun.pixels[i];
  }
  const capture::Image whole = photograph_parts(studio, shared_court(), directions,
                                                studio.plate.cam_from_set, {.samples = 24})
                                   .rest;
  double difference = 0;
  double total = 0;
  for (std::size_t i = 0; i < sum.pixels.size(); ++i) {
    difference += sum.pixels[i] - whole.pixels[i];
    total += whole.pixels[i];
  }
  EXPECT_LT(std::abs(difference), 0.01 * total);
}

TEST(PhotographParts, HaveWhatGlowsOnceAndNotDimmedWithTheSun) {
  MadeSceneBuilder builder;
  builder.add("lamp", make_rectangle({-9, -9, 0}, {18, 0, 0}, {0, 18, 0}, 1), {0, 0, 0}, 1, -1, 0);
  SceneDescription description = builder.take();
  StandardParameters glow = standard_parameters(description.materials[0], 0);
  std::ranges::fill(glow.emission, 3.0F);
  description.materials[0] = make_standard_material("lamp", glow);
  const Scene scene(std::move(description));
  const auto directions = calibrate::make_direction_table({"pinhole", 4, 4, {4, 4, 1.5, 1.5}});
  const auto camera = calibrate::look_at({0, 0, 2}, {0, 0, 0}, 0);
  const LightParts parts =
      photograph_parts(shared_studio(), scene, directions, camera, {.samples = 8});
  for (const float strength : {0.0F, 1.0F}) {
    EXPECT_NEAR(add_light(parts, strength).at(2, 2, 1), 3, 1e-4) << strength;
  }
}

TEST(PhotographParts, RepeatThemselves) {
  const MadeStudio& studio = shared_studio();
  const auto directions = calibrate::make_direction_table(studio.plate.lens);
  const auto take = [&] {
    return photograph_parts(studio, shared_court(), directions, studio.plate.cam_from_set,
                            {.samples = 2});
  };
  const LightParts once = take();
  const LightParts again = take();
  EXPECT_EQ(once.sun.pixels, again.sun.pixels);
  EXPECT_EQ(once.rest.pixels, again.rest.pixels);
}

TEST(SunStrength, PassesSmoothlyAndComesBack) {
  const MadeStudio& studio = shared_studio();
  EXPECT_EQ(sun_strength(studio, {}), 1);
  float lowest = 1;
  float before = 1;
  for (std::int64_t n = 0; n <= studio.settings.frames; ++n) {
    const capture::Time time = time_of_picture(studio.plate, n);
    const float strength = sun_strength(studio, time);
    EXPECT_LT(std::abs(strength - before), 0.03F);
    EXPECT_NEAR(strength, sun_strength(studio, time + studio.period), 1e-5F);
    lowest = std::min(lowest, strength);
    before = strength;
  }
  EXPECT_LT(lowest, 0.7F);
  EXPECT_GT(lowest, 0.5F);
}

TEST(MadeProbe, HasAWholeBracketWhenThePlateBegins) {
  const MadeStudio& studio = shared_studio();
  EXPECT_EQ(time_of_picture(studio.probe, 2), time_of_picture(studio.plate, 0));
  EXPECT_NE(exposure_of_picture(studio.probe, 0), exposure_of_picture(studio.probe, 2));
  EXPECT_EQ(exposure_of_picture(studio.probe, 1), exposure_of_picture(studio.probe, 4));
}

TEST(CoverageOf, SharesThePictureOutAmongAllThings) {
  const MadeStudio& studio = shared_studio();
  const auto directions = calibrate::make_direction_table(studio.plate.lens);
  const auto cover = [&](const std::vector<bool>& seen) {
    return coverage_of(studio.place, seen, directions, studio.plate.cam_from_set, 16);
  };
  std::vector<bool> ground(studio.place.instances.size(), false);
  ground.front() = true;
  std::vector<bool> rest = ground;
  rest.flip();
  const capture::Image a = cover(ground);
  const capture::Image b = cover(rest);
  double sky = 0;
  double court = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    EXPECT_GE(a.pixels[i], 0);
    EXPECT_LE(a.pixels[i] + b.pixels[i], 1 + 1e-5F);
    sky += 1 - a.pixels[i] - b.pixels[i];
    court += a.pixels[i];
  }
  const double pixels = static_cast<double>(a.pixels.size());
  EXPECT_GT(court / pixels, 0.5);
  EXPECT_GT(sky / pixels, 0.02);
  EXPECT_LT(sky / pixels, 0.3);
}

TEST(PictureOfCard, LiesWithinTheCardsPicture) {
  MadeStudioSettings settings = small();
  settings.width = 640;
  settings.height = 480;
  settings.sky_height = 128;
  const MadeStudio studio = make_studio(settings);
  const auto [x, y, width, height] = picture_of_card(studio);
  EXPECT_GE(width * height, 100);
  for (const int px : {x, x + width - 1}) {
    for (const int py : {y, y + height - 1}) {
      ASSERT_TRUE(px >= 0 && px < 640 && py >= 0 && py < 480);
      // Where the pixel's ray meets the card's plane.
      const auto v = unproject(studio.plate.lens, {double(px), double(py)});
      ASSERT_TRUE(v);
      const calibrate::Vec3 from = position_of(studio.plate.cam_from_set);
      const calibrate::Vec3 to = studio.plate.cam_from_set.R.transposed() * *v;
      const double distance = (court_card.middle.z - from.z) / to.z;
      const double dx = from.x + distance * to.x - court_card.middle.x;
      const double dy = from.y + distance * to.y - court_card.middle.y;
      const double c = std::cos(court_card.yaw_rad);
      const double s = std::sin(court_card.yaw_rad);
      EXPECT_LT(std::abs(c * dx + s * dy), court_card.width / 2);
      EXPECT_LT(std::abs(-s * dx + c * dy), court_card.depth / 2);
    }
  }
}

TEST(MakeStudio, RefusesPicturesTooSmallToSee) {
  EXPECT_THROW(make_studio({.width = 8}), std::invalid_argument);
  EXPECT_THROW(make_studio({.frames = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace render::made_studio_test
