// Paths of light, one at a time: the inside of the reference.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "render/environment_sampler.h"
#include "render/light_table.h"
#include "render/sample_sequence.h"
#include "render/scene.h"
#include "render/standard.h"
#include "render/video_texture.h"

namespace render {

// What paths meet and follow. The masks are Embree's, of scene.h.
struct PathRules {
  bool diffuse_bounces = false;  // follow light between diffuse surfaces
  bool sees_background = false;  // a camera path that leaves the scene sees the environment
  unsigned camera_mask = mask_virtual | mask_stand_in;
  unsigned scattered_mask = mask_virtual;  // rays mirrored or scattered at a surface
  unsigned diffuse_blockers = mask_virtual | mask_real_blocker;  // of the environment and lamps
  unsigned lobe_blockers = mask_virtual;                         // of the environment in the lobes
  bool caustics = false;  // clear bodies bend what dull surfaces get, too: none goes straight on
  int max_depth = 4096;
};

// Where a path sees the plate.
struct PathEnd {
  Vec3f through{1, 1, 1};  // share of the light there that reaches the start
  bool bent = false;       // by a clear body or mirror: the plate is that of here, not of its pixel
  bool mirrored = false;   // by the latter
  std::optional<HitPoint> stand_in;  // that it met; or it left the scene
  Vec3f incoming;
};

// What a camera path gathered, and where it sees the plate: of one that parts at surfaces all ends.
struct CameraPath {
  Vec3f radiance;
  std::vector<PathEnd> ends;
};

struct Layer;  // shader.h

// The lobes of a surface, and one of them: inside.
struct PathLobes;
enum class PathLobe : std::uint8_t;

// Traces through one scene under one environment. Safe from any thread; all arguments must outlive
// it. Unbiased, but for caustics of smooth surfaces on diffuse ones, which are blurred where a
// path leaves those, and clear bodies, through which what is dull sees the light straight on unless
// the rules say otherwise.
//
// The environment is sampled at every surface in proportion to its light, and the lobes in
// proportion to theirs, both weighted by the balance heuristic (Veach and Guibas, "Optimally
// Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995). Lamps light diffuse
// surfaces; in mirrors and lobes they are seen as the glowing surface that they are samples of.
// Without lamps, and with diffuse bounces, glowing surfaces light others where paths meet them.
class PathTracer {
 public:
  // Throws std::invalid_argument if a material is neither "standard", "glass", "stand_in" nor one
  // that shows a live picture.
  PathTracer(const Scene& scene,
             const EnvironmentSampler& environment,
             std::span<const LocalLight> lamps,
             const PathRules& rules,
             std::span<const VideoTexture* const> videos = {});

  CameraPath camera_path(Vec3f origin, Vec3f direction, SampleSequence& numbers) const;
  // Radiance along a ray that left a real surface, and whether it met a virtual object. Where
  // that mirrors the plate it ends.
  struct Scattered {
    Vec3f radiance;
    bool met = false;
    std::vector<PathEnd> ends;
  };
  Scattered scattered_path(Vec3f origin,
                           Vec3f direction,
                           unsigned mask,
                           SampleSequence& numbers) const;

  // Irradiance of the lamps on a point, as it arrives.
  Vec3f lamp_irradiance(const HitPoint& hit, Vec3f normal) const;
  // One sample of the irradiance of the environment that clear bodies bend or mirror to a point.
  Vec3f bent_irradiance(const HitPoint& hit, Vec3f normal, SampleSequence& numbers) const;
  // One sample of the irradiance that virtual objects send to a point, what they let pass left out.
  Vec3f virtual_irradiance(const HitPoint& hit, SampleSequence& numbers) const;

  const PathRules& rules() const { return rules_; }
  const Scene& scene() const { return scene_; }
  const EnvironmentSampler& environment() const { return environment_; }

 private:
  struct Walk;
  void walk(Walk& w, SampleSequence& numbers) const;
  static bool survives(Walk& w, SampleSequence& numbers);
  void add_sky(const Walk& w, Vec3f& radiance) const;
  bool sees_plate(const Walk& w) const;
  bool ends_at(const Walk& w, const Instance& stand_in) const;
  Vec3f environment_light(const HitPoint& hit,
                          const StandardSurface& surface,
                          const StandardWeights& weights,
                          const PathLobes& lobes,
                          Vec3f view,
                          bool mirrors_plate,
                          SampleSequence& numbers) const;
  void pass_glass(Walk& w, const HitPoint& hit, SampleSequence& numbers) const;
  std::optional<Layer> layer_at(const Walk& w, const HitPoint& hit) const;
  static bool pass_layer(Walk& w, const HitPoint& hit, const Layer& layer);
  bool scatter(Walk& w,
               const HitPoint& hit,
               const StandardSurface& surface,
               const StandardWeights& weights,
               const PathLobes& lobes,
               PathLobe by,
               SampleSequence& numbers) const;
  StandardSurface surface_at(const HitPoint& hit) const;
  Vec3f paint_at(const HitPoint& hit) const;

  const Scene& scene_;
  const EnvironmentSampler& environment_;
  std::span<const LocalLight> lamps_;
  PathRules rules_;
  std::span<const VideoTexture* const> videos_;
  struct Surfacing {
    StandardParameters parameters;
    bool matte = false;  // a stand-in: all its light is diffuse
    bool glass = false;
    bool picture = false;
  };
  std::vector<Surfacing> materials_;
};

}  // namespace render
