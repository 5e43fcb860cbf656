// Cells that are found without live pictures: what is noted of rays and light that these may come
// into the way of. What they do there is looked at in each frame (picture_looker.cpp).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "render/blocker_boxes.h"
#include "render/cell_baker.h"
#include "render/cell_squares.h"
#include "render/cones.h"
#include "render/embree_context.h"
#include "render/lamp_way.h"
#include "render/smooth_blocks.h"
#include "render/trace.h"

namespace render {
namespace {

// Where a pixel has more rays than that which pictures may come before, or lights that they may
// dim, some stand for all: the dimmer ones, of which each is less of it than one of so many alike.
// While a cell has few of them, there is room for more.
constexpr float rays_of_pixel = 48, many_rays_of_pixel = 384, lights_of_pixel = 256;

}  // namespace

// Whether what a camera ray met hides pictures behind it.
bool CellBaker::hides_pictures(int index) const {
  const auto i = static_cast<std::size_t>(index);
  if (stream_.geom[i] == RTC_INVALID_GEOMETRY_ID) return false;
  const Scene& scene = *frame_->inputs.scene;
  const auto& instances = scene.description().instances;
  const Instance& met =
      instances[scene.surface_of(stream_.geom[i], stream_.prim[i], stream_.inst[i]).instance];
  return met.kind == ObjectKind::virtual_object || met.occludes;
}

// How far along one of the stream's rays pictures show: up to what hides them.
float CellBaker::picture_end(int index, Vec3f from, Vec3f direction) const {
  const auto i = static_cast<std::size_t>(index);
  const bool stands_in = (stream_.mask[i] & (mask_stand_in | mask_mirrored)) != 0 &&
                         stream_.geom[i] != RTC_INVALID_GEOMETRY_ID && !hides_pictures(index);
  if (!stands_in) return stream_.far_m[i];
  // Nothing virtual is behind it, or the ray had passed it.
  const auto hides = closest_hit(*frame_->inputs.scene, from, direction, 0, mask_occluder,
                                 RayKind::camera, LivePictures::passed_apart);
  return hides ? hides->distance : ray_far;
}

// Of blocks, a ray through each pixel: pictures before them are each pixel's own.
void CellBaker::trace_all_pixels() {
  set_rays_of_all_pixels(transport_->blocks);
  for (int i = 0; i < cell_pixels; ++i) {
    const bool taken = stream_.mask[static_cast<std::size_t>(i)] != 0;
    statistics_->primary_rays += taken;
    const auto [x, y] = pixel_of_ray(i);
    if (counting_) counting_[y * cell_size + x].rays += taken;
  }
  trace(cell_pixels, true, RayKind::camera, frame_->pixel_angle);
}

// Notes how far the rays of pixels come: pictures may come before that.
void CellBaker::keep_far() {
  transport_->far_m.resize(cell_pixels);
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    const auto k = static_cast<std::size_t>(i);
    transport_->far_m[static_cast<std::size_t>(y * cell_size + x)] =
        picture_end(i, frame_->camera, {stream_.dx[k], stream_.dy[k], stream_.dz[k]});
  }
}

// Between what distances pictures would come between things that further rays see.
void CellBaker::keep_distances() {
  bool any = false;
  for (std::size_t k = 0; k < cell_pixels && !any; ++k) any = takes_rays(k);
  if (!any) return;
  transport_->nearest_m = ray_far;
  for (const Met& met : met_.all()) {
    const float far_m = hidden_from(met);
    transport_->nearest_m = std::min(transport_->nearest_m, far_m);
    transport_->farthest_m = std::max(transport_->farthest_m, far_m);
  }
}

// Brings what glass tints into the order in which pictures dim it.
void CellBaker::sort_tints(CellVisibility& visibility) const {
  if (past_pictures_) std::ranges::sort(visibility.tints, {}, key_of);
}

Scene::Bounds CellBaker::box_around(const CellMask& receiving) const {
  const Receivers& r = receivers_;
  Scene::Bounds box = no_bounds;
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(receiving, k)) continue;
    const Vec3f at{r.px[k], r.py[k], r.pz[k]};
    box = joined(box, {at, at});
  }
  return box;
}

// Whether pictures may come into the way of any light of the table to centres.
bool CellBaker::may_shade(const CellVisibility& visibility, const CellMask& receiving) const {
  if (!past_pictures_ || shades_ring_ || none(receiving)) return false;
  const Scene::Bounds box = box_around(receiving);
  for (std::size_t i = 0; i < visibility.lit.size(); ++i) {
    if (none(visibility.lit[i])) continue;
    const DirectionRange to = frame_->soft_lights.range(i);
    for (const Scene::Bounds& stall : frame_->stalls.boxes()) {
      if (may_be_met(stall, box, to)) return true;
    }
  }
  return false;
}

// Keeps where the centres' shadow rays begin.
void CellBaker::keep_shadowed(const CellMask& receiving,
                              std::vector<CellTransport::Shadowed>& shadowed) const {
  const Receivers& r = receivers_;
  CellTransport::Shadowed& all = shadowed.emplace_back();
  all.px = r.px, all.py = r.py, all.pz = r.pz;
  all.box = box_around(receiving);
  const auto apart = [&](std::size_t a, std::size_t b) {
    const bool same = in(receiving, b) && r.surface[a] == r.surface[b];
    return same ? length(all.position(b) - all.position(a)) : 0.0F;
  };
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    all.width_m[k] = 0;
    if (!in(receiving, k)) continue;
    const auto step = static_cast<std::size_t>(block_), line = step * cell_size;
    const float across = apart(k, k % cell_size + step < cell_size ? k + step : k - step);
    const float down = apart(k, k + line < cell_pixels ? k + line : k - line);
    all.width_m[k] = std::sqrt(across * down);
  }
  find_smooth_squares(receiving, all);
}

// Notes which squares of the cell are one surface each.
void CellBaker::find_smooth_squares(const CellMask& receiving,
                                    CellTransport::Shadowed& centres) const {
  const auto is_smooth = [&](const Square& s) {
    if (!holds_all(receiving, s)) return false;
    for (std::size_t i = 0; i < s.side * s.side; ++i) {
      const std::size_t k = s.first + i / s.side * cell_size + i % s.side;
      if (!is_one_surface(receivers_, s.first, k)) return false;
    }
    return true;
  };
  for (std::size_t bit = 0; bit < all_squares; ++bit) {
    centres.smooth |= std::uint32_t{is_smooth(square_of(bit))} << bit;
  }
}

// Whether pictures may come between a point and a lamp.
bool CellBaker::may_dim_lamp(Vec3f from, std::size_t lamp) const {
  if (!past_pictures_ || shades_ring_ || shadow_rays_.is_caustic(lamp)) return false;
  const LocalLight& light = frame_->planned_table->lamps[lamp];
  const WayTo<float> way = way_to(from, light.position);
  return light.ambient == 0 && way.distance_m > 0 &&
         may_be_passed(from, way.direction, way.distance_m);
}

// Light that a point gets of a lamp.
void CellBaker::add_lamp_past_pictures(const ShadePoint& p,
                                       std::size_t target,
                                       std::size_t lamp,
                                       Vec3f weight) {
  const auto slot = static_cast<std::uint16_t>(target);
  const auto number = static_cast<std::uint16_t>(lamp);
  const Vec3f origin = past_pictures_ ? offset_origin(p.hit, p.hit.geometric_normal) : Vec3f{};
  if (past_pictures_ && grid_ && !shades_ring_) transport_->reach.add_receiver(*grid_, origin);
  if (may_dim_lamp(origin, lamp)) {
    const auto lamps = static_cast<float>(frame_->planned_table->lamps.size());
    const float share = largest(p.throughput) * share_of_sample(p.slot);
    const float chance = std::min(share / lamps * lights_of_pixel, 1.0F);
    if (number_of_light(p, lamp) < chance) {
      const WayTo<float> way = way_to(origin, frame_->planned_table->lamps[lamp].position);
      transport_->picture_lights.push_back({origin, way.direction, weight,
                                            way.distance_m * before_lamp, 1 / chance, slot, number,
                                            true});
      return;
    }
  }
  lamps_.add({slot, number, weight});
}

// Of being followed, for a ray that is such a share of its pixel. The less room there is, the
// fewer.
float CellBaker::chance_of_picture_ray(float share) const {
  constexpr float most = CellTransport::most_picture_rays;
  constexpr float least = 1.0F / 16;  // fewer would be sparks
  const auto taken = static_cast<float>(transport_->picture_rays.size());
  const float many = taken < most / 4 ? many_rays_of_pixel : rays_of_pixel;
  return std::min(share * many * std::clamp(2 - 2 * taken / most, least, 1.0F), 1.0F);
}

// A ray that pictures may come before; what it goes on to find is noted as behind it.
std::uint16_t CellBaker::add_picture_ray(const QueuedRay& ray, float far_m) {
  auto& rays = transport_->picture_rays;
  // Within a body of glass about a picture, one after the other may meet it.
  const auto others =
      ray.behind == no_picture_ray ? 0U : std::min(rays[ray.behind].behind + 1U, 20U);
  const float share = largest(ray.throughput) * share_of_sample(ray.slot);
  const float chance = chance_of_picture_ray(share / static_cast<float>(1U << others));
  if (!(number_in_pixel(ray.pixel, index_of_sample(ray.slot), ray.path) < chance)) {
    return ray.behind;
  }
  // What colours light on its way would weaken what it sees of pictures, too.
  const bool coloured = passed_through(*frame_->inputs.scene, ray.media, 1) != Vec3f{1, 1, 1};
  if (rays.size() == CellTransport::most_picture_rays || coloured) {
    needs_pictures_ = true;
    return ray.behind;
  }
  base_[slots + rays.size()] = {};
  rays.push_back({ray.origin, ray.direction, ray.throughput, ray.spread, ray.steps, far_m,
                  ray.roughness, 1 / chance, static_cast<std::uint16_t>(target_of(ray)),
                  CellTransport::PictureRay::no_lender, ray.kind, static_cast<std::uint8_t>(others),
                  ray.one_of_many});
  return static_cast<std::uint16_t>(rays.size() - 1);
}

// Where a centre looks, in the set.
Vec3f CellBaker::direction_through(std::size_t pixel) const {
  const auto& table = *frame_->inputs.directions;
  const std::size_t t = table.index(y0_ + static_cast<int>(pixel / cell_size),
                                    x0_ + static_cast<int>(pixel % cell_size));
  return normalize(frame_->turn.to_set(Vec3f{table.x[t], table.y[t], table.z[t]}));
}

// Whether pixels see things apart from each other that pictures may come between.
bool CellBaker::pictures_may_part(std::size_t k) const {
  const int px = static_cast<int>(k % cell_size), py = static_cast<int>(k / cell_size);
  float nearest = ray_far, farthest = 0;
  for (int y = py - 1; y <= py + 1; ++y) {
    for (int x = px - 1; x <= px + 1; ++x) {
      const float far_m = hidden_from(met_.at(x, y));
      nearest = std::min(nearest, far_m), farthest = std::max(farthest, far_m);
    }
  }
  const Vec3f seen = direction_through(k);
  return std::ranges::any_of(frame_->stalls.boxes(), [&](const Scene::Bounds& box) {
    const auto [first, last] = stretch_in(box, frame_->camera, seen, ray_far);
    return first <= last && nearest < last && farthest > first && nearest < farthest;
  });
}

// The same for a centre that is one of its pixel's few samples.
bool CellBaker::centre_looks_apart(std::size_t pixel) {
  if (!in(transport_->looks_apart, pixel)) return false;
  samples_each_ = effort_.aa_samples;
  return look_apart({static_cast<std::uint16_t>(pixel), 0}, direction_through(pixel),
                    transport_->far_m[pixel], 1 / std::sqrt(static_cast<float>(samples_each_)),
                    static_cast<std::uint16_t>(pixel)) != no_picture_ray;
}

// How far away something is that hides pictures behind it.
float CellBaker::hidden_from(const Met& met) const {
  const auto& instances = frame_->inputs.scene->description().instances;
  if (met.surface.instance >= instances.size()) return ray_far;
  const Instance& instance = instances[met.surface.instance];
  const bool hides = instance.kind == ObjectKind::virtual_object || instance.occludes;
  return hides ? length(met.position - frame_->camera) : ray_far;
}

// Whether a further ray looks at pictures by itself, and if so, its number; it shows what `lender`,
// the centre of a pixel, does behind them, or what it finds itself.
std::uint16_t CellBaker::look_apart(
    const Further& f, Vec3f direction, float far_m, float width, std::uint16_t lender) {
  const std::size_t pixel = f.pixel;
  if (!in(transport_->looks_apart, pixel) || !may_be_passed(frame_->camera, direction, far_m)) {
    return no_picture_ray;
  }
  auto& rays = transport_->picture_rays;
  if (rays.size() == CellTransport::most_picture_rays) {
    needs_pictures_ = true;
    return no_picture_ray;
  }
  const float chance = chance_of_picture_ray(1 / static_cast<float>(samples_each_));
  if (!(number_in_pixel(f.pixel, f.index, 0) < chance)) return no_picture_ray;
  const auto [right, down] =
      pixel_sides(*frame_->inputs.directions, x0_ + static_cast<int>(pixel % cell_size),
                  y0_ + static_cast<int>(pixel / cell_size));
  base_[slots + rays.size()] = {};
  rays.push_back({frame_->camera,
                  direction,
                  {1, 1, 1},
                  {frame_->turn.to_set(right) * width, frame_->turn.to_set(down) * width},
                  {},
                  far_m,
                  0,
                  1 / chance,
                  static_cast<std::uint16_t>(cell_pixels + pixel),
                  lender,
                  RayKind::camera,
                  0,
                  false});
  return static_cast<std::uint16_t>(rays.size() - 1);
}

// Light that a point gets of the table.
CellBaker::MayDim CellBaker::add_light_past_pictures(const ShadePoint& p,
                                                     std::size_t target,
                                                     Vec3f direction,
                                                     std::size_t light,
                                                     Vec3f weight,
                                                     float part) {
  const auto slot = static_cast<std::uint16_t>(target);
  const auto number = static_cast<std::uint16_t>(light);
  const Vec3f origin = past_pictures_ ? offset_origin(p.hit, p.hit.geometric_normal) : Vec3f{};
  if (past_pictures_ && grid_ && !shades_ring_) transport_->reach.add_receiver(*grid_, origin);
  MayDim may_dim;
  if (may_be_passed(origin, direction, ray_far)) {
    const float chance =
        std::min(largest(p.throughput) * share_of_sample(p.slot) * part * lights_of_pixel, 1.0F);
    may_dim.chance = chance;
    if (number_of_light(p, frame_->light_rows.place[light]) < chance) {
      transport_->picture_lights.push_back(
          {origin, direction, weight, ray_far, 1 / chance, slot, number, false});
      may_dim.looked_for = true;
      return may_dim;
    }
  }
  lights_.add({slot, number, weight});
  return may_dim;
}

// A light of a point that is no centre: as above, and counted for its pixel.
void CellBaker::add_tested_past_pictures(const ShadePoint& p,
                                         const PointLight& l,
                                         Vec3f weight,
                                         Vec3f open) {
  const MayDim may_dim = add_light_past_pictures(
      p, matte_target_of(p), shadow_rays_.direction(receivers_, l.point, l.light), l.light, weight,
      part_of_light(l, open));
  if (may_dim.chance == 0) return;
  const float gives = largest(weight * frame_->planned_table->lights[l.light].irradiance);
  LookedFor& of = looked_for_[p.pixel];
  of.gives += gives, of.number += may_dim.chance;
  if (!may_dim.looked_for) return;
  of.would_be += gives / may_dim.chance;
  looked_for_by_.push_back(static_cast<std::uint8_t>(p.pixel));
}

// Those lights of a pixel, from the first-th on, that pictures are looked for in stand for all that
// these may dim, and no more: what is lost is a share of what is there, and nothing gets darker
// than without that. Where hardly one is looked for, there may be none: those of other pixels stand
// for them too, as chance has it.
void CellBaker::settle_picture_lights(std::size_t first) {
  constexpr float enough = 2;
  auto& lights = transport_->picture_lights;
  for (std::size_t i = first; i < lights.size(); ++i) {
    const LookedFor& of = looked_for_[looked_for_by_[i - first]];
    if (of.number >= enough && of.would_be > 0) lights[i].stands_for *= of.gives / of.would_be;
  }
}

// What a light gives a point, of all that this gets if nothing is in the way.
float CellBaker::part_of_light(const PointLight& l, Vec3f open) const {
  const float all = largest(open);
  const float own = largest(frame_->planned_table->lights[l.light].irradiance) * l.weight;
  return all > own ? own / all : 1.0F;
}

// Light of a stand-in's point that is no centre, before the transport has it.
void CellBaker::note_picture_shadow(const ShadePoint& p,
                                    std::size_t receiver,
                                    const PointLight& l,
                                    Vec3f open) {
  const Receivers& r = receivers_;
  const Vec3f origin{r.px[receiver], r.py[receiver], r.pz[receiver]};
  const Vec3f direction = shadow_rays_.direction(r, receiver, l.light);
  if (!may_be_passed(origin, direction, ray_far)) return;
  const float share = largest(p.throughput * p.plate_share) * share_of_sample(p.slot);
  const float chance = std::min(share * part_of_light(l, open) * lights_of_pixel, 1.0F);
  if (!(number_of_light(p, frame_->light_rows.place[l.light]) < chance)) return;
  transport_->picture_shadows.push_back(
      {origin,
       direction,
       {},
       ray_far,
       1 / chance,
       static_cast<std::uint32_t>(transport_->shadow_lights.size()),
       l.light,
       false});
}

// Of its pixel.
float CellBaker::share_of_sample(std::size_t slot) const {
  return is_further(slot) ? 1 / static_cast<float>(samples_each_) : 1.0F;
}

// A number in 0..1, well spread over the samples of a pixel.
float CellBaker::number_in_pixel(std::uint32_t pixel,
                                 std::uint32_t sample,
                                 std::uint32_t path) const {
  const std::uint32_t x = static_cast<std::uint32_t>(x0_) + pixel % cell_size;
  const std::uint32_t y = static_cast<std::uint32_t>(y0_) + pixel / cell_size;
  return SampleSequence(path * 3 + 1, y << 16U | x, sample).next();
}

// The same of one of a point's lights, by its place among all. Of those that stand for others, one
// lies every so many places, from a random first one on: pictures hide lights that are neighbours,
// and chance for each by itself would make grain of their shadows, some of it blacker than black.
float CellBaker::number_of_light(const ShadePoint& p, std::size_t place) const {
  const float number = number_in_pixel(p.pixel, index_of_sample(p.slot), p.path) +
                       golden_ratio * static_cast<float>(place);
  return number - std::floor(number);
}

// What pictures hide is looked at through a pixel's centre: where a further ray comes to a thing
// before a picture, and the centre to one behind it, that will not do.
void CellBaker::compare_with_centre(int index, const Further& f) {
  const auto i = static_cast<std::size_t>(index);
  const Vec3f direction{stream_.dx[i], stream_.dy[i], stream_.dz[i]};
  const float centre_m = transport_->far_m[f.pixel];
  const float own_m = picture_end(index, frame_->camera, direction);
  transport_->nearest_m = std::min({transport_->nearest_m, own_m, centre_m});
  transport_->farthest_m = std::max({transport_->farthest_m, own_m, centre_m});
  if (needs_pictures_ || in(transport_->looks_apart, f.pixel)) return;
  const bool may_differ =
      std::ranges::any_of(frame_->stalls.boxes(), [&](const Scene::Bounds& box) {
        const auto [first, last] = stretch_in(box, frame_->camera, direction, ray_far);
        if (!(first <= last)) return false;
        const bool hidden = own_m <= first && centre_m <= first;
        const bool shown = own_m >= last && centre_m >= last;
        return !hidden && !shown;
      });
  if (!may_differ) return;
  needs_pictures_ = !met_.continuous(met_at(index), met_.of(f.pixel));
}

}  // namespace render
