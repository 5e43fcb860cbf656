// Samples of glowing surfaces.
#include "render/area_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

#include "render/transform.h"

namespace render {
namespace {

struct Corner {
  float u, v;
  Vec3f position;
};

Corner between(const Corner& a, const Corner& b, float t) {
  return {a.u + (b.u - a.u) * t, a.v + (b.v - a.v) * t, a.position + (b.position - a.position) * t};
}

// A convex polygon with the part where distance(corner) is negative cut off.
//
// Sutherland and Hodgman, "Reentrant Polygon Clipping", CACM 1974.
template <class F>
std::vector<Corner> clipped(const std::vector<Corner>& polygon, F&& distance) {
  std::vector<Corner> result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const float da = distance(a), db = distance(b);
    if (da >= 0) result.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) result.push_back(between(a, b, da / (da - db)));
  }
  return result;
}

// Half of the sum of the corners' cross products: a polygon's normal, as long as its area.
Vec3f vector_area(const std::vector<Corner>& polygon) {
  Vec3f sum;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    sum += cross(polygon[i].position - polygon[0].position,
                 polygon[i + 1].position - polygon[0].position);
  }
  return sum * 0.5F;
}

Vec3f middle_of(const std::vector<Corner>& polygon) {
  Vec3f sum;
  float area = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const Vec3f a = polygon[0].position, b = polygon[i].position, c = polygon[i + 1].position;
    const float part = length(cross(b - a, c - a));
    sum += (a + b + c) * (part / 3);
    area += part;
  }
  return area > 0 ? sum / area : polygon[0].position;
}

// Where (u, v) lies on a triangle.
std::optional<Vec3f> position_at(const std::array<Corner, 3>& t, float u, float v) {
  const float bu = t[1].u - t[0].u, bv = t[1].v - t[0].v;
  const float cu = t[2].u - t[0].u, cv = t[2].v - t[0].v;
  const float twice = bu * cv - bv * cu;
  if (twice == 0) return std::nullopt;
  const float du = u - t[0].u, dv = v - t[0].v;
  const float b = (du * cv - dv * cu) / twice, c = (bu * dv - bv * du) / twice;
  constexpr float slack = 1e-5F;
  if (b < -slack || c < -slack || b + c > 1 + slack) return std::nullopt;
  return t[0].position + (t[1].position - t[0].position) * b + (t[2].position - t[0].position) * c;
}

// What the triangles seen so far say of a part.
struct Part {
  Vec3f normal;  // sum of vector areas
  float area = 0;
  std::optional<Vec3f> middle;  // of the picture's part, on the surface
  float largest = 0;
  Vec3f middle_of_largest;
};

void add_triangle(const std::array<Corner, 3>& triangle,
                  std::array<int, 2> samples,
                  std::vector<Part>& parts) {
  const auto [columns, rows] = samples;
  const auto first_last = [](float a, float b, float c, int count) {
    const auto n = static_cast<float>(count);
    const auto cell = [n](float value) {
      return static_cast<int>(std::clamp(std::floor(value * n), 0.0F, n - 1));
    };
    return std::array{cell(std::min({a, b, c})), cell(std::max({a, b, c}))};
  };
  const auto [left, right] = first_last(triangle[0].u, triangle[1].u, triangle[2].u, columns);
  const auto [top, bottom] = first_last(triangle[0].v, triangle[1].v, triangle[2].v, rows);
  const float width = 1 / static_cast<float>(columns), height = 1 / static_cast<float>(rows);
  for (int j = top; j <= bottom; ++j) {
    for (int i = left; i <= right; ++i) {
      const float u0 = static_cast<float>(i) * width, u1 = static_cast<float>(i + 1) * width;
      const float v0 = static_cast<float>(j) * height, v1 = static_cast<float>(j + 1) * height;
      std::vector<Corner> piece(triangle.begin(), triangle.end());
      piece = clipped(piece, [u0](const Corner& c) { return c.u - u0; });
      piece = clipped(piece, [u1](const Corner& c) { return u1 - c.u; });
      piece = clipped(piece, [v0](const Corner& c) { return c.v - v0; });
      piece = clipped(piece, [v1](const Corner& c) { return v1 - c.v; });
      if (piece.size() < 3) continue;
      const Vec3f normal = vector_area(piece);
      const float area = length(normal);
      if (!(area > 0)) continue;
      Part& part = parts[static_cast<std::size_t>(j * columns + i)];
      part.normal += normal;
      part.area += area;
      if (!part.middle) part.middle = position_at(triangle, 0.5F * (u0 + u1), 0.5F * (v0 + v1));
      if (area > part.largest) {
        part.largest = area;
        part.middle_of_largest = middle_of(piece);
      }
    }
  }
}

void add_instance(const SceneDescription& scene,
                  const Instance& instance,
                  std::uint32_t material,
                  std::array<int, 2> samples,
                  std::vector<Part>& parts) {
  const Mesh& mesh = *scene.meshes.at(instance.mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.materials[mesh.materials.size() == 1 ? 0 : t] != material) continue;
    if (mesh.uvs.empty()) {
      throw std::invalid_argument("a surface without texture coordinates cannot show a picture");
    }
    std::array<Corner, 3> triangle;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t vertex = mesh.triangles[t][i];
      const auto& [u, v] = mesh.uvs[vertex];
      triangle[i] = {u, v, transform_point(instance.set_from_object, mesh.positions[vertex])};
      if (!std::isfinite(u) || !std::isfinite(v) || !std::isfinite(length(triangle[i].position))) {
        triangle[0].u = triangle[1].u = triangle[2].u = -1;  // nowhere
        break;
      }
    }
    // Outside stays outside where the object is mirrored.
    if (determinant(instance.set_from_object) < 0) std::swap(triangle[1], triangle[2]);
    add_triangle(triangle, samples, parts);
  }
}

}  // namespace

AreaLight sample_area_light(const SceneDescription& scene,
                            std::uint32_t instance,
                            std::uint32_t material,
                            std::array<int, 2> samples) {
  const auto [columns, rows] = samples;
  if (columns < 1 || rows < 1 || columns > most_area_samples || rows > most_area_samples) {
    throw std::invalid_argument("a surface is sampled by 1 to " +
                                std::to_string(most_area_samples) + " lamps a side");
  }
  std::vector<Part> parts(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  add_instance(scene, scene.instances.at(instance), material, samples, parts);
  AreaLight light;
  light.instance = instance;
  light.material = material;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Part& part = parts[static_cast<std::size_t>(j * columns + i)];
      const float l = length(part.normal);
      if (!(l > 0)) continue;
      const auto share = [](int k, int n) { return static_cast<float>(k) / static_cast<float>(n); };
      light.samples.push_back({part.middle.value_or(part.middle_of_largest), part.normal / l,
                               part.area, share(i, columns), share(j, rows), share(i + 1, columns),
                               share(j + 1, rows)});
    }
  }
  if (light.samples.empty()) {
    const bool any = std::ranges::any_of(parts, [](const Part& part) { return part.area > 0; });
    throw std::invalid_argument(
        any ? "what shows the picture faces all ways alike, so that its light has no direction: "
              "name "
              "one part or material of it, or take more samples"
            : "no surface shows any of the picture: texture coordinates 0..1");
  }
  return light;
}

std::vector<LocalLight> lamps_of(const AreaLight& light,
                                 const VideoTexture& video,
                                 const VideoGlow& glow) {
  std::vector<LocalLight> lamps;
  const auto radiance = [&](Vec3f mean) {
    return Vec3f{std::max(0.0F, mean.x), std::max(0.0F, mean.y), std::max(0.0F, mean.z)} *
           glow.gain;
  };
  Vec3f sum;
  float area = 0;
  for (const AreaSample& s : light.samples) {
    const Vec3f l = radiance(mean_over(video, s.u0, s.v0, s.u1, s.v1));
    LocalLight& lamp = lamps.emplace_back();
    lamp.position = s.position;
    lamp.normal = s.normal;
    lamp.intensity = l * s.area_m2;
    lamp.planned = glow.gain * (planned_grey * s.area_m2);
    lamp.area_m2 = s.area_m2;
    lamp.instance = light.instance;
    lamp.material = light.material;
    sum += l * s.area_m2;
    area += s.area_m2;
  }
  if (glow.ambient > 0 && area > 0) {
    constexpr float pi = std::numbers::pi_v<float>;
    LocalLight& lamp = lamps.emplace_back();
    lamp.intensity = sum * (glow.ambient * pi / area);
    lamp.planned = glow.gain * (glow.ambient * pi * planned_grey);
    lamp.ambient = 1;
  }
  return lamps;
}

}  // namespace render
