// Cells of 16x16 pixels: camera rays, light, shading, bounces, edges, and the finished halves.
#include "render/kernel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "render/embree_context.h"
#include "render/kept_visibility.h"
#include "render/trace.h"

namespace render {
namespace {

constexpr int ring_size = cell_size + 2;  // a cell with the pixels around it
constexpr int ring_pixels = ring_size * ring_size;
constexpr float display_limit = 4;  // brighter light than this, in display white, looks alike
constexpr Scene::Surface no_hit{~0U, ~0U};

// A stream of rays with their hits.
struct RayStream {
  alignas(64) std::array<float, stream_rays> ox, oy, oz, dx, dy, dz, near_m, far_m, time;
  alignas(64) std::array<unsigned, stream_rays> mask, id, flags, geom, prim, inst;
  alignas(64) std::array<float, stream_rays> u, v, ngx, ngy, ngz;
};

struct QueuedRay {
  Vec3f origin, direction, throughput, environment;
  float footprint_m, spread_rad;
  float roughness;
  std::uint32_t pixel, slot;
  RayKind kind;
  std::uint8_t depth;
};

// What the rays of one sample add up to.
struct Sample {
  Vec3f added;   // radiance
  Vec3f plate;   // share of the plate
  float passed;  // the same in the mean, without lamps
  float seen;    // 1 - coverage by virtual objects

  Sample& operator+=(const Sample& o) {
    added += o.added;
    plate += o.plate;
    passed += o.passed;
    seen += o.seen;
    return *this;
  }
};

// What the camera ray through a pixel's centre met: enough to find edges and to share shading.
struct Met {
  Scene::Surface surface;  // or no_hit
  Vec3f normal;            // of the triangle, unit, towards the camera
  Vec3f position;
};

// Why a pixel takes further camera rays.
enum class Edge : std::uint8_t {
  none,
  surface,  // another surface begins: those that meet what a neighbour met share its radiance
  glint,    // mirrored light changes quickly: they share only the light that arrives
};

// What a point receives.
struct Light {
  Vec3f irradiance, open, lamps;
  std::uint32_t compact_open = 0, compact_seen = 0;
};

// The order of camera rays in a cell's stream: 4x4 blocks one after the other.
std::array<int, 2> pixel_of_ray(int i) {
  return {((i >> 4) & 3) * 4 + (i & 3), (i >> 6) * 4 + ((i >> 2) & 3)};
}

void clear_results(ShadePoint& p) {
  p.radiance = p.plate_share = p.plate_passed = {};
  p.clipped_plate = false;
}

// The mean width of a cone. What goes straight on keeps it.
float spread_of(const Spread& spread, const ShadePoint& from) {
  const float area = length(spread.a) * length(spread.b);
  return area > 0 ? std::min(std::sqrt(area), 1.0F) : from.spread_rad;
}

float mean(Vec3f v) { return (v.x + v.y + v.z) * (1.0F / 3); }
float largest(Vec3f v) { return std::max({v.x, v.y, v.z}); }

}  // namespace

struct TileWorkspace::Impl final : RaySink {
  RayStream stream;
  GatherWorkspace gather;
  Receivers receivers;
  std::array<ShadePoint, stream_rays> points;
  std::array<ShadePoint*, stream_rays> group;
  std::array<std::uint8_t, stream_rays> done;
  std::array<Sample, 2 * cell_pixels> samples;  // centres, then further ones shaded on their own
  std::array<Sample, cell_pixels> sums;
  std::array<Vec3f, cell_pixels> shown_sum, squares;  // of what further samples show
  std::array<std::uint16_t, cell_pixels> counts;
  int samples_each = 1;  // of the pixels that take further ones now
  std::array<Met, ring_pixels> met;
  std::array<Edge, cell_pixels> edge;
  std::array<Light, cell_pixels> light;  // at what the centres met
  CellMask light_known;
  std::array<std::int16_t, stream_rays> lender;  // pixel whose light a point shares, or -1
  std::array<Vec3f, cell_pixels> plate;
  struct Further {
    std::uint16_t pixel;
    std::uint16_t index;
  };
  std::array<Further, stream_rays> further;
  std::vector<QueuedRay> queue;  // capacity reserved
  // Of the cell at work.
  const FrameContext* frame = nullptr;
  RenderStatistics* statistics = nullptr;
  int x0 = 0, y0 = 0;
  CellMask inside{};

  void push(const ShadePoint& from, const NewRay& ray) override;
  void render_cell(const TileJob& tile, TileResult& result);
  void load_plate(const TileJob& tile);
  void trace_centres();
  void keep_centres();
  void trace_ring();
  void trace(int count, bool coherent, RayKind kind);
  void set_camera_ray(int i, Vec3f v_cam);
  Met met_at(int i) const;
  void shade_centres();
  void set_point(ShadePoint& p, int i, std::uint32_t pixel, std::uint32_t slot);
  void shade_points(int count, bool grid);
  void receive(int count, bool grid);
  void run_background(std::span<ShadePoint* const> points);
  void collect(const ShadePoint& p);
  void bounce();
  void find_edges();
  void find_glints();
  CellMask edges() const;
  CellMask uncertain(int n) const;
  bool is_uncertain(std::size_t k, int n) const;
  Vec3f direction_in(int x, int y, const std::array<float, 2>& offset) const;
  void add_further(std::size_t k, const Sample& sample);
  void sample_edges();
  void finish_further(int count);
  int neighbour_of(int i, const Further& f) const;
  void write(const TileJob& tile, TileResult& result);
  template <class F>
  void for_each_shader(int count, F&& call);
};

TileWorkspace::TileWorkspace() : impl_(std::make_unique<Impl>()) {
  impl_->queue.reserve(16384);
  impl_->gather.tints.reserve(static_cast<std::size_t>(GatherWorkspace::group) * cell_pixels);
}
TileWorkspace::~TileWorkspace() = default;
TileWorkspace::TileWorkspace(TileWorkspace&&) noexcept = default;
TileWorkspace& TileWorkspace::operator=(TileWorkspace&&) noexcept = default;

namespace {

// Changes whenever visibility may: scene, camera, lens, light directions, effort.
std::uint64_t visibility_key(const FrameInputs& inputs, const FrameJob& job) {
  std::uint64_t key = 0x9E3779B97F4A7C15ULL;
  const auto mix = [&key](std::uint64_t value) {
    key = (key ^ value) * 0xFF51AFD7ED558CCDULL;
    key ^= key >> 32;
  };
  mix(inputs.scene->id());
  for (const double value : job.cam_from_set.R.m) mix(std::bit_cast<std::uint64_t>(value));
  const calibrate::Vec3& t = job.cam_from_set.t;
  for (const double value : {t.x, t.y, t.z}) mix(std::bit_cast<std::uint64_t>(value));
  for (const auto* axis : {&inputs.directions->x, &inputs.directions->y}) {
    for (const float value : *axis) mix(std::bit_cast<std::uint32_t>(value));
  }
  for (const DirectionalLight& light : job.lights.lights) {
    mix(std::bit_cast<std::uint32_t>(light.direction.x));
    mix(std::bit_cast<std::uint32_t>(light.direction.y));
    mix(std::bit_cast<std::uint32_t>(light.direction.z));
  }
  mix(job.effort.adaptive_visibility);
  mix(static_cast<std::uint64_t>(job.effort.interleave));
  return key;
}

}  // namespace

void TileWorkspace::log_rays(RayLog* log) { impl_->gather.log = log; }

namespace {

// Places in a pixel, -.5..+.5: every first 4^n of them are spread well (Sobol's sequence).
std::array<std::array<float, 2>, samples_max> sample_pattern() {
  std::array<std::array<float, 2>, samples_max> pattern;
  for (std::uint32_t i = 0; i < samples_max; ++i) {
    std::uint32_t x = 0, y = 0;
    std::uint32_t column = 1U << 31;
    for (std::uint32_t bits = i, place = 1U << 31; bits != 0; bits >>= 1, place >>= 1) {
      if (bits & 1) x |= place, y ^= column;
      column ^= column >> 1;
    }
    const auto middle = [](std::uint32_t v) {
      return (static_cast<float>(v >> 24) + 0.5F) / samples_max - 0.5F;
    };
    pattern[i] = {middle(x), middle(y)};
  }
  return pattern;
}

}  // namespace

FrameContext make_frame_context(const FrameInputs& inputs, const FrameJob& job) {
  if (!inputs.scene || !inputs.directions || !inputs.environment) {
    throw std::invalid_argument("a frame needs a scene, a lens and an environment");
  }
  const Effort& e = job.effort;
  if (e.aa_samples < 1 || e.aa_samples > samples_max) {
    throw std::invalid_argument("aa_samples must be 1 to " + std::to_string(samples_max));
  }
  const auto is_radiance = [](float v) { return std::isfinite(v) && v >= 0; };
  if (!is_radiance(e.aa_tolerance) || !is_radiance(e.glint_contrast)) {
    throw std::invalid_argument("aa_tolerance and glint_contrast must be finite, and 0 or more");
  }
  if (e.interleave != 1 && e.interleave != 2 && e.interleave != 4) {
    throw std::invalid_argument("interleave must be 1, 2 or 4");
  }
  if (!(e.accuracy >= 0 && e.accuracy <= 1)) throw std::invalid_argument("accuracy must be 0 to 1");
  if (e.max_depth < 0 || e.max_depth > 64) throw std::invalid_argument("max_depth must be 0 to 64");
  if (e.tile_size < cell_size || e.tile_size % cell_size != 0) {
    throw std::invalid_argument("tile_size must be a multiple of 16");
  }
  const auto finite = [](Vec3f v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
  };
  for (const DirectionalLight& light : job.lights.lights) {
    if (!finite(light.direction) || !finite(light.irradiance)) {
      throw std::invalid_argument("a light of the table is not finite");
    }
  }
  FrameContext context;
  std::ranges::copy_if(job.lights.lights, std::back_inserter(context.compact),
                       [](const DirectionalLight& light) { return light.compact != 0; });
  if (context.compact.size() > most_compact_lights) {
    throw std::invalid_argument("a table marks at most " + std::to_string(most_compact_lights) +
                                " lights as compact");
  }
  if (!inputs.environment->compact_apart) context.compact.clear();
  context.pattern = sample_pattern();
  context.inputs = inputs;
  context.job = &job;
  context.light = {inputs.scene, &job.lights, &job.effort};
  const auto& R = job.cam_from_set.R.m;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      context.set_from_cam[i * 3 + j] = static_cast<float>(R[j * 3 + i]);
  }
  context.camera = calibrate::to_float(calibrate::position_of(job.cam_from_set));
  if (!finite(context.camera)) throw std::invalid_argument("the camera's pose is not finite");
  const auto& d = *inputs.directions;
  const std::size_t a = d.index(d.height / 2, d.width / 2),
                    b = d.index(d.height / 2, d.width / 2 + 1);
  context.pixel_angle =
      std::clamp(length(Vec3f{d.x[a] - d.x[b], d.y[a] - d.y[b], d.z[a] - d.z[b]}), 1e-6F, 1.0F);
  if (inputs.kept_visibility) {
    inputs.kept_visibility->begin_frame(
        visibility_key(inputs, job), (d.width + cell_size - 1) / cell_size,
        (d.height + cell_size - 1) / cell_size, 2 * job.lights.lights.size());
  }
  return context;
}

void cut_tile(const capture::HalfImage& plate, Rect rect, int margin, TileJob& job) {
  job.rect = rect;
  job.margin = margin;
  Rect& b = job.background_rect;
  b.x = std::max(0, rect.x - margin);
  b.y = std::max(0, rect.y - margin);
  b.width = std::min(plate.width, rect.x + rect.width + margin) - b.x;
  b.height = std::min(plate.height, rect.y + rect.height + margin) - b.y;
  const auto row = static_cast<std::size_t>(b.width) * 3;
  job.background.resize(static_cast<std::size_t>(b.height) * row);
  for (int y = 0; y < b.height; ++y) {
    const auto from = plate.pixels.begin() + static_cast<std::ptrdiff_t>(plate.index(b.y + y, b.x));
    std::copy(from, from + static_cast<std::ptrdiff_t>(row),
              job.background.begin() + static_cast<std::ptrdiff_t>(row) * y);
  }
}

void size_result(const Rect& rect, TileResult& result) {
  const auto pixels = static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
  result.rect = rect;
  result.rgba.resize(pixels * 4);
  result.matte.resize(pixels);
  result.statistics = {};
}

void TileWorkspace::Impl::push(const ShadePoint& from, const NewRay& ray) {
  const float weight = largest(ray.throughput);
  if (!(weight > 0)) return;
  Sample& sample = samples[from.slot];
  const Environment& env = *frame->inputs.environment;
  const bool straight = ray.kind == RayKind::camera;
  const Vec3f light =
      straight ? Vec3f{} : radiance_of(env, ray.direction, ray.roughness, ray.spread);
  const Effort& effort = frame->job->effort;
  // A cut ray is not black: it sees the environment, or the plate. Bright light is never cut.
  const bool deep = from.depth >= effort.max_depth || queue.size() == queue.capacity();
  if (deep) ++statistics->depth_limit_hits;
  if (deep || weight * std::max(1.0F, largest(light)) < 1 - effort.accuracy) {
    if (straight) {
      sample.plate += ray.throughput;
      sample.passed += mean(ray.throughput);
      sample.seen += mean(ray.throughput);
    } else if (ray.kind == RayKind::reflection) {
      sample.added += ray.throughput * light;
    }
    return;
  }
  queue.push_back({ray.origin, ray.direction, ray.throughput, light, from.footprint_m,
                   spread_of(ray.spread, from), ray.roughness, from.pixel, from.slot, ray.kind,
                   static_cast<std::uint8_t>(from.depth + 1)});
}

void TileWorkspace::Impl::trace(int count, bool coherent, RayKind kind) {
  RayStream& s = stream;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    s.far_m[i] = s.mask[i] ? ray_far : -1.0F;
    s.time[i] = 0;
    s.id[i] = static_cast<unsigned>(i);
    s.flags[i] = 0;
    s.geom[i] = s.inst[i] = RTC_INVALID_GEOMETRY_ID;
  }
  if (gather.log) {
    gather.log->add(false, coherent,
                    {s.ox.data(), s.oy.data(), s.oz.data(), s.dx.data(), s.dy.data(), s.dz.data(),
                     s.near_m.data(), s.far_m.data()},
                    s.mask.data(), static_cast<std::size_t>(count));
  }
  TraceContext context(kind, coherent);
  RTCRayHitNp rays;
  rays.ray = {s.ox.data(),    s.oy.data(),   s.oz.data(), s.near_m.data(),
              s.dx.data(),    s.dy.data(),   s.dz.data(), s.time.data(),
              s.far_m.data(), s.mask.data(), s.id.data(), s.flags.data()};
  rays.hit.Ng_x = s.ngx.data(), rays.hit.Ng_y = s.ngy.data(), rays.hit.Ng_z = s.ngz.data();
  rays.hit.u = s.u.data(), rays.hit.v = s.v.data();
  rays.hit.primID = s.prim.data(), rays.hit.geomID = s.geom.data();
  rays.hit.instID[0] = s.inst.data();
  rtcIntersectNp(frame->inputs.scene->embree(), &context.context, &rays,
                 static_cast<unsigned>(count));
}

void TileWorkspace::Impl::set_camera_ray(int index, Vec3f v) {
  const auto i = static_cast<std::size_t>(index);
  const auto& m = frame->set_from_cam;
  const Vec3f d{m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
                m[6] * v.x + m[7] * v.y + m[8] * v.z};
  const float l = dot(d, d);
  const bool seen = l > 0.25F;  // zero where the lens sees nothing
  const Vec3f unit = seen ? d * (1 / std::sqrt(l)) : Vec3f{0, 0, 1};
  stream.ox[i] = frame->camera.x, stream.oy[i] = frame->camera.y, stream.oz[i] = frame->camera.z;
  stream.dx[i] = unit.x, stream.dy[i] = unit.y, stream.dz[i] = unit.z;
  stream.near_m[i] = 0;
  stream.mask[i] = seen ? mask_virtual | mask_stand_in : 0U;
}

Met TileWorkspace::Impl::met_at(int index) const {
  const auto i = static_cast<std::size_t>(index);
  const RayStream& s = stream;
  if (s.geom[i] == RTC_INVALID_GEOMETRY_ID) return {no_hit, {}, {}};
  const Vec3f d{s.dx[i], s.dy[i], s.dz[i]};
  Vec3f n = normalize(Vec3f{s.ngx[i], s.ngy[i], s.ngz[i]});
  if (dot(n, d) > 0) n = -n;
  const Scene::Surface surface = frame->inputs.scene->surface_of(s.geom[i], s.prim[i], s.inst[i]);
  return {surface, n, frame->camera + d * s.far_m[i]};
}

void TileWorkspace::Impl::trace_centres() {
  const auto& table = *frame->inputs.directions;
  inside = {};
  // 4x4 blocks one after the other: coherent for Embree, and each stream is exactly one cell.
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    const bool in = x0 + x < table.width && y0 + y < table.height;
    if (in) {
      const std::size_t t = table.index(y0 + y, x0 + x);
      set_camera_ray(i, {table.x[t], table.y[t], table.z[t]});
      inside[static_cast<std::size_t>(y / 4)] |= std::uint64_t{1} << ((y & 3) * 16 + x);
    } else {
      set_camera_ray(i, {});
    }
    statistics->primary_rays += in;
  }
  trace(cell_pixels, true, RayKind::camera);
}

void TileWorkspace::Impl::set_point(ShadePoint& p,
                                    int index,
                                    std::uint32_t pixel,
                                    std::uint32_t slot) {
  const auto i = static_cast<std::size_t>(index);
  const RayStream& s = stream;
  p.incoming = {s.dx[i], s.dy[i], s.dz[i]};
  if (s.geom[i] != RTC_INVALID_GEOMETRY_ID) {
    p.hit =
        frame->inputs.scene->hit_point(s.geom[i], s.prim[i], s.inst[i], s.u[i], s.v[i], p.incoming);
  }
  p.spread_rad = frame->pixel_angle;
  p.footprint_m = s.far_m[i] < ray_far ? s.far_m[i] * p.spread_rad : 0;
  p.throughput = {1, 1, 1};
  p.plate = plate[pixel];
  p.pixel = pixel;
  p.slot = slot;
  p.kind = RayKind::camera;
  p.depth = 0;
}

// Calls `call` with each shader and its points, in the order in which shaders first appear.
template <class F>
void TileWorkspace::Impl::for_each_shader(int count, F&& call) {
  const Scene& scene = *frame->inputs.scene;
  std::fill_n(done.begin(), count, std::uint8_t{0});
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (done[i]) continue;
    const Shader& shader = scene.shader_of(points[i].hit.material);
    std::size_t n = 0;
    for (std::size_t j = i; j < static_cast<std::size_t>(count); ++j) {
      if (done[j] || &scene.shader_of(points[j].hit.material) != &shader) continue;
      done[j] = 1;
      group[n++] = &points[j];
    }
    call(shader, std::span<ShadePoint* const>(group.data(), n));
  }
}

// Light at the first `count` points; in a grid each lies at its pixel's place.
void TileWorkspace::Impl::receive(int count, bool grid) {
  Receivers& r = receivers;
  const auto& instances = frame->inputs.scene->description().instances;
  r.active = {};
  r.count = 0;
  r.real_first.fill(0);
  const float further_share = 1 / static_cast<float>(frame->job->effort.aa_samples);
  const auto entry = [&](std::size_t k, const ShadePoint& p) {
    const Vec3f origin = offset_origin(p.hit, p.hit.geometric_normal);
    r.px[k] = origin.x, r.py[k] = origin.y, r.pz[k] = origin.z;
    r.nx[k] = p.light_normal.x, r.ny[k] = p.light_normal.y, r.nz[k] = p.light_normal.z;
    const Vec3f g = p.hit.geometric_normal;
    r.gx[k] = g.x, r.gy[k] = g.y, r.gz[k] = g.z;
    const bool real = instances[p.hit.instance].kind == ObjectKind::stand_in;
    r.mask[k] = real ? mask_virtual : mask_virtual | mask_real_blocker;
    r.real_first[k] = real;
    r.surface[k] = p.hit.instance * 4096 + p.hit.material;
    // Further samples of an edge pixel share its weight.
    r.share[k] = largest(p.throughput) * (p.slot < cell_pixels ? 1.0F : further_share);
  };
  constexpr std::uint16_t nowhere = 0xFFFF;
  std::array<std::uint16_t, stream_rays> place;
  std::fill_n(place.begin(), count, nowhere);
  const auto known = [this](std::size_t k) { return (light_known[k / 64] >> (k % 64) & 1) != 0; };
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    ShadePoint& p = points[i];
    p.irradiance = p.irradiance_open = p.irradiance_lamps = {};
    p.compact_open = p.compact_seen = 0;
    if (!p.receives_light) continue;
    if (lender[i] >= 0 && known(static_cast<std::size_t>(lender[i]))) {
      const Light& lent = light[static_cast<std::size_t>(lender[i])];
      p.irradiance = lent.irradiance;
      p.irradiance_open = lent.open;
      p.irradiance_lamps = lent.lamps;
      p.compact_open = lent.compact_open;
      p.compact_seen = lent.compact_seen;
      continue;
    }
    const std::size_t k = grid ? p.pixel : static_cast<std::size_t>(r.count);
    place[i] = static_cast<std::uint16_t>(k);
    entry(k, p);
    ++r.count;
    r.active[k / 64] |= std::uint64_t{1} << (k % 64);
  }
  if (r.count == 0) return;
  if (grid) {
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      if (!(r.active[k / 64] >> (k % 64) & 1)) r.nx[k] = r.ny[k] = r.nz[k] = 0;
    }
    KeptVisibility* memory = frame->inputs.kept_visibility;
    const int column = x0 / cell_size, row = y0 / cell_size;
    const CellMask* kept = memory ? memory->find(column, row) : nullptr;
    CellMask* room = memory && !kept ? memory->place(column, row) : nullptr;
    if (gather_cell(frame->light, r, gather, {kept, room}, *statistics)) memory->keep(column, row);
  } else {
    gather_points(frame->light, r, gather, *statistics);
  }
  const bool lamps = !frame->job->lights.lamps.empty();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    ShadePoint& p = points[i];
    const std::size_t k = place[i];
    if (k == nowhere) continue;
    p.irradiance_open = {r.open_r[k], r.open_g[k], r.open_b[k]};
    p.irradiance = p.irradiance_open - Vec3f{r.lost_r[k], r.lost_g[k], r.lost_b[k]};
    p.compact_open = r.compact_open[k];
    p.compact_seen = r.compact_seen[k];
    if (lamps) {
      p.irradiance_lamps =
          gather_lamps(frame->light, {r.px[k], r.py[k], r.pz[k]}, p.light_normal,
                       p.hit.geometric_normal, mask_virtual | mask_real_blocker, *statistics);
    }
    if (!grid) continue;
    light[k] = {p.irradiance, p.irradiance_open, p.irradiance_lamps, p.compact_open,
                p.compact_seen};
    light_known[k / 64] |= std::uint64_t{1} << (k % 64);
  }
}

void TileWorkspace::Impl::collect(const ShadePoint& p) {
  Sample& sample = samples[p.slot];
  sample.added += p.throughput * p.radiance;
  if (p.kind == RayKind::camera) {
    sample.plate += p.throughput * p.plate_share;
    sample.passed += mean(p.throughput * p.plate_passed);
  }
}

void TileWorkspace::Impl::shade_points(int count, bool grid) {
  if (count == 0) return;
  const Scene& scene = *frame->inputs.scene;
  const ShadeContext context{&scene.description(), frame->inputs.environment, frame->compact};
  for_each_shader(count, [&](const Shader& shader, std::span<ShadePoint* const> group_points) {
    for (ShadePoint* p : group_points) p->receives_light = false;
    shader.surface(context, group_points);
  });
  receive(count, grid);
  for_each_shader(count, [&](const Shader& shader, std::span<ShadePoint* const> group_points) {
    for (ShadePoint* p : group_points) clear_results(*p);
    shader.shade(context, group_points, *this);
    for (ShadePoint* p : group_points) {
      collect(*p);
      statistics->clipped_plate += p->clipped_plate;
      const bool real = scene.description().instances[p->hit.instance].kind == ObjectKind::stand_in;
      if (real && p->kind == RayKind::camera) samples[p->slot].seen += mean(p->throughput);
    }
  });
}

void TileWorkspace::Impl::run_background(std::span<ShadePoint* const> leaving) {
  if (leaving.empty()) return;
  const ShadeContext context{&frame->inputs.scene->description(), frame->inputs.environment,
                             frame->compact};
  for (ShadePoint* p : leaving) clear_results(*p);
  frame->inputs.scene->background().shade(context, leaving);
  for (ShadePoint* p : leaving) {
    collect(*p);
    samples[p->slot].seen += mean(p->throughput);
  }
}

void TileWorkspace::Impl::shade_centres() {
  int count = 0;
  std::size_t leaving = 0;
  // Points in front, those that leave at the back: a cell has no more than 256 of both.
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    const auto pixel = static_cast<std::uint32_t>(y * cell_size + x);
    if (!(inside[pixel / 64] >> (pixel % 64) & 1)) continue;
    if (stream.geom[static_cast<std::size_t>(i)] != RTC_INVALID_GEOMETRY_ID) {
      set_point(points[static_cast<std::size_t>(count++)], i, pixel, pixel);
    } else {
      ShadePoint& p = points[stream_rays - ++leaving];
      set_point(p, i, pixel, pixel);
      group[leaving - 1] = &p;
    }
  }
  run_background({group.data(), leaving});
  shade_points(count, true);
  bounce();
}

void TileWorkspace::Impl::bounce() {
  while (!queue.empty()) {
    const std::size_t n = std::min<std::size_t>(queue.size(), stream_rays);
    const std::size_t from = queue.size() - n;
    for (std::size_t i = 0; i < n; ++i) {
      const QueuedRay& q = queue[from + i];
      stream.ox[i] = q.origin.x, stream.oy[i] = q.origin.y, stream.oz[i] = q.origin.z;
      stream.dx[i] = q.direction.x, stream.dy[i] = q.direction.y, stream.dz[i] = q.direction.z;
      stream.near_m[i] = 0;
      stream.mask[i] = q.kind == RayKind::camera ? mask_virtual | mask_stand_in : mask_virtual;
    }
    trace(static_cast<int>(n), false, RayKind::reflection);
    statistics->secondary_rays += n;
    int count = 0;
    std::size_t leaving = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const QueuedRay& q = queue[from + i];
      const bool hit = stream.geom[i] != RTC_INVALID_GEOMETRY_ID;
      if (!hit && q.kind != RayKind::camera) {
        if (q.kind == RayKind::reflection) samples[q.slot].added += q.throughput * q.environment;
        continue;
      }
      if (hit && q.kind == RayKind::difference) {
        samples[q.slot].added -= q.throughput * q.environment;
      }
      ShadePoint& p =
          hit ? points[static_cast<std::size_t>(count++)] : points[stream_rays - ++leaving];
      set_point(p, static_cast<int>(i), q.pixel, q.slot);
      if (!hit) group[leaving - 1] = &p;
      p.spread_rad = q.spread_rad;
      p.footprint_m = q.footprint_m + (hit ? stream.far_m[i] * q.spread_rad : 0);
      p.throughput = q.throughput;
      p.kind = q.kind == RayKind::camera ? RayKind::camera : RayKind::reflection;
      p.depth = q.depth;
    }
    queue.resize(from);
    run_background({group.data(), leaving});
    shade_points(count, false);
  }
}

void TileWorkspace::Impl::keep_centres() {
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    met[static_cast<std::size_t>((y + 1) * ring_size + x + 1)] = met_at(i);
  }
}

void TileWorkspace::Impl::trace_ring() {
  const auto& table = *frame->inputs.directions;
  std::array<std::uint16_t, 4 * (ring_size - 1)> place;
  int count = 0;
  const auto add = [&](int x, int y) {
    place[static_cast<std::size_t>(count)] =
        static_cast<std::uint16_t>((y + 1) * ring_size + x + 1);
    const bool in = x0 + x >= 0 && y0 + y >= 0 && x0 + x < table.width && y0 + y < table.height;
    const std::size_t t = in ? table.index(y0 + y, x0 + x) : 0;
    set_camera_ray(count, in ? Vec3f{table.x[t], table.y[t], table.z[t]} : Vec3f{});
    ++count;
  };
  for (int x = -1; x <= cell_size; ++x) add(x, -1);
  for (int x = -1; x <= cell_size; ++x) add(x, cell_size);
  for (int y = 0; y < cell_size; ++y) add(-1, y);
  for (int y = 0; y < cell_size; ++y) add(cell_size, y);
  trace(count, true, RayKind::camera);
  for (int i = 0; i < count; ++i) met[place[static_cast<std::size_t>(i)]] = met_at(i);
}

namespace {

// Whether two neighbouring pixels show one surface: same thing, no crease, no step in depth.
bool continuous(const Met& a, const Met& b, float pixel_angle, Vec3f camera) {
  if (a.surface != b.surface) return false;
  if (a.surface == no_hit) return true;
  if (dot(a.normal, b.normal) < 0.9F) return false;
  const Vec3f between = b.position - a.position;
  const float step = std::min(std::abs(dot(a.normal, between)), std::abs(dot(b.normal, between)));
  return step < 3 * pixel_angle * length(a.position - camera);
}

}  // namespace

void TileWorkspace::Impl::find_edges() {
  edge.fill(Edge::none);
  const auto& table = *frame->inputs.directions;
  const auto mark = [&](int x, int y) {
    if (x >= 0 && y >= 0 && x < cell_size && y < cell_size) {
      edge[static_cast<std::size_t>(y * cell_size + x)] = Edge::surface;
    }
  };
  const auto compare = [&](int x, int y, int dx, int dy) {
    const auto in = [&](int px, int py) {
      return px >= 0 && py >= 0 && px < table.width && py < table.height;
    };
    if (!in(x0 + x, y0 + y) || !in(x0 + x + dx, y0 + y + dy)) return;
    const Met& a = met[static_cast<std::size_t>((y + 1) * ring_size + x + 1)];
    const Met& b = met[static_cast<std::size_t>((y + 1 + dy) * ring_size + x + 1 + dx)];
    if (continuous(a, b, frame->pixel_angle, frame->camera)) return;
    mark(x, y);
    mark(x + dx, y + dy);
  };
  for (int y = -1; y <= cell_size; ++y) {
    for (int x = -1; x <= cell_size; ++x) {
      if (x < cell_size) compare(x, y, 1, 0);
      if (y < cell_size) compare(x, y, 0, 1);
    }
  }
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!(inside[k / 64] >> (k % 64) & 1)) edge[k] = Edge::none;
  }
}

// Marks pixels whose own light differs from a neighbour's by more than the effort allows.
void TileWorkspace::Impl::find_glints() {
  const float least = frame->job->effort.glint_contrast;
  if (!(least > 0)) return;
  const auto shown = [&](std::size_t k) {
    const Vec3f v = samples[k].added;
    return Vec3f{std::min(v.x, display_limit), std::min(v.y, display_limit),
                 std::min(v.z, display_limit)};
  };
  const auto is_inside = [&](std::size_t k) { return (inside[k / 64] >> (k % 64) & 1) != 0; };
  const auto compare = [&](std::size_t a, std::size_t b) {
    if (!is_inside(a) || !is_inside(b)) return;
    const Vec3f d = shown(a) - shown(b);
    if (std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) > least)
      edge[a] = edge[b] = Edge::glint;
  };
  for (std::size_t y = 0; y < cell_size; ++y) {
    for (std::size_t x = 0; x < cell_size; ++x) {
      const std::size_t k = y * cell_size + x;
      if (x + 1 < cell_size) compare(k, k + 1);
      if (y + 1 < cell_size) compare(k, k + cell_size);
    }
  }
}

// The nearest pixel whose centre shows the same surface as a further ray met, or -1.
int TileWorkspace::Impl::neighbour_of(int index, const Further& f) const {
  const Met here = met_at(index);
  const int px = f.pixel % cell_size, py = f.pixel / cell_size;
  const auto& offset = frame->pattern[f.index];
  float best = 1e9F;
  int found = -1;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const int x = px + dx, y = py + dy;
      if (x < 0 || y < 0 || x >= cell_size || y >= cell_size) continue;
      const int k = y * cell_size + x;
      if (!(inside[static_cast<std::size_t>(k / 64)] >> (k % 64) & 1)) continue;
      const float ox = static_cast<float>(dx) - offset[0], oy = static_cast<float>(dy) - offset[1];
      const float distance = ox * ox + oy * oy;
      if (distance >= best) continue;
      const Met& there = met[static_cast<std::size_t>((y + 1) * ring_size + x + 1)];
      if (!continuous(here, there, frame->pixel_angle, frame->camera)) continue;
      best = distance;
      found = k;
    }
  }
  return found;
}

void TileWorkspace::Impl::finish_further(int count) {
  trace(count, true, RayKind::camera);
  statistics->primary_rays += static_cast<std::uint64_t>(count);
  int shaded = 0;
  std::size_t leaving = 0;
  std::array<std::uint16_t, stream_rays> pixel_of;
  std::size_t used = 0;
  const float finer = 1 / std::sqrt(static_cast<float>(samples_each));
  for (int i = 0; i < count; ++i) {
    const Further& f = further[static_cast<std::size_t>(i)];
    const int neighbour = neighbour_of(i, f);
    if (neighbour >= 0 && edge[f.pixel] == Edge::surface) {
      add_further(f.pixel, samples[static_cast<std::size_t>(neighbour)]);
      continue;
    }
    const std::size_t slot = cell_pixels + used;
    samples[slot] = {};
    pixel_of[used++] = f.pixel;
    const bool hit = stream.geom[static_cast<std::size_t>(i)] != RTC_INVALID_GEOMETRY_ID;
    ShadePoint& p =
        hit ? points[static_cast<std::size_t>(shaded++)] : points[stream_rays - ++leaving];
    set_point(p, i, f.pixel, static_cast<std::uint32_t>(slot));
    p.spread_rad *= finer;
    p.footprint_m *= finer;
    if (hit && neighbour >= 0)
      lender[static_cast<std::size_t>(shaded - 1)] = static_cast<std::int16_t>(neighbour);
    if (!hit) group[leaving - 1] = &p;
  }
  run_background({group.data(), leaving});
  shade_points(shaded, false);
  lender.fill(-1);
  bounce();
  for (std::size_t i = 0; i < used; ++i) {
    add_further(pixel_of[i], samples[cell_pixels + i]);
  }
}

// More camera rays in pixels that an edge crosses. The centre's own sample makes room for them.
// Pixels that are still uncertain take more, three times as many as they have, and again.
void TileWorkspace::Impl::sample_edges() {
  const Effort& effort = frame->job->effort;
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (edge[k] == Edge::none) continue;
    sums[k] = {};
    squares[k] = shown_sum[k] = {};
    counts[k] = 0;
  }
  int first = 0;
  for (int end = effort.aa_samples; end <= samples_max; first = end, end *= 4) {
    samples_each = end;
    const CellMask chosen = first == 0 ? edges() : uncertain(first);
    int count = 0;
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      if (!(chosen[k / 64] >> (k % 64) & 1)) continue;
      const int x = static_cast<int>(k % cell_size), y = static_cast<int>(k / cell_size);
      for (int i = first; i < end; ++i) {
        further[static_cast<std::size_t>(count)] = {static_cast<std::uint16_t>(k),
                                                    static_cast<std::uint16_t>(i)};
        set_camera_ray(count,
                       direction_in(x0 + x, y0 + y, frame->pattern[static_cast<std::size_t>(i)]));
        if (++count == stream_rays) {
          finish_further(count);
          count = 0;
        }
      }
    }
    if (count > 0) finish_further(count);
    if (!(effort.aa_tolerance > 0)) break;
  }
}

CellMask TileWorkspace::Impl::edges() const {
  CellMask mask{};
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (edge[k] != Edge::none) mask[k / 64] |= std::uint64_t{1} << (k % 64);
  }
  return mask;
}

// Pixels whose mean of `n` further samples is uncertain, and those beside them: what one pixel saw
// of a small bright thing the next one may have missed.
CellMask TileWorkspace::Impl::uncertain(int n) const {
  CellMask mask{};
  for (int k = 0; k < cell_pixels; ++k) {
    if (!is_uncertain(static_cast<std::size_t>(k), n)) continue;
    for (int y = std::max(0, k / cell_size - 1); y <= std::min(cell_size - 1, k / cell_size + 1);
         ++y) {
      for (int x = std::max(0, k % cell_size - 1); x <= std::min(cell_size - 1, k % cell_size + 1);
           ++x) {
        const auto i = static_cast<std::size_t>(y * cell_size + x);
        if (edge[i] != Edge::none && counts[i] == n) mask[i / 64] |= std::uint64_t{1} << (i % 64);
      }
    }
  }
  return mask;
}

// Whether the mean of a pixel's first `n` further samples may be off by more than is allowed. A
// pixel that took no more than before stays as it is.
bool TileWorkspace::Impl::is_uncertain(std::size_t k, int n) const {
  if (counts[k] != n) return false;
  const auto samples_n = static_cast<float>(n);
  const Vec3f shown = shown_sum[k];
  const Vec3f spread = squares[k] - shown * shown * (1 / samples_n);
  const float tolerance = frame->job->effort.aa_tolerance;
  return std::max({spread.x, spread.y, spread.z}) >
         tolerance * tolerance * samples_n * std::max(samples_n - 1, 1.0F);
}

// Through a pixel off its centre: linear between the centre and the next one on that side.
Vec3f TileWorkspace::Impl::direction_in(int x, int y, const std::array<float, 2>& offset) const {
  const auto& table = *frame->inputs.directions;
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

void TileWorkspace::Impl::add_further(std::size_t k, const Sample& sample) {
  sums[k] += sample;
  ++counts[k];
  const Vec3f v = sample.added + plate[k] * sample.plate;
  const Vec3f shown{std::min(v.x, display_limit), std::min(v.y, display_limit),
                    std::min(v.z, display_limit)};
  shown_sum[k] += shown;
  squares[k] += shown * shown;
}

void TileWorkspace::Impl::load_plate(const TileJob& tile) {
  const Rect& b = tile.background_rect;
  for (int y = 0; y < cell_size; ++y) {
    for (int x = 0; x < cell_size; ++x) {
      const int row = y0 + y - b.y, column = x0 + x - b.x;
      Vec3f& to = plate[static_cast<std::size_t>(y * cell_size + x)];
      if (row >= b.height || column >= b.width) {
        to = {};
        continue;
      }
      const std::size_t at = (static_cast<std::size_t>(row) * static_cast<std::size_t>(b.width) +
                              static_cast<std::size_t>(column)) *
                             3;
      to = {capture::float_from_half(tile.background[at]),
            capture::float_from_half(tile.background[at + 1]),
            capture::float_from_half(tile.background[at + 2])};
    }
  }
}

void TileWorkspace::Impl::write(const TileJob& tile, TileResult& result) {
  const Rect& rect = tile.rect;
  const auto finish = [this](float value) {
    if (std::abs(value) <= capture::half_max) return value;
    ++statistics->clamped_values;
    return std::isnan(value) ? 0.0F : std::clamp(value, -capture::half_max, capture::half_max);
  };
  for (int y = 0; y < cell_size; ++y) {
    for (int x = 0; x < cell_size; ++x) {
      const int row = y0 + y - rect.y, column = x0 + x - rect.x;
      if (row < 0 || column < 0 || row >= rect.height || column >= rect.width) continue;
      const auto k = static_cast<std::size_t>(y * cell_size + x);
      const Sample& s = sums[k];
      const float n = counts[k];
      const Vec3f share{s.plate.x / n, s.plate.y / n, s.plate.z / n};
      const Vec3f rgb{plate[k].x * share.x + s.added.x / n, plate[k].y * share.y + s.added.y / n,
                      plate[k].z * share.z + s.added.z / n};
      const float coverage = 1 - s.seen / n, matte = 1 - s.passed / n;
      const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(rect.width) +
                             static_cast<std::size_t>(column);
      result.rgba[at * 4] = capture::half_from_float(finish(rgb.x));
      result.rgba[at * 4 + 1] = capture::half_from_float(finish(rgb.y));
      result.rgba[at * 4 + 2] = capture::half_from_float(finish(rgb.z));
      result.rgba[at * 4 + 3] = capture::half_from_float(finish(coverage));
      result.matte[at] = capture::half_from_float(finish(matte));
      statistics->virtual_pixels += coverage > 0;
      statistics->affected_pixels += coverage > 0 || matte != 0 || s.added != Vec3f{};
    }
  }
}

void TileWorkspace::Impl::render_cell(const TileJob& tile, TileResult& result) {
  samples.fill({});
  queue.clear();
  light_known = {};
  lender.fill(-1);
  load_plate(tile);
  trace_centres();
  const bool smooth_edges = frame->job->effort.aa_samples > 1;
  if (smooth_edges) keep_centres();
  shade_centres();
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    sums[k] = samples[k];
    counts[k] = 1;
  }
  if (smooth_edges) {
    trace_ring();
    find_edges();
    find_glints();
    sample_edges();
  }
  write(tile, result);
}

void render_tile(const FrameContext& context,
                 const TileJob& tile,
                 TileWorkspace& workspace,
                 TileResult& result) {
  prepare_thread();
  TileWorkspace::Impl& w = workspace.impl();
  w.frame = &context;
  w.statistics = &result.statistics;
  for (int y = tile.rect.y; y < tile.rect.y + tile.rect.height; y += cell_size) {
    for (int x = tile.rect.x; x < tile.rect.x + tile.rect.width; x += cell_size) {
      w.x0 = x;
      w.y0 = y;
      w.render_cell(tile, result);
    }
  }
}

}  // namespace render
