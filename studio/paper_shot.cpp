// The papers' scenes as shots to measure with.
#include "studio/paper_shot.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "render/area_light.h"
#include "render/standard.h"
#include "render/texture.h"

namespace studio {

namespace {

// Radiance of the white of a screen that lights its room, where 1 is the display's.
constexpr float screen_white = 3;
// Share of the directions around that shows what walls send back of it.
constexpr float from_walls = 0.1F;

// Makes the picture on an object a video that lights its surroundings, by 5x5 lamps as the paper
// has it, or as many as given. Returns the lamps of its one frame.
std::vector<render::LocalLight> light_by(const std::string& object,
                                         std::array<int, 2> lamps,
                                         render::SceneDescription& scene,
                                         render::VideoTexture& video) {
  const auto instance = std::ranges::find(scene.instances, object, &render::Instance::name);
  const auto index = static_cast<std::uint32_t>(instance - scene.instances.begin());
  const std::uint32_t material = scene.meshes[instance->mesh]->materials[0];
  render::Material& screen = scene.materials[material];
  render::StandardParameters p = standard_parameters(screen, scene.textures.size());
  const render::Texture& picture = *scene.textures[static_cast<std::size_t>(p.emission_texture)];
  capture::Image frame = capture::make_image(picture.height, picture.width, 3);
  const auto w = static_cast<float>(frame.width), h = static_cast<float>(frame.height);
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      const auto texel = sample(picture, (static_cast<float>(x) + 0.5F) / w,
                                (static_cast<float>(y) + 0.5F) / h, {});
      std::copy_n(texel.begin(), 3, &frame.at(y, x));
    }
  }
  video = render::make_video_texture(frame);
  scene.videos = {"screen"};
  p.emission_texture = -1;
  p.emission_video = 0;
  p.emission_gain = screen_white;
  screen = make_standard_material(screen.name, p);
  const render::AreaLight light = sample_area_light(scene, index, material, lamps);
  return lamps_of(light, video, {{screen_white, screen_white, screen_white}, from_walls});
}

}  // namespace

PaperShot make_paper_shot(std::string_view name, int width, int height) {
  return make_paper_shot(render::made_paper_scene(name), width, height);
}

PaperShot make_paper_shot(render::PaperScene paper,
                          int width,
                          int height,
                          std::array<int, 2> screen_lamps) {
  PaperShot made;
  BenchScene& shot = made.shot;
  if (!paper.lit_by.empty()) {
    auto video = std::make_unique<render::VideoTexture>();
    paper.lamps = light_by(paper.lit_by, screen_lamps, paper.scene, *video);
    shot.video = std::move(video);
    shot.videos = {shot.video.get()};
  }
  const auto start = std::chrono::steady_clock::now();
  shot.scene = std::make_unique<render::Scene>(paper.scene);
  made.compile_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const double focal_px = 0.5 * width / std::tan(0.5 * paper.horizontal_view_rad);
  shot.lens = {
      "pinhole", width, height, {focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0}};
  shot.directions = calibrate::make_direction_table(shot.lens);
  render::LightFollower follower;
  BenchLight light =
      follow_bench_sky(follower, paper.environment, {.count = render::Effort{}.light_samples});
  shot.environment = std::move(light.environment);
  shot.plate = capture::make_image(height, width, 3);
  shot.half_plate = capture::to_half(shot.plate);
  shot.job.cam_from_set = paper.cam_from_set;
  shot.job.lights = std::move(light.table);
  shot.job.lights.lamps = paper.lamps;
  return made;
}

}  // namespace studio
