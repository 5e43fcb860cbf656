// The sun through a ball of glass, against rays through an exact one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/compositing/made_glass.h"
#include "tests/render/plain_shapes.h"
#include "tests/render/sun_and_sky.h"

namespace compositing::sun_through_glass_test {
namespace {

using render::Vec3f;

constexpr float glass_index = 1.5F;
constexpr int size = 32;

// Radiance along a ray that passes the unit ball or meets it: mirrored, straight through, and
// mirrored inside until it is too weak.
float exact(const render::Environment& env, Vec3f from, Vec3f direction) {
  const auto sees = [&](Vec3f d) { return radiance_of(env, d, 0).y; };
  const float along = dot(from, direction);
  const float inside = along * along - dot(from, from) + 1;
  if (inside <= 0) return sees(direction);
  Vec3f p = from + direction * (-along - std::sqrt(inside));
  const float share = render::fresnel(-dot(p, direction), 1 / glass_index);
  float sum = share * sees(render::mirrored(-direction, p));
  float weight = 1 - share;
  Vec3f d = render::refracted(direction, p, 1 / glass_index);
  while (weight > 1e-4F) {
    p = normalize(p - d * (2 * dot(p, d)));
    sum += weight * (1 - share) * sees(render::refracted(d, -p, glass_index));
    weight *= share;
    d = normalize(render::mirrored(-d, -p));
  }
  return sum;
}

capture::Image exact_picture(const GlassShot& shot, int steps) {
  capture::Image picture = capture::make_image(size, size, 1);
  const calibrate::Pose set_from_cam = inverse(shot.job.cam_from_set);
  const Vec3f from = calibrate::to_float(set_from_cam.t);
  const std::vector<double>& lens = shot.lens.parameters;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      double sum = 0;
      for (int i = 0; i < steps * steps; ++i) {
        const double dx = (i % steps + 0.5) / steps - 0.5, dy = (i / steps + 0.5) / steps - 0.5;
        const calibrate::Vec3 v{(x + dx - lens[2]) / lens[0], (y + dy - lens[3]) / lens[1], 1};
        sum += exact(shot.environment, from, normalize(calibrate::to_float(set_from_cam.R * v)));
      }
      picture.at(y, x, 0) = static_cast<float>(sum / (steps * steps));
    }
  }
  return picture;
}

// At its rim a ball shows half of the sky in a few pixels: cones that are wide, and sharply bent.
TEST(SunThroughGlass, ShowsInABallOnlyWhereItIs) {
  GlassShot shot = glass_shot(bodies({render::make_sphere(1, 384)}, {{.index = glass_index}}),
                              [](Vec3f) { return 1.0F; }, size, 0.95 * size, {0, -2.4, 0.8});
  shot.job.effort = {};
  constexpr int suns = 24, step = PLATELIGHT_FULL_TESTS ? 1 : 7;
  for (int k = 0; k < suns; k += step) {
    // Behind the camera, where it is not seen beside the ball.
    const float turn = static_cast<float>(k) / static_cast<float>(suns - 1) - 0.5F;
    const render::SunAndSky sky{.sun_radius_rad = 0.02F,
                                .sun_azimuth_rad = -1.57F + 3 * turn,
                                .sun_elevation_rad = k % 2 == 0 ? 0.73F : 0.3F,
                                .clouds = 0};
    shot.environment = render::make_sun_and_sky(sky, 256);
    render::smooth_for_reflections(shot.environment);
    const capture::Image truth = exact_picture(shot, 48);
    const capture::Image kernel = shot.kernel();
    double squares = 0, errors = 0, worst = 0, brightest = 0;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double shown = std::min<double>(truth.at(y, x, 0), 4);
        const double error = std::min<double>(kernel.at(y, x, 1), 4) - shown;
        squares += shown * shown;
        errors += error * error;
        worst = std::max(worst, std::abs(error));
        brightest = std::max<double>(brightest, kernel.at(y, x, 1));
      }
    }
    EXPECT_LT(std::sqrt(errors / squares), 0.08) << sky.sun_azimuth_rad;
    EXPECT_LT(worst, 0.8) << sky.sun_azimuth_rad;
    EXPECT_LT(brightest, 1.1 * *std::ranges::max_element(truth.pixels)) << sky.sun_azimuth_rad;
  }
}

}  // namespace
}  // namespace compositing::sun_through_glass_test
