// A cell's rays, from the camera to the light.
#include "render/cell_baker.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/cones.h"
#include "render/embree_context.h"
#include "render/kept_transport.h"
#include "render/lanes.h"
#include "render/refinement.h"
#include "render/standard.h"
#include "render/trace.h"

namespace render {
namespace {

// Whether the table's light matters to a point.
bool receives_light(const ShadePoint& p) {
  return p.diffuse != Vec3f{} || p.catches_shadow || p.catches_lamps;
}

}  // namespace

CellBaker::CellBaker() {
  queue_.reserve(16384);
  gather_.tints.reserve(static_cast<std::size_t>(GatherWorkspace::group) * cell_pixels);
}

void CellBaker::bake(const FrameContext& frame,
                     int stage,
                     int x0,
                     int y0,
                     CellTransport& transport,
                     RenderStatistics& statistics,
                     Clock::time_point give_up) {
  frame_ = &frame;
  give_up_ = give_up;
  effort_ = frame.efforts[static_cast<std::size_t>(stage)];
  const bool may_move = frame.inputs.kept && frame.inputs.scene->has_moving();
  grid_ = may_move ? &frame.inputs.kept->grid() : nullptr;
  shadow_rays_ = {frame.inputs.scene,
                  frame.planned_table.get(),
                  &effort_,
                  frame.caustics.get(),
                  frame.job->lights.lamps.size(),
                  effort_.soft_lights ? &frame.soft_lights : nullptr,
                  &frame.light_rows};
  x0_ = x0;
  y0_ = y0;
  block_ = block_of_stage(stage);
  transport_ = &transport;
  statistics_ = &statistics;
  const std::uint64_t rays_before =
      statistics.primary_rays + statistics.shadow_rays + statistics.secondary_rays;
  const KeptTransport* kept = frame.inputs.kept;
  const CellReach* known =
      kept ? kept->reach_with_pictures(x0 / cell_size, y0 / cell_size, stage) : nullptr;
  const bool may_be_apart = !frame.stalls.empty();
  if (known || !may_be_apart || !find(stage, true)) {
    // What rays passed that were to find it without pictures decides, too.
    const CellReach reach = known ? *known : may_be_apart ? transport.reach : CellReach{};
    find(stage, false);
    transport.reach.add(reach);
    if (may_be_apart) transport.shadow_answers.forget();  // for the first try's are not all here
  }
  transport.rays =
      statistics.primary_rays + statistics.shadow_rays + statistics.secondary_rays - rays_before;
}

// False if live pictures matter to it in ways that are not looked at anew in each frame.
bool CellBaker::find(int stage, bool past_pictures) {
  const FrameContext& frame = *frame_;
  CellTransport& transport = *transport_;
  transport.clear();
  past_pictures_ = transport.past_pictures = past_pictures;
  gather_.pictures = past_pictures ? LivePictures::passed_apart : LivePictures::met;
  // Rays that caustics let through differ from others in more than where they go.
  // Cells that are about to go on are not worth the time.
  const bool stays = stage <= one_ray_stage || stage >= finished_stage;
  transport.shadow_answers.begin(grid_ != nullptr && !frame.caustics && stays);
  gather_.notes.begin_cell(grid_ != nullptr ? &transport.shadow_answers : nullptr,
                           frame.inputs.scene->places().bounds);
  needs_pictures_ = false;
  shades_ring_ = false;  // the cell before may have been given up there
  const auto& table = *frame.inputs.directions;
  transport.blocks = {block_, std::min(cell_size, table.width - x0_),
                      std::min(cell_size, table.height - y0_)};
  if (frame.inputs.count_rays) transport.counts.resize(cell_pixels);
  counting_ = frame.inputs.count_rays ? transport.counts.data() : nullptr;
  smooths_ = stage == smoothed_stage;
  blend_contrast_ = blend_contrast_of_stage(frame.job->effort, stage);
  cuts_glass_later_ = effort_.aa_samples > 1 && stage >= finished_stage;
  compares_centres_ = effort_.aa_samples > 1;
  compares_further_ = effort_.aa_tolerance > 0 || counting_ != nullptr;
  samples_.fill({});
  first_.fill({});
  own_.fill({});
  std::fill_n(base_.begin(), slots, CellTransport::Base{});
  light_.fill({});
  edge_.fill(Edge::none);
  further_samples_.clear();
  lender_.fill(-1);
  queue_.clear();
  cut_rays_.clear();
  cut_places_.clear();
  open_lobes_.clear();
  open_sky_of_centre_.fill(1);
  grey_.fill({});
  grey_of_further_.fill({});
  painted_diffuse_.fill({});
  painted_count_.fill(0), painted_turn_.fill(0);
  lights_.clear();
  lamps_.clear();
  bent_.clear();
  video_.clear();
  paint_.clear();
  places_.clear(*frame.planned, frame.planned_levels);
  compact_shares_.clear();
  lamps_apart_.fill(0);
  sees_mirrored_.fill(0);
  is_first_.fill(0);
  sent_.fill(0);
  looked_up_.direction = {};
  if (!past_pictures_) {
    see_foreground();
  } else if (block_ > 1) {
    trace_all_pixels();
    keep_far();
  }
  trace_centres();
  if (past_pictures_ && block_ == 1) keep_far();
  const bool finds_edges = effort_.aa_samples > 1;
  if (finds_edges) keep_centres();
  shade_centres();
  if (needs_pictures_) return false;
  if (finds_edges) {
    trace_ring();
    find_edges();
    shade_ring();
    find_glints();
    sample_edges();
    blend_neighbours();
    if (counting_) count_errors();
  }
  if (needs_pictures_) return false;
  pack();
  return true;
}

void CellBaker::clear_answer(ShadePoint& p) {
  p.radiance = p.diffuse = p.light_normal = p.plate_share = p.environment_share = {};
  p.catches_shadow = p.catches_lamps = false;
  p.video.index = p.paint.index = -1;
  p.painted = not_painted;
}

// The stream's first rays, as far as each goes.
void CellBaker::intersect(int count, TraceContext& context) {
  RayStream& s = stream_;
  RTCRayHitNp rays;
  rays.ray = {s.ox.data(),    s.oy.data(),   s.oz.data(), s.near_m.data(),
              s.dx.data(),    s.dy.data(),   s.dz.data(), s.time.data(),
              s.far_m.data(), s.mask.data(), s.id.data(), s.flags.data()};
  rays.hit.Ng_x = s.ngx.data(), rays.hit.Ng_y = s.ngy.data(), rays.hit.Ng_z = s.ngz.data();
  rays.hit.u = s.u.data(), rays.hit.v = s.v.data();
  rays.hit.primID = s.prim.data(), rays.hit.geomID = s.geom.data();
  rays.hit.instID[0] = s.inst.data();
  rtcIntersectNp(frame_->inputs.scene->embree(), &context.context, &rays,
                 static_cast<unsigned>(count));
}

void CellBaker::trace(
    int count, bool coherent, RayKind kind, float cone_rad, LivePictures pictures) {
  if (give_up_ != Clock::time_point::max() && Clock::now() > give_up_) throw TakesTooLong{};
  RayStream& s = stream_;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    s.far_m[i] = s.mask[i] ? ray_far : -1.0F;
    s.time[i] = 0;
    s.id[i] = static_cast<unsigned>(i);
    s.flags[i] = 0;
    s.geom[i] = s.inst[i] = RTC_INVALID_GEOMETRY_ID;
  }
  if (gather_.log) {
    gather_.log->add(false, coherent, cone_rad,
                     {s.ox.data(), s.oy.data(), s.oz.data(), s.dx.data(), s.dy.data(), s.dz.data(),
                      s.near_m.data(), s.far_m.data()},
                     s.mask.data(), static_cast<std::size_t>(count));
  }
  TraceContext context(*frame_->inputs.scene, kind, coherent);
  context.cone_rad = cone_rad;
  context.pictures = past_pictures_ ? LivePictures::passed_apart : pictures;
  intersect(count, context);
  frame_->inputs.scene->fetch_hits(s.geom.data(), s.prim.data(), s.inst.data(),
                                   static_cast<std::size_t>(count));
}

// Where the lens looks in its own frame: zero where it sees nothing.
void CellBaker::set_camera_ray(int index, Vec3f v) {
  const auto i = static_cast<std::size_t>(index);
  stream_.dx[i] = v.x, stream_.dy[i] = v.y, stream_.dz[i] = v.z;
}

// Turns the first `count` of these into rays of the set, eight at a time.
void CellBaker::turn_camera_rays(int count) {
  RayStream& s = stream_;
  for (std::size_t first = 0; first < static_cast<std::size_t>(count); first += 8) {
    const Eight x = load_eight(&s.dx[first]), y = load_eight(&s.dy[first]),
                z = load_eight(&s.dz[first]);
    const auto [dx, dy, dz] = frame_->turn.to_set(calibrate::Vec3T<Eight>{x, y, z});
    const Eight l = dx * dx + dy * dy + dz * dz, by = 1 / root(l);
    const auto seen = l > 0.25F;
    store_eight(&s.dx[first], seen ? dx * by : Eight{});
    store_eight(&s.dy[first], seen ? dy * by : Eight{});
    store_eight(&s.dz[first], seen ? dz * by : eight_of(1));
    const unsigned bits = bits_of(seen);
    for (std::size_t i = 0; i < 8; ++i) {
      s.mask[first + i] = (bits >> i & 1) != 0 ? mask_virtual | mask_stand_in : 0U;
    }
  }
  std::fill_n(s.ox.begin(), count, frame_->camera.x);
  std::fill_n(s.oy.begin(), count, frame_->camera.y);
  std::fill_n(s.oz.begin(), count, frame_->camera.z);
  std::fill_n(s.near_m.begin(), count, 0.0F);
}

void CellBaker::trace_centres() {
  const bool has_foreground = !transport_->foreground.empty();
  inside_ = {};
  // 4x4 blocks one after the other: coherent for Embree, and each stream is exactly one cell.
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    const bool in = transport_->blocks.has_ray(x, y);
    const bool sees = in && !(has_foreground && is_behind_foreground(x, y));
    if (sees) {
      const CellTransport::Blocks& blocks = transport_->blocks;
      set_camera_ray(i, direction_in(x0_ + x, y0_ + y,
                                     {blocks.off(x, blocks.columns), blocks.off(y, blocks.rows)}));
    } else {
      set_camera_ray(i, {});
    }
    if (in) inside_[static_cast<std::size_t>(y / 4)] |= std::uint64_t{1} << ((y & 3) * 16 + x);
    statistics_->primary_rays += sees;
  }
  turn_camera_rays(cell_pixels);
  for (int i = 0; counting_ && i < cell_pixels; ++i) {
    if (stream_.mask[static_cast<std::size_t>(i)] == 0) continue;
    const auto [x, y] = pixel_of_ray(i);
    ++counting_[static_cast<std::size_t>(y * cell_size + x)].rays;
  }
  trace(cell_pixels, true, RayKind::camera, frame_->pixel_angle * static_cast<float>(block_),
        has_foreground ? LivePictures::passed : LivePictures::met);
}

void CellBaker::set_point(ShadePoint& p, int index, std::uint32_t pixel, std::uint32_t slot) {
  const auto i = static_cast<std::size_t>(index);
  const RayStream& s = stream_;
  p.incoming = s.mask[i] != 0 ? Vec3f{s.dx[i], s.dy[i], s.dz[i]} : Vec3f{};
  if (s.geom[i] != RTC_INVALID_GEOMETRY_ID) {
    frame_->inputs.scene->read_hit(s.geom[i], s.prim[i], s.inst[i], s.u[i], s.v[i], p.incoming,
                                   p.hit);
  }
  p.footprint_m = p.blur_m = 0;
  p.throughput = {1, 1, 1};
  p.pixel = pixel;
  p.slot = slot;
  p.behind = no_picture_ray;
  p.kind = RayKind::camera;
  p.depth = 0;
  p.path = 1;
  p.media.count = 0;
}

// The cone of a camera ray, which is as wide and high as so many pixels are there.
void CellBaker::set_camera_cone(ShadePoint& p, int index, float pixels) const {
  const auto [right, down] =
      pixel_sides(*frame_->inputs.directions, x0_ + static_cast<int>(p.pixel) % cell_size,
                  y0_ + static_cast<int>(p.pixel) / cell_size);
  const float far_m = stream_.far_m[static_cast<std::size_t>(index)];
  arrive(p, {}, {frame_->turn.to_set(right) * pixels, frame_->turn.to_set(down) * pixels}, far_m);
}

// Answers, then light, at the first `count` points; in a grid each is its pixel's centre.
void CellBaker::shade_points(int count, bool grid) {
  if (count == 0) return;
  const Scene& scene = *frame_->inputs.scene;
  const ShadeContext context{&scene.description(), &scene, scene.pictures(), scene.prepared(),
                             effort_.aa_samples > 1 ? TextureFilter::dense : TextureFilter::quick};
  lobes_.clear();
  pushing_ = nullptr;
  for_each_shader(count, [&](const Shader& shader, std::span<ShadePoint* const> group_points) {
    for (ShadePoint* p : group_points) clear_answer(*p);
    shader.shade(context, group_points, *this);
    const bool means = compares_centres_ && shader.glows_by_means();
    for (ShadePoint* p : group_points) {
      if (means && p->depth == 0) own_[p->slot] += p->throughput * p->radiance;
      if (!shades_ring_ || p->depth > 0) {
        paint(*p);
        continue;
      }
      // Around the cell, light is not asked for.
      answers_light_[index_of(*p)] = p->diffuse != Vec3f{} || p->catches_lamps;
      p->diffuse = {};
      p->catches_shadow = p->catches_lamps = false;
    }
  });
  if (!grid) find_plate(count);
  receive(count, grid);
  find_open_sky(count, grid);
  if (grid) {
    open_lobes_.find(transport_->visibility, transport_->receiving, frame_->light_rows,
                     receivers_.surface);
  }
  take_from_environment();
  const auto& instances = frame_->inputs.scene->description().instances;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    ShadePoint& p = points_[i];
    if (lamps_apart_[i] && glows_by_lamps(p)) {
      p.radiance = {};
      p.video = {};
    }
    collect(p);
    if (p.kind == RayKind::camera && instances[p.hit.instance].kind == ObjectKind::stand_in) {
      base_[target_of(p)].seen += mean(p.throughput);
    }
  }
}

void CellBaker::run_background(std::span<ShadePoint* const> leaving) {
  if (leaving.empty()) return;
  const Scene& scene = *frame_->inputs.scene;
  const ShadeContext context{&scene.description(), &scene, scene.pictures(), scene.prepared()};
  for (ShadePoint* p : leaving) {
    clear_answer(*p);
    p->hit = {};
  }
  frame_->inputs.scene->background().shade(context, leaving);
  for (ShadePoint* p : leaving) {
    if (p->incoming == Vec3f{}) {  // where the lens sees nothing, what is there stays
      clear_answer(*p);
      p->plate_share = {1, 1, 1};
    }
    light_of_point_[index_of(*p)] = {};
    collect(*p);
    base_[target_of(*p)].seen += mean(p->throughput);
  }
}

// What a point sends back whatever the light, and all of it under the planned light.
void CellBaker::collect(const ShadePoint& p) {
  CellTransport::Base& base = base_[target_of(p)];
  CameraSample& sample = samples_[p.slot];
  const Light& light = light_of_point_[index_of(p)];
  const Vec3f own = p.throughput * p.radiance;
  const Vec3f sent_back = own + p.throughput * planned_diffuse(p) * (light.arriving + light.lamps);
  base.radiance += own;
  sample.added += sent_back;
  if (p.depth == 0) first_[p.slot] += sent_back;
  if (p.video.index >= 0) add_video(p);
  if (p.environment_share != Vec3f{}) {
    add_environment(p.slot, target_of(p), p.incoming, 0, {}, false,
                    p.throughput * p.environment_share);
  }
  const Vec3f share = p.throughput * p.plate_share;
  if (p.kind == RayKind::bent && !p.catches_shadow && share != Vec3f{}) {
    add_bent(p, share, unshaded);
  }
  if (p.kind != RayKind::camera) return;
  if (!p.catches_shadow) {
    base.plate += share;
    base.passed += mean(share);
    sample.plate += share;
    return;
  }
  sample.plate += share * passing(light.open, light.open - light.arriving);
}

void CellBaker::shade_centres() {
  int count = 0;
  std::size_t leaving = 0;
  // Points in front, those that leave at the back: a cell has no more than 256 of both.
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    const auto pixel = static_cast<std::uint32_t>(y * cell_size + x);
    if (!is_inside(pixel)) continue;
    if (stream_.geom[static_cast<std::size_t>(i)] != RTC_INVALID_GEOMETRY_ID) {
      ShadePoint& p = points_[static_cast<std::size_t>(count++)];
      set_point(p, i, pixel, pixel);
      set_camera_cone(p, i, static_cast<float>(block_));
    } else {
      ShadePoint& p = points_[stream_rays - ++leaving];
      set_point(p, i, pixel, pixel);
      group_[leaving - 1] = &p;
    }
  }
  run_background({group_.data(), leaving});
  shade_points(count, true);
  choose_first();
  bounce();
}

// Which part of wide lights a point looks for, that counts a share of its pixel. Neighbours share
// what is found where the points that centres see at once are, and what they mirror smoothly;
// further samples each take another. What nobody shares would be grain in parts; but where it is
// faint, and a few lights stand for all, grain shows less than the edges of their shadows.
std::uint8_t CellBaker::part_of(const ShadePoint& p, float share) const {
  if (is_further(p.slot)) {
    const std::uint32_t of_pixel = p.pixel * 7 + p.pixel / cell_size * 3;
    return SoftLights::part_of_sample(index_of_slot_[p.slot - cell_pixels] + of_pixel);
  }
  const bool alone = p.kind != RayKind::camera || p.depth > 0;
  const bool faint = effort_.accuracy < 1 && share < few_lights_share;
  if (shades_ring_ || (alone && !receivers_.mirrored && !faint)) return SoftLights::middle;
  return SoftLights::part_of_pixel(p.pixel % cell_size, p.pixel / cell_size);
}

void CellBaker::clear_receivers() {
  Receivers& r = receivers_;
  r.active = r.by_lamps = r.by_caustics = {};
  r.count = 0;
  r.surfaces.clear();
  r.real_first.fill(0);
}

void CellBaker::set_receiver(std::size_t k, const ShadePoint& p) {
  Receivers& r = receivers_;
  const Vec3f origin = offset_origin(p.hit, p.hit.geometric_normal);
  r.px[k] = origin.x, r.py[k] = origin.y, r.pz[k] = origin.z;
  if (grid_) transport_->reach.add_receiver(*grid_, origin, sets_centres_);
  r.nx[k] = p.light_normal.x, r.ny[k] = p.light_normal.y, r.nz[k] = p.light_normal.z;
  const Vec3f g = p.hit.geometric_normal;
  r.gx[k] = g.x, r.gy[k] = g.y, r.gz[k] = g.z;
  const auto& instance = frame_->inputs.scene->description().instances[p.hit.instance];
  const bool real = instance.kind == ObjectKind::stand_in;
  r.mask[k] = real ? mask_virtual : mask_virtual | mask_real_blocker;
  r.real_first[k] = real;
  r.surface[k] = r.surfaces.of({p.hit.instance, p.hit.material});
  // Further samples of an edge pixel share its weight.
  const float further_share = 1 / static_cast<float>(effort_.aa_samples);
  r.share[k] = largest(p.throughput) * (is_further(p.slot) ? further_share : 1.0F);
  // What is dark shows little of the light, what only mirrors nothing but compact lights.
  if (!p.catches_shadow && !p.catches_lamps) {
    constexpr float grey = 0.25F / std::numbers::pi_v<float>;
    r.share[k] *= std::min(largest(planned_diffuse(p)) / grey, 1.0F);
  }
  r.part[k] = part_of(p, r.share[k]);
}

// Finds who sees which light, and notes it.
void CellBaker::receive(int count, bool grid) {
  Receivers& r = receivers_;
  auto& place = receiver_of_point_;
  std::array<std::uint16_t, stream_rays> point_at;  // of receivers among points
  std::fill_n(place.begin(), count, nowhere);
  std::fill_n(light_of_point_.begin(), count, Light{});
  std::array<std::uint8_t, stream_rays> glossy{};
  for (const Lobe& lobe : lobes_) {
    std::uint8_t& flags = glossy[index_of(*lobe.point)];
    flags = static_cast<std::uint8_t>(flags | (lobe.lamps ? 3 : 1));
  }
  std::fill_n(shares_mirrored_.begin(), count, std::uint8_t{0});
  if (!grid) receive_mirrored(count, glossy);
  clear_receivers();
  tested_.clear();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const ShadePoint& p = points_[i];
    if (!glossy[i] && !receives_light(p)) continue;
    if (shares_mirrored_[i]) continue;
    if (lender_[i] >= 0) {
      const auto centre = static_cast<std::size_t>(lender_[i]);
      if (transport_->receiving[centre / 64] >> (centre % 64) & 1) {
        light_of_point_[i] = light_[centre];
        add_shared(p, centre);
        continue;
      }
    }
    const std::size_t k = grid ? p.pixel : static_cast<std::size_t>(r.count);
    place[i] = static_cast<std::uint16_t>(k);
    point_at[k] = static_cast<std::uint16_t>(i);
    sets_centres_ = grid;
    set_receiver(k, p);
    sets_centres_ = false;
    ++r.count;
    r.active[k / 64] |= std::uint64_t{1} << (k % 64);
    if (p.diffuse != Vec3f{} || p.catches_lamps || glossy[i] > 1) {
      r.by_lamps[k / 64] |= std::uint64_t{1} << (k % 64);
    }
    const bool of_ring = shades_ring_ && p.depth == 0 && answers_light_[i];
    if (p.diffuse != Vec3f{} || p.catches_lamps || of_ring ||
        (p.kind == RayKind::bent && p.catches_shadow)) {
      r.by_caustics[k / 64] |= std::uint64_t{1} << (k % 64);
    }
  }
  std::array<std::uint32_t, cell_pixels> shadow_rays;
  if (counting_) {
    shadow_rays.fill(0);
    gather_.counts = shadow_rays.data();
  }
  if (r.count > 0) {
    if (grid) {
      for (std::size_t k = 0; k < cell_pixels; ++k) {
        if (!(r.active[k / 64] >> (k % 64) & 1)) r.nx[k] = r.ny[k] = r.nz[k] = 0;
      }
      gather_cell(shadow_rays_, r, gather_, transport_->visibility, *statistics_);
      transport_->receiving = r.active;
      sort_tints(transport_->visibility);
      if (may_shade(transport_->visibility, r.active)) {
        keep_shadowed(r.active, transport_->shadowed);
      }
    } else {
      gather_points(shadow_rays_, r, gather_, tested_, *statistics_);
    }
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const std::size_t k = place[i];
    if (k == nowhere) continue;
    const Vec3f open = r.light.open(k);
    light_of_point_[i] = {open, r.light.arriving(k), {}};
    if (!grid) continue;
    light_[k] = light_of_point_[i];
    add_centre(points_[i]);
  }
  if (grid) {
    add_centre_lamps(std::span(place).first(static_cast<std::size_t>(count)));
  } else if (r.count > 0) {
    const auto points = std::span(point_at).first(static_cast<std::size_t>(r.count));
    add_tested(points);
    add_point_lamps(points);
  }
  gather_.counts = nullptr;
  for (std::size_t i = 0; counting_ && i < static_cast<std::size_t>(count); ++i) {
    if (place[i] != nowhere) counting_[points_[i].pixel].shadow_rays += shadow_rays[place[i]];
  }
  add_lobes(place, grid);
}

void CellBaker::add_centre(const ShadePoint& p) {
  CellTransport::Centres& c = transport_->centres.front();
  const std::size_t k = p.pixel;
  c.nx[k] = receivers_.nx[k], c.ny[k] = receivers_.ny[k], c.nz[k] = receivers_.nz[k];
  if (p.painted != not_painted) {
    add_painted_centre(p);
  } else if (const Vec3f diffuse = p.throughput * p.diffuse; diffuse != Vec3f{}) {
    c.diffuse.put(k, diffuse);
    c.any_diffuse = true;
  }
  if (p.catches_shadow) {
    c.shadow.put(k, p.throughput * p.plate_share);
    c.any_shadow = true;
  }
}

}  // namespace render
