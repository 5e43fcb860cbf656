// Light on its way through clear bodies, as photons.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/light_table.h"
#include "render/scene.h"

namespace render {

struct PhotonSettings {
  int photons = 0;         // that leave the lights, in all; 0 = none do
  float accuracy = 0.97F;  // what falls below a quarter of 1 - accuracy is not followed
  friend bool operator==(const PhotonSettings&, const PhotonSettings&) = default;
};

inline constexpr int most_caustic_photons = 1 << 18;
// Lights that are followed: the brightest of those that have some of the table's light.
inline constexpr std::size_t most_caustic_lights = 16;
inline constexpr float least_caustic_share = 0.02F;

// Where light falls that came through clear bodies, or was mirrored by them, in place of what goes
// straight through them.
//
// A grid of photons falls from each light on what box each body has, so that no light is lost or
// comes twice: a body's photons are those that meet it first. At each surface both ways are
// followed (glass.h), to the first surface that is not clear. A photon knows to first order where
// its neighbours of the grid went, and those from its light's rim.
class Photons {
 public:
  // Under the planned light of a table. Deterministic.
  Photons(const Scene& scene, const LightTable& planned, const PhotonSettings& settings);

  // The lights that are followed, by their number in the table, ascending: what goes straight
  // through clear bodies of their light is none.
  const std::vector<std::uint32_t>& lights() const { return lights_; }
  bool follows(std::uint32_t light) const {
    return light < follows_.size() && follows_[light] != 0;
  }
  // Whether anything in those boxes may be in a photon's way, or is one of the bodies.
  bool pass(const std::vector<Scene::Bounds>& boxes) const;
  std::size_t rays() const { return rays_; }

  // A photon that has fallen on a surface.
  struct Landing {
    Vec3f position, normal;
    Vec3f share;  // of its light's irradiance times a square metre
    // How far away its neighbours fell: two of the grid, two from the light's rim.
    std::array<Vec3f, 4> neighbours;
  };
  // By followed light.
  const std::vector<std::vector<Landing>>& landings() const { return landings_; }
  // A photon's straight way from one surface to the next, or to nowhere.
  struct Way {
    Vec3f from, direction;
    float far_m = 0;
  };

 private:
  std::vector<std::uint32_t> lights_;
  std::vector<std::uint8_t> follows_;  // by light of the table
  std::vector<std::vector<Landing>> landings_;
  std::vector<Way> ways_;
  bool knows_all_ways_ = true;
  std::size_t rays_ = 0;
};

}  // namespace render
