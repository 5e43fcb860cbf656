// What live pictures do to cells.
#include "render/picture_looker.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "render/blocker_boxes.h"
#include "render/cones.h"
#include "render/lamp_way.h"
#include "render/lanes.h"
#include "render/straight_on.h"

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

void PictureLooker::Rays::add(Vec3f from, Vec3f direction, float end_m, std::size_t number) {
  const auto i = static_cast<std::size_t>(count++);
  ox[i] = from.x, oy[i] = from.y, oz[i] = from.z;
  dx[i] = direction.x, dy[i] = direction.y, dz[i] = direction.z;
  far_m[i] = end_m;
  asker[i] = static_cast<std::uint32_t>(number);
}

SightRays PictureLooker::Rays::sights() const {
  return {static_cast<std::size_t>(count),
          ox.data(),
          oy.data(),
          oz.data(),
          dx.data(),
          dy.data(),
          dz.data(),
          far_m.data()};
}

bool PictureLooker::look(const FrameContext& frame,
                         const CellTransport& cell,
                         int x0,
                         int y0,
                         CellPictures& seen,
                         RenderStatistics& statistics) {
  seen.along.clear(), seen.lit_through.clear(), seen.shadowed_through.clear();
  seen.shades = seen.shades_mirrored = seen.shades_lamps = seen.has_foreground = false;
  if (!cell.past_pictures || frame.pictures.empty()) return false;
  frame_ = &frame;
  statistics_ = &statistics;
  x0_ = x0, y0_ = y0;
  rays_.count = 0;
  if (!cell.far_m.empty()) see_straight(cell, seen);
  if (!cell.picture_rays.empty()) see_along(cell, seen);
  light_through(cell.picture_lights, seen.lit_through);
  light_through(cell.picture_shadows, seen.shadowed_through);
  if (!cell.shadowed.empty()) {
    const CellTransport::Centres& c = cell.centres.front();
    seen.shades = shade_centres(cell.shadowed.front(), {cell.receiving, c.nx, c.ny, c.nz},
                                cell.visibility, seen.lost);
  }
  if (!cell.shadowed.empty() && !cell.lamps.numbers.empty()) {
    seen.shades_lamps = shade_lamps(cell.shadowed.front(), cell.lamps, seen.lamps_lost);
  }
  if (!cell.mirrored_shadowed.empty()) {
    const CellTransport::Mirrored& m = cell.mirrored.front();
    seen.shades_mirrored =
        shade_centres(cell.mirrored_shadowed.front(), {cell.mirrored_receiving, m.nx, m.ny, m.nz},
                      cell.mirrored_visibility, seen.mirrored_lost);
  }
  return seen.any();
}

// Whether a straight line passes where any of the frame's pictures stands.
bool PictureLooker::passes_picture(Vec3f from, Vec3f direction, float far_m) const {
  return std::ranges::any_of(frame_->pictures, [&](const FrameContext::Picture& picture) {
    const auto [first, last] = stretch_in(picture.bounds, from, direction, far_m);
    return first <= last;
  });
}

// What the rays see of pictures: sights_, those of a ray one after the other, the nearest first;
// none where pictures are clear. `footprint(sight)` is how wide a ray looks there.
template <class Footprint>
void PictureLooker::see(const Footprint& footprint) {
  sights_.clear();
  for (const FrameContext::Picture& picture : frame_->pictures) {
    const std::size_t first = sights_.size();
    picture.standing->meet(rays_.sights(), sights_);
    const std::span<Sight> own = std::span(sights_).subspan(first);
    for (Sight& sight : own) sight.footprint_m = footprint(sight);
    picture.standing->see(own);
  }
  std::erase_if(sights_, [](const Sight& s) {
    return s.radiance == Vec3f{} && s.passed == Vec3f{1, 1, 1};
  });
  if (frame_->pictures.size() == 1) return;
  std::ranges::sort(sights_, [](const Sight& a, const Sight& b) {
    return a.ray != b.ray ? a.ray < b.ray : a.distance_m < b.distance_m;
  });
}

// Of each ray that sees anything: its number, and all that it sees together.
template <class Put>
void PictureLooker::put_together(Put&& put) {
  for (std::size_t i = 0; i < sights_.size();) {
    const std::uint32_t ray = sights_[i].ray;
    CellPictures::Seen all{{}, {1, 1, 1}};
    for (; i < sights_.size() && sights_[i].ray == ray; ++i) {
      all.radiance += all.passed * sights_[i].radiance;
      all.passed = all.passed * sights_[i].passed;
      if (largest(all.passed) < least_share) all.passed = {};
    }
    put(ray, all);
  }
}

// Pictures that the camera sees, each pixel's own.
void PictureLooker::see_straight(const CellTransport& cell, CellPictures& seen) {
  const CellCone cone = cone_of_cell(*frame_, x0_, y0_);
  const bool any = std::ranges::any_of(frame_->pictures, [&](const FrameContext::Picture& picture) {
    return may_be_seen(cone, frame_->camera, picture.bounds);
  });
  if (!any) return;
  const calibrate::DirectionTable& table = *frame_->inputs.directions;
  const auto direction_at = [&](std::size_t k) {
    const std::size_t t =
        table.index(y0_ + static_cast<int>(k / cell_size), x0_ + static_cast<int>(k % cell_size));
    return Vec3f{table.x[t], table.y[t], table.z[t]};
  };
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    const bool inside = static_cast<int>(k % cell_size) < cell.blocks.columns &&
                        static_cast<int>(k / cell_size) < cell.blocks.rows;
    const Vec3f direction = inside ? direction_at(k) : Vec3f{};
    const float far_m = direction != Vec3f{} && !in(cell.looks_apart, k) ? cell.far_m[k] : 0.0F;
    statistics_->primary_rays += far_m > 0;
    rays_.add(frame_->camera, frame_->turn.to_set(direction), far_m, k);
  }
  see([&](const Sight& sight) {
    const int x = x0_ + static_cast<int>(sight.ray % cell_size),
              y = y0_ + static_cast<int>(sight.ray / cell_size);
    const auto [right, down] = pixel_sides(table, x, y);
    const Vec3f along = direction_at(sight.ray);
    const auto across = [&](Vec3f side) { return length(side - along * dot(along, side)); };
    return sight.distance_m * std::sqrt(across(right) * across(down));
  });
  rays_.count = 0;
  seen.has_foreground = !sights_.empty();
  if (!seen.has_foreground) return;
  seen.foreground.radiance.fill(Four{});
  seen.foreground.passed.fill(Four{1, 1, 1, 1});
  put_together([&](std::size_t k, const CellPictures::Seen& all) {
    const auto& [radiance, passed] = all;
    seen.foreground.radiance[k] = four_of(radiance);
    seen.foreground.passed[k] = Four{passed.x, passed.y, passed.z, mean(passed)};
  });
}

// What surfaces' rays see of pictures.
void PictureLooker::see_along(const CellTransport& cell, CellPictures& seen) {
  const std::vector<CellTransport::PictureRay>& all = cell.picture_rays;
  const auto look = [&] {
    see([&](const Sight& sight) {
      const CellTransport::PictureRay& ray = all[rays_.asker[sight.ray]];
      point_.incoming = ray.direction;
      point_.hit.normal = point_.hit.geometric_normal = sight.normal;
      arrive_bounced(point_, ray.steps, ray.spread, ray.roughness, ray.one_of_many,
                     sight.distance_m);
      return std::max(point_.footprint_m, point_.blur_m);
    });
    statistics_->secondary_rays += static_cast<std::uint64_t>(rays_.count);
    if (!sights_.empty() && seen.along.empty()) seen.along.assign(all.size(), {{}, {1, 1, 1}});
    put_together([&](std::size_t ray, const CellPictures::Seen& together) {
      seen.along[rays_.asker[ray]] = together;
    });
    rays_.count = 0;
  };
  for (std::size_t n = 0; n < all.size(); ++n) {
    if (!passes_picture(all[n].origin, all[n].direction, all[n].far_m)) continue;
    rays_.add(all[n].origin, all[n].direction, all[n].far_m, n);
    if (rays_.count == stream_rays) look();
  }
  if (rays_.count > 0) look();
}

// Adds a ray to those to light, which must not be full: for the `number`-th of who asks.
void PictureLooker::aim(
    Vec3f from, Vec3f direction, float far_m, float width_m, float cone_rad, std::size_t number) {
  const auto i = static_cast<std::size_t>(rays_.count);
  rays_.width_m[i] = width_m, rays_.cone_rad[i] = cone_rad;
  rays_.add(from, direction, far_m, number);
}

// What passes of the light that they look for: `take(number, passed)` of each, and none is left.
template <class Take>
void PictureLooker::dim(Take&& take) {
  const auto n = static_cast<std::size_t>(rays_.count);
  std::fill_n(rays_.red.begin(), n, 1.0F);
  std::fill_n(rays_.green.begin(), n, 1.0F);
  std::fill_n(rays_.blue.begin(), n, 1.0F);
  const LightRays light{rays_.sights(),   rays_.width_m.data(), rays_.cone_rad.data(),
                        rays_.red.data(), rays_.green.data(),   rays_.blue.data()};
  for (const FrameContext::Picture& picture : frame_->pictures) picture.standing->dim(light);
  statistics_->shadow_rays += n;
  rays_.count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    take(rays_.asker[i], Vec3f{rays_.red[i], rays_.green[i], rays_.blue[i]});
  }
}

// The light of points that are no centres.
void PictureLooker::light_through(std::span<const CellTransport::PictureLight> all,
                                  std::vector<Vec3f>& passed) {
  const auto look = [&] {
    if (rays_.count > 0 && passed.empty()) passed.assign(all.size(), {1, 1, 1});
    dim([&](std::uint32_t n, Vec3f share) { passed[n] = share; });
  };
  for (std::size_t n = 0; n < all.size(); ++n) {
    const CellTransport::PictureLight& l = all[n];
    if (!passes_picture(l.origin, l.direction, l.far_m)) continue;
    aim(l.origin, l.direction, l.far_m, 0, 0, n);
    if (rays_.count == stream_rays) look();
  }
  look();
}

// Whether a light's penumbrae are wide enough in a square, as far as the pictures are from there.
bool PictureLooker::is_soft_in(std::size_t bit,
                               const CellTransport::Shadowed& centres,
                               Vec3f direction,
                               float cone_rad) const {
  const Square square = square_of(bit);
  for (const std::size_t k : corners_of(square)) {
    for (const auto& [bounds, standing] : frame_->pictures) {
      const auto [first, last] = stretch_in(bounds, centres.position(k), direction, ray_far);
      const float across_m = 2 * static_cast<float>(square.side - 1) * centres.width_m[k];
      if (first <= last && cone_rad * first < across_m) return false;
    }
  }
  return true;
}

void PictureLooker::plan_square(std::size_t bit,
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
bool PictureLooker::shade_centres(const CellTransport::Shadowed& centres,
                                  const LitCentres& lit_centres,
                                  const CellVisibility& visibility,
                                  LostLight& lost) {
  const auto& lights = frame_->job->lights.lights;
  const bool soft = frame_->job->effort.soft_lights;
  auto glass = visibility.tints.begin();
  bool any = false;
  for (std::size_t i = 0; i < std::min(lights.size(), visibility.lit.size()); ++i) {
    const DirectionalLight& light = lights[i];
    const DirectionRange to{light.direction, light.direction};
    const bool may_meet =
        std::ranges::any_of(frame_->pictures, [&](const FrameContext::Picture& picture) {
          return may_be_met(picture.bounds, centres.box, to);
        });
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
bool PictureLooker::look_for_light(const ShadowPlan& plan,
                                   const CellTransport::Shadowed& centres,
                                   Vec3f direction,
                                   float cone_rad) {
  bool any = false;
  const auto shoot = [&] {
    dim([&](std::uint32_t k, Vec3f passed) {
      if (passed == Vec3f{1, 1, 1}) return;
      any = true;
      hidden_.put(k, Vec3f{1, 1, 1} - passed);
    });
  };
  hidden_ = {};
  const auto look = [&](std::size_t k) {
    aim(centres.position(k), direction, ray_far, centres.width_m[k], cone_rad, k);
    if (rays_.count == stream_rays) shoot();
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
    for (const auto& [bounds, standing] : frame_->pictures) {
      met |= meets_eight(bounds, centres, first, direction);
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
bool PictureLooker::shade_lamps(const CellTransport::Shadowed& centres,
                                const CellLamps& lamps,
                                ColourPlanes& lost) {
  const Scene::Bounds& box = centres.box;
  const Vec3f middle = (box.lower + box.upper) * 0.5F, half = (box.upper - box.lower) * 0.5F;
  bool any = false;
  for (std::size_t i = 0; i < lamps.numbers.size(); ++i) {
    const LocalLight& lamp = frame_->job->lights.lamps[lamps.numbers[i]];
    const WayTo<float> from_middle = way_to(middle, lamp.position);
    const bool may_meet =
        std::ranges::any_of(frame_->pictures, [&](const FrameContext::Picture& picture) {
          const auto [first, last] =
              stretch_in({picture.bounds.lower - half, picture.bounds.upper + half}, middle,
                         from_middle.direction, from_middle.distance_m);
          return first <= last;
        });
    if (lamp.ambient != 0 || !may_meet) continue;
    hidden_ = {};
    bool hides = false;
    const auto shoot = [&] {
      dim([&](std::uint32_t k, Vec3f passed) {
        hidden_.put(k, Vec3f{1, 1, 1} - passed);
        hides = hides || passed != Vec3f{1, 1, 1};
      });
    };
    const float side_m = std::sqrt(lamp.area_m2);
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      if (!(lamps.factors[i].at[k] > 0)) continue;
      const Vec3f from = centres.position(k);
      const WayTo<float> way = way_to(from, lamp.position);
      const float far_m = way.distance_m * before_lamp;
      if (!(far_m > 0) || !passes_picture(from, way.direction, far_m)) continue;
      aim(from, way.direction, far_m, centres.width_m[k], side_m / way.distance_m, k);
      if (rays_.count == stream_rays) shoot();
    }
    shoot();
    if (!hides) continue;
    for (const TintedLight& tint : lamps.tints_of(i)) {
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
