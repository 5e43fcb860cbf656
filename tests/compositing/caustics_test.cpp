// Light through glass on real floors and dull things: kernel and reference, warm and cold.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "render/kept_transport.h"
#include "tests/compositing/made_glass.h"
#include "tests/render/plain_shapes.h"
#include "tests/render/sun_and_sky.h"

namespace compositing::caustics_test {
namespace {

using render::Vec3f;

// A ball of glass over a real floor, beside a dull box, under a large sun, seen through a lens.
struct BallShot {
  MadeShot shot;
  calibrate::Lens lens;

  explicit BallShot(int size, const render::GlassParameters& glass = {.index = 1.5F}) {
    render::SceneDescription scene = shot_scene(false);
    scene.materials[2] = render::make_glass_material("glass", glass);
    scene.meshes.push_back(made_ball({0, 0, 0}, 0.4F, 2));
    render::StandardParameters dull;
    dull.specular = 0;
    dull.roughness = 1;
    scene.materials[1] = render::make_standard_material("dull", dull);
    auto box =
        std::make_shared<render::Mesh>(*render::make_box({0.5F, -0.4F, -0.5F}, {0.9F, 0.4F, 0.2F}));
    box->materials = {1};
    scene.meshes.push_back(box);
    for (std::uint32_t mesh = 1; mesh <= 2; ++mesh) {
      render::Instance instance;
      instance.name = "thing";
      instance.mesh = mesh;
      instance.moves = true;
      instance.set_from_object[11] = 0.5F;
      scene.instances.push_back(instance);
    }
    shot = made_shot(size, size * 3 / 4, std::move(scene));
    const double f = size * 1.1;
    lens = {"pinhole", size, size * 3 / 4, {f, f, (size - 1) / 2.0, (size * 3 / 4 - 1) / 2.0}};
    shot.job.cam_from_set = calibrate::look_at({0.4, -2.2, 1.5}, {0.3, 0, 0.2}, 0);
    shot.environment = render::make_sun_and_sky({.sun_radius_rad = 0.08F,
                                                 .sun_irradiance = 3,
                                                 .sun_azimuth_rad = 2.8F,
                                                 .sun_elevation_rad = 0.9F,
                                                 .clouds = 0},
                                                128);
    render::smooth_for_reflections(shot.environment);
    shot.job.lights = render::make_light_table(shot.environment, {.count = 64});
    for (auto& light : shot.job.lights.lights) light.planned = light.irradiance;
    shot.plate = capture::to_half([&] {
      capture::Image plate = capture::make_image(size * 3 / 4, size, 3);
      std::ranges::fill(plate.pixels, 0.2F);
      return plate;
    }());
  }

  render::FrameInputs inputs() const {
    render::FrameInputs inputs = shot.inputs();
    inputs.lens = &lens;
    inputs.plate = &shot.plate;
    return inputs;
  }
  render::FrameResult show(render::KeptTransport* kept = nullptr) const {
    render::FrameInputs all = inputs();
    all.kept = kept;
    render::FrameResult result;
    render_frame(all, shot.job, shot.plate, result);
    return result;
  }
  void move(std::size_t instance, int axis, float by) {
    render::SceneDescription moved = shot.scene->description();
    moved.instances[instance].set_from_object[static_cast<std::size_t>(4 * axis + 3)] += by;
    shot.scene = std::make_unique<render::Scene>(std::move(moved), *shot.scene);
  }
};

// What is left are the few brightest pixels, and what the table of lights errs.
TEST(Caustics, AreThoseOfPathsThroughTheGlass) {
  BallShot ball(64);
  ball.shot.job.effort.caustic_photons = 1;  // for the reference, any number is all
  const capture::Image plate = capture::to_float(ball.shot.plate);
  const auto truth = [&](std::uint32_t seed) {
    return render_reference(ball.inputs(), ball.shot.job, plate, {.samples = 512, .seed = seed});
  };
  const std::array references{truth(1), truth(2)};
  const capture::Image mask = render::affected_mask(references[0], plate);
  const auto error = [&](int photons) {
    ball.shot.job.effort.caustic_photons = photons;
    return render::picture_error(capture::to_float(ball.show().rgba), references, mask)
        .relative_rms;
  };
  EXPECT_LT(error(20'000), 0.045);
  EXPECT_LT(error(2'000), 0.05);
  EXPECT_GT(error(0), 0.2) << "straight on";
}

// Whatever moves, a frame that others came before has the bits of one alone.
TEST(Caustics, AreInTheVeryFrameInWhichAnythingMoves) {
  BallShot ball(64);
  ball.shot.job.effort.caustic_photons = 3000;
  render::KeptTransport kept;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> step(-0.1F, 0.1F);
  capture::HalfImage before;
  for (int frame = 0; frame < 15; ++frame) {
    const auto warm = ball.show(&kept);
    EXPECT_EQ(warm.rgba.pixels, ball.show().rgba.pixels) << frame;
    EXPECT_NE(warm.rgba.pixels, before.pixels) << frame;
    before = warm.rgba;
    switch (frame % 5) {
      case 0:
        ball.move(1, frame % 3, step(random));
        break;
      case 1:
        ball.move(2, frame % 2, step(random));
        break;
      case 2:
        ball.shot.job.lights.lights[0].irradiance *= 1.5F;
        break;
      case 3:
        ball.shot.job.effort.caustic_photons += 500;
        break;
      default:
        ball.shot.job.cam_from_set.t.x += 0.05;
    }
  }
}

// A real floor that hides nothing shows what is below it: what moves there comes into the way of
// light that glass has bent.
TEST(Caustics, AreInTheVeryFrameInWhichSomethingMovesBehindWhatHidesNothing) {
  BallShot ball(64);
  ball.shot.job.effort.caustic_photons = 3000;
  render::SceneDescription scene = ball.shot.scene->description();
  scene.instances[0].occludes = false;
  ball.shot.scene = std::make_unique<render::Scene>(std::move(scene));
  const std::size_t box = ball.shot.scene->description().instances.size() - 1;
  ball.move(box, 2, -2);  // below the floor
  ball.move(box, 0, -0.9F);
  render::KeptTransport kept;
  for (int frame = 0; frame < 8; ++frame) {
    ball.move(box, frame % 2, frame % 3 == 0 ? 0.25F : -0.12F);
    const render::FrameResult warm = ball.show(&kept), cold = ball.show();
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
  }
}

// Hidden by the least scale that there is, far from where the set begins.
TEST(Caustics, OfWhatIsTinyAndFarAwayAreNone) {
  BallShot ball(32);
  ball.shot.job.effort.caustic_photons = 500;
  for (const float far_m : {3.0F, 30.0F, 300.0F}) {
    for (int turn = 0; turn < 6; ++turn) {
      render::SceneDescription scene = ball.shot.scene->description();
      const float angle = static_cast<float>(turn);
      for (std::size_t i = 1; i < scene.instances.size(); ++i) {
        auto& place = scene.instances[i].set_from_object;
        place = {1e-6F, 0,   0, far_m * std::cos(angle), 0, 1e-6F, 0, far_m * std::sin(angle), 0, 0,
                 1e-6F, 0.5F};
      }
      BallShot tiny(32);
      tiny.shot.job.effort.caustic_photons = 500;
      tiny.shot.scene = std::make_unique<render::Scene>(std::move(scene));
      for (const capture::Half value : tiny.show().rgba.pixels)
        ASSERT_TRUE(std::isfinite(capture::float_from_half(value))) << far_m << " " << turn;
    }
  }
}

TEST(Caustics, AreTheSameWhateverTheTiles) {
  BallShot ball(80);
  ball.shot.job.effort.caustic_photons = 3000;
  const auto whole = ball.show();
  for (const int tile : {16, 48}) {
    ball.shot.job.effort.tile_size = tile;
    EXPECT_EQ(ball.show().rgba.pixels, whole.rgba.pixels) << tile;
  }
}

TEST(Caustics, FollowLiveLightWithoutARay) {
  BallShot ball(64);
  ball.shot.job.effort.caustic_photons = 3000;
  ball.shot.environment.radiance.pixels.assign(ball.shot.environment.radiance.pixels.size(), 0.0F);
  render::smooth_for_reflections(ball.shot.environment);
  for (auto& light : ball.shot.job.lights.lights) {
    if (light.irradiance.y < 0.3F) light.irradiance = light.planned = {};
  }
  std::ranges::fill(ball.shot.plate.pixels, capture::half_from_float(0.01F));
  render::KeptTransport kept;
  ball.show(&kept);
  const auto once = ball.show(&kept);
  for (auto& light : ball.shot.job.lights.lights) light.irradiance *= 3;
  const auto thrice = ball.show(&kept);
  const auto& s = thrice.statistics;
  EXPECT_EQ(s.primary_rays + s.shadow_rays + s.secondary_rays, 0U);
  EXPECT_GT(s.kept_rays, 0U);
  // The box, which the plate does not colour.
  std::size_t lit = 0;
  for (std::size_t i = 0; i < once.rgba.pixels.size(); i += 4) {
    if (capture::float_from_half(once.rgba.pixels[i + 3]) < 1) continue;
    const float a = capture::float_from_half(once.rgba.pixels[i + 1]);
    const float b = capture::float_from_half(thrice.rgba.pixels[i + 1]);
    if (a < 0.1F) continue;
    ++lit;
    EXPECT_NEAR(b, 3 * a, 0.05F * b);
  }
  EXPECT_GT(lit, 100U);
}

// What glass shows of the floor shows the light on it.
TEST(Caustics, AreSeenThroughTheGlass) {
  BallShot ball(96);
  // A window of glass that bends nothing much, between the camera and the caustic.
  render::SceneDescription scene = ball.shot.scene->description();
  auto window = std::make_shared<render::Mesh>(*render::make_box({-2, -1.1F, -1}, {2, -1.099F, 3}));
  window->materials = {static_cast<std::uint32_t>(scene.materials.size())};
  scene.materials.push_back(render::make_glass_material("window", {.index = 1.02F}));
  scene.meshes.push_back(window);
  render::Instance instance;
  instance.name = "window";
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  scene.instances.push_back(instance);
  ball.shot.job.effort.caustic_photons = 20'000;
  const capture::Image without = capture::to_float(ball.show().rgba);
  ball.shot.scene = std::make_unique<render::Scene>(std::move(scene));
  const capture::Image with = capture::to_float(ball.show().rgba);
  std::size_t bright = 0;
  double sum = 0, seen = 0;
  for (int y = 0; y < without.height; ++y) {
    for (int x = 0; x < without.width; ++x) {
      if (without.at(y, x, 3) > 0 || without.at(y, x, 1) < 0.4F) continue;
      ++bright;
      sum += without.at(y, x, 1);
      seen += with.at(y, x, 1);
    }
  }
  EXPECT_GT(bright, 20U) << "no caustic on the floor";
  EXPECT_NEAR(seen / sum, 1, 0.1);
}

TEST(Caustics, StayFiniteWhateverTheGlassAndTheLight) {
  for (const float index : {1.0F, 1.0001F, 3.0F, 4.0F}) {
    for (const float absorption : {0.0F, 1e6F}) {
      BallShot ball(24, {.index = index, .absorption = {absorption, 0, absorption}, .abbe = 10});
      ball.shot.job.effort.caustic_photons = 2000;
      for (const float gain : {0.0F, 1e6F}) {
        for (auto& light : ball.shot.job.lights.lights) light.irradiance = light.planned * gain;
        const auto result = ball.show();
        for (const capture::Half pixel : result.rgba.pixels) {
          const float v = capture::float_from_half(pixel);
          ASSERT_TRUE(std::isfinite(v) && v >= 0) << index << " " << absorption << " " << gain;
        }
      }
    }
  }
}

// A stand-in that takes no light is as it would be without photons.
TEST(Caustics, LeaveShadowsAloneThatTakeNoLight) {
  BallShot ball(48);
  render::SceneDescription scene = ball.shot.scene->description();
  scene.materials[0] = make_stand_in_material("floor", {.catches_light = 0});
  scene.instances.pop_back();  // the box
  ball.shot.scene = std::make_unique<render::Scene>(std::move(scene));
  const capture::Image without = capture::to_float(ball.show().rgba);
  ball.shot.job.effort.caustic_photons = 2000;
  const capture::Image with = capture::to_float(ball.show().rgba);
  std::size_t floor = 0;
  for (int y = 0; y < with.height; ++y) {
    for (int x = 0; x < with.width; ++x) {
      if (with.at(y, x, 3) > 0) continue;
      ++floor;
      EXPECT_EQ(with.at(y, x, 1), without.at(y, x, 1)) << x << ", " << y;
    }
  }
  EXPECT_GT(floor, 500U);
}

TEST(Caustics, RefuseMorePhotonsThanThereMayBe) {
  BallShot ball(32);
  for (const int photons : {-1, render::most_caustic_photons + 1}) {
    ball.shot.job.effort.caustic_photons = photons;
    EXPECT_THROW(ball.show(), std::invalid_argument) << photons;
  }
}

}  // namespace
}  // namespace compositing::caustics_test
