// Mirrored light of a cell: rays into lobes, and what lobes mirror of compact sources.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibrate/angles.h"
#include "render/cell_baker.h"
#include "render/standard.h"
#include "render/trace.h"
#include "render/transform.h"

namespace render {
namespace {

using calibrate::pi_f;
constexpr float widest_rad = 1;  // cones end here
// A lobe whose alpha is more than so many radii of a compact source sees it as a point, others in
// so many parts.
constexpr float wide_lobe = 2;
constexpr std::uint32_t parts_of_source = 4;
// Of a source so many of its radii from a lobe's middle, places that are not drawn will do.
constexpr float far_source = 3;
// By how much weaker rays inside a clear body may be before they are cut. What lies straight on is
// not what they see where they come out, and that may be the sun. One ray a pixel shows nothing
// that small, and pictures that still sharpen have no time for it.
constexpr float inside_glass = 0.125F;
// With cuts by chance: from so much of 1 - accuracy on a ray is always followed, below it by
// chance.
constexpr float surely_followed = 2.0F / 3;
// A ray that is cut still asks whether anything is in its way, down to so much of what is followed:
// indoors nearly everything is, and light from outside would lie on it like a haze. Of fainter
// ones, and of centres' rough lobes, the light that their point gets tells.
constexpr float least_asked = 0.25F;
// Lobes this rough are wider than the regions of the sky that lights stand for: these tell what
// such a lobe sees.
constexpr float rough_lobe = 0.4F;
// What compact lights may add in a lobe at most, of what a ray that is not followed may show, for
// nobody to ask whether they are in sight.
constexpr float unseen_compact = 1.0F / 64;

// Lobes of a roughness up to the first look along the mirrored direction, from the second on along
// that of their mean.
constexpr float leaning_from = 0.2F, leaning_fully = 0.4F;

// Where a lobe about `normal` (unit), which has `middle` as its mirrored direction and sends light
// to the unit direction `view`, gets its light from in the mean: the more towards the normal the
// rougher it is and the lower the view, for none of it comes from below the surface. `middle`
// itself, bit for bit, if it is smooth. To be looked up as a lobe of the same roughness seen
// head-on. The power is fitted to the means of samples (light.md).
Vec3f mean_of_lobe(Vec3f middle, Vec3f normal, Vec3f view, float roughness) {
  if (!(roughness > leaning_from)) return middle;
  const float cosine = std::clamp(dot(normal, view), 0.0F, 1.0F);
  const float x = std::min((roughness - leaning_from) / (leaning_fully - leaning_from), 1.0F);
  const float share = x * x * (3 - 2 * x) * std::pow(roughness, 1.04F + 2.6F * cosine);
  return normalize(middle + (normal - middle) * share);
}

// Which of a path's surfaces' rays were followed, as a number.
std::uint32_t next_path(std::uint32_t path, std::uint32_t number) {
  return (path ^ (number + 1)) * 0x9E3779B1U + (path >> 15);
}

// Not wider than cones get.
Vec3f bounded(Vec3f turn) {
  const float squared = dot(turn, turn);
  return squared > widest_rad * widest_rad ? turn * (widest_rad / std::sqrt(squared)) : turn;
}

// Unit vectors across a unit direction.
struct Across {
  Vec3f a, b;
  explicit Across(Vec3f direction) : a(unit_across(direction)), b(cross(direction, a)) {}
};

// A cone about a direction as wide as that, but round.
Spread rounded(const Spread& spread, Vec3f direction) {
  const float width_rad = std::sqrt(length(spread.a) * length(spread.b));
  const Across across(direction);
  return {across.a * width_rad, across.b * width_rad};
}

}  // namespace

// Which of the pattern's places in its pixel a further sample has.
std::uint32_t CellBaker::sample_of(const ShadePoint& p) const {
  return is_further(p.slot) ? index_of_slot_[p.slot - cell_pixels] : 0;
}

// Alike for the same pixel, depth and number, however the picture is cut into tiles.
SampleSequence CellBaker::numbers_of(const ShadePoint& p,
                                     std::uint32_t number,
                                     std::uint32_t sample) const {
  return {number * 64U + p.depth, pixel_in_picture(p), sample};
}

std::uint32_t CellBaker::pixel_in_picture(const ShadePoint& p) const {
  const std::uint32_t x = static_cast<std::uint32_t>(x0_) + p.pixel % cell_size;
  const std::uint32_t y = static_cast<std::uint32_t>(y0_) + p.pixel / cell_size;
  return y << 16U | x;
}

// Further samples of a pixel share a rough lobe among them: each follows one of its directions, and
// stands for a cone about it that is the wider the less likely it is. False if the ray is left in
// the middle of its lobe.
bool CellBaker::turn_within_lobe(const ShadePoint& from, std::uint32_t number, NewRay& ray) const {
  if (!is_further(from.slot) || ray.normal == Vec3f{} || ray.roughness < mirror_roughness)
    return false;
  const Vec3f view = -from.incoming;
  SampleSequence numbers = numbers_of(from, number, sample_of(from));
  Vec3f direction = sample_lobe(ray.normal, view, ray.roughness, numbers.next_pair());
  const float density = lobe_density(ray.normal, view, ray.roughness, direction);
  if (!(density > 0)) return false;
  const float own_rad = 0.5F * (length(ray.spread.a) + length(ray.spread.b));
  const float share_rad = 2 / std::sqrt(pi_f * density * static_cast<float>(samples_each_));
  const float into = dot(direction, from.hit.geometric_normal);
  // Not below the surface, from where no light comes.
  const float above_rad = std::max(2 * std::abs(into), own_rad);
  const float width_rad =
      std::min({calibrate::hypotenuse(own_rad, share_rad), above_rad, widest_rad});
  if (into < 0) direction -= from.hit.geometric_normal * (2 * into);
  const Across across(direction);
  ray.direction = direction;
  ray.origin = offset_origin(from.hit, direction);
  ray.roughness = 0;
  ray.spread = {across.a * width_rad, across.b * width_rad};
  return true;
}

// A lobe about the ray that a surface asked for, if compact light or lamps may show in it. Tells
// whether these are found apart from the ray that it then sends.
bool CellBaker::note_lobe(const ShadePoint& from,
                          const NewRay& asked,
                          const NewRay& sent,
                          bool one_of_many) {
  const bool lamps = mirrors_lamps(from, asked);
  float share = 0;
  if (frame_->planned->compact_apart) {
    share = one_of_many ? 1 : share_without_compact(*frame_->planned, sent.roughness, sent.spread);
  }
  if (!(share > 0) && !lamps) return false;
  const float area = length(asked.spread.a) * length(asked.spread.b);
  const SeenLobe seen(asked.normal, from.hit.geometric_normal, -from.incoming);
  const Lobe lobe{.point = &from,
                  .seen = seen,
                  .throughput = asked.throughput,
                  .cone_rad = 0.5F * std::sqrt(area),
                  .roughness = asked.roughness,
                  .share = share,
                  .number = pushed_,
                  .difference = asked.kind == RayKind::difference,
                  .lamps = lamps};
  if (lamps || compact_is_seen_in(lobe)) lobes_.push_back(lobe);
  return lamps;
}

// What a surface that sends a ray straight on sees of the plate.
void CellBaker::see_plate(const ShadePoint& from, Vec3f share) {
  CellTransport::Base& base = base_[target_of(from)];
  samples_[from.slot].plate += share;
  base.plate += share;
  base.passed += mean(share);
  base.seen += mean(share);
}

void CellBaker::push(const ShadePoint& from, const NewRay& asked) {
  const float weight = largest(asked.throughput);
  if (!(weight > 0)) return;
  pushed_ = pushing_ == &from ? pushed_ + 1 : 0;
  pushing_ = &from;
  NewRay ray = asked;
  const bool as_it_came = asked.spread.a == Vec3f{} && asked.spread.b == Vec3f{};
  ray.spread = as_it_came ? from.turns : Spread{bounded(asked.spread.a), bounded(asked.spread.b)};
  const bool one_of_many = turn_within_lobe(from, pushed_, ray);
  const bool straight = ray.kind == RayKind::camera;
  const bool lamps = !straight && asked.normal != Vec3f{} ? note_lobe(from, asked, ray, one_of_many)
                                                          : lamps_apart_[index_of(from)] != 0;
  // A cut ray is not black: it sees the environment, or the plate, or else what is about here.
  // Bright light is never cut.
  const bool deep = from.depth >= effort_.max_depth;
  const bool many = sent_[from.pixel] >= effort_.max_rays || queue_.size() == queue_.capacity();
  statistics_->depth_limit_hits += deep;
  statistics_->ray_limit_hits += many;
  const Media& media = ray.media ? *ray.media : from.media;
  const bool later = media.count > 0 && cuts_glass_later_ && !effort_.chance_cuts;
  const float least = (1 - effort_.accuracy) * (later ? inside_glass : 1);
  // What little a ray adds is not worth many steps along its cone.
  const bool dim = weight < least;
  const Vec3f sees = straight || one_of_many || ray.normal == Vec3f{}
                         ? ray.direction
                         : mean_of_lobe(ray.direction, ray.normal, -from.incoming, ray.roughness);
  const Spread cone = straight || !dim ? ray.spread : rounded(ray.spread, sees);
  const auto chance = [&]() -> float {
    if (deep || many) return 0;
    if (!dim) return 1;
    if (straight) return 0;
    const Vec3f radiance = planned_radiance(look_up(sees, ray.roughness, cone, false));
    const float brightest = std::max(largest(radiance), frame_->brightest_video);
    if (!effort_.chance_cuts) return weight * brightest < least ? 0.0F : 1.0F;
    return std::min(weight * std::max(brightest, 1.0F) / (surely_followed * least), 1.0F);
  };
  const float followed = chance();
  const bool dull = ray.kind == RayKind::reflection && from.diffuse != Vec3f{};
  const bool rough = dull && from.depth == 0 && asked.normal != Vec3f{} &&
                     asked.roughness >= rough_lobe && !effort_.chance_cuts;
  if (rough && from.slot < cell_pixels) {
    open_lobes_.note(from.slot,
                     {asked.normal, from.hit.geometric_normal, -from.incoming, asked.roughness});
  }
  const bool by_lights = rough && !is_further(from.slot);
  const bool asks =
      !(followed > 0) && !deep && !many && dull && !by_lights && weight >= least_asked * least;
  if (followed < 1 && effort_.dark_cuts) return;
  if (followed < 1 && !asks) {
    if (straight) {
      see_plate(from, ray.throughput);
    } else if (ray.kind == RayKind::bent) {
      leave_bent(from.slot, target_of(from), ray.direction, cone, ray.throughput);
    } else if (dull && !(followed > 0)) {
      note_cut_ray(from, ray.throughput, look_up(sees, ray.roughness, cone, one_of_many), rough);
    } else if (ray.kind == RayKind::reflection) {
      add_environment(from.slot, target_of(from), sees, ray.roughness, cone, one_of_many,
                      ray.throughput);
    }
    if (!(followed > 0) || !(chance_of(from, next_path(from.path, pushed_)) < followed)) return;
    // It stands for those that are not, and adds what it meets less what was taken for it above.
    ray.throughput = ray.throughput * (1 / followed);
    ray.spread = cone;
  }
  const bool turned = ray.direction != from.incoming || sees_mirrored_[index_of(from)] != 0;
  const bool sees_mirrored =
      turned && ray.kind == RayKind::reflection && frame_->inputs.scene->has_mirrored();
  ++sent_[from.pixel];
  queue_.push_back({.origin = ray.origin,
                    .direction = ray.direction,
                    .throughput = ray.throughput,
                    .sees = sees,
                    .spread = ray.spread,
                    .steps = from.steps,
                    .roughness = ray.roughness,
                    .pixel = from.pixel,
                    .slot = from.slot,
                    .kind = ray.kind,
                    .depth = static_cast<std::uint8_t>(from.depth + 1),
                    .behind = from.behind,
                    .one_of_many = one_of_many,
                    .lamps_apart = lamps,
                    .beyond_cut = followed > 0 && followed < 1,
                    .first = false,
                    .asks = asks,
                    .by_lights = by_lights,
                    .sees_mirrored = sees_mirrored,
                    .path = next_path(from.path, pushed_),
                    .media = media});
}

// A number in 0..1: well spread over the samples of a pixel, those of centres over the picture.
//
// Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.
float CellBaker::chance_of(const ShadePoint& from, std::uint32_t path) const {
  if (is_further(from.slot))
    return SampleSequence(path, pixel_in_picture(from), sample_of(from)).next();
  constexpr double a = 0.7548776662466927, b = 0.5698402909980532;
  const int x = x0_ + static_cast<int>(from.pixel % cell_size);
  const int y = y0_ + static_cast<int>(from.pixel / cell_size);
  const double place = double{SampleSequence{path, 0, 0}.next()} + a * x + b * y;
  return static_cast<float>(place - std::floor(place));
}

// Places in the environment. A ray that is cut asks twice: how bright is it there, and what then.
CellBaker::LookUp& CellBaker::look_up(Vec3f direction,
                                      float roughness,
                                      const Spread& spread,
                                      bool diffused) {
  LookUp& l = looked_up_;
  if (l.direction == direction && l.roughness == roughness && l.spread.a == spread.a &&
      l.spread.b == spread.b && l.diffused == diffused)
    return l;
  l.direction = direction, l.roughness = roughness, l.spread = spread, l.diffused = diffused;
  l.radiance.reset();
  l.count = diffused ? find_diffused_samples(*frame_->planned, direction, spread, l.places)
                     : find_map_samples(*frame_->planned, direction, roughness, spread, l.places);
  return l;
}

// Of the planned light.
Vec3f CellBaker::planned_radiance(LookUp& l) const {
  if (l.radiance) return *l.radiance;
  Vec3f sum{};
  for (const auto& [x, y, share, level] : std::span(l.places).first(l.count)) {
    sum += radiance_at(*frame_->planned_levels[level], x, y) * share;
  }
  l.radiance = sum;
  return sum;
}

void CellBaker::add_environment(std::size_t slot,
                                std::size_t target,
                                Vec3f direction,
                                float roughness,
                                const Spread& spread,
                                bool one_of_many,
                                Vec3f weight) {
  LookUp& l = look_up(direction, roughness, spread, one_of_many);
  add_places(slot, target, std::span(l.places).first(l.count),
             decides(slot) ? planned_radiance(l) : Vec3f{}, weight);
}

void CellBaker::add_places(std::size_t slot,
                           std::size_t target,
                           std::span<const MapSample> places,
                           Vec3f planned_radiance,
                           Vec3f weight) {
  for (const auto& [x, y, share, level] : places) {
    places_.add({weight * share, x, y, static_cast<std::uint16_t>(target),
                 static_cast<std::uint16_t>(level)});
  }
  samples_[slot].added += weight * planned_radiance;
}

// What lobes mirror of compact lights that their points see; of a real surface's, less those that
// virtual objects hide, for the plate shows them.
void CellBaker::add_lobes(std::span<const std::uint16_t> receiver_of_point, bool grid) {
  const CellVisibility& cell = transport_->visibility;
  if (grid) find_compact_tints();
  if (lobes_.empty()) return;
  for (const Lobe& lobe : lobes_) {
    const auto i = index_of(*lobe.point);
    const bool shared = receiver_of_point[i] == nowhere;
    if (!grid && !shared) continue;
    const std::size_t k = shared ? static_cast<std::size_t>(lender_[i]) : receiver_of_point[i];
    for (std::size_t c = 0; c < frame_->compact.size(); ++c) {
      const std::uint32_t light = frame_->compact[c];
      const auto in = [&](const CellMask& mask) { return (mask[k / 64] >> (k % 64) & 1) != 0; };
      if (!in(cell.lit[light])) continue;
      const Vec3f passed =
          compact_shares_.empty() ? Vec3f{1, 1, 1} : compact_shares_[c * cell_pixels + k];
      add_compact(lobe, light, in(cell.seen[light]) ? passed : Vec3f{});
    }
    if (lobe.lamps) add_lamps_of_centre(lobe, k);
  }
  if (grid) return;
  const auto receiver_of = [&](const Lobe& lobe) {
    return receiver_of_point[index_of(*lobe.point)];
  };
  std::ranges::sort(lobes_, {},
                    [&](const Lobe& lobe) { return receiver_of(lobe) * 256U + lobe.number; });
  for (const PointLight& l : tested_) {
    if (frame_->job->lights.lights[l.light].compact == 0) continue;
    for (const Lobe& lobe : std::ranges::equal_range(lobes_, l.point, {}, receiver_of)) {
      add_compact(lobe, l.light, l.passed);
    }
  }
  if (frame_->job->lights.lamps.empty()) return;
  for (const PointLamp& l : reached_) {
    if (shadow_rays_.is_caustic(l.lamp) || !(l.open > 0)) continue;
    for (const Lobe& lobe : std::ranges::equal_range(lobes_, l.point, {}, receiver_of)) {
      if (lobe.lamps) add_lamp(lobe, l.lamp, l.passed);
    }
  }
}

// What glass lets by of each compact light to each centre.
void CellBaker::find_compact_tints() {
  compact_shares_.clear();
  for (const TintedLight& tint : transport_->visibility.tints) {
    const auto found = std::ranges::lower_bound(frame_->compact, tint.light);
    if (found == frame_->compact.end() || *found != tint.light) continue;
    if (compact_shares_.empty()) {
      compact_shares_.resize(frame_->compact.size() * cell_pixels, Vec3f{1, 1, 1});
    }
    const auto c = static_cast<std::size_t>(found - frame_->compact.begin());
    compact_shares_[c * cell_pixels + tint.centre] -= tint.lost_share;
  }
}

// Of what passes to a point straight on, what a lobe mirrors of it.
Vec3f CellBaker::passed_to_lobe(const Lobe& lobe, std::size_t light, Vec3f passed) {
  if (passed == Vec3f{} || passed == Vec3f{1, 1, 1}) return passed;
  if (!frame_->inputs.scene->has_glass()) return passed;
  return passed * share_straight_on(lobe, frame_->job->lights.lights[light]);
}

// Less than all where clear bodies bend the way to a light by more than lobe and light are wide:
// then the light shows in them elsewhere, and rays find it there.
float CellBaker::share_straight_on(const Lobe& lobe, const DirectionalLight& light) {
  const Scene& scene = *frame_->inputs.scene;
  const ShadePoint& p = *lobe.point;
  Media media = p.media;
  Vec3f direction = light.direction;
  Vec3f origin = offset_origin(p.hit, direction);
  for (int surfaces = 0; surfaces < effort_.max_depth; ++surfaces) {
    const auto met = closest_hit(scene, origin, direction, 0, mask_virtual, RayKind::reflection,
                                 gather_.pictures);
    ++statistics_->shadow_rays;
    if (counting_) ++counting_[p.pixel].shadow_rays;
    if (grid_)
      grid_->mark_line(origin, direction, met ? met->distance : ray_far, transport_->reach.passed);
    if (!met) break;
    const HitPoint hit =
        scene.hit_point(met->geom_id, met->prim_id, met->inst_id, met->u, met->v, direction);
    if (scene.glass_of(hit.material) == nullptr) break;
    const Crossing crossing = cross_surface(scene, media, {hit.instance, hit.material}, hit.back);
    media = crossing.after;
    if (crossing.seen) direction = refracted_into(hit, direction, crossing.ratio[1]);
    if (direction == Vec3f{}) return 0;
    origin = offset_origin(hit, direction);
  }
  const Vec3f bent = direction - light.direction;
  const float lobe_rad = 2 * lobe.roughness * lobe.roughness;
  const float width_rad =
      calibrate::hypotenuse(lobe_rad, calibrate::hypotenuse(lobe.cone_rad, light.spread));
  const float turns = length(bent) / std::max(width_rad, 1e-4F);
  return std::exp(-turns * turns);
}

void CellBaker::add_compact(const Lobe& lobe, std::size_t light, Vec3f passed) {
  const Vec3f seen = passed_to_lobe(lobe, light, passed);
  mirror_compact(lobe, light, lobe.difference ? seen - Vec3f{1, 1, 1} : seen);
}

void CellBaker::mirror_compact(const Lobe& lobe, std::size_t light, Vec3f share) {
  if (share == Vec3f{}) return;
  const float density = compact_density(lobe, light) * lobe.share;
  if (!(density > 0)) return;
  const ShadePoint& p = *lobe.point;
  const Vec3f direction = frame_->planned_table->lights[light].direction;
  const float seen = lobe.difference ? 1 : seen_past_plate(p, direction, ray_far);
  if (!(seen > 0)) return;
  const Vec3f weight = lobe.throughput * share * (density * seen);
  if (past_pictures_) {
    add_light_past_pictures(p, target_of(p), direction, light, weight);
  } else {
    lights_.add(
        {static_cast<std::uint16_t>(target_of(p)), static_cast<std::uint16_t>(light), weight});
  }
  samples_[p.slot].added += weight * frame_->planned_table->lights[light].irradiance;
}

// Whether the compact lights, were nothing in their way, would add enough in a lobe to be worth
// shadow rays.
bool CellBaker::compact_is_seen_in(const Lobe& lobe) const {
  const float least = (1 - effort_.accuracy) * unseen_compact;
  float sum = 0;
  for (const std::uint32_t light : frame_->compact) {
    const Vec3f most = lobe.throughput * frame_->planned_table->lights[light].irradiance;
    sum += largest(most) * compact_density(lobe, light) * lobe.share;
    if (sum >= least) return true;
  }
  return false;
}

// Whether a lobe mirrors lamps: where it is wider than each of them, so that they add up to the
// surface that they are samples of. A narrower one has to meet that itself.
bool CellBaker::mirrors_lamps(const ShadePoint& from, const NewRay& ray) const {
  if (ray.roughness < mirror_roughness) return false;
  const float cone = 0.25F * length(ray.spread.a) * length(ray.spread.b);
  const float alpha = ray.roughness * ray.roughness;
  const float squared_rad = std::max(alpha * alpha, cone);
  bool any = false;
  for (const LocalLight& lamp : frame_->job->lights.lamps) {
    if (lamp.instance == no_instance) continue;
    const Vec3f to = lamp.position - from.hit.position;
    if (lamp.area_m2 > pi_f * dot(to, to) * squared_rad) return false;
    any = true;
  }
  return any;
}

bool CellBaker::glows_by_lamps(const ShadePoint& p) const {
  if (p.radiance == Vec3f{} && p.video.index < 0) return false;
  return std::ranges::any_of(frame_->job->lights.lamps, [&](const LocalLight& lamp) {
    return lamp.instance == p.hit.instance && lamp.material == p.hit.material;
  });
}

void CellBaker::add_lamps_of_centre(const Lobe& lobe, std::size_t centre) {
  const CellLamps& cell = transport_->lamps;
  for (std::size_t i = 0; i < cell.numbers.size(); ++i) {
    const std::size_t number = cell.numbers[i];
    if (!(cell.factors[i].at[centre] > 0) || shadow_rays_.is_caustic(number)) continue;
    if (frame_->job->lights.lamps[number].instance == no_instance) continue;
    add_lamp(lobe, number, cell.passed(i, centre));
  }
}

// What a lobe mirrors of a lamp that its point sees. What is too dim is left out, as rays are.
void CellBaker::add_lamp(const Lobe& lobe, std::size_t number, Vec3f passed) {
  const std::vector<LocalLight>& lamps = frame_->job->lights.lamps;
  const LocalLight& lamp = lamps[number];
  if (lamp.instance == no_instance) return;
  const ShadePoint& p = *lobe.point;
  const Vec3f to = lamp.position - p.hit.position;
  const float squared = dot(to, to);
  if (!(squared > 0)) return;
  const Vec3f direction = to / std::sqrt(squared);
  const float facing = -dot(lamp.normal, direction);
  if (!(facing > 0)) return;
  const float disc = lamp.area_m2 / pi_f;
  const float blur_rad = calibrate::hypotenuse(std::sqrt(disc / squared), lobe.cone_rad);
  const float density = lobe.seen.blurred(lobe.roughness, blur_rad, direction);
  const Vec3f weight = lobe.throughput * passed * (density * facing / (squared + disc));
  Vec3f planned = weight * frame_->planned_table->lamps[number].intensity;
  const float least = (1 - frame_->job->effort.accuracy) / (8 * static_cast<float>(lamps.size()));
  if (!(std::max(largest(planned), largest(-planned)) > least)) return;
  const float seen = lobe.difference ? 1 : seen_past_plate(p, direction, std::sqrt(squared));
  if (!(seen > 0)) return;
  planned = planned * seen;
  add_lamp_past_pictures(p, target_of(p), number, weight * seen);
  samples_[p.slot].added += planned;
}

// What a lobe mirrors of a compact light, per irradiance. A lobe that is not much wider than the
// source takes it in parts, or its far slopes would be lit as if the lobe were as wide: in parts
// here, and in others in every further sample of the pixel.
float CellBaker::compact_density(const Lobe& lobe, std::size_t light) const {
  const DirectionalLight& l = frame_->job->lights.lights[light];
  const float alpha = lobe.roughness * lobe.roughness;
  if (std::max(alpha, lobe.cone_rad) > wide_lobe * l.spread) {
    const float blur_rad = calibrate::hypotenuse(l.spread, lobe.cone_rad);
    return lobe.seen.blurred(lobe.roughness, blur_rad, l.direction);
  }
  const Across across(l.direction);
  const auto part = [&](float x, float y, float blur_rad) {
    const Vec3f direction = l.direction + (across.a * x + across.b * y) * l.spread;
    return lobe.seen.blurred(lobe.roughness, blur_rad, normalize(direction));
  };
  const Vec3f away = l.direction - lobe.seen.middle();
  if (dot(away, away) > far_source * far_source * l.spread * l.spread) {
    // Hardly changes over the source: four places that give the mean of any cubic over a disc.
    constexpr float out = std::numbers::sqrt2_v<float> / 2;
    const float blur_rad = lobe.cone_rad;
    return 0.25F * (part(out, 0, blur_rad) + part(-out, 0, blur_rad) + part(0, out, blur_rad) +
                    part(0, -out, blur_rad));
  }
  const ShadePoint& p = *lobe.point;
  const bool further = is_further(p.slot);
  const std::uint32_t samples = further ? static_cast<std::uint32_t>(samples_each_) : 1;
  const float part_rad = l.spread / std::sqrt(static_cast<float>(parts_of_source * samples));
  const float blur_rad = calibrate::hypotenuse(part_rad, lobe.cone_rad);
  const std::uint32_t number = (static_cast<std::uint32_t>(light) + 1) * 16 + lobe.number;
  float sum = 0;
  for (std::uint32_t i = 0; i < parts_of_source; ++i) {
    const auto [area, turn] = numbers_of(p, number, sample_of(p) * parts_of_source + i).next_pair();
    const float radius = std::sqrt(area);
    sum += part(radius * std::cos(2 * pi_f * turn), radius * std::sin(2 * pi_f * turn), blur_rad);
  }
  return sum * (1.0F / parts_of_source);
}

}  // namespace render
