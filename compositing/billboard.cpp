// The shader "billboard".
#include "compositing/billboard.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "render/shader.h"
#include "render/trace.h"

namespace compositing {
namespace {

using render::HitPoint;
using render::Layer;
using render::Material;
using render::RayKind;
using render::ShadeContext;
using render::ShadePoint;
using render::Vec3f;

constexpr std::uint32_t most_steps = 1024;

// The parameter block begins with this. Then come rows times columns places (u, v) of the picture,
// row by row, at even steps of x/z and y/z in the camera's frame.
struct Block {
  std::uint32_t picture;
  std::uint32_t lit;
  std::array<float, 3> gain;
  std::uint32_t columns, rows;  // 0 = no camera
  std::array<float, 12> cam_from_set;
  std::array<float, 2> first, steps_a_unit;  // of x/z and y/z: where the grid begins
  float uv_per_tangent;                      // at the picture's middle
};

Block block_of(const Material& material) {
  Block block;
  std::memcpy(&block, material.parameters.data(), sizeof block);
  return block;
}

struct Place {
  float u, v;
};

Place grid_at(const Material& material,
              const Block& block,
              std::uint32_t row,
              std::uint32_t column) {
  Place place;
  const std::size_t index = std::size_t{row} * block.columns + column;
  std::memcpy(&place, material.parameters.data() + sizeof(Block) + index * sizeof place,
              sizeof place);
  return place;
}

struct LookUp {
  Place place;
  float uv_per_metre;
};

// Through the camera's lens; nothing where it does not see.
std::optional<LookUp> seen_by_camera(const Material& material, const Block& b, Vec3f p) {
  const auto& m = b.cam_from_set;
  const float z = m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11];
  if (!(z > 1e-4F)) return std::nullopt;
  const float x = (m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3]) / z;
  const float y = (m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7]) / z;
  const float gx = (x - b.first[0]) * b.steps_a_unit[0];
  const float gy = (y - b.first[1]) * b.steps_a_unit[1];
  const auto last_x = static_cast<float>(b.columns - 1), last_y = static_cast<float>(b.rows - 1);
  if (!(gx >= 0 && gx <= last_x && gy >= 0 && gy <= last_y)) return std::nullopt;
  const std::uint32_t column = std::min(static_cast<std::uint32_t>(gx), b.columns - 2);
  const std::uint32_t row = std::min(static_cast<std::uint32_t>(gy), b.rows - 2);
  const float fx = gx - static_cast<float>(column), fy = gy - static_cast<float>(row);
  const Place a = grid_at(material, b, row, column), c = grid_at(material, b, row, column + 1);
  const Place d = grid_at(material, b, row + 1, column);
  const Place e = grid_at(material, b, row + 1, column + 1);
  const auto mixed = [&](float p00, float p01, float p10, float p11) {
    return (p00 * (1 - fx) + p01 * fx) * (1 - fy) + (p10 * (1 - fx) + p11 * fx) * fy;
  };
  const Place place{mixed(a.u, c.u, d.u, e.u), mixed(a.v, c.v, d.v, e.v)};
  // Where the lens does not see, the grid holds no numbers.
  if (!(std::isfinite(place.u) && std::isfinite(place.v))) return std::nullopt;
  return LookUp{place, b.uv_per_tangent / z};
}

std::optional<LookUp> find(const Material& material, const Block& block, const HitPoint& hit) {
  if (block.columns == 0) return LookUp{{hit.u, hit.v}, hit.uv_per_metre};
  return seen_by_camera(material, block, hit.position);
}

std::array<float, 4> seen(const ShadeContext& context,
                          const Material& material,
                          const Block& block,
                          const HitPoint& hit,
                          float footprint_m) {
  const auto at = find(material, block, hit);
  if (!at) return {};
  return context.pictures[block.picture]->look_up(at->place.u, at->place.v,
                                                  footprint_m * at->uv_per_metre);
}

Vec3f foreground(const Block& block, const std::array<float, 4>& rgba) {
  return {rgba[0] * block.gain[0], rgba[1] * block.gain[1], rgba[2] * block.gain[2]};
}

Vec3f grey(float value) { return {value, value, value}; }

class BillboardShader final : public render::Shader {
 public:
  void check(const render::SceneDescription&, const Material& material) const override {
    const auto refuse = [&](const char* reason) {
      throw std::invalid_argument("billboard \"" + material.name + "\": " + reason);
    };
    if (material.parameters.size() < sizeof(Block)) refuse("wrong parameter block");
    const Block b = block_of(material);
    if (b.columns > most_steps || b.rows > most_steps || b.columns == 1 || b.rows == 1 ||
        (b.columns == 0) != (b.rows == 0)) {
      refuse("wrong size of the lens's grid");
    }
    if (material.parameters.size() !=
        sizeof(Block) + std::size_t{b.columns} * b.rows * sizeof(Place)) {
      refuse("wrong parameter block");
    }
    for (const float gain : b.gain) {
      if (!(gain >= 0 && std::isfinite(gain))) refuse("gain must be finite, and 0 or more");
    }
    const auto all_finite = [](const auto& values) {
      return std::ranges::all_of(values, [](float v) { return std::isfinite(v); });
    };
    if (!all_finite(b.cam_from_set) || !all_finite(b.first) || !all_finite(b.steps_a_unit) ||
        !std::isfinite(b.uv_per_tangent)) {
      refuse("its camera is not finite");
    }
  }

  void shade(const ShadeContext& context,
             std::span<ShadePoint* const> points,
             render::RaySink& rays) const override {
    constexpr float per_pi = 0.318309886F;
    for (ShadePoint* p : points) {
      const Material& material = context.scene->materials[p->hit.material];
      const Block block = block_of(material);
      // A rough lobe sees it as wide as the lobe is there.
      const float width_m = std::max(p->footprint_m, p->blur_m);
      const std::array<float, 4> rgba = seen(context, material, block, p->hit, width_m);
      if (block.lit != 0) {
        p->diffuse = foreground(block, rgba) * per_pi;
        p->light_normal = p->hit.normal;
      } else {
        p->radiance = foreground(block, rgba);
      }
      if (!(rgba[3] < 1)) continue;
      rays.push(*p, {render::offset_origin(p->hit, p->incoming),
                     p->incoming,
                     p->throughput * (1 - rgba[3]),
                     {},
                     0,
                     {},
                     p->kind});
    }
  }

  bool lets_light_through(const Material&) const override { return true; }

  std::optional<std::size_t> picture_of(const Material& material) const override {
    return block_of(material).picture;
  }

  std::optional<Layer> layer(const ShadeContext& context,
                             const Material& material,
                             const HitPoint& hit,
                             float footprint_m) const override {
    const Block block = block_of(material);
    const std::array<float, 4> rgba = seen(context, material, block, hit, footprint_m);
    const Vec3f shown = foreground(block, rgba), passed = grey(1 - rgba[3]);
    return block.lit != 0 ? Layer{{}, passed, shown} : Layer{shown, passed};
  }

  // A hole is where the camera does not see; how clear a place is within its picture depends on how
  // wide the ray is, and is left to shade().
  Vec3f transmittance(const ShadeContext& context,
                      const Material& material,
                      const HitPoint& hit,
                      Vec3f,
                      RayKind kind) const override {
    const Block block = block_of(material);
    if (kind == RayKind::shadow) return grey(1 - seen(context, material, block, hit, 0)[3]);
    return find(material, block, hit) ? Vec3f{} : grey(1);
  }
};

Material material_of(std::string name, const Block& block, const std::vector<Place>& grid) {
  Material material{std::move(name), "billboard", {}};
  material.parameters.resize(sizeof block + grid.size() * sizeof(Place));
  std::memcpy(material.parameters.data(), &block, sizeof block);
  if (!grid.empty()) {
    std::memcpy(material.parameters.data() + sizeof block, grid.data(),
                grid.size() * sizeof(Place));
  }
  return material;
}

Block block_from(const BillboardSettings& settings) {
  for (const float gain : settings.gain) {
    if (!(gain >= 0 && std::isfinite(gain))) {
      throw std::invalid_argument("a billboard's gain must be finite, and 0 or more");
    }
  }
  Block block{};
  block.picture = settings.picture;
  block.lit = settings.lit ? 1 : 0;
  block.gain = settings.gain;
  return block;
}

// x/z and y/z of what the picture's rim and inside show.
struct Window {
  double x0 = std::numeric_limits<double>::max(), x1 = -x0, y0 = x0, y1 = -x0;
};
Window window_of(const calibrate::Lens& lens) {
  constexpr int places = 64;
  Window window;
  for (int j = 0; j <= places; ++j) {
    for (int i = 0; i <= places; ++i) {
      const double share_x = static_cast<double>(i) / places;
      const double share_y = static_cast<double>(j) / places;
      const auto v =
          calibrate::unproject(lens, {lens.width * share_x - 0.5, lens.height * share_y - 0.5});
      if (!v) continue;
      if (!(std::atan2(std::hypot(v->x, v->y), v->z) < widest_billboard_rad)) {
        throw std::invalid_argument(
            "a billboard's camera must see less than 75 degrees off its axis");
      }
      window.x0 = std::min(window.x0, v->x / v->z), window.x1 = std::max(window.x1, v->x / v->z);
      window.y0 = std::min(window.y0, v->y / v->z), window.y1 = std::max(window.y1, v->y / v->z);
    }
  }
  if (!(window.x0 < window.x1 && window.y0 < window.y1)) {
    throw std::invalid_argument("a billboard's camera sees nothing");
  }
  return window;
}

}  // namespace

void register_billboards() {
  render::register_shader("billboard", std::make_shared<BillboardShader>());
}

Material make_billboard_material(std::string name, const BillboardSettings& settings) {
  return material_of(std::move(name), block_from(settings), {});
}

Material make_billboard_material(std::string name,
                                 const BillboardSettings& settings,
                                 const BillboardCamera& camera,
                                 int steps) {
  const calibrate::Lens& lens = camera.lens;
  calibrate::check(lens);
  if (steps < 1 || steps >= static_cast<int>(most_steps)) {
    throw std::invalid_argument("a lens's grid has 1 to 1023 steps");
  }
  Block block = block_from(settings);
  const Window window = window_of(lens);
  const double step_x = (window.x1 - window.x0) / steps, step_y = (window.y1 - window.y0) / steps;
  block.columns = block.rows = static_cast<std::uint32_t>(steps) + 1;
  block.first = {static_cast<float>(window.x0), static_cast<float>(window.y0)};
  block.steps_a_unit = {static_cast<float>(1 / step_x), static_cast<float>(1 / step_y)};
  const auto& R = camera.cam_from_set.R.m;
  const calibrate::Vec3& t = camera.cam_from_set.t;
  const std::array<double, 3> moved{t.x, t.y, t.z};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t c = 0; c < 3; ++c)
      block.cam_from_set[row * 4 + c] = static_cast<float>(R[row * 3 + c]);
    block.cam_from_set[row * 4 + 3] = static_cast<float>(moved[row]);
  }
  std::vector<Place> grid;
  for (std::uint32_t row = 0; row < block.rows; ++row) {
    for (std::uint32_t column = 0; column < block.columns; ++column) {
      const auto q =
          calibrate::project(lens, {window.x0 + column * step_x, window.y0 + row * step_y, 1});
      constexpr float none = std::numeric_limits<float>::quiet_NaN();
      grid.push_back(!q ? Place{none, none}
                        : Place{static_cast<float>((q->x + 0.5) / lens.width),
                                static_cast<float>((q->y + 0.5) / lens.height)});
    }
  }
  // As many pixels as the whole picture has, over the solid angle of its window.
  block.uv_per_tangent =
      static_cast<float>(1 / std::sqrt((window.x1 - window.x0) * (window.y1 - window.y0)));
  return material_of(std::move(name), block, grid);
}

render::Mesh make_billboard_mesh(std::uint32_t material) {
  render::Mesh mesh;
  mesh.positions = {{-0.5F, 0, 0}, {0.5F, 0, 0}, {0.5F, 0, 1}, {-0.5F, 0, 1}};
  mesh.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.materials = {material};
  return mesh;
}

}  // namespace compositing
