// The made lamp's shape and light.
#include "render/made_lamp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "render/made_scene.h"
#include "render/made_shapes.h"
#include "render/standard.h"

namespace render {
namespace {

constexpr std::array<float, 3> dark_metal{0.06F, 0.065F, 0.07F};
constexpr int lamp_segments = 64;
constexpr float below_m = 0.002F;  // of the lights under the disc, so that it does not hide them

Vec3f turned(const Placement& m, Vec3f v) {
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
          m[8] * v.x + m[9] * v.y + m[10] * v.z};
}

}  // namespace

SceneDescription made_lamp(float emission_gain) {
  MadeSceneBuilder lamp;
  const Vec3f disc = lamp_disc_middle;
  const float top = disc.z + 0.12F;
  const std::array<std::array<float, 2>, 5> pole{
      {{0.06F, 0}, {0.06F, 0.05F}, {0.025F, 0.07F}, {0.025F, top}, {0, top}}};
  Mesh post = make_lathe(pole, lamp_segments, 1);
  append(post, make_box({0, -0.012F, top - 0.03F}, {disc.x, 0.012F, top - 0.006F}, 0.004F, 1));
  const float rim = lamp_disc_radius_m + 0.012F;
  const std::array<std::array<float, 2>, 4> shade{
      {{lamp_disc_radius_m, disc.z}, {rim, disc.z}, {0.04F, top}, {0, top}}};
  append(post, make_lathe(shade, lamp_segments, 1), {disc.x, disc.y, 0});
  lamp.add("lamp post", std::move(post), dark_metal, 0.5F, -1, 1, 0);
  Mesh glow;
  const std::array<std::array<float, 2>, 2> flat{{{0, disc.z}, {lamp_disc_radius_m, disc.z}}};
  append(glow, make_lathe(flat, lamp_segments, 1), {disc.x, disc.y, 0});
  lamp.add(std::string(lamp_glow), std::move(glow), {0, 0, 0}, 1, -1, 0);
  SceneDescription scene = lamp.take();
  StandardParameters parameters = standard_parameters(scene.materials.back(), 0);
  std::ranges::copy(lamp_disc_radiance, parameters.emission);
  parameters.emission_gain = emission_gain;
  scene.materials.back() = make_standard_material(std::string(lamp_glow), parameters);
  return scene;
}

std::vector<LocalLight> lights_of_made_lamp(const Placement& set_from_lamp, int count) {
  if (count < 1) throw std::invalid_argument("a lamp shines by at least one light");
  const float area = std::numbers::pi_v<float> * lamp_disc_radius_m * lamp_disc_radius_m /
                     static_cast<float>(count);
  const auto& [red, green, blue] = lamp_disc_radiance;
  std::vector<LocalLight> lights;
  for (int i = 0; i < count; ++i) {
    // A spiral of equal areas.
    //
    // Vogel, "A Better Way to Construct the Sunflower Head", Mathematical Biosciences 1979.
    const float share = (static_cast<float>(i) + 0.5F) / static_cast<float>(count);
    const float radius = count > 1 ? lamp_disc_radius_m * std::sqrt(share) : 0.0F;
    const float turn = static_cast<float>(i) * std::numbers::pi_v<float> * (3 - std::sqrt(5.0F));
    const Vec3f own =
        lamp_disc_middle + Vec3f{radius * std::cos(turn), radius * std::sin(turn), -below_m};
    const Vec3f foot{set_from_lamp[3], set_from_lamp[7], set_from_lamp[11]};
    lights.push_back({turned(set_from_lamp, own) + foot, turned(set_from_lamp, {0, 0, -1}),
                      Vec3f{red, green, blue} * area});
  }
  return lights;
}

}  // namespace render
