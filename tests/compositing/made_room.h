// A made room with a screen that shows live video, for kernel tests.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "made_shot.h"
#include "render/glass.h"
#include "render/kept_transport.h"
#include "render/video_texture.h"

namespace compositing {

// Of width x height metres about `middle`, facing `normal` (level), the picture upright.
inline std::shared_ptr<render::Mesh> made_screen(render::Vec3f middle,
                                                 render::Vec3f normal,
                                                 float width_m,
                                                 float height_m,
                                                 std::uint32_t material) {
  const render::Vec3f up{0, 0, height_m / 2};
  const render::Vec3f right = cross(render::Vec3f{0, 0, 1}, normal) * (width_m / 2);
  auto mesh = std::make_shared<render::Mesh>();
  mesh->positions = {middle - right - up, middle + right - up, middle + right + up,
                     middle - right + up};
  mesh->uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh->materials = {material};
  return mesh;
}

// A frame of made video: coloured bars that move, and a bright ball.
inline capture::Image made_video(int height, int width, int frame) {
  capture::Image image = capture::make_image(height, width);
  const float t = 0.3F * static_cast<float>(frame);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float u = (static_cast<float>(x) + 0.5F) / static_cast<float>(width);
      const float v = (static_cast<float>(y) + 0.5F) / static_cast<float>(height);
      const float du = u - 0.5F - 0.3F * std::sin(t), dv = v - 0.4F;
      const bool ball = du * du + dv * dv < 0.02F;
      image.at(y, x, 0) = ball ? 3.0F : 0.5F + 0.5F * std::sin(9 * u + t);
      image.at(y, x, 1) = ball ? 2.5F : 0.3F + 0.3F * std::sin(7 * v - t);
      image.at(y, x, 2) = ball ? 1.0F : 0.5F + 0.5F * std::cos(11 * (u + v) + t);
    }
  }
  return image;
}

// Grey walls and a floor that mirrors a little, a screen at the far wall, a dull, a mirroring and a
// glass ball; hardly any light but the screen's.
struct MadeRoom {
  std::unique_ptr<render::Scene> scene;
  calibrate::DirectionTable directions;
  render::Environment environment = made_sky(16, 0, 0.02F);
  render::FrameJob job;
  capture::HalfImage plate;
  render::VideoTexture video;
  std::vector<const render::VideoTexture*> videos;

  static constexpr std::uint32_t screen_instance = 3;
  static constexpr float gain = 4;

  static render::SceneDescription describe() {
    register_shaders();
    render::SceneDescription s;
    s.background = "environment";
    s.videos = {"news"};
    const auto material = [&s](const render::StandardParameters& p) {
      s.materials.push_back(render::make_standard_material("made", p));
      return static_cast<std::uint32_t>(s.materials.size() - 1);
    };
    render::StandardParameters wall;
    wall.base_color[0] = wall.base_color[1] = wall.base_color[2] = 0.7F;
    wall.roughness = 1;
    wall.specular = 0;
    render::StandardParameters parquet = wall;
    parquet.base_color[2] = 0.4F;
    parquet.specular = 1;
    parquet.roughness = 0;
    render::StandardParameters chrome;
    chrome.metallic = 1;
    chrome.roughness = 0;
    render::StandardParameters screen;
    screen.base_color[0] = screen.base_color[1] = screen.base_color[2] = 0;
    screen.specular = 0;
    screen.emission[0] = screen.emission[1] = screen.emission[2] = 1;
    screen.emission_gain = gain;
    screen.emission_video = 0;
    const std::uint32_t walls = material(wall), floor = material(parquet),
                        mirror = material(chrome), glow = material(screen);
    s.materials.push_back(render::make_glass_material("glass", {}));
    const auto add = [&s](std::shared_ptr<render::Mesh> mesh) {
      s.meshes.push_back(std::move(mesh));
      s.instances.emplace_back().mesh = static_cast<std::uint32_t>(s.meshes.size() - 1);
    };
    add(made_floor(3, floor));
    add(made_screen({0, 3, 1.5F}, {0, -1, 0}, 6, 3, walls));
    add(made_screen({-3, 0, 1.5F}, {1, 0, 0}, 6, 3, walls));
    add(made_screen({0.2F, 2.9F, 1.2F}, {0, -1, 0}, 1.6F, 0.9F, glow));
    add(made_ball({-1, 1, 0.4F}, 0.4F, walls));
    add(made_ball({0.3F, 1.2F, 0.35F}, 0.35F, mirror));
    add(made_ball({1.3F, 1, 0.35F}, 0.35F, static_cast<std::uint32_t>(s.materials.size() - 1)));
    return s;
  }

  MadeRoom(int width, int height) : plate(capture::to_half(capture::make_image(height, width))) {
    scene = std::make_unique<render::Scene>(describe());
    const double f = width * 0.9;
    directions = calibrate::make_direction_table(
        {"pinhole", width, height, {f, f, (width - 1) / 2.0, (height - 1) / 2.0}});
    job.cam_from_set = calibrate::look_at({0.6, -3, 1.5}, {0, 2, 0.9}, 0);
    job.lights = even_lights(64);
    for (render::DirectionalLight& light : job.lights.lights) light.irradiance *= 0.02F;
    show(made_video(90, 160, 0));
  }

  void show(const capture::Image& frame) {
    render::make_video_texture(frame, video);
    videos = {&video};
  }
  render::FrameInputs inputs() const {
    render::FrameInputs inputs{scene.get(), &directions, &environment};
    inputs.videos = videos;
    return inputs;
  }
};

// The real floor in place of the room's own: a stand-in on which the plate shows.
inline void make_floor_real(render::SceneDescription& scene) {
  scene.materials.push_back(make_stand_in_material("floor", {}));
  auto floor = std::make_shared<render::Mesh>(*scene.meshes[0]);
  floor->materials = {static_cast<std::uint32_t>(scene.materials.size() - 1)};
  scene.meshes[0] = floor;
  scene.instances[0].kind = render::ObjectKind::stand_in;
  scene.instances[0].blocks_light = false;
}

inline render::FrameResult render_room(const MadeRoom& room,
                                       render::KeptTransport* kept = nullptr) {
  render::FrameResult result;
  render::FrameInputs inputs = room.inputs();
  inputs.kept = kept;
  render_frame(inputs, room.job, room.plate, result);
  return result;
}

}  // namespace compositing
