// Meshes of an imported model.
#include "render/model_mesh.h"

#include <assimp/mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "render/join_vertices.h"
#include "render/srgb_codes.h"

namespace render {
namespace {

bool finite(const aiVector3D& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
bool is_sound(const aiVector3D& v) {
  constexpr float far = farthest_position;
  return std::abs(v.x) <= far && std::abs(v.y) <= far && std::abs(v.z) <= far;
}
Vec3f vec(const aiVector3D& v) { return {v.x, v.y, v.z}; }

// Normals that are zero or not finite are taken from the faces around them.
void copy_normals(const aiMesh& source, Mesh& mesh) {
  const std::size_t count = mesh.positions.size();
  mesh.normals.resize(count);
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f normal = finite(source.mNormals[i]) ? normalize(vec(source.mNormals[i])) : Vec3f{};
    mesh.normals[i] = normal;
    if (!(dot(normal, normal) > 0.5F)) missing.push_back(i);
  }
  if (missing.empty()) return;
  std::vector<Vec3f> sums(count);
  for (const auto& triangle : mesh.triangles) {
    const Vec3f a = mesh.positions[triangle[0]];
    const Vec3f face = cross(mesh.positions[triangle[1]] - a, mesh.positions[triangle[2]] - a);
    for (const std::uint32_t corner : triangle) sums[corner] += face;
  }
  for (const std::size_t i : missing) {
    const Vec3f normal = normalize(sums[i]);
    mesh.normals[i] = dot(normal, normal) > 0.5F ? normal : Vec3f{0, 0, 1};
  }
}

// Normals of facets that are not those of the corners' order give way to them.
void mend_facets(Mesh& mesh) {
  constexpr float least_cosine = 0.9F;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3f p = mesh.positions[a];
    const Vec3f face = normalize(cross(mesh.positions[b] - p, mesh.positions[c] - p));
    if (!(dot(face, face) > 0.5F)) continue;
    for (const std::uint32_t corner : {a, b, c}) {
      if (dot(mesh.normals[corner], face) < least_cosine) mesh.normals[corner] = face;
    }
  }
}

// Twice a triangle's area in texture coordinates: below 0 where the picture is mirrored, 0 where
// that cannot be told.
float uv_determinant(const std::vector<std::array<float, 2>>& uvs,
                     const std::array<std::uint32_t, 3>& triangle) {
  const auto &a = uvs[triangle[0]], &b = uvs[triangle[1]], &c = uvs[triangle[2]];
  const float determinant = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
  return std::isfinite(determinant) ? determinant : 0;
}

// Vertices that mirrored triangles share with others get a twin, so that each has one sense of
// rotation (as in Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008, section 3.1).
void part_mirrored(Mesh& mesh, const std::vector<std::array<float, 2>>& uvs) {
  constexpr std::uint32_t none = ~0U;
  std::vector<bool> upright(mesh.positions.size(), false);
  for (const auto& triangle : mesh.triangles) {
    if (uv_determinant(uvs, triangle) <= 0) continue;
    for (const std::uint32_t corner : triangle) upright[corner] = true;
  }
  std::vector<std::uint32_t> twin(mesh.positions.size(), none);
  for (auto& triangle : mesh.triangles) {
    if (uv_determinant(uvs, triangle) >= 0) continue;
    for (std::uint32_t& corner : triangle) {
      if (!upright[corner]) continue;
      if (twin[corner] == none) {
        twin[corner] = static_cast<std::uint32_t>(mesh.positions.size());
        append_vertex(mesh, mesh, corner);
      }
      corner = twin[corner];
    }
  }
}

// Tangents along u of a normal map, with the sign that makes cross(normal, tangent) * sign point up
// in it.
void compute_tangents(Mesh& mesh, const UvTransform& of_map) {
  // Whether the map is mirrored by its transform; one that has no area is taken for none.
  const float map_determinant = of_map.u[0] * of_map.v[1] - of_map.u[1] * of_map.v[0];
  const UvTransform map_from_mesh = map_determinant != 0 ? of_map : UvTransform{};
  const bool mirrors = map_determinant < 0;
  const auto& uvs = of_map.second != 0 && !mesh.second_uvs.empty() ? mesh.second_uvs : mesh.uvs;
  part_mirrored(mesh, uvs);
  std::vector<Vec3f> along_u(mesh.positions.size());
  std::vector<Vec3f> along_v(mesh.positions.size());
  for (const auto& triangle : mesh.triangles) {
    const float determinant = uv_determinant(uvs, triangle);
    if (determinant == 0) continue;
    const auto [a, b, c] = triangle;
    const Vec3f e1 = mesh.positions[b] - mesh.positions[a];
    const Vec3f e2 = mesh.positions[c] - mesh.positions[a];
    const auto step_to = [&, &from = uvs[a]](std::uint32_t corner) {
      return map_from_mesh.of_step({uvs[corner][0] - from[0], uvs[corner][1] - from[1]});
    };
    const auto [u1, v1] = step_to(b);
    const auto [u2, v2] = step_to(c);
    const float sign = (determinant > 0) != mirrors ? 1.0F : -1.0F;
    const Vec3f u = normalize((e1 * v2 - e2 * v1) * sign);
    const Vec3f v = normalize((e2 * u1 - e1 * u2) * sign);
    const float area = length(cross(e1, e2));
    for (const std::uint32_t corner : {a, b, c}) {
      along_u[corner] += u * area;
      along_v[corner] += v * area;
    }
  }
  mesh.tangents.resize(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3f n = mesh.normals[i];
    Vec3f t = normalize(along_u[i] - n * dot(n, along_u[i]));
    if (!(dot(t, t) > 0.5F))
      t = normalize(cross(n, std::abs(n.x) < 0.9F ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0}));
    const float sign = dot(cross(n, t), along_v[i]) > 0 ? -1.0F : 1.0F;
    mesh.tangents[i] = {t.x, t.y, t.z, sign};
  }
}

// Each triangle with vertices and a normal of its own.
void make_flat(Mesh& mesh) {
  Mesh flat;
  flat.triangles.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(flat.positions.size());
    const Vec3f p = mesh.positions[a];
    const Vec3f face = normalize(cross(mesh.positions[b] - p, mesh.positions[c] - p));
    for (const std::uint32_t corner : {a, b, c}) {
      append_vertex(flat, mesh, corner);
      flat.normals.push_back(dot(face, face) > 0.5F ? face : Vec3f{0, 0, 1});
    }
    flat.triangles.push_back({first, first + 1, first + 2});
  }
  mesh = std::move(flat);
}

std::vector<std::array<float, 2>> uvs_of(const aiMesh& source, unsigned set) {
  std::vector<std::array<float, 2>> uvs;
  uvs.reserve(source.mNumVertices);
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiVector3D& t = source.mTextureCoords[set][i];
    const float u = t.x, v = 1 - t.y;
    constexpr float most = 1e6F;
    const bool sound = std::abs(u) <= most && std::abs(v) <= most;
    uvs.push_back(sound ? std::array<float, 2>{u, v} : std::array<float, 2>{});
  }
  return uvs;
}

// glTF's are linear, as its colours of materials are, and those of X3D and STL are taken for that.
// Programs that scan or paint write codes of a display to the others.
void copy_colours(const aiMesh& source, const ModelFormat& format, Mesh& mesh) {
  const bool codes = format.ply || format.obj || format.fbx;
  mesh.colours.reserve(source.mNumVertices);
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiColor4D& c = source.mColors[0][i];
    const auto code = [](float value) {
      return static_cast<std::uint8_t>(value > 0 ? std::min(value, 1.0F) * 255 + 0.5F : 0);
    };
    mesh.colours.push_back(codes ? std::array{code(c.r), code(c.g), code(c.b)}
                                 : codes_of_light({c.r, c.g, c.b}));
  }
}

void copy_tangents(const aiMesh& source, Mesh& mesh) {
  mesh.tangents.resize(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (!finite(source.mTangents[i]) || !finite(source.mBitangents[i])) {
      mesh.tangents[i] = {1, 0, 0, 1};
      continue;
    }
    const Vec3f t = normalize(vec(source.mTangents[i]));
    const float sign =
        dot(cross(mesh.normals[i], t), vec(source.mBitangents[i])) < 0 ? -1.0F : 1.0F;
    mesh.tangents[i] = {t.x, t.y, t.z, sign};
  }
}

}  // namespace

ColourRange colour_range(const aiMesh& source) {
  ColourRange range;
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiColor4D& c = source.mColors[0][i];
    for (const float value : {c.r, c.g, c.b}) {
      if (value > range.brightest) range.brightest = value;
    }
    if (c.a < range.least_alpha) range.least_alpha = c.a;
    if (c.a > range.most_alpha) range.most_alpha = c.a;
  }
  return range;
}

Mesh convert_shape(const aiMesh& source, std::size_t& left_out) {
  Mesh mesh;
  mesh.positions.reserve(source.mNumVertices);
  for (unsigned i = 0; i < source.mNumVertices; ++i)
    mesh.positions.push_back(is_sound(source.mVertices[i]) ? vec(source.mVertices[i]) : Vec3f{});
  mesh.triangles.reserve(source.mNumFaces);
  for (unsigned i = 0; i < source.mNumFaces; ++i) {
    const aiFace& face = source.mFaces[i];
    if (face.mNumIndices != 3) continue;
    const std::array<std::uint32_t, 3> triangle{face.mIndices[0], face.mIndices[1],
                                                face.mIndices[2]};
    bool whole = true;
    for (const std::uint32_t corner : triangle) {
      if (corner >= source.mNumVertices)
        throw std::runtime_error("a triangle names vertex " + std::to_string(corner) + " of " +
                                 std::to_string(source.mNumVertices));
      whole = whole && is_sound(source.mVertices[corner]);
    }
    if (whole)
      mesh.triangles.push_back(triangle);
    else
      ++left_out;
  }
  return mesh;
}

Mesh convert_mesh(const aiMesh& source,
                  const ImportedMaterial& material,
                  const ModelFormat& format,
                  bool coloured,
                  std::span<const Vec3f> corner_normals,
                  std::size_t& left_out) {
  Mesh mesh = convert_shape(source, left_out);
  if (source.HasNormals()) copy_normals(source, mesh);
  if (source.HasNormals() && format.stl) mend_facets(mesh);
  const auto has = [&](unsigned set) {
    return set < AI_MAX_NUMBER_OF_TEXTURECOORDS && source.HasTextureCoords(set);
  };
  const unsigned set = has(material.uv_set) ? material.uv_set : 0;
  if (has(set)) mesh.uvs = uvs_of(source, set);
  if (const auto second = material.second_uv_set; second && has(*second) && !mesh.uvs.empty())
    mesh.second_uvs = uvs_of(source, *second);
  if (coloured) copy_colours(source, format, mesh);
  const bool join = format.smooth_normals;
  if (join) join_vertices(mesh, corner_normals);
  if (material.parameters.normal_texture >= 0) {
    if (mesh.normals.empty() && !mesh.uvs.empty()) make_flat(mesh);
    if (source.HasNormals() && source.HasTangentsAndBitangents() && !join)
      copy_tangents(source, mesh);
    else if (!mesh.uvs.empty() && !mesh.normals.empty())
      compute_tangents(mesh, material.parameters.normal_uv);
  }
  return mesh;
}

}  // namespace render
