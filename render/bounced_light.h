// Light that dull surfaces send on to each other, as small lamps that stand where light falls.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/light_table.h"
#include "render/scene.h"

namespace render {

struct BounceSettings {
  int lamps = 64;     // at most
  int points = 4096;  // of all surfaces, where the light that falls on them is found
  friend bool operator==(const BounceSettings&, const BounceSettings&) = default;
};

inline constexpr int most_bounce_points = 1 << 14;

// What virtual surfaces of the shader "standard" send back of a table's light, glass, stand-ins and
// live pictures left out: their light is not followed. Points evenly spread over all surfaces, on
// both sides, find by rays what each light sends there; those whose own light leaves the set count
// for nothing. Points that lie and face alike become one lamp in their middle, most lamps where
// most light is that goes on into the set; all light is kept. Where lamps stand depends on the
// planned light alone, and their intensities follow any light of the same table without a ray, so
// that a still set under live light takes none (LocalLight).
//
// What live textures are the colour of counts as grey, whatever they show.
//
// What the lamps send to the points, and so to each other, is found by rays as well: all bounces of
// light are in them. A lamp of some area lights what touches it less than a point would, and has no
// bright spot around it.
//
// Keller, "Instant Radiosity", SIGGRAPH 1997, whose lamps are single hits of random walks. That a
// lamp stands for many points: Walter et al., "Lightcuts", SIGGRAPH 2005. That lamps light each
// other: radiosity (Goral et al., SIGGRAPH 1984), with lamps for its patches.
class BouncedLight {
 public:
  BouncedLight() = default;
  // Of the scene as it stands, under a table's lights and lamps (those of bounced light left out).
  // Deterministic. Throws std::invalid_argument unless lamps are 0 to most_lights, and points 1 to
  // most_bounce_points.
  BouncedLight(const Scene& scene, const LightTable& table, const BounceSettings& settings);

  // The lamps under a table whose lights and lamps are the same but for their energies. Throws
  // std::invalid_argument if they are not as many.
  std::vector<LocalLight> lamps(const LightTable& now) const;
  bool empty() const { return lamps_.empty(); }
  std::uint64_t rays() const { return rays_; }  // that placing them took

 private:
  std::vector<LocalLight> lamps_;
  std::vector<Vec3f> per_light_;  // (lamp, light of the table, then lamps): intensity of a unit
  std::size_t lights_ = 0, locals_ = 0;
  std::uint64_t rays_ = 0;
};

// Bounced light from frame to frame: found anew where the table's plan or lamps, or the standing of
// anything that is no live picture, is another than in the frame before. One thread uses it.
class BounceFollower {
 public:
  // The lamps of a frame, for lights and lamps of `table`: with those not more than a table may
  // hold. Throws as BouncedLight.
  std::vector<LocalLight> follow(const Scene& scene,
                                 const LightTable& table,
                                 const BounceSettings& settings);

 private:
  struct Plan {  // all that BouncedLight depends on
    std::uint64_t parts = 0;
    std::vector<std::array<float, 12>> places;
    std::vector<std::shared_ptr<const Mesh>> shapes;  // of meshes that deform
    std::vector<DirectionalLight> lights;
    std::vector<LocalLight> lamps;
    BounceSettings settings;
    friend bool operator==(const Plan&, const Plan&) = default;
  };
  static Plan plan_of(const Scene& scene, const LightTable& table, const BounceSettings& settings);

  Plan plan_;
  BouncedLight bounced_;
};

}  // namespace render
