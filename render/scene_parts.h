// What a compiled scene holds. Private to render: includes Embree.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
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
  std::uint32_t instance = none;  // none: inside an instanced scene
  const Vec3f* positions = nullptr;
  std::vector<Vec3f> normals;                   // placed; empty: the mesh's own
  std::vector<std::uint32_t> triangle_of_prim;  // empty: prim is the triangle
  static constexpr std::uint32_t none = ~0U;
};

// All of a scene but where its moving instances stand.
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
  RTCScene placed = nullptr;                            // what is placed directly
  std::vector<RTCScene> mesh_scenes;                    // of instanced meshes, else null
  std::vector<std::unique_ptr<Part>> parts;             // of both
  std::vector<const Part*> part_of_geometry;            // of `placed`
  std::vector<std::vector<const Part*>> parts_of_mesh;  // inside instanced scenes
  std::vector<std::array<float, 9>> normal_matrices;    // per instance; of what moves, as it began
  std::vector<Bounds> mesh_bounds;                      // of meshes that move, in their own frame
  std::vector<std::vector<std::size_t>> pictures_of_mesh;     // of the scene's, that it shows
  std::vector<std::vector<std::uint32_t>> shown_by_material;  // per mesh: those that show them
  Bounds virtual_bounds = no_bounds, all_bounds = no_bounds;  // of what does not move
  std::vector<Bounds> blocker_boxes;                          // of it
  std::size_t skipped = 0;
  bool two_level = false;  // something moves
  bool real_blockers = false;
  bool filters = false;
  bool has_glass = false;

  Compiled() = default;
  Compiled(const Compiled&) = delete;
  Compiled& operator=(const Compiled&) = delete;
  ~Compiled() {
    for (RTCScene s : mesh_scenes) {
      if (s) rtcReleaseScene(s);
    }
    if (placed) rtcReleaseScene(placed);
    if (device) rtcReleaseDevice(device);
  }

  void build(const SceneDescription& scene);
  void find_pictures(const SceneDescription& scene);
  void add_parts(const SceneDescription& scene,
                 std::uint32_t mesh_index,
                 std::uint32_t instance,
                 unsigned mask,
                 RTCScene target);
  void add_part(const SceneDescription& scene,
                std::uint32_t mesh_index,
                std::uint32_t instance,
                unsigned mask,
                RTCScene target,
                bool with_filter,
                const std::vector<std::uint32_t>& triangles,
                bool all);
};

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
  std::vector<std::array<float, 9>> normal_matrices;  // per instance
  std::vector<std::uint8_t> mirrored;                 // per instance: inside out by its matrix
  Bounds virtual_bounds = no_bounds, all_bounds = no_bounds, blocker_bounds = no_bounds;
  std::vector<Bounds> blocker_boxes;

  ~Impl() {
    if (scene) rtcReleaseScene(scene);
  }

  void assemble();
  void prepare(const Impl* before);
  void add_instance(std::uint32_t instance, RTCScene inner);

  const Part& part(unsigned geom_id, unsigned inst_id, std::uint32_t& instance) const {
    const bool placed =
        inst_id == RTC_INVALID_GEOMETRY_ID || instance_of_geometry[inst_id] == Part::none;
    if (placed) {
      const Part& found = *compiled->part_of_geometry[geom_id];
      instance = found.instance;
      return found;
    }
    instance = instance_of_geometry[inst_id];
    return *compiled->parts_of_mesh[description.instances[instance].mesh][geom_id];
  }
  HitPoint hit_point(
      unsigned geom_id, unsigned prim_id, unsigned inst_id, float u, float v, Vec3f incoming) const;

  static const Impl& of(const RTCFilterFunctionNArguments* args) {
    return *reinterpret_cast<const TraceContext*>(args->context)->scene->impl_;
  }
  static void filter_closest(const RTCFilterFunctionNArguments* args);
  static void filter_any(const RTCFilterFunctionNArguments* args);
  struct FilteredRay {
    Vec3f origin, direction;
  };
  FilteredRay ray_of(const RTCFilterFunctionNArguments* args, unsigned lane) const;
  Vec3f passes(const RTCFilterFunctionNArguments* args, unsigned lane, RayKind kind) const;
  bool is_past_picture(const RTCFilterFunctionNArguments* args) const;
  bool stands_back(const RTCFilterFunctionNArguments* args, unsigned lane) const;
};

}  // namespace render
