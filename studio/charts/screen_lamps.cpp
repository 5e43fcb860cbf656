// Screens as lamps.
#include "studio/charts/screen_lamps.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "render/area_light.h"
#include "render/pixel_rays.h"
#include "render/standard.h"
#include "studio/charts/matte_shot.h"
#include "studio/paper_shot.h"

namespace studio {
namespace {

using render::Vec3f;

constexpr int many_lamps = 33;    // along a side: what fewer are measured against
constexpr int default_lamps = 5;  // as a set has them if it says nothing else
constexpr float radiance = 3;     // of the screen over the bare floor
constexpr float floor_side_m = 6;

render::Environment make_night() {
  render::Environment night;
  night.radiance = capture::make_image(16, 32, 3);
  render::smooth_for_reflections(night);
  return night;
}

// The corners of an upright screen of 0.91 x 0.7 m that faces -y, its lower edge 0.3 m up.
constexpr std::array<Vec3f, 4> corners{
    {{-0.455F, 0, 0.3F}, {0.455F, 0, 0.3F}, {0.455F, 0, 1.0F}, {-0.455F, 0, 1.0F}}};

render::PaperScene make_bare_floor() {
  render::PaperScene made;
  made.scene.materials = {make_grey_material("floor"), make_grey_material("screen")};
  auto floor = std::make_shared<render::Mesh>();
  floor->positions = {{-floor_side_m, -floor_side_m, 0},
                      {floor_side_m, -floor_side_m, 0},
                      {floor_side_m, 0, 0},
                      {-floor_side_m, 0, 0}};
  floor->triangles = {{0, 1, 2}, {0, 2, 3}};
  floor->materials = {0};
  auto screen = std::make_shared<render::Mesh>();
  screen->positions.assign(corners.begin(), corners.end());
  screen->uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  screen->triangles = {{0, 1, 2}, {0, 2, 3}};
  screen->materials = {1};
  made.scene.meshes = {floor, screen};
  made.scene.instances = {{"floor", 0}, {"screen", 1}};
  made.cam_from_set = calibrate::look_at({0.4, -4, 3.2}, {0, -1.5, 0}, 0);
  made.horizontal_view_rad = 42 * std::numbers::pi / 180;
  made.environment = make_night();
  return made;
}

std::vector<render::LocalLight> lamps_over_the_floor(const render::SceneDescription& scene,
                                                     int across) {
  capture::Image white = capture::make_image(8, 8, 3);
  std::ranges::fill(white.pixels, 1.0F);
  const render::AreaLight light = sample_area_light(scene, 1, 1, {across, across});
  return lamps_of(light, render::make_video_texture(white), {{radiance, radiance, radiance}, 0});
}

// Irradiance of the screen on the floor at a point: Lambert's sum over the edges of a polygon
// ("Photometria", 1760; as in Arvo, "Analytic Methods for Simulated Light Transport", 1995).
double floor_irradiance(Vec3f p) {
  double sum = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3f a = normalize(corners[i] - p), b = normalize(corners[(i + 1) % 4] - p);
    const double angle = std::acos(std::clamp<double>(double{dot(a, b)}, -1, 1));
    sum += angle * double{normalize(cross(a, b)).z};
  }
  return double{radiance} / 2 * std::abs(sum);
}

// What the floor shows, through the pixels' centres, and where it is seen.
Truth floor_truth(const BenchScene& shot) {
  Truth truth;
  const int width = shot.plate.width, height = shot.plate.height;
  truth.mask = capture::make_image(height, width, 1);
  capture::Image picture = capture::make_image(height, width, 4);
  const render::PixelRays rays(shot.directions, shot.job.cam_from_set);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto direction = rays.direction(x, y, 0, 0);
      if (!direction || !(direction->z < 0)) continue;
      const Vec3f p = rays.origin() + *direction * (rays.origin().z / -direction->z);
      if (!(std::abs(p.x) < 0.99F * floor_side_m && p.y < -0.02F && p.y > -0.99F * floor_side_m)) {
        continue;
      }
      truth.mask.at(y, x) = 1;
      const double shown = double{grey_albedo} / std::numbers::pi * floor_irradiance(p);
      for (int c = 0; c < 3; ++c) picture.at(y, x, c) = static_cast<float>(shown);
    }
  }
  truth.references = {picture, picture};
  return truth;
}

struct Timed {
  capture::Image picture;
  double moving_ms = 0, still_ms = 0;
};

Timed render(const BenchScene& shot, const Visibility& visibility, int runs) {
  render::FrameJob job = shot.job;
  job.effort.aa_samples = 1;
  job.effort.aa_tolerance = job.effort.glint_contrast = 0;
  visibility.set_in(job.effort);
  render::FrameInputs inputs = shot.inputs();
  render::FrameResult result;
  const auto frame_ms = [&] {
    const auto start = std::chrono::steady_clock::now();
    render_frame(inputs, job, shot.half_plate, result);
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    return taken.count();
  };
  Timed timed;
  timed.moving_ms = frame_ms();
  for (int i = 1; i < runs; ++i) timed.moving_ms = std::min(timed.moving_ms, frame_ms());
  timed.picture = capture::to_float(result.rgba);
  render::KeptTransport kept;
  inputs.kept = &kept;
  frame_ms();
  // A video that runs: cells are lit anew, not shown again.
  const auto still_ms = [&] {
    drift(job);
    return frame_ms();
  };
  timed.still_ms = still_ms();
  for (int i = 1; i < runs; ++i) timed.still_ms = std::min(timed.still_ms, still_ms());
  return timed;
}

ChartPoint point_of(const std::string& scene,
                    int across,
                    const Visibility& visibility,
                    const Timed& timed,
                    const Truth& truth) {
  ChartPoint point;
  point.scene = scene;
  point.method = "lamps on a screen";
  point.variant = visibility.name;
  point.settings = {{"lamps", static_cast<double>(across * across)},
                    {"visibility", std::string(visibility.name)}};
  point.by_default = across == default_lamps && visibility.adaptive;
  point.label = fmt::format("{0}x{0}{1}", across, point.by_default ? ": default" : "");
  const render::PictureError error = error_of(timed.picture, truth);
  point.time_ms = timed.moving_ms;
  point.error = error.relative_rms;
  point.error_p99 = error.p99;
  point.figures = {{"still_ms", timed.still_ms}};
  return point;
}

render::PaperScene make_grey_room() {
  render::PaperScene room = render::made_paper_scene("tv_room_lit");
  for (render::Material& material : room.scene.materials) {
    if (material.name != "screen") material = make_grey_material(material.name);
  }
  room.environment = make_night();
  return room;
}

}  // namespace

void add_screen_lamps(bool quick, Chart& chart) {
  const int width = quick ? 80 : 320, height = quick ? 60 : 240;
  const int runs = quick ? 1 : 3;
  const std::vector<int> sides = quick ? std::vector{1, 5} : std::vector{1, 2, 3, 4, 5, 6, 7, 8, 9};
  BenchScene floor = make_paper_shot(make_bare_floor(), width, height).shot;
  const Truth of_floor = floor_truth(floor);
  for (const int across : sides) {
    floor.job.lights.lamps = lamps_over_the_floor(floor.scene->description(), across);
    chart.points.push_back(point_of("screen over a bare floor, against the closed form", across,
                                    adaptive_grid, render(floor, adaptive_grid, runs), of_floor));
  }
  const render::PaperScene room = make_grey_room();
  // Without what walls send back, which takes no lamp.
  const auto room_of = [&](int across) {
    BenchScene shot = make_paper_shot(room, width, height, {across, across}).shot;
    std::erase_if(shot.job.lights.lamps, [](const auto& lamp) { return lamp.ambient != 0; });
    return shot;
  };
  const BenchScene many = room_of(many_lamps);
  Truth of_room;
  of_room.references[0] = of_room.references[1] = render(many, every_pixel, 1).picture;
  // What shines itself does so whatever the lamps.
  BenchScene none = room_of(1);
  none.job.lights.lamps.clear();
  const capture::Image shining = render(none, every_pixel, 1).picture;
  of_room.mask = capture::make_image(height, width, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      of_room.mask.at(y, x) = shining.at(y, x, 1) == 0 ? 1.0F : 0.0F;
    }
  }
  const std::string name =
      fmt::format("grey TV room lit by its TV, against {0}x{0} lamps", many_lamps);
  for (const Visibility& visibility : {every_pixel, adaptive_grid}) {
    for (const int across : sides) {
      chart.points.push_back(
          point_of(name, across, visibility, render(room_of(across), visibility, runs), of_room));
    }
  }
}

}  // namespace studio
