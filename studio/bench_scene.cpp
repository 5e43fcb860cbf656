// The scene of charts and benchmarks.
#include "studio/bench_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "compositing/stand_in.h"
#include "render/made_car.h"
#include "render/standard.h"

namespace studio {
namespace {

using render::Vec3f;

constexpr float matte_albedo = 0.5F;

render::Material make_matte() {
  render::StandardParameters parameters;
  std::fill_n(parameters.base_color, 3, matte_albedo);
  parameters.roughness = 1;
  parameters.specular = 0;
  return render::make_standard_material("matte", parameters);
}

render::SceneDescription describe(BenchFinish finish) {
  render::SceneDescription scene = render::made_car();
  if (finish == BenchFinish::matte) std::ranges::fill(scene.materials, make_matte());
  scene.background = "plate";
  const auto floor_material = static_cast<std::uint32_t>(scene.materials.size());
  scene.materials.push_back(compositing::make_stand_in_material("floor", {}));
  auto floor = std::make_shared<render::Mesh>();
  constexpr float side = 30;
  floor->positions = {{-side, -side, 0}, {side, -side, 0}, {side, side, 0}, {-side, side, 0}};
  floor->triangles = {{0, 1, 2}, {0, 2, 3}};
  floor->materials = {floor_material};
  render::Instance instance;
  instance.name = "floor";
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size());
  instance.kind = render::ObjectKind::stand_in;
  instance.blocks_light = false;
  scene.meshes.push_back(std::move(floor));
  scene.instances.push_back(instance);
  return scene;
}

// Grey asphalt with grain: what lies under the shadow must be seen through it.
capture::Image make_plate(int width, int height) {
  capture::Image plate = capture::make_image(height, width, 3);
  std::mt19937 random(7);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float grain = static_cast<float>(random() & 1023) / 1023 - 0.5F;
      const float grey = 0.28F + 0.06F * grain;
      plate.at(y, x, 0) = grey;
      plate.at(y, x, 1) = grey * 0.99F;
      plate.at(y, x, 2) = grey * 0.96F;
    }
  }
  return plate;
}

// Puts the sun's power into a disc of another size.
void replace_sun(capture::Image& sun, Vec3f direction, float radius_rad) {
  const int width = sun.width, height = sun.height;
  std::array<double, 3> power{};
  double inside = 0;
  const float least = std::cos(radius_rad);
  const auto solid_angle = [&](int y) {
    const double theta = std::numbers::pi * (y + 0.5) / height;
    return std::sin(theta) * (std::numbers::pi / height) * (2 * std::numbers::pi / width);
  };
  const auto is_inside = [&](int y, int x) {
    return dot(render::direction_of_texel(static_cast<float>(x), static_cast<float>(y), width,
                                          height),
               direction) >= least;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        power[c] += sun.at(y, x, static_cast<int>(c)) * solid_angle(y);
      }
      if (is_inside(y, x)) inside += solid_angle(y);
    }
  }
  if (inside <= 0) return;  // smaller than a texel: the map's own sun is as small as it gets
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        sun.at(y, x, static_cast<int>(c)) =
            is_inside(y, x) ? static_cast<float>(power[c] / inside) : 0.0F;
      }
    }
  }
}

float upward_luminance(const render::Environment& environment) {
  const Vec3f e = render::irradiance_of(environment, {0, 0, 1});
  return render::luminance(e.x, e.y, e.z);
}

}  // namespace

render::Environment make_bench_sky(const BenchSky& wanted) {
  static const render::MadeSky made =
      render::make_sky({.height = 256, .sun_azimuth_rad = -0.9F, .sun_elevation_rad = 0.75F});
  render::MadeSky sky = made;
  if (wanted.sun_radius_rad > 0) replace_sun(sky.sun, sky.sun_direction, wanted.sun_radius_rad);
  render::Environment environment;
  environment.radiance = sky.rest;
  std::vector<float>& pixels = environment.radiance.pixels;
  const auto add_sun = [&](float strength) {
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] += strength * sky.sun.pixels[i];
  };
  add_sun(1);
  const float clear_day = upward_luminance(environment);
  add_sun(wanted.sun_to_sky - 1);
  const float exposure = wanted.exposure_locked ? 1 : clear_day / upward_luminance(environment);
  std::mt19937 random(wanted.noise_seed);
  std::normal_distribution<float> normal(1, wanted.noise);
  for (float& value : pixels) {
    value *= exposure;
    if (wanted.noise > 0) value *= std::max(0.0F, normal(random));
  }
  render::smooth_for_reflections(environment);
  return environment;
}

BenchLight follow_bench_sky(render::LightFollower& follower,
                            const render::Environment& sky,
                            const render::LightTableSettings& settings) {
  BenchLight light{follower.follow(sky, {.table = settings}), {}};
  light.environment.radiance = sky.radiance;
  render::smooth_for_reflections(light.environment, follower.compact_texels());
  return light;
}

BenchScene make_bench_scene(int width, int height, BenchFinish finish) {
  if (width < 16 || height < 16) throw std::invalid_argument("a bench picture needs 16x16 pixels");
  compositing::register_shaders();
  BenchScene shot;
  shot.scene = std::make_unique<render::Scene>(describe(finish));
  const double focal_px = width * 1.32;
  shot.lens = {
      "pinhole", width, height, {focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0}};
  shot.directions = calibrate::make_direction_table(shot.lens);
  shot.environment = make_bench_sky({});
  shot.plate = make_plate(width, height);
  shot.half_plate = capture::to_half(shot.plate);
  shot.plate = capture::to_float(shot.half_plate);
  shot.job.cam_from_set = calibrate::look_at({4.9, -4.6, 2.1}, {0.05, 0, 0.45}, 0);
  shot.job.effort.accuracy = 0.99F;
  return shot;
}

void drift(render::FrameJob& job) {
  const auto strengthen = [](render::Vec3f& strength, render::Vec3f& planned) {
    if (planned == render::Vec3f{}) planned = strength;
    strength *= 1.0001F;
  };
  for (render::DirectionalLight& l : job.lights.lights) strengthen(l.irradiance, l.planned);
  for (render::LocalLight& l : job.lights.lamps) strengthen(l.intensity, l.planned);
}

}  // namespace studio
