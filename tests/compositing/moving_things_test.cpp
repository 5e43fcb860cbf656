// Things that move: only cells that may see it are found anew, and no bit shows it.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <ranges>

#include "made_room.h"
#include "render/area_light.h"
#include "render/cell_reach.h"

namespace compositing::moving_things_test {
namespace {

using render::Scene;
using render::SpaceGrid;
using render::Vec3f;

struct Dice {
  std::mt19937 random;
  float operator()(float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random);
  }
  int pick(int most) { return std::uniform_int_distribution<int>(0, most)(random); }
  Vec3f point(float size) {
    return {(*this)(-size, size), (*this)(-size, size), (*this)(-size, size)};
  }
  Vec3f direction() {
    while (true) {
      const Vec3f v = point(1);
      if (const float l = length(v); l > 0.1F && l < 1) return v * (1 / l);
    }
  }
};

bool has(const SpaceGrid::Mask& mask, int box) {
  return (mask[static_cast<std::size_t>(box) / 64] >> (box % 64) & 1) != 0;
}

bool have_common(const SpaceGrid::Mask& a, const SpaceGrid::Mask& b) {
  return std::ranges::any_of(std::views::iota(std::size_t{0}, a.size()),
                             [&](std::size_t i) { return (a[i] & b[i]) != 0; });
}

TEST(SpaceGrid, MarksEveryBoxThatALinePassesAndNoFarOne) {
  const SpaceGrid grid({{-1, -2, -0.5F}, {1, 2, 0.5F}});
  Dice dice{std::mt19937(1)};
  for (int i = 0; i < 800; ++i) {
    const Vec3f from = dice.point(i % 2 == 0 ? 4.0F : 1.2F);
    Vec3f direction = dice.direction();
    if (i % 4 == 0) direction = {0, 0, i % 8 == 0 ? 1.0F : -1.0F};
    // Short ones, as in glass, stay within a box or two.
    const float far_m = i % 2 == 0 ? dice(0.1F, 8) : dice(0.001F, 0.4F);
    SpaceGrid::Mask mask{};
    grid.mark_line(from, direction, far_m, mask);
    int marked = 0;
    for (const std::uint64_t word : mask) marked += std::popcount(word);
    EXPECT_LE(marked, 3 * SpaceGrid::side);
    for (int step = 1; step < 1000; ++step) {
      const Vec3f p = from + direction * (far_m * static_cast<float>(step) / 1000);
      // What is anywhere on it, beyond the outermost walls too, is known to be met.
      SpaceGrid::Mask there{};
      grid.mark_bounds({p, p}, there);
      EXPECT_TRUE(have_common(mask, there)) << i << " " << step;
      const int box = grid.box_at(p);
      if (box < 0 || has(mask, box)) continue;
      // A point on a wall may be counted to the other side of it.
      const Scene::Bounds b = grid.box(box);
      const float near = std::min({p.x - b.lower.x, b.upper.x - p.x, p.y - b.lower.y,
                                   b.upper.y - p.y, p.z - b.lower.z, b.upper.z - p.z});
      EXPECT_LT(near, 2e-3F) << i;
    }
  }
}

// Whatever stood, or stands, on the way from a point to a light is told.
TEST(MovedThings, MissNoPointThatTheyShade) {
  const SpaceGrid grid({{-1, -1, -1}, {1, 1, 1}});
  Dice dice{std::mt19937(2)};
  int shaded = 0, told = 0;
  for (int i = 0; i < 3000; ++i) {
    render::LightTable table;
    for (int n = 0; n < 3; ++n) table.lights.push_back({dice.direction(), {1, 1, 1}, 0.1F});
    table.lamps.emplace_back().position = dice.point(2);
    const Vec3f middle = dice.point(1.2F), half{dice(0.01F, 0.3F), dice(0.01F, 0.3F), 0.1F};
    const Vec3f from = dice.point(i % 3 == 0 ? 4.0F : 1.4F);
    const Vec3f inside = middle + half * dice.point(1);
    // A light is put behind it, to make it likely.
    if (i % 2 == 0) table.lights[1].direction = normalize(inside - from);
    if (i % 4 == 1) table.lamps[0].position = from + (inside - from) * dice(1, 3);
    render::CellReach reach;
    reach.add_receiver(grid, from);
    const render::SoftLights soft(table);
    const render::MovedThings things({{middle - half, middle + half}}, grid, table, soft,
                                     reach.lit.boxes);
    told += things.may_change(reach);
    const auto lies_between = [&](Vec3f along, float far) {
      for (int step = 0; step <= 2000; ++step) {
        const Vec3f p = from + along * (far * static_cast<float>(step) / 2000) - middle;
        if (std::abs(p.x) <= half.x && std::abs(p.y) <= half.y && std::abs(p.z) <= half.z) {
          return true;
        }
      }
      return false;
    };
    bool between = lies_between(table.lamps[0].position - from, 1);
    for (std::size_t light = 0; light < table.lights.size() && !between; ++light) {
      between = lies_between(table.lights[light].direction, 10);
      for (std::uint8_t part = 0; part < render::SoftLights::count && !between; ++part) {
        between = lies_between(soft.direction(light, part), 10);
      }
    }
    if (!between) continue;
    ++shaded;
    EXPECT_TRUE(things.may_change(reach)) << i;
  }
  EXPECT_GT(shaded, 800);
  EXPECT_LT(told, shaded + 1500);
}

std::uint64_t rays_of(const render::FrameResult& result) {
  const render::RenderStatistics& s = result.statistics;
  return s.primary_rays + s.shadow_rays + s.secondary_rays;
}

// Dull, mirroring and clear balls move by random steps through a room lit by its screen, whose
// video goes on, and by the sky; `real_floor` that is mirrored or stands back too.
TEST(MovingThings, ShowAtOnceInEveryCellThatSeesThem) {
  for (const bool real_floor : {false, true}) {
    MadeRoom room(128, 96);
    render::SceneDescription scene = MadeRoom::describe();
    if (real_floor) {
      scene.materials.push_back(make_stand_in_material("floor", {}));
      auto floor = std::make_shared<render::Mesh>(*scene.meshes[0]);
      floor->materials = {static_cast<std::uint32_t>(scene.materials.size() - 1)};
      scene.meshes[0] = floor;
      scene.instances[0].kind = render::ObjectKind::stand_in;
      scene.instances[0].blocks_light = scene.instances[0].occludes = false;
    }
    for (const std::size_t i : {4U, 5U, 6U}) scene.instances[i].moves = true;
    room.scene = std::make_unique<render::Scene>(scene);
    room.job.lights.lights.resize(12);
    const auto screen = render::sample_area_light(scene, MadeRoom::screen_instance, 3, {2, 2});
    render::KeptTransport kept;
    Dice dice{std::mt19937(7)};
    std::uint64_t warm_rays = 0, cold_rays = 0;
    for (int frame = 0; frame < 16; ++frame) {
      room.show(made_video(90, 160, frame));
      room.job.lights.lamps = lamps_of(screen, room.video, {{4, 4, 4}, 0.02F});
      if (frame % 4 != 3) {
        auto& place = scene.instances[static_cast<std::size_t>(4 + dice.pick(2))].set_from_object;
        place[3] = dice(-0.4F, 0.4F);
        place[7] = dice(-0.4F, 0.4F);
        if (frame == 9) place[3] = 30;  // out of the room, and of all that was thought of
      }
      room.scene = std::make_unique<render::Scene>(scene, *room.scene);
      const render::FrameResult warm = render_room(room, &kept);
      const render::Scene built(scene);
      render::FrameInputs inputs = room.inputs();
      inputs.scene = &built;
      render::FrameResult cold;
      render_frame(inputs, room.job, room.plate, cold);
      EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << real_floor << " " << frame;
      EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << real_floor << " " << frame;
      if (frame == 0) continue;
      warm_rays += rays_of(warm);
      cold_rays += rays_of(cold);
    }
    EXPECT_LT(warm_rays, cold_rays * 3 / 4) << real_floor;
  }
}

// A room in whose light things take small steps, each of which changes a few shadows: only where a
// shadow ray comes to something else, or rays may see them, is anything found anew.
struct SmallSteps {
  MadeRoom room{160, 128};
  render::SceneDescription scene = MadeRoom::describe();
  render::KeptTransport kept;
  double lost = 0;  // share of the cells, mean of the frames

  explicit SmallSteps(std::vector<std::size_t> moving) {
    for (const std::size_t i : moving) scene.instances[i].moves = true;
  }
  // Moves a thing along, in so many frames, each of which is to have the bits of a cold one.
  void take(std::size_t thing, Vec3f step, int frames) {
    room.scene = std::make_unique<render::Scene>(scene);
    render_room(room, &kept);
    lost = 0;
    for (int frame = 0; frame < frames; ++frame) {
      auto& place = scene.instances[thing].set_from_object;
      place[3] += step.x, place[7] += step.y, place[11] += step.z;
      room.scene = std::make_unique<render::Scene>(scene, *room.scene);
      render::FrameInputs inputs = room.inputs();
      inputs.kept = &kept;
      render::prepare_frame(inputs, room.job, room.plate);
      const std::vector<int> stages = kept.stages();
      lost += static_cast<double>(std::ranges::count(stages, render::KeptTransport::none)) /
              static_cast<double>(stages.size() * static_cast<std::size_t>(frames));
      const render::FrameResult warm = render_room(room, &kept);
      const render::Scene built(scene);
      inputs = room.inputs();
      inputs.scene = &built;
      render::FrameResult cold;
      render_frame(inputs, room.job, room.plate, cold);
      EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << thing << " " << frame;
      EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << thing << " " << frame;
    }
  }
};

TEST(MovingThings, LeaveCellsWhoseShadowRaysComeToTheSame) {
  SmallSteps dull({4, 5, 6});
  dull.scene.instances[0].mesh = 1;  // no floor that mirrors
  dull.take(4, {0.004F, 0.003F, 0}, 6);
  EXPECT_GT(dull.lost, 0.05);
  EXPECT_LT(dull.lost, 0.45);
  SmallSteps glass({6});
  glass.take(6, {0.002F, -0.004F, 0.002F}, 4);
  EXPECT_LT(glass.lost, 0.6);
  SmallSteps lamps({4});
  const auto screen = render::sample_area_light(lamps.scene, MadeRoom::screen_instance, 3, {2, 2});
  lamps.room.job.lights.lamps = lamps_of(screen, lamps.room.video, {{4, 4, 4}, 0.02F});
  lamps.take(4, {0.003F, 0, 0.002F}, 4);
  EXPECT_LT(lamps.lost, 0.55);
}

// Something comes into the way of lights that nothing could block before, and leaves it again.
TEST(MovingThings, ComeBetweenLightsThatNothingBlockedAndCells) {
  SmallSteps far({4});
  far.scene.instances[4].set_from_object[11] = 20;
  far.scene.instances.erase(far.scene.instances.begin() + 5, far.scene.instances.end());
  far.take(4, {0.2F, -0.3F, -4}, 6);
  far.take(4, {0, 0, 9}, 3);
}

// More shadow rays than are kept of any cell.
TEST(MovingThings, ShowWhereCellsHaveTooManyShadowRaysToKeep) {
  SmallSteps many({4});
  many.room.job.lights.lights = even_lights(900).lights;
  many.room.job.effort.adaptive_visibility = false;
  many.take(4, {0.004F, 0.003F, 0}, 2);
  EXPECT_GT(many.lost, 0.5);
}

// A small thing in a corner leaves most of a wide picture as it is.
TEST(MovingThings, LeaveCellsFarAwayAsTheyAre) {
  render::SceneDescription scene = shot_scene(false);
  render::StandardParameters paint;
  paint.clearcoat = 1;
  scene.materials.push_back(render::make_standard_material("paint", paint));
  const auto material = static_cast<std::uint32_t>(scene.materials.size() - 1);
  for (int i = 0; i < 6; ++i) {
    scene.meshes.push_back(made_ball({0, 0, 0.3F}, 0.3F, material));
    render::Instance& ball = scene.instances.emplace_back();
    ball.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    ball.set_from_object[3] = 0.9F * static_cast<float>(i) - 2;
    ball.moves = true;
  }
  MadeShot shot = made_shot(320, 128, scene, 16);
  shot.job.cam_from_set = calibrate::look_at({0, -5, 2.5}, {0, 0, 0.3}, 0);
  // From above, so that shadows are short.
  std::erase_if(shot.job.lights.lights, [](const auto& light) { return light.direction.z < 0.6F; });
  render::KeptTransport kept;
  render::FrameResult result;
  const auto rays = [&](render::KeptTransport* memory) {
    render::FrameInputs inputs = shot.inputs();
    inputs.kept = memory;
    render_frame(inputs, shot.job, shot.plate, result);
    return rays_of(result);
  };
  const std::uint64_t all = rays(&kept);
  EXPECT_EQ(rays(&kept), 0U);
  scene.instances.back().set_from_object[7] = 0.1F;
  shot.scene = std::make_unique<render::Scene>(scene, *shot.scene);
  const std::uint64_t some = rays(&kept);
  EXPECT_GT(some, 0U);
  EXPECT_LT(some, all / 2);
  // Nor are they lost where it leaves the picture, and all of space that was thought of.
  for (int step = 1; step <= 8; ++step) {
    scene.instances.back().set_from_object[3] += 0.4F;
    shot.scene = std::make_unique<render::Scene>(scene, *shot.scene);
    const std::uint64_t warm = rays(&kept);
    const capture::HalfImage shown = result.rgba;
    EXPECT_LT(warm, rays(nullptr) / 3) << step;
    EXPECT_EQ(shown.pixels, result.rgba.pixels) << step;
  }
}

}  // namespace
}  // namespace compositing::moving_things_test
