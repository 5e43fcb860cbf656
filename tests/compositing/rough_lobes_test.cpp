// Rough lobes of broad surfaces, whose pixels take one sample.
#include <gtest/gtest.h>

#include <cmath>

#include "../render/plain_shapes.h"
#include "calibrate/angles.h"
#include "made_shot.h"

namespace compositing::rough_lobes_test {
namespace {

// Of a white metal plane under a sky of 1 over a black ground, seen from that elevation: 1 if lobes
// lost nothing.
double shown(float roughness, double elevation_deg, float glint_contrast = 0.09F) {
  register_shaders();
  render::StandardParameters metal;
  metal.metallic = 1;
  metal.roughness = roughness;
  render::SceneDescription description = render::make_scene(render::make_square(50), metal);
  description.background = "environment";
  const render::Scene scene(description);
  static const render::Environment sky = made_sky(64, 0, 1);
  const auto directions = render::make_pinhole_directions(8, 8, 80);
  const double up = elevation_deg * calibrate::degree;
  render::FrameJob job;
  job.cam_from_set = calibrate::look_at({-2 * std::cos(up), 0, 2 * std::sin(up)}, {0, 0, 0}, 0);
  job.lights = even_lights(64);
  job.effort.glint_contrast = glint_contrast;
  const auto plate = capture::to_half(capture::make_image(8, 8));
  render::FrameResult frame;
  render_frame({&scene, &directions, &sky}, job, plate, frame);
  double sum = 0;
  for (std::size_t i = 0; i < 64; ++i) {
    sum += static_cast<double>(capture::float_from_half(frame.rgba.pixels[4 * i + 1])) / 64;
  }
  return sum;
}

// What of a lobe would go below the surface comes from above it.
TEST(RoughLobes, KeepTheirLightWhereTheGroundIsDark) {
  for (const double elevation_deg : {5.0, 10.0, 20.0, 40.0, 70.0}) {
    EXPECT_NEAR(shown(1, elevation_deg), 1, 0.03) << elevation_deg;
    for (const float roughness : {0.4F, 0.5F, 0.6F, 0.7F, 0.8F, 0.9F}) {
      EXPECT_GT(shown(roughness, elevation_deg), 0.86) << roughness << " " << elevation_deg;
    }
  }
}

// The cones of further samples end at the horizon.
TEST(RoughLobes, KeepTheirLightWherePixelsTakeFurtherSamples) {
  constexpr float any = 1e-9F;
  for (const double elevation_deg : {5.0, 10.0, 20.0, 40.0}) {
    EXPECT_GT(shown(0.3F, elevation_deg, any), 0.97) << elevation_deg;
    EXPECT_GT(shown(0.5F, elevation_deg, any), 0.955) << elevation_deg;
    EXPECT_GT(shown(0.7F, elevation_deg, any), 0.93) << elevation_deg;
  }
}

TEST(RoughLobes, ChangeSmoothlyWithTheirRoughness) {
  for (const double elevation_deg : {10.0, 40.0}) {
    double before = shown(0.15F, elevation_deg);
    for (int i = 16; i <= 60; ++i) {
      const double here = shown(static_cast<float>(i) * 0.01F, elevation_deg);
      EXPECT_LT(std::abs(here - before), 0.02) << i << " " << elevation_deg;
      before = here;
    }
  }
}

}  // namespace
}  // namespace compositing::rough_lobes_test
