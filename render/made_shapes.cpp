// Rectangles, boxes and lathed solids.
#include "render/made_shapes.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace render {
namespace {

using Index = std::uint32_t;

void add_face(Mesh& mesh, std::span<const Vec3f> corners, Vec3f normal, Vec3f along, float tile_m) {
  const auto first = static_cast<Index>(mesh.positions.size());
  const Vec3f up = cross(normal, along);
  const float scale = 1 / tile_m;
  for (const Vec3f p : corners) {
    mesh.positions.push_back(p);
    mesh.normals.push_back(normal);
    mesh.uvs.push_back({dot(p, along) * scale, -dot(p, up) * scale});
  }
  for (Index i = 2; i < corners.size(); ++i) {
    mesh.triangles.push_back({first, first + i - 1, first + i});
  }
}

// The direction in a face that texture u runs along: level where the face is not.
Vec3f level_direction(Vec3f normal) {
  const Vec3f level = cross(Vec3f{0, 0, 1}, normal);
  return length(level) < 1e-3F ? Vec3f{1, 0, 0} : normalize(level);
}

}  // namespace

Mesh make_rectangle(Vec3f corner, Vec3f along, Vec3f up, float tile_m) {
  Mesh mesh;
  mesh.positions = {corner, corner + along, corner + along + up, corner + up};
  mesh.normals.assign(4, normalize(cross(along, up)));
  const float u = tile_m > 0 ? length(along) / tile_m : 1;
  const float v = tile_m > 0 ? length(up) / tile_m : 1;
  mesh.uvs = {{0, v}, {u, v}, {u, 0}, {0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

Mesh make_box(Vec3f lower, Vec3f upper, float bevel, float tile_m) {
  Mesh mesh;
  const Vec3f middle = (lower + upper) * 0.5F;
  const Vec3f half = (upper - lower) * 0.5F;
  const std::array<float, 3> h{half.x, half.y, half.z};
  const auto point = [&](const std::array<float, 3>& p) {
    return middle + Vec3f{p[0], p[1], p[2]};
  };
  const auto unit = [](std::size_t axis, float sign) {
    std::array<float, 3> n{};
    n[axis] = sign;
    return Vec3f{n[0], n[1], n[2]};
  };
  constexpr std::array<float, 2> signs{-1, 1};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t b = (axis + 1) % 3;
    const std::size_t c = (axis + 2) % 3;
    for (const float sign : signs) {  // the six faces
      std::array<Vec3f, 4> corners;
      constexpr std::array<std::array<float, 2>, 4> around{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
      for (std::size_t i = 0; i < 4; ++i) {
        const auto& s = around[sign > 0 ? i : 3 - i];
        std::array<float, 3> p{};
        p[axis] = sign * h[axis];
        p[b] = s[0] * (h[b] - bevel);
        p[c] = s[1] * (h[c] - bevel);
        corners[i] = point(p);
      }
      const Vec3f normal = unit(axis, sign);
      add_face(mesh, corners, normal, level_direction(normal), tile_m);
    }
    if (bevel <= 0) continue;
    for (const float sb : signs) {  // the four edges along this axis
      for (const float sc : signs) {
        const auto corner = [&](float along, bool first) {
          std::array<float, 3> p{};
          p[axis] = along * (h[axis] - bevel);
          p[b] = sb * (first ? h[b] : h[b] - bevel);
          p[c] = sc * (first ? h[c] - bevel : h[c]);
          return point(p);
        };
        std::array<Vec3f, 4> corners{corner(-1, true), corner(1, true), corner(1, false),
                                     corner(-1, false)};
        if (sb * sc > 0) std::swap(corners[1], corners[3]);
        const Vec3f normal = normalize(unit(b, sb) + unit(c, sc));
        add_face(mesh, corners, normal, level_direction(normal), tile_m);
      }
    }
  }
  if (bevel > 0) {  // the eight corners
    for (const float sx : signs) {
      for (const float sy : signs) {
        for (const float sz : signs) {
          std::array<Vec3f, 3> corners{
              point({sx * h[0], sy * (h[1] - bevel), sz * (h[2] - bevel)}),
              point({sx * (h[0] - bevel), sy * h[1], sz * (h[2] - bevel)}),
              point({sx * (h[0] - bevel), sy * (h[1] - bevel), sz * h[2]})};
          if (sx * sy * sz < 0) std::swap(corners[1], corners[2]);
          const Vec3f normal = normalize(Vec3f{sx, sy, sz});
          add_face(mesh, corners, normal, level_direction(normal), tile_m);
        }
      }
    }
  }
  return mesh;
}

Mesh make_lathe(std::span<const std::array<float, 2>> profile, int segments, float tile_m) {
  Mesh mesh;
  float along = 0;
  for (std::size_t ring = 1; ring < profile.size(); ++ring) {
    const auto [r0, z0] = profile[ring - 1];
    const auto [r1, z1] = profile[ring];
    const float slant = std::hypot(r1 - r0, z1 - z0);
    if (slant <= 0) continue;
    const auto first = static_cast<Index>(mesh.positions.size());
    for (int i = 0; i <= segments; ++i) {
      const float turn = static_cast<float>(i) / static_cast<float>(segments);
      const float angle = 2 * std::numbers::pi_v<float> * turn;
      const float c = std::cos(angle);
      const float s = std::sin(angle);
      const Vec3f normal{c * (z1 - z0) / slant, s * (z1 - z0) / slant, (r0 - r1) / slant};
      mesh.positions.push_back({r0 * c, r0 * s, z0});
      mesh.positions.push_back({r1 * c, r1 * s, z1});
      mesh.normals.insert(mesh.normals.end(), 2, normal);
      mesh.uvs.push_back({turn, -along / tile_m});
      mesh.uvs.push_back({turn, -(along + slant) / tile_m});
    }
    for (Index i = 0; i < static_cast<Index>(segments); ++i) {
      const Index a = first + 2 * i;
      if (r0 > 0) mesh.triangles.push_back({a, a + 2, a + 1});
      if (r1 > 0) mesh.triangles.push_back({a + 1, a + 2, a + 3});
    }
    along += slant;
  }
  return mesh;
}

void append(Mesh& whole, const Mesh& part, Vec3f position, float yaw_rad) {
  const float c = std::cos(yaw_rad);
  const float s = std::sin(yaw_rad);
  const auto turned = [&](Vec3f v) { return Vec3f{c * v.x - s * v.y, s * v.x + c * v.y, v.z}; };
  const auto first = static_cast<Index>(whole.positions.size());
  for (const Vec3f p : part.positions) whole.positions.push_back(turned(p) + position);
  for (const Vec3f n : part.normals) whole.normals.push_back(turned(n));
  whole.uvs.insert(whole.uvs.end(), part.uvs.begin(), part.uvs.end());
  for (const auto& t : part.triangles) {
    whole.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  whole.materials.insert(whole.materials.end(), part.materials.begin(), part.materials.end());
}

}  // namespace render
