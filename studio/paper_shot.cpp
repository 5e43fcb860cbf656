// The papers' scenes as shots to measure with.
#include "studio/paper_shot.h"

#include <chrono>
#include <cmath>

#include "render/paper_scenes.h"

namespace studio {

PaperShot make_paper_shot(std::string_view name, int width, int height) {
  const render::PaperScene paper = render::made_paper_scene(name);
  PaperShot made;
  BenchScene& shot = made.shot;
  const auto start = std::chrono::steady_clock::now();
  shot.scene = std::make_unique<render::Scene>(paper.scene);
  made.compile_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const double focal_px = 0.5 * width / std::tan(0.5 * paper.horizontal_view_rad);
  shot.directions = calibrate::make_direction_table(
      {"pinhole", width, height, {focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0}});
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
