// Scenes into Embree's trees: once what stands still, then again and again what moves.
#include <algorithm>
#include <stdexcept>

#include "render/glowing_parts.h"
#include "render/scene_parts.h"
#include "render/transform.h"

namespace render {
namespace {

constexpr std::size_t most_facets = 16;

unsigned mask_of(const Instance& instance) {
  if (instance.kind == ObjectKind::virtual_object) return mask_virtual;
  return mask_stand_in | (instance.blocks_light ? mask_real_blocker : 0U) |
         (instance.occludes ? mask_occluder : 0U) | (instance.mirrored ? mask_mirrored : 0U);
}

// Where an instance's tree stands, for Embree, which asks for a way back: what is flat is made
// three millionths as thick as it is large: less than rays start off it (offset_origin). Hits are
// read by the matrix itself. False if it is less than flat, so that nobody can see it.
bool stand_tree(const std::array<float, 12>& set_from_object, std::array<float, 12>& placed) {
  placed = set_from_object;
  const auto column = [&](std::size_t i) {
    return Vec3f{set_from_object[i], set_from_object[4 + i], set_from_object[8 + i]};
  };
  const auto row = [&](std::size_t i) {
    return Vec3f{set_from_object[4 * i], set_from_object[4 * i + 1], set_from_object[4 * i + 2]};
  };
  // The largest of three directions across two of them each: across all, if they are flat.
  const auto across = [](const auto& of) {
    Vec3f most{};
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3f v = cross(of(i), of((i + 1) % 3));
      if (length(v) > length(most)) most = v;
    }
    return most;
  };
  const float size = std::max({length(column(0)), length(column(1)), length(column(2))});
  const Vec3f out = across(column), in = across(row);
  constexpr float least = 1e-30F, thin = 3e-6F;
  if (!(length(out) > least) || !(length(out) > 1e-7F * size * size)) return false;
  if (std::abs(determinant(set_from_object)) > 0.1F * thin * size * length(out)) return true;
  const Vec3f to = normalize(out) * (thin * size), from = normalize(in);
  const std::array<float, 3> t{to.x, to.y, to.z}, f{from.x, from.y, from.z};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) placed[4 * i + k] += t[i] * f[k];
  }
  return true;
}

// A box around a box that is moved.
Scene::Bounds placed_bounds(const Scene::Bounds& box, const std::array<float, 12>& m) {
  if (!(box.lower.x <= box.upper.x)) return no_bounds;
  Scene::Bounds bounds = no_bounds;
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3f p =
        transform_point(m, {(i & 1U ? box.upper : box.lower).x, (i & 2U ? box.upper : box.lower).y,
                            (i & 4U ? box.upper : box.lower).z});
    bounds = joined(bounds, {p, p});
  }
  return bounds;
}

}  // namespace

void check_built(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw std::runtime_error("Embree could not build the scene (error " +
                           std::to_string(static_cast<int>(error)) + "): is memory short?");
}

void Scene::Compiled::build(const SceneDescription& description) {
  kept_meshes = description.meshes;
  std::vector<float> glow;  // per material
  for (const Material& material : description.materials) {
    const std::shared_ptr<const Shader>& shader =
        shaders.emplace_back(find_shader(material.shader));
    shader->check(description, material);
    glow.push_back(shader->glow(material));
    shadow.push_back(shader->shadow_everywhere(material));
    filtered.push_back(shader->lets_light_through(material) ? 1 : 0);
    glass.push_back(material.shader == "glass" ? std::optional(make_glass(material))
                                               : std::nullopt);
    has_glass = has_glass || glass.back();
  }
  background = find_background(description.background);
  device = rtcNewDevice("");
  if (!device) throw std::runtime_error("Embree could not start on this machine");
  placed = rtcNewScene(device);
  rtcSetSceneBuildQuality(placed, RTC_BUILD_QUALITY_MEDIUM);

  const std::size_t meshes = description.meshes.size();
  std::vector<int> uses(meshes, 0);
  may_stand_back.assign(meshes, 0);
  instanced.assign(meshes, 0);
  mesh_bounds.assign(meshes, no_bounds);
  moving_glowing_parts.resize(meshes);
  for (const Instance& instance : description.instances) {
    if (++uses[instance.mesh] > 1 || instance.moves) instanced[instance.mesh] = 1;
    two_level = two_level || instance.moves;
    if (instance.kind == ObjectKind::stand_in && !instance.occludes) {
      may_stand_back[instance.mesh] = 1;
      stands_back = true;
    }
  }
  trees.resize(meshes);
  pool = std::make_shared<TreePool>(meshes);
  find_pictures(description);
  for (std::uint32_t i = 0; i < description.instances.size(); ++i) {
    const Instance& instance = description.instances[i];
    const Mesh& mesh = *description.meshes[instance.mesh];
    normal_matrices.push_back(normal_matrix(instance.set_from_object));
    if (mesh.rest) {  // its bounds are its shape's
    } else if (instance.moves) {
      mesh_bounds[instance.mesh] = bounds_of(mesh, Instance{}.set_from_object);
      moving_glowing_parts[instance.mesh] =
          find_glowing_parts(mesh, Instance{}.set_from_object, glow);
    } else {
      const Bounds bounds = bounds_of(mesh, instance.set_from_object);
      const auto parts_of_mesh = find_glowing_parts(mesh, instance.set_from_object, glow);
      glowing_parts.insert(glowing_parts.end(), parts_of_mesh.begin(), parts_of_mesh.end());
      all_bounds = joined(all_bounds, bounds);
      if (instance.kind == ObjectKind::virtual_object) {
        virtual_bounds = joined(virtual_bounds, bounds);
      }
    }
    real_blockers |= instance.kind == ObjectKind::stand_in && instance.blocks_light;
    has_mirrored |= instance.kind == ObjectKind::stand_in && instance.mirrored;
    if (mesh.rest) {  // also of one without triangles: its next shape may have some
      filters |= std::ranges::any_of(mesh.materials, [&](auto m) { return filtered[m] != 0; });
    } else if (mesh.triangles.empty()) {
      continue;
    } else if (instanced[instance.mesh] == 0) {
      const auto left_out = untraceable_triangles(mesh.positions, mesh.triangles);
      skipped += left_out.size();
      add_parts(description, instance.mesh, left_out, {placed, parts, i, mask_of(instance)});
    } else if (!trees[instance.mesh]) {
      auto tree = std::make_shared<MeshTree>();
      tree->mesh = description.meshes[instance.mesh];
      tree->skipped = untraceable_triangles(mesh.positions, mesh.triangles);
      skipped += tree->skipped.size();
      build_tree(description, instance.mesh, false, *tree);
      filters |= std::ranges::any_of(tree->parts, [](const auto& part) { return part->filtered; });
      trees[instance.mesh] = std::move(tree);
    }
  }
  filters |= std::ranges::any_of(parts, [](const auto& part) { return part->filtered; });
  if (two_level) rtcCommitScene(placed);
  blocker_boxes = find_blocker_boxes(description);
  check_built(device);
}

void Scene::Compiled::find_pictures(const SceneDescription& description) {
  for (const auto& mesh : description.meshes) {
    std::vector<std::size_t>& shown = pictures_of_mesh.emplace_back();
    std::vector<std::uint32_t>& by = shown_by_material.emplace_back();
    for (const std::uint32_t material : mesh->materials) {
      if (std::ranges::find(by, material) != by.end()) continue;
      const auto pictures = shaders[material]->pictures_of(description.materials[material]);
      if (!pictures.empty()) by.push_back(material);
      for (const std::size_t picture : pictures) {
        if (std::ranges::find(shown, picture) == shown.end()) shown.push_back(picture);
      }
    }
    const bool one = mesh->materials.size() == 1 && by.size() == 1;
    shows_apart.push_back(one && shaders[by[0]]->only_shows(description.materials[by[0]], *mesh));
  }
  for (const Instance& instance : description.instances) {
    if (!pictures_of_mesh[instance.mesh].empty() && !instance.moves) {
      throw std::invalid_argument("scene: object " + instance.name +
                                  " shows a live picture, but is not one that moves");
    }
  }
}

void Scene::Impl::add_instance(std::uint32_t instance, RTCScene inner) {
  RTCGeometry geometry = rtcNewGeometry(compiled->device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, inner);
  const bool all_placed = instance == Part::none;
  const Instance still;
  const Instance& placing = all_placed ? still : description.instances[instance];
  std::array<float, 12> place;
  const bool is_there = stand_tree(placing.set_from_object, place);
  if (!is_there) {
    const Instance nowhere;
    std::copy_n(nowhere.set_from_object.begin(), place.size(), place.begin());
  }
  rtcSetGeometryMask(geometry, all_placed ? ~0U : is_there ? mask_of(placing) : 0U);
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, place.data());
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, static_cast<unsigned>(instance_of_geometry.size()));
  rtcReleaseGeometry(geometry);
  instance_of_geometry.push_back(instance);
}

// Of meshes that deform, those that the scene before has are its own.
void Scene::Impl::find_trees(const Impl* before) {
  if (before && before->compiled != compiled) before = nullptr;
  trees = compiled->trees;
  skipped = compiled->skipped;
  std::vector<std::uint8_t> used(trees.size(), 0);
  for (const Instance& instance : description.instances) used[instance.mesh] = 1;
  for (std::uint32_t i = 0; i < trees.size(); ++i) {
    const std::shared_ptr<const Mesh>& mesh = description.meshes[i];
    if (!mesh->rest || mesh->triangles.empty() || used[i] == 0) continue;
    const bool same = before && before->description.meshes[i] == mesh;
    trees[i] = same ? before->trees[i] : compiled->fit_tree(description, i);
    skipped += trees[i]->skipped.size();
  }
}

// Puts the scene together from what is compiled.
void Scene::Impl::assemble(const Impl* before) {
  find_trees(before);
  const Compiled& c = *compiled;
  places.parts = c.id;
  if (c.two_level) {
    scene = rtcNewScene(c.device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    if (!c.parts.empty()) add_instance(Part::none, c.placed);
  } else {
    scene = c.placed;
    rtcRetainScene(scene);
    instance_of_geometry.assign(c.parts.size(), Part::none);
  }
  virtual_bounds = c.virtual_bounds;
  all_bounds = c.all_bounds;
  blocker_boxes = c.blocker_boxes;
  glowing_parts = c.glowing_parts;
  normal_matrices = c.normal_matrices;
  for (std::uint32_t i = 0; i < description.instances.size(); ++i) {
    const Instance& instance = description.instances[i];
    mirrored.push_back(determinant(instance.set_from_object) < 0 ? 1 : 0);
    const std::shared_ptr<const Mesh>& mesh = description.meshes[instance.mesh];
    const MeshTree* tree = trees[instance.mesh].get();
    if (tree) add_instance(i, tree->scene);
    facets.emplace_back();
    if (!mesh->rest && mesh->triangles.size() <= most_facets) {
      for (std::uint32_t t = 0; t < mesh->triangles.size(); ++t) {
        facets[i].push_back(facet_of(*mesh, mesh->positions.data(), t, &instance.set_from_object));
      }
    }
    if (!instance.moves) continue;
    normal_matrices[i] = normal_matrix(instance.set_from_object);
    const Bounds own =
        mesh->rest ? (tree ? tree->bounds : no_bounds) : c.mesh_bounds[instance.mesh];
    const Bounds bounds = placed_bounds(own, instance.set_from_object);
    places.set_from_object.push_back(instance.set_from_object);
    places.shapes.push_back(mesh->rest ? mesh : nullptr);
    places.apart.push_back(c.shows_apart[instance.mesh]);
    Pictures& shown = places.pictures.emplace_back();
    for (const std::size_t picture : c.pictures_of_mesh[instance.mesh]) {
      if (picture >= pictures.size() || !pictures[picture]) {
        throw std::invalid_argument("scene: object " + instance.name +
                                    " shows a live picture that is not there");
      }
      shown.push_back(pictures[picture]);
    }
    places.bounds.push_back(bounds);
    for (const auto& [box, radiance] : c.moving_glowing_parts[instance.mesh]) {
      glowing_parts.push_back({placed_bounds(box, instance.set_from_object), radiance});
    }
    all_bounds = joined(all_bounds, bounds);
    if (instance.kind == ObjectKind::virtual_object) {
      virtual_bounds = joined(virtual_bounds, bounds);
    }
    if (blocks(instance) && bounds.lower.x <= bounds.upper.x) blocker_boxes.push_back(bounds);
  }
  for (const Bounds& box : blocker_boxes) blocker_bounds = joined(blocker_bounds, box);
  rtcCommitScene(scene);
  check_built(c.device);
}

// What is as it was in the scene before is prepared already.
void Scene::Impl::prepare(const Impl* before) {
  if (before && before->places.parts != places.parts) before = nullptr;
  std::size_t moving = 0;
  for (std::uint32_t i = 0; i < description.instances.size(); ++i) {
    const Instance& instance = description.instances[i];
    if (!instance.moves) continue;
    const std::size_t place = moving++;
    const bool same = before &&
                      before->places.set_from_object[place] == places.set_from_object[place] &&
                      before->places.pictures[place] == places.pictures[place];
    for (const std::uint32_t material : compiled->shown_by_material[instance.mesh]) {
      PreparedSurface surface{i, material, nullptr};
      if (same) {
        const auto known = std::ranges::find_if(before->prepared, [&](const PreparedSurface& s) {
          return s.instance == i && s.material == material;
        });
        if (known != before->prepared.end()) surface.prepared = known->prepared;
      } else {
        surface.prepared = compiled->shaders[material]->prepare(description.materials[material],
                                                                *description.meshes[instance.mesh],
                                                                instance.set_from_object, pictures);
      }
      if (surface.prepared) prepared.push_back(std::move(surface));
    }
  }
}

}  // namespace render
