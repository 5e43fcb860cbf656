// Laws of lightprobes.
#include "render/probe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "calibrate/angles.h"
#include "tests/render/sun_and_sky.h"

namespace render::probe_test {
namespace {

using calibrate::Lens;
using calibrate::Pose;
using calibrate::Vec2;
using calibrate::Vec3;

using calibrate::degree;
using std::numbers::pi;

Lens fisheye(int size, double max_angle_deg = 93) {
  const double centre = (size - 1) / 2.0;
  const double radius = 2 * std::sin(max_angle_deg * degree / 2);
  return {"equisolid", size, size, {size / 2.0 / radius, centre, centre}, max_angle_deg * degree};
}

Pose looking_up() { return calibrate::pose_from_axis({0, 0, 0}, {0, 0, 1}, 0); }

// What a probe sees of a sky; outside of its lens NaN, which nothing may read.
template <class Radiance>
capture::Image photograph_sky(const Lens& lens,
                              const Pose& probe_from_set,
                              const Radiance& radiance) {
  capture::Image image = capture::make_image(lens.height, lens.width);
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const auto v = calibrate::unproject(lens, {static_cast<double>(x), static_cast<double>(y)});
      Vec3f value{NAN, NAN, NAN};
      if (v) value = radiance(to_float(probe_from_set.R.transposed() * *v));
      image.at(y, x, 0) = value.x;
      image.at(y, x, 1) = value.y;
      image.at(y, x, 2) = value.z;
    }
  }
  return image;
}

Vec3f white(Vec3f) { return {1, 1, 1}; }

Vec3f smooth_sky(Vec3f d) { return {1 + d.z, 1 + 0.5F * d.x, 1 + 0.3F * d.y * d.z}; }

TEST(ProbeMapper, KeepsAWhitePictureWhiteForEveryLensAndSize) {
  for (const Lens& lens : {fisheye(512), fisheye(100), fisheye(1400),
                           Lens{"kannala_brandt", 300, 200, {60, 60, 150, 100}, 1.5},
                           Lens{"pinhole", 320, 240, {200, 200, 159.5, 119.5}}}) {
    SCOPED_TRACE(lens.model + " " + std::to_string(lens.width));
    const Pose pose = calibrate::pose_from_axis({0, 0, 0}, {1, 2, 0.7}, 0.3);
    ProbeMapper mapper(lens, pose, {.height = 64, .unseen = Unseen::mean});
    Environment env;
    mapper.map(photograph_sky(lens, pose, white), {}, env);
    for (const float value : env.radiance.pixels) ASSERT_NEAR(value, 1, 1e-5F);
  }
}

TEST(ProbeMapper, PutsEveryDirectionWhereTheSetHasIt) {
  for (const Vec3 axis : {Vec3{0, 0, 1}, Vec3{0, 1, 0}, Vec3{-1, 0.3, -0.5}}) {
    const Pose pose = calibrate::pose_from_axis({1, 2, 3}, axis, 0.4);
    const Lens lens = fisheye(512);
    ProbeMapper mapper(lens, pose, {.height = 128});
    Environment env;
    mapper.map(photograph_sky(lens, pose, smooth_sky), {}, env);
    int seen = 0;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 256; ++x) {
        if (env.seen[static_cast<std::size_t>(y * 256 + x)] == 0) continue;
        ++seen;
        const Vec3f d = direction_of_texel(static_cast<float>(x), static_cast<float>(y), 256, 128);
        const Vec3f expected = smooth_sky(d);
        ASSERT_NEAR(env.radiance.at(y, x, 0), expected.x, 0.02F) << x << " " << y;
        ASSERT_NEAR(env.radiance.at(y, x, 1), expected.y, 0.02F) << x << " " << y;
        ASSERT_NEAR(env.radiance.at(y, x, 2), expected.z, 0.02F) << x << " " << y;
        ASSERT_GT(dot(to_double(d), normalize(axis)), std::cos(94.5 * degree));
      }
    }
    EXPECT_GT(seen, 128 * 256 / 3);
    EXPECT_NEAR(mapper.seen_part(), (1 - std::cos(93 * degree)) / 2, 0.01);
  }
}

TEST(ProbeMapper, KeepsTheEnergyOfASunOfOnePixelWhereverItStands) {
  for (const int size : {200, 512, 1400}) {
    const Lens lens = fisheye(size);
    ProbeMapper mapper(lens, looking_up(),
                       {.height = 128, .unseen = Unseen::floor, .floor_albedo = 0});
    Environment env;
    for (double angle = 0; angle < 80; angle += 11) {
      const Vec3 to_sun{std::sin(angle * degree) * 0.6, std::sin(angle * degree) * 0.8,
                        std::cos(angle * degree)};
      const Vec2 q = calibrate::project(lens, looking_up().R * to_sun).value();
      const int x = static_cast<int>(std::lround(q.x));
      const int y = static_cast<int>(std::lround(q.y));
      capture::Image picture = capture::make_image(size, size);
      for (int c = 0; c < 3; ++c) picture.at(y, x, c) = 1e5F;
      mapper.map(picture, {}, env);
      double power = 0;
      for (int row = 0; row < 128; ++row) {
        for (int column = 0; column < 256; ++column) {
          power += env.radiance.at(row, column, 1) * texel_solid_angle(row, 256, 128);
        }
      }
      // An equisolid lens gives every pixel the same solid angle.
      const double pixel = 1e5 / (lens.parameters[0] * lens.parameters[0]);
      EXPECT_NEAR(power, pixel, 0.03 * pixel) << size << " " << angle;
    }
  }
}

TEST(ProbeMapper, UndoesTheLensesVignetting) {
  const Lens lens = fisheye(400);
  const std::vector<double> vignetting{0.0802, -0.1180, 0.0140};
  const auto shaded = [&](Vec3f d) {
    const double t2 = std::pow(std::acos(std::min(d.z, 1.0F)), 2);
    const auto s = static_cast<float>(1 + t2 * (0.0802 + t2 * (-0.1180 + t2 * 0.0140)));
    return Vec3f{s, s, s};
  };
  ProbeMapper mapper(lens, looking_up(),
                     {.height = 64, .unseen = Unseen::mean, .vignetting = vignetting});
  Environment env;
  mapper.map(photograph_sky(lens, looking_up(), shaded), {}, env);
  for (const float value : env.radiance.pixels) ASSERT_NEAR(value, 1, 0.01F);
}

TEST(ProbeMapper, AppliesTheGainPerChannel) {
  const Lens lens = fisheye(100);
  ProbeMapper mapper(lens, looking_up(), {.height = 16, .unseen = Unseen::mean});
  Environment env;
  mapper.map(photograph_sky(lens, looking_up(), white), {diagonal({2, 3, 0.5F}), {}}, env);
  EXPECT_NEAR(env.radiance.at(2, 3, 0), 2, 1e-5F);
  EXPECT_NEAR(env.radiance.at(2, 3, 1), 3, 1e-5F);
  EXPECT_NEAR(env.radiance.at(15, 3, 2), 0.5F, 1e-5F);
}

TEST(ProbeMapper, AppliesAMatrixToEveryTexel) {
  const ColourMatrix matrix{0.9F, 0.2F, -0.1F, 0.1F, 1.1F, 0.05F, -0.05F, 0.3F, 0.7F};
  const Lens lens = fisheye(200);
  ProbeMapper mapper(lens, looking_up(), {.height = 32, .unseen = Unseen::mean});
  const capture::Image sky = photograph_sky(lens, looking_up(), smooth_sky);
  Environment plain;
  mapper.map(sky, {}, plain);
  Environment env;
  mapper.map(sky, {matrix, {}}, env);
  EXPECT_EQ(mapper.texels_below_zero(), 0);
  for (std::size_t i = 0; i < plain.seen.size(); ++i) {
    const float* p = &plain.radiance.pixels[3 * i];
    for (std::size_t c = 0; c < 3; ++c) {
      const float* row = &matrix[3 * c];
      ASSERT_NEAR(env.radiance.pixels[3 * i + c], row[0] * p[0] + row[1] * p[1] + row[2] * p[2],
                  1e-5F);
    }
  }
  Environment diagonal_env;
  mapper.map(sky, {diagonal({1, 1, 1}), {}}, diagonal_env);
  EXPECT_EQ(diagonal_env.radiance.pixels, plain.radiance.pixels);
}

TEST(ProbeMapper, CountsColoursThatAMatrixTakesBelowZeroAsNoLight) {
  const ColourMatrix matrix{2, -0.9F, 0, 0, 1, 0, 0, 0, 1};
  const Lens lens = fisheye(200);
  ProbeMapper mapper(lens, looking_up(), {.height = 32, .unseen = Unseen::mean});
  Environment env;
  mapper.map(photograph_sky(lens, looking_up(),
                            [](Vec3f d) {
                              return d.x > 0 ? Vec3f{0.1F, 1, 1}
                                             : Vec3f{1, std::numeric_limits<float>::infinity(), 1};
                            }),
             {matrix, {}}, env);
  EXPECT_GT(mapper.texels_below_zero(), 32 * 64 * 2 / 5);
  for (const float value : env.radiance.pixels) ASSERT_TRUE(value >= 0 && std::isfinite(value));
}

TEST(ProbeMapper, FillsTheFloorByTheLightThatFallsOnIt) {
  const Lens lens = fisheye(400, 90);
  ProbeMapper mapper(lens, looking_up(), {.height = 64});
  Environment env;
  mapper.map(photograph_sky(lens, looking_up(), white), {}, env);
  EXPECT_EQ(env.seen.back(), 0);
  EXPECT_NEAR(env.radiance.at(60, 5, 0), 0.2F, 0.002F);
  EXPECT_LT(env.unseen_share, 0.01F);
  mapper.map(photograph_sky(lens, looking_up(), white), {.floor_radiance = Vec3f{.1F, .2F, .3F}},
             env);
  EXPECT_EQ(env.radiance.at(60, 5, 2), .3F);
}

TEST(ProbeMapper, MirrorsTheUnseenHalfAtItsRim) {
  const Lens lens = fisheye(400, 90);
  const Pose pose = calibrate::pose_from_axis({0, 0, 0}, {0, 1, 0}, 0);
  ProbeMapper mapper(lens, pose, {.height = 64, .unseen = Unseen::mirror});
  Environment env;
  mapper.map(photograph_sky(lens, pose,
                            [](Vec3f d) {
                              return Vec3f{1 + d.z, 1 + d.x, 1};
                            }),
             {}, env);
  for (const Vec3f d :
       {Vec3f{0, -1, 0}, normalize(Vec3f{1, -1, 1}), normalize(Vec3f{-1, -2, 0.5F})}) {
    const Vec3f radiance = radiance_of(env, d, 0);
    EXPECT_NEAR(radiance.x, 1 + d.z, 0.06F);
    EXPECT_NEAR(radiance.y, 1 + d.x, 0.06F);
  }
  // Half of the upward light is filled in.
  EXPECT_NEAR(env.unseen_share, 0.5F, 0.02F);
}

TEST(ProbeMapper, FillsByTheMeanOfWhatIsSeenWithoutItsSun) {
  const Lens lens = fisheye(400, 90);
  ProbeMapper mapper(lens, looking_up(), {.height = 64, .unseen = Unseen::mean});
  Environment env;
  mapper.map(photograph_sky(lens, looking_up(), [](Vec3f d) { return Vec3f{d.z, 1, 1}; }), {}, env);
  EXPECT_NEAR(env.radiance.at(60, 5, 0), 0.5F, 0.01F);
  const auto with_sun = [](Vec3f d) {
    return d.z > 0.99F ? Vec3f{1e4F, 1e4F, 1e4F} : Vec3f{d.z, 1, 1};
  };
  mapper.map(photograph_sky(lens, looking_up(), with_sun), {}, env);
  EXPECT_NEAR(env.radiance.at(60, 5, 0), 0.5F, 0.02F);
}

TEST(ProbeMapper, CountsNotANumberAndNegativeValuesAsZero) {
  const Lens lens = fisheye(100);
  ProbeMapper mapper(lens, looking_up(), {.height = 16});
  capture::Image picture = photograph_sky(lens, looking_up(), white);
  picture.at(50, 50, 0) = std::numeric_limits<float>::quiet_NaN();
  picture.at(40, 50, 1) = -1e9F;
  picture.at(60, 50, 2) = std::numeric_limits<float>::infinity();
  Environment env;
  mapper.map(picture, {}, env);
  for (const float value : env.radiance.pixels) {
    ASSERT_TRUE(std::isfinite(value));
    ASSERT_GE(value, 0);
  }
}

TEST(ProbeMapper, GivesTheSameBitsEachTimeAndKeepsItsBuffers) {
  const Lens lens = fisheye(256);
  ProbeMapper mapper(lens, looking_up(), {.height = 64});
  const capture::Image picture = photograph_sky(lens, looking_up(), smooth_sky);
  Environment env;
  mapper.map(picture, {}, env);
  const std::vector<float> first = env.radiance.pixels;
  const float* const buffer = env.radiance.pixels.data();
  mapper.map(picture, {}, env);
  EXPECT_EQ(env.radiance.pixels, first);
  EXPECT_EQ(env.radiance.pixels.data(), buffer);
}

TEST(ProbeMapper, FillsWithNothingBelowAndAboveWhereOnlyTheFloorIsSeenAndMirrorsAll) {
  const Lens lens = fisheye(64, 80);
  const Pose looking_down = calibrate::look_at({0, 0, 0}, {0, 0, -1}, 0);
  ProbeMapper mapper(lens, looking_down,
                     {.height = 32, .unseen = Unseen::floor, .floor_albedo = 1});
  Environment env;
  capture::Image picture = capture::make_image(64, 64);
  std::fill(picture.pixels.begin(), picture.pixels.end(), 1.0F);
  mapper.map(picture, {}, env);
  for (const float value : env.radiance.pixels) ASSERT_TRUE(value >= 0 && value <= 1.01F) << value;
}

TEST(ProbeMapper, RefusesWhatCannotBe) {
  const Lens lens = fisheye(64);
  EXPECT_THROW(ProbeMapper(lens, looking_up(), {.height = 4}), std::invalid_argument);
  EXPECT_THROW(ProbeMapper(lens, looking_up(), {.height = 16, .floor_albedo = 2}),
               std::invalid_argument);
  EXPECT_THROW(ProbeMapper(lens, looking_up(), {.height = 16, .vignetting = {-1}}),
               std::invalid_argument);
  EXPECT_THROW(ProbeMapper(Lens{}, looking_up(), {.height = 16}), std::invalid_argument);
  // A picture that the lens's image lies beside.
  EXPECT_THROW(
      ProbeMapper(calibrate::cropped(lens, 5000, 5000, 64, 64), looking_up(), {.height = 16}),
      std::invalid_argument);
  ProbeMapper mapper(lens, looking_up(), {.height = 16});
  Environment env;
  EXPECT_THROW(mapper.map(capture::make_image(64, 65), {}, env), std::invalid_argument);
}

}  // namespace
}  // namespace render::probe_test
