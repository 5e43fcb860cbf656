// Circumstances under which whole frames err.
#include "studio/charts/render_stressors.h"

#include <cmath>
#include <functional>
#include <numbers>

#include <fmt/format.h>

#include "render/glass.h"
#include "render/join_scenes.h"
#include "render/made_stage.h"
#include "studio/scene_trial.h"

namespace studio {
namespace {

constexpr int width = 160, height = 120;
constexpr int quick_width = 64, quick_height = 48;

struct PictureShape {
  int width, height, paths;
};

// One sample: the error of the scene, at the default effort.
StressorSample sample(double value, const render::PaperScene& scene, const PictureShape& shape) {
  const SceneTrial trial(make_paper_shot(scene, shape.width, shape.height), shape.paths);
  const TriedEffort tried = trial.measure({}, 0);
  double covered = 0;
  for (const float pixel : trial.covered().pixels) covered += static_cast<double>(pixel);
  StressorSample taken{value, tried.error.relative_rms, std::nullopt, "ok"};
  if (tried.statistics.depth_limit_hits > 0) taken.status = "some rays ended by the depth limit";
  taken.figures = {{"error_p99", tried.error.p99},
                   {"reference_noise", tried.error.reference_noise},
                   {"table_error", double{tried.table_error}},
                   {"groups_within_5_percent",
                    render::share_within(tried.groups, &render::GroupError::mean, 0.05)},
                   {"triangles_per_pixel",
                    static_cast<double>(triangle_count(scene.scene)) / std::max(covered, 1.0)}};
  return taken;
}

render::PaperScene car_under(const BenchSky& sky) {
  render::PaperScene car = render::made_paper_scene("car");
  car.environment = make_bench_sky(sky);
  return car;
}

// The glass sphere as shells about each other, glass and air in turn, evenly thick.
render::PaperScene sphere_of_shells(int shells) {
  render::PaperScene made = render::made_paper_scene("billboards");
  const render::Vec3f m = render::glass_sphere_middle;
  for (int i = 0; i < shells; ++i) {
    render::SceneDescription sphere = render::make_glass_sphere();
    render::GlassParameters glass = render::glass_parameters(sphere.materials.at(0));
    if (i % 2 != 0) glass.index = 1;
    glass.priority = i;  // the inner one is there
    sphere.materials[0] = render::make_glass_material(fmt::format("shell {}", i), glass);
    sphere.instances[0].name = sphere.materials[0].name;
    const float scale = 1 - static_cast<float>(i) / static_cast<float>(shells);
    const float rest = 1 - scale;
    join(made.scene, sphere,
         {scale, 0, 0, rest * m.x, 0, scale, 0, rest * m.y, 0, 0, scale, rest * m.z});
  }
  // So close that the sphere fills the picture's height.
  made.cam_from_set = calibrate::look_at({0.62, -2.6, 1.13}, {0.62, 0, 1.13}, 0);
  made.horizontal_view_rad = 35 * std::numbers::pi / 180;
  return made;
}

}  // namespace

std::vector<Stressor> render_stressors(bool quick, Console& console, double from, double to) {
  const PictureShape shape =
      quick ? PictureShape{quick_width, quick_height, 16} : PictureShape{width, height, 128};
  std::vector<Stressor> stressors;
  double done = 0;
  constexpr double samples = 26;
  const auto sweep = [&](const std::string& name, const std::string& unit,
                         const std::vector<double>& values,
                         const std::function<StressorSample(double)>& measure) {
    Stressor stressor{name, unit, true, {}};
    for (const double value : values) {
      console.progress(from + (to - from) * std::min(1.0, done++ / samples), name);
      stressor.samples.push_back(measure(value));
    }
    stressors.push_back(std::move(stressor));
  };
  using Values = std::vector<double>;
  sweep("angular radius of the sun over the car", "degrees",
        quick ? Values{0.5} : Values{0.5, 1, 2, 5, 10, 20, 40}, [&](double degrees) {
          const auto radius = static_cast<float>(degrees * std::numbers::pi / 180);
          return sample(degrees, car_under({.sun_radius_rad = radius}), shape);
        });
  sweep("strength of the sun, times a clear day's, exposed alike; car", "",
        quick ? Values{} : Values{0.01, 0.1, 1, 10, 100, 1000}, [&](double strength) {
          return sample(strength, car_under({.sun_to_sky = static_cast<float>(strength)}), shape);
        });
  // Afar, its edges are closer together than pixels. What would stand around it is cut off.
  sweep("distance of the car, times the shot's", "",
        quick ? Values{2} : Values{0.5, 1, 2, 4, 8, 16}, [&](double distance) {
          const auto across = [&](int pixels) {
            return std::max(16, static_cast<int>(std::lround(pixels / distance)));
          };
          const int paths = static_cast<int>(std::clamp(shape.paths * distance, 16.0, 2048.0));
          return sample(distance, render::made_paper_scene("car"),
                        {across(2 * shape.width), across(2 * shape.height), paths});
        });
  sweep("shells of glass and air about each other", "",
        quick ? Values{1, 8} : Values{1, 2, 3, 4, 6, 8, 12}, [&](double shells) {
          return sample(shells, sphere_of_shells(static_cast<int>(shells)), shape);
        });
  std::erase_if(stressors, [](const Stressor& s) { return s.samples.empty(); });
  return stressors;
}

}  // namespace studio
