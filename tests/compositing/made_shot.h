// A small made shot for kernel tests: a ball and a box on a stand-in floor under a made sky.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>

#include "compositing/stand_in.h"
#include "render/kernel.h"
#include "render/standard.h"

namespace compositing {

struct MadeShot {
  std::unique_ptr<render::Scene> scene;
  calibrate::DirectionTable directions;
  render::Environment environment;
  render::FrameJob job;
  capture::HalfImage plate;

  render::FrameInputs inputs() const { return {scene.get(), &directions, &environment}; }
};

inline std::shared_ptr<render::Mesh> made_ball(render::Vec3f centre,
                                               float radius,
                                               std::uint32_t material) {
  auto mesh = std::make_shared<render::Mesh>();
  constexpr int columns = 48, rows = 24;
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const float theta = std::numbers::pi_v<float> * static_cast<float>(j) / rows;
      const float phi = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / columns;
      const render::Vec3f n{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                            std::cos(theta)};
      mesh->positions.push_back(centre + n * radius);
      mesh->normals.push_back(n);
    }
  }
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      const std::uint32_t a = j * (columns + 1) + i, b = a + 1, c = a + columns + 1, d = c + 1;
      mesh->triangles.push_back({a, c, d});
      mesh->triangles.push_back({a, d, b});
    }
  }
  mesh->materials = {material};
  return mesh;
}

inline std::shared_ptr<render::Mesh> made_floor(float half_size, std::uint32_t material) {
  auto mesh = std::make_shared<render::Mesh>();
  const float s = half_size;
  mesh->positions = {{-s, -s, 0}, {s, -s, 0}, {s, s, 0}, {-s, s, 0}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh->materials = {material};
  return mesh;
}

inline render::Environment made_sky(int height, float ground, float sky) {
  render::Environment env;
  env.radiance = capture::make_image(height, 2 * height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < 2 * height; ++x) {
      for (int c = 0; c < 3; ++c) env.radiance.at(y, x, c) = 2 * y < height ? sky : ground;
    }
  }
  render::smooth_for_reflections(env);
  return env;
}

// Lights spread evenly over the upper half, of radiance 1: the sky of made_sky(_, 0, 1).
inline render::LightTable even_lights(int count) {
  render::LightTable table;
  for (int i = 0; i < count; ++i) {
    const float z = (static_cast<float>(i) + 0.5F) / static_cast<float>(count);
    const float phi = static_cast<float>(i) * 2.39996323F, r = std::sqrt(1 - z * z);
    const float e = 2 * std::numbers::pi_v<float> / static_cast<float>(count);
    table.lights.push_back({{r * std::cos(phi), r * std::sin(phi), z}, {e, e, e}, 0.1F});
  }
  return table;
}

inline capture::HalfImage made_plate(int height, int width) {
  capture::Image image = capture::make_image(height, width, 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = 0.3F + 0.2F * std::sin(static_cast<float>(i) * 0.37F);
  }
  return capture::to_half(image);
}

// Objects: a red ball with clear coat, a thin glass ball, on a floor; or the floor alone.
inline render::SceneDescription shot_scene(bool objects = true) {
  register_shaders();
  render::SceneDescription scene;
  scene.background = "plate";
  scene.meshes.push_back(made_floor(20, 0));
  scene.materials.push_back(make_stand_in_material("floor", {}));
  render::StandardParameters paint;
  paint.base_color[1] = paint.base_color[2] = 0.1F;
  paint.clearcoat = 1;
  scene.materials.push_back(render::make_standard_material("paint", paint));
  render::StandardParameters glass;
  glass.transmission = 1;
  glass.roughness = 0;
  glass.base_color[0] = 0.5F;
  scene.materials.push_back(render::make_standard_material("glass", glass));
  render::Instance floor;
  floor.name = "floor";
  floor.kind = render::ObjectKind::stand_in;
  floor.blocks_light = false;
  scene.instances.push_back(floor);
  if (objects) {
    scene.meshes.push_back(made_ball({0, 0, 0.5F}, 0.5F, 1));
    scene.meshes.push_back(made_ball({0.9F, -0.4F, 0.4F}, 0.4F, 2));
    for (std::uint32_t mesh = 1; mesh <= 2; ++mesh) {
      render::Instance ball;
      ball.name = "ball";
      ball.mesh = mesh;
      scene.instances.push_back(ball);
    }
  }
  return scene;
}

inline MadeShot made_shot(int width,
                          int height,
                          render::SceneDescription description,
                          int lights = 32) {
  MadeShot shot;
  shot.scene = std::make_unique<render::Scene>(std::move(description));
  const double f = width * 1.1;
  shot.directions = calibrate::make_direction_table(
      {"pinhole", width, height, {f, f, (width - 1) / 2.0, (height - 1) / 2.0}});
  shot.environment = made_sky(32, 0.2F, 1.0F);
  shot.job.cam_from_set = calibrate::look_at({3, -3, 1.5}, {0.3, 0, 0.3}, 0);
  shot.job.lights = even_lights(lights);
  shot.job.effort.accuracy = 0.99F;
  shot.plate = made_plate(height, width);
  return shot;
}

}  // namespace compositing
