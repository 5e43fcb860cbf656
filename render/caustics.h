// Light that clear bodies gather on dull surfaces.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "render/photons.h"

namespace render {

// Who sees them: nothing is found finer than these pixels.
struct CausticView {
  Vec3f camera{};
  float pixel_rad = 0;  // a pixel's width; 0 = any
  friend bool operator==(const CausticView&, const CausticView&) = default;
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
