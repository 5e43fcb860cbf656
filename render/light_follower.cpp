// The table of lights from frame to frame, without flicker.
#include "render/light_follower.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "render/lobe_filter.h"
#include "render/region_parts.h"

namespace render {
namespace {

// Lights with less of the energy than this may jump without being called changed: they are noise.
constexpr double least_share = 0.005;

// Light that has grown or shrunk by more than this is planned for anew.
constexpr double most_change = 1.5;

// Share of the light that may go from some regions to others before they are cut anew, and frames
// that light is calm, or another, before a change is taken for one that stays.
constexpr double most_shifted = 0.3;
constexpr int settled_frames = 12;

Vec3f to_float(const std::array<double, 3>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

double luminance_of(const std::array<double, 3>& irradiance) {
  return .2126 * irradiance[0] + .7152 * irradiance[1] + .0722 * irradiance[2];
}

// Whether a channel has changed by more than a part of itself, or of the luminance where that is
// more: a lamp's least channel may be all noise.
bool differs(const std::array<double, 3>& now,
             const std::array<double, 3>& before,
             double part,
             double least) {
  const double base = std::max(luminance_of(before), least);
  for (std::size_t c = 0; c < 3; ++c) {
    if (std::abs(now[c] - before[c]) > part * std::max(before[c], base)) return true;
  }
  return false;
}

double total_luminance(const std::vector<RegionLight>& sums) {
  double total = 0;
  for (const RegionLight& sum : sums) total += sum.luminance;
  return total;
}

}  // namespace

LightTable LightFollower::follow(const Environment& env, const LightFollowerSettings& settings) {
  check(settings.table);
  check(env);
  area_average(env.radiance, std::min(env.radiance.height, light_map_height), map_);
  LightTable table;
  table.unseen_share = env.unseen_share;
  std::vector<RegionLight> sums;
  if (regions_.height == map_.height && made_height_ == env.radiance.height &&
      made_with_ == settings.table) {
    sums = sum_regions(regions_, map_, env.radiance);
  }
  if (sums.empty()) calm_frames_ = settled_frames;
  if (sums.empty() || (total_luminance(sums) > 0 &&
                       (has_shifted(sums) || has_moved(sums, settings.tolerance_rad)))) {
    sums = make_anew(env, settings.table);
  }
  if (!(total_luminance(sums) > 0)) {
    table.version = version_;
    return table;
  }
  take_energies(sums, settings);
  plan();
  table.version = version_;
  for (const Followed& followed : lights_) {
    DirectionalLight light = followed.light;
    light.irradiance = to_float(followed.irradiance);
    table.lights.push_back(light);
  }
  table.parts = parts_;
  table.error_estimate = estimate_light_error(table.lights, env.radiance.height);
  return table;
}

std::vector<RegionLight> LightFollower::make_anew(const Environment& env,
                                                  const LightTableSettings& settings) {
  regions_ = cut_light_regions(map_, settings);
  made_with_ = settings;
  made_height_ = env.radiance.height;
  lights_.clear();
  std::vector<RegionLight> sums = sum_regions(regions_, map_, env.radiance);
  for (const RegionLight& sum : sums)
    lights_.push_back(
        {.light = make_light(sum), .irradiance = sum.irradiance, .newest = sum.luminance});
  std::vector<DirectionalLight> lights;
  for (const Followed& followed : lights_) lights.push_back(followed.light);
  parts_ = part_regions(regions_, map_, lights);
  const double total = total_luminance(sums);
  cut_shares_.clear();
  for (const RegionLight& sum : sums) cut_shares_.push_back(total > 0 ? sum.luminance / total : 0);
  shifted_frames_ = 0;
  averaged_frames_ = 0;
  ++version_;
  mark_compact();
  return sums;
}

// Whether so much of the light went from some regions to others that it would be cut otherwise, and
// stays there for all that is known.
bool LightFollower::has_shifted(const std::vector<RegionLight>& sums) {
  const double total = total_luminance(sums);
  double shifted = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    shifted += std::abs(sums[i].luminance / total - cut_shares_[i]) / 2;
  }
  if (!(shifted > most_shifted)) {
    ++calm_frames_;
    shifted_frames_ = 0;
    return false;
  }
  const bool was_calm = calm_frames_ >= settled_frames;
  calm_frames_ = 0;
  return was_calm || ++shifted_frames_ >= settled_frames;
}

// Decisions were taken for another light than this: they are taken anew.
void LightFollower::plan() {
  double planned = 0, now = 0;
  for (const Followed& followed : lights_) {
    const Vec3f e = followed.light.planned;
    planned += luminance_of({e.x, e.y, e.z});
    now += luminance_of(followed.irradiance);
  }
  if (now < planned * most_change && planned < now * most_change) return;
  for (Followed& followed : lights_) followed.light.planned = to_float(followed.irradiance);
  ++version_;
}

void LightFollower::mark_compact() {
  compact_ = {};
  std::vector<std::size_t> bright;
  for (std::size_t i = 0; i < lights_.size(); ++i) {
    if (regions_.bright[i] != 0) bright.push_back(i);
  }
  std::ranges::sort(bright, std::greater(), [this](std::size_t i) {
    return std::pair(luminance_of(lights_[i].irradiance), i);
  });
  bright.resize(std::min(bright.size(), most_compact_lights));
  if (bright.empty() || made_height_ % regions_.height != 0) return;
  for (const std::size_t i : bright) lights_[i].light.compact = 1;
  compact_.height = regions_.height;
  compact_.is_compact.reserve(regions_.light.size());
  for (const std::size_t i : regions_.light) {
    compact_.is_compact.push_back(static_cast<std::uint8_t>(lights_[i].light.compact));
  }
}

bool LightFollower::has_moved(const std::vector<RegionLight>& sums, float tolerance_rad) const {
  double moved = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (!(sums[i].luminance > 0)) continue;
    const Vec3f now = make_light(sums[i]).direction;
    const Vec3f frozen = lights_[i].light.direction;
    moved += sums[i].luminance * std::atan2(length(cross(now, frozen)), dot(now, frozen));
  }
  return moved > tolerance_rad * total_luminance(sums);
}

// An average lags behind light that drifts. Noise misses it to both sides, and makes neighbouring
// frames differ; a drift misses it to one side. Near 1 where all of a miss is drift, 0 or less
// where it may be noise.
double LightFollower::gain_of_drift(Followed& followed, double now) {
  constexpr double memory = 0.25;  // of misses
  constexpr double doubt = 1.5;    // of chance: noise alone rarely passes it
  const double step = now - followed.newest;
  followed.newest = now;
  followed.miss += memory * (now - luminance_of(followed.irradiance) - followed.miss);
  followed.variance += memory / 4 * (step * step / 2 - followed.variance);
  const double drift = followed.miss * followed.miss;
  const double noise = followed.variance;
  return drift > 0 ? (drift - doubt * noise) / (drift + noise) : 0;
}

void LightFollower::take_energies(const std::vector<RegionLight>& sums,
                                  const LightFollowerSettings& settings) {
  const double least_gain = 1 / std::max(settings.smoothing_frames, 1.0F);
  std::array<double, 3> total{}, averaged_total{};
  for (std::size_t i = 0; i < sums.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      total[c] += sums[i].irradiance[c];
      averaged_total[c] += lights_[i].irradiance[c];
    }
  }
  bool changed = differs(total, averaged_total, settings.sudden_change / 2, 0);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    changed = changed || differs(sums[i].irradiance, lights_[i].irradiance, settings.sudden_change,
                                 least_share * luminance_of(total));
  }
  // All at once: light that went from one region to another must not count in both for a while.
  if (changed) averaged_frames_ = 0;
  // A plain mean at first, then an exponential one.
  const double gain = std::max(1.0 / (averaged_frames_ + 1), least_gain);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    Followed& followed = lights_[i];
    if (changed) followed.miss = followed.variance = 0, followed.newest = sums[i].luminance;
    const double own_gain = std::max(gain, gain_of_drift(followed, sums[i].luminance));
    for (std::size_t c = 0; c < 3; ++c) {
      followed.irradiance[c] += own_gain * (sums[i].irradiance[c] - followed.irradiance[c]);
    }
  }
  ++averaged_frames_;
}

}  // namespace render
