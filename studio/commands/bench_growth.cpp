// platelight bench growth: how a frame's time grows with triangles and shrinks with threads.
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/made_shapes.h"
#include "studio/charts/matte_shot.h"
#include "studio/commands/bench_rows.h"
#include "studio/commands/benches.h"
#include "studio/commands/kernel_rate.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

constexpr int triangle_counts[] = {100'000, 200'000, 400'000, 800'000};

// Hills of about so many triangles, 4 m wide, all of which the camera sees from above.
render::SceneDescription make_hills(int triangles) {
  const auto side = static_cast<int>(std::lround(std::sqrt(triangles / 2.0))) + 1;
  std::vector<render::Vec3f> points;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const float x = 4 * static_cast<float>(column) / static_cast<float>(side - 1) - 2;
      const float y = 4 * static_cast<float>(row) / static_cast<float>(side - 1) - 2;
      const float z = 0.12F * std::sin(5 * x) * std::cos(4 * y) + 0.02F * std::sin(31 * x + 17 * y);
      points.push_back({x, -y, z});
    }
  }
  render::SceneDescription scene;
  scene.background = "environment";
  auto mesh = std::make_shared<render::Mesh>(render::make_sheet(points, side, side));
  mesh->materials = {0};
  scene.meshes = {mesh};
  scene.materials = {make_grey_material("hills")};
  scene.instances.emplace_back().name = "hills";
  return scene;
}

BenchScene shot_of_hills(int triangles) {
  BenchScene shot = make_bench_scene(640, 480, BenchFinish::matte);
  shot.scene = std::make_unique<render::Scene>(make_hills(triangles));
  shot.job.cam_from_set = calibrate::look_at({0, -2.6, 3.2}, {0, -0.1, 0}, 0);
  shot.job.lights = make_light_table(shot.environment, {.count = default_lights});
  shot.job.effort = plain_effort(shot.job.effort);
  return shot;
}

KernelRate measure_on(int threads, const BenchScene& shot, int runs) {
  KernelRate rate;
  tbb::task_arena arena(threads);
  arena.execute([&] { rate = measure_kernel(shot, shot.job, runs); });
  return rate;
}

}  // namespace

void bench_growth(int runs, Console& console) {
  const int all = tbb::this_task_arena::max_concurrency();
  console.say(
      fmt::format("hills of triangles, 640x480, 64 lights, every pixel tests all; {} "
                  "threads and 1",
                  all));
  console.say(
      "triangles   kernel        bare Embree   of its rate   grown by        1 thread: kernel, "
      "bare       efficiency");
  Json rows = Json::array();
  std::pair<double, double> first;
  for (const int triangles : triangle_counts) {
    const BenchScene shot = shot_of_hills(triangles);
    const KernelRate together = measure_on(all, shot, runs), alone = measure_on(1, shot, runs);
    if (rows.empty()) first = {together.kernel_ms, together.bare_ms};
    const auto efficiency = [all](double one_ms, double all_ms) { return one_ms / all_ms / all; };
    const double growth = together.kernel_ms / first.first;
    const double bare_growth = together.bare_ms / first.second;
    const double kernel_efficiency = efficiency(alone.kernel_ms, together.kernel_ms);
    const double bare_efficiency = efficiency(alone.bare_ms, together.bare_ms);
    const std::size_t made = triangle_count(shot.scene->description());
    console.say(fmt::format(
        "{:9} {:8.1f} ms {:11.1f} ms {:9.0f} %   {:.2f}, bare {:.2f} {:10.1f} ms, {:6.1f} ms   "
        "{:.2f}, bare {:.2f}",
        made, together.kernel_ms, together.bare_ms, 100 * together.bare_ms / together.kernel_ms,
        growth, bare_growth, alone.kernel_ms, alone.bare_ms, kernel_efficiency, bare_efficiency));
    rows.push_back({{"triangles", made},
                    {"rays", together.rays},
                    {"threads", all},
                    {"kernel_ms", together.kernel_ms},
                    {"bare_ms", together.bare_ms},
                    {"growth_over_bare", growth / bare_growth},
                    {"one_thread_kernel_ms", alone.kernel_ms},
                    {"one_thread_bare_ms", alone.bare_ms},
                    {"efficiency_over_bare", kernel_efficiency / bare_efficiency}});
  }
  give_rows(rows, console);
}

}  // namespace studio
