// Caustics by so many photons.
#include "studio/charts/caustics.h"

#include <vector>

#include <fmt/format.h>

#include "render/caustics.h"
#include "render/glass.h"
#include "render/made_shapes.h"
#include "render/paper_scenes.h"
#include "render/reference.h"
#include "studio/charts/matte_shot.h"
#include "studio/least_time.h"
#include "studio/paper_shot.h"

namespace studio {
namespace {

// The sun is larger than it is, or paths would hardly ever find it behind the glass.
constexpr float sun_radius_rad = 0.1F;

render::PaperScene ball_over_floor() {
  render::PaperScene made;
  made.name = "ball";
  made.scene.materials = {make_grey_material("floor"),
                          render::make_glass_material("ball", {.index = 1.5F})};
  const auto add = [&](const char* name, render::Mesh mesh) {
    mesh.materials = {static_cast<std::uint32_t>(made.scene.meshes.size())};
    render::Instance& instance = made.scene.instances.emplace_back();
    instance.name = name;
    instance.mesh = static_cast<std::uint32_t>(made.scene.meshes.size());
    made.scene.meshes.push_back(std::make_shared<render::Mesh>(std::move(mesh)));
  };
  add("floor", render::make_rectangle({-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, 1));
  render::Mesh ball = render::make_cushion({0.4F, 0.4F, 0.4F}, 2, 48);
  for (render::Vec3f& p : ball.positions) p.z += 0.5F;
  add("ball", std::move(ball));
  made.cam_from_set = calibrate::look_at({0.4, -2.2, 1.5}, {0.1, 0.1, 0.2}, 0);
  made.horizontal_view_rad = 0.8;
  made.environment = make_bench_sky({.sun_radius_rad = sun_radius_rad});
  return made;
}

}  // namespace

void add_caustics(bool quick, Chart& chart) {
  const int width = quick ? 48 : 128, height = quick ? 36 : 96, runs = quick ? 1 : 3;
  const std::vector<int> counts =
      quick ? std::vector{0, 4096} : std::vector{0, 256, 1024, 4096, 16384, 65536, 262144};
  BenchScene shot = make_paper_shot(ball_over_floor(), width, height).shot;
  shot.job.effort.caustic_photons = 1;  // the reference then bends all light
  const Truth truth = truth_of(shot.plate, [&](std::uint32_t seed) {
    return render::render_reference(shot.inputs(), shot.job, shot.plate,
                                    {.samples = quick ? 1024 : 4096, .seed = seed});
  });
  for (const int count : counts) {
    shot.job.effort.caustic_photons = count;
    ChartPoint point = measured_point(shot, truth, runs);
    const double finding_ms = least_time_ms(
        [&] {
          if (count == 0) return;
          const render::Caustics caustics(
              std::make_shared<render::Photons>(*shot.scene, shot.job.lights,
                                                render::PhotonSettings{.photons = count}),
              {});
        },
        runs);
    point.figures.emplace_back("finding_ms", finding_ms);
    point.scene = "glass ball over a grey floor, against the reference that bends all light";
    point.method = "photons through glass";
    point.settings = {{"caustic_photons", static_cast<double>(count)}};
    point.by_default = count == render::Effort{}.caustic_photons;
    point.label = fmt::format("{}{}", count, point.by_default ? ": default, straight on" : "");
    chart.points.push_back(std::move(point));
  }
}

}  // namespace studio
