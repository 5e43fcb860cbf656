// Light of live video: a screen that lights a room, and the real floor.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "made_room.h"
#include "render/area_light.h"
#include "render/kept_transport.h"
#include "render/reference.h"

namespace compositing::live_light_test {
namespace {

using capture::float_from_half;
using render::FrameResult;

// The room's screen lights it by its video.
void light(MadeRoom& room, std::array<int, 2> samples = {5, 5}, float ambient = 0) {
  const auto screen =
      render::sample_area_light(room.scene->description(), MadeRoom::screen_instance, 3, samples);
  room.job.lights.lamps = lamps_of(screen, room.video, {{4, 4, 4}, ambient});
}

// The room with a real floor instead of its own.
MadeRoom room_on_real_floor(int width, int height) {
  MadeRoom room(width, height);
  render::SceneDescription scene = MadeRoom::describe();
  make_floor_real(scene);
  room.scene = std::make_unique<render::Scene>(std::move(scene));
  capture::Image plate = capture::make_image(height, width);
  for (std::size_t i = 0; i < plate.pixels.size(); ++i)
    plate.pixels[i] = 0.004F + 0.001F * static_cast<float>(i % 11);
  room.plate = capture::to_half(plate);
  return room;
}

TEST(VideoLight, IsTheSameColdAndWarmAndTakesNoRays) {
  for (const bool real_floor : {false, true}) {
    MadeRoom room = real_floor ? room_on_real_floor(96, 72) : MadeRoom(96, 72);
    render::KeptTransport kept;
    std::vector<capture::Half> before;
    for (int frame = 0; frame < 4; ++frame) {
      capture::Image image = made_video(90, 160, frame);
      if (frame == 3) std::ranges::fill(image.pixels, 0.0F);  // black
      room.show(image);
      light(room, {5, 5}, 0.02F);
      const FrameResult cold = render_room(room), warm = render_room(room, &kept);
      EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
      EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << frame;
      const auto& s = warm.statistics;
      EXPECT_EQ(s.primary_rays + s.shadow_rays + s.secondary_rays == 0, frame > 0) << frame;
      EXPECT_NE(warm.rgba.pixels, before) << "frame " << frame << " does not show";
      before = warm.rgba.pixels;
    }
  }
}

TEST(VideoLight, DoesNotDependOnTilesOrThreads) {
  MadeRoom room = room_on_real_floor(96, 72);
  light(room);
  for (const int interleave : {1, 4}) {
    room.job.effort.interleave = interleave;
    room.job.effort.tile_size = 96;
    const FrameResult first = render_room(room);
    for (const int tile : {16, 48}) {
      room.job.effort.tile_size = tile;
      for (const std::size_t threads : {1U, 2U}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        EXPECT_EQ(render_room(room).rgba.pixels, first.rgba.pixels) << tile << " " << threads;
      }
    }
  }
}

// A floor alone under a screen that faces down: no shadow, no mirror.
struct LitFloor {
  MadeRoom room{64, 48};
  std::uint32_t screen;
  render::AreaLight light;

  LitFloor() {
    render::SceneDescription scene = MadeRoom::describe();
    scene.instances.resize(1);
    scene.meshes[0] = made_floor(3, 0);  // of the walls' material
    auto mesh = std::make_shared<render::Mesh>();
    mesh->positions = {{-0.5F, -0.5F, 1}, {0.5F, -0.5F, 1}, {0.5F, 0.5F, 1}, {-0.5F, 0.5F, 1}};
    mesh->uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh->triangles = {{0, 2, 1}, {0, 3, 2}};
    mesh->materials = {3};
    scene.meshes.push_back(mesh);
    scene.instances.emplace_back().mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    room.scene = std::make_unique<render::Scene>(std::move(scene));
    room.job.lights = {};
    room.environment = made_sky(16, 0, 0);
    room.job.cam_from_set = calibrate::look_at({0, -2.5, 0.8}, {0, 0, 0}, 0);
    light = render::sample_area_light(room.scene->description(), 1, 3, {5, 5});
  }
};

// A rough floor before the screen. Seen as rays alone would see it, where the middles of lobes
// meet the screen, it errs by a quarter and more.
TEST(VideoLight, IsMirroredByRoughSurfacesAsTheReferenceSays) {
  constexpr int width = 48, height = 36, first_row = 26;
  for (const auto& [roughness, metallic] : {std::pair{0.5F, 1.0F}, {0.7F, 0.0F}}) {
    MadeRoom room(width, height);
    render::SceneDescription scene = MadeRoom::describe();
    auto parameters = render::standard_parameters(scene.materials[1], 0, 1);
    parameters.roughness = roughness;
    parameters.metallic = metallic;
    scene.materials[1] = render::make_standard_material("floor", parameters);
    scene.instances.resize(4);  // without the balls, and the walls out of sight
    for (const std::size_t wall : {1U, 2U}) scene.instances[wall].set_from_object[11] = -100;
    room.scene = std::make_unique<render::Scene>(std::move(scene));
    light(room);
    std::array<capture::Image, 2> truth;
    for (std::uint32_t i = 0; i < 2; ++i) {
      truth[i] = render_reference(room.inputs(), room.job, capture::make_image(height, width),
                                  {.samples = 384, .seed = i + 1});
    }
    capture::Image floor = capture::make_image(height, width, 1);
    for (int y = first_row; y < height; ++y) {
      for (int x = 0; x < width; ++x) floor.at(y, x) = 1;
    }
    const auto error = [&] {
      const capture::Image shown = capture::to_float(render_room(room).rgba);
      return render::picture_error(shown, truth, floor).relative_rms;
    };
    EXPECT_LT(error(), 0.04) << roughness << " " << metallic;
    for (render::LocalLight& lamp : room.job.lights.lamps) lamp.instance = render::no_instance;
    EXPECT_GT(error(), 0.25) << roughness << " " << metallic;
  }
}

TEST(VideoLight, LightsAFloorAsTheReferenceSays) {
  LitFloor floor;
  MadeRoom& room = floor.room;
  room.job.lights.lamps = lamps_of(floor.light, room.video, {{4, 4, 4}, 0});
  render::ReferenceSettings settings;
  settings.samples = 64;
  const capture::Image black = capture::make_image(48, 64);
  const capture::Image truth = render_reference(room.inputs(), room.job, black, settings);
  const capture::Image shown = capture::to_float(render_room(room).rgba);
  capture::Image mask = render::affected_mask(truth, black);
  std::fill_n(mask.pixels.begin(), 20 * 64, 0.0F);  // the floor alone
  const auto error = render::picture_error(shown, truth, mask);
  EXPECT_GT(error.pixels, 1000U);
  EXPECT_LT(error.relative_rms, 0.02);
}

// The middle of the floor, under the middle of an evenly glowing square of 1 m, 1 m above it.
TEST(VideoLight, LightsAFloorAsTheClosedFormSays) {
  LitFloor floor;
  MadeRoom& room = floor.room;
  capture::Image white = capture::make_image(4, 4);
  std::ranges::fill(white.pixels, 1.0F);
  room.show(white);
  room.job.lights.lamps = lamps_of(floor.light, room.video, {{4, 4, 4}, 0});
  const FrameResult result = render_room(room);
  const calibrate::Lens lens{"pinhole", 64, 48, {57.6, 57.6, 31.5, 23.5}};
  const auto q = calibrate::project(lens, room.job.cam_from_set * calibrate::Vec3{0, 0, 0});
  const float shown = float_from_half(result.rgba.pixels[result.rgba.index(
      static_cast<int>(std::lround(q->y)), static_cast<int>(std::lround(q->x)), 0)]);
  const double pi = std::numbers::pi, x = 0.5, root = std::sqrt(1 + x * x);
  const double irradiance = 4 * 4 * x / root * std::atan(x / root);
  EXPECT_NEAR(shown, 0.7 / pi * irradiance, 0.02 * shown);
}

TEST(VideoLight, LightsTheRoomAsTheReferenceSays) {
  for (const bool real_floor : {false, true}) {
    MadeRoom room = real_floor ? room_on_real_floor(96, 72) : MadeRoom(96, 72);
    room.show(made_video(9, 16, 3));
    light(room);
    room.job.effort.accuracy = 0.999F;
    render::ReferenceSettings settings;
    settings.samples = 64;
    const capture::Image plate = capture::to_float(room.plate);
    const capture::Image truth = render_reference(room.inputs(), room.job, plate, settings);
    const capture::Image shown = capture::to_float(render_room(room).rgba);
    int lit = 0, alike = 0;
    for (std::size_t i = 0; i < truth.pixels.size(); i += 4) {
      const float r = truth.pixels[i];
      lit += r > 0.02F;
      alike += r > 0.02F && std::abs(shown.pixels[i] - r) < 0.04F * r + 0.005F;
    }
    EXPECT_GT(lit, 1000);
    EXPECT_GT(alike, lit * 9 / 10) << lit;
  }
}

// A lamp that is planned for is kept while its intensity follows the video; one that moves is not.
TEST(VideoLight, TakesRaysAnewWhereALampMoves) {
  MadeRoom room(64, 48);
  light(room);
  render::KeptTransport kept;
  render_room(room, &kept);
  room.job.lights.lamps[3].position.z += 0.1F;
  EXPECT_GT(render_room(room, &kept).statistics.primary_rays, 0U);
  EXPECT_EQ(render_room(room, &kept).statistics.primary_rays, 0U);
}

TEST(VideoLight, RefusesLampsThatAreNotFinite) {
  MadeRoom room(32, 32);
  light(room);
  room.job.lights.lamps[3].intensity.y = std::nanf("");
  EXPECT_THROW(render_room(room), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::live_light_test
