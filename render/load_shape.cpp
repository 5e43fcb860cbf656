// Shapes of models, corner by corner.
#include "render/load_shape.h"

#include <cstdint>
#include <stdexcept>
#include <utility>

#include "render/join_scenes.h"
#include "render/transform.h"

namespace render {
namespace {

// Where a mirrored instance's corners run the other way round, they are turned back.
template <class Value>
std::vector<Value> by_corners(const Mesh& mesh, const std::vector<Value>& values, bool mirrored) {
  std::vector<Value> result;
  if (values.empty()) return result;
  result.reserve(3 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    for (const std::uint32_t corner : {a, mirrored ? c : b, mirrored ? b : c}) {
      result.push_back(values[corner]);
    }
  }
  return result;
}

MeshShape shape_of(const Mesh& mesh, const Placement& placed) {
  const bool mirrored = determinant(placed) < 0;
  const std::array<float, 9> for_normals = normal_matrix(placed);
  MeshShape shape{by_corners(mesh, mesh.positions, mirrored),
                  by_corners(mesh, mesh.normals, mirrored),
                  by_corners(mesh, mesh.tangents, mirrored)};
  for (Vec3f& p : shape.positions) p = transform_point(placed, p);
  for (Vec3f& n : shape.normals) {
    n = transform_normal(for_normals, n);
    if (mirrored) n = -n;  // out of the corners as they run now
  }
  for (auto& tangent : shape.tangents) {
    const Vec3f t = normalize(transform_vector(placed, {tangent[0], tangent[1], tangent[2]}));
    tangent = {t.x, t.y, t.z, mirrored ? -tangent[3] : tangent[3]};
  }
  return shape;
}

LoadedModel load_whole(const std::string& path, LoadOptions options, const std::stop_token& stop) {
  options.whole = true;
  LoadedModel model = load_model(path, options, stop);
  if (model.report.triangles > most_deforming_triangles) {
    throw std::runtime_error(path + ": it has " + std::to_string(model.report.triangles) +
                             " triangles, but a model that deforms at most " +
                             std::to_string(most_deforming_triangles));
  }
  return model;
}

void check_same(const Mesh& mesh, const MeshShape& shape, const std::string& part) {
  const auto refuse = [&](const std::string& what) { throw std::runtime_error(part + what); };
  if (shape.positions.size() != mesh.positions.size()) {
    refuse(" has " + std::to_string(shape.positions.size() / 3) + " triangles, but in the first " +
           "file " + std::to_string(mesh.positions.size() / 3) +
           ": all shapes must have the same triangles, in the same order");
  }
  if (shape.normals.size() != mesh.normals.size()) {
    refuse(mesh.normals.empty() ? " has normals, which the first file has not"
                                : " has no normals, which the first file has");
  }
  if (shape.tangents.size() < mesh.tangents.size()) {
    refuse(" has no tangents: it needs the normal map and coordinates that the first file has");
  }
}

}  // namespace

LoadedModel load_deforming_model(const std::string& path,
                                 const LoadOptions& options,
                                 const std::stop_token& stop) {
  LoadedModel model = load_whole(path, options, stop);
  std::vector<std::shared_ptr<const Mesh>> meshes;
  for (Instance& instance : model.scene.instances) {
    const Mesh& source = *model.scene.meshes[instance.mesh];
    const bool mirrored = determinant(instance.set_from_object) < 0;
    MeshShape shape = shape_of(source, instance.set_from_object);
    Mesh mesh;
    mesh.uvs = by_corners(source, source.uvs, mirrored);
    mesh.second_uvs = by_corners(source, source.second_uvs, mirrored);
    mesh.colours = by_corners(source, source.colours, mirrored);
    mesh.materials = source.materials;
    mesh.triangles.resize(source.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      mesh.triangles[t] = {3 * t, 3 * t + 1, 3 * t + 2};
    }
    mesh.rest = std::make_shared<const std::vector<Vec3f>>(shape.positions);
    instance.mesh = static_cast<std::uint32_t>(meshes.size());
    instance.set_from_object = as_it_stands;
    instance.moves = true;
    meshes.push_back(in_shape(mesh, std::move(shape)));
  }
  model.scene.meshes = std::move(meshes);
  return model;
}

std::vector<MeshShape> load_shape(const std::string& path,
                                  const LoadOptions& options,
                                  std::span<const DeformingPart> parts,
                                  const std::stop_token& stop) {
  LoadOptions alone = options;
  alone.shape_alone = true;
  const SceneDescription scene = load_whole(path, alone, stop).scene;
  if (scene.instances.size() != parts.size()) {
    throw std::runtime_error(path + ": it has " + std::to_string(scene.instances.size()) +
                             " parts, but the first file " + std::to_string(parts.size()));
  }
  std::vector<MeshShape> shapes;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const Mesh& mesh = *parts[i].mesh;
    MeshShape shape = shape_of(*scene.meshes[instance.mesh], instance.set_from_object);
    check_same(mesh, shape, path + ": its part '" + parts[i].name + "'");
    if (mesh.tangents.empty()) shape.tangents.clear();
    shapes.push_back(std::move(shape));
  }
  return shapes;
}

std::shared_ptr<const Mesh> in_shape(const Mesh& mesh, MeshShape shape) {
  auto result = std::make_shared<Mesh>();
  result->positions = std::move(shape.positions);
  result->normals = std::move(shape.normals);
  result->tangents = std::move(shape.tangents);
  result->uvs = mesh.uvs;
  result->second_uvs = mesh.second_uvs;
  result->colours = mesh.colours;
  result->triangles = mesh.triangles;
  result->materials = mesh.materials;
  result->rest = mesh.rest;
  return result;
}

std::size_t bytes_of(const Mesh& mesh) {
  std::size_t bytes =
      std::span(mesh.triangles).size_bytes() + std::span(mesh.materials).size_bytes();
  for_each_vertex_array(mesh, [&](const auto& v) { bytes += std::span(v).size_bytes(); });
  return bytes;
}

}  // namespace render
