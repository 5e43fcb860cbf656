// The shader interface: what plugs into the kernel. Shaders are registered by name; a material
// names one and carries its parameter block (mesh.h). All calls are on batches, from many threads
// at once.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "render/environment.h"
#include "render/light_table.h"
#include "render/scene.h"

namespace render {

enum class RayKind : std::uint8_t {
  camera,  // from the camera, or straight on through something thin: what it sees is the picture
  reflection,  // mirrored or scattered in a narrow lobe: sees virtual objects and the environment
  difference,  // a reflection on a real surface: counts only as (what it hits - environment)
  shadow,
};

// Bytes that a shader keeps between surface() and shade().
inline constexpr std::size_t shader_scratch_bytes = 96;

// One point to shade. Filled by the kernel, by surface(), by the kernel again, by shade().
struct ShadePoint {
  // From the kernel.
  HitPoint hit;             // unset for background()
  Vec3f incoming;           // unit, direction of the ray that arrived
  float footprint_m = 0;    // width of the sample's cone here
  float spread_rad = 0;     // by how much that cone widens a metre: its full angle
  Vec3f throughput;         // share of the pixel that this ray carries
  Vec3f plate;              // the pixel's background, scene-linear
  std::uint32_t pixel = 0;  // index in the cell, for patterns
  std::uint32_t slot = 0;   // the sample that the result is added to
  RayKind kind = RayKind::camera;
  std::uint8_t depth = 0;
  // From surface().
  bool receives_light = false;
  Vec3f light_normal;  // unit
  alignas(8) std::array<std::byte, shader_scratch_bytes> scratch;
  // From the kernel: irradiance on light_normal.
  Vec3f irradiance;        // of the light table, as it arrives
  Vec3f irradiance_open;   // the same if no virtual object blocked it
  Vec3f irradiance_lamps;  // of the set's own lamps, as it arrives
  // Bit i = ShadeContext::compact[i]: shines on light_normal if nothing virtual hides it; is seen.
  std::uint32_t compact_open = 0, compact_seen = 0;
  // From shade(): each is multiplied by throughput by the kernel.
  Vec3f radiance;              // added to the pixel
  Vec3f plate_share;           // share of the pixel's background that passes, lamps' light included
  Vec3f plate_passed;          // the same without lamps: what the matte is made from
  bool clipped_plate = false;  // the plate was too bright to tell the surface's albedo
};

// A ray that a shader asks for.
struct NewRay {
  Vec3f origin;
  Vec3f direction;   // unit
  Vec3f throughput;  // the point's own, times the surface's share
  float roughness;   // of the lobe, 0 = mirror: picks the environment's smoothing
  Spread spread;     // of the sample's cone from here on
  RayKind kind;
};

// Where shade() puts rays. Rays whose share is too small are replaced by the environment's (or the
// plate's) light in their direction.
class RaySink {
 public:
  virtual ~RaySink() = default;
  virtual void push(const ShadePoint& from, const NewRay& ray) = 0;
};

struct ShadeContext {
  const SceneDescription* scene = nullptr;
  const Environment* environment = nullptr;
  // Lights that the environment's smoothed levels lack: rough lobes add those that a point sees.
  std::span<const DirectionalLight> compact;
};

// What a lobe of `roughness` mirrors of those compact lights whose bits are set.
Vec3f compact_light(const ShadeContext& context,
                    std::uint32_t lights,
                    Vec3f normal,
                    Vec3f view,
                    float roughness,
                    const Spread& spread);

class Shader {
 public:
  virtual ~Shader() = default;
  // Throws std::invalid_argument if the parameter block is not one of this shader's.
  virtual void check(const SceneDescription& scene, const Material& material) const = 0;
  // Decides light_normal and receives_light, and keeps in scratch what shade() needs.
  virtual void surface(const ShadeContext& context, std::span<ShadePoint* const> points) const = 0;
  // Radiance, the plate's share, and further rays.
  virtual void shade(const ShadeContext& context,
                     std::span<ShadePoint* const> points,
                     RaySink& rays) const = 0;
  // Whether light can pass anywhere: only then transmittance() is ever called.
  virtual bool lets_light_through(const Material& material) const {
    static_cast<void>(material);
    return false;
  }
  // RGB share of light that passes straight through here. For `camera`, `reflection`, `difference`
  // rays a hole is where it is (1, 1, 1); anything less is left to shade().
  virtual Vec3f transmittance(const ShadeContext& context,
                              const Material& material,
                              const HitPoint& hit,
                              Vec3f incoming,
                              RayKind kind) const {
    static_cast<void>(context), static_cast<void>(material), static_cast<void>(hit);
    static_cast<void>(incoming), static_cast<void>(kind);
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
// Throw std::invalid_argument naming what is not there. "standard" and the background "environment"
// are always there.
std::shared_ptr<const Shader> find_shader(std::string_view name);
std::shared_ptr<const BackgroundShader> find_background(std::string_view name);

}  // namespace render
