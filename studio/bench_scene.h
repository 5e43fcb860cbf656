// The scene that charts and benchmarks measure with: the made car on a floor under a made sky.
#pragma once

#include <memory>

#include "calibrate/lens.h"
#include "capture/image.h"
#include "render/kept_transport.h"
#include "render/made_sky.h"
#include "render/reference.h"
#include "render/renderer.h"

namespace studio {

// A shot that needs no files. The car covers a quarter to a third of the picture, the floor, a
// stand-in that catches its shadow, nearly all the rest.
struct BenchScene {
  std::unique_ptr<render::Scene> scene;
  calibrate::DirectionTable directions;
  render::Environment environment;
  capture::Image plate;           // (height, width, 3)
  capture::HalfImage half_plate;  // the same
  render::FrameJob job;           // without lights

  render::FrameInputs inputs() const { return {scene.get(), &directions, &environment}; }
};

// The sun's share and size may be changed, to see where methods fail.
struct BenchSky {
  float sun_radius_rad = 0;  // 0 = the made sky's own sun, about half a degree
  float sun_to_sky = 1;      // times the sun of a clear day
  float noise = 0;           // relative, per texel
  std::uint32_t noise_seed = 1;
};

render::Environment make_bench_sky(const BenchSky& sky);

// Throws std::invalid_argument if a side is below 16.
BenchScene make_bench_scene(int width, int height);

}  // namespace studio
