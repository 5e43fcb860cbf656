// Laws of the tile kernel, with the shaders of augmented pictures plugged in.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>
#include <random>

#include "../render/sun_and_sky.h"
#include "made_room.h"
#include "made_shot.h"
#include "render/area_light.h"
#include "render/kept_transport.h"
#include "render/light_follower.h"
#include "render/reference.h"

namespace {
std::atomic<long> allocations{0};
thread_local bool counting = false;
}  // namespace

// Counted, to show that nothing allocates in the tile loop; sanitizers want their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Not inlined, so that the compiler does not see malloc behind new.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (counting) ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#endif

namespace compositing::kernel_test {
namespace {

using capture::float_from_half;
using render::FrameResult;

FrameResult render(const MadeShot& shot) {
  FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  return result;
}

TEST(RenderFrame, LeavesThePlateBitForBitWhereNothingIsVirtual) {
  const MadeShot shot = made_shot(100, 70, shot_scene(false));
  const FrameResult result = render(shot);
  for (std::size_t i = 0; i < shot.plate.pixels.size() / 3; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_EQ(result.rgba.pixels[i * 4 + c], shot.plate.pixels[i * 3 + c]) << "pixel " << i;
    }
    ASSERT_EQ(result.rgba.pixels[i * 4 + 3], 0);
    ASSERT_EQ(result.matte.pixels[i], 0);
  }
}

TEST(RenderFrame, LeavesThePlateBitForBitFarFromTheObjects) {
  const MadeShot shot = made_shot(160, 120, shot_scene());
  const FrameResult result = render(shot);
  std::size_t untouched = 0;
  for (std::size_t i = 0; i < shot.plate.pixels.size() / 3; ++i) {
    if (result.matte.pixels[i] != 0) continue;
    ++untouched;
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_EQ(result.rgba.pixels[i * 4 + c], shot.plate.pixels[i * 3 + c]) << "pixel " << i;
    }
  }
  EXPECT_GT(untouched, 1000U);
}

TEST(RenderFrame, DoesNotDependOnTilesOrThreads) {
  MadeShot shot = made_shot(150, 110, shot_scene());
  for (const int interleave : {1, 2, 4}) {
    shot.job.effort.interleave = interleave;
    shot.job.effort.tile_size = 64;
    const FrameResult first = render(shot);
    for (const int tile : {16, 48, 160}) {
      shot.job.effort.tile_size = tile;
      for (const std::size_t threads : {1U, 2U}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const FrameResult again = render(shot);
        EXPECT_EQ(again.rgba.pixels, first.rgba.pixels) << tile << " " << threads;
        EXPECT_EQ(again.matte.pixels, first.matte.pixels) << tile << " " << threads;
        EXPECT_EQ(again.statistics, first.statistics);
      }
    }
  }
}

// Lights' energies, camera and effort change from frame to frame; kept transport must not show.
TEST(RenderFrame, IsTheSameColdAndWarm) {
  render::SceneDescription scene = shot_scene();
  render::Instance real = scene.instances[1];  // a real ball, which shades the floor too
  real.kind = render::ObjectKind::stand_in;
  real.set_from_object[3] = -1.2F;
  scene.meshes.push_back(made_ball({0, 0, 0.5F}, 0.5F, 0));
  real.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  scene.instances.push_back(real);
  MadeShot shot = made_shot(96, 64, scene, 70);
  for (render::DirectionalLight& light : shot.job.lights.lights) light.planned = light.irradiance;
  const render::Environment planned = shot.environment;
  render::KeptTransport kept;
  for (int frame = 0; frame < 6; ++frame) {
    if (frame == 2) {
      shot.job.lights.lights[3].irradiance *= 0.5F;
      for (float& value : shot.environment.radiance.pixels) value *= 0.7F;
      render::smooth_for_reflections(shot.environment);
    }
    if (frame == 3) shot.job.cam_from_set = calibrate::look_at({3, -3, 1.6}, {0.3, 0, 0.3}, 0);
    if (frame == 4) shot.job.lights.lights[5].direction = {0, 0, 1};
    if (frame == 5) shot.job.effort.interleave = 4;
    render::FrameInputs inputs = shot.inputs();
    inputs.planned = &planned;
    FrameResult cold;
    render_frame(inputs, shot.job, shot.plate, cold);
    FrameResult warm;
    inputs.kept = &kept;
    render_frame(inputs, shot.job, shot.plate, warm);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
    EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << frame;
    const bool reused = frame == 1 || frame == 2;
    EXPECT_EQ(warm.statistics.primary_rays < cold.statistics.primary_rays, reused) << frame;
  }
}

// Objects move from frame to frame, in random steps; what is kept, and shared between scenes, must
// not show.
TEST(RenderFrame, IsTheSameColdAndWarmWhileThingsMove) {
  render::SceneDescription scene = shot_scene();
  scene.instances[2].moves = true;
  MadeShot shot = made_shot(96, 64, scene);
  render::KeptTransport kept;
  std::mt19937 random(3);
  std::vector<capture::Half> last;
  for (int frame = 0; frame < 6; ++frame) {
    if (frame % 3 != 2) {  // every third stands still
      for (const std::size_t i : {3U, 7U}) {
        scene.instances[2].set_from_object[i] =
            std::uniform_real_distribution<float>(-0.5F, 0.5F)(random);
      }
    }
    shot.scene = std::make_unique<render::Scene>(scene, *shot.scene);
    render::FrameInputs inputs = shot.inputs();
    inputs.kept = &kept;
    FrameResult warm, cold;
    render_frame(inputs, shot.job, shot.plate, warm);
    const render::Scene built(scene);
    inputs.scene = &built;
    inputs.kept = nullptr;
    render_frame(inputs, shot.job, shot.plate, cold);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
    EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << frame;
    EXPECT_NE(warm.rgba.pixels == last, frame % 3 != 2) << frame;
    last = warm.rgba.pixels;
  }
}

TEST(RenderFrame, RestoresThePictureFromPlateMatteAndFill) {
  const MadeShot shot = made_shot(120, 90, shot_scene());
  const FrameResult result = render(shot);
  for (std::size_t i = 0; i < shot.plate.pixels.size() / 3; ++i) {
    const float matte = float_from_half(result.matte.pixels[i]);
    ASSERT_GE(matte, -1e-3F);
    ASSERT_LE(matte, 1.001F);
    ASSERT_GE(matte, float_from_half(result.rgba.pixels[i * 4 + 3]) - 1e-3F)
        << "an object covers at least what it hides";
  }
}

TEST(RenderFrame, IsWhiteInAWhiteFurnace) {
  for (const float roughness : {0.0F, 0.3F, 1.0F}) {
    render::SceneDescription scene = shot_scene(false);
    scene.background = "environment";
    scene.instances.clear();
    render::StandardParameters white;
    white.roughness = roughness;
    white.clearcoat = 0.7F;
    scene.materials.push_back(render::make_standard_material("white", white));
    scene.meshes.push_back(
        made_ball({0, 0, 0}, 1, static_cast<std::uint32_t>(scene.materials.size() - 1)));
    render::Instance ball;
    ball.mesh = 1;
    scene.instances.push_back(ball);
    MadeShot shot = made_shot(80, 60, std::move(scene));
    shot.environment = made_sky(32, 1, 1);
    shot.job.lights.lights.clear();
    constexpr int count = 4000;
    for (int i = 0; i < count; ++i) {
      const float z = 1 - 2 * (static_cast<float>(i) + 0.5F) / count;
      const float phi = static_cast<float>(i) * 2.39996323F, r = std::sqrt(1 - z * z);
      const float e = 4 * std::numbers::pi_v<float> / count;
      shot.job.lights.lights.push_back({{r * std::cos(phi), r * std::sin(phi), z}, {e, e, e}, 0});
    }
    const FrameResult result = render(shot);
    for (std::size_t i = 0; i < result.rgba.pixels.size(); i += 4) {
      ASSERT_NEAR(float_from_half(result.rgba.pixels[i]), 1.0F, 0.005F)
          << "roughness " << roughness << " pixel " << i / 4;
    }
  }
}

TEST(RenderFrame, PutsTheShadowWhereTheSunSaysAndAsDeep) {
  MadeShot shot = made_shot(200, 150, shot_scene());
  // A sun of 3 parts and a sky of 1 part straight above: the shadow keeps a quarter.
  shot.job.lights.lights = {{normalize(render::Vec3f{0, 1, 1}), {3 * 1.41421356F, 3, 3}, 0},
                            {{0, 0, 1}, {1, 1, 1}, 0}};
  const FrameResult result = render(shot);
  const auto ratio_at = [&](calibrate::Vec3 p_set) {
    const calibrate::Lens lens{"pinhole", 200, 150, {220, 220, 99.5, 74.5}};
    const auto q = calibrate::project(lens, shot.job.cam_from_set * p_set);
    const int x = static_cast<int>(std::lround(q->x)), y = static_cast<int>(std::lround(q->y));
    return float_from_half(result.rgba.pixels[result.rgba.index(y, x, 0)]) /
           float_from_half(shot.plate.pixels[shot.plate.index(y, x, 0)]);
  };
  EXPECT_NEAR(ratio_at({0, -1.0, 0}), 1.0F / 4, 0.01F) << "the ball's shadow falls towards -y";
  EXPECT_NEAR(ratio_at({0, -2.2, 0}), 1.0F, 0.002F);
}

// A rough metal plate, seen where it mirrors the sun, which a roof far away may hide.
struct RoughPlate {
  MadeShot shot;
  double lit = 0, without_sun = 0;

  explicit RoughPlate(bool with_roof) : shot(made_shot(65, 65, describe(with_roof))) {
    render::Environment& env = shot.environment;
    const render::Environment sky = made_sky(64, 0.2F, 0.5F);
    env.radiance = sky.radiance;
    const render::Vec3f to_sun = normalize(render::Vec3f{0, 0.8F, 1});
    const auto [x, y] = render::texel_of_direction(to_sun, 128, 64);
    for (int c = 0; c < 3; ++c) {
      env.radiance.at(static_cast<int>(std::lround(y)), static_cast<int>(std::lround(x)), c) = 2e3F;
    }
    render::LightFollower follower;
    shot.job.lights = follower.follow(env, {});
    render::smooth_for_reflections(env, follower.compact_texels());
    shot.job.cam_from_set = calibrate::look_at({1.5, -4, 5}, {0, 0, 0}, 0);
    const FrameResult with = render(shot);
    lit = middle(with);
    shot.environment = sky;
    shot.job.lights = render::make_light_table(sky, {});
    without_sun = middle(render(shot));
  }
  static double middle(const FrameResult& result) {
    return float_from_half(result.rgba.pixels[result.rgba.index(32, 32, 1)]);
  }
  static render::SceneDescription describe(bool with_roof) {
    render::SceneDescription scene = shot_scene(false);
    scene.instances.clear();
    render::StandardParameters metal;
    metal.metallic = 1;
    metal.roughness = 0.4F;
    scene.materials.push_back(render::make_standard_material("metal", metal));
    const auto material = static_cast<std::uint32_t>(scene.materials.size() - 1);
    const auto add = [&](float half_size, std::array<float, 3> at) {
      scene.meshes.push_back(made_floor(half_size, material));
      render::Instance& instance = scene.instances.emplace_back();
      instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
      for (std::size_t i = 0; i < 3; ++i) instance.set_from_object[i * 4 + 3] = at[i];
    };
    add(2, {0, 0, 0});
    if (with_roof) add(0.8F, {0, 8, 10});  // before the sun, and beside the mirrored direction
    return scene;
  }
};

TEST(RenderFrame, MirrorsASunInARoughPlateOnlyWhereItShines) {
  const RoughPlate open(false), shaded(true);
  // What a lobe mirrors of the sun: irradiance times density.
  render::StandardSurface metal{};
  metal.base = {1, 1, 1};
  metal.metallic = 1;
  metal.normal = metal.coat_normal = {0, 0, 1};
  const render::Vec3f view = normalize(render::Vec3f{1.5F, -4, 5});
  const auto [x, y] = render::texel_of_direction(normalize(render::Vec3f{0, 0.8F, 1}), 128, 64);
  const int row = static_cast<int>(std::lround(y));
  const render::Vec3f to_sun = render::direction_of_texel(std::round(x), std::round(y), 128, 64);
  const double expected = 2e3 * render::texel_solid_angle(row, 128, 64) *
                          render::lobe_density({0, 0, 1}, view, 0.4F, to_sun) *
                          render::standard_weights(metal, view).specular.y;
  EXPECT_NEAR((open.lit - open.without_sun) / expected, 1, 0.05);
  EXPECT_NEAR(shaded.lit, shaded.without_sun, 0.02 * shaded.without_sun);
}

// A mirror ball under a small sun, whose picture in it is a few pixels or less.
MadeShot made_glint(int size) {
  render::SceneDescription scene = shot_scene(false);
  scene.instances.clear();
  render::StandardParameters chrome;
  chrome.metallic = 1;
  chrome.roughness = 0;
  scene.materials.push_back(render::make_standard_material("chrome", chrome));
  scene.meshes.push_back(
      made_ball({0.3F, 0, 0.3F}, 1, static_cast<std::uint32_t>(scene.materials.size() - 1)));
  scene.instances.emplace_back().mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  MadeShot shot = made_shot(size, size, std::move(scene));
  shot.environment = made_sky(256, 0.1F, 0.2F);
  for (int y = 40; y < 44; ++y) {
    for (int x = 330; x < 334; ++x) {
      for (int c = 0; c < 3; ++c) shot.environment.radiance.at(y, x, c) = 500;
    }
  }
  render::smooth_for_reflections(shot.environment);
  return shot;
}

// The rms of the difference to a picture of as many samples as there can be, clamped as a display
// does.
double glint_error(MadeShot& shot, const FrameResult& truth) {
  const FrameResult result = render(shot);
  double sum = 0;
  for (std::size_t i = 0; i < result.rgba.pixels.size(); i += 4) {
    const double a = std::min(float_from_half(result.rgba.pixels[i]), 4.0F);
    const double b = std::min(float_from_half(truth.rgba.pixels[i]), 4.0F);
    sum += (a - b) * (a - b);
  }
  return std::sqrt(sum / static_cast<double>(result.rgba.pixels.size() / 4));
}

TEST(RenderFrame, SamplesGlintsAndErrsLessTheLessItTolerates) {
  MadeShot shot = made_glint(96);
  render::Effort& effort = shot.job.effort;
  effort.glint_contrast = 1e-3F;
  effort.aa_tolerance = 0;
  effort.aa_samples = 256;
  const FrameResult truth = render(shot);

  effort.aa_samples = 4;
  effort.glint_contrast = 0;
  const double without = glint_error(shot, truth);
  effort.glint_contrast = 0.1F;
  double before = glint_error(shot, truth);
  EXPECT_LT(before, 0.8 * without);
  for (const float tolerance : {0.2F, 0.05F, 0.01F}) {
    effort.aa_tolerance = tolerance;
    const double error = glint_error(shot, truth);
    EXPECT_LT(error, 0.9 * before) << tolerance;
    before = error;
  }
}

// Balls, more and less rough, beside each other under a small sun, on a floor that catches their
// shadows: lobes that something blocks, shadow edges, a sun in all of them.
struct SunnyBalls {
  MadeShot shot;
  std::array<capture::Image, 2> references;

  SunnyBalls() : shot(make_shot()) {
    shot.environment = render::make_sun_and_sky({}, 128);
    render::LightFollower follower;
    render::LightFollowerSettings settings;
    settings.table.count = 256;
    shot.job.lights = follower.follow(shot.environment, settings);
    render::smooth_for_reflections(shot.environment, follower.compact_texels());
    for (const std::uint32_t seed : {1U, 2U}) {
      render::ReferenceSettings reference;
      reference.samples = 128;
      reference.seed = seed;
      references[seed - 1] = render::render_reference(shot.inputs(), shot.job, plate(), reference);
    }
  }
  static MadeShot make_shot() {
    render::SceneDescription scene = shot_scene(false);
    const auto add = [&](render::Vec3f centre, float roughness, float metallic) {
      render::StandardParameters p;
      p.roughness = roughness;
      p.metallic = metallic;
      p.base_color[1] = 0.4F;
      scene.materials.push_back(render::make_standard_material("ball", p));
      scene.meshes.push_back(
          made_ball(centre, 0.5F, static_cast<std::uint32_t>(scene.materials.size() - 1)));
      scene.instances.emplace_back().mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    };
    add({0, 0, 0.5F}, 0.5F, 1);
    add({0.9F, 0.5F, 0.5F}, 0.3F, 1);
    add({0.3F, -0.9F, 0.5F}, 0.7F, 0);
    return made_shot(96, 72, std::move(scene));
  }
  capture::Image plate() const { return capture::to_float(shot.plate); }
  double error() const {
    return render::picture_error(capture::to_float(render(shot).rgba), references,
                                 render::affected_mask(references[0], plate()))
        .relative_rms;
  }
};

TEST(RenderFrame, NearsTheReferenceTheMoreEffortItTakes) {
  SunnyBalls balls;
  render::Effort& effort = balls.shot.job.effort;
  effort = {};
  const double normal = balls.error();
  EXPECT_LT(normal, 0.04);
  effort.aa_tolerance = 0.02F;
  effort.glint_contrast = 0.005F;
  effort.accuracy = 0.999F;
  effort.adaptive_visibility = false;
  const double most = balls.error();
  EXPECT_LT(most, 0.015);
  EXPECT_LT(most, 0.6 * normal);
}

TEST(RenderTile, DoesNotAllocate) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer allocates by itself";
#endif
  const MadeShot shot = made_shot(128, 96, shot_scene());
  for (const bool count_rays : {false, true}) {
    render::FrameInputs inputs = shot.inputs();
    inputs.count_rays = count_rays;
    const render::FrameContext context = make_frame_context(inputs, shot.job);
    render::TileWorkspace workspace;
    render::TileJob tile;
    render::TileResult result;
    const render::Rect rect{0, 0, 128, 96};
    cut_tile(shot.plate, rect, 0, tile);
    size_result(rect, result, count_rays);
    render_tile(context, tile, workspace, result);
    allocations = 0;
    counting = true;
    render_tile(context, tile, workspace, result);
    counting = false;
    EXPECT_EQ(allocations, 0) << count_rays;
  }
}

TEST(RenderTile, DoesNotAllocateUnderLiveVideo) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer allocates by itself";
#endif
  MadeRoom room(128, 96);
  const render::AreaLight screen =
      render::sample_area_light(room.scene->description(), MadeRoom::screen_instance, 3, {5, 5});
  room.job.lights.lamps = lamps_of(screen, room.video, {});
  const render::FrameContext context = make_frame_context(room.inputs(), room.job);
  render::TileWorkspace workspace;
  render::TileJob tile;
  render::TileResult result;
  const render::Rect rect{0, 0, 128, 96};
  cut_tile(room.plate, rect, 0, tile);
  size_result(rect, result);
  render_tile(context, tile, workspace, result);
  allocations = 0;
  counting = true;
  render_tile(context, tile, workspace, result);
  counting = false;
  EXPECT_EQ(allocations, 0);
}

TEST(MakeFrameContext, RefusesEffortsThatMakeNoSense) {
  MadeShot shot = made_shot(32, 32, shot_scene());
  const auto refuse = [&](auto&& change) {
    const render::FrameJob before = shot.job;
    change(shot.job);
    FrameResult result;
    EXPECT_THROW(render_frame(shot.inputs(), shot.job, shot.plate, result), std::invalid_argument);
    shot.job = before;
  };
  refuse([](render::FrameJob& job) { job.effort.aa_samples = 0; });
  refuse([](render::FrameJob& job) { job.effort.aa_samples = 1025; });
  refuse([](render::FrameJob& job) { job.effort.aa_tolerance = -0.1F; });
  refuse([](render::FrameJob& job) { job.effort.aa_tolerance = std::nanf(""); });
  refuse([](render::FrameJob& job) { job.effort.glint_contrast = -0.1F; });
  refuse([](render::FrameJob& job) { job.effort.glint_contrast = HUGE_VALF; });
  refuse([](render::FrameJob& job) { job.effort.interleave = 3; });
  refuse([](render::FrameJob& job) { job.effort.tile_size = 20; });
  refuse([](render::FrameJob& job) { job.effort.accuracy = 2; });
  refuse([](render::FrameJob& job) { job.effort.max_depth = -1; });
  refuse([](render::FrameJob& job) { job.effort.max_rays = -1; });
  refuse([](render::FrameJob& job) { job.lights.parts.resize(job.lights.lights.size() + 1); });
  refuse([](render::FrameJob& job) {
    job.lights.parts.resize(1);
    job.lights.parts[0].directions[3].y = std::nanf("");
  });
  refuse([](render::FrameJob& job) { job.lights.lights[0].irradiance.x = std::nanf(""); });
  refuse([](render::FrameJob& job) {
    job.lights.lights.assign(render::most_compact_lights + 1, {{0, 0, 1}, {1, 1, 1}, 0, 1});
  });
}

TEST(RenderFrame, RefusesAPlateOfAnotherSize) {
  const MadeShot shot = made_shot(32, 32, shot_scene());
  FrameResult result;
  EXPECT_THROW(render_frame(shot.inputs(), shot.job, made_plate(32, 33), result),
               std::invalid_argument);
}

}  // namespace
}  // namespace compositing::kernel_test
