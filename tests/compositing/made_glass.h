// Bodies of glass before a made environment.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "render/glass.h"
#include "render/reference.h"
#include "tests/compositing/made_shot.h"

namespace compositing {

// A body of glass in the middle, before an environment of a radiance by direction.
struct GlassShot {
  std::unique_ptr<render::Scene> scene;
  calibrate::Lens lens;
  calibrate::DirectionTable directions;
  render::Environment environment;
  render::FrameJob job;
  capture::HalfImage plate;

  render::FrameInputs inputs() const {
    return {.scene = scene.get(),
            .directions = &directions,
            .environment = &environment,
            .lens = &lens};
  }
  capture::Image kernel() const {
    render::FrameResult result;
    render_frame(inputs(), job, plate, result);
    return capture::to_float(result.rgba);
  }
  capture::Image reference(int samples) const {
    return render_reference(inputs(), job, capture::to_float(plate), {.samples = samples});
  }
};

inline GlassShot glass_shot(render::SceneDescription scene,
                            const std::function<float(render::Vec3f)>& radiance,
                            int size,
                            double focal_px,
                            calibrate::Vec3 from) {
  register_shaders();
  GlassShot shot;
  shot.scene = std::make_unique<render::Scene>(std::move(scene));
  shot.lens = {"pinhole", size, size, {focal_px, focal_px, (size - 1) / 2.0, (size - 1) / 2.0}};
  shot.directions = calibrate::make_direction_table(shot.lens);
  capture::Image& map = shot.environment.radiance = capture::make_image(128, 256, 3);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const float value = radiance(render::direction_of_texel(
          static_cast<float>(x), static_cast<float>(y), map.width, map.height));
      for (int c = 0; c < 3; ++c) map.at(y, x, c) = value;
    }
  }
  render::smooth_for_reflections(shot.environment);
  shot.job.cam_from_set = calibrate::look_at(from, {0, 0, 0}, 0);
  shot.job.effort.accuracy = 0.99999F;
  shot.plate = made_plate(size, size);
  return shot;
}

inline render::SceneDescription bodies(std::vector<std::shared_ptr<const render::Mesh>> meshes,
                                       const std::vector<render::GlassParameters>& glass) {
  render::SceneDescription scene;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    auto mesh = std::make_shared<render::Mesh>(*meshes[i]);
    mesh->materials = {static_cast<std::uint32_t>(i)};
    scene.meshes.push_back(mesh);
    scene.materials.push_back(render::make_glass_material("glass", glass[i]));
    render::Instance instance;
    instance.name = "body " + std::to_string(i);
    instance.mesh = static_cast<std::uint32_t>(i);
    scene.instances.push_back(instance);
  }
  return scene;
}

}  // namespace compositing
