// Pictures that sharpen: cells at their stages.
#include "render/refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "made_shot.h"
#include "render/kept_transport.h"

namespace compositing::refinement_test {
namespace {

using render::FrameResult;

constexpr int cells = 6 * 4;  // of a picture of 96x64

using Stages = std::vector<std::uint8_t>;

FrameResult render_at(const MadeShot& shot,
                      const Stages& stages,
                      render::KeptTransport* kept = nullptr) {
  render::FrameJob job = shot.job;
  job.stages = stages;
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = kept;
  FrameResult result;
  render_frame(inputs, job, shot.plate, result);
  return result;
}

Stages all_at(int stage, std::size_t cells_n = cells) {
  return Stages(cells_n, static_cast<std::uint8_t>(stage));
}

TEST(Refinement, EndsWithTheSameBitsAsAtOnce) {
  const MadeShot shot = made_shot(96, 64, shot_scene());
  const FrameResult at_once = render_at(shot, {});
  render::KeptTransport kept;
  FrameResult last;
  Stages stages = all_at(0);
  for (std::size_t n = 0; n < render::finished_stage * cells; ++n) {
    ++stages[n * 7 % cells];
    if (n % 6 == 5) last = render_at(shot, stages, &kept);
  }
  EXPECT_EQ(last.rgba.pixels, at_once.rgba.pixels);
  EXPECT_EQ(last.matte.pixels, at_once.matte.pixels);
  EXPECT_NE(render_at(shot, all_at(0)).rgba.pixels, at_once.rgba.pixels);
}

TEST(Refinement, TakesRaysOnlyForCellsThatGoOn) {
  const MadeShot shot = made_shot(96, 64, shot_scene());
  render::KeptTransport kept;
  const auto rays = [&](const Stages& stages) {
    return render_at(shot, stages, &kept).statistics.primary_rays;
  };
  Stages stages = all_at(0);
  EXPECT_EQ(rays(stages), 12U * 8U);
  EXPECT_EQ(rays(stages), 0U);
  stages = all_at(2);
  EXPECT_EQ(rays(stages), 48U * 32U);
  stages = all_at(render::one_ray_stage);
  EXPECT_EQ(rays(stages), 96U * 64U);
  EXPECT_EQ(rays(stages), 0U);
  ++stages[9];
  const std::uint64_t one = rays(stages);
  EXPECT_GE(one, 256U);
  EXPECT_LE(one, 256U * (1 + render::samples_max));
  EXPECT_EQ(rays(stages), 0U);
}

// Plate, light and what is moved change between frames, and so does how sharp they are.
TEST(Refinement, IsTheSameColdAndWarm) {
  render::SceneDescription scene = shot_scene();
  scene.instances[2].moves = true;
  MadeShot shot = made_shot(96, 64, scene);
  for (render::DirectionalLight& light : shot.job.lights.lights) light.planned = light.irradiance;
  render::KeptTransport kept;
  std::mt19937 random(5);
  const auto pick = [&random](int most) {
    return std::uniform_int_distribution<int>(0, most)(random);
  };
  for (int frame = 0; frame < 12; ++frame) {
    if (pick(3) == 0) {
      scene.instances[2].set_from_object[7] = 0.1F * static_cast<float>(pick(9));
      shot.scene = std::make_unique<render::Scene>(scene, *shot.scene);
    }
    shot.job.lights.lights[3].irradiance *= 0.9F;
    for (capture::Half& value : shot.plate.pixels) value ^= static_cast<capture::Half>(pick(1));
    Stages stages(cells);
    for (std::uint8_t& stage : stages) stage = static_cast<std::uint8_t>(pick(render::finer_stage));
    const FrameResult warm = render_at(shot, stages, &kept);
    const FrameResult cold = render_at(shot, stages);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
    EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << frame;
  }
}

TEST(Refinement, BringsThePictureNearerToTheFinishedOneInEveryStage) {
  const MadeShot shot = made_shot(192, 128, shot_scene());
  const capture::Image finished = capture::to_float(render_at(shot, {}).rgba);
  double before = 1e9;
  for (int stage = 0; stage < render::finished_stage; ++stage) {
    const capture::Image shown = capture::to_float(render_at(shot, all_at(stage, 4 * cells)).rgba);
    double sum = 0;
    for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
      sum += std::pow(shown.pixels[i] - finished.pixels[i], 2);
    }
    // At edges, the square of the error goes with the width of what shares a ray. A few rays only
    // see anew what smoothing has already guessed.
    EXPECT_LT(sum, before / (stage == render::few_rays_stage ? 1.25 : 1.6)) << stage;
    EXPECT_GT(sum, 0) << stage;
    before = sum;
  }
}

// Beyond what the effort asks, pixels are nearer to those that take all the rays that they may.
TEST(Refinement, GoesBeyondTheEffort) {
  MadeShot shot = made_shot(192, 128, shot_scene());
  const auto shown_at = [&](int stage) {
    return capture::to_float(render_at(shot, all_at(stage, 4 * cells)).rgba);
  };
  const capture::Image finished = shown_at(render::finished_stage);
  const capture::Image finer = shown_at(render::finer_stage);
  shot.job.effort.aa_tolerance = 0.002F;
  shot.job.effort.accuracy = 0.9999F;
  shot.job.effort.adaptive_visibility = false;
  const capture::Image best = shown_at(render::finished_stage);
  double of_finished = 0, of_finer = 0;
  for (std::size_t i = 0; i < best.pixels.size(); ++i) {
    of_finished += std::pow(finished.pixels[i] - best.pixels[i], 2);
    of_finer += std::pow(finer.pixels[i] - best.pixels[i], 2);
  }
  EXPECT_LT(of_finer, of_finished / 2);
}

// Where no pixel is uncertain, there is nothing beyond.
TEST(Refinement, EndsWithAnEffortThatAsksForNoMoreRays) {
  MadeShot shot = made_shot(96, 64, shot_scene());
  EXPECT_TRUE(render::can_be_finer(shot.job.effort));
  shot.job.effort.aa_tolerance = 0;
  EXPECT_FALSE(render::can_be_finer(shot.job.effort));
  EXPECT_EQ(render_at(shot, all_at(render::finer_stage)).rgba.pixels,
            render_at(shot, all_at(render::finished_stage)).rgba.pixels);
}

// The middle of what is covered, in pixels, and how much that is.
std::array<double, 3> middle_of_cover(const FrameResult& result) {
  std::array<double, 3> sums{};
  for (int y = 0; y < result.rgba.height; ++y) {
    for (int x = 0; x < result.rgba.width; ++x) {
      const double cover = capture::float_from_half(result.rgba.pixels[result.rgba.index(y, x, 3)]);
      sums[0] += x * cover, sums[1] += y * cover, sums[2] += cover;
    }
  }
  return {sums[0] / sums[2], sums[1] / sums[2], sums[2]};
}

// Where pixels share a camera ray, also in cells that the picture's border cuts, each shows its own
// plate and what its block's ray met, which goes through the block's middle: nothing is moved.
TEST(Refinement, SharesARayInBlocks) {
  const MadeShot shot = made_shot(90, 61, shot_scene());
  const FrameResult fine = render_at(shot, all_at(render::one_ray_stage));
  const auto where = middle_of_cover(fine);
  for (int stage = 0; stage < render::one_ray_stage; ++stage) {
    const int size = render::block_of_stage(stage);
    const FrameResult coarse = render_at(shot, all_at(stage));
    int covered = 0, alike = 0, differ = 0;
    for (int y = 0; y < 61; ++y) {
      for (int x = 0; x < 90; ++x) {
        const auto at = coarse.rgba.index(y, x, 3);
        const auto first = coarse.rgba.index(y - y % size, x - x % size, 3);
        ASSERT_EQ(coarse.rgba.pixels[at], coarse.rgba.pixels[first]) << x << ' ' << y;
        covered += coarse.rgba.pixels[at] != 0;
        // The block's ray goes between this pixel and those beside and below it.
        const bool has_ray = x % size == (size - 1) / 2 && y % size == (size - 1) / 2;
        if (!has_ray || x + 1 == 90 || y + 1 == 61) continue;
        const auto cover = [&](int row, int column) {
          return fine.rgba.pixels[fine.rgba.index(row, column, 3)];
        };
        if (cover(y, x) != cover(y, x + 1) || cover(y, x) != cover(y + 1, x) ||
            cover(y, x) != cover(y + 1, x + 1)) {
          continue;
        }
        ++alike;
        differ += coarse.rgba.pixels[at] != cover(y, x);
      }
    }
    EXPECT_GT(covered, 200);
    EXPECT_LT(covered, 90 * 61 - 200);
    EXPECT_GT(alike, 90 * 61 / (2 * size * size)) << size;
    EXPECT_LE(differ, 2) << size;  // where things part between pixels
    if (size > 4) continue;        // which miss whole things
    const auto [x, y, cover] = middle_of_cover(coarse);
    const double near = 0.1 * size;
    EXPECT_NEAR(x, where[0], near) << size;
    EXPECT_NEAR(y, where[1], near) << size;
    EXPECT_NEAR(cover / where[2], 1, 0.02 * size) << size;
  }
  EXPECT_EQ(render::block_of_stage(render::one_ray_stage), 1);
}

TEST(Refinement, SmoothsEdgesAndHardlyShadesMore) {
  const MadeShot shot = made_shot(192, 128, shot_scene());
  const FrameResult finished = render_at(shot, {});
  const FrameResult hard = render_at(shot, all_at(render::one_ray_stage, 4 * cells));
  const FrameResult smooth = render_at(shot, all_at(render::smoothed_stage, 4 * cells));
  EXPECT_GT(smooth.statistics.primary_rays, hard.statistics.primary_rays);
  EXPECT_LT(smooth.statistics.shadow_rays, hard.statistics.shadow_rays * 11 / 10);
  // How much of each pixel things cover, where neighbours show none and all of them.
  const auto off_at_edges = [&](const FrameResult& result) {
    const auto covered = [](const FrameResult& of, int y, int x) {
      return capture::float_from_half(of.matte.pixels[of.matte.index(y, x, 0)]);
    };
    double sum = 0;
    for (int y = 0; y < 128; ++y) {
      for (int x = 1; x < 191; ++x) {
        const float left = covered(hard, y, x - 1), right = covered(hard, y, x + 1);
        if (std::min(left, right) > 0 || std::max(left, right) < 1) continue;
        sum += std::pow(covered(result, y, x) - covered(finished, y, x), 2);
      }
    }
    return sum;
  };
  EXPECT_LT(off_at_edges(smooth), off_at_edges(hard) / 2.5);
}

// What is smoothed lies between what the pixel and those around it showed.
TEST(Refinement, SmoothsWithinWhatNeighboursShow) {
  MadeShot shot = made_shot(96, 64, shot_scene());
  std::ranges::fill(shot.plate.pixels, capture::Half{0});
  const auto hard = capture::to_float(render_at(shot, all_at(render::one_ray_stage)).rgba);
  const auto smooth = capture::to_float(render_at(shot, all_at(render::smoothed_stage)).rgba);
  int changed = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 96; ++x) {
      for (int c = 0; c < 3; ++c) {
        float least = 1e9F, most = 0;
        for (int ny = std::max(y - 1, 0); ny <= std::min(y + 1, 63); ++ny) {
          for (int nx = std::max(x - 1, 0); nx <= std::min(x + 1, 95); ++nx) {
            least = std::min(least, hard.pixels[hard.index(ny, nx, c)]);
            most = std::max(most, hard.pixels[hard.index(ny, nx, c)]);
          }
        }
        const float shown = smooth.pixels[smooth.index(y, x, c)];
        EXPECT_GE(shown, least * 0.998F - 1e-4F) << x << ' ' << y;
        EXPECT_LE(shown, most * 1.002F + 1e-4F) << x << ' ' << y;
        changed += shown != hard.pixels[hard.index(y, x, c)];
      }
    }
  }
  EXPECT_GT(changed, 300);
}

TEST(Refinement, RefusesStagesThatAreNotThere) {
  const MadeShot shot = made_shot(96, 64, shot_scene());
  EXPECT_THROW(render_at(shot, all_at(0, cells - 1)), std::invalid_argument);
  EXPECT_THROW(render_at(shot, all_at(render::refinement_stages)), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::refinement_test
