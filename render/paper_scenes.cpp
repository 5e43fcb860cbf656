// The papers' scenes: what stands in them, who looks, what light there is.
#include "render/paper_scenes.h"

#include <array>
#include <cmath>
#include <stdexcept>

#include "calibrate/angles.h"
#include "render/join_scenes.h"
#include "render/made_car.h"
#include "render/made_headlight.h"
#include "render/made_sky.h"
#include "render/made_soft_boxes.h"
#include "render/made_stage.h"
#include "render/made_tv_room.h"

namespace render {
namespace {

using calibrate::degree;
constexpr int map_height = 256;

constexpr std::string_view pomi = "Pomi et al., VMV 2003, table 1";

constexpr std::string_view benthin = "Benthin et al., EGPGV 2002, section 5";

constexpr std::array<PaperFigure, 6> figures{{
    {"tv_room", pomi, made_tv_room_triangles, 24, 640, 480, 19, 130, 100, 25},
    {"tv_room_lit", pomi, made_tv_room_triangles, 24, 640, 480, 5.5, 130, 100, 25},
    {"billboards", pomi, made_stage_triangles, 24, 640, 480, 10, 220, 420, 25},
    {"glass_sphere", pomi, made_stage_triangles + glass_sphere_triangles, 24, 640, 480, 6.4, 220,
     420, 25},
    {"car", pomi, made_car_triangles, 24, 640, 480, 2.6, 350, 350, 1},
    {"headlight", benthin, made_headlight_triangles, 32, 640, 480, 10},
}};

Environment smoothed(const capture::Image& map) {
  Environment environment = environment_from_map(map, 0, map_height);
  smooth_for_reflections(environment);
  return environment;
}

// The rest of a flat in the evening: a lit room behind the viewer, little else.
Environment make_evening(float strength) {
  const std::array<SoftBox, 3> boxes{{
      {{0.5F, -1, 0.75F}, 1.1F, 0.7F, {1.1F, 0.9F, 0.65F}},
      {{-1.2F, -1, 0.3F}, 0.4F, 0.6F, {0.6F, 0.9F, 1.4F}},
      {{0.1F, -0.2F, 1}, 0.9F, 0.7F, {0.8F, 0.68F, 0.5F}},
  }};
  capture::Image map = make_soft_box_map(map_height, {0.24F, 0.21F, 0.17F}, {0.17F, 0.145F, 0.12F},
                                         {0.09F, 0.07F, 0.05F}, boxes);
  for (float& value : map.pixels) value *= strength;
  return smoothed(map);
}

// A studio's lamps on a grid above and in front.
Environment make_studio_light() {
  const std::array<SoftBox, 4> boxes{{
      {{-0.9F, -1, 1.1F}, 0.1F, 0.1F, {300, 282, 252}},
      {{1.1F, -0.8F, 1.2F}, 0.22F, 0.22F, {6, 6.6F, 7.8F}},
      {{0.1F, -1, 0.5F}, 0.8F, 0.35F, {1.0F, 0.97F, 0.9F}},
      {{0.2F, 0.4F, 1}, 0.5F, 0.3F, {1.4F, 1.5F, 1.8F}},
  }};
  return smoothed(make_soft_box_map(map_height, {0.10F, 0.11F, 0.13F}, {0.04F, 0.045F, 0.06F},
                                    {0.03F, 0.03F, 0.03F}, boxes));
}

Environment make_daylight() {
  const MadeSky sky =
      make_sky({.height = map_height, .sun_azimuth_rad = -0.9F, .sun_elevation_rad = 0.75F});
  capture::Image map = sky.rest;
  for (std::size_t i = 0; i < map.pixels.size(); ++i) map.pixels[i] += sky.sun.pixels[i];
  return smoothed(map);
}

// The headlight's paper took the foyer of its institute, as a map of high dynamic range: daylight
// through a glass front and a skylight, lamps on the ceiling, all else dim. Ours bundles its light
// more than a flat with windows does, and less than a hall with bare lamps.
Environment make_foyer() {
  std::vector<SoftBox> boxes{
      {{0.25F, 0.1F, 1}, 0.7F, 0.4F, {9.0F, 9.5F, 10.5F}},       // skylight
      {{-1, 0.45F, 0.1F}, 0.3F, 0.6F, {0.9F, 0.75F, 0.5F}},      // lit door
      {{-1, -0.35F, 0.22F}, 0.45F, 0.3F, {0.3F, 0.21F, 0.14F}},  // panelling
      {{0.35F, -1, 0.1F}, 0.6F, 0.5F, {0.12F, 0.25F, 0.6F}},     // desk of the porter
      {{1, -0.5F, -0.25F}, 0.5F, 0.2F, {0.75F, 0.68F, 0.55F}},   // daylight on the floor
  };
  constexpr int panes = 5;
  for (int i = 0; i < panes; ++i) {
    const float azimuth = 0.35F + 0.26F * static_cast<float>(i);
    boxes.push_back({{std::cos(azimuth), std::sin(azimuth), 0.3F}, 0.2F, 0.75F, {5.5F, 6, 6.8F}});
  }
  constexpr int lamps = 8;
  for (int i = 0; i < lamps; ++i) {
    const float x = 0.9F - 0.6F * static_cast<float>(i / 2), y = i % 2 == 0 ? 0.55F : -0.55F;
    boxes.push_back({{x, y, 0.8F}, 0.05F, 0.05F, {44, 39, 29}});
  }
  return smoothed(make_soft_box_map(map_height, {0.45F, 0.44F, 0.42F}, {0.3F, 0.29F, 0.27F},
                                    {0.16F, 0.12F, 0.08F}, boxes));
}

PaperScene make_room(bool lit) {
  PaperScene made;
  made.scene = make_tv_room(!lit);
  made.cam_from_set = calibrate::look_at({1.25, -4.2, 1.62}, {-0.33, 0.9, 0.52}, 0);
  made.horizontal_view_rad = 62 * degree;
  // Lit by the screen, the room is dark but for it.
  made.environment = make_evening(lit ? 0.1F : 1.0F);
  if (lit) {
    made.lit_by = "tv";
  } else {
    made.lamps = lights_of_tv_room();
  }
  return made;
}

PaperScene make_billboards(bool with_sphere) {
  PaperScene made;
  made.scene = make_stage();
  if (with_sphere) join(made.scene, make_glass_sphere());
  made.cam_from_set = calibrate::look_at({0.15, -5.4, 1.55}, {0, 0.4, 1.05}, 0);
  made.horizontal_view_rad = 52 * degree;
  made.environment = make_studio_light();
  return made;
}

PaperScene make_car_scene() {
  PaperScene made;
  made.scene = made_car();
  made.cam_from_set = calibrate::look_at({4.9, -4.6, 2.1}, {0.05, 0, 0.45}, 0);
  made.horizontal_view_rad = 2 * std::atan(0.5 / 1.32);
  made.environment = make_daylight();
  return made;
}

PaperScene make_headlight_scene() {
  PaperScene made;
  made.scene = make_headlight();
  made.cam_from_set = calibrate::look_at({0.63, 0.24, 0.06}, {-0.035, 0, 0.002}, 0);
  made.horizontal_view_rad = 26 * degree;
  made.environment = make_foyer();
  return made;
}

}  // namespace

std::span<const PaperFigure> paper_figures() { return figures; }

std::vector<std::string_view> paper_scene_names() {
  std::vector<std::string_view> names;
  for (const PaperFigure& figure : figures) names.push_back(figure.scene);
  return names;
}

PaperScene made_paper_scene(std::string_view name) {
  PaperScene made;
  if (name == "tv_room" || name == "tv_room_lit") {
    made = make_room(name == "tv_room_lit");
  } else if (name == "billboards" || name == "glass_sphere") {
    made = make_billboards(name == "glass_sphere");
  } else if (name == "car") {
    made = make_car_scene();
  } else if (name == "headlight") {
    made = make_headlight_scene();
  } else {
    std::string known;
    for (const PaperFigure& figure : figures) {
      known += (known.empty() ? "" : ", ") + std::string(figure.scene);
    }
    throw std::invalid_argument("no paper has a scene \"" + std::string(name) + "\"; there are " +
                                known);
  }
  made.name = name;
  return made;
}

}  // namespace render
