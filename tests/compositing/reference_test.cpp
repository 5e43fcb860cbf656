// The reference's composites: stand-ins, plate, glass.
#include "render/reference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../render/plain_shapes.h"
#include "../render/sun_and_sky.h"
#include "calibrate/angles.h"
#include "compositing/stand_in.h"

namespace compositing::reference_test {
namespace {

using namespace render;  // the reference is render's; only its stand-ins need this folder

using calibrate::pi_f;

// A floor of the real world under a camera that looks straight down from 10 m: pixels of 0.1 m.
struct Floor {
  int size;
  SceneDescription description;
  calibrate::DirectionTable directions;
  FrameJob job;
  capture::Image plate;

  explicit Floor(int picture_size, const StandInParameters& parameters = {})
      : size(picture_size),
        directions(make_pinhole_directions(size, size, 100)),
        plate(capture::make_image(size, size)) {
    compositing::register_shaders();
    description.background = "plate";
    description.materials = {make_standard_material("virtual", {}),
                             compositing::make_stand_in_material("floor", parameters)};
    auto floor = std::make_shared<Mesh>(*make_square(20));
    floor->materials = {1};
    add(floor, ObjectKind::stand_in);
    job.cam_from_set = calibrate::look_at({0, 0, 10}, {0, 0, 0}, 0);
    for (std::size_t i = 0; i < plate.pixels.size(); ++i)
      plate.pixels[i] = 0.1F + 0.05F * static_cast<float>(i % 13);
  }
  void add(std::shared_ptr<const Mesh> mesh, ObjectKind kind = ObjectKind::virtual_object) {
    description.meshes.push_back(std::move(mesh));
    Instance& instance = description.instances.emplace_back();
    instance.mesh = static_cast<std::uint32_t>(description.meshes.size() - 1);
    instance.kind = kind;
    instance.blocks_light = false;
  }
  capture::Image render(const Environment& environment, int samples) const {
    const Scene scene(description);
    ReferenceSettings settings;
    settings.samples = samples;
    return render_reference({&scene, &directions, &environment}, job, plate, settings);
  }
  // Pixel (column, row) of a point on the floor: x to the right, y up in the picture.
  std::array<int, 2> pixel_of(float x, float y) const {
    const float centre = static_cast<float>(size - 1) / 2;
    return {static_cast<int>(std::lround(centre + 10 * x)),
            static_cast<int>(std::lround(centre - 10 * y))};
  }
  float middle(const capture::Image& picture, int c) const {
    return picture.at(size / 2, size / 2, c);
  }
  float ratio(const capture::Image& picture, float x, float y, int c = 1) const {
    const auto [column, row] = pixel_of(x, y);
    return picture.at(row, column, c) / plate.at(row, column, c);
  }
};

TEST(RenderReference, LeavesThePlateBitForBitWhereNothingVirtualIs) {
  Floor floor(64);
  const Environment sky = make_sun_and_sky({}, 32);
  for (const int samples : {1, 7, 32}) {
    const capture::Image picture = floor.render(sky, samples);
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) {
        for (int c = 0; c < 3; ++c) ASSERT_EQ(picture.at(y, x, c), floor.plate.at(y, x, c));
        ASSERT_EQ(picture.at(y, x, 3), 0);
      }
  }
}

TEST(RenderReference, PutsTheShadowOfABoxWhereTheSunThrowsIt) {
  Floor floor(48);
  floor.add(make_box({-0.5F, -0.5F, 0}, {0.5F, 0.5F, 1}));
  Environment sun = make_even_environment(0, 256);
  // One texel at elevation 45 degrees towards -x: the shadow goes 1 m to +x.
  sun.radiance.at(64, 0, 0) = sun.radiance.at(64, 0, 1) = sun.radiance.at(64, 0, 2) = 1e4F;
  const capture::Image picture = floor.render(sun, 64);
  EXPECT_NEAR(floor.ratio(picture, 1.0F, 0), 0, 1e-6) << "in the shadow";
  EXPECT_NEAR(floor.ratio(picture, 1.35F, 0.35F), 0, 1e-6);
  EXPECT_EQ(floor.ratio(picture, 1.7F, 0), 1) << "beyond it";
  EXPECT_EQ(floor.ratio(picture, 1.0F, 0.7F), 1) << "beside it";
  EXPECT_EQ(floor.ratio(picture, -0.8F, 0), 1) << "on the sun's side";
  EXPECT_EQ(floor.middle(picture, 3), 1) << "the box itself";
}

TEST(RenderReference, TakesTheShareOfTheSkyThatAnObjectHides) {
  // A wide ceiling 1 m above half of the floor hides half of an even sky at its edge.
  Floor floor(3);
  floor.add(make_box({0, -200, 20}, {400, 200, 20.01F}));
  const Environment even = make_even_environment(1, 64);
  const capture::Image picture = floor.render(even, 4096);
  EXPECT_NEAR(floor.ratio(picture, 0, 0), 0.5, 0.01);
}

TEST(RenderReference, LightsTheFloorByAVirtualLampThroughThePlatesOwnAlbedo) {
  Floor floor(3);
  const float plate = floor.middle(floor.plate, 0);
  const Environment even = make_even_environment(1, 64);  // irradiance pi_f
  floor.job.lights.lamps.push_back({{0, 0, 1}, {}, {2, 2, 2}});
  const capture::Image picture = floor.render(even, 256);
  // albedo = pi_f plate / pi_f, out = plate + albedo / pi_f * 2.
  EXPECT_NEAR(floor.middle(picture, 0), plate + plate / pi_f * 2, 0.01 * plate);
  const Environment dark = make_even_environment(0, 8);
  EXPECT_NEAR(floor.middle(floor.render(dark, 64), 0), plate + 0.2F / pi_f * 2, 2e-3)
      << "no light, no albedo: the set's";
}

TEST(RenderReference, MirrorsVirtualObjectsInAMirrorFloorOnly) {
  StandInParameters parameters;
  parameters.catches_reflection = 1;
  parameters.reflectance = 0.5F;
  parameters.catches_shadow = 0;
  Floor floor(40, parameters);
  StandardParameters glow;
  glow.base_color[0] = glow.base_color[1] = glow.base_color[2] = 0;
  glow.emission[1] = 3;
  floor.description.materials[0] = make_standard_material("glowing", glow);
  // High above the camera, seen only in the floor.
  floor.add(make_square(1, 12));
  const Environment even = make_even_environment(0.25F, 16);
  const capture::Image picture = floor.render(even, 16);
  const float f = 0.5F;
  // The square's underside also reflects 4 % of what is below it: the sky's lower half.
  EXPECT_NEAR(floor.middle(picture, 1) - floor.middle(floor.plate, 1),
              f * (3 + 0.04F * 0.25F - 0.25F), 0.01);
  EXPECT_EQ(picture.at(2, 2, 1), floor.plate.at(2, 2, 1)) << "where the mirrored ray meets nothing";
}

TEST(RenderReference, ShowsThePlateThroughThinGlass) {
  Floor floor(3);
  StandardParameters glass;
  glass.transmission = 1;
  glass.roughness = 0;
  floor.description.materials[0] = make_standard_material("glass", glass);
  floor.add(make_square(3, 5));
  const Environment dark = make_even_environment(0, 8);
  const capture::Image picture = floor.render(dark, 1024);
  EXPECT_NEAR(floor.middle(picture, 1) / floor.middle(floor.plate, 1), 0.96, 0.01);
  EXPECT_NEAR(floor.middle(picture, 3), 0.04, 0.01);
}

TEST(RenderReference, HidesVirtualObjectsBehindStandInsUnlessTheyDoNotOcclude) {
  for (const bool occludes : {true, false}) {
    Floor floor(3);
    floor.description.instances[0].occludes = occludes;
    floor.add(make_square(2, -1));
    const Environment even = make_even_environment(1, 16);
    EXPECT_EQ(floor.middle(floor.render(even, 16), 3), occludes ? 0 : 1);
  }
}

}  // namespace
}  // namespace compositing::reference_test
