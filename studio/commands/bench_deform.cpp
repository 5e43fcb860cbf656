// platelight bench deform: a cloth whose tree is fitted to each shape, against trees built anew.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/ray_log.h"
#include "render/scene.h"
#include "render/standard.h"
#include "studio/commands/benches.h"
#include "studio/json_text.h"

namespace studio {
namespace {

using render::Vec3f;

constexpr int squares = 317;  // a side: 200,978 triangles

// Of 2 x 1.5 metres, held at its left edge: a wave that grows, then all of it curls up.
render::Mesh make_cloth(float time, float wave_m, float curl_rad) {
  render::Mesh mesh;
  const auto wide = static_cast<std::uint32_t>(squares + 1);
  for (std::uint32_t i = 0; i < wide * wide; ++i) {
    const float u = static_cast<float>(i % wide) / squares;
    const float v = static_cast<float>(i / wide) / squares;
    const float out = wave_m * u * std::sin(14 * u + 5 * v - time);
    const float turn = curl_rad * u;
    const float radius = curl_rad > 0 ? 2 / curl_rad + out : 0;
    mesh.positions.push_back(curl_rad > 0 ? Vec3f{radius * std::sin(turn),
                                                  2 / curl_rad - radius * std::cos(turn), 1.5F * v}
                                          : Vec3f{2 * u, out, 1.5F * v});
  }
  for (std::uint32_t row = 0; row + 1 < wide; ++row) {
    for (std::uint32_t column = 0; column + 1 < wide; ++column) {
      const std::uint32_t i = row * wide + column;
      mesh.triangles.push_back({i, i + 1, i + wide + 1});
      mesh.triangles.push_back({i, i + wide + 1, i + wide});
    }
  }
  mesh.materials = {0};
  return mesh;
}

// Rays of a camera before the cloth, and rays from everywhere about it.
render::RayLog make_rays(bool from_camera) {
  render::RayLog log;
  std::mt19937 random(1);
  const auto dice = [&](float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random);
  };
  constexpr int width = 640, height = 480, block = 16;
  for (int y = 0; y < height; y += block) {
    for (int x = 0; x < width; x += block) {
      std::array<std::array<float, block * block>, 8> rays;
      std::array<unsigned, block * block> masks;
      masks.fill(render::mask_virtual);
      for (std::size_t i = 0; i < masks.size(); ++i) {
        const auto column = static_cast<float>(x + static_cast<int>(i) % block) / width;
        const auto row = static_cast<float>(y + static_cast<int>(i) / block) / height;
        const Vec3f from = from_camera ? Vec3f{1, -4, 0.75F} : Vec3f{dice(-1, 3), dice(-2, 2), 2};
        const Vec3f to = from_camera ? Vec3f{2.4F * column - 0.2F, 0, 1.7F * row - 0.1F}
                                     : Vec3f{dice(0, 2), dice(-0.3F, 0.3F), dice(0, 1.5F)};
        const Vec3f along = normalize(to - from);
        const float values[8] = {from.x, from.y, from.z, along.x, along.y, along.z, 0, 1e30F};
        for (std::size_t k = 0; k < 8; ++k) rays[k][i] = values[k];
      }
      const float* parts[8];
      for (std::size_t k = 0; k < 8; ++k) parts[k] = rays[k].data();
      log.add(false, from_camera, 0, parts, masks.data(), masks.size());
    }
  }
  return log;
}

// Processor time, the least of `runs`.
double least_ms(int runs, const std::function<void()>& work) {
  double least = 1e30;
  for (int i = 0; i < runs; ++i) {
    const std::clock_t start = std::clock();
    work();
    least = std::min(least, static_cast<double>(std::clock() - start) * 1e3 / CLOCKS_PER_SEC);
  }
  return least;
}

}  // namespace

void bench_deform(int runs, Console& console) {
  render::SceneDescription description;
  description.materials = {render::make_standard_material("cloth", {})};
  render::Instance& flag = description.instances.emplace_back();
  flag.moves = true;
  description.meshes = {nullptr};
  const auto rest = std::make_shared<const std::vector<Vec3f>>(make_cloth(0, 0, 0).positions);
  const std::vector<render::RayLog> camera{make_rays(true)}, other{make_rays(false)};
  nlohmann::ordered_json figures;
  console.say("cloth of 200,978 triangles; processor ms; Mrays/s, fitted / built");
  for (const int frame : {0, 50, 100, 200, 400, 600, 800, 1000}) {
    const auto t = static_cast<float>(frame);
    const auto shape_at = [&](float time) {
      return make_cloth(time, std::min(t, 400.0F) * 5e-4F, std::max(t - 400, 0.0F) * 0.02F);
    };
    auto fitted_mesh = std::make_shared<render::Mesh>(shape_at(0.2F * t));
    const auto built_mesh = std::make_shared<const render::Mesh>(*fitted_mesh);
    fitted_mesh->rest = rest;
    auto before_mesh = std::make_shared<render::Mesh>(shape_at(0.2F * (t - 1)));
    before_mesh->rest = rest;
    description.meshes = {before_mesh};
    auto before = std::make_unique<const render::Scene>(description);
    std::unique_ptr<const render::Scene> fitted, built;
    // Two take turns, as in a show.
    bool odd = false;
    const double fit_ms = least_ms(runs + 2, [&] {
      odd = !odd;
      description.meshes = {odd ? fitted_mesh : before_mesh};
      fitted = std::make_unique<const render::Scene>(description, fitted ? *fitted : *before);
    });
    description.meshes = {fitted_mesh};
    fitted = std::make_unique<const render::Scene>(description, *fitted);
    description.meshes = {built_mesh};
    const double build_ms =
        least_ms(runs, [&] { built = std::make_unique<const render::Scene>(description); });
    std::array<double, 4> rates{};
    for (std::size_t i = 0; i < rates.size(); ++i) {
      const std::vector<render::RayLog>& rays = i < 2 ? camera : other;
      const render::Scene& scene = i % 2 == 0 ? *fitted : *built;
      rates[i] = static_cast<double>(rays[0].mask.size()) * 1e-3 /
                 least_ms(runs, [&] { shoot_logged_rays(scene, rays, i < 2); });
    }
    console.say(fmt::format(
        "frame {:5}: fitted in {:5.1f} ms, built in {:5.1f} ms; camera rays {:5.1f} / {:5.1f}, "
        "others {:5.1f} / {:5.1f}",
        frame, fit_ms, build_ms, rates[0], rates[1], rates[2], rates[3]));
    figures.push_back({{"frame", frame},
                       {"fit_ms", fit_ms},
                       {"build_ms", build_ms},
                       {"camera_mrays_fitted", rates[0]},
                       {"camera_mrays_built", rates[1]},
                       {"other_mrays_fitted", rates[2]},
                       {"other_mrays_built", rates[3]}});
  }
  console.figures(json_text(figures));
}

}  // namespace studio
