// The shader interface: what plugs into the kernel. Shaders are registered by name; a material
// names one and carries its parameter block (mesh.h). All calls are on batches, from many threads
// at once.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/area_footprint.h"
#include "render/environment.h"
#include "render/glass.h"
#include "render/live_picture.h"
#include "render/scene.h"
#include "render/texture.h"

namespace render {

enum class RayKind : std::uint8_t {
  camera,  // from the camera, or straight on through something thin: what it sees is the picture
  bent,    // turned by clear bodies since, or mirrored by what is virtual to where a stand-in shows
           // in mirrors: sees what the camera does, and the plate elsewhere
  reflection,  // mirrored or scattered in a narrow lobe: sees virtual objects, stand-ins that are
               // mirrored (as a bent one), and the environment
  difference,  // a reflection on a real surface: counts only as (what it hits - environment)
  shadow,
};

inline constexpr std::uint16_t no_picture_ray = 0xFFFF, not_painted = 0xFFFF;

// A look-up of a live texture at (u, v).
struct SeenVideo {
  std::int32_t index = -1;  // of SceneDescription::videos, or none
  float u = 0, v = 0;
  UvFootprint footprint;  // see find_video_samples
  float blur_uv = 0;
};

// One point to shade. Filled by the kernel, then by shade(). A shader never sees the light: it says
// how its surface answers to it, so that the answer can be kept while the light changes.
struct ShadePoint {
  // From the kernel.
  HitPoint hit;             // unset for background()
  Vec3f incoming;           // unit, direction of the ray that arrived
  float footprint_m = 0;    // width of the sample's cone here
  float blur_m = 0;         // width here of the rough lobe that a ray in its middle stands for
  Spread steps;             // across that cone: how the hit moves on the surface, in metres,
  Spread turns;             // ... and how `incoming` turns
  Vec3f throughput;         // share of the pixel that this ray carries
  std::uint32_t pixel = 0;  // index in the cell, for patterns
  std::uint32_t slot = 0;   // the sample that the result is added to
  std::uint16_t behind = no_picture_ray;  // what its path passed that pictures may come before
  std::uint16_t painted = not_painted;    // where its matte light waits for `paint`
  RayKind kind = RayKind::camera;
  std::uint8_t depth = 0;
  std::uint32_t path = 1;  // a number for the surfaces' rays that led here
  Media media;             // that the ray arrived in
  // From shade(), cleared before: all that is sent back along `incoming`. Each is multiplied by
  // throughput by the kernel.
  Vec3f radiance;               // its own light
  SeenVideo video;              // ... that a live texture shows,
  Vec3f video_gain;             // ... times this
  Vec3f diffuse;                // radiance per irradiance on light_normal,
  SeenVideo paint;              // ... times what this live texture shows
  Vec3f light_normal;           // unit
  Vec3f plate_share;            // share of the pixel's background that passes
  Vec3f environment_share;      // of the environment's radiance straight on, where a ray leaves
  bool catches_shadow = false;  // plate_share falls with the irradiance that virtual objects take
  bool catches_lamps = false;   // shows the set's lamps on the plate, or where that tells nothing,
  Vec3f albedo;                 // ... on a surface of this albedo
};

// A ray that a shader asks for, in the middle of a lobe.
struct NewRay {
  Vec3f origin;
  Vec3f direction;   // unit
  Vec3f throughput;  // the point's own, times the surface's share
  Vec3f normal;      // that the lobe lies about; zero = straight through
  float roughness;   // of the lobe, 0 = mirror: picks the environment's smoothing
  Spread spread;     // of the sample's cone from here on; nothing = as it came
  RayKind kind;
  std::optional<Media> media = {};  // that it goes on in; nothing = that the point is in
};

// Fills footprint, steps and turns of a point with its hit and incoming: the cone of a sample whose
// ray came `distance_m` far, and where it began moved by `steps` across it, while its direction
// turned by `turns`. Of first order.
//
// Igehy, "Tracing Ray Differentials", SIGGRAPH 1999, section 3.
void arrive(ShadePoint& p, const Spread& steps, const Spread& turns, float distance_m);

// How directions change across the cone of a sample that is mirrored at a surface of unit normal
// `normal` to the unit direction `view` that it came from. From the same paper.
Spread mirrored_spread(const ShadePoint& p, Vec3f normal, Vec3f view);

// Where shade() puts rays. Rays whose share is too small are replaced by the environment's (or the
// plate's) light in their direction.
class RaySink {
 public:
  virtual ~RaySink() = default;
  virtual void push(const ShadePoint& from, const NewRay& ray) = 0;
};

// Rays that look for pictures, side by side.
struct SightRays {
  std::size_t count = 0;
  const float *ox = nullptr, *oy = nullptr, *oz = nullptr;
  const float *dx = nullptr, *dy = nullptr, *dz = nullptr;  // unit
  const float* far_m = nullptr;  // where they end; of what is none, 0 or less
};
// Those that look for lights: they end there.
struct LightRays {
  SightRays rays;
  // How wide each begins, in metres, and by how much it widens a metre.
  const float *width_m = nullptr, *cone_rad = nullptr;
  float *red = nullptr, *green = nullptr, *blue = nullptr;  // what passes, so far
};
// Where a ray meets a picture, and what it sees of it.
struct Sight {
  std::uint32_t ray = 0;
  float distance_m = 0;
  Vec3f position, normal;  // unit, on the side that the ray comes from
  float u = 0, v = 0, uv_per_metre = 0;
  float footprint_m = 0;                 // how wide it looks, from who asks
  Vec3f radiance{}, passed = {1, 1, 1};  // of what is behind
};

class StandingPicture;

// What a shader has found out beforehand about an instance and the pictures on it: what it may ask
// at every point without finding it again. Immutable, and refers to nothing but pictures.
class Prepared {
 public:
  virtual ~Prepared() = default;
  // Of what only shows (Shader::only_shows()); else null.
  virtual const StandingPicture* picture() const { return nullptr; }
};

// A picture that only shows, where it stands: rays look at it without any tree.
class StandingPicture : public Prepared {
 public:
  const StandingPicture* picture() const final { return this; }
  // Whether it shows nothing anywhere in this frame, and may be passed over.
  virtual bool shows_nothing() const = 0;
  // Dims rays by what the picture lets pass of each, as Shader::transmittance() says.
  virtual void dim(const LightRays& rays) const = 0;
  // Adds where rays meet it before they end, in their order.
  virtual void meet(const SightRays& rays, std::vector<Sight>& sights) const = 0;
  // What such sights show, as Shader::layer() says.
  virtual void see(std::span<Sight> sights) const = 0;
};

struct PreparedSurface {
  std::uint32_t instance = 0, material = 0;
  std::shared_ptr<const Prepared> prepared;
};

struct ShadeContext {
  const SceneDescription* scene = nullptr;
  const Scene* compiled = nullptr;  // for shade()
  std::span<const std::shared_ptr<const LivePicture>> pictures = {};
  std::span<const PreparedSurface> prepared = {};
  TextureFilter texture_filter = TextureFilter::dense;

  // What Shader::prepare() gave for the surface, or null.
  const Prepared* prepared_for(const HitPoint& hit) const {
    for (const PreparedSurface& surface : prepared) {
      if (surface.instance == hit.instance && surface.material == hit.material) {
        return surface.prepared.get();
      }
    }
    return nullptr;
  }
};

// What a picture adds to what is behind it, and the share of that which it lets pass.
struct Layer {
  Vec3f radiance;
  Vec3f passed;
  Vec3f albedo = {};  // of a matte one that the set's light falls on, as far as it covers
  std::optional<Vec3f> lit_through = {};  // of light to matte surfaces, if that is not `passed`
};

class Shader {
 public:
  virtual ~Shader() = default;
  // Throws std::invalid_argument if the parameter block is not one of this shader's.
  virtual void check(const SceneDescription& scene, const Material& material) const = 0;
  // How the surface answers to light, and further rays. Where a ray is pushed, the kernel also adds
  // what its lobe mirrors of compact lights.
  virtual void shade(const ShadeContext& context,
                     std::span<ShadePoint* const> points,
                     RaySink& rays) const = 0;
  // Whether light can pass anywhere: only then transmittance() is ever called.
  virtual bool lets_light_through(const Material& material) const {
    static_cast<void>(material);
    return false;
  }
  // Whether what a point glows by is the mean over all that its sample sees: then what neighbours
  // differ by is no edge.
  virtual bool glows_by_means() const { return false; }
  // The most radiance, of any colour, that it sends out by itself.
  virtual float glow(const Material& material) const {
    static_cast<void>(material);
    return 0;
  }
  // What transmittance() says of shadows where it is the same anywhere on the surface, which then
  // has no holes: it is not called.
  virtual std::optional<Vec3f> shadow_everywhere(const Material& material) const {
    static_cast<void>(material);
    return std::nullopt;
  }
  // The scene's live pictures that the material shows. What its instances hide and show changes
  // with any of them, as if they moved. Called when scenes are compiled.
  virtual std::vector<std::size_t> pictures_of(const Material& material) const {
    static_cast<void>(material);
    return {};
  }
  // Whether, with pictures, it does nothing on a mesh but what layer() tells, without any albedo.
  // Then prepare() gives a StandingPicture.
  virtual bool only_shows(const Material& material, const Mesh& mesh) const {
    static_cast<void>(material), static_cast<void>(mesh);
    return false;
  }
  // Called when a scene is made, for every instance that shows live pictures by the material,
  // unless the scene before had it at the same place with the same ones: at most once a frame. All
  // that pictures_of() names are there.
  virtual std::shared_ptr<const Prepared> prepare(
      const Material& material,
      const Mesh& mesh,
      const std::array<float, 12>& set_from_object,
      std::span<const std::shared_ptr<const LivePicture>> pictures) const {
    static_cast<void>(material), static_cast<void>(mesh);
    static_cast<void>(set_from_object), static_cast<void>(pictures);
    return nullptr;
  }
  // Of shaders that glow or are matte, and let light pass straight on: what shade() gives, for the
  // reference's paths. `incoming`: unit, direction of the ray, which is of that kind;
  // `footprint_m`: width of the square of surface whose mean is wanted.
  virtual std::optional<Layer> layer(const ShadeContext& context,
                                     const Material& material,
                                     const HitPoint& hit,
                                     Vec3f incoming,
                                     RayKind kind,
                                     float footprint_m) const {
    static_cast<void>(context), static_cast<void>(material), static_cast<void>(hit);
    static_cast<void>(incoming), static_cast<void>(kind), static_cast<void>(footprint_m);
    return std::nullopt;
  }
  // RGB share of light that passes straight through here. For `camera`, `reflection`, `difference`
  // rays a hole is where it is (1, 1, 1); anything less is left to shade(). `footprint_m`: no less
  // than the width of surface that the ray stands for; 0 of shadow rays, infinite if not known.
  virtual Vec3f transmittance(const ShadeContext& context,
                              const Material& material,
                              const HitPoint& hit,
                              Vec3f incoming,
                              RayKind kind,
                              float footprint_m) const {
    static_cast<void>(context), static_cast<void>(material), static_cast<void>(hit);
    static_cast<void>(incoming), static_cast<void>(kind), static_cast<void>(footprint_m);
    return {0, 0, 0};
  }
};

// What a ray that leaves the scene sees.
class BackgroundShader {
 public:
  virtual ~BackgroundShader() = default;
  virtual void shade(const ShadeContext& context, std::span<ShadePoint* const> points) const = 0;
};

// Adds a shader. Call at start-up, before threads. Registering a name again replaces it for scenes
// that are built later.
void register_shader(std::string name, std::shared_ptr<const Shader> shader);
void register_background(std::string name, std::shared_ptr<const BackgroundShader> shader);
// Throw std::invalid_argument naming what is not there. "standard", "glass" and the background
// "environment" are always there.
std::shared_ptr<const Shader> find_shader(std::string_view name);
std::shared_ptr<const BackgroundShader> find_background(std::string_view name);

}  // namespace render
