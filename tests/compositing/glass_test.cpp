// Glass: what optics says of it, in the kernel and in the reference.
#include "render/glass.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include "calibrate/angles.h"
#include "render/kept_transport.h"
#include "render/light_follower.h"
#include "render/reference.h"
#include "render/trace.h"
#include "tests/compositing/made_glass.h"
#include "tests/render/plain_shapes.h"
#include "tests/render/sun_and_sky.h"

namespace compositing::glass_test {
namespace {

using render::Vec3f;

using calibrate::degree;

TEST(Fresnel, IsWhatTheFormulasSayAtEveryAngle) {
  for (const double index : {1.0, 1.33, 1.5, 2.4, 3.0}) {
    for (int i = 0; i < 90; ++i) {
      const double angle = i * degree;
      const double inside = std::asin(std::sin(angle) / index);
      double share = std::pow((index - 1) / (index + 1), 2);
      if (i > 0) {
        const double across = std::sin(angle - inside) / std::sin(angle + inside);
        const double along = std::tan(angle - inside) / std::tan(angle + inside);
        share = 0.5 * (across * across + along * along);
      }
      EXPECT_NEAR(
          render::fresnel(static_cast<float>(std::cos(angle)), static_cast<float>(1 / index)),
          share, 2e-5);
      // From inside, at the refracted angle, the same share is mirrored.
      EXPECT_NEAR(render::fresnel(static_cast<float>(std::cos(inside)), static_cast<float>(index)),
                  share, 3e-4);
    }
  }
}

TEST(Fresnel, MirrorsAllBeyondTheCriticalAngle) {
  const double critical = std::asin(1 / 1.5);
  EXPECT_LT(render::fresnel(static_cast<float>(std::cos(critical - 0.001)), 1.5F), 1);
  EXPECT_EQ(render::fresnel(static_cast<float>(std::cos(critical + 0.001)), 1.5F), 1);
  EXPECT_EQ(render::refracted({0.9F, 0, -std::sqrt(0.19F)}, {0, 0, 1}, 1.5F), Vec3f{});
}

TEST(Fresnel, LosesOnePolarisationAtBrewstersAngleAndMirrorsAllAtGrazing) {
  for (double index = 1; index < 3.01; index += 0.1) {
    const auto ratio = static_cast<float>(1 / index);
    // There all that is mirrored is polarised across: half of its share.
    const double across = (index * index - 1) / (index * index + 1);
    EXPECT_NEAR(render::fresnel(static_cast<float>(1 / std::hypot(1, index)), ratio),
                0.5 * across * across, 1e-5)
        << index;
    if (index < 1.05) continue;
    // Near grazing by its slope: 1 - 2 c (n^2 + 1) / sqrt(n^2 - 1).
    const double slope = 2 * (index * index + 1) / std::sqrt(index * index - 1);
    EXPECT_NEAR(render::fresnel(1e-4F, ratio), 1 - 1e-4 * slope, 1e-5) << index;
    EXPECT_EQ(render::fresnel(0, ratio), 1);
    const double critical = std::asin(1 / index);
    const auto inside = [&](double angle) {
      return render::fresnel(static_cast<float>(std::cos(angle)), static_cast<float>(index));
    };
    EXPECT_LT(inside(critical - 1e-3), 1) << index;
    for (double angle = critical + 1e-3; angle < 90 * degree; angle += 0.05)
      EXPECT_EQ(inside(angle), 1) << index;
  }
}

TEST(Refracted, IsSnellsInAnyPlaneAndGoesBackTheSameWay) {
  std::mt19937 engine(3);
  std::normal_distribution<float> normal_distribution;
  const auto direction = [&] {
    return normalize(Vec3f{normal_distribution(engine), normal_distribution(engine),
                           normal_distribution(engine)});
  };
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3f normal = direction();
    Vec3f in = direction();
    if (dot(in, normal) > 0) in = -in;
    const float index = 1 + 0.001F * static_cast<float>(trial);
    for (const float ratio : {1 / index, index}) {
      const Vec3f out = render::refracted(in, normal, ratio);
      const float sine = length(cross(in, normal));
      if (out == Vec3f{}) {
        EXPECT_GE(sine * ratio, 1 - 1e-5F);
        continue;
      }
      EXPECT_NEAR(length(out), 1, 1e-5);
      EXPECT_LE(length(cross(out, normal) - cross(in, normal) * ratio), 1e-5F);
      EXPECT_LE(dot(out, normal), 0);
      if (sine * ratio > 0.999F) continue;
      EXPECT_LE(length(render::refracted(-out, -normal, 1 / ratio) + in), 2e-3F);
    }
  }
}

TEST(Refracted, ObeysSnellsLaw) {
  for (int i = 0; i < 90; ++i) {
    const double angle = i * degree;
    const Vec3f in{static_cast<float>(std::sin(angle)), 0, static_cast<float>(-std::cos(angle))};
    const Vec3f out = render::refracted(in, {0, 0, 1}, 1 / 1.5F);
    EXPECT_NEAR(out.x, std::sin(angle) / 1.5, 1e-6);
    EXPECT_EQ(out.y, 0);
    EXPECT_NEAR(length(out), 1, 1e-6);
  }
}

TEST(GlassParameters, AreRefusedByNameWhenOutOfRange) {
  const auto refuses = [](const std::function<void(render::GlassParameters&)>& spoil) {
    render::GlassParameters p;
    spoil(p);
    EXPECT_THROW(render::glass_parameters(render::make_glass_material("cover", p)),
                 std::invalid_argument);
  };
  refuses([](auto& p) { p.index = 0.9F; });
  refuses([](auto& p) { p.index = std::nanf(""); });
  refuses([](auto& p) { p.absorption[1] = -1; });
  refuses([](auto& p) { p.shadow[2] = 2; });
  refuses([](auto& p) { p.abbe = 2; });
  refuses([](auto& p) { p.tint[1] = 1.01F; });
  refuses([](auto& p) { p.tint[2] = -0.1F; });
  render::Material short_block = render::make_glass_material("cover", {});
  short_block.parameters.pop_back();
  EXPECT_THROW(render::glass_parameters(short_block), std::invalid_argument);
}

TEST(IndicesOf, BendBlueMoreThanRedByAbbesNumber) {
  const auto [red, green, blue] = render::indices_of({.index = 1.5168F, .abbe = 64.17F});
  EXPECT_LT(red, green);
  EXPECT_LT(green, blue);
  EXPECT_NEAR(red, 1.5157, 5e-4);   // BK7 at 611 nm, by Sellmeier's equation
  EXPECT_NEAR(blue, 1.5242, 1e-3);  // at 464 nm
}

double middle_of(const capture::Image& picture) {
  return picture.at(picture.height / 2, picture.width / 2, 0);
}

TEST(Glass, SlabLetsThroughWhatTheSeriesOfItsReflectionsSays) {
  for (const float index : {1.33F, 1.5F, 2.4F}) {
    for (const float absorption : {0.0F, 3.0F, 40.0F}) {
      const double f = std::pow((index - 1) / (index + 1), 2);
      const double a = std::exp(-absorption * 0.1);
      const double through = (1 - f) * (1 - f) * a / (1 - f * f * a * a);
      const double back = f + f * (1 - f) * (1 - f) * a * a / (1 - f * f * a * a);
      // Light 1 before the camera, 3 behind it.
      const GlassShot shot =
          glass_shot(bodies({render::make_box({-5, -0.05F, -5}, {5, 0.05F, 5})},
                            {{.index = index, .absorption = {absorption, absorption, absorption}}}),
                     [](Vec3f d) { return d.y > 0 ? 1.0F : 3.0F; }, 16, 400, {0, -3, 0});
      EXPECT_NEAR(middle_of(shot.kernel()), through + 3 * back, 1e-3 * (through + 3 * back));
    }
  }
}

// Unpolarised light at every face, as the renderer has it. Light 1 behind the slab, 3 before it.
TEST(Glass, SlantedSlabLetsThroughWhatTheSeriesSaysInKernelAndReference) {
  for (const float index : {1.33F, 1.5F, 2.4F}) {
    for (const double angle : {0.0, 40.0, 60.0, 75.0}) {
      for (const float absorption : {0.0F, 3.0F}) {
        const double inside = std::asin(std::sin(angle * degree) / index);
        const double f = render::fresnel(static_cast<float>(std::cos(angle * degree)), 1 / index);
        const double a = std::exp(-absorption * 0.1 / std::cos(inside));
        const double through = (1 - f) * (1 - f) * a / (1 - f * f * a * a);
        const double back = f + f * (1 - f) * (1 - f) * a * a / (1 - f * f * a * a);
        const double expected = through + 3 * back;
        const GlassShot shot = glass_shot(
            bodies({render::make_box({-5, -0.05F, -5}, {5, 0.05F, 5})},
                   {{.index = index, .absorption = {absorption, absorption, absorption}}}),
            [](Vec3f d) { return d.y > 0 ? 1.0F : 3.0F; }, 1, 4000,
            {3 * std::sin(angle * degree), -3 * std::cos(angle * degree), 0});
        EXPECT_NEAR(shot.kernel().at(0, 0, 0) / expected, 1, 1e-3) << index << " " << angle;
        EXPECT_NEAR(shot.reference(1 << 17).at(0, 0, 0) / expected, 1, 1e-3)
            << index << " " << angle << " " << absorption;
      }
    }
  }
}

TEST(Glass, IsWhiteInAWhiteFurnace) {
  for (const float index : {1.0F, 1.5F, 3.0F}) {
    const GlassShot shot = glass_shot(bodies({render::make_sphere(1, 48)}, {{.index = index}}),
                                      [](Vec3f) { return 1.0F; }, 32, 40, {0, -4, 1});
    const capture::Image kernel = shot.kernel();
    const capture::Image reference = shot.reference(64);
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 32; ++x) {
        EXPECT_NEAR(kernel.at(y, x, 0), 1, 0.004) << index << ": " << x << ", " << y;
        EXPECT_NEAR(reference.at(y, x, 0), 1, 0.02) << index << ": " << x << ", " << y;
      }
    }
  }
}

// A foil on either side: what passes a surface takes its tint, what is mirrored takes none.
TEST(Glass, TintsLightAtEachSurfaceThatItPasses) {
  constexpr std::array<float, 3> tint{0.8F, 0.3F, 0};
  for (const float index : {1.0F, 1.5F, 2.4F}) {
    const double f = std::pow((index - 1) / (index + 1), 2);
    // Light 1 before the camera, 3 behind it.
    const GlassShot shot =
        glass_shot(bodies({render::make_box({-5, -0.05F, -5}, {5, 0.05F, 5})},
                          {{.index = index, .tint = {tint[0], tint[1], tint[2]}}}),
                   [](Vec3f d) { return d.y > 0 ? 1.0F : 3.0F; }, 16, 400, {0, -3, 0});
    const capture::Image kernel = shot.kernel(), reference = shot.reference(1000);
    for (int c = 0; c < 3; ++c) {
      const double t = tint[static_cast<std::size_t>(c)];
      const double through = t * t * (1 - f) * (1 - f) / (1 - f * f);
      const double back = f + t * t * f * (1 - f) * (1 - f) / (1 - f * f);
      EXPECT_NEAR(kernel.at(8, 8, c), through + 3 * back, 1e-3) << index << " " << c;
      double mean = 0;
      for (int i = 0; i < 256; ++i) mean += reference.at(i / 16, i % 16, c) / 256;
      EXPECT_NEAR(mean, through + 3 * back, 0.01) << index << " " << c;
    }
  }
}

TEST(Glass, OfATintKeepsAWhiteWorldWhiteInWhiteAndDarkensItElse) {
  const auto white = [](Vec3f) { return 1.0F; };
  for (const float abbe : {0.0F, 20.0F}) {
    const GlassShot shot =
        glass_shot(bodies({render::make_sphere(1, 48)}, {{.abbe = abbe, .tint = {1, 0.5F, 0}}}),
                   white, 24, 40, {0, -4, 1});
    const capture::Image kernel = shot.kernel(), reference = shot.reference(256);
    for (const capture::Image* picture : {&kernel, &reference}) {
      for (int y = 8; y < 16; ++y) {
        for (int x = 8; x < 16; ++x) {
          EXPECT_LT(picture->at(y, x, 2), picture->at(y, x, 1) + 0.02);
          EXPECT_LT(picture->at(y, x, 1), 0.5);
        }
      }
    }
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 24; ++x) {
        EXPECT_NEAR(kernel.at(y, x, 0), 1, 0.01);
        EXPECT_LT(kernel.at(y, x, 1), 1.01);
      }
    }
  }
}

TEST(Glass, TintsItsShadowTwice) {
  const Vec3f shadow = [] {
    const render::Scene scene(bodies({render::make_box({-1, -1, -1}, {1, 1, 1})},
                                     {{.shadow = {0.5F, 1, 1}, .tint = {0.5F, 0.5F, 0}}}));
    return transmittance(scene, {0.1F, 0.3F, 5}, {0, 0, -1}, 0, 10, render::mask_virtual);
  }();
  EXPECT_NEAR(shadow.x, 0.0625, 1e-6);
  EXPECT_NEAR(shadow.y, 0.25, 1e-6);
  EXPECT_EQ(shadow.z, 0);
}

TEST(Glass, OfIndexOneIsNotThere) {
  GlassShot shot = glass_shot(bodies({render::make_sphere(1, 48)}, {{.index = 1}}),
                              [](Vec3f d) { return 1 + d.x; }, 32, 40, {0, -4, 1});
  const capture::Image with = shot.kernel();
  shot.scene = std::make_unique<render::Scene>(bodies({}, {}));
  const capture::Image without = shot.kernel();
  for (std::size_t i = 0; i < with.pixels.size(); ++i) {
    if (i % 4 == 3) continue;  // coverage
    EXPECT_NEAR(with.pixels[i], without.pixels[i], 0.01);
  }
}

// A plano-convex lens shows things at its focal length, upside down beyond it.
TEST(Glass, BallBendsRaysToItsFocus) {
  // Parallel rays near the axis meet at n R / (2 (n - 1)) behind the middle of a ball. A camera
  // there sees one direction all over the ball's middle: that straight on.
  const float index = 1.5F;
  const double focus = index / (2 * (index - 1));
  const auto slope = [](Vec3f d) { return 0.5F + 5 * d.x; };
  GlassShot shot = glass_shot(bodies({render::make_sphere(1, 384)}, {{.index = index}}), slope, 33,
                              33 / (2 * std::tan(0.06)), {0, -focus, 0});
  const capture::Image at_focus = shot.kernel();
  EXPECT_NEAR(at_focus.at(16, 2, 0), at_focus.at(16, 30, 0), 0.03);
  shot.job.cam_from_set = calibrate::look_at({0, -4 * focus, 0}, {0, 0, 0}, 0);
  const capture::Image beyond = shot.kernel();
  EXPECT_GT(beyond.at(16, 2, 0), beyond.at(16, 30, 0) + 0.1);  // turned around
}

TEST(Glass, BulbInAHollowIsSeenAsIfTheGapWereThere) {
  // Water in a glass ball, its inside described twice: with a gap of air, and overlapping, where
  // the glass has priority. A third way, glass alone with water's hollow as an own surface, is the
  // truth.
  const auto outer = render::make_sphere(1, 64), inner = render::make_sphere(0.7F, 64),
             over = render::make_sphere(0.75F, 64);
  const auto radiance = [](Vec3f d) { return 1 + 0.8F * d.z + 0.3F * d.x; };
  const render::GlassParameters glass{.index = 1.5F}, water{.index = 1.33F, .priority = 1};
  const GlassShot nested =
      glass_shot(bodies({outer, inner}, {glass, water}), radiance, 33, 60, {0, -4, 0.5});
  // The water reaches too far, but where glass of higher priority is, it is glass: a shell.
  auto shell = std::make_shared<render::Mesh>(*outer);
  const auto first = static_cast<std::uint32_t>(shell->positions.size());
  for (std::size_t i = 0; i < inner->positions.size(); ++i) {
    shell->positions.push_back(inner->positions[i]);
    shell->normals.push_back(-inner->normals[i]);
  }
  for (const auto& [a, b, c] : inner->triangles) {
    shell->triangles.push_back({first + a, first + c, first + b});
  }
  const GlassShot overlapping =
      glass_shot(bodies({shell, over}, {{.index = 1.5F, .priority = 2}, water}), radiance, 33, 60,
                 {0, -4, 0.5});
  const capture::Image a = nested.kernel(), b = overlapping.kernel();
  double squares = 0, differences = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    squares += a.pixels[i] * a.pixels[i];
    differences += std::pow(a.pixels[i] - b.pixels[i], 2);
  }
  EXPECT_LT(std::sqrt(differences / squares), 0.003);
}

TEST(Glass, DispersesIntoColours) {
  const auto shot_of = [](float abbe) {
    return glass_shot(bodies({render::make_sphere(1, 384)}, {{.index = 1.5F, .abbe = abbe}}),
                      [](Vec3f d) { return d.x > -0.12F ? 1.0F : 0.0F; }, 65, 300, {0, -4, 0});
  };
  const auto colour = [](const capture::Image& picture) {
    double most = 0;
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        most = std::max<double>(most, std::abs(picture.at(y, x, 0) - picture.at(y, x, 2)));
      }
    }
    return most;
  };
  EXPECT_EQ(colour(shot_of(0).kernel()), 0);
  EXPECT_GT(colour(shot_of(20).kernel()), 0.1);
  EXPECT_GT(colour(shot_of(20).reference(1000)), 0.1);
}

// What is rough mirrors no more of the sun than glass lets by: seen straight, and through glass.
TEST(Glass, DimsTheSunThatRoughThingsMirror) {
  const auto picture = [](float shadow, double from) {
    render::SceneDescription scene = bodies({render::make_box({-2, -2, -2}, {2, 2, 2})},
                                            {{.index = 1, .shadow = {shadow, shadow, shadow}}});
    render::StandardParameters metal;
    metal.metallic = 1;
    metal.roughness = 0.4F;
    auto ball = std::make_shared<render::Mesh>(*render::make_sphere(0.5F, 48));
    ball->materials = {1};
    scene.meshes.push_back(ball);
    scene.materials.push_back(render::make_standard_material("metal", metal));
    scene.instances.emplace_back().mesh = 1;
    GlassShot shot =
        glass_shot(std::move(scene), [](Vec3f) { return 0.0F; }, 48, 50, {0, -from, 0});
    shot.environment = render::make_sun_and_sky(
        {.sun_azimuth_rad = -1.4F, .sun_elevation_rad = 0.6F, .clouds = 0}, 128);
    render::LightFollower follower;
    shot.job.lights = follower.follow(shot.environment, {});
    render::smooth_for_reflections(shot.environment, follower.compact_texels());
    EXPECT_TRUE(shot.environment.compact_apart);
    return shot.kernel();
  };
  for (const double from : {1.5, 3.0}) {  // inside of the glass, outside
    const capture::Image clear = picture(1, from), half = picture(0.5F, from);
    const capture::Image dark = picture(0, from);
    int lit = 0, between = 0;
    for (int y = 0; y < clear.height; ++y) {
      for (int x = 0; x < clear.width; ++x) {
        const float all = clear.at(y, x, 1), none = dark.at(y, x, 1);
        if (all < 1.2F * none) continue;
        ++lit;
        between += std::abs(half.at(y, x, 1) - 0.5F * (all + none)) < 0.1F * (all - none);
      }
    }
    EXPECT_GT(lit, 80) << from;
    EXPECT_GT(between, 0.8 * lit) << from;
  }
}

// A sun that a ball of glass bends shows in metal behind it where it is bent to, not straight on.
TEST(Glass, BendsTheSunThatMetalMirrors) {
  for (const float roughness : {0.1F, 0.2F, 0.4F}) {
    SCOPED_TRACE(roughness);
    auto metal_ball = std::make_shared<render::Mesh>(*render::make_sphere(0.5F, 48));
    for (Vec3f& p : metal_ball->positions) p += Vec3f{-1.2F, 0, -0.4F};
    metal_ball->materials = {1};
    render::SceneDescription scene = bodies({render::make_sphere(0.5F, 96)}, {{.index = 1.6F}});
    render::StandardParameters metal;
    metal.metallic = 1;
    metal.roughness = roughness;
    scene.meshes.push_back(metal_ball);
    scene.materials.push_back(render::make_standard_material("metal", metal));
    scene.instances.emplace_back().mesh = 1;
    GlassShot shot =
        glass_shot(std::move(scene), [](Vec3f) { return 0.0F; }, 64, 60, {-0.6, -2.6, 0});
    shot.environment = render::make_sun_and_sky(
        {.sun_radius_rad = 0.01F, .sun_azimuth_rad = 0, .sun_elevation_rad = 0.3F, .clouds = 0},
        256);
    render::LightFollower follower;
    shot.job.lights = follower.follow(shot.environment, {});
    render::smooth_for_reflections(shot.environment, follower.compact_texels());
    ASSERT_TRUE(shot.environment.compact_apart);
    shot.job.effort = {};
    const capture::Image kernel = shot.kernel(), truth = shot.reference(256);
    double squares = 0, errors = 0;
    int fireflies = 0;
    for (int y = 1; y + 1 < truth.height; ++y) {
      for (int x = 1; x + 1 < truth.width; ++x) {
        const double shown = std::min<double>(kernel.at(y, x, 1), 4);
        const double is = std::min<double>(truth.at(y, x, 1), 4);
        squares += is * is;
        errors += (shown - is) * (shown - is);
        float most = 0;
        for (int i = 0; i < 9; ++i)
          most = std::max(most, truth.at(y - 1 + i / 3, x - 1 + i % 3, 1));
        fireflies += kernel.at(y, x, 1) > 4 * most + 2;
      }
    }
    EXPECT_LT(std::sqrt(errors / squares), 0.22);  // straight on .22 to .45
    EXPECT_EQ(fireflies, 0);
  }
}

// Light that a rough thing gets through glass counts once.
TEST(Glass, LeavesAWhiteRoughThingInAWhiteWorldWhite) {
  for (const float roughness : {0.2F, 0.5F, 1.0F}) {
    render::SceneDescription scene = bodies({render::make_box({-2, -2, -2}, {2, 2, 2})}, {{}});
    render::StandardParameters metal;
    metal.metallic = 1;
    metal.roughness = roughness;
    auto ball = std::make_shared<render::Mesh>(*render::make_sphere(0.5F, 48));
    ball->materials = {1};
    scene.meshes.push_back(ball);
    scene.materials.push_back(render::make_standard_material("metal", metal));
    scene.instances.emplace_back().mesh = 1;
    const GlassShot shot =
        glass_shot(std::move(scene), [](Vec3f) { return 1.0F; }, 16, 40, {0, -5, 0});
    const capture::Image picture = shot.reference(256);
    double sum = 0;
    for (const float v : picture.pixels) sum += v;
    EXPECT_NEAR(sum / static_cast<double>(picture.pixels.size()), 1, 0.01) << roughness;
  }
}

// A glass ball on a stand-in floor, before a plate.
MadeShot ball_on_plate(int size) {
  render::SceneDescription scene = shot_scene();
  scene.materials[2] = render::make_glass_material("glass", {.index = 1.5F});
  scene.meshes[2] = made_ball({0.5F, -0.9F, 0.4F}, 0.4F, 2);
  scene.instances.erase(scene.instances.begin() + 1);  // the red ball
  MadeShot shot = made_shot(size, size * 3 / 4, std::move(scene));
  shot.job.effort.accuracy = 0.999F;
  return shot;
}

calibrate::Lens lens_of(const MadeShot& shot) {
  const double f = shot.directions.width * 1.1;
  return {"pinhole",
          shot.directions.width,
          shot.directions.height,
          {f, f, (shot.directions.width - 1) / 2.0, (shot.directions.height - 1) / 2.0}};
}

TEST(Glass, ShowsThePlateBehindItAsTheReferenceDoes) {
  MadeShot shot = ball_on_plate(96);
  // A plate that tells where one looks: a ramp to the right.
  capture::Image plate = capture::make_image(72, 96, 3);
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      plate.at(y, x, 0) = static_cast<float>(x) / 96;
      plate.at(y, x, 1) = static_cast<float>(y) / 72;
      plate.at(y, x, 2) = 0.5F;
    }
  }
  shot.plate = capture::to_half(plate);
  plate = capture::to_float(shot.plate);
  const calibrate::Lens lens = lens_of(shot);
  render::FrameInputs inputs = shot.inputs();
  inputs.lens = &lens;
  render::FrameResult result;
  render_frame(inputs, shot.job, shot.plate, result);
  const capture::Image kernel = capture::to_float(result.rgba);
  const capture::Image reference = render_reference(inputs, shot.job, plate, {.samples = 512});
  const capture::Image mask = render::affected_mask(reference, plate);
  EXPECT_LT(render::picture_error(kernel, reference, mask).relative_rms, 0.02);

  // Without the plate, the picture is another.
  inputs.lens = nullptr;
  render_frame(inputs, shot.job, shot.plate, result);
  EXPECT_GT(render::picture_error(capture::to_float(result.rgba), reference, mask).relative_rms,
            0.05);
}

// A glass ball in a box of walls that glow, through whose windows one looks: what lies straight on
// for a ray that is cut is the sky, but it would meet a wall.
GlassShot ball_between_walls() {
  render::SceneDescription scene = bodies({render::make_sphere(0.5F, 48)}, {{.index = 1.8F}});
  render::StandardParameters dim;
  std::fill_n(dim.base_color, 3, 0.0F);
  std::fill_n(dim.emission, 3, 0.05F);
  dim.specular = 0;
  scene.materials.push_back(render::make_standard_material("wall", dim));
  for (const auto& wall :
       {render::make_box({-2, -1, -2}, {-1.9F, 3, 2}), render::make_box({1.9F, -1, -2}, {2, 3, 2}),
        render::make_box({-2, -1, 1.9F}, {2, 3, 2}), render::make_box({-2, 2.9F, -2}, {2, 3, 2})}) {
    auto mesh = std::make_shared<render::Mesh>(*wall);
    mesh->materials = {1};
    scene.instances.emplace_back().mesh = static_cast<std::uint32_t>(scene.meshes.size());
    scene.meshes.push_back(std::move(mesh));
  }
  return glass_shot(std::move(scene), [](Vec3f d) { return d.z < -0.3F ? 2.0F : 0.9F; }, 64, 150,
                    {0, -5, 0});
}

// Over all pixels and channels.
double mean_of(const capture::Image& picture) {
  double sum = 0;
  for (const float v : picture.pixels) sum += v;
  return sum / static_cast<double>(picture.pixels.size());
}

TEST(Glass, IsRightInTheMeanWhereRaysAreFollowedByChance) {
  GlassShot shot = ball_between_walls();
  render::Effort& effort = shot.job.effort;
  effort.aa_samples = 1;
  const double truth = mean_of(shot.kernel());
  effort.accuracy = 0.8F;
  const double cut = std::abs(mean_of(shot.kernel()) / truth - 1);
  EXPECT_GT(cut, 0.02);  // else this test shows nothing
  effort.chance_cuts = true;
  EXPECT_LT(std::abs(mean_of(shot.kernel()) / truth - 1), 0.1 * cut);
}

TEST(Glass, IsTheSameWhateverTilesWhereRaysAreFollowedByChance) {
  GlassShot shot = ball_between_walls();
  shot.job.effort.accuracy = 0.8F;
  shot.job.effort.chance_cuts = true;
  const capture::Image once = shot.kernel();
  shot.job.effort.tile_size = 64;
  EXPECT_EQ(once.pixels, shot.kernel().pixels);
  shot.job.effort.chance_cuts = false;
  EXPECT_NE(once.pixels, shot.kernel().pixels);
}

TEST(Glass, IsTheSameWhateverTheTilesAndWhatIsKept) {
  MadeShot shot = ball_on_plate(80);
  const calibrate::Lens lens = lens_of(shot);
  render::FrameInputs inputs = shot.inputs();
  inputs.lens = &lens;
  render::FrameResult once, again, warm;
  render_frame(inputs, shot.job, shot.plate, once);
  shot.job.effort.tile_size = 16;
  render_frame(inputs, shot.job, shot.plate, again);
  EXPECT_EQ(once.rgba.pixels, again.rgba.pixels);

  // A new plate through kept transport.
  render::KeptTransport kept;
  inputs.kept = &kept;
  render_frame(inputs, shot.job, shot.plate, warm);
  for (capture::Half& half : shot.plate.pixels) {
    half = capture::half_from_float(1 - capture::float_from_half(half));
  }
  render_frame(inputs, shot.job, shot.plate, warm);
  EXPECT_GT(warm.statistics.kept_rays, 0U);
  inputs.kept = nullptr;
  render_frame(inputs, shot.job, shot.plate, again);
  EXPECT_EQ(warm.rgba.pixels, again.rgba.pixels);
  EXPECT_NE(warm.rgba.pixels, once.rgba.pixels);
}

}  // namespace
}  // namespace compositing::glass_test
