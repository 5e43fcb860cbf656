// What live pictures do in a frame to a cell that was found without them: before it, in what its
// surfaces mirror, and in its light.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "render/blocker_boxes.h"
#include "render/cell_baker.h"
#include "render/cell_squares.h"
#include "render/embree_context.h"
#include "render/lamp_way.h"
#include "render/lanes.h"
#include "render/straight_on.h"
#include "render/trace.h"

namespace render {
namespace {

// The side of a square that is as large as a disc of that radius.
float side_of_disc(float radius) { return 1.7724539F * radius; }

// Which of eight points see a box in one direction.
unsigned meets_eight(const Scene::Bounds& box,
                     const CellTransport::Shadowed& s,
                     std::size_t first,
                     Vec3f direction) {
  Eight near = Eight{}, far = eight_of(ray_far);
  const auto cut = [&](const float* from, float along, float low, float high) {
    // Parallel to a side: within it or not, as far as numbers go.
    const float per = 1 / (std::abs(along) > 1e-12F ? along : std::copysign(1e-12F, along));
    const Eight o = load_eight(from), a = (low - o) * per, b = (high - o) * per;
    const Eight least = a < b ? a : b, most = a < b ? b : a;
    near = least > near ? least : near;
    far = most < far ? most : far;
  };
  cut(&s.px[first], direction.x, box.lower.x, box.upper.x);
  cut(&s.py[first], direction.y, box.lower.y, box.upper.y);
  cut(&s.pz[first], direction.z, box.lower.z, box.upper.z);
  return bits_of(near <= far);
}

// Fills a square between its corners.
void fill(const Square& s, std::array<float, cell_pixels>& plane) {
  const auto [a, b, c, d] = corners_of(s);
  const float at_a = plane[a], at_b = plane[b], at_c = plane[c], at_d = plane[d];
  const float step = 1 / static_cast<float>(s.side - 1);
  for (std::size_t y = 0; y < s.side; ++y) {
    const float v = static_cast<float>(y) * step;
    const float left = at_a + (at_c - at_a) * v, right = at_b + (at_d - at_b) * v;
    float* row = &plane[s.first + y * cell_size];
    for (std::size_t x = 0; x < s.side; ++x) {
      row[x] = left + (right - left) * (static_cast<float>(x) * step);
    }
  }
}

}  // namespace

// Looks along the stream's first rays, each up to its end_m_, at pictures one behind the other.
// Returns whether any was met: along_ has what was seen. `set_cone(point, ray)` says how wide.
template <class SetCone>
bool CellBaker::look_along(
    int count, bool coherent, RayKind kind, float cone_rad, SetCone&& set_cone) {
  const Scene& scene = *frame_->inputs.scene;
  const ShadeContext context{&scene.description(), &scene, scene.pictures(), scene.prepared(),
                             TextureFilter::quick};
  RayStream& s = stream_;
  std::fill_n(along_.begin(), count, CellPictures::Seen{{}, {1, 1, 1}});
  std::fill_n(came_m_.begin(), count, 0.0F);
  std::array<int, stream_rays> ray_of_point;
  bool any = false;
  for (int n = 0; n < most_pictures; ++n) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      s.near_m[i] = s.time[i] = 0;
      s.far_m[i] = s.mask[i] != 0 ? end_m_[i] - came_m_[i] : -1.0F;
      s.id[i] = static_cast<unsigned>(i);
      s.flags[i] = 0;
      s.geom[i] = s.inst[i] = RTC_INVALID_GEOMETRY_ID;
    }
    TraceContext trace(scene, kind, coherent);
    trace.cone_rad = cone_rad;
    intersect(count, trace);
    int met = 0;
    for (int k = 0; k < count; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (s.mask[i] == 0) continue;
      if (s.geom[i] == RTC_INVALID_GEOMETRY_ID) {
        s.mask[i] = 0;
        continue;
      }
      s.far_m[i] += came_m_[i];
      ShadePoint& p = points_[static_cast<std::size_t>(met)];
      set_point(p, k, 0, 0);
      set_cone(p, k);
      p.throughput = along_[i].passed;
      clear_answer(p);
      ray_of_point[static_cast<std::size_t>(met++)] = k;
    }
    if (met == 0) break;
    any = true;
    StraightOn beyond(points_.data());
    for_each_shader(met, [&](const Shader& shader, std::span<ShadePoint* const> group_points) {
      shader.shade(context, group_points, beyond);
    });
    for (std::size_t j = 0; j < static_cast<std::size_t>(met); ++j) {
      const ShadePoint& p = points_[j];
      const auto i = static_cast<std::size_t>(ray_of_point[j]);
      along_[i].radiance += p.throughput * p.radiance;
      along_[i].passed = beyond.share(j);
      came_m_[i] = s.far_m[i];
      const Vec3f from = beyond.origin(j);
      s.ox[i] = from.x, s.oy[i] = from.y, s.oz[i] = from.z;
      if (largest(along_[i].passed) < least_share) {
        along_[i].passed = {};
        s.mask[i] = 0;
      }
    }
  }
  return any;
}

// Whether a straight line passes where any of the frame's pictures stands.
bool CellBaker::passes_picture(Vec3f from, Vec3f direction, float far_m) const {
  return std::ranges::any_of(pictures_at_, [&](const Scene::Bounds& box) {
    const auto [first, last] = stretch_in(box, from, direction, far_m);
    return first <= last;
  });
}

bool CellBaker::look_at_pictures(const FrameContext& frame,
                                 const CellTransport& cell,
                                 int x0,
                                 int y0,
                                 CellPictures& seen,
                                 RenderStatistics& statistics) {
  seen.along.clear(), seen.lit_through.clear(), seen.shadowed_through.clear();
  seen.shades = seen.shades_mirrored = seen.shades_lamps = seen.has_foreground = false;
  if (!cell.past_pictures) return false;
  frame_ = &frame;
  statistics_ = &statistics;
  x0_ = x0, y0_ = y0;
  counting_ = nullptr;
  pictures_at_.clear();
  const Scene& scene = *frame.inputs.scene;
  const Scene::Places& places = scene.places();
  std::size_t apart = 0;
  for (std::size_t i = 0; i < places.bounds.size(); ++i) {
    const Scene::Bounds& bounds = places.bounds[i];
    if (places.apart[i] == 0) continue;
    ++apart;
    if (bounds.lower.x <= bounds.upper.x) pictures_at_.push_back(bounds);
  }
  dims_.clear();
  for (const PreparedSurface& surface : scene.prepared()) {
    if (scene.shows_apart(surface.instance)) dims_.push_back(surface.prepared.get());
  }
  takes_no_tree_ = dims_.size() == apart &&
                   std::ranges::all_of(dims_, [](const Prepared* by) { return by->dim({}); });
  if (!cell.far_m.empty()) see_straight(cell, seen);
  if (!cell.picture_rays.empty()) see_along(cell, seen);
  light_through(cell.picture_lights, seen.lit_through);
  light_through(cell.picture_shadows, seen.shadowed_through);
  if (!cell.shadowed.empty()) {
    const CellTransport::Centres& c = cell.centres.front();
    seen.shades = shade_centres_by_pictures(
        cell.shadowed.front(), {cell.receiving, c.nx, c.ny, c.nz}, cell.visibility, seen.lost);
  }
  if (!cell.shadowed.empty() && !cell.lamps.numbers.empty()) {
    seen.shades_lamps =
        shade_lamps_by_pictures(cell.shadowed.front(), cell.lamps, cell.receiving, seen.lamps_lost);
  }
  if (!cell.mirrored_shadowed.empty()) {
    const CellTransport::Mirrored& m = cell.mirrored.front();
    seen.shades_mirrored = shade_centres_by_pictures(cell.mirrored_shadowed.front(),
                                                     {cell.mirrored_receiving, m.nx, m.ny, m.nz},
                                                     cell.mirrored_visibility, seen.mirrored_lost);
  }
  return seen.any();
}

// Pictures that the camera sees, each pixel's own.
void CellBaker::see_straight(const CellTransport& cell, CellPictures& seen) {
  if (!may_see_pictures()) return;
  set_rays_of_all_pixels(cell.blocks);
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    const auto k = static_cast<std::size_t>(i);
    const bool in = x < cell.blocks.columns && y < cell.blocks.rows;
    end_m_[k] = in ? cell.far_m[static_cast<std::size_t>(y * cell_size + x)] : -1.0F;
    const bool apart = render::in(cell.looks_apart, static_cast<std::size_t>(y * cell_size + x));
    const bool sees =
        stream_.mask[k] != 0 && end_m_[k] > 0 && !apart &&
        passes_picture(frame_->camera, {stream_.dx[k], stream_.dy[k], stream_.dz[k]}, end_m_[k]);
    stream_.mask[k] = sees ? mask_picture : 0U;
    statistics_->primary_rays += sees;
  }
  seen.has_foreground = look_along(cell_pixels, true, RayKind::camera, frame_->pixel_angle,
                                   [&](ShadePoint& p, int i) {
                                     const auto [x, y] = pixel_of_ray(i);
                                     p.pixel = static_cast<std::uint32_t>(y * cell_size + x);
                                     set_camera_cone(p, i, 1);
                                   });
  if (!seen.has_foreground) return;
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    const auto k = static_cast<std::size_t>(y * cell_size + x);
    const auto& [radiance, passed] = along_[static_cast<std::size_t>(i)];
    seen.foreground.radiance[k] = four_of(radiance);
    seen.foreground.passed[k] = Four{passed.x, passed.y, passed.z, mean(passed)};
  }
}

// What surfaces' rays see of pictures.
void CellBaker::see_along(const CellTransport& cell, CellPictures& seen) {
  const auto& all = cell.picture_rays;
  std::array<std::size_t, stream_rays> number;
  int count = 0;
  const auto look = [&] {
    if (count == 0) return;
    statistics_->secondary_rays += static_cast<std::uint64_t>(count);
    const bool any = look_along(
        count, false, RayKind::reflection, std::numeric_limits<float>::infinity(),
        [&](ShadePoint& p, int i) {
          const CellTransport::PictureRay& ray = all[number[static_cast<std::size_t>(i)]];
          set_bounced_cone(p, ray.steps, ray.spread, ray.roughness, ray.one_of_many,
                           stream_.far_m[static_cast<std::size_t>(i)]);
          p.kind = ray.kind == RayKind::difference ? RayKind::reflection : ray.kind;
        });
    if (any) {
      if (seen.along.empty()) seen.along.assign(all.size(), {{}, {1, 1, 1}});
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        seen.along[number[i]] = along_[i];
      }
    }
    count = 0;
  };
  for (std::size_t n = 0; n < all.size(); ++n) {
    const CellTransport::PictureRay& ray = all[n];
    if (!passes_picture(ray.origin, ray.direction, ray.far_m)) continue;
    const auto i = static_cast<std::size_t>(count++);
    number[i] = n;
    stream_.ox[i] = ray.origin.x, stream_.oy[i] = ray.origin.y, stream_.oz[i] = ray.origin.z;
    stream_.dx[i] = ray.direction.x, stream_.dy[i] = ray.direction.y;
    stream_.dz[i] = ray.direction.z;
    stream_.mask[i] = mask_picture;
    end_m_[i] = ray.far_m;
    if (count == stream_rays) look();
  }
  look();
}

// Adds a ray to the stream of those to light, which must not be full: for the `number`-th of who
// asks.
void CellBaker::aim(
    Vec3f from, Vec3f direction, float far_m, float width_m, float cone_rad, std::size_t number) {
  GatherWorkspace& w = gather_;
  const auto i = static_cast<std::size_t>(w.rays++);
  w.ox[i] = from.x, w.oy[i] = from.y, w.oz[i] = from.z;
  w.dx[i] = direction.x, w.dy[i] = direction.y, w.dz[i] = direction.z;
  w.ray_point[i] = static_cast<std::uint32_t>(number);
  light_far_m_[i] = far_m;
  shadow_width_m_[i] = width_m, shadow_cone_rad_[i] = cone_rad;
}

// The stream of shadow rays, at pictures alone: afterwards tr, tg, tb are what passes.
void CellBaker::shoot_at_pictures() {
  GatherWorkspace& w = gather_;
  const Scene& scene = *frame_->inputs.scene;
  const auto n = static_cast<unsigned>(w.rays);
  statistics_->shadow_rays += n;
  w.rays = 0;
  for (unsigned i = 0; i < n; ++i) w.tr[i] = w.tg[i] = w.tb[i] = 1;
  if (takes_no_tree_) {
    const LightRays rays{.count = n,
                         .ox = w.ox.data(),
                         .oy = w.oy.data(),
                         .oz = w.oz.data(),
                         .dx = w.dx.data(),
                         .dy = w.dy.data(),
                         .dz = w.dz.data(),
                         .far_m = light_far_m_.data(),
                         .width_m = shadow_width_m_.data(),
                         .cone_rad = shadow_cone_rad_.data(),
                         .red = w.tr.data(),
                         .green = w.tg.data(),
                         .blue = w.tb.data()};
    for (const Prepared* by : dims_) by->dim(rays);
    return;
  }
  TraceContext context(scene, RayKind::shadow, false);
  for (unsigned i = 0; i < n; ++i) {
    w.near_m[i] = w.time[i] = 0;
    w.far_m[i] = light_far_m_[i];
    w.mask[i] = mask_picture;
    w.id[i] = i, w.flags[i] = 0;
  }
  context.transmittance_r = w.tr.data();
  context.transmittance_g = w.tg.data();
  context.transmittance_b = w.tb.data();
  context.shadow_width_m = shadow_width_m_.data();
  context.shadow_cone_rad = shadow_cone_rad_.data();
  RTCRayNp rays{w.ox.data(),    w.oy.data(),   w.oz.data(), w.near_m.data(),
                w.dx.data(),    w.dy.data(),   w.dz.data(), w.time.data(),
                w.far_m.data(), w.mask.data(), w.id.data(), w.flags.data()};
  rtcOccludedNp(scene.embree(), &context.context, &rays, n);
  for (unsigned i = 0; i < n; ++i) {
    if (w.far_m[i] < 0) w.tr[i] = w.tg[i] = w.tb[i] = 0;
  }
}

// The light of points that are no centres.
void CellBaker::light_through(std::span<const CellTransport::PictureLight> all,
                              std::vector<Vec3f>& passed) {
  GatherWorkspace& w = gather_;
  const auto shoot = [&] {
    const auto n = static_cast<std::size_t>(w.rays);
    if (n == 0) return;
    shoot_at_pictures();
    if (passed.empty()) passed.assign(all.size(), {1, 1, 1});
    for (std::size_t i = 0; i < n; ++i) {
      passed[w.ray_point[i]] = {w.tr[i], w.tg[i], w.tb[i]};
    }
  };
  for (std::size_t n = 0; n < all.size(); ++n) {
    const CellTransport::PictureLight& l = all[n];
    if (!passes_picture(l.origin, l.direction, l.far_m)) continue;
    aim(l.origin, l.direction, l.far_m, 0, 0, n);
    if (w.rays == stream_rays) shoot();
  }
  shoot();
}

// Where centres look for a light: squares in whose corners alone they do, for its penumbra is wider
// than these, and all others.
struct CellBaker::ShadowPlan {
  std::array<std::uint8_t, all_squares> squares;  // their numbers
  std::size_t count = 0;
  CellMask pixels{};
};

// Whether a light's penumbrae are wide enough in a square, as far as the pictures are from there.
bool CellBaker::is_soft_in(std::size_t bit,
                           const CellTransport::Shadowed& centres,
                           Vec3f direction,
                           float cone_rad) const {
  const Square square = square_of(bit);
  for (const std::size_t k : corners_of(square)) {
    for (const Scene::Bounds& picture : pictures_at_) {
      const auto [first, last] = stretch_in(picture, centres.position(k), direction, ray_far);
      const float across_m = 2 * static_cast<float>(square.side - 1) * centres.width_m[k];
      if (first <= last && cone_rad * first < across_m) return false;
    }
  }
  return true;
}

void CellBaker::plan_square(std::size_t bit,
                            const CellTransport::Shadowed& centres,
                            Vec3f direction,
                            float cone_rad,
                            ShadowPlan& plan) const {
  const Square square = square_of(bit);
  if ((centres.smooth >> bit & 1) != 0 && holds_all(plan.pixels, square) &&
      is_soft_in(bit, centres, direction, cone_rad)) {
    plan.squares[plan.count++] = static_cast<std::uint8_t>(bit);
    take_out(plan.pixels, square);
  } else if (bit < 5) {
    for (const std::size_t part : parts_of(bit)) {
      plan_square(part, centres, direction, cone_rad, plan);
    }
  }
}

// The light of centres: each looks for a light once, as wide as the light is, and as the pixel; and
// where that is wide, the corners of squares alone do. False if none loses any.
bool CellBaker::shade_centres_by_pictures(const CellTransport::Shadowed& centres,
                                          const LitCentres& lit_centres,
                                          const CellVisibility& visibility,
                                          LostLight& lost) {
  const Scene::Bounds box = centres.box(lit_centres.receiving);
  const auto& lights = frame_->job->lights.lights;
  const bool soft = frame_->job->effort.soft_lights;
  auto glass = visibility.tints.begin();
  bool any = false;
  for (std::size_t i = 0; i < std::min(lights.size(), visibility.lit.size()); ++i) {
    const DirectionalLight& light = lights[i];
    const DirectionRange to{light.direction, light.direction};
    const bool may_meet = std::ranges::any_of(
        pictures_at_, [&](const Scene::Bounds& picture) { return may_be_met(picture, box, to); });
    if (!may_meet || none(visibility.lit[i])) continue;
    ShadowPlan plan;
    for (std::size_t word = 0; word < 4; ++word) {
      plan.pixels[word] =
          visibility.lit[i][word] & visibility.seen[i][word] & lit_centres.receiving[word];
    }
    const CellMask asked = plan.pixels;
    const float cone_rad = soft ? side_of_disc(light.spread) : 0.0F;
    plan_square(0, centres, light.direction, cone_rad, plan);
    if (!look_for_light(plan, centres, light.direction, cone_rad)) continue;
    while (glass != visibility.tints.end() && glass->light < i) ++glass;
    for (; glass != visibility.tints.end() && glass->light == i; ++glass) {
      const Vec3f own = hidden_.at(glass->centre);
      hidden_.put(glass->centre, own - own * glass->lost_share);
    }
    if (!any) lost = {};
    any = true;
    const bool shared = !visibility.windows.empty() && SoftLights::has_parts(light);
    for (std::size_t k = 0; k < cell_pixels; k += 8) {
      const unsigned bits = static_cast<unsigned>(asked[k / 64] >> (k % 64)) & 0xFF;
      if (bits == 0) continue;
      const Eight cosine = load_eight(&lit_centres.nx[k]) * light.direction.x +
                           load_eight(&lit_centres.ny[k]) * light.direction.y +
                           load_eight(&lit_centres.nz[k]) * light.direction.z;
      const auto lose = [&](const Vec3f& irradiance, ColourPlanes& from, unsigned which) {
        const auto chosen = mask_of_eight(which);
        const auto add = [&](const auto& hidden, float colour, auto& plane) {
          const Eight more = load_eight(&hidden[k]) * cosine * colour;
          store_eight(&plane[k], load_eight(&plane[k]) + (chosen ? more : Eight{}));
        };
        add(hidden_.r, irradiance.x, from.r);
        add(hidden_.g, irradiance.y, from.g);
        add(hidden_.b, irradiance.z, from.b);
      };
      lose(light.irradiance, lost.all, bits);
      if (!shared) continue;
      const unsigned near = static_cast<unsigned>(visibility.near[i][k / 64] >> (k % 64)) & 0xFF;
      lose(light.irradiance, lost.shared, bits & ~near);
    }
  }
  return any;
}

// Finds what pictures hide of one light, where a plan says: hidden_. False if nothing.
bool CellBaker::look_for_light(const ShadowPlan& plan,
                               const CellTransport::Shadowed& centres,
                               Vec3f direction,
                               float cone_rad) {
  GatherWorkspace& w = gather_;
  bool any = false;
  const auto shoot = [&] {
    const auto n = static_cast<std::size_t>(w.rays);
    if (n == 0) return;
    shoot_at_pictures();
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3f hidden{1 - w.tr[i], 1 - w.tg[i], 1 - w.tb[i]};
      if (hidden == Vec3f{}) continue;
      any = true;
      hidden_.put(w.ray_point[i], hidden);
    }
  };
  hidden_ = {};
  const auto look = [&](std::size_t k) {
    aim(centres.position(k), direction, ray_far, centres.width_m[k], cone_rad, k);
    if (w.rays == stream_rays) shoot();
  };
  for (const std::uint8_t bit : std::span(plan.squares).first(plan.count)) {
    for (const std::size_t k : corners_of(square_of(bit))) {
      if (passes_picture(centres.position(k), direction, ray_far)) look(k);
    }
  }
  for (std::size_t first = 0; first < cell_pixels; first += 8) {
    unsigned bits = static_cast<unsigned>(plan.pixels[first / 64] >> (first % 64)) & 0xFF;
    if (bits == 0) continue;
    unsigned met = 0;
    for (const Scene::Bounds& picture : pictures_at_) {
      met |= meets_eight(picture, centres, first, direction);
    }
    for (bits &= met; bits != 0; bits &= bits - 1) {
      look(first + static_cast<std::size_t>(std::countr_zero(bits)));
    }
  }
  shoot();
  for (const std::uint8_t bit : std::span(plan.squares).first(any ? plan.count : 0)) {
    const Square square = square_of(bit);
    fill(square, hidden_.r), fill(square, hidden_.g), fill(square, hidden_.b);
  }
  return any;
}

// The light of lamps: each centre looks for each of them, as large as it is.
bool CellBaker::shade_lamps_by_pictures(const CellTransport::Shadowed& centres,
                                        const CellLamps& lamps,
                                        const CellMask& receiving,
                                        ColourPlanes& lost) {
  GatherWorkspace& w = gather_;
  const Scene::Bounds box = centres.box(receiving);
  const Vec3f middle = (box.lower + box.upper) * 0.5F, half = (box.upper - box.lower) * 0.5F;
  bool any = false;
  for (std::size_t i = 0; i < lamps.numbers.size(); ++i) {
    const LocalLight& lamp = frame_->job->lights.lamps[lamps.numbers[i]];
    const WayTo<float> from_middle = way_to(middle, lamp.position);
    const bool may_meet = std::ranges::any_of(pictures_at_, [&](const Scene::Bounds& picture) {
      const auto [first, last] = stretch_in({picture.lower - half, picture.upper + half}, middle,
                                            from_middle.direction, from_middle.distance_m);
      return first <= last;
    });
    if (lamp.ambient != 0 || !may_meet) continue;
    hidden_ = {};
    bool hides = false;
    const auto shoot = [&] {
      const auto n = static_cast<std::size_t>(w.rays);
      if (n == 0) return;
      shoot_at_pictures();
      for (std::size_t ray = 0; ray < n; ++ray) {
        hidden_.put(w.ray_point[ray], {1 - w.tr[ray], 1 - w.tg[ray], 1 - w.tb[ray]});
        hides = hides || w.tr[ray] < 1 || w.tg[ray] < 1 || w.tb[ray] < 1;
      }
    };
    const float side_m = std::sqrt(lamp.area_m2);
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      if (!(lamps.factors[i].at[k] > 0)) continue;
      const Vec3f from = centres.position(k);
      const WayTo<float> way = way_to(from, lamp.position);
      const float far_m = way.distance_m * before_lamp;
      if (!(far_m > 0) || !passes_picture(from, way.direction, far_m)) continue;
      aim(from, way.direction, far_m, centres.width_m[k], side_m / way.distance_m, k);
      if (w.rays == stream_rays) shoot();
    }
    shoot();
    if (!hides) continue;
    for (const TintedLight& tint : lamps.tints) {
      if (tint.light != i) continue;
      const Vec3f own = hidden_.at(tint.centre);
      hidden_.put(tint.centre, own - own * tint.lost_share);
    }
    if (!any) lost = {};
    any = true;
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      lost.put(k, lost.at(k) + lamp.intensity * hidden_.at(k) * lamps.factors[i].at[k]);
    }
  }
  return any;
}

}  // namespace render
