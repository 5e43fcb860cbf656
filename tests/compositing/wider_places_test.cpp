// Places in the environment that were joined in wider texels, where nothing showed: under light
// that nobody planned for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/compositing/made_shot.h"

namespace compositing::wider_places_test {
namespace {

// The evenly grey sky that was planned for, and a lamp in it.
render::Environment made_sky_with_lamp(float lamp) {
  render::Environment env = made_sky(128, 0.4F, 0.4F);
  const render::Vec3f to = normalize(render::Vec3f{0.6F, -0.7F, 0.6F});
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 256; ++x) {
      const render::Vec3f d =
          render::direction_of_texel(static_cast<float>(x), static_cast<float>(y), 256, 128);
      if (dot(d, to) < std::cos(0.2F)) continue;
      for (int c = 0; c < 3; ++c) env.radiance.at(y, x, c) = lamp;
    }
  }
  render::smooth_for_reflections(env);
  return env;
}

// Balls of white metal that mirror each other and the sky, more or less sharply.
MadeShot mirroring_balls() {
  render::SceneDescription scene = shot_scene();
  std::size_t i = 0;
  for (const float roughness : {0.05F, 0.3F}) {
    render::StandardParameters metal;
    metal.metallic = 1;
    metal.roughness = roughness;
    scene.materials[++i] = render::make_standard_material("metal", metal);
  }
  MadeShot shot = made_shot(96, 64, std::move(scene));
  shot.job.lights.lights.clear();
  return shot;
}

struct Difference {
  double mean = 0, least_value = 1e9;  // radiance
};

// Between pictures under light that was planned for, and that was not.
Difference difference_of(MadeShot& shot, float lamp) {
  const render::Environment planned = made_sky_with_lamp(0.4F);
  shot.environment = made_sky_with_lamp(lamp);
  render::FrameInputs inputs = shot.inputs();
  render::FrameResult known, unknown;
  render_frame(inputs, shot.job, shot.plate, known);
  inputs.planned = &planned;
  render_frame(inputs, shot.job, shot.plate, unknown);
  Difference d;
  int count = 0;
  for (std::size_t i = 0; i < known.rgba.pixels.size(); i += 4) {
    if (capture::float_from_half(known.rgba.pixels[i + 3]) < 1) continue;
    const double a = capture::float_from_half(known.rgba.pixels[i]),
                 b = capture::float_from_half(unknown.rgba.pixels[i]);
    d.mean += std::abs(a - b);
    d.least_value = std::min(d.least_value, b);
    ++count;
  }
  d.mean /= count;
  return d;
}

TEST(WiderPlaces, ShowALampThatWasNotPlannedForWhereItIs) {
  MadeShot shot = mirroring_balls();
  const Difference d = difference_of(shot, 4);
  EXPECT_LT(d.mean, 0.015);  // .012; without wider places .009
  EXPECT_GE(d.least_value, 0.399) << "some of the sky was lost";
}

}  // namespace
}  // namespace compositing::wider_places_test
