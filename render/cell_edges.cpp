// Edges and glints of a cell: where pixels take further camera rays.
#include "render/cell_baker.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "render/embree_context.h"
#include "render/trace.h"

namespace render {
namespace {

constexpr float darkest = 0.01F;  // below, eyes do not tell more: steps up to 1 by their root
// Where each sample sends on so many rays, as behind ribbed glass, a pixel takes no more samples.
constexpr int many_rays = 10, most_samples_of_many_rays = 256;
constexpr float alike_mirrors = 0.99F;  // cosine between normals: what they mirror is alike
// Of so few further samples, the one nearest to the middle would be all but the centre's once more.
constexpr int few_samples = 4;
constexpr std::size_t own_centre = 4;  // of a pixel's neighbours, row by row
constexpr float blend_parts = 1024;    // of a blend of neighbours, in whole numbers
// Steps of light across the corner of a pixel from one surface to another matter, in terms of those
// across its sides: a tip that no side shows covers little of it.
constexpr float corner_contrast = 4;

Vec3f abs(Vec3f v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }
Vec3f clipped(Vec3f v) {
  return {std::min(v.x, display_limit), std::min(v.y, display_limit), std::min(v.z, display_limit)};
}
// How many samples that follow each other in the pattern are looked at together, of so many first
// ones: so that there are four such batches, or what can be.
constexpr int batch_of(int aa_samples) { return aa_samples >= 16 ? 4 : aa_samples >= 8 ? 2 : 1; }

// Whether the table has a direction there: of the picture's pixels, and of one more around them.
bool has_direction(const calibrate::DirectionTable& table, int x, int y) {
  return x >= -1 && y >= -1 && x <= table.width && y <= table.height;
}

// By how much the light of two pixels differs, as eyes see it.
float step_between(Vec3f a, Vec3f b) {
  a = clipped(a), b = clipped(b);
  const float brightest = std::clamp(std::max(largest(a), largest(b)), darkest, 1.0F);
  return largest(abs(a - b)) / std::sqrt(brightest);
}

}  // namespace

Met CellBaker::met_at(int index) const {
  const auto i = static_cast<std::size_t>(index);
  const RayStream& s = stream_;
  if (s.geom[i] == RTC_INVALID_GEOMETRY_ID) return {Met::nothing, {}, {}};
  const Vec3f d{s.dx[i], s.dy[i], s.dz[i]};
  const Scene& scene = *frame_->inputs.scene;
  const Vec3f across{s.ngx[i], s.ngy[i], s.ngz[i]};  // in the object's frame inside an instance
  Vec3f n = normalize(scene.normal_in_set(s.inst[i], across));
  if (dot(n, d) > 0) n = -n;
  const Scene::Surface surface = scene.surface_of(s.geom[i], s.prim[i], s.inst[i]);
  return {surface, n, frame_->camera + d * s.far_m[i]};
}

void CellBaker::keep_centres() {
  met_.begin(frame_->camera, frame_->pixel_angle);
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    met_.at(x, y) = met_at(i);
  }
}

void CellBaker::trace_ring() {
  const auto& table = *frame_->inputs.directions;
  for (int i = 0; i < around; ++i) {
    const auto [x, y] = pixel_around(i);
    const bool in = has_direction(table, x0_ + x, y0_ + y);
    const std::size_t t = in ? table.index(y0_ + y, x0_ + x) : 0;
    set_camera_ray(i, in ? Vec3f{table.x[t], table.y[t], table.z[t]} : Vec3f{});
  }
  turn_camera_rays(around);
  trace(around, true, RayKind::camera, frame_->pixel_angle);
  for (int i = 0; i < around; ++i) {
    const auto [x, y] = pixel_around(i);
    met_.at(x, y) = met_at(i);
  }
}

// Whether what a pixel around the cell mirrors, or shows through something clear, may tell that the
// one beside it in the cell wants further samples.
bool CellBaker::mirrors_across(int i) const {
  const auto [x, y] = pixel_around(i);
  const int px = std::clamp(x, 0, cell_size - 1), py = std::clamp(y, 0, cell_size - 1);
  const bool beside = (px == x) != (py == y);
  const auto k = static_cast<std::size_t>(py * cell_size + px);
  return beside && stream_.geom[static_cast<std::size_t>(i)] != RTC_INVALID_GEOMETRY_ID &&
         is_inside(k) && edge_[k] == Edge::none && (sent_[k] > 0 || samples_[k].added != first_[k]);
}

// What the pixels around the cell mirror, or show through clear things: as at centres, but for the
// light of what they see at once, and for these decisions alone.
void CellBaker::shade_ring() {
  knows_.fill(0);
  if (!(effort_.glint_contrast > 0) || smooths_) return;
  int count = 0;
  for (int i = 0; i < around; ++i) {
    if (!mirrors_across(i)) continue;
    const auto k = static_cast<std::size_t>(i);
    const auto [x, y] = pixel_around(i);
    const int pixel = std::clamp(y, 0, cell_size - 1) * cell_size + std::clamp(x, 0, cell_size - 1);
    knows_[k] = 1;
    samples_[cell_pixels + k] = {};
    first_[cell_pixels + k] = {};
    ShadePoint& p = points_[static_cast<std::size_t>(count++)];
    set_point(p, i, static_cast<std::uint32_t>(pixel), static_cast<std::uint32_t>(cell_pixels + k));
    set_camera_cone(p, i, 1);
  }
  if (count == 0) return;
  CellTransport& own = *transport_;
  aside_.clear();
  aside_.receiving = own.receiving;
  aside_.mirrored_receiving = own.mirrored_receiving;
  std::swap(aside_.reach, own.reach);
  transport_ = &aside_;
  lights_.begin_aside(), lamps_.begin_aside(), places_.begin_aside();
  bent_.begin_aside(), video_.begin_aside();
  const auto sent = sent_;
  shades_ring_ = true;
  shade_points(count, false);
  bounce();
  shades_ring_ = false;
  lights_.end_aside(), lamps_.end_aside(), places_.end_aside();
  bent_.end_aside(), video_.end_aside();
  sent_ = sent;
  transport_ = &own;
  std::swap(aside_.reach, own.reach);
  std::fill_n(base_.begin() + cell_pixels, cell_pixels, CellTransport::Base{});
  for (std::size_t i = 0; i < around; ++i) {
    mirrored_[i] = samples_[cell_pixels + i].added - first_[cell_pixels + i];
  }
}

void CellBaker::find_edges() {
  edge_.fill(Edge::none);
  const auto& table = *frame_->inputs.directions;
  const auto mark = [&](int x, int y) {
    if (x >= 0 && y >= 0 && x < cell_size && y < cell_size) {
      edge_[static_cast<std::size_t>(y * cell_size + x)] = Edge::surface;
    }
  };
  const auto compare = [&](int x, int y, int dx, int dy) {
    if (!has_direction(table, x0_ + x, y0_ + y) ||
        !has_direction(table, x0_ + x + dx, y0_ + y + dy))
      return;
    const Met& a = met_.at(x, y);
    const Met& b = met_.at(x + dx, y + dy);
    if (met_.continuous(a, b)) return;
    mark(x, y);
    mark(x + dx, y + dy);
  };
  for (int y = -1; y <= cell_size; ++y) {
    for (int x = -1; x <= cell_size; ++x) {
      if (x < cell_size) compare(x, y, 1, 0);
      if (y < cell_size) compare(x, y, 0, 1);
    }
  }
  mark_small_lights();
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!is_inside(k)) edge_[k] = Edge::none;
  }
}

// By how much the light of two neighbours differs, as eyes see it, but for what one surface's
// textures differ by: of these, each has the mean already.
float CellBaker::light_step(std::size_t a, std::size_t b) const {
  const float step = step_between(samples_[a].added, samples_[b].added);
  const float least = smooths_ ? blend_contrast_ : effort_.glint_contrast;
  if (!(step > least) || !met_.continuous(a, b)) return step;
  const CellTransport& t = *transport_;
  const bool lit = in(t.receiving, a) && in(t.receiving, b);
  const auto diffuse_of = [&](std::size_t k) { return diffuse_of_centre(k) - grey_[k]; };
  const auto even = [&](std::size_t k, std::size_t other) {
    Vec3f change = (own_[other] - own_[k]) * 0.5F;
    if (lit)
      change += (diffuse_of(other) - diffuse_of(k)) * (light_[k].arriving + light_[k].lamps) * 0.5F;
    return samples_[k].added + change;
  };
  return step_between(even(a, b), even(b, a));
}

// Marks pixels whose virtual light, or the shadow that they catch, differs from a neighbour's by
// more than the effort allows.
void CellBaker::find_glints() {
  const float least = effort_.glint_contrast;
  if (!(least > 0)) return;
  const auto compare = [&](std::size_t a, std::size_t b) {
    if (!is_inside(a) || !is_inside(b)) return;
    const float step = light_step(a, b);
    for (const std::size_t k : {a, b}) {
      if (step > least && !smooths_) {
        if (edge_[k] != Edge::shadow) edge_[k] = Edge::glint;
      } else if (blend_contrast_ > 0 && step > blend_contrast_) {
        if (edge_[k] == Edge::none) edge_[k] = Edge::blend;
      }
    }
    if (!smooths_ && lit_unlike(a, b)) edge_[a] = edge_[b] = Edge::shadow;
  };
  const auto compare_across = [&](std::size_t a, std::size_t b) {
    if (smooths_ || !is_inside(a) || !is_inside(b)) return;
    if (!(step_between(samples_[a].added, samples_[b].added) > corner_contrast * least)) return;
    // Of one surface, further rays would find what its centres have.
    if (met_.continuous(a, b)) return;
    for (const std::size_t k : {a, b}) {
      if (!takes_rays(k)) edge_[k] = Edge::surface;
    }
  };
  for (std::size_t y = 0; y < cell_size; ++y) {
    for (std::size_t x = 0; x < cell_size; ++x) {
      const std::size_t k = y * cell_size + x;
      if (x + 1 < cell_size) compare(k, k + 1);
      if (y + 1 < cell_size) compare(k, k + cell_size);
      if (x + 1 == cell_size || y + 1 == cell_size) continue;
      compare_across(k, k + cell_size + 1);
      compare_across(k + 1, k + cell_size);
    }
  }
  for (int i = 0; i < around; ++i) {
    if (!knows_[static_cast<std::size_t>(i)]) continue;
    const auto [x, y] = pixel_around(i);
    const auto k = static_cast<std::size_t>(std::clamp(y, 0, cell_size - 1) * cell_size +
                                            std::clamp(x, 0, cell_size - 1));
    const Vec3f beside = first_[k] + mirrored_[static_cast<std::size_t>(i)];
    const bool may_be = edge_[k] == Edge::none || edge_[k] == Edge::blend;
    if (may_be && step_between(samples_[k].added, beside) > least) edge_[k] = Edge::glint;
  }
}

// Whether the light that arrives at two neighbours of one surface shows by more than the effort
// allows that a shadow ends between them, other than sharp ones, which further samples find.
bool CellBaker::lit_unlike(std::size_t a, std::size_t b) const {
  const CellTransport& t = *transport_;
  if (!in(t.receiving, a) || !in(t.receiving, b) || !met_.continuous(a, b)) return false;
  const CellTransport::Centres& c = t.centres.front();
  const Vec3f diffuse = (diffuse_of_centre(a) + diffuse_of_centre(b)) * 0.5F;
  const auto shown = [&](std::size_t k, Vec3f in_doubt) {
    const Light& light = light_[k];
    return diffuse * (light.arriving + light.lamps - in_doubt) +
           c.shadow.at(k) * passing(light.open, light.open - light.arriving) * plate_contrast;
  };
  const auto differ = [&](const std::array<Vec3f, 2>& in_doubt) {
    return largest(abs(clipped(shown(a, in_doubt[0])) - clipped(shown(b, in_doubt[1])))) >
           effort_.glint_contrast;
  };
  if (!differ({})) return false;
  const bool catches = c.shadow.at(a) != Vec3f{} || c.shadow.at(b) != Vec3f{};
  return catches || differ(light_in_doubt(a, b));
}

// Whether a pixel's centre, which shows the same surface, mirrors another part of what is about.
bool CellBaker::bent_mirror(std::size_t k, const Met& here, const Met& there) const {
  return in(mirrors_, k) && dot(here.normal, there.normal) < alike_mirrors;
}

// The nearest pixel whose centre shows the same surface as a further_ ray met_, or -1.
int CellBaker::neighbour_of(int index, const Further& f) const {
  const Met here = met_at(index);
  const int px = f.pixel % cell_size, py = f.pixel / cell_size;
  const auto& offset = frame_->pattern->places[f.index];
  const bool shares_all = edge_[f.pixel] == Edge::surface && !smooths_;
  float best = 1e9F;
  int found = -1;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const int x = px + dx, y = py + dy;
      if (x < 0 || y < 0 || x >= cell_size || y >= cell_size) continue;
      const int k = y * cell_size + x;
      if (!is_inside(static_cast<std::size_t>(k))) continue;
      const float ox = static_cast<float>(dx) - offset[0], oy = static_cast<float>(dy) - offset[1];
      const float distance = ox * ox + oy * oy;
      if (distance >= best) continue;
      const Met& there = met_.at(x, y);
      if (!met_.continuous(here, there)) continue;
      if (shares_all && bent_mirror(static_cast<std::size_t>(k), here, there)) continue;
      best = distance;
      found = k;
    }
  }
  return found;
}

// The camera rays of `further_`. Cut-outs are filtered over a sample's share of the pixel's area.
void CellBaker::trace_further(int count) {
  turn_camera_rays(count);
  trace(count, true, RayKind::camera,
        frame_->pixel_angle / std::sqrt(static_cast<float>(samples_each_)));
  statistics_->primary_rays += static_cast<std::uint64_t>(count);
  for (int i = 0; counting_ && i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (stream_.mask[k]) ++counting_[further_[k].pixel].rays;
  }
}

void CellBaker::begin_further(std::size_t k) {
  further_samples_.begin(k);
  borrowed_[k] = {};
}

// So many of a pixel's further samples are what the centre beside it shows.
void CellBaker::take_from_centre(std::size_t k, int dx, int dy, int times) {
  const int centre = static_cast<int>(k) + dy * cell_size + dx;
  further_samples_.add(k, samples_[static_cast<std::size_t>(centre)], times);
  std::uint16_t& taken = borrowed_[k][static_cast<std::size_t>((dy + 1) * 3 + dx + 1)];
  taken = static_cast<std::uint16_t>(taken + times);
}

// How wide the cone of a further sample is, of its pixel's. The first ones share the pixel's area
// among them. Where more are taken, things are thin, and most of them are lines, of which each
// sample crosses another place: their cones are as narrow as they lie apart across a line. Wider
// ones would mirror a bent edge as if all around were bent as much, and lose most of its glint.
float CellBaker::share_of_cone() const {
  const auto n = static_cast<float>(samples_each_);
  return samples_each_ > effort_.aa_samples ? 1 / n : 1 / std::sqrt(n);
}

void CellBaker::finish_further(int count) {
  const float finer = share_of_cone();
  trace_further(count);
  int shaded = 0;
  std::size_t leaving = 0;
  std::array<std::uint16_t, stream_rays> sample_of_ray;
  std::size_t used = 0;
  for (int i = 0; i < count; ++i) {
    const Further& f = further_[static_cast<std::size_t>(i)];
    const int neighbour = neighbour_of(i, f);
    const bool shares = neighbour >= 0 && edge_[f.pixel] == Edge::surface;
    std::uint16_t behind = no_picture_ray;
    if (past_pictures_) {
      compare_with_centre(i, f);
      const auto ray = static_cast<std::size_t>(i);
      const Vec3f direction{stream_.dx[ray], stream_.dy[ray], stream_.dz[ray]};
      behind = look_apart(
          f, direction, picture_end(i, frame_->camera, direction), finer,
          shares ? static_cast<std::uint16_t>(neighbour) : CellTransport::PictureRay::no_lender);
    }
    if (shares) {
      sample_of_ray[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(neighbour);
      const auto centre = static_cast<std::size_t>(neighbour);
      if (behind != no_picture_ray) {
        further_samples_.add(f.pixel, samples_[centre]);
      } else {
        take_from_centre(f.pixel, neighbour % cell_size - f.pixel % cell_size,
                         neighbour / cell_size - f.pixel / cell_size, 1);
      }
      continue;
    }
    const std::size_t slot = cell_pixels + used;
    samples_[slot] = {};
    index_of_slot_[used++] = f.index;
    sample_of_ray[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(slot);
    const bool hit = stream_.geom[static_cast<std::size_t>(i)] != RTC_INVALID_GEOMETRY_ID;
    ShadePoint& p =
        hit ? points_[static_cast<std::size_t>(shaded++)] : points_[stream_rays - ++leaving];
    set_point(p, i, f.pixel, static_cast<std::uint32_t>(slot));
    p.behind = behind;
    if (hit) set_camera_cone(p, i, finer);
    if (hit && neighbour >= 0 && edge_[f.pixel] != Edge::shadow)
      lender_[static_cast<std::size_t>(shaded - 1)] = static_cast<std::int16_t>(neighbour);
    if (!hit) group_[leaving - 1] = &p;
  }
  run_background({group_.data(), leaving});
  shade_points(shaded, false);
  settle_doubts(shaded);
  lender_.fill(-1);
  bounce();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const CameraSample& sample = samples_[sample_of_ray[i]];
    if (sample_of_ray[i] >= cell_pixels) further_samples_.add(further_[i].pixel, sample);
    further_samples_.add_to_batch(further_[i].pixel,
                                  further_[i].index / batch_of(effort_.aa_samples), sample);
  }
  further_samples_.end_batch();
}

// More camera rays in pixels that an edge crosses. While edges are only smoothed, these are edges
// of things alone, and nearly all of the rays show what a centre beside them does. The centre's own
// sample makes room for them; at a stage of few rays it takes the place of the one nearest to the
// middle. Pixels that are still uncertain take more, three times as many as they have, and again.
void CellBaker::sample_edges() {
  const bool takes_centre = effort_.aa_samples <= few_samples;
  const SamplePattern& pattern = *frame_->pattern;
  const int left_out = takes_centre ? std::min(pattern.middle, effort_.aa_samples - 1) : -1;
  mirrors_ = {};
  if (past_pictures_) keep_distances();
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    const bool mirrors = sent_[k] > 0 || samples_[k].added != first_[k];
    mirrors_[k / 64] |= std::uint64_t{mirrors} << (k % 64);
    if (!takes_rays(k)) continue;
    begin_further(k);
    if (past_pictures_ && pictures_may_part(k)) {
      transport_->looks_apart[k / 64] |= std::uint64_t{1} << (k % 64);
    }
    if (!takes_centre) continue;
    if (!centre_looks_apart(k)) borrowed_[k][own_centre] = 1;
    further_samples_.add(k, samples_[k]);
    further_samples_.count_as_batch(k);
  }
  int first = 0;
  for (int end = effort_.aa_samples; end <= samples_max; first = end, end *= 4) {
    samples_each_ = end;
    const CellMask chosen = first == 0 ? edges() : uncertain(first);
    int count = 0;
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      if (!(chosen[k / 64] >> (k % 64) & 1)) continue;
      const int x = static_cast<int>(k % cell_size), y = static_cast<int>(k / cell_size);
      for (int i = first; i < end; ++i) {
        if (i == left_out) continue;
        further_[static_cast<std::size_t>(count)] = {static_cast<std::uint16_t>(k),
                                                     static_cast<std::uint16_t>(i)};
        set_camera_ray(count,
                       direction_in(x0_ + x, y0_ + y, pattern.places[static_cast<std::size_t>(i)]));
        if (++count == stream_rays) {
          finish_further(count);
          count = 0;
        }
      }
    }
    if (count > 0) finish_further(count);
    if (!(effort_.aa_tolerance > 0)) break;
  }
}

// By a tent as wide as two pixels, of those that show the same surface. What is brighter than a
// display counts the less, so that its edge is smooth as displayed.
void CellBaker::blend_neighbours() {
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (edge_[k] != Edge::blend) continue;
    begin_further(k);
    const int x = static_cast<int>(k % cell_size), y = static_cast<int>(k / cell_size);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int px = x + dx, py = y + dy;
        const bool in = px >= 0 && py >= 0 && px < cell_size && py < cell_size &&
                        is_inside(static_cast<std::size_t>(py * cell_size + px)) &&
                        met_.continuous(met_.at(x, y), met_.at(px, py));
        if (!in) continue;
        const auto tent = static_cast<float>((2 - std::abs(dx)) * (2 - std::abs(dy)));
        const float shown = largest(samples_[static_cast<std::size_t>(py * cell_size + px)].added);
        const float times = blend_parts * tent / std::max(shown, 1.0F);
        take_from_centre(k, dx, dy, std::max(static_cast<int>(times), 1));
      }
    }
  }
}

CellMask CellBaker::edges() const {
  CellMask mask{};
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (takes_rays(k)) mask[k / 64] |= std::uint64_t{1} << (k % 64);
  }
  return mask;
}

// Of pixels with `n` further samples, those that take more: where more would take the most away
// from the picture's squared error. That is the variance of a sample over n, and falls by an n-th
// of itself with one more; so of more samples a larger error is allowed, by the root of their
// number. A pixel counts as varied as the mean of those around it, or as it is itself, if that is
// more: what one of them saw of a small bright thing the next one may have missed. (Of samples that
// are spread well the variance falls with n itself; then more of them are worth even less.)
CellMask CellBaker::uncertain(int n) const {
  std::array<float, cell_pixels> variances{};
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!takes_rays(k)) continue;
    variances[k] = further_samples_.variance(k);
  }
  const float of_first = first_tolerance * effort_.aa_tolerance;
  const auto samples_n = static_cast<float>(n);
  const float most =
      of_first * of_first * samples_n * samples_n / static_cast<float>(effort_.aa_samples);
  CellMask mask{};
  for (int k = 0; k < cell_pixels; ++k) {
    const auto own = static_cast<std::size_t>(k);
    if (!takes_rays(own) || further_samples_.count(own) != n) continue;
    // A cell that is being found keeps a live frame waiting.
    if (n >= most_samples_of_many_rays && sent_[own] > many_rays * n) continue;
    float around = 0, pixels = 0;
    for (int y = std::max(0, k / cell_size - 1); y <= std::min(cell_size - 1, k / cell_size + 1);
         ++y) {
      for (int x = std::max(0, k % cell_size - 1); x <= std::min(cell_size - 1, k % cell_size + 1);
           ++x) {
        const auto i = static_cast<std::size_t>(y * cell_size + x);
        if (!takes_rays(i)) continue;
        around += variances[i];
        ++pixels;
      }
    }
    // Whatever neighbours' brightness: beside what is white this one may be dark.
    const float variance = std::max(variances[own], around / pixels);
    if (n < least_samples_[own] || variance * further_samples_.share_shown(own) > most) {
      mask[own / 64] |= std::uint64_t{1} << (own % 64);
    }
  }
  return mask;
}

void CellBaker::count_errors() {
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    const auto n = static_cast<float>(further_samples_.count(k));
    if (edge_[k] == Edge::none || !(n > 1)) continue;
    // What was blended is as sure as one of it.
    const float variance =
        edge_[k] == Edge::blend ? further_samples_.spread(k) : further_samples_.variance(k);
    counting_[k].error = std::sqrt(variance * further_samples_.share_shown(k) / n);
  }
}

// Through a pixel off its centre: linear between the centre and the next one on that side.
Vec3f CellBaker::direction_in(int x, int y, const std::array<float, 2>& offset) const {
  const auto& table = *frame_->inputs.directions;
  const int sx = offset[0] < 0 ? -1 : 1, sy = offset[1] < 0 ? -1 : 1;
  const float fx = std::abs(offset[0]), fy = std::abs(offset[1]);
  const auto at = [&](int column, int row) {
    const std::size_t t = table.index(row, column);
    return Vec3f{table.x[t], table.y[t], table.z[t]};
  };
  const Vec3f a = at(x, y), b = at(x + sx, y), c = at(x, y + sy);
  if (dot(a, a) < 0.5F || dot(b, b) < 0.5F || dot(c, c) < 0.5F) return a;
  return a + (b - a) * fx + (c - a) * fy;
}

}  // namespace render
