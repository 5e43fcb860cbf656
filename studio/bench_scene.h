// The scene that charts and benchmarks measure with: the made car on a floor under a made sky.
#pragma once

#include <memory>
#include <vector>

#include "calibrate/lens.h"
#include "capture/image.h"
#include "render/kept_transport.h"
#include "render/light_follower.h"
#include "render/made_sky.h"
#include "render/reference.h"
#include "render/renderer.h"
#include "render/video_texture.h"

namespace studio {

// A shot that needs no files. The car covers a quarter to a third of the picture, the floor, a
// stand-in that catches its shadow, nearly all the rest.
struct BenchScene {
  std::unique_ptr<render::Scene> scene;
  calibrate::Lens lens;                  // a pinhole
  calibrate::DirectionTable directions;  // of it
  render::Environment environment;
  capture::Image plate;                               // (height, width, 3)
  capture::HalfImage half_plate;                      // the same
  render::FrameJob job;                               // without lights
  std::unique_ptr<const render::VideoTexture> video;  // a frame of the scene's only video, if it
  std::vector<const render::VideoTexture*> videos;    // has one

  render::FrameInputs inputs() const {
    return {.scene = scene.get(),
            .directions = &directions,
            .environment = &environment,
            .videos = videos};
  }
};

// Surfaces of the car.
enum class BenchFinish {
  real,   // paint, glass, rubber, chrome
  matte,  // all of it one dull grey: shows nothing but how the light table lights it
};

// Throws std::invalid_argument if a side is below 16.
BenchScene make_bench_scene(int width, int height, BenchFinish finish = BenchFinish::real);

// The sun's share and size may be changed, to see where methods fail. Unless the exposure is
// locked, radiance is then scaled to what it was on a surface that faces up, as a camera's would
// be.
struct BenchSky {
  float sun_radius_rad = 0;  // 0 = the made sky's own sun, about half a degree
  float sun_to_sky = 1;      // times the sun of a clear day
  bool exposure_locked = false;
  float noise = 0;  // relative, per texel
  std::uint32_t noise_seed = 1;
};

render::Environment make_bench_sky(const BenchSky& sky);

// Light as a show has it (LightFeed): followed, and compact sources apart from what is smoothed.
struct BenchLight {
  render::LightTable table;
  render::Environment environment;
};

BenchLight follow_bench_sky(render::LightFollower& follower,
                            const render::Environment& sky,
                            const render::LightTableSettings& settings);

// That were taken: primary, shadow and secondary ones.
inline std::uint64_t all_rays(const render::RenderStatistics& s) {
  return s.primary_rays + s.shadow_rays + s.secondary_rays;
}

// As live light does from frame to frame: each light and lamp a little stronger, what is planned as
// it was.
void drift(render::FrameJob& job);

}  // namespace studio
