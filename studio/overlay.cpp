// Overlays.
#include "studio/overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

namespace studio {
namespace {

using calibrate::Vec2;
using calibrate::Vec3;
using Colour = std::array<double, 3>;

constexpr Colour grid_colour{150, 190, 210};
constexpr Colour metre_colour{255, 255, 255};
constexpr Colour stand_in_colour{255, 200, 40};
constexpr Colour covered_tint{80, 160, 255};
constexpr Colour changed_tint{255, 120, 60};
constexpr std::array<Colour, 3> axis_colours{Colour{255, 60, 60}, {60, 230, 60}, {90, 130, 255}};

// Draws lines of the set into a picture.
class Canvas {
 public:
  Canvas(const Set& set, const calibrate::Pose& cam_from_set, std::vector<std::uint8_t>& rgb8)
      : lens_(set.camera.lens),
        cam_from_set_(cam_from_set),
        rgb8_(rgb8),
        width_(set.show.width),
        height_(set.show.height) {}

  std::optional<Vec2> pixel(Vec3 p_set) const {
    return calibrate::project(lens_, cam_from_set_ * p_set);
  }
  std::optional<Vec2> pixel_of_direction(Vec3 v_set) const {
    return calibrate::project(lens_, cam_from_set_.R * v_set);
  }
  bool inside(Vec2 q) const { return q.x > -1 && q.y > -1 && q.x < width_ && q.y < height_; }

  // In pieces, since lenses bend straight lines; halved until a piece spans a few pixels.
  void line(Vec3 a, Vec3 b, const Colour& colour, double opacity, int depth = 0) {
    constexpr int first_depth = 8;  // shorter pieces that lie outside at both ends are left out
    constexpr int last_depth = 11;
    const auto qa = pixel(a);
    const auto qb = pixel(b);
    const bool near_ends = qa && qb && std::hypot(qa->x - qb->x, qa->y - qb->y) < 8;
    if (near_ends || depth == last_depth) {
      if (qa && qb && near_ends && (inside(*qa) || inside(*qb))) piece(*qa, *qb, colour, opacity);
      return;
    }
    const bool shows = !qa || !qb || inside(*qa) || inside(*qb);
    if (depth >= first_depth && !shows) return;
    const Vec3 middle = (a + b) * 0.5;
    line(a, middle, colour, opacity, depth + 1);
    line(middle, b, colour, opacity, depth + 1);
  }

  void ring(Vec2 q, double radius, const Colour& colour) {
    const int steps = static_cast<int>(radius * 8) + 12;
    constexpr double turn = 6.283185307179586;
    Vec2 last{q.x + radius, q.y};
    for (int i = 1; i <= steps; ++i) {
      const double a = turn * i / steps;
      const Vec2 next{q.x + radius * std::cos(a), q.y + radius * std::sin(a)};
      piece(last, next, colour, 1);
      last = next;
    }
  }

  void tint(int x, int y, const Colour& colour, double opacity) { blend(x, y, colour, opacity); }

 private:
  // A short straight line, its weight shared by the two pixels that it passes between.
  void piece(Vec2 a, Vec2 b, const Colour& colour, double opacity) {
    const double span = std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), 1.0});
    const int steps = static_cast<int>(std::ceil(span));
    const bool flat = std::abs(a.x - b.x) >= std::abs(a.y - b.y);
    for (int i = 0; i < steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      const double x = a.x + (b.x - a.x) * t;
      const double y = a.y + (b.y - a.y) * t;
      const double across = flat ? y : x;
      const int lower = static_cast<int>(std::floor(across));
      const int along = static_cast<int>(std::lround(flat ? x : y));
      const double share = across - lower;
      for (const auto& [offset, weight] : {std::pair{0, 1 - share}, {1, share}}) {
        const int px = flat ? along : lower + offset;
        const int py = flat ? lower + offset : along;
        blend(px, py, colour, opacity * weight);
      }
    }
  }

  void blend(int x, int y, const Colour& colour, double opacity) {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
    const std::size_t at = (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                            static_cast<std::size_t>(x)) *
                           3;
    for (std::size_t c = 0; c < 3; ++c) {
      const double mixed = rgb8_[at + c] * (1 - opacity) + colour[c] * opacity;
      rgb8_[at + c] = static_cast<std::uint8_t>(std::lround(std::clamp(mixed, 0.0, 255.0)));
    }
  }

  const calibrate::Lens& lens_;
  calibrate::Pose cam_from_set_;
  std::vector<std::uint8_t>& rgb8_;
  int width_, height_;
};

// Where the middle of the picture, or the objects, are on the ground; and a step that fits there.
struct Ground {
  Vec3 centre;
  double step_m = 1;
};

Ground ground_of(const ShownFrame& shown) {
  const calibrate::Pose& cam_from_set = shown.prepared.job.cam_from_set;
  const auto bounds = shown.prepared.scene->bounds();
  Vec3 centre;
  if (bounds.lower.x <= bounds.upper.x) {
    const auto virtual_bounds = shown.prepared.scene->virtual_bounds();
    const auto& used = virtual_bounds.lower.x <= virtual_bounds.upper.x ? virtual_bounds : bounds;
    centre = (calibrate::to_double(used.lower) + calibrate::to_double(used.upper)) * 0.5;
  }
  centre.z = 0;
  const double distance_m = calibrate::length(calibrate::position_of(cam_from_set) - centre);
  // About twenty steps to the camera: 0.01, 0.1, 1, 10 m and so on.
  const double step_m = std::pow(10.0, std::round(std::log10(std::max(distance_m, 1e-3) / 20)));
  return {{std::round(centre.x / step_m) * step_m, std::round(centre.y / step_m) * step_m, 0},
          step_m};
}

void draw_grid(Canvas& canvas, const Ground& ground) {
  constexpr int half = 20;
  const double reach_m = half * ground.step_m;
  const auto whole = [](double v) { return std::abs(v - std::round(v)) < 1e-6; };
  for (int i = -half; i <= half; ++i) {
    const double x = ground.centre.x + i * ground.step_m;
    const double y = ground.centre.y + i * ground.step_m;
    canvas.line({x, ground.centre.y - reach_m, 0}, {x, ground.centre.y + reach_m, 0},
                whole(x) ? metre_colour : grid_colour, whole(x) ? 0.7 : 0.35);
    canvas.line({ground.centre.x - reach_m, y, 0}, {ground.centre.x + reach_m, y, 0},
                whole(y) ? metre_colour : grid_colour, whole(y) ? 0.7 : 0.35);
  }
}

void draw_axes(Canvas& canvas, const Ground& ground) {
  const double reach_m = ground.step_m * 5;
  const std::array<Vec3, 3> tips{Vec3{reach_m, 0, 0}, {0, reach_m, 0}, {0, 0, reach_m}};
  for (std::size_t i = 0; i < 3; ++i) {
    for (const double shift : {0.0, 0.002, -0.002}) {  // three lines make a thick one
      const Vec3 offset{shift * reach_m, shift * reach_m, shift * reach_m};
      canvas.line(offset, tips[i] + offset, axis_colours[i], 1);
    }
  }
}

Vec3 transformed(const std::array<float, 12>& m, calibrate::Vec3f p) {
  return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
          m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
}

// Edges that no two triangles of the same plane share.
void draw_stand_ins(Canvas& canvas, const render::SceneDescription& scene) {
  constexpr std::size_t most_edges = 20000;
  for (const render::Instance& instance : scene.instances) {
    if (instance.kind != render::ObjectKind::stand_in) continue;
    const render::Mesh& mesh = *scene.meshes[instance.mesh];
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    std::set<std::pair<std::uint32_t, std::uint32_t>> inner;
    std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> normal_of;
    for (const auto& t : mesh.triangles) {
      const Vec3 a = calibrate::to_double(mesh.positions[t[0]]);
      const Vec3 b = calibrate::to_double(mesh.positions[t[1]]);
      const Vec3 c = calibrate::to_double(mesh.positions[t[2]]);
      const Vec3 normal = calibrate::normalize(calibrate::cross(b - a, c - a));
      for (std::size_t i = 0; i < 3; ++i) {
        const auto edge = std::minmax(t[i], t[(i + 1) % 3]);
        const auto [known, fresh] = normal_of.emplace(edge, normal);
        edges.insert(edge);
        if (!fresh && std::abs(calibrate::dot(known->second, normal)) > 0.999) inner.insert(edge);
      }
      if (edges.size() > most_edges) break;
    }
    for (const auto& edge : edges) {
      if (inner.contains(edge)) continue;
      canvas.line(transformed(instance.set_from_object, mesh.positions[edge.first]),
                  transformed(instance.set_from_object, mesh.positions[edge.second]),
                  stand_in_colour, 0.9);
    }
  }
}

void draw_coverage(Canvas& canvas, const render::FrameResult& result) {
  for (int y = 0; y < result.rgba.height; ++y) {
    for (int x = 0; x < result.rgba.width; ++x) {
      const double covered =
          capture::float_from_half(result.rgba.pixels[result.rgba.index(y, x, 3)]);
      const double matte = capture::float_from_half(result.matte.pixels[result.matte.index(y, x)]);
      canvas.tint(x, y, covered_tint, 0.45 * std::clamp(covered, 0.0, 1.0));
      if (covered <= 0) canvas.tint(x, y, changed_tint, std::min(0.6, 0.9 * std::abs(matte)));
    }
  }
}

void draw_lights(Canvas& canvas, const Set& set, const render::LightTable& table) {
  double strongest = 0;
  for (const auto& light : table.lights)
    strongest = std::max(strongest, double{light.irradiance.y});
  const double side = std::min(set.show.width, set.show.height);
  for (const auto& light : table.lights) {
    const auto q = canvas.pixel_of_direction(calibrate::to_double(light.direction));
    if (!q || !canvas.inside(*q)) continue;
    const double share = std::sqrt(light.irradiance.y / std::max(strongest, 1e-30));
    canvas.ring(*q, 2 + 0.04 * side * share, stand_in_colour);
  }
}

}  // namespace

const std::vector<std::string>& overlay_names() {
  static const std::vector<std::string> names{"grid", "axes", "stand_in", "coverage", "light"};
  return names;
}

void draw_overlays(const Set& set,
                   const ShownFrame& shown,
                   const std::vector<std::string>& names,
                   std::vector<std::uint8_t>& rgb8) {
  for (const std::string& name : names) {
    if (std::ranges::find(overlay_names(), name) == overlay_names().end()) {
      throw std::invalid_argument("there is no overlay \"" + name + "\"");
    }
  }
  const auto wanted = [&](const char* name) {
    return std::ranges::find(names, name) != names.end();
  };
  Canvas canvas(set, shown.prepared.job.cam_from_set, rgb8);
  const Ground ground = ground_of(shown);
  if (wanted("coverage")) draw_coverage(canvas, *shown.result);
  if (set.camera.lens.width < 1) return;  // nothing else can be placed without a lens
  if (wanted("grid")) draw_grid(canvas, ground);
  if (wanted("stand_in")) draw_stand_ins(canvas, shown.prepared.scene->description());
  if (wanted("axes")) draw_axes(canvas, ground);
  if (wanted("light")) draw_lights(canvas, set, shown.prepared.job.lights);
}

}  // namespace studio
