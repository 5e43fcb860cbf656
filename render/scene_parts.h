// What a compiled scene holds. Private to render: includes Embree.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "render/blocker_boxes.h"
#include "render/embree_context.h"
#include "render/glass.h"
#include "render/scene.h"
#include "render/shader.h"

namespace render {

inline std::uint32_t material_of(const Mesh& mesh, std::uint32_t triangle) {
  return mesh.materials[mesh.materials.size() == 1 ? 0 : triangle];
}

// One Embree geometry of a mesh: its opaque triangles, or those that need a filter.
struct Scene::Part {
  std::uint32_t mesh = 0;
  std::uint32_t instance = none;  // none: inside a tree of the mesh's own
  bool filtered = false;
  Vec3f* positions = nullptr;                   // Embree's
  std::vector<Vec3f> normals;                   // placed; empty: the mesh's own
  std::vector<std::uint32_t> triangle_of_prim;  // empty: prim is the triangle
  static constexpr std::uint32_t none = ~0U;
};

// How far a mesh's triangles have come apart from those that they lie beside at rest.
class Disorder {
 public:
  Disorder(const std::vector<Vec3f>& rest,
           const std::vector<std::array<std::uint32_t, 3>>& triangles);

  // How many times larger the boxes about what lies together at rest are than they were, measured
  // by the triangles' areas. `skipped`: triangles that do not count, ascending. Infinite where a
  // triangle that counts is not finite at rest.
  double of(const Mesh& mesh, const std::vector<std::uint32_t>& skipped) const;

 private:
  double spread(const std::vector<Vec3f>& positions,
                const std::vector<std::array<std::uint32_t, 3>>& triangles,
                const std::vector<std::uint32_t>& skipped) const;

  std::vector<std::uint16_t> group_of_triangle_;
  std::vector<std::uint32_t> skipped_;  // at rest
  std::size_t groups_ = 0;
  double spread_ = 0;  // at rest
};

// The tree of one mesh, through which its instances are traced.
struct Scene::MeshTree {
  std::shared_ptr<const Mesh> mesh;  // Embree reads its triangles
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<std::unique_ptr<Part>> parts;  // by geometry
  std::vector<std::uint32_t> skipped;        // triangles that are left out, ascending
  // Of a mesh that deforms:
  std::unique_ptr<const Disorder> disorder;
  bool for_rest = false;  // built for the shape at rest, then fitted
  Bounds bounds = no_bounds;

  MeshTree() = default;
  MeshTree(const MeshTree&) = delete;
  MeshTree& operator=(const MeshTree&) = delete;
  ~MeshTree() { clear(); }
  void clear() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
    scene = nullptr;
    device = nullptr;
    parts.clear();
  }
};

// Trees of meshes that deform which no scene uses any more, for scenes to come. Safe from any
// thread.
class Scene::TreePool {
 public:
  explicit TreePool(std::size_t meshes) : free_(meshes) {}

  std::unique_ptr<MeshTree> take(std::uint32_t mesh);  // null if there is none
  // The tree comes back when nobody uses it any more.
  static std::shared_ptr<const MeshTree> lend(const std::shared_ptr<TreePool>& pool,
                                              std::uint32_t mesh,
                                              std::unique_ptr<MeshTree> tree);

 private:
  void give_back(std::uint32_t mesh, std::unique_ptr<MeshTree> tree);

  std::mutex mutex_;
  std::vector<std::array<std::unique_ptr<MeshTree>, 2>> free_;  // per mesh
};

// All of a scene but where its moving instances stand, and the shapes of meshes that deform.
struct Scene::Compiled {
  std::uint64_t id = 0;                                  // of this process
  std::vector<std::shared_ptr<const Mesh>> kept_meshes;  // Embree reads their triangles
  std::vector<std::shared_ptr<const Shader>> shaders;    // per material
  std::shared_ptr<const BackgroundShader> background;
  std::vector<std::optional<Glass>> glass;   // per material
  std::vector<std::uint8_t> filtered;        // per material
  std::vector<std::optional<Vec3f>> shadow;  // per material: what passes for shadows anywhere on it
  std::vector<std::uint8_t> may_stand_back;  // per mesh: of a stand-in that does not occlude
  std::vector<std::uint8_t> instanced;       // per mesh: used more than once, or by what moves
  RTCDevice device = nullptr;
  RTCScene placed = nullptr;                           // what is placed directly
  std::vector<std::unique_ptr<Part>> parts;            // of `placed`, by geometry
  std::vector<std::shared_ptr<const MeshTree>> trees;  // of instanced meshes that stay as they are
  std::shared_ptr<TreePool> pool;                      // of those that deform
  std::vector<std::array<float, 9>> normal_matrices;   // per instance; of what moves, as it began
  std::vector<Bounds> mesh_bounds;                     // of meshes that move, in their own frame
  std::vector<std::vector<std::size_t>> pictures_of_mesh;     // of the scene's, that it shows
  std::vector<std::vector<std::uint32_t>> shown_by_material;  // per mesh: those that show them
  std::vector<std::uint8_t> shows_apart;  // per mesh: pictures, by Shader::only_shows() alone
  Bounds virtual_bounds = no_bounds, all_bounds = no_bounds;  // of what does not move
  std::vector<Bounds> blocker_boxes;                          // of it
  std::vector<GlowingPart> glowing_parts;                     // of it
  std::vector<std::vector<GlowingPart>>
      moving_glowing_parts;  // per mesh that moves, in its own frame
  std::size_t skipped = 0;
  bool two_level = false;  // something moves
  bool stands_back = false;
  bool has_mirrored = false;
  bool real_blockers = false;
  bool filters = false;
  bool has_glass = false;

  Compiled() = default;
  Compiled(const Compiled&) = delete;
  Compiled& operator=(const Compiled&) = delete;
  ~Compiled() {
    if (placed) rtcReleaseScene(placed);
    if (device) rtcReleaseDevice(device);
  }

  void build(const SceneDescription& scene);
  void find_pictures(const SceneDescription& scene);

  // Where a mesh's triangles go.
  struct Target {
    RTCScene scene = nullptr;
    std::vector<std::unique_ptr<Part>>& parts;
    std::uint32_t instance = Part::none;  // whose place they are put to
    unsigned mask = ~0U;
    const std::vector<Vec3f>* rest = nullptr;  // in place of the mesh's own positions
  };
  void add_parts(const SceneDescription& scene,
                 std::uint32_t mesh_index,
                 const std::vector<std::uint32_t>& skipped,
                 const Target& target) const;
  void add_part(const SceneDescription& scene,
                std::uint32_t mesh_index,
                const Target& target,
                bool with_filter,
                const std::vector<std::uint32_t>& triangles,
                bool all) const;
  void build_tree(const SceneDescription& scene,
                  std::uint32_t mesh_index,
                  bool for_rest,
                  MeshTree& tree) const;
  // Of a mesh that deforms and has triangles.
  std::shared_ptr<const MeshTree> fit_tree(const SceneDescription& scene,
                                           std::uint32_t mesh_index) const;
};

// Triangles of a mesh that cannot be traced, for a corner is not finite or too far, ascending.
std::vector<std::uint32_t> untraceable_triangles(
    const std::vector<Vec3f>& positions,
    const std::vector<std::array<std::uint32_t, 3>>& triangles);

// Throws std::runtime_error if Embree has failed since the last call.
void check_built(RTCDevice device);

// Of the positions that can be traced.
Scene::Bounds bounds_of(const Mesh& mesh, const std::array<float, 12>& set_from_mesh);

// A triangle in the set.
struct Facet {
  std::array<Vec3f, 3> corners;
  Vec3f normal;  // unit; 0 where it has no area
  float largest_coordinate = 0;
  float uv_per_metre = 0;
  Vec3f u_slope, v_slope;
};
// `set_from_mesh` is where its positions still stand in the mesh's frame.
Facet facet_of(const Mesh& mesh,
               const Vec3f* positions,
               std::uint32_t triangle,
               const std::array<float, 12>* set_from_mesh);

struct Scene::Impl {
  std::uint64_t id = 0;
  SceneDescription description;
  std::shared_ptr<const Compiled> compiled;
  RTCScene scene = nullptr;
  // By geometry of `scene`: the instance that it is, or Part::none where it holds what is placed.
  std::vector<std::uint32_t> instance_of_geometry;
  Places places;
  Pictures pictures;
  std::vector<PreparedSurface> prepared;
  std::vector<std::shared_ptr<const MeshTree>> trees;  // per mesh; null: placed, or empty
  std::vector<std::array<float, 9>> normal_matrices;   // per instance
  std::vector<std::uint8_t> mirrored;                  // per instance: inside out by its matrix
  Bounds virtual_bounds = no_bounds, all_bounds = no_bounds, blocker_bounds = no_bounds;
  std::vector<Bounds> blocker_boxes;
  std::vector<GlowingPart> glowing_parts;
  std::size_t skipped = 0;
  // Per instance: of few triangles, as of a floor, or a billboard, which most of its rays only
  // pass.
  std::vector<std::vector<Facet>> facets;

  ~Impl() {
    if (scene) rtcReleaseScene(scene);
  }

  void find_trees(const Impl* before);
  void assemble(const Impl* before);
  void prepare(const Impl* before);
  void add_instance(std::uint32_t instance, RTCScene inner);

  const Part& part(unsigned geom_id, unsigned inst_id, std::uint32_t& instance) const {
    const bool placed =
        inst_id == RTC_INVALID_GEOMETRY_ID || instance_of_geometry[inst_id] == Part::none;
    if (placed) {
      const Part& found = *compiled->parts[geom_id];
      instance = found.instance;
      return found;
    }
    instance = instance_of_geometry[inst_id];
    return *trees[description.instances[instance].mesh]->parts[geom_id];
  }
  void read_hit(unsigned geom_id,
                unsigned prim_id,
                unsigned inst_id,
                float u,
                float v,
                const Vec3f& incoming,
                HitPoint& hit) const;

  static const Impl& of(const RTCFilterFunctionNArguments* args) {
    return *reinterpret_cast<const TraceContext*>(args->context)->scene->impl_;
  }
  static void filter_closest(const RTCFilterFunctionNArguments* args);
  static void filter_any(const RTCFilterFunctionNArguments* args);
  struct FilteredRay {
    Vec3f origin, direction;
  };
  FilteredRay ray_of(const RTCFilterFunctionNArguments* args, unsigned lane) const;
  Vec3f passes(const RTCFilterFunctionNArguments* args,
               unsigned lane,
               RayKind kind,
               float cone_rad) const;
  bool is_past_picture(const RTCFilterFunctionNArguments* args) const;
  bool stands_back(const RTCFilterFunctionNArguments* args, unsigned lane) const;
};

}  // namespace render
