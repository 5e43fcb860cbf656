// Light that clear bodies gather on dull surfaces.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "render/light_table.h"
#include "render/scene.h"

namespace render {

struct CausticSettings {
  int photons = 0;         // that leave the lights, in all; 0 = none do
  float accuracy = 0.97F;  // what falls below a quarter of 1 - accuracy is not followed
  Vec3f camera{};          // nothing is found finer than its pixels,
  float pixel_rad = 0;     // which are that wide
  friend bool operator==(const CausticSettings&, const CausticSettings&) = default;
};

inline constexpr int most_caustic_photons = 1 << 20;
// Lights that are followed: the brightest of those that have some of the table's light.
inline constexpr std::size_t most_caustic_lights = 16;
inline constexpr float least_caustic_share = 0.02F;

// Where light falls that came through clear bodies, or was mirrored by them, in place of what goes
// straight through them: the irradiance that it makes anywhere, per unit of each light's own, so
// that it follows live light without a ray.
//
// A grid of photons falls from each light on what box each body has, so that no light is lost or
// comes twice: a body's photons are those that meet it first. At each surface both ways are
// followed (glass.h), to the first surface that is not clear. A photon knows to first order where
// its neighbours of the grid went, and those from its light's rim: it falls as an ellipse that they
// fill, and so a few are smooth where they spread and sharp where they meet.
//
// Jensen, "Global Illumination using Photon Maps", EGWR 1996; the ellipses: Schjoth et al., "Photon
// Differentials", GRAPHITE 2007.
class Caustics {
 public:
  // Under the planned light of a table. Deterministic.
  Caustics(const Scene& scene, const LightTable& planned, const CausticSettings& settings);

  // The lights that are followed, by their number in the table, ascending: what goes straight
  // through clear bodies of their light is none.
  const std::vector<std::uint32_t>& lights() const { return lights_; }
  bool follows(std::uint32_t light) const {
    return light < follows_.size() && follows_[light] != 0;
  }
  // Irradiance on a surface per unit of the irradiance of lights()[number]. The normal is unit.
  Vec3f at(std::size_t number, Vec3f position, Vec3f normal) const;

  // Differs where anything that at() says does.
  std::uint64_t key() const { return key_; }
  // A few boxes that hold all places where at() says anything.
  std::vector<Scene::Bounds> regions() const;
  // Whether anything in those boxes may be in a photon's way.
  bool pass(const std::vector<Scene::Bounds>& boxes) const;
  std::size_t landed() const { return landed_; }     // photons
  std::size_t rays() const { return ways_.size(); }  // that they took

  // A photon's straight way from one surface to the next, or to nowhere.
  struct Way {
    Vec3f from, direction;
    float far_m = 0;
  };
  // What one photon lights: an ellipse on the surface where it fell.
  struct Spot {
    Vec3f centre, normal;
    Vec3f across, along;    // in the surface: its rim is where their products with an offset have a
                            // sum of squares of 1
    Vec3f peak;             // irradiance in its middle
    float thickness_m = 0;  // how far off the surface it still counts
    Scene::Bounds bounds;
  };

 private:
  // Spots that lie close to each other lie under one node: the children of node i are 2i + 1 and
  // 2i + 2, and the leaves hold equal runs of spots.
  struct Spots {
    std::vector<Spot> spots;
    std::vector<Scene::Bounds> nodes;
    std::size_t leaves = 0;

    void build();
    Vec3f at(Vec3f position, Vec3f normal) const;

   private:
    void sort(std::size_t node, std::size_t first, std::size_t last);
  };

  std::vector<std::uint32_t> lights_;
  std::vector<std::uint8_t> follows_;  // by light of the table
  std::vector<Spots> spots_;           // by followed light
  std::vector<Way> ways_;
  std::uint64_t key_ = 0;
  std::size_t landed_ = 0;
};

// Caustics from frame to frame: found anew where a body of glass has moved, or anything into or out
// of a photon's way, or the planned light, the camera or the settings are others. One thread uses
// it.
class CausticFollower {
 public:
  // Null where there are none: no photons are asked for, or nothing clear is there.
  std::shared_ptr<const Caustics> follow(const Scene& scene,
                                         const LightTable& planned,
                                         const CausticSettings& settings);

 private:
  struct Plan {  // all that they depend on
    Scene::Places places;
    std::vector<DirectionalLight> lights;
    CausticSettings settings;
  };
  std::optional<Plan> plan_;
  std::shared_ptr<const Caustics> caustics_;
};

}  // namespace render
