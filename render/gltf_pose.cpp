// Where a glTF skin puts the vertices of a mesh.
#include "render/gltf_pose.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace render {
namespace {

using Vec3d = std::array<double, 3>;

Vec3d cross_of(const Vec3d& a, const Vec3d& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot_of(const Vec3d& a, const Vec3d& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vec3d column(const GltfMatrix& m, std::size_t k) { return {m[4 * k], m[4 * k + 1], m[4 * k + 2]}; }

// The vector a x + b y + c z of three columns.
void combine(const std::array<Vec3d, 3>& columns, float* v) {
  const Vec3d from{v[0], v[1], v[2]};
  for (std::size_t r = 0; r < 3; ++r) {
    v[r] = static_cast<float>(columns[0][r] * from[0] + columns[1][r] * from[1] +
                              columns[2][r] * from[2]);
  }
}

}  // namespace

GltfMatrix operator*(const GltfMatrix& a, const GltfMatrix& b) {
  GltfMatrix product{};
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t r = 0; r < 4; ++r) {
      for (std::size_t k = 0; k < 4; ++k) product[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    }
  }
  return product;
}

GltfMatrix gltf_matrix(const std::array<double, 3>& translation,
                       const std::array<double, 4>& rotation,
                       const std::array<double, 3>& scale) {
  auto [x, y, z, w] = rotation;
  const double norm = std::sqrt(x * x + y * y + z * z + w * w);
  if (norm > 0) x /= norm, y /= norm, z /= norm, w /= norm;
  const auto& [sx, sy, sz] = scale;
  return {sx * (1 - 2 * (y * y + z * z)),
          sx * 2 * (x * y + z * w),
          sx * 2 * (x * z - y * w),
          0,
          sy * 2 * (x * y - z * w),
          sy * (1 - 2 * (x * x + z * z)),
          sy * 2 * (y * z + x * w),
          0,
          sz * 2 * (x * z + y * w),
          sz * 2 * (y * z - x * w),
          sz * (1 - 2 * (x * x + y * y)),
          0,
          translation[0],
          translation[1],
          translation[2],
          1};
}

std::optional<GltfMatrix> inverse(const GltfMatrix& m) {
  const Vec3d a = column(m, 0), b = column(m, 1), c = column(m, 2), t = column(m, 3);
  const Vec3d bc = cross_of(b, c), ca = cross_of(c, a), ab = cross_of(a, b);
  const double determinant = dot_of(a, bc);
  if (!std::isfinite(determinant) || determinant == 0) return std::nullopt;
  const double s = 1 / determinant;
  return GltfMatrix{bc[0] * s,          ca[0] * s,          ab[0] * s,          0,
                    bc[1] * s,          ca[1] * s,          ab[1] * s,          0,
                    bc[2] * s,          ca[2] * s,          ab[2] * s,          0,
                    -dot_of(bc, t) * s, -dot_of(ca, t) * s, -dot_of(ab, t) * s, 1};
}

void apply_skin(std::span<const GltfMatrix> matrices,
                std::span<const float> joints,
                std::span<const float> weights,
                std::vector<float>& positions,
                std::vector<float>& normals,
                std::vector<float>& tangents) {
  const std::size_t vertices = positions.size() / 3;
  const std::size_t influences = vertices > 0 ? weights.size() / vertices : 0;
  for (std::size_t i = 0; i < vertices; ++i) {
    GltfMatrix m{};
    double sum = 0;
    for (std::size_t k = i * influences; k < (i + 1) * influences; ++k) {
      if (!(weights[k] > 0)) continue;
      if (!(joints[k] >= 0 && joints[k] < static_cast<float>(matrices.size())))
        throw std::runtime_error("a vertex names joint " + std::to_string(joints[k]) + " of " +
                                 std::to_string(matrices.size()));
      const GltfMatrix& joint = matrices[static_cast<std::size_t>(joints[k])];
      for (std::size_t e = 0; e < 16; ++e) m[e] += weights[k] * joint[e];
      sum += weights[k];
    }
    if (!(sum > 0)) continue;
    for (double& e : m) e /= sum;
    const Vec3d a = column(m, 0), b = column(m, 1), c = column(m, 2), t = column(m, 3);
    combine({a, b, c}, &positions[3 * i]);
    for (std::size_t r = 0; r < 3; ++r) positions[3 * i + r] += static_cast<float>(t[r]);
    if (!tangents.empty()) combine({a, b, c}, &tangents[4 * i]);
    if (normals.empty()) continue;
    const Vec3d bc = cross_of(b, c), ca = cross_of(c, a), ab = cross_of(a, b);
    combine({bc, ca, ab}, &normals[3 * i]);
    if (dot_of(a, bc) < 0) {
      for (std::size_t r = 0; r < 3; ++r) normals[3 * i + r] = -normals[3 * i + r];
    }
  }
}

}  // namespace render
