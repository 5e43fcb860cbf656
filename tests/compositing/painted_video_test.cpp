// Live video as the colour of matte surfaces, in the set's light.
#include <gtest/gtest.h>

#include "made_room.h"
#include "render/kept_transport.h"
#include "render/reference.h"
#include "render/sample_pattern.h"
#include "render/texture.h"

namespace compositing::painted_video_test {
namespace {

using capture::float_from_half;
using render::FrameResult;

constexpr std::uint32_t walls = 0;  // the material

// The made room whose walls and dull ball have the colours of its video, in more light.
struct PaintedRoom : MadeRoom {
  PaintedRoom(int width, int height) : MadeRoom(width, height) {
    render::SceneDescription painted = describe();
    auto parameters = render::standard_parameters(painted.materials[walls], 0, 1);
    parameters.base_color[0] = 0.8F;
    parameters.base_color_video = 0;
    painted.materials[walls] = render::make_standard_material("painted", parameters);
    scene = std::make_unique<render::Scene>(std::move(painted));
    for (render::DirectionalLight& light : job.lights.lights) light.irradiance *= 40.0F;
    environment = made_sky(16, 0, 0.8F);
  }
};

// A picture whose texels are alike, and the same as a texture that stands still in the walls'
// video's place.
capture::Image made_stripes(int size) {
  capture::Image frame = capture::make_image(size, size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      for (int c = 0; c < 3; ++c) {
        frame.at(y, x, c) = static_cast<float>((x * (c + 2) * 3 + y * 5) % 256) / 255;
      }
    }
  }
  return frame;
}
std::unique_ptr<render::Scene> made_still(const capture::Image& frame) {
  std::vector<std::uint8_t> texels;
  for (const float value : frame.pixels) {
    texels.push_back(static_cast<std::uint8_t>(std::lround(value * 255)));
  }
  render::SceneDescription still = MadeRoom::describe();
  auto parameters = render::standard_parameters(still.materials[walls], 0, 1);
  parameters.base_color[0] = 0.8F;
  parameters.base_color_texture = 0;
  still.materials[walls] = render::make_standard_material("painted", parameters);
  still.textures.push_back(std::make_shared<render::Texture>(
      render::make_texture(frame.width, frame.height, 3, false, texels)));
  return std::make_unique<render::Scene>(std::move(still));
}

// Of a room under its video, and under the texture.
struct TwoPictures {
  FrameResult video, still;
  double difference = 0;  // the mean one, in terms of the mean light
};
TwoPictures painted_twice(PaintedRoom& room) {
  const capture::Image frame = made_stripes(32);
  room.show(frame);
  TwoPictures two;
  two.video = render_room(room);
  room.scene = made_still(frame);
  two.still = render_room(room);
  double sum = 0, difference = 0;
  for (std::size_t i = 0; i < two.video.rgba.pixels.size(); ++i) {
    const float b = float_from_half(two.still.rgba.pixels[i]);
    sum += b;
    difference += std::abs(float_from_half(two.video.rgba.pixels[i]) - b);
  }
  two.difference = difference / sum;
  return two;
}

TEST(PaintedVideo, IsALitTexture) {
  PaintedRoom room(96, 72);
  const TwoPictures two = painted_twice(room);
  EXPECT_LT(two.difference, 0.01);
  EXPECT_EQ(two.video.matte.pixels, two.still.matte.pixels);
}

// Where a cell's samples see more places of it than are kept apart, the others are like those.
TEST(PaintedVideo, IsALitTextureByTooManySamples) {
  PaintedRoom room(16, 16);
  room.job.effort.aa_samples = render::samples_max;
  room.job.effort.glint_contrast = 1e-6F;
  EXPECT_LT(painted_twice(room).difference, 0.01);
}

TEST(PaintedVideo, IsSeenInMirrorsAndGlassAsInTheReference) {
  PaintedRoom room(96, 72);
  room.job.effort.accuracy = 0.999F;
  room.show(made_video(9, 16, 0));  // coarse, so that it is hardly filtered
  render::LocalLight lamp;
  lamp.position = {-1.5F, 0, 2};
  lamp.intensity = {2, 1.5F, 1};
  room.job.lights.lamps.push_back(lamp);
  render::ReferenceSettings settings;
  settings.samples = 256;
  const capture::Image truth =
      render_reference(room.inputs(), room.job, capture::make_image(72, 96), settings);
  const capture::Image shown = capture::to_float(render_room(room).rgba);
  int bright = 0, alike = 0;
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      for (int c = 0; c < 3; ++c) {
        const float r = truth.at(y, x, c);
        if (r < 0.02F) continue;
        ++bright;
        alike += std::abs(shown.at(y, x, c) - r) < 0.06F * r + 0.01F;
      }
    }
  }
  EXPECT_GT(bright, 10000);
  EXPECT_GT(alike, bright * 98 / 100) << bright;
}

TEST(PaintedVideo, IsTheSameColdAndWarmAndTakesNoRays) {
  PaintedRoom room(96, 72);
  render::KeptTransport kept;
  std::vector<capture::Half> before;
  for (int frame = 0; frame < 4; ++frame) {
    capture::Image image = made_video(90, 160, frame);
    if (frame == 2) image.at(20, 30, 1) = std::nanf("");
    room.show(image);
    const FrameResult cold = render_room(room), warm = render_room(room, &kept);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
    EXPECT_EQ(warm.statistics.primary_rays == 0, frame > 0) << frame;
    EXPECT_NE(warm.rgba.pixels, before) << "frame " << frame << " does not show";
    for (const capture::Half half : warm.rgba.pixels)
      ASSERT_TRUE(std::isfinite(float_from_half(half)));
    before = warm.rgba.pixels;
  }
}

// A surface sends back no more light than falls on it, however bright the video is.
TEST(PaintedVideo, IsNoBrighterThanWhite) {
  PaintedRoom room(48, 36);
  const auto shown_with = [&](float grey) {
    capture::Image image = capture::make_image(4, 4);
    std::ranges::fill(image.pixels, grey);
    room.show(image);
    return capture::to_float(render_room(room).rgba);
  };
  const capture::Image white = shown_with(1), brighter = shown_with(1e9F), black = shown_with(0);
  // On the left wall, which nothing that glows is mirrored in.
  for (int c = 0; c < 3; ++c) {
    EXPECT_GT(white.at(12, 2, c), 0.1F);
    EXPECT_EQ(brighter.at(12, 2, c), white.at(12, 2, c));
    EXPECT_EQ(black.at(12, 2, c), 0);
  }
}

}  // namespace
}  // namespace compositing::painted_video_test
