// Every pixel draws its own lights.
#include "render/sampled_light.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <span>
#include <stdexcept>
#include <vector>

#include "capture/parallel_loop.h"
#include "render/cell_baker.h"
#include "render/embree_context.h"
#include "render/environment_sampler.h"
#include "render/pixel_rays.h"
#include "render/sample_sequence.h"
#include "render/trace.h"

namespace render {
namespace {

constexpr std::uint32_t drawn = 16384;

// A direction, and the irradiance that it stands for on a surface that faces it, times the samples
// of a pixel.
struct Drawn {
  Vec3f direction;
  Vec3f irradiance;
};

std::vector<Drawn> draw(const Environment& environment, std::uint32_t seed) {
  const EnvironmentSampler sampler(environment);
  std::vector<Drawn> result(drawn);
  capture::parallel_for(std::uint32_t{0}, drawn, [&](std::uint32_t i) {
    const auto sample = sampler.sample(SampleSequence(seed, 0, i).next_pair());
    if (sample) result[i] = {sample->direction, sample->radiance * (1 / sample->density)};
  });
  return result;
}

// Where a pixel's run of them begins: runs are whole pieces of the sequence, which are well spread.
std::uint32_t run_of(std::uint32_t pixel, std::uint32_t seed, std::uint32_t samples) {
  const float place = SampleSequence(seed, pixel + 1, 0).next();
  const std::uint32_t runs = drawn / samples;
  return std::min(static_cast<std::uint32_t>(place * static_cast<float>(runs)), runs - 1) * samples;
}

// Mirrors are left out.
class NoRays final : public RaySink {
 public:
  void push(const ShadePoint&, const NewRay&) override {}
};

// All that a cell takes on one thread.
struct Workspace {
  RayStream stream;
  std::array<ShadePoint, stream_rays> points;
  std::array<std::uint32_t, stream_rays> run;        // per point
  std::array<Vec3f, stream_rays> open, lost;         // irradiance, times the samples
  std::array<std::uint32_t, stream_rays> ray_pixel;  // per camera ray
  std::array<Vec3f, stream_rays> ray_light;          // per shadow ray
  std::array<std::uint16_t, stream_rays> ray_point;
  std::array<std::uint8_t, stream_rays> shaded;
};

class SampledLight {
 public:
  SampledLight(const FrameInputs& inputs,
               const FrameJob& job,
               const capture::Image& plate,
               const SampledLightSettings& settings,
               capture::Image& picture)
      : scene_(*inputs.scene),
        rays_(*inputs.directions, job.cam_from_set),
        plate_(plate),
        samples_(static_cast<std::uint32_t>(settings.samples)),
        seed_(settings.seed),
        lights_(draw(*inputs.environment, settings.seed)),
        picture_(picture) {}

  void render_cell(int x0, int y0, Workspace& w) const {
    const int count = trace_centres(x0, y0, w);
    shade(count, w);
    light(count, w);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) write(w, i);
  }

 private:
  std::uint32_t pixel_at(int x, int y) const {
    return static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(picture_.width) +
           static_cast<std::uint32_t>(x);
  }

  // Points of the cell's pixels that meet anything; the others show the plate.
  int trace_centres(int x0, int y0, Workspace& w) const {
    RayStream& s = w.stream;
    int count = 0;
    for (int y = y0; y < std::min(y0 + cell_size, picture_.height); ++y) {
      for (int x = x0; x < std::min(x0 + cell_size, picture_.width); ++x) {
        for (int c = 0; c < 3; ++c) picture_.at(y, x, c) = plate_.at(y, x, c);
        const auto direction = rays_.direction(x, y, 0, 0);
        if (!direction) continue;
        w.ray_pixel[static_cast<std::size_t>(count)] = pixel_at(x, y);
        set_ray(s, count++, rays_.origin(), *direction, mask_virtual | mask_stand_in);
      }
    }
    intersect(s, count);
    int met = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (s.geom[i] == RTC_INVALID_GEOMETRY_ID) continue;
      ShadePoint& p = w.points[static_cast<std::size_t>(met++)];
      p = {};
      p.incoming = {s.dx[i], s.dy[i], s.dz[i]};
      scene_.read_hit(s.geom[i], s.prim[i], s.inst[i], s.u[i], s.v[i], p.incoming, p.hit);
      p.throughput = {1, 1, 1};
      p.pixel = w.ray_pixel[i];
    }
    return met;
  }

  void shade(int count, Workspace& w) const {
    NoRays mirrors;
    const ShadeContext context{&scene_.description(), &scene_, scene_.pictures(),
                               scene_.prepared()};
    std::array<ShadePoint*, stream_rays> group;
    std::fill_n(w.shaded.begin(), count, std::uint8_t{0});
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (w.shaded[i] != 0) continue;
      const Shader& shader = scene_.shader_of(w.points[i].hit.material);
      std::size_t n = 0;
      for (std::size_t j = i; j < static_cast<std::size_t>(count); ++j) {
        if (w.shaded[j] != 0 || &scene_.shader_of(w.points[j].hit.material) != &shader) continue;
        w.shaded[j] = 1;
        group[n++] = &w.points[j];
      }
      shader.shade(context, std::span<ShadePoint* const>(group.data(), n), mirrors);
    }
  }

  void light(int count, Workspace& w) const {
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      w.run[i] = run_of(w.points[i].pixel, seed_, samples_);
      w.open[i] = w.lost[i] = {};
    }
    int rays = 0;
    for (std::uint32_t j = 0; j < samples_; ++j) {
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        const ShadePoint& p = w.points[i];
        const Drawn& light = lights_[w.run[i] + j];
        const float cosine = dot(p.light_normal, light.direction);
        if (!(cosine > 0) || !(dot(p.hit.geometric_normal, light.direction) > 0)) continue;
        const Vec3f irradiance = light.irradiance * cosine;
        w.open[i] += irradiance;
        set_ray(w.stream, rays, offset_origin(p.hit, p.hit.geometric_normal), light.direction,
                mask_virtual);
        w.ray_light[static_cast<std::size_t>(rays)] = irradiance;
        w.ray_point[static_cast<std::size_t>(rays++)] = static_cast<std::uint16_t>(i);
        if (rays == stream_rays) rays = find_lost(rays, w);
      }
    }
    find_lost(rays, w);
  }

  // Shoots shadow rays, takes away the light of those that are blocked; none are left.
  int find_lost(int rays, Workspace& w) const {
    RayStream& s = w.stream;
    TraceContext context(scene_, RayKind::shadow, false);
    RTCRayNp stream = rays_of(s);
    rtcOccludedNp(scene_.embree(), &context.context, &stream, static_cast<unsigned>(rays));
    for (std::size_t i = 0; i < static_cast<std::size_t>(rays); ++i) {
      if (s.far_m[i] < 0) w.lost[w.ray_point[i]] += w.ray_light[i];
    }
    return 0;
  }

  void write(const Workspace& w, std::size_t i) const {
    const ShadePoint& p = w.points[i];
    const Vec3f arriving = (w.open[i] - w.lost[i]) * (1 / static_cast<float>(samples_));
    const Vec3f share =
        p.catches_shadow ? p.plate_share * passing(w.open[i], w.lost[i]) : p.plate_share;
    const Vec3f own = p.radiance + p.diffuse * arriving;
    float* rgba = &picture_.pixels[std::size_t{4} * p.pixel];
    rgba[0] = rgba[0] * share.x + own.x;
    rgba[1] = rgba[1] * share.y + own.y;
    rgba[2] = rgba[2] * share.z + own.z;
    const auto& instance = scene_.description().instances[p.hit.instance];
    rgba[3] = instance.kind == ObjectKind::virtual_object ? 1.0F : 0.0F;
  }

  static void set_ray(RayStream& s, int at, Vec3f origin, Vec3f direction, unsigned mask) {
    const auto i = static_cast<std::size_t>(at);
    s.ox[i] = origin.x, s.oy[i] = origin.y, s.oz[i] = origin.z;
    s.dx[i] = direction.x, s.dy[i] = direction.y, s.dz[i] = direction.z;
    s.near_m[i] = 0, s.far_m[i] = ray_far, s.time[i] = 0;
    s.mask[i] = mask, s.id[i] = static_cast<unsigned>(at), s.flags[i] = 0;
    s.geom[i] = s.inst[i] = RTC_INVALID_GEOMETRY_ID;
  }

  static RTCRayNp rays_of(RayStream& s) {
    return {s.ox.data(),    s.oy.data(),   s.oz.data(), s.near_m.data(),
            s.dx.data(),    s.dy.data(),   s.dz.data(), s.time.data(),
            s.far_m.data(), s.mask.data(), s.id.data(), s.flags.data()};
  }

  void intersect(RayStream& s, int count) const {
    TraceContext context(scene_, RayKind::camera, true);
    RTCRayHitNp rays;
    rays.ray = rays_of(s);
    rays.hit.Ng_x = s.ngx.data(), rays.hit.Ng_y = s.ngy.data(), rays.hit.Ng_z = s.ngz.data();
    rays.hit.u = s.u.data(), rays.hit.v = s.v.data();
    rays.hit.primID = s.prim.data(), rays.hit.geomID = s.geom.data();
    rays.hit.instID[0] = s.inst.data();
    rtcIntersectNp(scene_.embree(), &context.context, &rays, static_cast<unsigned>(count));
  }

  const Scene& scene_;
  PixelRays rays_;
  const capture::Image& plate_;
  std::uint32_t samples_, seed_;
  std::vector<Drawn> lights_;
  capture::Image& picture_;
};

void check(const FrameInputs& inputs,
           const capture::Image& plate,
           const SampledLightSettings& settings) {
  if (!inputs.scene || !inputs.directions || !inputs.environment) {
    throw std::invalid_argument("sampled light needs a scene, a lens and an environment");
  }
  const auto& directions = *inputs.directions;
  if (plate.width != directions.width || plate.height != directions.height || plate.channels != 3) {
    throw std::invalid_argument("the plate must have three channels and the lens's size");
  }
  if (settings.samples < 1 || settings.samples > static_cast<int>(drawn)) {
    throw std::invalid_argument("sampled light takes 1 to 16384 samples");
  }
  if (inputs.scene->has_filters() || inputs.scene->has_real_blockers()) {
    throw std::invalid_argument(
        "sampled light knows neither glass nor holes nor stand-ins that block light");
  }
}

}  // namespace

capture::Image render_sampled_light(const FrameInputs& inputs,
                                    const FrameJob& job,
                                    const capture::Image& plate,
                                    const SampledLightSettings& settings) {
  check(inputs, plate, settings);
  capture::Image picture = capture::make_image(plate.height, plate.width, 4);
  const SampledLight light(inputs, job, plate, settings, picture);
  const int columns = (plate.width + cell_size - 1) / cell_size;
  const int rows = (plate.height + cell_size - 1) / cell_size;
  tbb::enumerable_thread_specific<Workspace> workspaces;
  capture::parallel_for(0, columns * rows, [&](int i) {
    prepare_thread();
    light.render_cell(i % columns * cell_size, i / columns * cell_size, workspaces.local());
  });
  return picture;
}

}  // namespace render
