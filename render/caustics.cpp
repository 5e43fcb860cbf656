// What photons light.
#include "render/caustics.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "calibrate/angles.h"
#include "capture/parallel_loop.h"
#include "render/blocker_boxes.h"
#include "render/trace.h"
#include "render/transform.h"

namespace render {
namespace {

using calibrate::pi_f;
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
// Surfaces that face so far away from the one that a photon fell on are others.
constexpr float same_way = 0.5F;

// What a photon lights: an ellipse with the second moments of all that it stands for. Nothing if
// that is too dim.
std::optional<Caustics::Spot> spot_of(const Photons::Landing& landing, const CausticView& view) {
  const Vec3f normal = landing.normal;
  const Vec3f t = unit_across(normal), s = cross(normal, t);
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
  spot.peak = landing.share * (3 / (pi_f * ra * rb));
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

}  // namespace

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
