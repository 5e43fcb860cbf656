// The reference's pictures: samples of every pixel, put together.
#include "render/reference.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include "calibrate/angles.h"
#include "capture/parallel_loop.h"
#include "render/cell_transport.h"
#include "render/environment_sampler.h"
#include "render/path_tracer.h"
#include "render/pixel_rays.h"
#include "render/plate_levels.h"
#include "render/sample_budget.h"
#include "render/sample_sequence.h"
#include "render/stand_in_parameters.h"
#include "render/trace.h"

namespace render {
namespace {

using calibrate::DirectionTable;
using calibrate::Mat3;
using calibrate::Pose;

using calibrate::pi_f;

Vec3f times(Vec3f a, Vec3f b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

// Sums over the samples of a pixel, in double, so that a thousand of them keep their digits.
class Sum {
 public:
  void add(Vec3f v) { x_ += v.x, y_ += v.y, z_ += v.z; }
  Vec3f over(double count) const {
    return {static_cast<float>(x_ / count), static_cast<float>(y_ / count),
            static_cast<float>(z_ / count)};
  }
  double x() const { return x_; }
  double y() const { return y_; }
  double z() const { return z_; }

 private:
  double x_ = 0, y_ = 0, z_ = 0;
};

// What the samples of a pixel say about one stand-in.
struct StandInSums {
  std::uint32_t instance = 0;
  bool bent = false;  // seen through clear bodies, or in mirrors: `plate` is what lies there
  Sum plate;          // times share; open and lost are times it as well
  StandInParameters parameters;
  int count = 0;
  Sum through;        // share of the pixel
  Sum open, lost;     // irradiance of the environment, and what virtual objects take; times share
  Sum gathered;       // irradiance of the environment that clear bodies bend; times share
  Sum irradiance;     // open, not times share
  Sum virtual_light;  // irradiance of lamps (and virtual objects); times share
};

// The plate, for paths that clear bodies bend, or mirrors send on.
class Plate {
 public:
  // `lens` null: nothing is seen of it.
  Plate(const capture::Image& plate, const calibrate::Lens* lens, const Pose& cam_from_set)
      : plate_(plate), lens_(lens), cam_from_set_(cam_from_set.R) {}

  // In a direction from the camera, bilinear, and how much of it is seen; nothing beyond the
  // picture.
  struct Seen {
    Vec3f plate;
    float share;
  };
  std::optional<Seen> seen(Vec3f from_camera, bool mirrored) const {
    if (lens_ == nullptr) return std::nullopt;
    const auto q = calibrate::project(*lens_, cam_from_set_ * calibrate::to_double(from_camera));
    if (!q || !(q->x >= -0.5 && q->x <= plate_.width - 0.5) ||
        !(q->y >= -0.5 && q->y <= plate_.height - 0.5)) {
      return std::nullopt;
    }
    return Seen{plate_at(plate_, static_cast<float>(q->x), static_cast<float>(q->y)),
                plate_share_at(plate_, q->x, q->y, mirrored)};
  }

 private:
  const capture::Image& plate_;
  const calibrate::Lens* lens_;
  Mat3 cam_from_set_;
};

// The composite, pixel by pixel.
class Composite {
 public:
  Composite(const PathTracer& tracer, bool bounces, const Plate& plate)
      : tracer_(tracer), bounces_(bounces), plate_(plate) {
    const SceneDescription& scene = tracer.scene().description();
    if (scene.background != "plate" && scene.background != "environment")
      throw std::invalid_argument(
          "the reference knows the backgrounds plate and environment, not '" + scene.background +
          "'");
    environment_behind_ = scene.background == "environment";
    for (const Material& material : scene.materials)
      stand_ins_.push_back(material.shader == "stand_in" ? stand_in_parameters(material)
                                                         : StandInParameters{});
  }

  struct Pixel {
    Sum added, background;
    double seen = 0;  // share of the plate's own things
    std::vector<StandInSums> stand_ins;
  };

  void sample(Vec3f origin,
              std::optional<Vec3f> direction,
              SampleSequence& numbers,
              Pixel& p) const {
    if (!direction) {
      p.background.add({1, 1, 1});
      p.seen += 1;
      return;
    }
    const CameraPath path = tracer_.camera_path(origin, *direction, numbers);
    p.added.add(path.radiance);
    for (const PathEnd& end : path.ends) sample_end(origin, end, 0, numbers, p);
  }

  // (R, G, B, coverage) of a pixel from its `count` samples, where the lens is so sensitive.
  std::array<float, 4> finish(const Pixel& p, Vec3f plate, float sensitivity, int count) const {
    const auto n = static_cast<double>(count);
    Vec3f added = p.added.over(n) * sensitivity;
    Vec3f rgb = times(plate, p.background.over(n));
    for (const StandInSums& s : p.stand_ins) {
      Vec3f share{1, 1, 1};
      if (s.parameters.catches_shadow != 0)
        share = {passing(s.lost.x(), s.open.x()), passing(s.lost.y(), s.open.y()),
                 passing(s.lost.z(), s.open.z())};
      share += brightening(s.open.over(1), s.gathered.over(1));
      if (s.bent) {
        rgb += times(s.plate.over(n), share) * sensitivity;
        continue;
      }
      rgb += times(plate, times(s.through.over(n), share));
      if (s.parameters.catches_light == 0) continue;
      const Vec3f light = s.virtual_light.over(n);
      if (light == Vec3f{}) continue;
      const Vec3f irradiance = s.irradiance.over(s.count);
      const Vec3f albedo{s.parameters.albedo[0], s.parameters.albedo[1], s.parameters.albedo[2]};
      if (plate_tells_albedo(plate, irradiance))
        rgb +=
            times(plate, {light.x / irradiance.x, light.y / irradiance.y, light.z / irradiance.z});
      else
        added += times(albedo, light) * (sensitivity / pi_f);
    }
    rgb = with_light(rgb, added);
    return {rgb.x, rgb.y, rgb.z, static_cast<float>(1 - p.seen / n)};
  }

 private:
  static float passing(double lost, double open) {
    return lost > 0 && open > 0 ? static_cast<float>(std::max(0.0, 1 - lost / open)) : 1.0F;
  }

  // `mirrors`: how many real surfaces on the way mirrored it.
  void sample_end(
      Vec3f origin, const PathEnd& end, int mirrors, SampleSequence& numbers, Pixel& p) const {
    if (end.bent) {
      sample_bent(origin, end, mirrors, numbers, p);
      return;
    }
    p.seen += mean(end.through);
    if (end.stand_in) {
      sample_stand_in(origin, end, {}, mirrors, numbers, p);
    } else if (environment_behind_) {
      p.added.add(times(end.through, tracer_.environment().radiance(end.incoming)));
    } else {
      p.background.add(end.through);
    }
  }

  // What a path bent by clear bodies, or mirrored, sees of the plate, or of the environment beside
  // it.
  void sample_bent(
      Vec3f origin, const PathEnd& end, int mirrors, SampleSequence& numbers, Pixel& p) const {
    const auto seen =
        environment_behind_ && !end.stand_in
            ? std::nullopt
            : plate_.seen(end.stand_in ? end.stand_in->position - origin : end.incoming,
                          end.mirrored);
    const float share = seen ? seen->share : 0;
    if (share < 1) {
      p.added.add(times(end.through, tracer_.environment().radiance(end.incoming)) * (1 - share));
    }
    if (!(share > 0)) {
      if (end.stand_in) add_reflection(origin, end, mirrors, numbers, p);
      return;
    }
    if (end.stand_in) {
      sample_stand_in(origin, end, seen->plate * share, mirrors, numbers, p);
    } else {
      p.added.add(times(end.through, seen->plate) * share);
    }
  }

  // `bent`: what is seen of the plate there, where clear bodies bent the path, or mirrors sent it.
  void sample_stand_in(Vec3f origin,
                       const PathEnd& end,
                       std::optional<Vec3f> bent,
                       int mirrors,
                       SampleSequence& numbers,
                       Pixel& p) const {
    const HitPoint& hit = *end.stand_in;
    auto sums = std::find_if(p.stand_ins.begin(), p.stand_ins.end(), [&](const StandInSums& s) {
      return s.instance == hit.instance && s.bent == bent.has_value();
    });
    if (sums == p.stand_ins.end()) {
      sums = p.stand_ins.emplace(p.stand_ins.end());
      sums->instance = hit.instance;
      sums->parameters = stand_ins_[hit.material];
      sums->bent = bent.has_value();
    }
    ++sums->count;
    sums->through.add(end.through);
    const Vec3f weight = bent ? times(end.through, *bent) : end.through;
    if (bent) sums->plate.add(weight);
    sample_irradiance(hit, weight, numbers, *sums);
    if (takes_caustics(*sums)) {
      sums->gathered.add(times(weight, tracer_.bent_irradiance(hit, hit.normal, numbers)));
    }
    if (sums->parameters.catches_light != 0 && !bent) {
      Vec3f light = tracer_.lamp_irradiance(hit, hit.normal);
      if (bounces_) light += tracer_.virtual_irradiance(hit, numbers);
      sums->virtual_light.add(times(end.through, light));
    }
    add_reflection(origin, end, mirrors, numbers, p);
  }

  bool takes_caustics(const StandInSums& sums) const {
    return tracer_.rules().caustics && (sums.bent || sums.parameters.catches_light != 0);
  }

  void sample_irradiance(const HitPoint& hit,
                         Vec3f weight,
                         SampleSequence& numbers,
                         StandInSums& sums) const {
    const auto sky = tracer_.environment().sample(numbers.next_pair());
    if (!sky) return;
    const float cosine = dot(hit.normal, sky->direction);
    if (!(cosine > 0) || !(dot(hit.geometric_normal, sky->direction) > 0)) return;
    const Vec3f origin = offset_origin(hit, hit.geometric_normal);
    const Scene& scene = tracer_.scene();
    const bool real_shadow =
        scene.has_real_blockers() &&
        transmittance(scene, origin, sky->direction, 0, ray_far, mask_real_blocker) == Vec3f{};
    if (real_shadow) return;
    const Vec3f open = sky->radiance * (cosine / sky->density);
    const Vec3f passed =
        transmittance(scene, origin, sky->direction, 0, ray_far,
                      takes_caustics(sums) ? mask_virtual | ray_glass_blocks : mask_virtual);
    sums.irradiance.add(open);
    sums.open.add(times(weight, open));
    sums.lost.add(times(weight, times(open, Vec3f{1, 1, 1} - passed)));
  }

  // F (L_hit - L_env) where the mirrored ray meets a virtual object.
  void add_reflection(
      Vec3f origin, const PathEnd& end, int mirrors, SampleSequence& numbers, Pixel& p) const {
    const HitPoint& hit = *end.stand_in;
    const StandInParameters& parameters = stand_ins_[hit.material];
    if (parameters.catches_reflection == 0 || !(parameters.reflectance > 0)) return;
    const Vec3f view = -end.incoming;
    const float f = schlick(parameters.reflectance, std::abs(dot(hit.normal, view)));
    const Vec3f direction =
        parameters.roughness < mirror_roughness
            ? normalize(mirrored(view, hit.normal))
            : sample_lobe(hit.normal, view, parameters.roughness, numbers.next_pair());
    if (!(dot(direction, hit.geometric_normal) > 0)) return;
    auto seen =
        tracer_.scattered_path(offset_origin(hit, direction), direction, mask_virtual, numbers);
    if (!seen.met) return;
    const Vec3f share = end.through * f;
    p.added.add(times(share, seen.radiance - tracer_.environment().radiance(direction)));
    // Between real and virtual mirrors light goes to and fro.
    constexpr int most_mirrors = 16;
    if (mirrors == most_mirrors) return;
    for (PathEnd& mirrored_end : seen.ends) {
      mirrored_end.through = times(mirrored_end.through, share);
      sample_end(origin, mirrored_end, mirrors + 1, numbers, p);
    }
  }

  const PathTracer& tracer_;
  bool bounces_;
  const Plate& plate_;
  bool environment_behind_ = false;
  std::vector<StandInParameters> stand_ins_;
};

void check(const FrameInputs& inputs, const ReferenceSettings& settings) {
  if (inputs.scene == nullptr || inputs.directions == nullptr || inputs.environment == nullptr)
    throw std::invalid_argument("the reference needs a scene, directions and an environment");
  if (inputs.directions->width < 1 || inputs.directions->height < 1)
    throw std::invalid_argument("the reference needs a picture of at least one pixel");
  if (settings.samples < 1 || settings.max_depth < 1)
    throw std::invalid_argument("the reference needs at least one sample, and a depth of one");
}

// Calls pixel(x, y, index) for every pixel, rows in parallel.
template <class F>
void for_each_pixel(const DirectionTable& directions, F&& pixel) {
  capture::parallel_for(0, directions.height, [&](int y) {
    prepare_thread();
    for (int x = 0; x < directions.width; ++x) {
      pixel(x, y, static_cast<std::uint32_t>(y * directions.width + x));
    }
  });
}

constexpr int pilot_share = 8;      // of all samples, one in so many finds where noise is
constexpr int pilot_estimates = 4;  // independent ones, whose spread is the noise
constexpr int most_times = 64;      // a pixel may get so many times the mean
constexpr std::uint32_t pilot_seed = 0x5EEDF00D;
constexpr float brightest_noise = 16;  // brighter light is clipped by any display

// How many samples each pixel gets. Rough estimates show where the picture is noisy; they are then
// thrown away, as counts that depend on the samples counted would bias the picture.
//
// estimate(x, y, index, seed, first, count) gives RGB of a pixel from `count` samples.
template <class F>
std::vector<int> plan_samples(const DirectionTable& directions,
                              const ReferenceSettings& settings,
                              F&& estimate) {
  const auto pixels =
      static_cast<std::size_t>(directions.width) * static_cast<std::size_t>(directions.height);
  const int each = settings.samples / (pilot_share * pilot_estimates);
  if (each < 1) return std::vector<int>(pixels, settings.samples);
  std::vector<float> variances(pixels);
  for_each_pixel(directions, [&](int x, int y, std::uint32_t index) {
    Vec3f sum{}, squares{};
    for (int k = 0; k < pilot_estimates; ++k) {
      const Vec3f rgb = estimate(x, y, index, settings.seed ^ pilot_seed, k * each, each);
      const Vec3f v{std::min(rgb.x, brightest_noise), std::min(rgb.y, brightest_noise),
                    std::min(rgb.z, brightest_noise)};
      sum += v;
      squares += times(v, v);
    }
    const Vec3f spread = squares - times(sum, sum) * (1.0F / pilot_estimates);
    variances[index] = spread.x + spread.y + spread.z;
  });
  const auto left = static_cast<std::int64_t>(settings.samples - each * pilot_estimates) *
                    static_cast<std::int64_t>(pixels);
  return share_samples(variances, directions.width, left,
                       std::max(1, settings.samples / pilot_share), settings.samples * most_times);
}

}  // namespace

capture::Image render_reference(const FrameInputs& inputs,
                                const FrameJob& job,
                                const capture::Image& plate,
                                const ReferenceSettings& settings) {
  check(inputs, settings);
  const DirectionTable& directions = *inputs.directions;
  if (plate.width != directions.width || plate.height != directions.height || plate.channels != 3)
    throw std::invalid_argument("the plate must have three channels and the lens's size");
  // Lamps of bounced light stand for what paths between surfaces find.
  std::vector<LocalLight> lamps = job.lights.lamps;
  const bool bounced = std::erase_if(lamps, [](const LocalLight& l) { return l.bounced != 0; }) > 0;
  const bool bounces = settings.bounces || bounced;
  PathRules rules;
  rules.max_depth = settings.max_depth;
  rules.caustics = job.effort.caustic_photons > 0;
  if (bounces) {
    rules.diffuse_bounces = true;
    rules.scattered_mask = rules.lobe_blockers = mask_virtual | mask_real_blocker;
  }
  const EnvironmentSampler environment(*inputs.environment);
  const PathTracer tracer(*inputs.scene, environment, lamps, rules, inputs.videos);
  capture::Image undimmed = plate;
  for (int y = 0; !directions.sensitivity.empty() && y < plate.height; ++y) {
    for (int x = 0; x < plate.width; ++x) {
      const float by = 1 / sensitivity_of_plate(directions.sensitivity[directions.index(y, x)]);
      for (int c = 0; c < 3; ++c) undimmed.at(y, x, c) *= by;
    }
  }
  const Plate behind_glass(undimmed, inputs.lens, job.cam_from_set);
  const Composite composite(tracer, bounces, behind_glass);
  const PixelRays rays(directions, job.cam_from_set);
  const auto pixel_of = [&](int x, int y, std::uint32_t index, std::uint32_t seed, int first,
                            int count) {
    Composite::Pixel pixel;
    for (int i = first; i < first + count; ++i) {
      SampleSequence numbers(seed, index, static_cast<std::uint32_t>(i));
      const auto [dx, dy] = numbers.next_pair();
      composite.sample(rays.origin(), rays.direction(x, y, dx - 0.5F, dy - 0.5F), numbers, pixel);
    }
    const Vec3f behind{plate.at(y, x, 0), plate.at(y, x, 1), plate.at(y, x, 2)};
    const float sensitivity =
        directions.sensitivity.empty() ? 1.0F : directions.sensitivity[directions.index(y, x)];
    return composite.finish(pixel, behind, sensitivity, count);
  };
  const std::vector<int> counts = plan_samples(
      directions, settings,
      [&](int x, int y, std::uint32_t index, std::uint32_t seed, int first, int count) {
        const auto rgba = pixel_of(x, y, index, seed, first, count);
        return Vec3f{rgba[0], rgba[1], rgba[2]};
      });
  capture::Image picture = capture::make_image(directions.height, directions.width, 4);
  for_each_pixel(directions, [&](int x, int y, std::uint32_t index) {
    const auto rgba = pixel_of(x, y, index, settings.seed, 0, counts[index]);
    std::copy(rgba.begin(), rgba.end(), &picture.at(y, x));
  });
  return picture;
}

capture::Image photograph(const FrameInputs& inputs,
                          const calibrate::Pose& cam_from_set,
                          const ReferenceSettings& settings) {
  check(inputs, settings);
  const DirectionTable& directions = *inputs.directions;
  PathRules rules;
  rules.max_depth = settings.max_depth;
  rules.diffuse_bounces = rules.sees_background = true;
  rules.scattered_mask = rules.lobe_blockers = rules.diffuse_blockers =
      mask_virtual | mask_stand_in;
  const EnvironmentSampler environment(*inputs.environment);
  const PathTracer tracer(*inputs.scene, environment, {}, rules, inputs.videos);
  const PixelRays rays(directions, cam_from_set);
  const auto pixel_of = [&](int x, int y, std::uint32_t index, std::uint32_t seed, int first,
                            int count) {
    Sum sum;
    for (int i = first; i < first + count; ++i) {
      SampleSequence numbers(seed, index, static_cast<std::uint32_t>(i));
      const auto [dx, dy] = numbers.next_pair();
      const auto direction = rays.direction(x, y, dx - 0.5F, dy - 0.5F);
      if (direction) sum.add(tracer.camera_path(rays.origin(), *direction, numbers).radiance);
    }
    return sum.over(count);
  };
  const std::vector<int> counts = plan_samples(directions, settings, pixel_of);
  capture::Image picture = capture::make_image(directions.height, directions.width, 3);
  for_each_pixel(directions, [&](int x, int y, std::uint32_t index) {
    const Vec3f rgb = pixel_of(x, y, index, settings.seed, 0, counts[index]);
    picture.at(y, x, 0) = rgb.x;
    picture.at(y, x, 1) = rgb.y;
    picture.at(y, x, 2) = rgb.z;
  });
  return picture;
}

}  // namespace render
