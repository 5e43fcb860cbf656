// Rectangles, boxes, lathed solids, tubes and cushions.
#include "render/made_shapes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>
#include <string>

#include "render/transform.h"

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

using ProfilePoint = std::array<float, 2>;

// A smooth stretch of a profile, turned. `closed`: its ends are one point, and smooth there too.
void add_turned(Mesh& mesh, std::span<const ProfilePoint> profile, int segments, bool closed) {
  const std::size_t count = profile.size();
  const auto first = static_cast<Index>(mesh.positions.size());
  const auto around = static_cast<Index>(segments);
  for (std::size_t i = 0; i < count; ++i) {
    // Across the middle of the two stretches that meet, each by its length: a smooth curve's
    // normal.
    const ProfilePoint& before = profile[i > 0 ? i - 1 : (closed ? count - 2 : i)];
    const ProfilePoint& after = profile[i + 1 < count ? i + 1 : (closed ? 1 : i)];
    const double dr = double{after[0]} - before[0], dz = double{after[1]} - before[1];
    const double norm = std::hypot(dr, dz);
    const bool on_axis = profile[i][0] == 0;
    const double nr = on_axis ? 0 : dz / norm;
    const double nz = on_axis ? (dr > 0 ? -1 : 1) : -dr / norm;
    for (int k = 0; k < segments; ++k) {
      const double angle = 2 * std::numbers::pi * k / segments;
      const Vec3 c{std::cos(angle), std::sin(angle), 1};
      mesh.positions.push_back(
          calibrate::to_float(c * Vec3{profile[i][0], profile[i][0], profile[i][1]}));
      mesh.normals.push_back(calibrate::to_float(c * Vec3{nr, nr, nz}));
      if (on_axis) break;
    }
  }
  Index ring = first;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    const bool tip = profile[i][0] == 0, next_tip = profile[i + 1][0] == 0;
    const Index next = ring + (tip ? 1 : around);
    for (Index k = 0; k < around; ++k) {
      const Index turned = (k + 1) % around;
      if (!tip) mesh.triangles.push_back({ring + k, ring + turned, next + (next_tip ? 0 : k)});
      if (!next_tip) mesh.triangles.push_back({next + k, ring + (tip ? 0 : turned), next + turned});
    }
    ring = next;
  }
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

Mesh make_box_faces(Vec3f lower, Vec3f upper, std::string_view faces, float tile_m) {
  Mesh mesh;
  const Vec3f size = upper - lower;
  const Vec3f x{size.x, 0, 0}, y{0, size.y, 0}, z{0, 0, size.z};
  for (std::size_t at = 0; at < faces.size(); at += 3) {
    const std::string_view face = faces.substr(at, 2);
    if (face == "-x") {
      append(mesh, make_rectangle(lower + y, -y, z, tile_m));
    } else if (face == "+x") {
      append(mesh, make_rectangle(lower + x, y, z, tile_m));
    } else if (face == "-y") {
      append(mesh, make_rectangle(lower, x, z, tile_m));
    } else if (face == "+y") {
      append(mesh, make_rectangle(lower + x + y, -x, z, tile_m));
    } else if (face == "-z") {
      append(mesh, make_rectangle(lower + y, x, -y, tile_m));
    } else if (face == "+z") {
      append(mesh, make_rectangle(lower + z, x, y, tile_m));
    } else {
      throw std::invalid_argument("a box has no face \"" + std::string(face) + "\"");
    }
  }
  return mesh;
}

Mesh make_turned(std::span<const std::array<float, 2>> profile, int segments) {
  Mesh mesh;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= profile.size(); ++i) {
    if (i < profile.size() && profile[i] != profile[i - 1]) continue;
    const bool closed = i - begin == profile.size() && profile.front() == profile.back();
    if (i - begin > 1) add_turned(mesh, profile.subspan(begin, i - begin), segments, closed);
    begin = i;
  }
  return mesh;
}

Mesh make_tube(std::span<const Vec3f> line, float radius, int sides) {
  Mesh mesh;
  const auto around = static_cast<Index>(sides);
  const auto add_ring = [&](Vec3f middle, Vec3f across, Vec3f along, bool cap) {
    const Vec3f up = cross(along, across);
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / sides;
      const Vec3f out =
          across * static_cast<float>(std::cos(angle)) + up * static_cast<float>(std::sin(angle));
      mesh.positions.push_back(middle + out * radius);
      if (!cap) mesh.normals.push_back(out);
    }
  };
  Vec3f across{};
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Vec3f along = normalize(line[std::min(i + 1, line.size() - 1)] - line[i > 0 ? i - 1 : i]);
    // The frame is carried along with as little twist as can be.
    across = i == 0 ? unit_across(along) : normalize(across - along * dot(across, along));
    const bool end = i == 0 || i + 1 == line.size();
    if (end) {
      add_ring(line[i], across, along, true);
      mesh.normals.insert(mesh.normals.end(), around, i == 0 ? -along : along);
      const auto rim = static_cast<Index>(mesh.positions.size()) - around;
      for (Index k = 1; k + 1 < around; ++k) {
        const Index b = rim + k, c = rim + k + 1;
        mesh.triangles.push_back({rim, i == 0 ? c : b, i == 0 ? b : c});
      }
    }
    add_ring(line[i], across, along, false);
    if (i == 0) continue;
    const Index ring = static_cast<Index>(mesh.positions.size()) - around;
    const Index before = ring - around - (i + 1 == line.size() ? around : 0);
    for (Index k = 0; k < around; ++k) {
      const Index turned = (k + 1) % around;
      mesh.triangles.push_back({before + k, before + turned, ring + k});
      mesh.triangles.push_back({ring + k, before + turned, ring + turned});
    }
  }
  return mesh;
}

Mesh make_cushion(Vec3f half, float exponent, int steps, std::string_view faces) {
  Mesh mesh;
  const double e = exponent;
  const auto bent = [e](double x) { return std::copysign(std::pow(std::abs(x), e - 1), x); };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const std::array<char, 2> face{sign < 0 ? '-' : '+', "xyz"[axis]};
      if (faces.find(std::string_view(face.data(), 2)) == std::string_view::npos) continue;
      const auto first = static_cast<Index>(mesh.positions.size());
      for (int row = 0; row <= steps; ++row) {
        for (int column = 0; column <= steps; ++column) {
          std::array<double, 3> p{};
          p[axis] = sign;
          p[(axis + 1) % 3] = std::tan((2.0 * row / steps - 1) * std::numbers::pi / 4);
          p[(axis + 2) % 3] = std::tan((2.0 * column / steps - 1) * std::numbers::pi / 4);
          for (double& x : p) x = std::abs(std::abs(x) - 1) < 1e-12 ? std::copysign(1.0, x) : x;
          // Summed from the smallest on, so that sides that meet agree to the bit.
          std::array<double, 3> powers{std::pow(std::abs(p[0]), e), std::pow(std::abs(p[1]), e),
                                       std::pow(std::abs(p[2]), e)};
          std::ranges::sort(powers);
          const double shrink = std::pow(powers[0] + powers[1] + powers[2], -1 / e);
          const Vec3 q{p[0] * shrink, p[1] * shrink, p[2] * shrink};
          mesh.positions.push_back(calibrate::to_float(q * calibrate::to_double(half)));
          mesh.normals.push_back(calibrate::to_float(
              normalize(Vec3{bent(q.x) / half.x, bent(q.y) / half.y, bent(q.z) / half.z})));
        }
      }
      const auto width = static_cast<Index>(steps) + 1;
      for (Index row = 0; row + 1 < width; ++row) {
        for (Index column = 0; column + 1 < width; ++column) {
          const Index a = first + row * width + column;
          Index b = a + width, d = a + 1;
          if (sign < 0) std::swap(b, d);
          mesh.triangles.push_back({a, b, a + width + 1});
          mesh.triangles.push_back({a, a + width + 1, d});
        }
      }
    }
  }
  return mesh;
}

Mesh make_sheet(std::span<const Vec3f> points, int rows, int columns) {
  Mesh mesh;
  mesh.positions.assign(points.begin(), points.end());
  const auto width = static_cast<Index>(columns);
  const auto at = [&](int row, int column) {
    return points[static_cast<std::size_t>(std::clamp(row, 0, rows - 1)) * width +
                  static_cast<std::size_t>(std::clamp(column, 0, columns - 1))];
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      mesh.normals.push_back(normalize(cross(at(row + 1, column) - at(row - 1, column),
                                             at(row, column + 1) - at(row, column - 1))));
    }
  }
  for (Index row = 0; row + 1 < static_cast<Index>(rows); ++row) {
    for (Index column = 0; column + 1 < width; ++column) {
      const Index a = row * width + column;
      mesh.triangles.push_back({a, a + width, a + width + 1});
      mesh.triangles.push_back({a, a + width + 1, a + 1});
    }
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
