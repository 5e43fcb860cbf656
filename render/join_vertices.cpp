// Equal vertices made one.
#include "render/join_vertices.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>

namespace render {
namespace {

constexpr float crease_cosine = 0.642788F;  // of 50 degrees
constexpr std::size_t most_compared = 256;
constexpr std::uint32_t none = ~0U;

// Numbers of the places at which vertices are: equal positions, equal numbers, in the order of
// their first vertex.
struct Places {
  std::vector<std::uint32_t> of_vertex;
  std::uint32_t count = 0;
};

std::uint64_t hash_of(Vec3f p) {
  std::uint64_t hash = 0;
  for (const float x : {p.x, p.y, p.z}) {
    hash = (hash ^ std::bit_cast<std::uint32_t>(x + 0.0F)) * 0x9E3779B97F4A7C15U;  // -0 is 0
    hash ^= hash >> 32U;
  }
  return hash;
}

Places places_of(const std::vector<Vec3f>& positions) {
  Places places;
  places.of_vertex.resize(positions.size());
  const std::size_t size = std::bit_ceil(2 * positions.size() + 1);
  std::vector<std::uint32_t> first(size, none);  // vertex, by hash
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    std::size_t slot = hash_of(positions[i]) & (size - 1);
    while (first[slot] != none && positions[first[slot]] != positions[i]) {
      slot = (slot + 1) & (size - 1);
    }
    if (first[slot] == none) {
      first[slot] = i;
      places.of_vertex[i] = places.count++;
    } else {
      places.of_vertex[i] = places.of_vertex[first[slot]];
    }
  }
  return places;
}

// Corners (3 x triangle + 0, 1, 2) sorted by place; those of place k begin at begin[k].
struct CornersByPlace {
  std::vector<std::uint32_t> begin, corners;

  CornersByPlace(const Mesh& mesh, const Places& places)
      : begin(places.count + 1, 0), corners(3 * mesh.triangles.size()) {
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t vertex : triangle) ++begin[places.of_vertex[vertex] + 1];
    }
    for (std::size_t k = 1; k < begin.size(); ++k) begin[k] += begin[k - 1];
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    std::uint32_t corner = 0;
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t vertex : triangle) {
        corners[next[places.of_vertex[vertex]]++] = corner++;
      }
    }
  }
  std::span<const std::uint32_t> at(std::uint32_t place) const {
    return std::span(corners).subspan(begin[place], begin[place + 1] - begin[place]);
  }
};

// A triangle's unit normal (zero if it has no area) times the angle at one of its corners.
struct Wedge {
  Vec3f normal;
  float angle = 0;
};

Wedge wedge_at(const Mesh& mesh, std::uint32_t corner) {
  const auto& triangle = mesh.triangles[corner / 3];
  const Vec3f p = mesh.positions[triangle[corner % 3]];
  const Vec3f a = normalize(mesh.positions[triangle[(corner + 1) % 3]] - p);
  const Vec3f b = normalize(mesh.positions[triangle[(corner + 2) % 3]] - p);
  return {normalize(cross(a, b)), std::acos(std::clamp(dot(a, b), -1.0F, 1.0F))};
}

// Normals of the corners at one place.
void make_normals(std::span<const Wedge> wedges, std::vector<Vec3f>& normals) {
  normals.clear();
  const bool compare = wedges.size() < most_compared;
  Vec3f all{};
  for (const Wedge& wedge : wedges) all += wedge.normal * wedge.angle;
  for (const Wedge& own : wedges) {
    Vec3f sum = all;
    if (compare) {
      sum = {};
      const bool flat = !(dot(own.normal, own.normal) > 0.5F);  // has no side: takes any
      for (const Wedge& other : wedges) {
        if (flat || dot(own.normal, other.normal) >= crease_cosine) {
          sum += other.normal * other.angle;
        }
      }
    }
    const Vec3f normal = normalize(sum);
    const bool found = dot(normal, normal) > 0.5F;
    normals.push_back(found                                ? normal
                      : dot(own.normal, own.normal) > 0.5F ? own.normal
                                                           : Vec3f{0, 0, 1});
  }
}

}  // namespace

void join_vertices(Mesh& mesh, std::span<const Vec3f> made) {
  const Places places = places_of(mesh.positions);
  const CornersByPlace by_place(mesh, places);
  const bool has_normals = !mesh.normals.empty();
  const bool has_uvs = !mesh.uvs.empty(), has_second = !mesh.second_uvs.empty();
  const bool has_colours = !mesh.colours.empty();
  Mesh joined;
  joined.triangles.resize(mesh.triangles.size());
  joined.materials = mesh.materials;
  joined.positions.reserve(places.count);
  joined.normals.reserve(places.count);
  if (has_uvs) joined.uvs.reserve(places.count);
  std::vector<Wedge> wedges;
  std::vector<Vec3f> normals;
  for (std::uint32_t place = 0; place < places.count; ++place) {
    const auto corners = by_place.at(place);
    normals.clear();
    wedges.clear();
    if (has_normals) {
      for (const std::uint32_t c : corners)
        normals.push_back(mesh.normals[mesh.triangles[c / 3][c % 3]]);
    } else if (!made.empty()) {
      for (const std::uint32_t c : corners) normals.push_back(made[c]);
    } else {
      for (const std::uint32_t c : corners) wedges.push_back(wedge_at(mesh, c));
      make_normals(wedges, normals);
    }
    const std::size_t first = joined.positions.size();
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const std::uint32_t vertex = mesh.triangles[corners[k] / 3][corners[k] % 3];
      const std::size_t made = joined.positions.size();
      std::size_t same = std::max(first, made - std::min(made, most_compared));
      while (same < made && !(joined.normals[same] == normals[k] &&
                              (!has_uvs || joined.uvs[same] == mesh.uvs[vertex]) &&
                              (!has_second || joined.second_uvs[same] == mesh.second_uvs[vertex]) &&
                              (!has_colours || joined.colours[same] == mesh.colours[vertex]))) {
        ++same;
      }
      if (same == made) {
        append_vertex(joined, mesh, vertex);
        if (!has_normals) joined.normals.push_back(normals[k]);
      }
      joined.triangles[corners[k] / 3][corners[k] % 3] = static_cast<std::uint32_t>(same);
    }
  }
  mesh = std::move(joined);
}

std::vector<std::vector<Vec3f>> normals_across(std::span<const Mesh> meshes) {
  Mesh all;
  for (const Mesh& mesh : meshes) {
    const auto first = static_cast<std::uint32_t>(all.positions.size());
    all.positions.insert(all.positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const auto& [a, b, c] : mesh.triangles) {
      all.triangles.push_back({first + a, first + b, first + c});
    }
  }
  const Places places = places_of(all.positions);
  const CornersByPlace by_place(all, places);
  std::vector<Vec3f> of_corners(3 * all.triangles.size());
  std::vector<Wedge> wedges;
  std::vector<Vec3f> normals;
  for (std::uint32_t place = 0; place < places.count; ++place) {
    const auto corners = by_place.at(place);
    wedges.clear();
    for (const std::uint32_t c : corners) wedges.push_back(wedge_at(all, c));
    make_normals(wedges, normals);
    for (std::size_t k = 0; k < corners.size(); ++k) of_corners[corners[k]] = normals[k];
  }
  std::vector<std::vector<Vec3f>> by_mesh;
  auto begin = of_corners.begin();
  for (const Mesh& mesh : meshes) {
    const auto end = begin + 3 * static_cast<std::ptrdiff_t>(mesh.triangles.size());
    by_mesh.emplace_back(begin, end);
    begin = end;
  }
  return by_mesh;
}

}  // namespace render
