// Shadows of a ball under lamps of known size, against the overlap of two discs on the sphere: the
// reference and the kernel, on a matte floor and on a stand-in that catches shadows.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "made_shot.h"
#include "render/light_follower.h"
#include "render/reference.h"
#include "tests/render/plain_shapes.h"
#include "tests/render/sun_and_sky.h"

namespace compositing::penumbra_test {
namespace {

using calibrate::Vec3;
using render::Vec3f;

using std::numbers::pi;

// A round lamp far away, as rings of a map about its middle: radiance by angle, in double.
struct Lamp {
  Vec3 middle;        // unit
  double radius = 0;  // nothing glows beyond, radians
  std::function<double(double)> radiance;
};

// The share of the lamp's irradiance on a floor that faces up which a ball leaves there. For every
// ring of the lamp, the part of its turn that the ball's disc covers is an arc, or none, or all.
double open_share(const Lamp& lamp, Vec3 point, Vec3 ball, double ball_radius) {
  const Vec3 to_ball = ball - point;
  const double cap = std::asin(ball_radius / length(to_ball));
  const Vec3 c = normalize(to_ball);
  const Vec3 side = std::abs(lamp.middle.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
  const Vec3 x = normalize(cross(side, lamp.middle)), y = cross(lamp.middle, x);
  const double along = dot(c, lamp.middle), across = std::hypot(dot(c, x), dot(c, y));
  const double towards = std::atan2(dot(c, y), dot(c, x));
  double open = 0, all = 0;
  constexpr int rings = 1500;
  for (int j = 0; j < rings; ++j) {
    const double angle = lamp.radius * (j + 0.5) / rings;
    const double weight = lamp.radiance(angle) * std::sin(angle);
    // Covered: |turn - towards| < half.
    const double reach =
        across > 0 ? (std::cos(cap) - std::cos(angle) * along) / (std::sin(angle) * across)
                   : (std::cos(angle) * along > std::cos(cap) ? -2 : 2);
    const double half = std::acos(std::clamp(reach, -1.0, 1.0));
    // The cosine to the floor's normal, integrated over the turn and over the arc.
    const double level = std::cos(angle) * lamp.middle.z;
    const double slope = std::sin(angle) * std::hypot(x.z, y.z);
    const double highest = std::atan2(y.z, x.z);
    const double whole = 2 * pi * level;
    const double arc = 2 * half * level + 2 * slope * std::sin(half) * std::cos(towards - highest);
    all += weight * whole;
    open += weight * (whole - arc);
  }
  return open / all;
}

// A round lamp in a map, and the same as a function of the angle.
struct MadeLamp {
  render::Environment environment;
  Lamp lamp;
};

// Straight above: rows of the map, between which look-ups are linear.
MadeLamp lamp_above(int height, int rows) {
  MadeLamp made{render::make_even_environment(0, height), {}};
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < 2 * height; ++x) {
      for (int c = 0; c < 3; ++c) made.environment.radiance.at(y, x, c) = 10;
    }
  }
  const double texel = pi / height;
  made.lamp = {{0, 0, 1}, (rows + 0.5) * texel, [=](double angle) {
                 return std::clamp(rows + 0.5 - angle / texel, 0.0, 1.0);
               }};
  return made;
}

// A row of pixels of 4 cm along x, on a floor z = 0 under a camera that looks straight down from
// beneath the ball.
constexpr int columns = 61;
constexpr double step_m = 0.04, ball_radius = 0.5;
constexpr Vec3 ball{0, 0, 4};

double x_of(int column, double middle) { return middle + (column - (columns - 1) / 2) * step_m; }

struct Shot {
  std::unique_ptr<render::Scene> scene;
  calibrate::DirectionTable directions = render::make_pinhole_directions(columns, 1, 2 / step_m);
  render::FrameJob job;
  capture::HalfImage plate;
  bool stand_in;

  Shot(bool on_stand_in, double middle) : stand_in(on_stand_in) {
    register_shaders();
    render::StandardParameters matte;
    matte.roughness = 1;
    matte.specular = 0;
    render::SceneDescription s = render::make_scene(render::make_sphere(ball_radius, 128), matte);
    s.instances[0].set_from_object[11] = static_cast<float>(ball.z);
    s.background = "plate";
    s.materials.push_back(make_stand_in_material("floor", {}));
    s.meshes.push_back(made_floor(20, stand_in ? 1 : 0));
    render::Instance& floor = s.instances.emplace_back();
    floor.mesh = 1;
    if (stand_in) {
      floor.kind = render::ObjectKind::stand_in;
      floor.blocks_light = false;
    }
    scene = std::make_unique<render::Scene>(std::move(s));
    job.cam_from_set = calibrate::look_at({middle, 0, 2}, {middle, 0, 0}, 0);
    capture::Image grey = capture::make_image(1, columns);
    std::ranges::fill(grey.pixels, 0.5F);
    plate = capture::to_half(grey);
  }
  // What is left of the light at every column.
  std::vector<double> shares(const capture::Image& picture, double irradiance) const {
    std::vector<double> result;
    for (int x = 0; x < columns; ++x) {
      const double value = picture.at(0, x, 1);
      result.push_back(stand_in ? value / 0.5 : value * pi / irradiance);
    }
    return result;
  }
};

struct Errors {
  double most = 0, rms = 0;
};
Errors errors_of(const std::vector<double>& shares, const MadeLamp& made, double middle) {
  Errors errors;
  bool dark = false, half = false, open = false;
  for (int x = 0; x < columns; ++x) {
    const double truth = open_share(made.lamp, {x_of(x, middle), 0, 0}, ball, ball_radius);
    const double off = std::abs(shares[static_cast<std::size_t>(x)] - truth);
    errors.most = std::max(errors.most, off);
    errors.rms += off * off / columns;
    dark = dark || truth < 0.5;
    half = half || (truth > 0.3 && truth < 0.7);
    open = open || truth > 0.99;
  }
  EXPECT_TRUE(dark && half && open) << "the row must cross the whole penumbra";
  errors.rms = std::sqrt(errors.rms);
  return errors;
}

// Lamps smaller and larger than the ball: with an umbra, and without.
const std::vector<int> lamp_rows{4, 8, 14};

TEST(Penumbra, IsWhatTheOverlapOfTwoDiscsSaysInTheReference) {
  for (const int rows : lamp_rows) {
    const MadeLamp made = lamp_above(256, rows);
    const double irradiance = render::irradiance_of(made.environment, {0, 0, 1}).y;
    for (const bool stand_in : {false, true}) {
      const Shot shot(stand_in, 0);
      const render::FrameInputs inputs{shot.scene.get(), &shot.directions, &made.environment};
      const capture::Image picture =
          render_reference(inputs, shot.job, capture::to_float(shot.plate), {.samples = 4096});
      const Errors errors = errors_of(shot.shares(picture, irradiance), made, 0);
      EXPECT_LT(errors.most, 0.01) << rows << " rows, stand-in " << stand_in;
    }
  }
}

TEST(Penumbra, IsWhatTheOverlapOfTwoDiscsSaysInTheKernel) {
  for (const int rows : lamp_rows) {
    MadeLamp made = lamp_above(256, rows);
    const double irradiance = render::irradiance_of(made.environment, {0, 0, 1}).y;
    render::smooth_for_reflections(made.environment);
    for (const bool stand_in : {false, true}) {
      Shot shot(stand_in, 0);
      shot.job.lights = make_light_table(made.environment, {.count = 1024});
      shot.job.effort.adaptive_visibility = false;
      shot.job.effort.accuracy = 0.999F;
      shot.job.effort.aa_tolerance = 0.01F;
      shot.job.effort.glint_contrast = 0.005F;
      render::FrameResult result;
      render_frame({shot.scene.get(), &shot.directions, &made.environment}, shot.job, shot.plate,
                   result);
      const Errors errors =
          errors_of(shot.shares(capture::to_float(result.rgba), irradiance), made, 0);
      EXPECT_LT(errors.rms, 0.01) << rows << " rows, stand-in " << stand_in;
      // In shadows of what is near each pixel goes by its own direction into a light, off the
      // middle.
      EXPECT_LT(errors.most, 0.025) << rows << " rows, stand-in " << stand_in;
    }
  }
}

// A low lamp, by the map's own light between its texels.
TEST(Penumbra, FallsAsideOfALowLampInTheReference) {
  constexpr int height = 256;
  constexpr double elevation = 0.9, radius = 0.08;
  // Towards -x, so that the shadow lies towards +x.
  const Vec3 middle{-std::cos(elevation), 0, std::sin(elevation)};
  MadeLamp made{render::make_even_environment(0, height), {}};
  const double texel = pi / height;
  const auto radiance = [=](double angle) {
    return std::clamp((radius - angle) / (2 * texel) + 0.5, 0.0, 1.0);
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < 2 * height; ++x) {
      const Vec3f d = render::direction_of_texel(static_cast<float>(x), static_cast<float>(y),
                                                 2 * height, height);
      const double angle = std::acos(std::clamp(dot(to_double(d), middle), -1.0, 1.0));
      for (int c = 0; c < 3; ++c)
        made.environment.radiance.at(y, x, c) = static_cast<float>(10 * radiance(angle));
    }
  }
  // A soft edge two texels wide, which look-ups between texels blur by less than a third of one.
  made.lamp = {middle, radius + 2 * texel, radiance};
  const double shadow = ball.z / std::tan(elevation);
  const Shot shot(true, shadow);
  const render::FrameInputs inputs{shot.scene.get(), &shot.directions, &made.environment};
  const capture::Image picture =
      render_reference(inputs, shot.job, capture::to_float(shot.plate), {.samples = 4096});
  EXPECT_LT(errors_of(shot.shares(picture, 1), made, shadow).most, 0.01);
}

// A glowing ball near by: no map, but paths that meet it.
TEST(Penumbra, IsWhatTheOverlapSaysUnderAGlowingBall) {
  constexpr double lamp_radius = 0.35;
  constexpr Vec3 lamp_at{0, 0, 2.4}, small_ball{0, 0, 1};
  constexpr double small_radius = 0.3;
  render::StandardParameters matte, glow;
  matte.roughness = 1;
  matte.specular = 0;
  glow = matte;
  std::fill_n(glow.base_color, 3, 0.0F);
  glow.emission[0] = glow.emission[1] = glow.emission[2] = 10;
  auto black = glow;
  std::fill_n(black.emission, 3, 0.0F);
  render::SceneDescription s = render::make_scene(render::make_square(5), matte);
  const auto add = [&](double radius, Vec3 at, const render::StandardParameters& p) {
    auto mesh =
        std::make_shared<render::Mesh>(*render::make_sphere(static_cast<float>(radius), 64));
    mesh->materials = {static_cast<std::uint32_t>(s.materials.size())};
    s.materials.push_back(render::make_standard_material("ball", p));
    s.meshes.push_back(mesh);
    render::Instance& instance = s.instances.emplace_back();
    instance.mesh = static_cast<std::uint32_t>(s.meshes.size() - 1);
    instance.set_from_object[11] = static_cast<float>(at.z);
  };
  add(lamp_radius, lamp_at, glow);
  add(small_radius, small_ball, black);
  const render::Scene scene(s);
  const render::Environment dark = render::make_even_environment(0, 8);
  const auto directions = render::make_pinhole_directions(1, 1, 8000);
  for (double x = 0.25; x < 1; x += 0.1) {
    const Vec3 to_lamp = lamp_at - Vec3{x, 0, 0};
    const double distance = length(to_lamp);
    const Lamp lamp{normalize(to_lamp), std::asin(lamp_radius / distance),
                    [](double) { return 1.0; }};
    const double full = pi * 10 * std::pow(lamp_radius / distance, 2) * lamp.middle.z;
    const calibrate::Pose pose = calibrate::look_at({x + 0.5, -1, 0.4}, {x, 0, 0}, 0);
    const double seen =
        pi * render::photograph({.scene = &scene, .directions = &directions, .environment = &dark},
                                pose, {.samples = 1 << 16})
                 .at(0, 0, 1);
    EXPECT_NEAR(seen / full, open_share(lamp, {x, 0, 0}, small_ball, small_radius), 0.01) << x;
  }
}

}  // namespace
}  // namespace compositing::penumbra_test
