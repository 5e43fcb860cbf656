// Virtual mirrors that show the plate where a stand-in is (Instance::mirrored).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "made_shot.h"
#include "render/kept_transport.h"
#include "render/light_follower.h"
#include "render/reference.h"
#include "render/renderer.h"
#include "tests/render/sun_and_sky.h"

namespace compositing::mirrored_plate_test {
namespace {

using render::Vec3f;

calibrate::Lens lens_of(const MadeShot& shot) {
  const int w = shot.directions.width, h = shot.directions.height;
  return {"pinhole", w, h, {1.1 * w, 1.1 * w, (w - 1) / 2.0, (h - 1) / 2.0}};
}

render::StandardParameters metal(float roughness) {
  render::StandardParameters metal;
  metal.metallic = 1;
  metal.roughness = roughness;
  std::fill_n(metal.base_color, 3, 1.0F);
  return metal;
}

render::StandardParameters coated_paint() {
  render::StandardParameters paint;
  paint.base_color[1] = paint.base_color[2] = 0.1F;
  paint.clearcoat = 1;
  return paint;
}

// A ball of some material, and a thin glass one, on a real floor of light and dark squares.
MadeShot shot_of(const render::StandardParameters& ball,
                 bool mirrored,
                 render::StandInParameters real = {}) {
  render::SceneDescription scene = shot_scene();
  scene.materials[0] = make_stand_in_material("floor", real);
  scene.materials[1] = render::make_standard_material("ball", ball);
  scene.instances[0].mirrored = mirrored;
  MadeShot shot = made_shot(160, 120, scene);
  const calibrate::Pose set_from_cam = calibrate::inverse(shot.job.cam_from_set);
  capture::Image plate = capture::make_image(120, 160, 3);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const std::size_t i = shot.directions.index(y, x);
      const calibrate::Vec3 v =
          set_from_cam.R *
          calibrate::Vec3{shot.directions.x[i], shot.directions.y[i], shot.directions.z[i]};
      const calibrate::Vec3 at = set_from_cam.t + v * (-set_from_cam.t.z / v.z);
      const bool light = (static_cast<int>(std::floor(2 * at.x) + std::floor(2 * at.y)) & 1) == 0;
      const float floor = light ? 0.7F : 0.25F;
      plate.at(y, x, 0) = v.z < 0 ? floor : 0.5F;
      plate.at(y, x, 1) = v.z < 0 ? 0.8F * floor : 0.7F;
      plate.at(y, x, 2) = v.z < 0 ? 0.6F * floor : 0.9F;
    }
  }
  shot.plate = capture::to_half(plate);
  return shot;
}

capture::Image rendered(const MadeShot& shot, render::KeptTransport* kept = nullptr) {
  const calibrate::Lens lens = lens_of(shot);
  render::FrameInputs inputs = shot.inputs();
  inputs.lens = &lens;
  inputs.kept = kept;
  render::FrameResult result;
  render_frame(inputs, shot.job, shot.plate, result);
  return capture::to_float(result.rgba);
}

capture::Image truth_of(const MadeShot& shot) {
  const calibrate::Lens lens = lens_of(shot);
  render::FrameInputs inputs = shot.inputs();
  inputs.lens = &lens;
  return render_reference(inputs, shot.job, capture::to_float(shot.plate), {.samples = 128});
}

double error_of(const capture::Image& picture, const capture::Image& truth, const MadeShot& shot) {
  const capture::Image mask = render::affected_mask(truth, capture::to_float(shot.plate));
  return render::picture_error(picture, truth, mask).relative_rms;
}

// An upright wall across the view, of so much height.
void add_wall(render::SceneDescription& scene, float y, float top, std::uint32_t material) {
  auto wall = std::make_shared<render::Mesh>();
  wall->positions = {{-4, y, 0}, {4, y, 0}, {4, y, top}, {-4, y, top}};
  wall->triangles = {{0, 1, 2}, {0, 2, 3}};
  wall->materials = {material};
  scene.instances.emplace_back().mesh = static_cast<std::uint32_t>(scene.meshes.size());
  scene.meshes.push_back(wall);
}

// A mirror as a wall: its picture of the floor is the plate where the mirrored ray falls, and of
// what the camera does not see, the environment.
TEST(MirroredPlate, IsWhatAFlatMirrorShowsOfTheFloor) {
  constexpr int width = 160, height = 120;
  constexpr float back = 1.5F;  // how far away the wall stands
  render::SceneDescription scene = shot_scene(false);
  render::StandInParameters real;
  real.catches_shadow = real.catches_light = 0;
  scene.materials[0] = make_stand_in_material("floor", real);
  scene.instances[0].mirrored = true;
  scene.materials[1] = render::make_standard_material("silver", metal(0));
  add_wall(scene, back, 3, 1);
  MadeShot shot = made_shot(width, height, scene);
  shot.environment = made_sky(32, 2, 3);
  const Vec3f eye{0, -2.5F, 1.2F};
  shot.job.cam_from_set = calibrate::look_at(calibrate::to_double(eye), {0, 0, 0.2}, 0);
  capture::Image plate = capture::make_image(height, width, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      plate.at(y, x, 0) = static_cast<float>(x) / width;
      plate.at(y, x, 1) = static_cast<float>(y) / height;
      plate.at(y, x, 2) = 0.5F;
    }
  }
  shot.plate = capture::to_half(plate);
  const capture::Image picture = rendered(shot);
  const calibrate::Lens lens = lens_of(shot);
  const calibrate::Pose set_from_cam = calibrate::inverse(shot.job.cam_from_set);
  int in_plate = 0, beside = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t i = shot.directions.index(y, x);
      Vec3f v = calibrate::to_float(set_from_cam.R * calibrate::Vec3{shot.directions.x[i],
                                                                     shot.directions.y[i],
                                                                     shot.directions.z[i]});
      const Vec3f at_wall = eye + v * ((back - eye.y) / v.y);
      if (!(at_wall.z > 0.05F && at_wall.z < 2.9F && std::abs(at_wall.x) < 2.9F)) continue;
      v.y = -v.y;
      if (!(v.z < -0.01F)) continue;
      const Vec3f at_floor = at_wall + v * (-at_wall.z / v.z);
      if (std::max(std::abs(at_floor.x), std::abs(at_floor.y)) > 19) continue;
      const auto q =
          calibrate::project(lens, shot.job.cam_from_set.R * calibrate::to_double(at_floor - eye));
      const double inside =
          q ? std::min({q->x + 0.5, width - 0.5 - q->x, q->y + 0.5, height - 0.5 - q->y}) : -1.0;
      constexpr double seam = height / 16.0;
      if (inside > seam + 1) {
        ++in_plate;
        EXPECT_NEAR(picture.at(y, x, 0), q->x / width, 0.006) << x << " " << y;
        EXPECT_NEAR(picture.at(y, x, 1), q->y / height, 0.006) << x << " " << y;
        EXPECT_NEAR(picture.at(y, x, 2), 0.5, 0.003) << x << " " << y;
      } else if (inside < -1) {
        ++beside;
        EXPECT_NEAR(picture.at(y, x, 2), 2, 0.01) << x << " " << y;
      } else {  // and no seam between
        EXPECT_GT(picture.at(y, x, 2), 0.49F);
        EXPECT_LT(picture.at(y, x, 2), 2.01F);
      }
    }
  }
  EXPECT_GT(in_plate, 1400);
  EXPECT_GT(beside, 500);
}

// Under the shadows of what stands there.
TEST(MirroredPlate, IsAsTheReferenceHasIt) {
  for (const auto& [what, ball, most] :
       {std::tuple("mirror", metal(0), 0.03), std::tuple("rough metal", metal(0.3F), 0.04),
        std::tuple("paint", coated_paint(), 0.04)}) {
    const MadeShot shot = shot_of(ball, true);
    const capture::Image truth = truth_of(shot);
    const double error = error_of(rendered(shot), truth, shot);
    EXPECT_LT(error, most) << what;
    EXPECT_GT(error_of(rendered(shot_of(ball, false)), truth, shot), 1.1 * error) << what;
    ::testing::Test::RecordProperty(std::string("error_") + what, std::to_string(error));
  }
}

// Of a real mirror, too: a floor that mirrors the ball that mirrors the floor.
TEST(MirroredPlate, IsAsTheReferenceHasItToAndFro) {
  render::StandInParameters real;
  real.catches_reflection = 1;
  real.reflectance = 0.5F;
  const MadeShot shot = shot_of(metal(0), true, real);
  const double error = error_of(rendered(shot), truth_of(shot), shot);
  EXPECT_LT(error, 0.04);
  ::testing::Test::RecordProperty("error", std::to_string(error));
}

// Light that bounces is found apart from what lobes mirror: neither twice nor not at all.
TEST(MirroredPlate, LeavesBouncedLightOfTheReferenceAsItIs) {
  render::StandardParameters chalk;
  chalk.specular = 0;
  for (const bool blocks : {false, true}) {
    MadeShot shots[2] = {shot_of(chalk, false), shot_of(chalk, true)};
    capture::Image pictures[2];
    for (int i = 0; i < 2; ++i) {
      render::SceneDescription scene = shots[i].scene->description();
      scene.instances[0].blocks_light = blocks;
      scene.instances.pop_back();  // the glass ball, which mirrors
      shots[i].scene = std::make_unique<render::Scene>(scene);
      const calibrate::Lens lens = lens_of(shots[i]);
      render::FrameInputs inputs = shots[i].inputs();
      inputs.lens = &lens;
      pictures[i] = render_reference(inputs, shots[i].job, capture::to_float(shots[i].plate),
                                     {.samples = 32, .bounces = true});
    }
    double sum = 0, off = 0;
    for (std::size_t i = 0; i < pictures[0].pixels.size(); ++i) {
      sum += pictures[0].pixels[i];
      off += pictures[1].pixels[i] - pictures[0].pixels[i];
    }
    EXPECT_LT(std::abs(off), 0.001 * sum) << blocks;
  }
}

// A plate that goes on, and things that move over the floor that a ball mirrors.
TEST(MirroredPlate, IsTheSameWarmAndCold) {
  MadeShot shot = shot_of(coated_paint(), true);
  render::SceneDescription scene = shot.scene->description();
  scene.materials.push_back(render::make_standard_material("chrome", metal(0.05F)));
  scene.materials.push_back(render::make_standard_material("chalk", {}));
  for (const std::uint32_t material : {3U, 4U}) {
    scene.meshes.push_back(made_ball({0, 0, 0.25F}, 0.25F, material));
    render::Instance& ball = scene.instances.emplace_back();
    ball.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    ball.moves = true;
  }
  for (const bool occludes : {true, false}) {
    scene.instances[0].occludes = occludes;
    shot.scene = std::make_unique<render::Scene>(scene);
    render::KeptTransport kept;
    std::mt19937 random(5);
    std::uniform_real_distribution<float> somewhere(-1.2F, 0.9F);
    for (int frame = 0; frame < 8; ++frame) {
      for (capture::Half& half : shot.plate.pixels) {
        half = capture::half_from_float(0.1F + 0.9F * capture::float_from_half(half));
      }
      if (frame % 3 != 2) {
        auto& place = scene.instances[static_cast<std::size_t>(3 + frame % 2)].set_from_object;
        place[3] = somewhere(random), place[7] = somewhere(random);
        shot.scene = std::make_unique<render::Scene>(scene, *shot.scene);
      }
      const capture::Image warm = rendered(shot, &kept);
      EXPECT_EQ(warm.pixels, rendered(shot).pixels) << occludes << " " << frame;
    }
  }
}

// Where nothing tells where the plate is seen, mirrors show the environment, as wide as they are:
// a lamp in it that is below the horizon, too.
TEST(MirroredPlate, IsTheEnvironmentWithoutALens) {
  for (const float roughness : {0.0F, 0.3F}) {
    MadeShot shots[2] = {shot_of(metal(roughness), true), shot_of(metal(roughness), false)};
    capture::Image pictures[2];
    for (int i = 0; i < 2; ++i) {
      capture::Image& sky = shots[i].environment.radiance;
      for (int y = 0; y < sky.height; ++y) {
        for (int x = 0; x < sky.width; ++x) {
          const bool lamp = y > 20 && y < 24 && x % 16 < 3;
          for (int c = 0; c < 3; ++c)
            sky.at(y, x, c) = lamp ? 8.0F : 0.2F + 0.01F * static_cast<float>(y % 7);
        }
      }
      render::smooth_for_reflections(shots[i].environment);
      render::FrameResult result;
      render_frame(shots[i].inputs(), shots[i].job, shots[i].plate, result);
      pictures[i] = capture::to_float(result.rgba);
    }
    double off = 0, sum = 0;
    for (std::size_t i = 0; i < pictures[0].pixels.size(); ++i) {
      off += std::pow(pictures[0].pixels[i] - pictures[1].pixels[i], 2);
      sum += std::pow(pictures[1].pixels[i], 2);
    }
    EXPECT_LT(std::sqrt(off / sum), 0.01) << roughness;
  }
}

// A sun that stands behind a real wall shows in metal where the plate shows nothing of that wall,
// and not where it does.
TEST(MirroredPlate, HidesTheSunWhereItShowsTheWallBeforeIt) {
  for (const bool in_picture : {false, true}) {
    render::SceneDescription scene = shot_scene();
    scene.instances.pop_back();  // the glass ball
    scene.materials[1] = render::make_standard_material("ball", metal(0.3F));
    add_wall(scene, in_picture ? 4.0F : -8.0F, 8, 0);
    scene.instances.back().kind = render::ObjectKind::stand_in;
    scene.instances.back().blocks_light = false;
    scene.instances.back().mirrored = true;
    MadeShot shot = made_shot(96, 72, scene);
    shot.job.cam_from_set = calibrate::look_at({0, -4, 1}, {0, 0, 0.7}, 0);
    shot.environment = render::make_sun_and_sky(
        {.sun_radius_rad = 0.01F,
         .sun_azimuth_rad = (in_picture ? 0.5F : -0.5F) * std::numbers::pi_v<float>,
         .sun_elevation_rad = 0.4F,
         .clouds = 0},
        256);
    render::LightFollower follower;
    shot.job.lights = follower.follow(shot.environment, {});
    render::smooth_for_reflections(shot.environment, follower.compact_texels());
    ASSERT_TRUE(shot.environment.compact_apart);
    const capture::Image picture = rendered(shot), truth = truth_of(shot);
    const auto brightest = [](const capture::Image& of) {
      float most = 0;
      for (std::size_t i = 0; i < of.pixels.size(); i += 4) most = std::max(most, of.pixels[i]);
      return most;
    };
    ::testing::Test::RecordProperty(in_picture ? "wall" : "sun",
                                    std::to_string(brightest(picture)));
    if (in_picture) {
      EXPECT_LT(brightest(picture), 3);
      EXPECT_LT(brightest(truth), 3);
    } else {
      EXPECT_GT(brightest(picture), 5);
      EXPECT_GT(brightest(truth), 5);
    }
  }
}

// Light of the plate is that of its place, not of the pixel that shows it.
TEST(MirroredPlate, KnowsTheLensVignetting) {
  MadeShot shot = shot_of(metal(0), true), even = shot_of(metal(0), true);
  calibrate::DirectionTable& lens = shot.directions;
  lens.sensitivity.assign(lens.x.size(), 1.0F);
  capture::Image dimmed = capture::to_float(shot.plate);
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const double r = std::hypot(x - 79.5, y - 59.5) / 100;
      const float by = lens.sensitivity[lens.index(y, x)] = static_cast<float>(1 - 0.6 * r * r);
      for (int c = 0; c < 3; ++c) dimmed.at(y, x, c) *= by;
    }
  }
  shot.plate = capture::to_half(dimmed);
  const capture::Image picture = rendered(shot), expected = rendered(even);
  const calibrate::Lens model = lens_of(shot);
  render::FrameInputs inputs = shot.inputs();
  inputs.lens = &model;
  const capture::Image truth = render_reference(inputs, shot.job, dimmed, {.samples = 64});
  double off = 0, off_truth = 0, sum = 0;
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const float by = lens.sensitivity[lens.index(y, x)];
      for (int c = 0; c < 3; ++c) {
        const float right = expected.at(y, x, c) * by;
        off += std::pow(picture.at(y, x, c) - right, 2);
        off_truth += std::pow(picture.at(y, x, c) - truth.at(y, x, c), 2);
        sum += double{right} * right;
      }
    }
  }
  EXPECT_LT(std::sqrt(off / sum), 0.005);
  EXPECT_LT(std::sqrt(off_truth / sum), 0.03);
}

// What a real floor mirrors of a real wall is in the plate, also through a clear pane between.
TEST(MirroredPlate, LeavesWhatRealThingsMirrorOfEachOtherAsItIs) {
  render::SceneDescription scene = shot_scene(false);
  render::StandInParameters shiny;
  shiny.catches_shadow = shiny.catches_light = 0;
  shiny.catches_reflection = 1;
  shiny.reflectance = 1;
  scene.materials[0] = make_stand_in_material("floor", shiny);
  render::StandardParameters clear;
  clear.transmission = 1;
  clear.roughness = 0;
  clear.specular = 0;
  scene.materials[1] = render::make_standard_material("clear", clear);
  scene.materials.push_back(make_stand_in_material("wall", {}));
  add_wall(scene, 2, 3, 3);
  scene.instances.back().kind = render::ObjectKind::stand_in;
  scene.instances.back().blocks_light = false;
  scene.instances.back().mirrored = true;
  add_wall(scene, 1, 3, 1);  // the pane
  MadeShot shot = made_shot(96, 72, scene);
  shot.job.cam_from_set = calibrate::look_at({0, -2.5, 1.2}, {0, 0.5, 0}, 0);
  const capture::Image picture = rendered(shot), plate = capture::to_float(shot.plate);
  const calibrate::Lens lens = lens_of(shot);
  render::FrameInputs inputs = shot.inputs();
  inputs.lens = &lens;
  const capture::Image truth = render_reference(inputs, shot.job, plate, {.samples = 4});
  for (int y = 40; y < 72; ++y) {  // the floor before the pane
    for (int x = 0; x < 96; ++x) {
      ASSERT_NEAR(picture.at(y, x, 0), plate.at(y, x, 0), 0.002) << x << " " << y;
      ASSERT_NEAR(truth.at(y, x, 0), plate.at(y, x, 0), 0.002) << x << " " << y;
    }
  }
}

// A wall that mirrors show hides in them what is behind it.
TEST(MirroredPlate, HidesWhatIsBehindRealThings) {
  render::SceneDescription scene = shot_scene(false);
  scene.materials[1] = render::make_standard_material("silver", metal(0));
  render::StandardParameters glow;
  std::fill_n(glow.emission, 3, 5.0F);
  scene.materials.push_back(render::make_standard_material("lamp", glow));
  add_wall(scene, 1.5F, 3, 1);  // the mirror
  add_wall(scene, -6, 3, 3);    // what glows behind the camera
  add_wall(scene, -5, 3, 0);    // a real wall before that
  render::Instance& real = scene.instances.back();
  real.kind = render::ObjectKind::stand_in;
  real.blocks_light = false;
  const auto brightest = [&](bool mirrored) {
    scene.instances.back().mirrored = mirrored;
    MadeShot shot = made_shot(64, 48, scene);
    shot.job.cam_from_set = calibrate::look_at({0, -2.5, 1.2}, {0, 1.5, 1.2}, 0);
    const capture::Image picture = rendered(shot);
    return *std::ranges::max_element(picture.pixels);
  };
  EXPECT_GT(brightest(false), 4);
  EXPECT_LT(brightest(true), 1.1F);
}

}  // namespace
}  // namespace compositing::mirrored_plate_test
