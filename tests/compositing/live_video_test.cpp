// Live video on surfaces: seen straight on, in mirrors and in glass.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "made_room.h"
#include "render/kept_transport.h"
#include "render/reference.h"

namespace compositing::live_video_test {
namespace {

using capture::float_from_half;
using render::FrameResult;

TEST(LiveVideo, IsSeenWhereItsTextureCoordinatesSay) {
  MadeRoom room(81, 61);
  room.job.cam_from_set = calibrate::look_at({0.2, 1.9, 1.2}, {0.2, 2.9, 1.2}, 0);
  const FrameResult result = render_room(room);
  const calibrate::Lens lens{"pinhole", 81, 61, {72.9, 72.9, 40, 30}};
  for (const auto& [u, v] : {std::pair(0.3F, 0.4F), {0.62F, 0.5F}, {0.5F, 0.3F}}) {
    const calibrate::Vec3 p{0.2 + 1.6 * (u - 0.5), 2.9, 1.2 + 0.9 * (0.5 - v)};
    const auto q = calibrate::project(lens, room.job.cam_from_set * p);
    const int x = static_cast<int>(std::lround(q->x)), y = static_cast<int>(std::lround(q->y));
    const float exact_u = u + static_cast<float>((x - q->x) / (72.9 * 1.6));
    const float exact_v = v + static_cast<float>((y - q->y) / (72.9 * 0.9));
    const render::Vec3f shown = sample(room.video, exact_u, exact_v, 0.01F) * MadeRoom::gain;
    EXPECT_NEAR(float_from_half(result.rgba.pixels[result.rgba.index(y, x, 0)]), shown.x,
                0.05F * shown.x + 0.02F);
    EXPECT_NEAR(float_from_half(result.rgba.pixels[result.rgba.index(y, x, 1)]), shown.y,
                0.05F * shown.y + 0.02F);
  }
}

// All but the pixels where thin mirrored edges are not found (kernel.md, Known limits).
TEST(LiveVideo, IsSeenInMirrorsAndGlassAsInTheReference) {
  MadeRoom room(96, 72);
  room.job.effort.accuracy = 0.999F;
  room.job.effort.aa_tolerance = 0.02F;
  room.show(made_video(9, 16, 0));  // coarse, so that it is hardly filtered
  render::ReferenceSettings settings;
  settings.samples = 128;
  const capture::Image truth =
      render_reference(room.inputs(), room.job, capture::make_image(72, 96), settings);
  const capture::Image shown = capture::to_float(render_room(room).rgba);
  int bright = 0, alike = 0, mirrored = 0;
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      const float r = truth.at(y, x, 0);
      if (r < 0.05F) continue;
      ++bright;
      mirrored += y > 40;
      alike += std::abs(shown.at(y, x, 0) - r) < 0.04F * r + 0.01F;
    }
  }
  EXPECT_GT(mirrored, 200);
  EXPECT_GT(alike, bright * 17 / 20) << bright;
}

// A frame of another size, and one with a hole of numbers that are none, come in between.
TEST(LiveVideo, IsTheSameColdAndWarmAndTakesNoRays) {
  MadeRoom room(96, 72);
  render::KeptTransport kept;
  std::vector<capture::Half> before;
  for (int frame = 0; frame < 5; ++frame) {
    capture::Image image = made_video(frame < 4 ? 90 : 60, frame < 4 ? 160 : 81, frame);
    if (frame == 2) image.at(20, 30, 1) = std::nanf("");
    room.show(image);
    const FrameResult cold = render_room(room), warm = render_room(room, &kept);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
    EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << frame;
    const bool keeps = frame > 0 && frame < 4;
    EXPECT_EQ(warm.statistics.primary_rays == 0, keeps) << frame;
    EXPECT_NE(warm.rgba.pixels, before) << "frame " << frame << " does not show";
    for (const capture::Half half : warm.rgba.pixels)
      ASSERT_TRUE(std::isfinite(float_from_half(half)));
    before = warm.rgba.pixels;
  }
}

// All light a million times as strong for a frame, and back: nothing is left of it.
TEST(LiveVideo, IsAsItWasAfterLightThatJumpsByAMillion) {
  MadeRoom room(96, 72);
  for (render::DirectionalLight& light : room.job.lights.lights) light.planned = light.irradiance;
  render::KeptTransport kept;
  const auto shown_at = [&](float gain) {
    capture::Image frame = made_video(90, 160, 0);
    for (float& value : frame.pixels) value *= gain;
    room.show(frame);
    for (std::size_t i = 0; i < room.job.lights.lights.size(); ++i) {
      room.job.lights.lights[i].irradiance = room.job.lights.lights[i].planned * gain;
    }
    FrameResult cold = render_room(room), warm = render_room(room, &kept);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << gain;
    for (const capture::Half half : warm.rgba.pixels) {
      EXPECT_TRUE(std::isfinite(float_from_half(half))) << gain;
    }
    return warm;
  };
  const FrameResult before = shown_at(1), jumped = shown_at(1e6F), after = shown_at(1);
  EXPECT_GT(jumped.statistics.clamped_values, 0U);
  EXPECT_EQ(after.rgba.pixels, before.rgba.pixels);
  EXPECT_EQ(jumped.statistics.primary_rays + after.statistics.primary_rays, 0U);
  // Brighter in proportion where halves hold it, and nowhere by more.
  for (std::size_t i = 0; i < before.rgba.pixels.size(); ++i) {
    if (i % 4 == 3) continue;
    const float was = float_from_half(before.rgba.pixels[i]);
    EXPECT_LE(float_from_half(jumped.rgba.pixels[i]), 1e6F * (was + 1e-3F)) << i;
  }
}

TEST(LiveVideo, DoesNotDependOnTilesOrThreads) {
  MadeRoom room(96, 72);
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

// Rough floors mirror the picture blurred: what is fine in it is not seen in them.
TEST(LiveVideo, IsBlurredByRoughSurfaces) {
  MadeRoom room(96, 72);
  render::SceneDescription scene = MadeRoom::describe();
  auto parameters = render::standard_parameters(scene.materials[1], 0, 1);
  parameters.roughness = 0.4F;
  parameters.metallic = 1;
  scene.materials[1] = render::make_standard_material("floor", parameters);
  room.scene = std::make_unique<render::Scene>(std::move(scene));
  const auto floor_at = [&](float phase) {
    capture::Image stripes = capture::make_image(64, 64);
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x)
        stripes.at(y, x, 0) = 1 + std::sin(phase + 3.14159265F / 4 * static_cast<float>(x));
    }
    room.show(stripes);
    const FrameResult result = render_room(room);
    std::vector<float> row;
    // Just beside them, where the screen ends in the ball, stripes show to the reference as well.
    for (int x = 42; x < 50; ++x)
      row.push_back(float_from_half(result.rgba.pixels[result.rgba.index(59, x, 0)]));
    return row;
  };
  const std::vector<float> a = floor_at(0), b = floor_at(3.14159265F);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 0.05F * a[i] + 0.02F) << i;
}

TEST(LiveVideo, MustBeThereForEveryTextureOfTheScene) {
  MadeRoom room(32, 32);
  room.videos.clear();
  EXPECT_THROW(render_room(room), std::invalid_argument);
  room.videos = {nullptr};
  EXPECT_THROW(render_room(room), std::invalid_argument);
  const render::VideoTexture none;
  room.videos = {&none};
  EXPECT_THROW(render_room(room), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::live_video_test
