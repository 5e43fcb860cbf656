// Photons through clear bodies, and what they light.
#include "render/caustics.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "capture/parallel_loop.h"
#include "render/glass.h"
#include "render/ray_differential.h"
#include "render/scene_parts.h"
#include "render/standard.h"
#include "render/trace.h"
#include "render/transform.h"

namespace render {
namespace {

constexpr float pi = std::numbers::pi_v<float>;
constexpr int deepest = 24;              // surfaces that a photon meets
constexpr float least_followed = 1e-3F;  // of a photon, whatever accuracy is asked for
constexpr int most_rays = 128;           // of a photon and its parts; the rest is lost
constexpr int photons_at_once = 64;
// Of photons at once: more ways are not known, more landings lost.
constexpr std::size_t most_ways = 32 * photons_at_once, most_landings = 8 * photons_at_once;
constexpr std::size_t spots_in_leaf = 8;
// Standard deviation of a photon's share of the grid, of the distance to the next: photons that do
// not spread then add up to an even light, but for four thousandths.
constexpr float spread_in_grid = 0.7F;
// The same of a pixel's width.
constexpr float spread_in_pixel = 0.4F;
// Irradiance of a spot, of its light's, that is not worth noting. Some twelve of them overlap.
constexpr float dimmest = 2e-4F;
// How far off the surface a spot still lights, of its smaller radius: of what curves, all but a
// rim.
constexpr float thickness = 0.1F;
constexpr std::size_t most_known_ways = std::size_t{1} << 21;
// Surfaces that face so far away from the one that a photon fell on are others.
constexpr float same_way = 0.5F;
constexpr float flattest = 0.05F;  // cosine, of what spreads over a surface

float sum(Vec3f v) { return v.x + v.y + v.z; }

// The light's grid over a body's box.
struct Grid {
  std::size_t number = 0;  // of the followed lights
  std::uint32_t instance = 0;
  Vec3f to_light, a, b;  // unit
  Vec3f corner;          // of the grid, in front of the box
  float step_m = 0;
  int columns = 0, rows = 0;
  float rim_rad = 0;  // of the light
};

// A photon on its way.
struct Photon {
  Vec3f origin, direction, share;  // of the light that it began with
  Media media;
  int depth = 0;      // surfaces that it has met
  bool bent = false;  // it has met a clear body
  // Its neighbours in the grid, one way and the other; and those from the light's rim.
  std::array<RayDifferential, 4> neighbours;
};

Vec3f axis(Vec3f direction) {
  return normalize(
      cross(std::abs(direction.z) < 0.9F ? Vec3f{0, 0, 1} : Vec3f{1, 0, 0}, direction));
}

Vec3f only(Vec3f v, std::size_t channel) {
  return {channel == 0 ? v.x : 0.0F, channel == 1 ? v.y : 0.0F, channel == 2 ? v.z : 0.0F};
}

bool has_glass(const Scene& scene, const Mesh& mesh) {
  return std::ranges::any_of(mesh.materials,
                             [&](std::uint32_t m) { return scene.glass_of(m) != nullptr; });
}

// Of the triangles that are clear.
Scene::Bounds clear_bounds(const Scene& scene,
                           const Mesh& mesh,
                           const std::array<float, 12>& set_from_mesh) {
  Scene::Bounds bounds = no_bounds;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (scene.glass_of(material_of(mesh, t)) == nullptr) continue;
    for (const std::uint32_t corner : mesh.triangles[t]) {
      const Vec3f p = transform_point(set_from_mesh, mesh.positions[corner]);
      if (is_finite(p)) bounds = joined(bounds, {p, p});
    }
  }
  return bounds;
}

// The grid, but for its steps.
Grid grid_over(const Scene::Bounds& box, Vec3f to_light) {
  Grid grid;
  grid.to_light = to_light;
  grid.a = axis(to_light);
  grid.b = cross(to_light, grid.a);
  const Vec3f middle = (box.lower + box.upper) * 0.5F, half = (box.upper - box.lower) * 0.5F;
  const auto reach = [&](Vec3f along) {
    return half.x * std::abs(along.x) + half.y * std::abs(along.y) + half.z * std::abs(along.z);
  };
  const float wide = reach(grid.a), high = reach(grid.b);
  const Vec3f far = middle + half;
  const float rounding = std::max({std::abs(far.x), std::abs(far.y), std::abs(far.z)}) * 1e-5F;
  const float before = reach(to_light) * 1.01F + (wide + high) * 1e-3F + rounding;
  grid.corner = middle + to_light * before - grid.a * wide - grid.b * high;
  return grid;
}

// Traces some photons of one grid.
class PhotonTracer {
 public:
  PhotonTracer(const Scene& scene, const PhotonSettings& settings, const Grid& grid)
      : scene_(scene), grid_(grid), least_(std::max((1 - settings.accuracy) / 4, least_followed)) {}

  void trace(int index) {
    const auto column = static_cast<float>(index % grid_.columns) + 0.5F;
    const auto row = static_cast<float>(index / grid_.columns) + 0.5F;
    const float step = grid_.step_m;
    Photon photon;
    photon.origin = grid_.corner + grid_.a * (column * step) + grid_.b * (row * step);
    photon.direction = -grid_.to_light;
    photon.neighbours[0].step = grid_.a * step;
    photon.neighbours[1].step = grid_.b * step;
    rays_of_photon_ = 0;
    note(photon.origin, grid_.to_light, ray_far);
    photon.share = transmittance(scene_, photon.origin, grid_.to_light, 0, ray_far,
                                 blockers | ray_glass_blocks);
    if (!(largest(photon.share) > least_)) return;
    waiting_.push_back(photon);
    while (!waiting_.empty() && rays_of_photon_ < most_rays) {
      const Photon next = waiting_.back();
      waiting_.pop_back();
      follow(next);
    }
    waiting_.clear();
  }

  std::vector<Photons::Landing> landings;
  std::vector<Photons::Way> ways;
  std::size_t rays = 0;
  bool knows_all_ways = true;

 private:
  static constexpr unsigned blockers = mask_virtual | mask_real_blocker;

  HitPoint point_at(const TracedHit& met, Vec3f direction) const {
    return scene_.hit_point(met.geom_id, met.prim_id, met.inst_id, met.u, met.v, direction);
  }

  static void arrive(Photon& photon, const HitPoint& hit, float distance_m) {
    for (RayDifferential& d : photon.neighbours) {
      d = arrived(d, hit, photon.direction, distance_m, flattest);
    }
  }

  void follow(Photon photon) {
    const auto met =
        closest_hit(scene_, photon.origin, photon.direction, 0,
                    photon.bent ? blockers | mask_stand_in : blockers, RayKind::reflection);
    note(photon.origin, photon.direction, met ? met->distance : ray_far);
    if (!met) return;
    photon.share = photon.share * passed_through(scene_, photon.media, met->distance);
    if (!(largest(photon.share) > least_)) return;
    const HitPoint hit = point_at(*met, photon.direction);
    arrive(photon, hit, met->distance);
    if (++photon.depth > deepest) return;
    if (scene_.glass_of(hit.material) != nullptr) {
      if (!photon.bent) {
        if (hit.instance != grid_.instance) return;
        // Rays from all over the light meet where this one does: they turn about the place.
        photon.neighbours[2] = {{}, grid_.a * grid_.rim_rad};
        photon.neighbours[3] = {{}, grid_.b * grid_.rim_rad};
        photon.bent = true;
      }
      cross_surface_at(photon, hit);
      return;
    }
    const Material& material = scene_.description().materials[hit.material];
    if (photon.bent && (material.shader == "standard" || material.shader == "stand_in")) {
      land(photon, hit);
    }
    const Shader& shader = scene_.shader_of(hit.material);
    if (!shader.lets_light_through(material)) return;
    const ShadeContext context{&scene_.description(), &scene_, scene_.pictures(),
                               scene_.prepared()};
    go_on(photon, hit,
          shader.transmittance(context, material, hit, photon.direction, RayKind::shadow, 0));
  }

  // Straight through the surface.
  void go_on(Photon photon, const HitPoint& hit, Vec3f share) {
    photon.share = photon.share * share;
    if (!(largest(photon.share) > least_)) return;
    photon.origin = offset_origin(hit, photon.direction);
    waiting_.push_back(photon);
  }

  void cross_surface_at(const Photon& photon, const HitPoint& hit) {
    const Crossing crossing =
        cross_surface(scene_, photon.media, {hit.instance, hit.material}, hit.back);
    if (!crossing.seen) {
      Photon on = photon;
      on.media = crossing.after;
      go_on(on, hit, {1, 1, 1});
      return;
    }
    const auto& ratio = crossing.ratio;
    if (ratio[0] == ratio[1] && ratio[1] == ratio[2]) {
      split(photon, hit, crossing.after, ratio[0], photon.share);
      return;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      split(photon, hit, crossing.after, ratio[c], only(photon.share, c));
    }
  }

  // As the shader does.
  void split(
      const Photon& photon, const HitPoint& hit, const Media& after, float ratio, Vec3f share) {
    const Vec3f incoming = photon.direction, normal = hit.normal;
    const float mirrors = fresnel(-dot(normal, incoming), ratio);
    if (largest(share) * mirrors > least_) {
      Photon back = photon;
      Vec3f direction = normalize(mirrored(-incoming, normal));
      const float into = dot(direction, hit.geometric_normal);
      if (into < 0) direction -= hit.geometric_normal * (2 * into);
      for (RayDifferential& d : back.neighbours) d.turn = mirrored_turn(hit, normal, incoming, d);
      push(back, hit, direction, share * mirrors);
    }
    if (!(largest(share) * (1 - mirrors) > least_)) return;
    Vec3f direction = refracted(incoming, normal, ratio);
    if (direction == Vec3f{}) return;
    const float back = dot(direction, hit.geometric_normal);
    if (back > -1e-4F) {
      direction = normalize(direction - hit.geometric_normal * (back + 1e-3F));
    }
    Photon on = photon;
    on.media = after;
    for (RayDifferential& d : on.neighbours) {
      d.turn = refracted_turn(hit, incoming, direction, ratio, d);
    }
    push(on, hit, direction, share * (1 - mirrors));
  }

  void push(Photon& photon, const HitPoint& hit, Vec3f direction, Vec3f share) {
    photon.origin = offset_origin(hit, direction);
    photon.direction = direction;
    photon.share = share;
    waiting_.push_back(photon);
  }

  void land(const Photon& photon, const HitPoint& hit) {
    if (landings.size() >= most_landings) return;
    Photons::Landing& landing = landings.emplace_back();
    landing.position = hit.position;
    landing.normal = hit.geometric_normal;
    landing.share = photon.share * (grid_.step_m * grid_.step_m);
    for (std::size_t i = 0; i < landing.neighbours.size(); ++i) {
      landing.neighbours[i] = photon.neighbours[i].step;
    }
  }

  void note(Vec3f from, Vec3f direction, float far_m) {
    ++rays_of_photon_;
    ++rays;
    if (ways.size() < most_ways) {
      ways.push_back({from, direction, far_m});
    } else {
      knows_all_ways = false;
    }
  }

  const Scene& scene_;
  const Grid& grid_;
  float least_;
  int rays_of_photon_ = 0;
  std::vector<Photon> waiting_;
};

// What a photon lights: an ellipse with the second moments of all that it stands for. Nothing if
// that is too dim.
std::optional<Caustics::Spot> spot_of(const Photons::Landing& landing, const CausticView& view) {
  const Vec3f normal = landing.normal;
  const Vec3f t = axis(normal), s = cross(normal, t);
  float tt = 0, ss = 0, ts = 0;
  const auto add = [&](Vec3f v, float variance) {
    const float x = dot(v, t), y = dot(v, s);
    tt += variance * x * x, ss += variance * y * y, ts += variance * x * y;
  };
  constexpr float of_grid = spread_in_grid * spread_in_grid, of_disc = 0.25F;
  add(landing.neighbours[0], of_grid), add(landing.neighbours[1], of_grid);
  add(landing.neighbours[2], of_disc), add(landing.neighbours[3], of_disc);
  const Vec3f seen = landing.position - view.camera;
  const float pixel_m = length(seen) * view.pixel_rad;
  const Vec3f gaze = normalize(seen), level = normalize(cross(gaze, normal));
  constexpr float of_pixel = spread_in_pixel * spread_in_pixel;
  if (level != Vec3f{}) {
    add(level * pixel_m, of_pixel);
    add(cross(normal, level) * (pixel_m / std::max(std::abs(dot(gaze, normal)), 0.1F)), of_pixel);
  } else {
    add(t * pixel_m, of_pixel), add(s * pixel_m, of_pixel);
  }
  // Never narrower than what numbers tell apart.
  const float size = std::max({std::abs(landing.position.x), std::abs(landing.position.y),
                               std::abs(landing.position.z), 1e-3F});
  const float least = size * 1e-5F;
  tt += least * least, ss += least * least;
  // Main axes.
  const float half = 0.5F * (tt - ss), root = calibrate::hypotenuse(half, ts);
  const float wide = 0.5F * (tt + ss) + root;
  const float narrow = std::max((tt * ss - ts * ts) / wide, least * least);
  const float turn = 0.5F * std::atan2(ts, half);
  const Vec3f a = t * std::cos(turn) + s * std::sin(turn), b = cross(normal, a);
  // (1 - r^2)^2 on an ellipse has an eighth of its squared radii as moments.
  const float ra = std::sqrt(8 * wide), rb = std::sqrt(8 * narrow);
  Caustics::Spot spot;
  spot.peak = landing.share * (3 / (pi * ra * rb));
  if (!(largest(spot.peak) > dimmest) || !is_finite(spot.peak)) return std::nullopt;
  spot.centre = landing.position;
  spot.normal = normal;
  spot.across = a * (1 / ra), spot.along = b * (1 / rb);
  spot.thickness_m = std::max(thickness * rb, 10 * least);
  const auto reach = [&](float ax, float bx, float nx) {
    return calibrate::hypotenuse(ra * ax, rb * bx) + spot.thickness_m * std::abs(nx);
  };
  const Vec3f r{reach(a.x, b.x, normal.x), reach(a.y, b.y, normal.y), reach(a.z, b.z, normal.z)};
  spot.bounds = {spot.centre - r, spot.centre + r};
  return spot;
}

bool holds(const Scene::Bounds& b, Vec3f p) {
  return p.x >= b.lower.x && p.x <= b.upper.x && p.y >= b.lower.y && p.y <= b.upper.y &&
         p.z >= b.lower.z && p.z <= b.upper.z;
}

// Whether the way may pass through the box, or touch it.
bool meets(const Scene::Bounds& box, const Photons::Way& way) {
  float first = 0, last = way.far_m;
  const auto cut = [&](float lower, float upper, float from, float direction) {
    const float margin = 1e-5F * std::max({std::abs(lower), std::abs(upper), std::abs(from)});
    const float low = lower - margin - from, high = upper + margin - from;
    if (direction == 0) return low <= 0 && high >= 0;
    const float a = low / direction, b = high / direction;
    first = std::max(first, std::min(a, b)), last = std::min(last, std::max(a, b));
    return first <= last;
  };
  return cut(box.lower.x, box.upper.x, way.from.x, way.direction.x) &&
         cut(box.lower.y, box.upper.y, way.from.y, way.direction.y) &&
         cut(box.lower.z, box.upper.z, way.from.z, way.direction.z);
}

// The brightest lights that have some share of all, at most so many.
std::vector<std::uint32_t> brightest(const LightTable& table, std::size_t most) {
  float total = 0;
  std::vector<std::uint32_t> numbers;
  for (const DirectionalLight& light : table.lights) total += std::max(sum(light.irradiance), 0.0F);
  for (std::uint32_t i = 0; i < table.lights.size(); ++i) {
    if (sum(table.lights[i].irradiance) > least_caustic_share * total) numbers.push_back(i);
  }
  std::ranges::stable_sort(numbers, std::greater{},
                           [&](std::uint32_t i) { return sum(table.lights[i].irradiance); });
  if (numbers.size() > most) numbers.resize(most);
  std::ranges::sort(numbers);
  return numbers;
}

// The grids of all lights over all bodies, each as fine as its light counts. Adds to the ways where
// the bodies are; `whole`: all of them are somewhere.
std::vector<Grid> find_grids(const Scene& scene,
                             const LightTable& table,
                             const std::vector<std::uint32_t>& lights,
                             int photons,
                             std::vector<Photons::Way>& ways,
                             bool& whole) {
  const SceneDescription& description = scene.description();
  std::vector<Grid> grids;
  std::vector<std::array<float, 2>> sizes;
  float total = 0;  // light on all boxes
  const auto light_of = [&](const Grid& grid) {
    return sum(table.lights[lights[grid.number]].irradiance);
  };
  for (std::uint32_t i = 0; i < description.instances.size(); ++i) {
    const Instance& instance = description.instances[i];
    const Mesh& mesh = *description.meshes[instance.mesh];
    if (!has_glass(scene, mesh)) continue;
    const Scene::Bounds box = clear_bounds(scene, mesh, instance.set_from_object);
    if (!(box.lower.x <= box.upper.x)) {
      whole = false;
      continue;
    }
    ways.push_back({(box.lower + box.upper) * 0.5F, {}, 0});  // the body is in its own way
    for (std::size_t n = 0; n < lights.size(); ++n) {
      const DirectionalLight& light = table.lights[lights[n]];
      Grid grid = grid_over(box, light.direction);
      grid.number = n;
      grid.instance = i;
      grid.rim_rad = light.spread;
      const Vec3f diagonal = ((box.lower + box.upper) * 0.5F - grid.corner) * 2.0F;
      const float wide = dot(diagonal, grid.a), high = dot(diagonal, grid.b);
      if (!(std::max(wide, high) > 0) || !std::isfinite(wide * high)) continue;
      sizes.push_back({wide, high});
      grids.push_back(grid);
      total += light_of(grid) * wide * high;
    }
  }
  for (std::size_t i = 0; i < grids.size(); ++i) {
    Grid& grid = grids[i];
    const auto [wide, high] = sizes[i];
    // Each body has one at least of each light, or would be opaque to it.
    const float share = light_of(grid) * wide * high / total;
    const float all = static_cast<float>(photons);
    const float count = std::clamp(share >= 0 ? share * all : 1.0F, 1.0F, all);
    // Whole steps: the last ones may reach past the box. Of a box that is hardly high, one row.
    grid.step_m = std::max(std::sqrt(wide * high / count), std::max(wide, high) / count);
    grid.columns = std::max(static_cast<int>(std::ceil(wide / grid.step_m)), 1);
    grid.rows = std::max(static_cast<int>(std::ceil(high / grid.step_m)), 1);
    grid.corner -= grid.a * (0.5F * (static_cast<float>(grid.columns) * grid.step_m - wide)) +
                   grid.b * (0.5F * (static_cast<float>(grid.rows) * grid.step_m - high));
  }
  return grids;
}

}  // namespace

Photons::Photons(const Scene& scene, const LightTable& planned, const PhotonSettings& settings) {
  // No more lights than photons can tell apart on every body.
  const auto& instances = scene.description().instances;
  const auto bodies =
      static_cast<std::size_t>(std::ranges::count_if(instances, [&](const Instance& instance) {
        return has_glass(scene, *scene.description().meshes[instance.mesh]);
      }));
  const std::size_t each =
      static_cast<std::size_t>(std::max(settings.photons, 0)) / std::max<std::size_t>(bodies, 1);
  lights_ = brightest(planned, std::min(most_caustic_lights, each));
  const std::vector<Grid> grids =
      find_grids(scene, planned, lights_, settings.photons, ways_, knows_all_ways_);
  // A light that no photon is left for goes straight through.
  const auto has_grid = [&](std::size_t n) {
    return std::ranges::any_of(grids, [&](const Grid& grid) { return grid.number == n; });
  };
  follows_.assign(planned.lights.size(), 0);
  for (std::size_t n = 0; n < lights_.size(); ++n) follows_[lights_[n]] = has_grid(n) ? 1 : 0;
  landings_.resize(lights_.size());
  for (const Grid& grid : grids) {
    const int photons = grid.columns * grid.rows;
    std::vector<PhotonTracer> parts(
        static_cast<std::size_t>((photons + photons_at_once - 1) / photons_at_once),
        PhotonTracer(scene, settings, grid));
    capture::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
      prepare_thread();
      const int first = static_cast<int>(part) * photons_at_once;
      const int last = std::min(first + photons_at_once, photons);
      for (int i = first; i < last; ++i) parts[part].trace(i);
    });
    std::vector<Landing>& all = landings_[grid.number];
    for (const PhotonTracer& part : parts) {
      all.insert(all.end(), part.landings.begin(), part.landings.end());
      rays_ += part.rays;
      knows_all_ways_ = knows_all_ways_ && part.knows_all_ways &&
                        ways_.size() + part.ways.size() <= most_known_ways;
      if (knows_all_ways_) ways_.insert(ways_.end(), part.ways.begin(), part.ways.end());
    }
  }
}

bool Photons::pass(const std::vector<Scene::Bounds>& boxes) const {
  if (boxes.empty()) return false;
  if (!knows_all_ways_) return true;
  Scene::Bounds all = no_bounds;
  for (const Scene::Bounds& box : boxes) all = joined(all, box);
  return std::ranges::any_of(ways_, [&](const Way& way) {
    return meets(all, way) &&
           std::ranges::any_of(boxes, [&](const Scene::Bounds& box) { return meets(box, way); });
  });
}

Caustics::Caustics(std::shared_ptr<const Photons> photons, const CausticView& view)
    : photons_(std::move(photons)), spots_(photons_->landings().size()) {
  capture::parallel_for(std::size_t{0}, spots_.size(), [&](std::size_t n) {
    prepare_thread();
    for (const Photons::Landing& landing : photons_->landings()[n]) {
      if (const auto spot = spot_of(landing, view)) spots_[n].spots.push_back(*spot);
    }
    spots_[n].build();
  });
  const auto mix = [&](std::uint64_t value) {
    key_ = (key_ ^ value) * 0xFF51AFD7ED558CCDULL;
    key_ ^= key_ >> 32;
  };
  const auto mix_vector = [&](Vec3f v) {
    mix(std::uint64_t{std::bit_cast<std::uint32_t>(v.x)} << 32 | std::bit_cast<std::uint32_t>(v.y));
    mix(std::bit_cast<std::uint32_t>(v.z));
  };
  for (const Spots& one : spots_) {
    mix(one.spots.size());
    for (const Spot& spot : one.spots) {
      for (const Vec3f& v : {spot.centre, spot.normal, spot.across, spot.along, spot.peak}) {
        mix_vector(v);
      }
    }
  }
}

Vec3f Caustics::at(std::size_t number, Vec3f position, Vec3f normal) const {
  return spots_[number].at(position, normal);
}

std::vector<Scene::Bounds> Caustics::regions() const {
  constexpr std::size_t most = 64;
  const std::size_t each = std::bit_floor(most / std::max<std::size_t>(spots_.size(), 1));
  std::vector<Scene::Bounds> regions;
  for (const Spots& one : spots_) {
    if (one.spots.empty()) continue;
    const std::size_t count = std::min(each, one.leaves);
    for (std::size_t i = 0; i < count; ++i) regions.push_back(one.nodes[count - 1 + i]);
  }
  return regions;
}

void Caustics::Spots::build() {
  leaves =
      std::bit_ceil(std::max<std::size_t>((spots.size() + spots_in_leaf - 1) / spots_in_leaf, 1));
  nodes.assign(2 * leaves - 1, no_bounds);
  sort(0, 0, leaves);
}

// Leaves first .. last - 1 lie under the node.
void Caustics::Spots::sort(std::size_t node, std::size_t first, std::size_t last) {
  const auto place = [&](std::size_t leaf) { return spots.size() * leaf / leaves; };
  const auto begin = spots.begin() + static_cast<std::ptrdiff_t>(place(first));
  const auto end = spots.begin() + static_cast<std::ptrdiff_t>(place(last));
  Scene::Bounds centres = no_bounds;
  for (auto spot = begin; spot != end; ++spot) {
    nodes[node] = joined(nodes[node], spot->bounds);
    centres = joined(centres, {spot->centre, spot->centre});
  }
  if (last - first == 1 || begin == end) return;
  const Vec3f size = centres.upper - centres.lower;
  const std::size_t middle = first + (last - first) / 2;
  const auto key = [&](const Spot& spot) {
    return size.x >= size.y && size.x >= size.z ? spot.centre.x
           : size.y >= size.z                   ? spot.centre.y
                                                : spot.centre.z;
  };
  std::ranges::nth_element(begin, spots.begin() + static_cast<std::ptrdiff_t>(place(middle)), end,
                           {}, key);
  sort(2 * node + 1, first, middle);
  sort(2 * node + 2, middle, last);
}

Vec3f Caustics::Spots::at(Vec3f position, Vec3f normal) const {
  Vec3f irradiance;
  if (spots.empty()) return irradiance;
  std::array<std::size_t, 64> waiting;
  std::size_t count = 0;
  waiting[count++] = 0;
  while (count > 0) {
    const std::size_t node = waiting[--count];
    if (!holds(nodes[node], position)) continue;
    if (node < leaves - 1) {
      waiting[count++] = 2 * node + 1;
      waiting[count++] = 2 * node + 2;
      continue;
    }
    const std::size_t leaf = node - (leaves - 1);
    const std::size_t last = spots.size() * (leaf + 1) / leaves;
    for (std::size_t i = spots.size() * leaf / leaves; i < last; ++i) {
      const Spot& spot = spots[i];
      const Vec3f off = position - spot.centre;
      const float x = dot(off, spot.across), y = dot(off, spot.along);
      const float inside = 1 - x * x - y * y;
      if (!(inside > 0) || std::abs(dot(off, spot.normal)) > spot.thickness_m ||
          !(dot(normal, spot.normal) > same_way)) {
        continue;
      }
      irradiance += spot.peak * (inside * inside);
    }
  }
  return irradiance;
}

std::shared_ptr<const Caustics> CausticFollower::follow(const Scene& scene,
                                                        const LightTable& planned,
                                                        const PhotonSettings& settings,
                                                        const CausticView& view) {
  if (settings.photons <= 0 || !scene.has_glass()) {
    *this = {};
    return nullptr;
  }
  bool stay = false;
  if (plan_ && plan_->settings == settings && plan_->lights == planned.lights) {
    const auto moved = Scene::moved(plan_->places, scene.places());
    stay = moved && !photons_->pass(*moved);
  }
  if (stay && view_ == view) {
    plan_->places = scene.places();
    return caustics_;
  }
  // Whatever throws leaves what was.
  const auto photons = stay ? photons_ : std::make_shared<const Photons>(scene, planned, settings);
  caustics_ = std::make_shared<const Caustics>(photons, view);
  photons_ = photons;
  plan_ = Plan{scene.places(), planned.lights, settings};
  view_ = view;
  return caustics_;
}

}  // namespace render
