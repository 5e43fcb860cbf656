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

struct PhotonSettings {
  int photons = 0;         // that leave the lights, in all; 0 = none do
  float accuracy = 0.97F;  // what falls below a quarter of 1 - accuracy is not followed
  friend bool operator==(const PhotonSettings&, const PhotonSettings&) = default;
};

// Who sees them: nothing is found finer than these pixels.
struct CausticView {
  Vec3f camera{};
  float pixel_rad = 0;  // a pixel's width; 0 = any
  friend bool operator==(const CausticView&, const CausticView&) = default;
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

// The irradiance that photons make anywhere, per unit of each light's own, so that it follows live
// light without a ray. Each lights an ellipse that its neighbours fill: so a few of them are smooth
// where they spread and sharp where they meet.
//
// Jensen, "Global Illumination using Photon Maps", EGWR 1996; the ellipses: Schjoth et al., "Photon
// Differentials", GRAPHITE 2007.
class Caustics {
 public:
  Caustics(std::shared_ptr<const Photons> photons, const CausticView& view);

  const Photons& photons() const { return *photons_; }
  // Irradiance on a surface per unit of the irradiance of photons().lights()[number]. The normal is
  // unit.
  Vec3f at(std::size_t number, Vec3f position, Vec3f normal) const;

  // Differs where anything that at() says does.
  std::uint64_t key() const { return key_; }
  // A few boxes that hold all places where at() says anything.
  std::vector<Scene::Bounds> regions() const;

  // What one photon lights.
  struct Spot {
    Vec3f centre, normal;
    // In the surface: its rim is where their products with an offset have a sum of squares of 1.
    Vec3f across, along;
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

  std::shared_ptr<const Photons> photons_;
  std::vector<Spots> spots_;  // by followed light
  std::uint64_t key_ = 0;
};

// Caustics from frame to frame. Photons are found anew where a body of glass has moved, or anything
// into or out of a photon's way, or the planned light or the settings are others. One thread uses
// it.
class CausticFollower {
 public:
  // Null where there are none: no photons are asked for, or nothing clear is there.
  std::shared_ptr<const Caustics> follow(const Scene& scene,
                                         const LightTable& planned,
                                         const PhotonSettings& settings,
                                         const CausticView& view);

 private:
  struct Plan {  // all that photons depend on
    Scene::Places places;
    std::vector<DirectionalLight> lights;
    PhotonSettings settings;
  };
  std::optional<Plan> plan_;
  std::shared_ptr<const Photons> photons_;
  CausticView view_;
  std::shared_ptr<const Caustics> caustics_;
};

}  // namespace render
