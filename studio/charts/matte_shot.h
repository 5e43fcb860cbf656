// What the charts of lights measure with: a shot in which nothing but the light errs.
#pragma once

#include <string>

#include "studio/bench_scene.h"
#include "studio/chart.h"
#include "studio/picture_error.h"

namespace studio {

struct Visibility {
  const char* name;
  bool adaptive;
  int interleave;
  bool soft = true;  // lights are looked for all over their regions

  void set_in(render::Effort& effort) const {
    effort.adaptive_visibility = adaptive;
    effort.interleave = interleave;
    effort.soft_lights = soft;
  }
};
inline constexpr Visibility every_pixel{"every pixel", false, 1};
inline constexpr Visibility adaptive_grid{"adaptive grid", true, 1};
inline constexpr Visibility visibilities[] = {every_pixel,
                                              adaptive_grid,
                                              {"adaptive grid, hard", true, 1, false},
                                              {"interleaved 2x2", true, 2},
                                              {"interleaved 4x4", true, 4}};

// What a show does if it is told nothing else.
inline constexpr int default_lights = render::Effort{}.light_samples;

// A sky as a show follows it, once.
BenchLight light_of(const render::Environment& sky, const render::LightTableSettings& settings);

render::PictureError error_of(const capture::Image& picture, const Truth& truth);

// A point of a frame: the time of one that keeps nothing and its error, and as the figure still_ms
// the time of one that keeps all of it while the light lives. Changes the shot's light a little.
ChartPoint measured_point(BenchScene& shot, const Truth& truth, int runs);

// Lambert's.
inline constexpr float grey_albedo = 0.5F;
render::Material make_grey_material(const std::string& name);

// A shot of the matte car through the centres of its pixels. Nothing but the light errs there: no
// edges, no mirrors.
class MatteShot {
 public:
  MatteShot(int width, int height);

  const BenchScene& scene() const { return shot_; }

  capture::Image render(const BenchLight& light, const Visibility& visibility);
  capture::Image render_sampled(const render::Environment& sky, int samples, std::uint32_t seed);
  // Every texel of the map may light every pixel.
  Truth truth(const render::Environment& sky, int samples);

 private:
  render::FrameInputs inputs(const render::Environment& environment) const;

  BenchScene shot_;
  render::FrameResult result_;
};

}  // namespace studio
