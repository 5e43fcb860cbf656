// What all tiles of a frame share.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

#include "capture/parallel_loop.h"
#include "render/caustics.h"
#include "render/kept_transport.h"
#include "render/kernel.h"
#include "render/standard.h"

namespace render {
namespace {

// A hash of many numbers.
class Key {
 public:
  void mix(std::uint64_t value) {
    value_ = (value_ ^ value) * 0xFF51AFD7ED558CCDULL;
    value_ ^= value_ >> 32;
  }
  void mix(double value) { mix(std::bit_cast<std::uint64_t>(value)); }
  void mix(float value) { mix(std::uint64_t{std::bit_cast<std::uint32_t>(value)}); }
  void mix(int value) { mix(static_cast<std::uint64_t>(value)); }
  void mix(Vec3f v) { mix(v.x), mix(v.y), mix(v.z); }
  // In several chains, for each step waits for the one before.
  void mix(std::span<const float> values) {
    constexpr std::size_t chains = 4, step = 2 * chains;
    std::array<Key, chains> parts;
    std::size_t i = 0;
    for (; i + step <= values.size(); i += step) {
      for (std::size_t c = 0; c < chains; ++c) {
        parts[c].mix(std::uint64_t{std::bit_cast<std::uint32_t>(values[i + 2 * c])} << 32 |
                     std::bit_cast<std::uint32_t>(values[i + 2 * c + 1]));
      }
    }
    for (; i < values.size(); ++i) mix(values[i]);
    for (const Key& part : parts) mix(part.value_);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0x9E3779B97F4A7C15ULL;
};

// Many numbers in parts, by all threads: a large picture's directions are more than a frame has
// time for.
void mix_at_once(std::span<const float> values, Key& key) {
  std::array<Key, 16> parts;
  const std::size_t length = values.size() / parts.size() + 1;
  capture::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    const std::size_t first = std::min(i * length, values.size());
    parts[i].mix(values.subspan(first, std::min(length, values.size() - first)));
  });
  for (const Key& part : parts) key.mix(part.value());
}

// Changes whenever the cells' transport may, but for things that move.
std::uint64_t transport_key(const FrameContext& context) {
  Key key;
  const FrameJob& job = *context.job;
  for (const double value : job.cam_from_set.R.m) key.mix(value);
  const calibrate::Vec3& t = job.cam_from_set.t;
  key.mix(t.x), key.mix(t.y), key.mix(t.z);
  mix_at_once(context.inputs.directions->x, key);
  mix_at_once(context.inputs.directions->y, key);
  for (const DirectionalLight& light : context.planned_table->lights) {
    key.mix(light.direction), key.mix(light.irradiance);
    key.mix(light.spread), key.mix(std::uint64_t{light.compact});
  }
  for (const RegionParts& parts : context.planned_table->parts) {
    for (const Vec3f to : parts.directions) key.mix(to);
  }
  for (const LocalLight& lamp : context.planned_table->lamps) {
    key.mix(lamp.position), key.mix(lamp.normal), key.mix(lamp.intensity);
    key.mix(lamp.area_m2), key.mix(std::uint64_t{lamp.ambient});
    key.mix(std::uint64_t{lamp.instance} << 32 | lamp.material);
  }
  for (const capture::Image* level : context.planned_levels) key.mix(level->height);
  key.mix(context.planned->radiance.pixels);
  key.mix(std::uint64_t{context.planned->compact_apart});
  if (context.lens) {
    for (const double parameter : context.lens->parameters) key.mix(parameter);
  }
  for (const VideoTexture* video : context.inputs.videos) {
    key.mix(video->width()), key.mix(video->height());
  }
  const Effort& e = job.effort;
  key.mix(e.aa_samples), key.mix(e.aa_tolerance), key.mix(e.glint_contrast);
  key.mix(e.interleave), key.mix(std::uint64_t{e.adaptive_visibility});
  key.mix(std::uint64_t{e.soft_lights});
  key.mix(std::uint64_t{e.cull_lights}), key.mix(e.accuracy), key.mix(e.max_depth);
  key.mix(e.max_rays);
  key.mix(std::uint64_t{e.chance_cuts}), key.mix(std::uint64_t{e.dark_cuts});
  key.mix(e.caustic_photons);
  if (context.caustics) {
    for (const std::uint32_t light : context.caustics->photons().lights()) {
      key.mix(std::uint64_t{light});
    }
  }
  return key.value();
}

// Changes whenever a kept cell may be lit differently, but for live textures and the plate. At a
// glance: the table and the smallest level, which follow live light.
DataKey light_key(const FrameContext& context, const DataKey& before) {
  Key key;
  for (const DirectionalLight& light : context.job->lights.lights) {
    key.mix(light.direction), key.mix(light.irradiance);
  }
  for (const LocalLight& lamp : context.job->lights.lamps) key.mix(lamp.intensity);
  const auto levels = std::span(context.levels).first(context.first_plate_level);
  key.mix((*std::ranges::min_element(levels, {}, &capture::Image::height))->pixels);
  const std::uint64_t glance = key.value();
  if (glance != before.glance) return {glance, glance};
  for (const capture::Image* level : levels) key.mix(level->pixels);
  key.mix(context.inputs.directions->sensitivity);
  return {glance, key.value()};
}

DataKey plate_levels_key(const FrameContext& context, const DataKey& before) {
  if (!context.plate_levels) return {};
  constexpr int glanced = 4;  // of levels: some thousands of pixels
  Key key;
  const std::vector<capture::Image>& levels = context.plate_levels->all();
  key.mix(levels[std::min<std::size_t>(glanced, levels.size() - 1)].pixels);
  const std::uint64_t glance = key.value();
  if (glance != before.glance)
    return {glance, 0};  // not known: levels that are alike at a glance may differ
  key.mix(levels.front().pixels);
  return {glance, key.value()};
}

FrameKeys keys_of(const FrameContext& context, const KeptTransport& kept) {
  const FrameKeys& before = kept.keys();
  FrameKeys keys{transport_key(context), light_key(context, before.light), {}};
  const bool light_stays = keys.light.all == before.light.all;
  if (light_stays && kept.bends_plate()) {
    keys.plate_levels = plate_levels_key(context, before.plate_levels);
  }
  return keys;
}

// Whether places in one are places in the other. Levels are twice as wide as high (check_levels).
bool alike(const Environment& a, const Environment& b) {
  const auto same_sizes = [](const auto& x, const auto& y) {
    return std::ranges::equal(x, y, {}, &capture::Image::height, &capture::Image::height);
  };
  return a.radiance.height == b.radiance.height && same_sizes(a.smoothed, b.smoothed) &&
         same_sizes(a.halved, b.halved) && same_sizes(a.diffused, b.diffused) &&
         a.compact_apart == b.compact_apart;
}

// The levels of the scene's live textures, and how bright they may be.
void add_videos(FrameContext& context) {
  const SceneDescription& scene = context.inputs.scene->description();
  const auto& videos = context.inputs.videos;
  if (videos.size() != scene.videos.size()) {
    throw std::invalid_argument("the scene has " + std::to_string(scene.videos.size()) +
                                " live textures, but the frame has " +
                                std::to_string(videos.size()));
  }
  for (const VideoTexture* video : videos) {
    if (video == nullptr || video->levels.empty()) {
      throw std::invalid_argument("a live texture has no frame");
    }
    context.first_video_levels.push_back(context.levels.size());
    for (const capture::Image& level : video->levels) context.levels.push_back(&level);
  }
  if (videos.empty()) return;
  for (const Material& material : scene.materials) {
    if (material.shader != "standard") continue;
    const StandardParameters p =
        standard_parameters(material, scene.textures.size(), scene.videos.size());
    if (p.emission_video < 0) continue;
    const float strongest = std::max({p.emission[0], p.emission[1], p.emission[2]});
    context.brightest_video = std::max(context.brightest_video, strongest * p.emission_gain);
  }
}

// Light through clear bodies, as lamps that follow the job's.
void add_caustics(FrameContext& context, LightTable& planned) {
  const FrameInputs& inputs = context.inputs;
  const Effort& effort = context.job->effort;
  CausticFollower alone;
  CausticFollower& follower = inputs.kept ? inputs.kept->caustics() : alone;
  context.caustics =
      follower.follow(*inputs.scene, planned, {effort.caustic_photons, effort.accuracy},
                      {context.camera, context.pixel_angle});
  context.lamps = context.job->lights.lamps;
  if (!context.caustics) return;
  for (const std::uint32_t light : context.caustics->photons().lights()) {
    LocalLight lamp;
    lamp.intensity = planned.lights[light].irradiance;
    planned.lamps.push_back(lamp);
    lamp.intensity = context.job->lights.lights[light].irradiance;
    context.lamps.push_back(lamp);
  }
}

std::array<Effort, refinement_stages> efforts_of(const Effort& effort) {
  std::array<Effort, refinement_stages> efforts;
  for (int stage = 0; stage < refinement_stages; ++stage) {
    efforts[static_cast<std::size_t>(stage)] = effort_of_stage(effort, stage);
  }
  return efforts;
}

void check_effort(const Effort& e) {
  if (e.aa_samples < 1 || e.aa_samples > samples_max) {
    throw std::invalid_argument("aa_samples must be 1 to " + std::to_string(samples_max));
  }
  if (e.interleave != 1 && e.interleave != 2 && e.interleave != 4) {
    throw std::invalid_argument("interleave must be 1, 2 or 4");
  }
  const auto is_radiance = [](float v) { return std::isfinite(v) && v >= 0; };
  if (!is_radiance(e.aa_tolerance) || !is_radiance(e.glint_contrast)) {
    throw std::invalid_argument("aa_tolerance and glint_contrast must be finite, and 0 or more");
  }
  if (!(e.accuracy >= 0 && e.accuracy <= 1)) throw std::invalid_argument("accuracy must be 0 to 1");
  if (e.max_depth < 0 || e.max_depth > 64) throw std::invalid_argument("max_depth must be 0 to 64");
  if (e.max_rays < 0) throw std::invalid_argument("max_rays must be 0 or more");
  if (e.caustic_photons < 0 || e.caustic_photons > most_caustic_photons) {
    throw std::invalid_argument("caustic_photons must be 0 to " +
                                std::to_string(most_caustic_photons));
  }
  if (e.tile_size < cell_size || e.tile_size % cell_size != 0) {
    throw std::invalid_argument("tile_size must be a multiple of 16");
  }
}

void check_table(const LightTable& table) {
  if (table.lights.size() > most_lights) {
    throw std::invalid_argument("a table holds at most " + std::to_string(most_lights) + " lights");
  }
  std::size_t compact = 0;
  for (const DirectionalLight& light : table.lights) {
    if (!is_finite(light.direction) || !is_finite(light.irradiance) || !is_finite(light.planned)) {
      throw std::invalid_argument("a light of the table is not finite");
    }
    compact += light.compact != 0 ? 1 : 0;
  }
  if (compact > most_compact_lights) {
    throw std::invalid_argument("a table marks at most " + std::to_string(most_compact_lights) +
                                " lights as compact");
  }
  if (table.parts.size() > table.lights.size()) {
    throw std::invalid_argument("a table has parts of more lights than it holds");
  }
  for (const RegionParts& parts : table.parts) {
    if (!std::ranges::all_of(parts.directions, [](Vec3f v) { return is_finite(v); })) {
      throw std::invalid_argument("a part of a light of the table is not finite");
    }
  }
  if (table.lamps.size() > most_lights) {
    throw std::invalid_argument("a table holds at most " + std::to_string(most_lights) + " lamps");
  }
  for (const LocalLight& lamp : table.lamps) {
    if (!is_finite(lamp.position) || !is_finite(lamp.normal) || !is_finite(lamp.intensity) ||
        !is_finite(lamp.planned) || !(lamp.area_m2 >= 0) || !std::isfinite(lamp.area_m2)) {
      throw std::invalid_argument("a lamp is not finite");
    }
  }
}

// Throws std::invalid_argument for what no frame can be rendered with.
void check_frame(const FrameInputs& inputs, const FrameJob& job) {
  if (!inputs.scene || !inputs.directions || !inputs.environment) {
    throw std::invalid_argument("a frame needs a scene, a lens and an environment");
  }
  check_effort(job.effort);
  check_table(job.lights);
  check_levels(*inputs.environment);
  if (inputs.planned) check_levels(*inputs.planned);
  if (!is_finite(calibrate::to_float(calibrate::position_of(job.cam_from_set)))) {
    throw std::invalid_argument("the camera's pose is not finite");
  }
}

// The table with its planned intensities, where it has any.
LightTable as_planned(const LightTable& table) {
  LightTable planned = table;
  for (DirectionalLight& light : planned.lights) {
    if (light.planned != Vec3f{}) light.irradiance = light.planned;
  }
  for (LocalLight& lamp : planned.lamps) {
    if (lamp.planned != Vec3f{}) lamp.intensity = lamp.planned;
  }
  return planned;
}

// What rays look up: the environment, as planned and as it is, the plate behind clear bodies, the
// live textures.
void add_levels(FrameContext& context) {
  const FrameInputs& inputs = context.inputs;
  context.planned = inputs.planned && alike(*inputs.planned, *inputs.environment)
                        ? inputs.planned
                        : inputs.environment;
  context.planned_levels = levels_of(*context.planned);
  context.first_plate_level = context.planned_levels.size();
  context.levels = levels_of(*inputs.environment);
  const auto bordered =
      inputs.kept ? inputs.kept->bordered_levels() : std::make_shared<BorderedLevels>();
  bordered->begin(context.levels);
  context.bordered = bordered;
  const bool bends = inputs.scene->has_glass() || inputs.scene->has_mirrored();
  if (bends && inputs.plate != nullptr && inputs.lens != nullptr) {
    const auto plate = inputs.kept ? inputs.kept->plate_levels() : std::make_shared<PlateLevels>();
    plate->fill(*inputs.plate, *inputs.directions);
    context.plate_levels = plate;
    context.lens = *inputs.lens;
    for (const capture::Image& level : plate->all()) context.levels.push_back(&level);
  }
  add_videos(context);
}

void add_camera(FrameContext& context) {
  const calibrate::Pose& cam_from_set = context.job->cam_from_set;
  const calibrate::DirectionTable& d = *context.inputs.directions;
  context.turn = CameraTurn(cam_from_set.R);
  context.camera = calibrate::to_float(calibrate::position_of(cam_from_set));
  const std::size_t a = d.index(d.height / 2, d.width / 2),
                    b = d.index(d.height / 2, d.width / 2 + 1);
  context.pixel_angle =
      std::clamp(length(Vec3f{d.x[a] - d.x[b], d.y[a] - d.y[b], d.z[a] - d.z[b]}), 1e-6F, 1.0F);
  context.small_lights = find_small_lights(context.inputs.scene->glowing_parts(), context.camera,
                                           context.turn, context.pixel_angle);
  context.columns = (d.width + cell_size - 1) / cell_size;
  context.rows = (d.height + cell_size - 1) / cell_size;
}

void add_pictures(FrameContext& context) {
  const Scene& scene = *context.inputs.scene;
  const std::vector<Instance>& instances = scene.description().instances;
  std::size_t moving = 0;
  for (std::uint32_t i = 0; i < instances.size(); ++i) {
    if (!instances[i].moves) continue;
    const Scene::Bounds& bounds = scene.places().bounds[moving++];
    if (!scene.shows_apart(i)) continue;
    const auto own = std::ranges::find(scene.prepared(), i, &PreparedSurface::instance);
    const StandingPicture* picture =
        own != scene.prepared().end() ? own->prepared->picture() : nullptr;
    if (picture && !picture->shows_nothing()) context.pictures.push_back({bounds, picture});
  }
}

}  // namespace

CellCone cone_of_cell(const FrameContext& context, int x0, int y0) {
  const KeptTransport* kept = context.inputs.kept;
  return kept && !kept->cones().empty()
             ? kept->cones()[context.cell_at(x0 / cell_size, y0 / cell_size)]
             : cell_cone(*context.inputs.directions, context.turn, x0, y0);
}

FrameContext make_frame_context(const FrameInputs& inputs, const FrameJob& job) {
  check_frame(inputs, job);
  FrameContext context;
  context.inputs = inputs;
  context.job = &job;
  add_levels(context);
  for (std::size_t i = 0; i < job.lights.lights.size(); ++i) {
    const DirectionalLight& light = job.lights.lights[i];
    context.irradiances.push_back(four_of(light.irradiance));
    if (light.compact != 0 && context.planned->compact_apart) {
      context.compact.push_back(static_cast<std::uint32_t>(i));
    }
  }
  context.pattern = &sample_pattern();
  add_camera(context);
  auto planned_table = std::make_shared<LightTable>(as_planned(job.lights));
  add_caustics(context, *planned_table);
  // Pictures cast no shadows on caustics, nor gather any: those are looked for with them.
  if (!context.caustics) {
    const Scene::Places& places = inputs.scene->places();
    const bool given = inputs.stalls && inputs.stalls->hold(places);
    context.stalls = given ? *inputs.stalls : PictureStalls(places);
    add_pictures(context);
  }
  context.light_rows = LightRows(planned_table->lights);
  context.soft_lights = SoftLights(*planned_table, job.effort.soft_lights);
  context.planned_table = std::move(planned_table);
  context.efforts = efforts_of(job.effort);
  check_stages(context);
  if (inputs.kept) inputs.kept->begin_frame(keys_of(context, *inputs.kept), context);
  return context;
}

void check_stages(const FrameContext& context) {
  const std::vector<std::uint8_t>& stages = context.job->stages;
  const std::size_t cells = context.cell_at(0, context.rows);
  if (!stages.empty() && stages.size() != cells) {
    throw std::invalid_argument("a frame of " + std::to_string(cells) + " cells has stages for " +
                                std::to_string(stages.size()));
  }
  if (std::ranges::any_of(stages, [](std::uint8_t s) { return s >= refinement_stages; })) {
    throw std::invalid_argument("a cell's stage must be 0 to " + std::to_string(finer_stage));
  }
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

void size_result(const Rect& rect, TileResult& result, bool count_rays) {
  const auto pixels = static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
  result.rect = rect;
  result.rgba.resize(pixels * 4);
  result.matte.resize(pixels);
  result.rays.resize(count_rays ? pixels : 0);
  result.statistics = {};
}

}  // namespace render
