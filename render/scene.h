// The scene: a description that can be serialised, and its compiled form with Embree's trees.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/mesh.h"

struct RTCSceneTy;
struct RTCDeviceTy;

namespace render {

class BackgroundShader;
class LivePicture;
struct PreparedSurface;
class Shader;
struct Glass;

enum class ObjectKind : std::uint8_t { virtual_object = 0, stand_in = 1 };

// Embree ray masks. What a camera ray sees of the real world is mask_stand_in; of these, those that
// hide virtual objects are mask_occluder too.
inline constexpr unsigned mask_virtual = 1;       // virtual objects
inline constexpr unsigned mask_stand_in = 2;      // stand-ins, seen as the camera sees them
inline constexpr unsigned mask_real_blocker = 4;  // stand-ins that block real light
inline constexpr unsigned mask_occluder = 8;
inline constexpr unsigned mask_mirrored = 16;  // stand-ins that virtual mirrors show
// In the mask of a shadow ray: clear bodies block it.
inline constexpr unsigned ray_glass_blocks = 1U << 31;

struct Instance {
  std::string name;
  std::uint32_t mesh = 0;
  std::array<float, 12> set_from_object{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  // rows of 3x4
  ObjectKind kind = ObjectKind::virtual_object;
  bool blocks_light = true;  // stand-ins only: shadows cast by the real thing it stands for
  bool occludes = true;      // stand-ins only: hides virtual objects behind it
  bool mirrored = false;     // stand-ins only: virtual mirrors show the plate there
  // It is likely to stand elsewhere in the next scene: held apart, so that this takes no building.
  bool moves = false;
  friend bool operator==(const Instance&, const Instance&) = default;
};

struct SceneDescription {
  std::vector<std::shared_ptr<const Mesh>> meshes;
  std::vector<std::shared_ptr<const Texture>> textures;
  std::vector<Material> materials;
  std::vector<Instance> instances;
  std::vector<std::string> videos;  // live textures by name: FrameInputs::videos has their frames
  std::string background = "environment";  // background shader: what camera rays see at the end
  std::uint64_t version = 0;
};

// As bytes and back (little-endian, versioned). parse throws std::runtime_error on anything that is
// truncated, oversized or refers to what is not there.
std::vector<std::byte> serialize(const SceneDescription& scene);
SceneDescription parse_scene(std::span<const std::byte> bytes);

// Number of triangles over all instances.
std::size_t triangle_count(const SceneDescription& scene);

// A point on a surface, in the set's frame.
struct HitPoint {
  Vec3f position;
  Vec3f geometric_normal;  // unit, on the side that `incoming` came from
  Vec3f normal;            // interpolated vertex normal, unit, flipped to the same side
  Vec3f tangent;           // unit, with handedness; zero if the mesh has none
  float handedness = 1;
  float u = 0, v = 0;     // texture coordinates
  Vec3f colour{1, 1, 1};  // interpolated vertex colour, linear
  // How the interpolated normal turns, per metre along `edge` (unit, in the triangle) and across
  // it; 0 where it does not.
  Vec3f edge;
  float turn_along = 0, turn_across = 0, turn_both = 0;
  bool back = false;  // the side that the triangle's corners run clockwise on: from inside a body
  float uv_per_metre = 0;        // texture coordinate units per metre of surface, in the mean
  Vec3f u_slope, v_slope;        // of texture coordinates on the triangle, per metre along it
  float largest_coordinate = 0;  // of the triangle's corners: its rounding is the hit's
  std::uint32_t material = 0;
  std::uint32_t instance = 0;
  bool has_second_uvs = false;  // else what follows is not set
  std::array<float, 2> second_uv;
  Vec3f second_u_slope, second_v_slope;
};

// By how much texture coordinates change over a small step on the surface, in metres.
inline std::array<float, 2> uv_of_step(const HitPoint& hit, Vec3f step) {
  return {dot(hit.u_slope, step), dot(hit.v_slope, step)};
}

// By how much the interpolated normal turns over a small step from the hit, in metres.
inline Vec3f turn_of_normal(const HitPoint& hit, Vec3f step) {
  const Vec3f across = cross(hit.geometric_normal, hit.edge);
  const float a = dot(step, hit.edge), b = dot(step, across);
  return hit.edge * (hit.turn_along * a + hit.turn_both * b) +
         across * (hit.turn_both * a + hit.turn_across * b);
}

// The compiled scene. Immutable once built; safe from any thread. Meshes that are used once are
// placed directly, those used more often, or by what moves, through Embree instances; beside what
// moves, all that is placed directly is an instance too.
class Scene {
 public:
  // Throws std::invalid_argument for indices out of range, std::runtime_error if Embree fails.
  // Triangles that are not finite, or farther away than 1.8e18, are left out and counted.
  // Instances that show a live picture, or a mesh that deforms, must be ones that move.
  using Pictures = std::vector<std::shared_ptr<const LivePicture>>;
  explicit Scene(SceneDescription description, Pictures pictures = {});
  // The same scene, bit for bit, at next to no cost where it differs from `before` only in where
  // moving instances stand and in its pictures; and at little where meshes that deform (Mesh::rest)
  // have other shapes. One that has other triangles, or another rest, has its own tree built anew;
  // with other materials, the whole scene is.
  Scene(SceneDescription description, const Scene& before, Pictures pictures = {});
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  const SceneDescription& description() const;
  // Differs between any two scenes of this process.
  std::uint64_t id() const;
  RTCSceneTy* embree() const;
  // The point that Embree's ids and barycentric u, v name. `incoming` is the ray's direction.
  void read_hit(unsigned geom_id,
                unsigned prim_id,
                unsigned inst_id,
                float u,
                float v,
                const Vec3f& incoming,
                HitPoint& hit) const;
  HitPoint hit_point(unsigned geom_id,
                     unsigned prim_id,
                     unsigned inst_id,
                     float u,
                     float v,
                     Vec3f incoming) const {
    HitPoint hit;
    read_hit(geom_id, prim_id, inst_id, u, v, incoming, hit);
    return hit;
  }
  // Begins to fetch from memory what read_hit() will read for `count` hits; those that are none
  // are left out.
  void fetch_hits(const unsigned* geom_ids,
                  const unsigned* prim_ids,
                  const unsigned* inst_ids,
                  std::size_t count) const;
  // Instance and material that Embree's ids name, without the rest.
  struct Surface {
    std::uint32_t instance = 0, material = 0;
    friend bool operator==(const Surface&, const Surface&) = default;
  };
  Surface surface_of(unsigned geom_id, unsigned prim_id, unsigned inst_id) const;
  // The same of a normal that Embree gives, which is in the object's frame inside an instance.
  Vec3f normal_in_set(unsigned inst_id, Vec3f normal) const;
  const Shader& shader_of(std::uint32_t material) const;
  // Of a material of the shader "glass"; null for others.
  const Glass* glass_of(std::uint32_t material) const;
  bool has_glass() const;
  bool has_moving() const;  // whether any instance does
  // Whether any stand-in hides nothing, so that rays which meet it may see what is behind.
  bool has_standing_back() const;
  bool has_mirrored() const;  // whether any stand-in is
  const BackgroundShader& background() const;
  // Whether any stand-in blocks light; whether any surface lets some through.
  bool has_real_blockers() const;
  bool has_filters() const;
  // Bounds in the set: of all virtual objects; of everything. Empty: lower > upper.
  struct Bounds {
    Vec3f lower, upper;
  };
  Bounds virtual_bounds() const;
  Bounds bounds() const;
  // Of all that blocks light (virtual objects, real blockers), and a few tighter boxes that hold
  // it.
  Bounds blocker_bounds() const;
  const std::vector<Bounds>& blocker_boxes() const;
  // What glows by itself, of meshes that do not deform, by parts that are apart (glowing_parts.h).
  struct GlowingPart {
    Bounds bounds;
    float radiance = 0;  // the most, of any colour
  };
  const std::vector<GlowingPart>& glowing_parts() const;
  std::size_t skipped_triangles() const;  // left out
  const Pictures& pictures() const;
  const std::vector<PreparedSurface>& prepared() const;  // by Shader::prepare()
  bool shows_pictures(std::uint32_t instance) const;     // whether any is live on it
  // Whether it does nothing but glow by live pictures and let pass what is behind
  // (Shader::only_shows): what rays find without it holds then, less what it hides.
  bool shows_apart(std::uint32_t instance) const;
  // Where the moving instances of a scene stand, what they show, and what else it is made of.
  struct Places {
    std::uint64_t parts = 0;  // differs between scenes that share nothing
    std::vector<std::array<float, 12>> set_from_object;
    std::vector<Bounds> bounds;
    std::vector<Pictures> pictures;                   // that each shows
    std::vector<std::uint8_t> apart;                  // Scene::shows_apart()
    std::vector<std::shared_ptr<const Mesh>> shapes;  // of each; null: it does not deform
  };
  const Places& places() const;
  // Bounds, before and after, of what stands elsewhere in `now`, has another shape or shows another
  // picture; nothing if more than that differs.
  static std::optional<std::vector<Bounds>> moved(const Places& before, const Places& now);
  // The same of what does not show pictures apart.
  static std::optional<std::vector<Bounds>> moved_but_apart(const Places& before,
                                                            const Places& now);

 private:
  struct Part;
  struct MeshTree;
  class TreePool;
  struct Compiled;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render
