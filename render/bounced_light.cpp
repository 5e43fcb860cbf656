// Points, what reaches them, and lamps of them.
#include "render/bounced_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include "calibrate/angles.h"
#include "capture/parallel_loop.h"
#include "render/bounce_clusters.h"
#include "render/sample_sequence.h"
#include "render/scene_parts.h"
#include "render/standard.h"
#include "render/trace.h"
#include "render/transform.h"
#include "render/video_texture.h"

namespace render {
namespace {

using calibrate::pi_f;
constexpr unsigned blockers = mask_virtual | mask_real_blocker;
// Rays that tell how much of a point's light stays in the set.
constexpr std::uint32_t leaving_rays = 8;
constexpr std::uint32_t places_seed = 1, leaving_seed = 2;
// From how far off a surface a point on it is looked for, of the size of its coordinates.
constexpr float look = 1e-4F;
// The cosine from the normal at which a dielectric mirrors as much as in the mean over a dull
// surface's light: where Schlick's (1 - cosine)^5 is 1 / 21.
constexpr float mean_cosine = 0.456F;
constexpr int most_bounces = 12;  // of light: white walls keep .8 to the twelfth, a fourteenth

// A place on a mesh, before it is known what is there.
struct Place {
  std::uint32_t instance = 0;
  Vec3f position, normal;  // in the set; the normal unit, on one of its sides
  float size = 0;          // of the largest coordinate there
};

std::array<Vec3f, 3> corners_of(const Mesh& mesh, std::size_t t, const Instance& instance) {
  const auto& [a, b, c] = mesh.triangles[t];
  const auto& m = instance.set_from_object;
  return {transform_point(m, mesh.positions[a]), transform_point(m, mesh.positions[b]),
          transform_point(m, mesh.positions[c])};
}

// Calls `call` with the corners of each triangle that may send light, its area and its instance.
template <class F>
void for_each_triangle(const SceneDescription& scene, F&& call) {
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (instance.kind != ObjectKind::virtual_object) continue;
    const Mesh& mesh = *scene.meshes[instance.mesh];
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      if (scene.materials[material_of(mesh, t)].shader != "standard") continue;
      const auto corners = corners_of(mesh, t, instance);
      const float twice = length(cross(corners[1] - corners[0], corners[2] - corners[0]));
      if (twice > 0 && std::isfinite(twice)) call(corners, 0.5F * twice, i);
    }
  }
}

// Evenly over all surfaces, in their order, each standing for as much of them.
std::vector<Place> find_places(const SceneDescription& scene, int count, float& area_each_m2) {
  double total = 0;
  for_each_triangle(scene, [&](const auto&, float area, std::uint32_t) { total += area; });
  std::vector<Place> places;
  area_each_m2 = static_cast<float>(total / count);
  if (!(total > 0)) return places;
  double passed = 0;
  for_each_triangle(scene, [&](const auto& corners, float area, std::uint32_t instance) {
    passed += area;
    const auto until = std::min(static_cast<std::size_t>(std::floor(passed / total * count + 0.5)),
                                static_cast<std::size_t>(count));
    while (places.size() < until) {
      const auto number = static_cast<std::uint32_t>(places.size());
      const auto [a, b] = SampleSequence(places_seed, 0, number).next_pair();
      const float root = std::sqrt(a), u = root * (1 - b), v = root * b;
      Place place{instance, corners[0] * (1 - u - v) + corners[1] * u + corners[2] * v,
                  normalize(cross(corners[1] - corners[0], corners[2] - corners[0])), 0};
      for (const Vec3f& c : corners) {
        place.size = std::max({place.size, std::abs(c.x), std::abs(c.y), std::abs(c.z)});
      }
      places.push_back(place);
    }
  });
  return places;
}

Vec3f about(Vec3f normal, std::array<float, 2> random) {
  const float z = 1 - 2 * random[0], r = std::sqrt(std::max(0.0F, 1 - z * z));
  const float turn = 2 * pi_f * random[1];
  return normalize(normal + Vec3f{r * std::cos(turn), r * std::sin(turn), z} * (1 - look));
}

// Finds points and what each light of a table sends there.
class PointFinder {
 public:
  explicit PointFinder(const Scene& scene) : scene_(scene) {}

  // The surface of a place as it is seen from the side of its normal; nothing where another one
  // lies close above it, or it has a hole.
  std::optional<SurfacePoint> point_at(const Place& place, float area_m2, std::uint32_t number) {
    const float off = std::max(place.size, 1e-3F) * look;
    const auto met = meet(place.position + place.normal * off, -place.normal);
    if (!met || met->distance > 2 * off) return std::nullopt;
    SurfacePoint point;
    point.area_m2 = area_m2;
    point.hit =
        scene_.hit_point(met->geom_id, met->prim_id, met->inst_id, met->u, met->v, -place.normal);
    const SceneDescription& description = scene_.description();
    const Material& material = description.materials[point.hit.material];
    if (point.hit.instance != place.instance || material.shader != "standard") return std::nullopt;
    const Vec3f along = unit_across(point.hit.geometric_normal) * std::sqrt(area_m2);
    const StandardParameters parameters =
        standard_parameters(material, description.textures.size(), description.videos.size());
    const StandardSurface surface = standard_surface(
        parameters, description, point.hit, {along, cross(point.hit.geometric_normal, along)});
    const Vec3f aside = normalize(
        cross(std::abs(surface.normal.z) < 0.9F ? Vec3f{0, 0, 1} : Vec3f{1, 0, 0}, surface.normal));
    const Vec3f view =
        surface.normal * mean_cosine + aside * std::sqrt(1 - mean_cosine * mean_cosine);
    point.albedo = standard_weights(surface, view).diffuse;
    if (parameters.base_color_video >= 0) point.albedo = point.albedo * planned_grey;
    if (!(largest(point.albedo) > 0)) return std::nullopt;
    point.stays = staying_share(point.hit, number);
    return point;
  }

  // What a point sends back, as intensity along its normal, per unit of each light, then of each
  // lamp of the table.
  void light(const SurfacePoint& point, const LightTable& table, std::span<Vec3f> per_light) {
    const Receiver receiver(point);
    for (std::size_t i = 0; i < table.lights.size(); ++i) {
      const Vec3f direction = table.lights[i].direction;
      const float cosine = dot(point.hit.normal, direction);
      if (!(cosine > 0) || !(dot(point.hit.geometric_normal, direction) > 0)) continue;
      per_light[i] = receiver.gain * passing(receiver.at.origin, direction, ray_far) * cosine;
    }
    for (std::size_t i = 0; i < table.lamps.size(); ++i) {
      if (table.lamps[i].bounced != 0) continue;
      per_light[table.lights.size() + i] = receiver.gain * arriving(receiver.at, table.lamps[i]);
    }
  }

  // The same per unit of each of these lamps; and what arrives of them, over the point's area.
  void light(const SurfacePoint& point,
             std::span<const LocalLight> lamps,
             std::span<Vec3f> per_lamp,
             std::span<float> received) {
    const Receiver receiver(point);
    for (std::size_t i = 0; i < lamps.size(); ++i) {
      const Vec3f light = arriving(receiver.at, lamps[i]);
      per_lamp[i] = receiver.gain * light;
      received[i] = largest(light) * point.area_m2;
    }
  }

  std::uint64_t rays() const { return rays_; }

 private:
  struct Receiver {
    Vec3f gain;
    LampReceiver at;
    explicit Receiver(const SurfacePoint& p)
        : gain(p.albedo * (p.area_m2 / pi_f)),
          at{offset_origin(p.hit, p.hit.geometric_normal), p.hit.normal, p.hit.geometric_normal} {}
  };

  // Irradiance per intensity.
  Vec3f arriving(const LampReceiver& at, const LocalLight& lamp) {
    const auto ray = ray_to_lamp(at, lamp);
    if (!ray) return {};
    const Vec3f light{ray->per_intensity, ray->per_intensity, ray->per_intensity};
    return ray->far_m > 0 ? light * passing(at.origin, ray->direction, ray->far_m) : light;
  }
  std::optional<TracedHit> meet(Vec3f origin, Vec3f direction) {
    ++rays_;
    return closest_hit(scene_, origin, direction, 0, mask_virtual | mask_stand_in,
                       RayKind::reflection, LivePictures::passed);
  }
  Vec3f passing(Vec3f origin, Vec3f direction, float far_m) {
    ++rays_;
    return transmittance(scene_, origin, direction, 0, far_m, blockers, LivePictures::passed);
  }
  float staying_share(const HitPoint& hit, std::uint32_t number) {
    std::uint32_t stay = 0;
    const Vec3f origin = offset_origin(hit, hit.geometric_normal);
    for (std::uint32_t i = 0; i < leaving_rays; ++i) {
      const Vec3f direction =
          about(hit.geometric_normal, SampleSequence(leaving_seed, number, i).next_pair());
      stay += meet(origin, direction).has_value();
    }
    return static_cast<float>(stay) / leaving_rays;
  }

  const Scene& scene_;
  std::uint64_t rays_ = 0;
};

void check(const BounceSettings& settings) {
  if (settings.lamps < 0 || settings.lamps > most_lights) {
    throw std::invalid_argument("lamps of bounced light must be 0 to " +
                                std::to_string(most_lights));
  }
  if (settings.points < 1 || settings.points > most_bounce_points) {
    throw std::invalid_argument("points of bounced light must be 1 to " +
                                std::to_string(most_bounce_points));
  }
}

// Runs over points on all threads; `call` takes a finder and the point's number. Returns the rays.
template <class F>
std::uint64_t for_each_point(const Scene& scene, std::size_t count, F&& call) {
  std::vector<std::uint64_t> rays(count);
  capture::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    prepare_thread();
    PointFinder finder(scene);
    call(finder, i);
    rays[i] = finder.rays();
  });
  return std::accumulate(rays.begin(), rays.end(), std::uint64_t{0});
}

// A matrix of colours, row by row.
struct Colours {
  Colours(std::size_t height, std::size_t width) : columns(width), values(height * width) {}
  std::size_t columns;
  std::vector<Vec3f> values;
  std::span<Vec3f> row(std::size_t i) { return std::span(values).subspan(i * columns, columns); }
  std::span<const Vec3f> row(std::size_t i) const {
    return std::span(values).subspan(i * columns, columns);
  }
};

void add(std::span<const Vec3f> from, Vec3f times, std::span<Vec3f> to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += from[i] * times;
}

// What the lamps are in all, where they are so much of the lights and send so much on to each
// other: after so many bounces no light is left that would show.
Colours after_all_bounces(const Colours& of_lights, const Colours& of_lamps) {
  Colours all = of_lights;
  for (int bounce = 1; bounce < most_bounces; ++bounce) {
    Colours next = of_lights;
    for (std::size_t i = 0; i < of_lamps.columns; ++i) {
      for (std::size_t j = 0; j < of_lamps.columns; ++j) {
        const Vec3f share = of_lamps.row(i)[j];
        if (share != Vec3f{}) add(all.row(j), share, next.row(i));
      }
    }
    all = std::move(next);
  }
  return all;
}

// What lamps send to points: what these send on of it, per unit of each lamp, and what share of all
// that it gives each lamp would have sent.
struct Exchange {
  Colours per_lamp;
  std::vector<double> given;
};

Exchange exchange(const Scene& scene,
                  const std::vector<SurfacePoint>& points,
                  const std::vector<LocalLight>& lamps,
                  std::uint64_t& rays) {
  Exchange result{Colours(points.size(), lamps.size()), std::vector<double>(lamps.size())};
  std::vector<float> received(points.size() * lamps.size());
  rays += for_each_point(scene, points.size(), [&](PointFinder& finder, std::size_t i) {
    finder.light(points[i], lamps, result.per_lamp.row(i),
                 std::span(received).subspan(i * lamps.size(), lamps.size()));
  });
  for (std::size_t k = 0; k < received.size(); ++k) {
    result.given[k % lamps.size()] += received[k] / pi_f;
  }
  return result;
}

// Rows of points added up to rows of lamps.
Colours summed(const Colours& of_points, const Lamps& lamps) {
  Colours sums(lamps.lamps.size(), of_points.columns);
  for (std::size_t c = 0; c < lamps.points.size(); ++c) {
    for (const std::size_t i : lamps.points[c]) add(of_points.row(i), {1, 1, 1}, sums.row(c));
  }
  return sums;
}

// Points next to each other in their order mostly lie so on their surface as well: what stays of
// their light is told by the rays of all of them.
void share_staying(std::vector<std::optional<SurfacePoint>>& sides) {
  constexpr std::size_t reach = 8 * 2;  // on both ways, each place having two sides
  constexpr float alike = 0.9F;         // of normals
  std::vector<float> shares(sides.size());
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (!sides[i]) continue;
    int count = 0;
    const std::size_t first = i < reach ? i % 2 : i - reach;
    for (std::size_t k = first; k < sides.size() && k <= i + reach; k += 2) {
      if (!sides[k] || sides[k]->hit.instance != sides[i]->hit.instance ||
          !(dot(sides[k]->hit.normal, sides[i]->hit.normal) > alike)) {
        continue;
      }
      shares[i] += sides[k]->stays;
      ++count;
    }
    shares[i] /= static_cast<float>(std::max(count, 1));
  }
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (sides[i]) sides[i]->stays = shares[i];
  }
}

std::vector<SurfacePoint> find_points(const Scene& scene, int count, std::uint64_t& rays) {
  float area_m2 = 0;
  const std::vector<Place> places = find_places(scene.description(), count, area_m2);
  std::vector<std::optional<SurfacePoint>> sides(2 * places.size());
  rays += for_each_point(scene, sides.size(), [&](PointFinder& finder, std::size_t i) {
    Place place = places[i / 2];
    if (i % 2 != 0) place.normal = -place.normal;
    sides[i] = finder.point_at(place, area_m2, static_cast<std::uint32_t>(i));
  });
  share_staying(sides);
  std::vector<SurfacePoint> points;
  for (const auto& side : sides) {
    if (side && side->stays > 0) points.push_back(*side);
  }
  return points;
}

std::vector<Vec3f> planned_of(const LightTable& table) {
  std::vector<Vec3f> planned;
  for (const DirectionalLight& l : table.lights) {
    planned.push_back(l.planned != Vec3f{} ? l.planned : l.irradiance);
  }
  for (const LocalLight& l : table.lamps) {
    planned.push_back(l.planned != Vec3f{} ? l.planned : l.intensity);
  }
  return planned;
}

Vec3f under(std::span<const Vec3f> light, std::span<const Vec3f> per_light) {
  return std::inner_product(per_light.begin(), per_light.end(), light.begin(), Vec3f{});
}

// Whether an instance is a live picture and nothing else: what frames one sends light, and blocks
// it.
bool is_picture(const Scene& scene, std::uint32_t instance) {
  if (!scene.shows_pictures(instance)) return false;
  const SceneDescription& description = scene.description();
  const Mesh& mesh = *description.meshes[description.instances[instance].mesh];
  return std::ranges::none_of(mesh.materials, [&](std::uint32_t material) {
    return scene.shader_of(material).pictures_of(description.materials[material]).empty();
  });
}

}  // namespace

BouncedLight::BouncedLight(const Scene& scene,
                           const LightTable& table,
                           const BounceSettings& settings)
    : lights_(table.lights.size()), locals_(table.lamps.size()) {
  check(settings);
  if (settings.lamps == 0 || lights_ + locals_ == 0) return;
  std::vector<SurfacePoint> points = find_points(scene, settings.points, rays_);
  const std::vector<Vec3f> planned = planned_of(table);
  Colours of_lights(points.size(), lights_ + locals_);
  rays_ += for_each_point(scene, points.size(), [&](PointFinder& finder, std::size_t i) {
    finder.light(points[i], table, of_lights.row(i));
    points[i].sent = under(planned, of_lights.row(i));
  });
  // A first set of lamps tells how much points count that bounced light alone reaches.
  const Lamps first = stand_lamps(points, settings.lamps);
  const Exchange bounced = exchange(scene, points, first.lamps, rays_);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t l = 0; l < first.lamps.size(); ++l) {
      points[i].sent += bounced.per_lamp.row(i)[l] * first.lamps[l].planned;
    }
  }
  const Lamps stood = stand_lamps(points, settings.lamps);
  const Exchange sent_on = exchange(scene, points, stood.lamps, rays_);
  Colours of_lamps = summed(sent_on.per_lamp, stood);
  // No lamp gives more than it has, however near to it points lie.
  for (std::size_t k = 0; k < of_lamps.values.size(); ++k) {
    of_lamps.values[k] *=
        static_cast<float>(1 / std::max(sent_on.given[k % of_lamps.columns], 1.0));
  }
  const Colours all = after_all_bounces(summed(of_lights, stood), of_lamps);
  lamps_ = stood.lamps;
  for (std::size_t c = 0; c < lamps_.size(); ++c) {
    lamps_[c].intensity = lamps_[c].planned = under(planned, all.row(c));
  }
  per_light_ = all.values;
}

std::vector<LocalLight> BouncedLight::lamps(const LightTable& now) const {
  if (now.lights.size() != lights_ || now.lamps.size() != locals_) {
    throw std::invalid_argument("bounced light follows a table of as many lights and lamps");
  }
  std::vector<LocalLight> lamps = lamps_;
  auto weight = per_light_.begin();
  for (LocalLight& lamp : lamps) {
    lamp.intensity = {};
    for (const DirectionalLight& l : now.lights) lamp.intensity += *weight++ * l.irradiance;
    for (const LocalLight& l : now.lamps) lamp.intensity += *weight++ * l.intensity;
  }
  return lamps;
}

BounceFollower::Plan BounceFollower::plan_of(const Scene& scene,
                                             const LightTable& table,
                                             const BounceSettings& settings) {
  Plan plan{scene.places().parts, {}, scene.places().shapes, table.lights, table.lamps, settings};
  const auto& instances = scene.description().instances;
  for (std::uint32_t i = 0; i < instances.size(); ++i) {
    if (instances[i].moves && !is_picture(scene, i)) {
      plan.places.push_back(instances[i].set_from_object);
    }
  }
  // Whatever their energies are.
  for (DirectionalLight& light : plan.lights) {
    if (light.planned != Vec3f{}) light.irradiance = {};
  }
  for (LocalLight& lamp : plan.lamps) {
    if (lamp.planned != Vec3f{}) lamp.intensity = {};
  }
  return plan;
}

std::vector<LocalLight> BounceFollower::follow(const Scene& scene,
                                               const LightTable& table,
                                               const BounceSettings& settings) {
  if (settings.lamps == 0) {
    *this = {};
    return {};
  }
  BounceSettings fitting = settings;
  const auto room =
      most_lights - static_cast<int>(std::min<std::size_t>(most_lights, table.lamps.size()));
  fitting.lamps = std::min(fitting.lamps, room);
  Plan plan = plan_of(scene, table, fitting);
  if (plan != plan_) {
    bounced_ = BouncedLight(scene, table, fitting);
    plan_ = std::move(plan);
  }
  return bounced_.lamps(table);
}

}  // namespace render
