// The scenes of both papers, made by the program.
//
// Pomi et al., "Streaming Video Textures for Mixed Reality Applications in Interactive Ray Tracing
// Environments", VMV 2003. Benthin et al., "Interactive Headlight Simulation - A Case Study of
// Interactive Distributed Ray Tracing", Eurographics Workshop on Parallel Graphics and
// Visualization 2002. Their models are not to be had: these are of as many triangles, all of them
// surface that can be seen, and show the same effects.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calibrate/pose.h"
#include "render/environment.h"
#include "render/light_table.h"
#include "render/scene.h"

namespace render {

// What is needed to render a scene as its paper shows it, lights aside: those of the environment
// are whatever table the caller makes of it.
struct PaperScene {
  std::string name;
  SceneDescription scene;  // background "environment"
  calibrate::Pose cam_from_set;
  double horizontal_view_rad = 0;  // at 4:3, as the papers' 640x480
  Environment environment;         // smoothed for reflections
  std::vector<LocalLight> lamps;   // of the scene's own lamps
  std::string lit_by;              // object whose picture lights the scene; empty = none does
};

// A measurement that a paper reports of its scene.
struct PaperFigure {
  std::string_view scene;
  std::string_view source;
  std::size_t triangles = 0;
  int cpus = 0;
  int width = 0, height = 0;
  double fps = 0;
  // Of the video that its surfaces show, or that is its environment; all 0 = there is none.
  int video_width = 0, video_height = 0;
  double video_fps = 0;
};

// All of them, in the papers' order: Pomi's table 1, then Benthin's section 5. "tv_room_lit" is
// "tv_room" with its light from the screen.
std::span<const PaperFigure> paper_figures();

// "tv_room", "tv_room_lit", "billboards", "glass_sphere", "car", "headlight".
std::vector<std::string_view> paper_scene_names();

// The same name gives the same scene, bit for bit. Throws std::invalid_argument, listing the names,
// if it is none of them.
PaperScene made_paper_scene(std::string_view name);

}  // namespace render
