// Light sampled pixel by pixel: it must come to what the reference says, and err by chance alone.
#include "render/sampled_light.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../render/plain_shapes.h"
#include "../render/sun_and_sky.h"
#include "compositing/stand_in.h"
#include "render/reference.h"

namespace compositing::sampled_light_test {
namespace {

using namespace render;  // only its stand-ins need this folder

// A matte sphere on a floor that catches its shadow, without edges in the pixels that are judged.
struct Shot {
  SceneDescription description;
  calibrate::DirectionTable directions = make_pinhole_directions(48, 40, 60);
  FrameJob job;
  capture::Image plate = capture::make_image(40, 48);
  Environment sky;

  explicit Shot(float transmission = 0) {
    compositing::register_shaders();
    StandardParameters matte;
    matte.roughness = 1;
    matte.specular = 0;
    matte.transmission = transmission;
    description = make_scene(make_sphere(1, 96), matte);
    description.background = "plate";
    description.materials.push_back(compositing::make_stand_in_material("floor", {}));
    auto floor = std::make_shared<Mesh>(*make_square(20, -1));
    floor->materials = {1};
    description.meshes.push_back(floor);
    Instance& instance = description.instances.emplace_back();
    instance.mesh = 1;
    instance.kind = ObjectKind::stand_in;
    instance.blocks_light = false;
    job.cam_from_set = calibrate::look_at({3, -5, 3}, {0, 0, -0.4}, 0);
    for (std::size_t i = 0; i < plate.pixels.size(); ++i) {
      plate.pixels[i] = 0.2F + 0.05F * static_cast<float>(i % 7);
    }
    SunAndSky made;
    made.sun_radius_rad = 0.2F;
    sky = make_sun_and_sky(made, 128);
  }
  capture::Image sampled(int samples, std::uint32_t seed = 1) const {
    const Scene scene(description);
    return render_sampled_light({&scene, &directions, &sky}, job, plate, {samples, seed});
  }
};

double rms(const capture::Image& a, const capture::Image& b) {
  double squares = 0, norm = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    if (i % 4 == 3) continue;
    squares += std::pow(a.pixels[i] - b.pixels[i], 2);
    norm += std::pow(b.pixels[i], 2);
  }
  return std::sqrt(squares / norm);
}

TEST(RenderSampledLight, ComesToWhatTheReferenceShows) {
  const Shot shot;
  const Scene scene(shot.description);
  ReferenceSettings settings;
  settings.samples = 512;
  const capture::Image truth =
      render_reference({&scene, &shot.directions, &shot.sky}, shot.job, shot.plate, settings);
  const capture::Image picture = shot.sampled(4096);
  double squares = 0, norm = 0;
  int judged = 0;
  for (int y = 1; y < truth.height - 1; ++y) {
    for (int x = 1; x < truth.width - 1; ++x) {
      // Whole pixels of one surface: elsewhere the reference averages over the pixel.
      bool whole = true;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          whole = whole && truth.at(y + dy, x + dx, 3) == truth.at(y, x, 3);
        }
      }
      if (!whole) continue;
      ++judged;
      for (int c = 0; c < 3; ++c) {
        squares += std::pow(picture.at(y, x, c) - truth.at(y, x, c), 2);
        norm += std::pow(truth.at(y, x, c), 2);
      }
      EXPECT_EQ(picture.at(y, x, 3), truth.at(y, x, 3)) << x << ", " << y;
    }
  }
  EXPECT_GT(judged, 1200);
  EXPECT_LT(std::sqrt(squares / norm), 0.012);
}

TEST(RenderSampledLight, ErrsLessTheMoreItSamples) {
  const Shot shot;
  const capture::Image truth = shot.sampled(8192, 99);
  double before = 1;
  for (const int samples : {4, 32, 256}) {
    const double error = rms(shot.sampled(samples), truth);
    EXPECT_LT(error, before / 2.5) << samples;
    before = error;
  }
}

TEST(RenderSampledLight, IsRightInTheMeanOfManySeeds) {
  const Shot shot;
  const capture::Image truth = shot.sampled(8192, 99);
  constexpr std::uint32_t seeds = 64;
  capture::Image mean = capture::make_image(truth.height, truth.width, 4);
  for (std::uint32_t seed = 1; seed <= seeds; ++seed) {
    const capture::Image picture = shot.sampled(16, seed);
    for (std::size_t i = 0; i < mean.pixels.size(); ++i)
      mean.pixels[i] += picture.pixels[i] / seeds;
  }
  EXPECT_LT(rms(mean, truth), rms(shot.sampled(16, 1), truth) / 4);
}

TEST(RenderSampledLight, GivesTheSameBitsForTheSameSeedOnly) {
  const Shot shot;
  EXPECT_EQ(shot.sampled(8, 3).pixels, shot.sampled(8, 3).pixels);
  EXPECT_NE(shot.sampled(8, 3).pixels, shot.sampled(8, 4).pixels);
}

TEST(RenderSampledLight, RefusesWhatItCannotShow) {
  const Shot shot;
  EXPECT_THROW(shot.sampled(0), std::invalid_argument);
  EXPECT_THROW(shot.sampled(16385), std::invalid_argument);
  EXPECT_THROW(Shot(0.5F).sampled(4), std::invalid_argument) << "glass";
  Shot blocked;
  blocked.description.instances[1].blocks_light = true;
  EXPECT_THROW(blocked.sampled(4), std::invalid_argument) << "a real thing in the light";
  Shot small;
  small.plate = capture::make_image(8, 8);
  EXPECT_THROW(small.sampled(4), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::sampled_light_test
