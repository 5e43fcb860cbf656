// Grids, laid patches and curves.
#include "render/surface_patches.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

#include "render/srgb_codes.h"

namespace render {
namespace {

Vec3f single(Vec3 v) { return calibrate::to_float(v); }

std::array<double, 2> mean_of(const ParameterLine& line) {
  std::array<double, 2> mean{};
  for (const auto& [u, v] : line) {
    mean[0] += u / static_cast<double>(line.size());
    mean[1] += v / static_cast<double>(line.size());
  }
  return mean;
}

// Nothing is added for a triangle without area, where a grid's row shrinks to a point.
void add_triangle(
    Mesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t material) {
  const auto same = [&mesh](std::uint32_t p, std::uint32_t q) {
    return length(mesh.positions[p] - mesh.positions[q]) < 1e-6F;
  };
  if (same(a, b) || same(b, c) || same(c, a)) return;
  mesh.triangles.push_back({a, b, c});
  mesh.materials.push_back(material);
}

}  // namespace

ParameterLine make_rounded_line(std::span<const std::array<double, 2>> corners, int count) {
  // Chaikin's corner cutting.
  ParameterLine line(corners.begin(), corners.end());
  for (int pass = 0; pass < 4; ++pass) {
    ParameterLine cut;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const auto& a = line[i];
      const auto& b = line[(i + 1) % line.size()];
      cut.push_back({0.85 * a[0] + 0.15 * b[0], 0.85 * a[1] + 0.15 * b[1]});
      cut.push_back({0.15 * a[0] + 0.85 * b[0], 0.15 * a[1] + 0.85 * b[1]});
    }
    line = std::move(cut);
  }
  std::vector<double> along{0};
  for (std::size_t i = 0; i < line.size(); ++i) {
    const auto& a = line[i];
    const auto& b = line[(i + 1) % line.size()];
    along.push_back(along.back() + std::hypot(b[0] - a[0], b[1] - a[1]));
  }
  ParameterLine even;
  std::size_t segment = 0;
  for (int k = 0; k < count; ++k) {
    const double at = along.back() * k / count;
    while (along[segment + 1] < at) ++segment;
    const double share = (at - along[segment]) / (along[segment + 1] - along[segment]);
    const auto& a = line[segment];
    const auto& b = line[(segment + 1) % line.size()];
    even.push_back({a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])});
  }
  return even;
}

ParameterLine scaled(const ParameterLine& line, double factor) {
  const auto mean = mean_of(line);
  ParameterLine result;
  for (const auto& [u, v] : line)
    result.push_back({mean[0] + factor * (u - mean[0]), mean[1] + factor * (v - mean[1])});
  return result;
}

bool lies_inside(const ParameterLine& line, double u, double v) {
  bool inside = false;
  for (std::size_t i = 0, j = line.size() - 1; i < line.size(); j = i++) {
    const auto& a = line[i];
    const auto& b = line[j];
    if ((a[1] > v) != (b[1] > v) && u < (b[0] - a[0]) * (v - a[1]) / (b[1] - a[1]) + a[0])
      inside = !inside;
  }
  return inside;
}

Vec3 normal_of(const SmoothSurface& surface, double u, double v) {
  constexpr double step = 5e-4;
  const Vec3 along_u = surface(u + step, v) - surface(u - step, v);
  const Vec3 along_v = surface(u, v + step) - surface(u, v - step);
  const Vec3 normal = normalize(cross(along_u, along_v));
  return dot(normal, normal) > 0.5 ? normal : Vec3{0, 0, 1};
}

void add_grid(Mesh& mesh, const SmoothSurface& surface, const GridPatch& patch) {
  // Vertices come into being with the first triangle that needs them.
  std::vector<std::int64_t> vertices(
      static_cast<std::size_t>(patch.rows) * static_cast<std::size_t>(patch.columns), -1);
  const auto vertex = [&](int row, int column) {
    std::int64_t& index =
        vertices[static_cast<std::size_t>(row) * static_cast<std::size_t>(patch.columns) +
                 static_cast<std::size_t>(column)];
    if (index < 0) {
      const auto [u, v] = patch.parameters(row, column);
      const Vec3 normal = normal_of(surface, u, v);
      const double depth = patch.depth_m ? patch.depth_m(row, column) : 0;
      index = static_cast<std::int64_t>(mesh.positions.size());
      mesh.positions.push_back(single(surface(u, v) - normal * depth));
      mesh.normals.push_back(single(normal));
    }
    return static_cast<std::uint32_t>(index);
  };
  for (int row = 0; row + 1 < patch.rows; ++row) {
    for (int column = 0; column + 1 < patch.columns; ++column) {
      const auto material = patch.material(row, column);
      if (!material) continue;
      const std::uint32_t a = vertex(row, column);
      const std::uint32_t b = vertex(row, column + 1);
      const std::uint32_t c = vertex(row + 1, column + 1);
      const std::uint32_t d = vertex(row + 1, column);
      add_triangle(mesh, a, b, c, *material);
      add_triangle(mesh, a, c, d, *material);
    }
  }
}

void add_laid(Mesh& mesh, const SmoothSurface& surface, const LaidPatch& patch) {
  const auto mean = mean_of(patch.line);
  const std::size_t count = patch.line.size();
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  ParameterLine places;
  const auto add_vertex = [&](double u, double v, double lift) {
    const Vec3 normal = normal_of(surface, u, v);
    places.push_back({u, v});
    mesh.positions.push_back(single(surface(u, v) + normal * lift));
    mesh.normals.push_back(single(normal));
  };
  for (int ring = 0; ring < patch.rings; ++ring) {
    const double factor = ring == 0 ? 1 : 0.985 * (1 - (ring - 1.0) / (patch.rings - 1.0));
    for (const auto& [u, v] : patch.line)
      add_vertex(mean[0] + factor * (u - mean[0]), mean[1] + factor * (v - mean[1]),
                 ring == 0 ? -0.5 * patch.lift_m : patch.lift_m);
  }
  add_vertex(mean[0], mean[1], patch.lift_m);
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c, std::uint32_t material) {
    const bool hidden =
        std::any_of(patch.covers.begin(), patch.covers.end(), [&](const ParameterLine& cover) {
          return lies_inside(cover, places[a][0], places[a][1]) &&
                 lies_inside(cover, places[b][0], places[b][1]) &&
                 lies_inside(cover, places[c][0], places[c][1]);
        });
    if (!hidden)
      add_triangle(mesh, first + static_cast<std::uint32_t>(a),
                   first + static_cast<std::uint32_t>(b), first + static_cast<std::uint32_t>(c),
                   material);
  };
  for (int ring = 0; ring + 1 < patch.rings; ++ring) {
    const std::uint32_t material = ring < patch.rim_rings ? patch.rim : patch.material;
    const std::size_t outer = static_cast<std::size_t>(ring) * count;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t next = (i + 1) % count;
      add(outer + i, outer + next, outer + count + next, material);
      add(outer + i, outer + count + next, outer + count + i, material);
    }
  }
  const std::size_t inner = static_cast<std::size_t>(patch.rings - 1) * count;
  const std::size_t middle = static_cast<std::size_t>(patch.rings) * count;
  for (std::size_t i = 0; i < count; ++i)
    add(inner + i, inner + (i + 1) % count, middle, patch.material);
}

CoveredArea::CoveredArea(ParameterLine line, bool both_sides)
    : line_(std::move(line)), both_sides_(both_sides), lower_(line_[0]), upper_(line_[0]) {
  for (const auto& point : line_) {
    for (std::size_t i = 0; i < 2; ++i) {
      lower_[i] = std::min(lower_[i], point[i]);
      upper_[i] = std::max(upper_[i], point[i]);
    }
  }
}

bool CoveredArea::covers(const std::array<double, 2>& place) const {
  return place[0] > lower_[0] && place[0] < upper_[0] && place[1] > lower_[1] &&
         place[1] < upper_[1] && lies_inside(line_, place[0], place[1]);
}

void smooth_normals(Mesh& mesh) {
  std::vector<Vec3f> sums(mesh.positions.size());
  for (const auto& triangle : mesh.triangles) {
    const Vec3f a = mesh.positions[triangle[0]];
    const Vec3f face = cross(mesh.positions[triangle[1]] - a, mesh.positions[triangle[2]] - a);
    for (const std::uint32_t corner : triangle) sums[corner] += face;
  }
  mesh.normals.resize(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const Vec3f normal = normalize(sums[i]);
    mesh.normals[i] = dot(normal, normal) > 0.5F ? normal : Vec3f{0, 0, 1};
  }
}

void halve_largest(Mesh& mesh, std::size_t count) {
  const auto area_of = [&mesh](std::size_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return length(
        cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]));
  };
  std::priority_queue<std::pair<float, std::size_t>> by_area;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) by_area.push({area_of(t), t});
  for (; count > 0; --count) {
    const std::size_t t = by_area.top().second;
    by_area.pop();
    auto [a, b, c] = mesh.triangles[t];
    const auto edge = [&mesh](std::uint32_t p, std::uint32_t q) {
      return length(mesh.positions[q] - mesh.positions[p]);
    };
    while (edge(a, b) < edge(b, c) || edge(a, b) < edge(c, a)) {
      const std::uint32_t first = a;
      a = b, b = c, c = first;
    }
    const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]) * 0.5F);
    mesh.normals.push_back(normalize(mesh.normals[a] + mesh.normals[b]));
    for (auto* uvs : {&mesh.uvs, &mesh.second_uvs}) {
      if (uvs->empty()) continue;
      const auto p = (*uvs)[a], q = (*uvs)[b];
      uvs->push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2});
    }
    if (!mesh.colours.empty()) {
      mesh.colours.push_back(codes_of_light(
          (light_of_codes(mesh.colours[a]) + light_of_codes(mesh.colours[b])) * 0.5F));
    }
    mesh.triangles[t] = {a, middle, c};
    mesh.triangles.push_back({middle, b, c});
    if (mesh.materials.size() > 1) mesh.materials.push_back(mesh.materials[t]);
    by_area.push({area_of(t), t});
    by_area.push({area_of(mesh.triangles.size() - 1), mesh.triangles.size() - 1});
  }
}

void append_mesh(Mesh& mesh, const Mesh& part) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
  mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
  for (const auto& [a, b, c] : part.triangles)
    mesh.triangles.push_back({first + a, first + b, first + c});
  mesh.materials.insert(mesh.materials.end(), part.materials.begin(), part.materials.end());
}

void add_mirrored(Mesh& mesh, const Mesh& part) {
  Mesh mirrored = part;
  for (Vec3f& p : mirrored.positions) p.y = -p.y;
  for (Vec3f& n : mirrored.normals) n.y = -n.y;
  for (auto& triangle : mirrored.triangles) std::swap(triangle[1], triangle[2]);
  append_mesh(mesh, mirrored);
}

MonotoneCurve::MonotoneCurve(std::vector<std::array<double, 2>> points)
    : points_(std::move(points)), slopes_(points_.size(), 0) {
  const auto secant = [&](std::size_t i) {
    return (points_[i + 1][1] - points_[i][1]) / (points_[i + 1][0] - points_[i][0]);
  };
  const std::size_t last = points_.size() - 1;
  slopes_[0] = secant(0);
  slopes_[last] = secant(last - 1);
  for (std::size_t i = 1; i < last; ++i) {
    const double before = secant(i - 1), after = secant(i);
    if (before * after <= 0) continue;
    const double h0 = points_[i][0] - points_[i - 1][0];
    const double h1 = points_[i + 1][0] - points_[i][0];
    const double weight = (h0 + 2 * h1) / (3 * (h0 + h1));
    slopes_[i] = before * after / (weight * after + (1 - weight) * before);
  }
}

double MonotoneCurve::operator()(double x) const {
  if (x <= points_.front()[0]) return points_.front()[1];
  if (x >= points_.back()[0]) return points_.back()[1];
  std::size_t i = 0;
  while (points_[i + 1][0] < x) ++i;
  const double h = points_[i + 1][0] - points_[i][0];
  const double t = (x - points_[i][0]) / h;
  const double t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * points_[i][1] + (t3 - 2 * t2 + t) * h * slopes_[i] +
         (-2 * t3 + 3 * t2) * points_[i + 1][1] + (t3 - t2) * h * slopes_[i + 1];
}

}  // namespace render
