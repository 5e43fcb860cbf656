// Cells that are kept from frame to frame: lit as they were, or found ahead.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <random>

#include "made_room.h"
#include "render/kept_transport.h"
#include "render/renderer.h"

namespace compositing::kept_cells_test {
namespace {

using Clock = std::chrono::steady_clock;

// The room on a real floor, with a ball of glass before a plate that it bends.
struct RealFloorRoom {
  MadeRoom room{96, 72};
  calibrate::Lens lens{"pinhole", 96, 72, {86.4, 86.4, 47.5, 35.5}};
  render::KeptTransport kept;

  RealFloorRoom() {
    render::SceneDescription scene = MadeRoom::describe();
    make_floor_real(scene);
    scene.instances[1].set_from_object[11] = -100;  // without the far wall: the plate shows
    scene.instances[dull_ball].moves = true;
    room.job.lights.lamps = {{.position = {-1, 0, 2}, .normal = {}, .intensity = {1, 1, 1}}};
    room.scene = std::make_unique<render::Scene>(std::move(scene));
    for (auto& light : room.job.lights.lights) light.planned = light.irradiance;
    for (std::size_t i = 0; i < room.plate.pixels.size(); ++i) {
      room.plate.pixels[i] = capture::half_from_float(0.1F + 0.01F * static_cast<float>(i % 11));
    }
  }

  static constexpr std::size_t dull_ball = 4;
  bool counts = false;

  void move_ball(float by) {
    render::SceneDescription moved = room.scene->description();
    moved.instances[dull_ball].set_from_object[3] += by;
    room.scene = std::make_unique<render::Scene>(std::move(moved), *room.scene);
  }
  render::FrameInputs inputs() {
    render::FrameInputs inputs = room.inputs();
    inputs.lens = &lens;
    inputs.count_rays = counts;
    return inputs;
  }
  render::FrameResult show(render::KeptTransport* memory) {
    render::FrameInputs all = inputs();
    all.kept = memory;
    render::FrameResult result;
    render_frame(all, room.job, room.plate, result);
    return result;
  }
  // Cells that the next frame shows as they are if nothing changes.
  int lit_cells() const {
    int count = 0;
    if (kept.stages().empty()) return count;
    for (int row = 0; row < 5; ++row) {
      for (int column = 0; column < 6; ++column) {
        const render::LitCell* lit = kept.lit(column, row);
        count += lit != nullptr && lit->light == kept.keys().light.all;
      }
    }
    return count;
  }
};

void expect_same(const render::FrameResult& warm, const render::FrameResult& cold, int frame) {
  EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
  EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << frame;
  EXPECT_EQ(warm.statistics.virtual_pixels, cold.statistics.virtual_pixels) << frame;
  EXPECT_EQ(warm.statistics.affected_pixels, cold.statistics.affected_pixels) << frame;
  EXPECT_EQ(warm.statistics.clamped_values, cold.statistics.clamped_values) << frame;
  EXPECT_EQ(warm.statistics.clipped_plate, cold.statistics.clipped_plate) << frame;
  EXPECT_TRUE(warm.rays.pixels == cold.rays.pixels) << frame;
}

TEST(LitCells, AreColdAndWarmTheSameAfterRandomEdits) {
  RealFloorRoom shot;
  MadeRoom& room = shot.room;
  std::mt19937 random(7);
  const auto below = [&](std::size_t end) { return random() % end; };
  const auto brighten = [](float& value) { value = value * 1.5F + 0.01F; };
  int shown_again = 0;
  for (int frame = 0; frame < 120; ++frame) {
    // As often as not nothing changes, so that cells are kept lit.
    switch (below(20)) {
      case 0:
        room.job.lights.lights[below(64)].irradiance *= 1.25F;
        break;
      case 1:
        room.plate.pixels[below(room.plate.pixels.size())] = capture::half_from_float(0.7F);
        break;
      case 2: {
        auto& radiance = room.environment.radiance.pixels;
        brighten(radiance[below(radiance.size())]);
        render::smooth_for_reflections(room.environment);
        break;
      }
      case 3:
        room.show(made_video(90, 160, frame));
        break;
      case 4:
        room.directions.sensitivity.assign(room.directions.z.size(), 1.0F);
        room.directions.sensitivity[below(room.directions.z.size())] = 0.5F;
        break;
      case 5: {
        auto& level = room.environment.smoothed.back().pixels;
        brighten(level[below(level.size())]);
        break;
      }
      case 6:
        brighten(room.job.lights.lamps[0].intensity.y);
        break;
      case 7:
        shot.move_ball(0.1F);
        break;
      case 8:
        room.job.stages.assign(30, render::finished_stage);
        room.job.stages[below(30)] = 2;
        break;
      case 9:
        shot.counts = !shot.counts;
        break;
      case 10:  // no number, and a number again
        room.plate.pixels[below(room.plate.pixels.size())] = 0x7e00;
        break;
      case 11:
        for (capture::Half& value : room.plate.pixels) {
          if (value == 0x7e00) value = capture::half_from_float(0.2F);
        }
        break;
      case 12:  // of one pixel alone, as a lens's edge may
        brighten(room.directions.x[below(room.directions.x.size())]);
        break;
      default:
        break;
    }
    shown_again += shot.lit_cells() > 0;
    expect_same(shot.show(&shot.kept), shot.show(nullptr), frame);
  }
  EXPECT_GT(shown_again, 40);
}

// Where they would be of no use: cells that show video never are.
TEST(LitCells, AreNotKeptWhileTheLightChanges) {
  RealFloorRoom shot;
  for (int frame = 0; frame < 4; ++frame) {
    for (render::DirectionalLight& light : shot.room.job.lights.lights) light.irradiance *= 1.01F;
    shot.show(&shot.kept);
    EXPECT_EQ(shot.lit_cells(), 0) << frame;
  }
  for (int i = 0; i < 2; ++i) shot.show(&shot.kept);
  EXPECT_GT(shot.lit_cells(), 10);
  EXPECT_LT(shot.lit_cells(), 30);  // some see the video
}

TEST(KeptTransport, LeavesRoomForWhatFindingCellsTakes) {
  constexpr std::size_t megabyte = std::size_t{1} << 20, all = 128 * megabyte;
  tbb::task_arena(1).execute([&] {  // for what one thread's lists have grown to counts for all
    RealFloorRoom shown;
    shown.show(&shown.kept);
    const std::size_t room = shown.kept.room();
    EXPECT_LT(room, all);
    shown.kept.found_with(60 * megabyte);
    EXPECT_EQ(shown.kept.room(), std::min(room, all - 60 * megabyte));
    shown.kept.found_with(megabyte);  // the largest counts
    EXPECT_EQ(shown.kept.room(), std::min(room, all - 60 * megabyte));
    shown.kept.found_with(100 * all);
    EXPECT_EQ(shown.kept.room(), all / 2);
    shown.room.job.effort.accuracy = 0.9F;  // all is found anew
    shown.show(&shown.kept);
    EXPECT_GT(shown.kept.room(), all / 2);
  });
}

TEST(RefineCells, FindsCellsAheadAsTheFrameWouldShowThem) {
  RealFloorRoom shot;
  render::FrameJob& job = shot.room.job;
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = &shot.kept;
  job.stages.assign(30, 1);
  shot.show(&shot.kept);
  const auto frame = render::prepare_frame(inputs, job, shot.room.plate);
  std::vector<render::Refinement> wanted;
  for (std::size_t i = 0; i < 30; i += 3) wanted.push_back({i, render::finished_stage});
  render::RenderStatistics ahead;
  render::refine_cells(*frame, wanted, Clock::now(), Clock::duration::max(), job, ahead);
  EXPECT_EQ(job.stages, std::vector<std::uint8_t>(30, 1));
  // Given up in their midst, they leave what there is as it was.
  const auto in_an_hour = Clock::now() + std::chrono::hours(1);
  render::refine_cells(*frame, wanted, in_an_hour, Clock::duration::zero(), job, ahead);
  for (const render::Refinement& one : wanted) EXPECT_TRUE(one.given_up);
  EXPECT_EQ(job.stages, std::vector<std::uint8_t>(30, 1));
  render::refine_cells(*frame, wanted, in_an_hour, Clock::duration::max(), job, ahead);
  for (const render::Refinement& one : wanted) {
    EXPECT_FALSE(one.given_up);
    EXPECT_GT(one.took_ms, 0);
  }
  EXPECT_GT(ahead.primary_rays, 0U);
  for (std::size_t i = 0; i < 30; ++i) {
    EXPECT_EQ(job.stages[i], i % 3 == 0 ? render::finished_stage : 1) << i;
  }
  render::FrameResult warm;
  render::render_frame(*frame, shot.room.plate, warm);
  EXPECT_EQ(warm.statistics.primary_rays + warm.statistics.secondary_rays, 0U);
  expect_same(warm, shot.show(nullptr), 0);
}

// A body that the first stage misses: the frame that finds it has begun without it.
TEST(RefineCells, KeepsNoCellLitWhosePlateHadNoKey) {
  RealFloorRoom shot;
  MadeRoom& room = shot.room;
  render::SceneDescription scene = room.scene->description();
  constexpr std::size_t screen = 3, glass_ball = 6;
  for (const std::size_t i : {screen, glass_ball}) scene.instances[i].set_from_object[11] = -100;
  scene.meshes.push_back(made_ball({-0.31F, 1.0F, 1.3F}, 0.07F, 4));
  scene.instances.emplace_back().mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  room.scene = std::make_unique<render::Scene>(std::move(scene));
  const auto show = [&](int frame, bool refine) {
    for (std::size_t i = 0; i < room.plate.pixels.size(); ++i) {
      const auto value = static_cast<float>((i * 7 + static_cast<std::size_t>(frame)) % 11);
      room.plate.pixels[i] = capture::half_from_float(0.1F + 0.01F * value);
    }
    render::FrameInputs inputs = shot.inputs();
    inputs.kept = &shot.kept;
    const auto context = render::prepare_frame(inputs, room.job, room.plate);
    if (refine) {
      std::vector<render::Refinement> wanted;
      for (std::size_t i = 0; i < 30; ++i) wanted.push_back({i, render::finished_stage});
      render::RenderStatistics ahead;
      refine_cells(*context, wanted, Clock::now() + std::chrono::hours(1), Clock::duration::max(),
                   room.job, ahead);
    }
    render::FrameResult warm;
    render_frame(*context, room.plate, warm);
    expect_same(warm, shot.show(nullptr), frame);
  };
  room.job.stages.assign(30, 0);
  for (int frame = 0; frame < 3; ++frame) show(0, false);
  EXPECT_FALSE(shot.kept.bends_plate());
  show(0, true);
  EXPECT_TRUE(shot.kept.bends_plate());
  const std::vector<render::DirectionalLight> before = room.job.lights.lights;
  room.job.lights.lights[0].irradiance *= 1.2F;
  show(1, false);
  room.job.lights.lights = before;
  for (int frame = 2; frame < 5; ++frame) show(frame, false);
}

}  // namespace
}  // namespace compositing::kept_cells_test
