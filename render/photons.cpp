// Photons through clear bodies.
#include "render/photons.h"

#include <algorithm>
#include <cmath>

#include "capture/parallel_loop.h"
#include "render/glass.h"
#include "render/ray_differential.h"
#include "render/scene_parts.h"
#include "render/trace.h"
#include "render/transform.h"

namespace render {
namespace {

constexpr int deepest = 24;              // surfaces that a photon meets
constexpr float least_followed = 1e-3F;  // of a photon, whatever accuracy is asked for
constexpr int most_rays = 128;           // of a photon and its parts; the rest is lost
constexpr int photons_at_once = 64;
// Of photons at once: more ways are not known, more landings lost.
constexpr std::size_t most_ways = 32 * photons_at_once, most_landings = 8 * photons_at_once;
constexpr std::size_t most_known_ways = std::size_t{1} << 21;
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
  float wide_m = 0, high_m = 0;  // of what it is over
  float rim_rad = 0;             // of the light
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
  grid.a = unit_across(to_light);
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
  grid.wide_m = 2 * wide, grid.high_m = 2 * high;
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

  // A real surface that hides nothing is met only if nothing virtual is behind it.
  bool looks_on(const Photon& photon, const TracedHit& met) const {
    if (!photon.bent || !scene_.has_standing_back()) return false;
    const std::uint32_t instance =
        scene_.surface_of(met.geom_id, met.prim_id, met.inst_id).instance;
    const Instance& real = scene_.description().instances[instance];
    return real.kind == ObjectKind::stand_in && !real.occludes;
  }

  void follow(Photon photon) {
    const auto met =
        closest_hit(scene_, photon.origin, photon.direction, 0,
                    photon.bent ? blockers | mask_stand_in : blockers, RayKind::reflection);
    note(photon.origin, photon.direction, met && !looks_on(photon, *met) ? met->distance : ray_far);
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
      go_on(on, hit, crossing.tint);
      return;
    }
    const auto& ratio = crossing.ratio;
    if (ratio[0] == ratio[1] && ratio[1] == ratio[2]) {
      split(photon, hit, crossing, ratio[0], photon.share);
      return;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      split(photon, hit, crossing, ratio[c], only_colour(photon.share, c));
    }
  }

  // As the shader does.
  void split(const Photon& photon,
             const HitPoint& hit,
             const Crossing& crossing,
             float ratio,
             Vec3f share) {
    const Vec3f incoming = photon.direction, normal = hit.normal;
    const float mirrors = fresnel(-dot(normal, incoming), ratio);
    if (largest(share) * mirrors > least_) {
      Photon back = photon;
      for (RayDifferential& d : back.neighbours) d.turn = mirrored_turn(hit, normal, incoming, d);
      push(back, hit, mirrored_off(hit, incoming), share * mirrors);
    }
    const Vec3f passes = share * (1 - mirrors) * crossing.tint;
    if (!(largest(passes) > least_)) return;
    const Vec3f direction = refracted_into(hit, incoming, ratio);
    if (direction == Vec3f{}) return;
    Photon on = photon;
    on.media = crossing.after;
    for (RayDifferential& d : on.neighbours) {
      d.turn = refracted_turn(hit, incoming, direction, ratio, d);
    }
    push(on, hit, direction, passes);
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
      const float area_m2 = grid.wide_m * grid.high_m;
      if (!(std::max(grid.wide_m, grid.high_m) > 0) || !std::isfinite(area_m2)) continue;
      grids.push_back(grid);
      total += light_of(grid) * area_m2;
    }
  }
  for (Grid& grid : grids) {
    const float wide = grid.wide_m, high = grid.high_m;
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
  if (grids.empty()) lights_.clear();
  follows_.assign(planned.lights.size(), 0);
  for (const std::uint32_t light : lights_) follows_[light] = 1;
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

}  // namespace render
