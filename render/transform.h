// Points, vectors and normals through row-major 3x4 matrices, which place meshes.
#pragma once

#include <array>
#include <cmath>

#include "render/mesh.h"

namespace render {

inline Vec3f transform_point(const std::array<float, 12>& m, Vec3f p) {
  return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
          m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
}

inline Vec3f transform_vector(const std::array<float, 12>& m, Vec3f v) {
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
          m[8] * v.x + m[9] * v.y + m[10] * v.z};
}

// Of the 3x3 part: below 0 where it turns things inside out.
inline float determinant(const std::array<float, 12>& m) {
  return dot(Vec3f{m[0], m[1], m[2]}, cross(Vec3f{m[4], m[5], m[6]}, Vec3f{m[8], m[9], m[10]}));
}

// Normals go with the cofactors of the 3x3 part, whatever its scale or handedness.
inline std::array<float, 9> normal_matrix(const std::array<float, 12>& m) {
  const Vec3f a{m[0], m[1], m[2]}, b{m[4], m[5], m[6]}, c{m[8], m[9], m[10]};
  const Vec3f bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
  return {bc.x, bc.y, bc.z, ca.x, ca.y, ca.z, ab.x, ab.y, ab.z};
}

inline Vec3f transform_normal(const std::array<float, 9>& m, Vec3f n) {
  return normalize(Vec3f{m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z,
                         m[6] * n.x + m[7] * n.y + m[8] * n.z});
}

// A unit vector across a unit direction.
inline Vec3f unit_across(Vec3f direction) {
  return normalize(
      cross(std::abs(direction.z) < 0.9F ? Vec3f{0, 0, 1} : Vec3f{1, 0, 0}, direction));
}

}  // namespace render
