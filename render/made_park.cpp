// The made park: ground, light and cameras.
#include "render/made_park.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calibrate/angles.h"
#include "render/environment.h"
#include "render/made_scene.h"
#include "render/made_shapes.h"
#include "render/made_surfaces.h"

namespace render {
namespace {

using calibrate::degree;
constexpr capture::Rational walk_rate{25, 1};

// What is brighter than this (in plate radiance) is the sun and the glow about it.
constexpr float brightest_sky = 16;

// Rough ground hides its own glints: hardly any mirrored light leaves it.
constexpr float rough_ground = 0.1F;
constexpr float half_court = court_m / 2;
constexpr float court_middle_y = 1.8F;
constexpr float court_front = court_middle_y - half_court;
constexpr float lawn_reach_m = 70;  // there it is a degree under the horizon
constexpr std::array<float, 3> white{1, 1, 1};

void add_ground(MadeSceneBuilder& park, int texture_size, std::uint32_t seed) {
  const auto asphalt = park.add(make_court_texture(texture_size, seed));
  park.add("court",
           make_rectangle({-half_court, court_front, 0}, {court_m, 0, 0}, {0, court_m, 0}, 0),
           white, 0.85F, asphalt, rough_ground);
  const auto grass = park.add(make_lawn_texture(std::max(texture_size / 2, 1), seed + 1));
  constexpr float tile_m = 7;
  constexpr float wide = 2 * lawn_reach_m;
  constexpr float beside = lawn_reach_m - half_court;
  Mesh lawn = make_rectangle({-lawn_reach_m, court_front + court_m, 0}, {wide, 0, 0},
                             {0, lawn_reach_m, 0}, tile_m);
  append(lawn, make_rectangle({-lawn_reach_m, court_front - lawn_reach_m, 0}, {wide, 0, 0},
                              {0, lawn_reach_m, 0}, tile_m));
  append(lawn,
         make_rectangle({-lawn_reach_m, court_front, 0}, {beside, 0, 0}, {0, court_m, 0}, tile_m));
  append(lawn,
         make_rectangle({half_court, court_front, 0}, {beside, 0, 0}, {0, court_m, 0}, tile_m));
  park.add("lawn", std::move(lawn), white, 0.95F, grass, 0);
}

void add_kerbs(MadeSceneBuilder& park, int texture_size, std::uint32_t seed) {
  const auto concrete = park.add(make_concrete_texture(std::max(texture_size / 8, 1), seed + 2));
  constexpr float gap = 0.008F;
  constexpr float width = 0.16F;
  constexpr float height = 0.09F;
  constexpr float bevel = 0.018F;
  constexpr float tile_m = 1.3F;
  Mesh kerbs;
  for (int i = 0; i < static_cast<int>(court_m); ++i) {
    const float from = static_cast<float>(i);
    append(kerbs, make_box({gap, 0, -0.1F}, {1 - gap, width, height}, bevel, tile_m),
           {-half_court + from, court_front + court_m, 0});
    for (const float side : {-half_court - width, half_court}) {
      append(kerbs, make_box({0, gap, -0.1F}, {width, 1 - gap, height}, bevel, tile_m),
             {side, court_front + from, 0});
    }
  }
  park.add("kerb", std::move(kerbs), white, 0.8F, concrete, rough_ground);

  Mesh posts;
  constexpr std::array<std::array<float, 2>, 4> post{
      {{0.055F, 0}, {0.055F, 0.7F}, {0.04F, 0.74F}, {0, 0.74F}}};
  for (int i = -2; i <= 2; ++i) {
    append(posts, make_lathe(post, 32, 1),
           {2.6F * static_cast<float>(i) + 1.3F, court_front + court_m + 0.6F, 0});
  }
  park.add("bollards", std::move(posts), {0.34F, 0.20F, 0.10F}, 0.6F);
}

// Where the light of a map comes from in the mean; not unit, zero if it is dark.
calibrate::Vec3 direction_of_light(const capture::Image& map) {
  calibrate::Vec3 sum;
  for (int y = 0; y < map.height; ++y) {
    const double size = texel_solid_angle(y, map.width, map.height);
    for (int x = 0; x < map.width; ++x) {
      const Vec3f v =
          direction_of_texel(static_cast<float>(x), static_cast<float>(y), map.width, map.height);
      sum = sum + calibrate::to_double(v) * (size * map.at(y, x, 1));
    }
  }
  return sum;
}

// Splits light by its strength, channel by channel.
MadeSky split_sky(const capture::Image& map, int height) {
  MadeSky sky;
  sky.rest = environment_from_map(map, 0, height).radiance;
  sky.sun = sky.rest;
  for (std::size_t i = 0; i < sky.rest.pixels.size(); ++i) {
    const float value = counted_radiance(sky.rest.pixels[i]) * park_exposure;
    sky.rest.pixels[i] = std::min(value, brightest_sky);
    sky.sun.pixels[i] = value - sky.rest.pixels[i];
  }
  calibrate::Vec3 sun = direction_of_light(sky.sun);
  if (sun == calibrate::Vec3{}) sun = direction_of_light(sky.rest);
  if (sun == calibrate::Vec3{}) throw std::invalid_argument("a park's map must not be dark");
  sky.sun_direction = calibrate::to_float(calibrate::normalize(sun));
  return sky;
}

calibrate::Track pan(const MadeStudioSettings& settings) {
  constexpr calibrate::Vec3 tripod{-1.9, -7.05, 1.6};
  constexpr double lens_m = 0.12;  // before the axis that it turns about
  constexpr double from_deg = 90;  // azimuths that the camera looks to
  constexpr double to_deg = 84;
  constexpr double tilt = 5.5 * degree;  // downwards
  constexpr double roll = 0.6 * degree;
  calibrate::Track track;
  for (int n = 0; n < settings.frames; ++n) {
    const double done = settings.frames > 1 ? n / (settings.frames - 1.0) : 0;
    const double eased = 0.5 - 0.5 * std::cos(std::numbers::pi * done);
    const double azimuth = (from_deg + (to_deg - from_deg) * eased) * degree;
    const calibrate::Vec3 ahead{std::cos(azimuth), std::sin(azimuth), 0};
    const calibrate::Vec3 lens = tripod + ahead * lens_m;
    const calibrate::Pose cam_from_set = calibrate::look_at(
        lens, lens + ahead * std::cos(tilt) + calibrate::Vec3{0, 0, -std::sin(tilt)}, roll);
    track.keys.push_back(
        {n / walk_rate.value(), lens, calibrate::quaternion_of(cam_from_set.R.transposed())});
  }
  return track;
}

MadeCamera make_walking_camera(const MadeStudioSettings& settings) {
  MadeCamera camera;
  const double scale = settings.width / 1280.0;
  camera.lens.model = "LENSMODEL_OPENCV4";
  camera.lens.width = settings.width;
  camera.lens.height = settings.height;
  camera.lens.parameters = {993.4 * scale,
                            994.8 * scale,
                            (settings.width - 1) / 2.0 - 5.3 * scale,
                            (settings.height - 1) / 2.0 + 4.1 * scale,
                            -0.187,
                            0.071,
                            -0.0005,
                            0.0007};
  camera.track = pan(settings);
  camera.cam_from_set = calibrate::pose_at(camera.track, 0).cam_from_set;
  constexpr double exposure_s = 1.0 / 500;
  camera.sensor = {.saturation = exposure_s,  // display white fills the well
                   .full_well_e = 5000,
                   .read_noise_e = 8,
                   .bits = 8,
                   .transfer = capture::Transfer::rec1886,
                   .seed = settings.seed * 2 + 1};
  camera.exposures_s = {exposure_s};
  camera.rate = walk_rate;
  return camera;
}

}  // namespace

MadeStudioSettings park_settings() {
  return {.width = 1280, .height = 720, .probe_size = 512, .frames = 8};
}

MadeStudio make_park(const capture::Image& map, const MadeStudioSettings& settings) {
  check(settings);
  MadeStudio studio;
  studio.settings = settings;
  studio.sky = split_sky(map, settings.sky_height);
  MadeSceneBuilder park;
  add_ground(park, settings.texture_size, settings.seed);
  add_kerbs(park, settings.texture_size, settings.seed);
  studio.place = park.take();
  studio.car_yaw_deg = -24;
  studio.plate = make_walking_camera(settings);
  studio.probe =
      make_fisheye(settings.probe_size, {1.0 / 100, 1.0 / 2500, 1.0 / 62500, 1.0 / 1562500},
                   settings.seed * 2 + 2);
  studio.period = capture::time_of_frame(settings.frames, walk_rate);
  return studio;
}

}  // namespace render
