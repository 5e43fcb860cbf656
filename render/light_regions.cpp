// A map of light cut into regions, one for each light of a table.
#include "render/light_regions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <queue>

#include "render/lobe_filter.h"

namespace render {
namespace {

using std::numbers::pi;

// Texels this many times as bright as the mean of the map belong to bright sources, ...
constexpr double bright_over_mean = 16;
// ... as long as these cover no more than this share of the sphere; else the limit is doubled.
constexpr double largest_bright_share = 0.04;

// The RMS error of surfaces behind occluders with one straight edge, over the sum that
// estimate_light_error() makes: 0.14 to 0.25, measured under a sky of radiance about 1 with suns of
// 0.1 to 20 degrees radius and irradiance 0.3 to 20, for 8 to 1024 lights.
constexpr double error_of_edges = 0.25;
// Lights of very wide regions (fewer than about eight in all) err even without shadows.
constexpr double error_of_size = 2;
// Half a disc over the horizon, in terms of the whole disc's irradiance and radius; and how much it
// counts, beside edges.
constexpr double irradiance_of_rim = 0.2;
constexpr double error_of_rim = 4;
// More irradiance than this looks the same: a surface of albedo 1/2 is then four times as bright as
// display white, where errors of pictures are cut off as well.
constexpr double irradiance_that_shows = 4 * pi / 0.5;

// Energy and first moment: luminance times (1, direction).
struct Moments {
  double energy = 0, x = 0, y = 0, z = 0;

  friend Moments operator+(const Moments& a, const Moments& b) {
    return {a.energy + b.energy, a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend Moments operator-(const Moments& a, const Moments& b) {
    return {a.energy - b.energy, a.x - b.x, a.y - b.y, a.z - b.z};
  }
  // Energy times the mean square chord from the centroid.
  double spread() const {
    if (!(energy > 0)) return 0;
    return std::max(energy - (x * x + y * y + z * z) / energy, 0.0);
  }
};

// Directions of the texels of a map, by row and column.
class TexelGrid {
 public:
  explicit TexelGrid(int height)
      : height_(height),
        sine_(size(height)),
        cosine_(size(height)),
        solid_angle_(size(height)),
        azimuth_cosine_(size(2 * height)),
        azimuth_sine_(size(2 * height)) {
    for (int y = 0; y < height; ++y) {
      const double polar = (y + 0.5) / height * pi;
      sine_[size(y)] = std::sin(polar);
      cosine_[size(y)] = std::cos(polar);
      solid_angle_[size(y)] = texel_solid_angle(y, 2 * height, height);
    }
    for (int x = 0; x < 2 * height; ++x) {
      const double azimuth = (0.5 - (x + 0.5) / (2 * height)) * 2 * pi;
      azimuth_cosine_[size(x)] = std::cos(azimuth);
      azimuth_sine_[size(x)] = std::sin(azimuth);
    }
  }

  int height() const { return height_; }
  int width() const { return 2 * height_; }
  double solid_angle(int row) const { return solid_angle_[size(row)]; }
  double sine(int row) const { return sine_[size(row)]; }
  Moments moments(int row, int column, double energy) const {
    const double across = energy * sine_[size(row)];
    return {energy, across * azimuth_cosine_[size(column)], across * azimuth_sine_[size(column)],
            energy * cosine_[size(row)]};
  }

 private:
  static std::size_t size(int i) { return static_cast<std::size_t>(i); }

  int height_;
  std::vector<double> sine_, cosine_, solid_angle_, azimuth_cosine_, azimuth_sine_;
};

// Texels x0 <= x < x1, y0 <= y < y1 of one layer: the bright sources, or the rest.
struct Region {
  int x0, x1, y0, y1;
  std::size_t layer;
  Moments moments;
  double priority;  // the region of highest priority is cut first
};

// A layer of the map as a summed-area table (Crow, "Summed-Area Tables for Texture Mapping",
// SIGGRAPH 1984).
class LightLayer {
 public:
  LightLayer(const TexelGrid& grid, const std::vector<double>& energy)
      : width_(static_cast<std::size_t>(grid.width()) + 1),
        table_(width_ * (static_cast<std::size_t>(grid.height()) + 1)) {
    for (int y = 0; y < grid.height(); ++y) {
      Moments row;
      for (int x = 0; x < grid.width(); ++x) {
        const std::size_t texel =
            static_cast<std::size_t>(y) * (width_ - 1) + static_cast<std::size_t>(x);
        row = row + grid.moments(y, x, energy[texel]);
        table_[at(x + 1, y + 1)] = table_[at(x + 1, y)] + row;
      }
    }
  }

  Moments sum(int x0, int x1, int y0, int y1) const {
    return table_[at(x1, y1)] - table_[at(x0, y1)] - table_[at(x1, y0)] + table_[at(x0, y0)];
  }

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x);
  }
  std::size_t width_;
  std::vector<Moments> table_;
};

struct Cut {
  Region first, second;
};

// Cuts regions in two, by a method.
class Cutter {
 public:
  Cutter(const TexelGrid& grid, std::vector<LightLayer> layers, LightMethod method)
      : grid_(grid), layers_(std::move(layers)), method_(method) {}

  Region whole(std::size_t layer) const {
    return region(0, grid_.width(), 0, grid_.height(), layer);
  }

  // Both parts hold light; nothing if there is no such cut.
  std::optional<Cut> cut(const Region& r) const {
    if (method_ == LightMethod::split) return best_cut(r, {true, true}, sum_of_spreads);
    const bool wide = (r.x1 - r.x0) * grid_.sine((r.y0 + r.y1) / 2) > r.y1 - r.y0;
    const auto along = best_cut(r, {wide, !wide}, imbalance);
    return along ? along : best_cut(r, {!wide, wide}, imbalance);
  }

 private:
  // Which ways a region may be cut.
  struct Ways {
    bool between_columns, between_rows;
  };

  static double sum_of_spreads(const Moments& a, const Moments& b) {
    return a.spread() + b.spread();
  }
  static double imbalance(const Moments& a, const Moments& b) {
    return std::abs(a.energy - b.energy);
  }

  Region region(int x0, int x1, int y0, int y1, std::size_t layer) const {
    Region r{x0, x1, y0, y1, layer, layers_[layer].sum(x0, x1, y0, y1), 0};
    const double energy = r.moments.energy;
    r.priority = energy;
    if (method_ == LightMethod::split && energy > 0) {
      // The edge of a shadow that runs through the region errs by a part of its energy, and the
      // wider the region, the more edges do.
      r.priority = energy * energy * std::sqrt(r.moments.spread() / energy);
    }
    return r;
  }

  template <class Score>
  std::optional<Cut> best_cut(const Region& r, Ways ways, Score score) const {
    // Differences of sums leave a little even where all is black.
    const double least_energy = r.moments.energy * 1e-9;
    double least = std::numeric_limits<double>::infinity();
    std::optional<Cut> best;
    const auto try_cut = [&](int x, int y) {
      const Moments before = layers_[r.layer].sum(r.x0, x, r.y0, y);
      const Moments after = r.moments - before;
      if (!(before.energy > least_energy && after.energy > least_energy)) return;
      const double s = score(before, after);
      if (s >= least) return;
      least = s;
      best = Cut{};
      best->first = {r.x0, x, r.y0, y, r.layer, {}, 0};
      best->second = {x < r.x1 ? x : r.x0, r.x1, y < r.y1 ? y : r.y0, r.y1, r.layer, {}, 0};
    };
    if (ways.between_columns) {
      for (int x = r.x0 + 1; x < r.x1; ++x) try_cut(x, r.y1);
    }
    if (ways.between_rows) {
      for (int y = r.y0 + 1; y < r.y1; ++y) try_cut(r.x1, y);
    }
    if (best) {
      for (Region* part : {&best->first, &best->second}) {
        *part = region(part->x0, part->x1, part->y0, part->y1, part->layer);
      }
    }
    return best;
  }

  const TexelGrid& grid_;
  std::vector<LightLayer> layers_;
  LightMethod method_;
};

// Cuts layers into at most `count` regions, the most important one first.
std::vector<Region> cut_layers(const Cutter& cutter, std::size_t count) {
  const auto comes_later = [](const Region& a, const Region& b) { return a.priority < b.priority; };
  std::priority_queue<Region, std::vector<Region>, decltype(comes_later)> open(comes_later);
  std::vector<Region> done;
  for (std::size_t layer = 0; layer < 2; ++layer) {
    const Region whole = cutter.whole(layer);
    if (whole.moments.energy > 0) open.push(whole);
  }
  while (!open.empty() && done.size() + open.size() < count) {
    const Region r = open.top();
    open.pop();
    if (const auto cut = cutter.cut(r)) {
      open.push(cut->first);
      open.push(cut->second);
    } else {
      done.push_back(r);
    }
  }
  for (; !open.empty(); open.pop()) done.push_back(open.top());
  return done;
}

std::vector<double> texel_energies(const capture::Image& map, const TexelGrid& grid) {
  std::vector<double> energy(map.pixels.size() / 3);
  for (std::size_t i = 0; i < energy.size(); ++i) {
    const float* p = &map.pixels[3 * i];
    energy[i] = static_cast<double>(luminance(p[0], p[1], p[2])) *
                grid.solid_angle(static_cast<int>(i) / grid.width());
  }
  return energy;
}

// Marks texels of bright compact sources.
std::vector<std::uint8_t> find_bright(const capture::Image& map,
                                      const TexelGrid& grid,
                                      double total_energy) {
  std::vector<std::uint8_t> bright(map.pixels.size() / 3);
  for (double limit = bright_over_mean * total_energy / (4 * pi);; limit *= 2) {
    double solid_angle = 0;
    for (std::size_t i = 0; i < bright.size(); ++i) {
      const float* p = &map.pixels[3 * i];
      bright[i] = luminance(p[0], p[1], p[2]) > limit;
      if (bright[i] != 0) solid_angle += grid.solid_angle(static_cast<int>(i) / grid.width());
    }
    if (solid_angle <= largest_bright_share * 4 * pi) return bright;
  }
}

}  // namespace

capture::Image light_map(const Environment& env) {
  return area_averaged(env.radiance, std::min(env.radiance.height, light_map_height));
}

LightRegions cut_light_regions(const capture::Image& map, const LightTableSettings& settings) {
  const TexelGrid grid(map.height);
  LightRegions result;
  result.height = map.height;
  std::vector<double> energy = texel_energies(map, grid);
  result.light.assign(energy.size(), 0);
  double total = 0;
  for (const double e : energy) total += e;
  if (!(total > 0)) return result;

  std::vector<std::uint8_t> bright(energy.size());
  std::vector<double> bright_energy(energy.size());
  if (settings.method == LightMethod::split && settings.count > 1) {
    bright = find_bright(map, grid, total);
    for (std::size_t i = 0; i < energy.size(); ++i) {
      if (bright[i] != 0) std::swap(energy[i], bright_energy[i]);
    }
  }
  const Cutter cutter(grid, {LightLayer(grid, energy), LightLayer(grid, bright_energy)},
                      settings.method);
  const auto count = static_cast<std::size_t>(settings.count);
  const std::vector<Region> regions = cut_layers(cutter, count);
  result.count = regions.size();
  for (std::size_t light = 0; light < regions.size(); ++light) {
    const Region& r = regions[light];
    result.bright.push_back(r.layer == 1);
    for (int y = r.y0; y < r.y1; ++y) {
      for (int x = r.x0; x < r.x1; ++x) {
        const std::size_t i = static_cast<std::size_t>(y * grid.width() + x);
        if ((bright[i] != 0) == (r.layer == 1)) result.light[i] = static_cast<std::uint16_t>(light);
      }
    }
  }
  return result;
}

std::vector<RegionLight> sum_regions(const LightRegions& regions, const capture::Image& map) {
  const TexelGrid grid(regions.height);
  std::vector<RegionLight> sums(regions.count);
  if (sums.empty()) return sums;
  std::size_t i = 0;
  for (int y = 0; y < grid.height(); ++y) {
    const double solid_angle = grid.solid_angle(y);
    for (int x = 0; x < grid.width(); ++x, ++i) {
      const float* p = &map.pixels[3 * i];
      RegionLight& sum = sums[regions.light[i]];
      const Moments m = grid.moments(y, x, luminance(p[0], p[1], p[2]) * solid_angle);
      for (std::size_t c = 0; c < 3; ++c) sum.irradiance[c] += p[c] * solid_angle;
      sum.luminance += m.energy;
      sum.moment[0] += m.x;
      sum.moment[1] += m.y;
      sum.moment[2] += m.z;
    }
  }
  return sums;
}

std::vector<RegionLight> sum_regions(const LightRegions& regions,
                                     const capture::Image& map,
                                     const capture::Image& finer) {
  std::vector<RegionLight> sums = sum_regions(regions, map);
  if (sums.empty() || finer.height <= regions.height) return sums;
  const TexelGrid grid(finer.height);
  std::vector<Moments> moments(sums.size());
  const int width = 2 * regions.height;
  const auto first_covering = [&](int coarse) {
    return static_cast<int>(
        std::ceil(static_cast<double>(coarse) * finer.height / regions.height - 0.5));
  };
  for (std::size_t i = 0; i < regions.light.size(); ++i) {
    const std::size_t light = regions.light[i];
    if (regions.bright[light] == 0) continue;
    const int row = static_cast<int>(i) / width;
    const int column = static_cast<int>(i) % width;
    for (int y = first_covering(row); y < first_covering(row + 1); ++y) {
      for (int x = first_covering(column); x < first_covering(column + 1); ++x) {
        const float* p = &finer.pixels[finer.index(y, x)];
        const double energy =
            luminance(counted_radiance(p[0]), counted_radiance(p[1]), counted_radiance(p[2])) *
            grid.solid_angle(y);
        moments[light] = moments[light] + grid.moments(y, x, energy);
      }
    }
  }
  for (std::size_t light = 0; light < sums.size(); ++light) {
    const Moments& m = moments[light];
    if (!(m.energy > 0)) continue;
    const double scale = sums[light].luminance / m.energy;
    sums[light].moment = {m.x * scale, m.y * scale, m.z * scale};
  }
  return sums;
}

DirectionalLight make_light(const RegionLight& region) {
  const auto& [irradiance, energy, moment] = region;
  const calibrate::Vec3 m{moment[0], moment[1], moment[2]};
  const double l = length(m);
  DirectionalLight light{};
  light.direction = l > 0 ? to_float(m / l) : Vec3f{0, 0, 1};
  light.irradiance = {static_cast<float>(irradiance[0]), static_cast<float>(irradiance[1]),
                      static_cast<float>(irradiance[2])};
  light.planned = light.irradiance;
  // A disc of radius r spreads r / sqrt(2) about its middle.
  if (energy > 0) {
    light.spread = static_cast<float>(std::sqrt(2 * std::max(1 - l * l / (energy * energy), 0.0)));
  }
  return light;
}

namespace {

// Squared error of surfaces behind edges that a light makes which stands for a source of irradiance
// e, in terms of e^2 / 12: where the truth is a ramp, min(e t, limit) over 0 < t < 1, the light
// makes a step in its middle. A source far beyond the limit shows nearly all of its penumbra fully
// lit, so that half of it is wrong by all of the limit.
double squared_error_of_edge(double e, double limit) {
  const double s = limit / e;
  if (s >= 1) return e * e;
  const double dark_half = s < 0.5 ? s * s / 2 - 2 * s * s * s / 3 : 1.0 / 24;
  const double bright_half = s < 0.5 ? 0 : (s - 0.5) * (s - 0.5) * (s - 0.5) / 3;
  return 12 * e * e * (dark_half + bright_half);
}

// The same of all that a light of a radius makes, in a sum over lights.
double squared_error(double e, double radius_rad) {
  constexpr double limit = irradiance_that_shows;
  // Surfaces that face away from the source's middle, but not from its rim.
  const double rim = std::min(irradiance_of_rim * e * radius_rad, limit);
  const double size = std::min(e * radius_rad * radius_rad, limit);
  return (squared_error_of_edge(e, limit) + error_of_rim * rim * rim) * radius_rad +
         error_of_size * size * size;
}

}  // namespace

float estimate_light_error(std::span<const DirectionalLight> lights, int map_height) {
  // The map cannot tell where in a texel its light is, nor sources smaller than a texel apart.
  const double texel_radius_rad = std::sqrt(pi) / map_height;
  double errors = 0;
  double flux = 0;
  calibrate::Vec3 sum;
  for (const DirectionalLight& light : lights) {
    const double e = luminance(light.irradiance.x, light.irradiance.y, light.irradiance.z);
    const double r = std::max(static_cast<double>(light.spread), texel_radius_rad);
    errors += squared_error(e, r);
    flux += e;
    sum += to_double(light.direction) * e;
  }
  if (!(flux > 0)) return 0;
  // The mean square of irradiance over all normals, from its first two spherical harmonics.
  // At most half of them face a source that is too bright to show.
  const double irradiance_squared = std::min(flux * flux / 16 + dot(sum, sum) / 12,
                                             irradiance_that_shows * irradiance_that_shows / 2);
  return static_cast<float>(error_of_edges * std::sqrt(errors / irradiance_squared));
}

}  // namespace render
