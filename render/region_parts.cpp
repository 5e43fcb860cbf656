// Regions of the sky in parts of equal light.
#include "render/region_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "calibrate/vec.h"

namespace render {
namespace {

using calibrate::Vec3;
using std::numbers::pi;

constexpr std::size_t side = RegionParts::side;
// The middles of parts lie a little nearer to each other than the light does, and are moved apart,
// by this at most.
constexpr double most_apart = 1.5;

std::size_t size(int i) { return static_cast<std::size_t>(i); }

// Texels x0 <= x < x1, y0 <= y < y1.
struct Box {
  int x0, x1, y0, y1;
};

// About the texels of each region; empty, the other way round, where it has none.
std::vector<Box> boxes_of(const LightRegions& regions) {
  std::vector<Box> boxes(regions.count, {2 * regions.height, 0, regions.height, 0});
  if (boxes.empty()) return boxes;
  std::size_t i = 0;
  for (int y = 0; y < regions.height; ++y) {
    for (int x = 0; x < 2 * regions.height; ++x, ++i) {
      Box& box = boxes[regions.light[i]];
      box = {std::min(box.x0, x), std::max(box.x1, x + 1), std::min(box.y0, y),
             std::max(box.y1, y + 1)};
    }
  }
  return boxes;
}

// Where a line of texels, each with its energy spread evenly along it, is cut in four of equal
// energy: places in texels, from where light begins to where it ends.
std::array<double, side + 1> cut_in_four(std::span<const double> energy) {
  double total = 0;
  for (const double e : energy) total += e;
  std::array<double, side + 1> cuts{};
  std::size_t next = 0;
  double before = 0;
  for (std::size_t i = 0; i < energy.size(); ++i) {
    if (!(energy[i] > 0)) continue;
    if (next == 0) cuts[next++] = static_cast<double>(i);
    for (; next < side; ++next) {
      const double wanted = total * static_cast<double>(next) / side;
      if (before + energy[i] < wanted) break;
      cuts[next] = static_cast<double>(i) + (wanted - before) / energy[i];
    }
    before += energy[i];
    cuts[side] = static_cast<double>(i) + 1;
  }
  return cuts;
}

// The pieces of texels between two places of a line.
template <class F>  // texel, share of it, where its middle is
void for_each_piece(double from, double to, F&& visit) {
  for (double at = from; at < to;) {
    const double texel = std::floor(at);
    const double end = std::min(texel + 1, to);
    visit(static_cast<std::size_t>(texel), end - at, (at + end) / 2);
    at = end;
  }
}

// Cuts the regions of one map.
class RegionCutter {
 public:
  RegionCutter(const LightRegions& regions, const capture::Image& map)
      : regions_(regions), map_(map), texel_rad_(pi / regions.height) {}

  RegionParts parts(std::size_t light, const DirectionalLight& of, const Box& box) {
    if (box.x0 >= box.x1) {
      RegionParts middle;
      middle.directions.fill(of.direction);
      return middle;
    }
    take_energies(light, box);
    const double middle_rad = (box.y0 + box.y1) / 2.0 * texel_rad_;
    const bool wide = columns_ * std::sin(middle_rad) >= rows_;
    const std::array<double, side + 1> strips = cut_in_four(sums(wide, 0, wide ? rows_ : columns_));
    std::array<Vec3, RegionParts::count> moments;
    for (std::size_t i = 0; i < side; ++i) {
      const std::array<double, side + 1> cuts = cut_in_four(sums(!wide, strips[i], strips[i + 1]));
      for (std::size_t k = 0; k < side; ++k) {
        moments[place_of(light, i, k)] =
            wide ? moment_of(box, strips[i], strips[i + 1], cuts[k], cuts[k + 1])
                 : moment_of(box, cuts[k], cuts[k + 1], strips[i], strips[i + 1]);
      }
    }
    return spread_out(moments, of);
  }

 private:
  void take_energies(std::size_t light, const Box& box) {
    columns_ = box.x1 - box.x0, rows_ = box.y1 - box.y0;
    energy_.assign(size(columns_) * size(rows_), 0);
    for (int y = 0; y < rows_; ++y) {
      const double solid_angle =
          texel_solid_angle(box.y0 + y, 2 * regions_.height, regions_.height);
      for (int x = 0; x < columns_; ++x) {
        const std::size_t texel = size((box.y0 + y) * 2 * regions_.height + box.x0 + x);
        if (regions_.light[texel] != light) continue;
        const float* p = &map_.pixels[3 * texel];
        energy_[size(y * columns_ + x)] =
            static_cast<double>(luminance(p[0], p[1], p[2])) * solid_angle;
      }
    }
  }

  Vec3 direction_at(const Box& box, double x, double y) const {
    const double azimuth = pi - (box.x0 + x) * texel_rad_, polar = (box.y0 + y) * texel_rad_;
    return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
            std::cos(polar)};
  }

  // The energy of each column between two rows, or of each row between two columns.
  std::vector<double> sums(bool of_columns, double from, double to) const {
    std::vector<double> sums(size(of_columns ? columns_ : rows_));
    for_each_piece(from, to, [&](std::size_t across, double share, double) {
      for (std::size_t along = 0; along < sums.size(); ++along) {
        sums[along] += share * (of_columns ? energy_[across * size(columns_) + along]
                                           : energy_[along * size(columns_) + across]);
      }
    });
    return sums;
  }

  // Energy times direction, of what lies between two columns and two rows.
  Vec3 moment_of(const Box& box, double x0, double x1, double y0, double y1) const {
    Vec3 moment;
    for_each_piece(y0, y1, [&](std::size_t row, double high, double y) {
      for_each_piece(x0, x1, [&](std::size_t column, double wide, double x) {
        const double e = wide * high * energy_[row * size(columns_) + column];
        if (e > 0) moment += direction_at(box, x, y) * e;
      });
    });
    return moment;
  }

  // Mirrored and transposed from light to light, so that what their parts miss does not add up.
  static std::size_t place_of(std::size_t light, std::size_t along, std::size_t across) {
    const std::size_t u = (light & 1) != 0 ? side - 1 - along : along;
    const std::size_t v = (light & 2) != 0 ? side - 1 - across : across;
    return (light & 4) != 0 ? u * side + v : v * side + u;
  }

  // Their directions, about the light's and as far apart as it is wide: both may come from a finer
  // map than parts do.
  static RegionParts spread_out(const std::array<Vec3, RegionParts::count>& moments,
                                const DirectionalLight& light) {
    Vec3 all;
    for (const Vec3& moment : moments) all += moment;
    const Vec3 wanted = to_double(light.direction);
    RegionParts parts;
    parts.directions.fill(light.direction);
    if (!(length(all) > 0) || !(light.spread > 0)) return parts;
    const Vec3 middle = normalize(all);
    std::array<Vec3, RegionParts::count> aside;
    double squares = 0;
    for (std::size_t i = 0; i < aside.size(); ++i) {
      const double l = length(moments[i]);
      const Vec3 to = l > 0 ? moments[i] / l : middle;
      aside[i] = to - middle * dot(to, middle);
      squares += dot(aside[i], aside[i]) / RegionParts::count;
    }
    // A disc of radius r spreads r / sqrt(2) about its middle.
    const double spread =
        std::sin(std::min(double{light.spread} * std::numbers::sqrt2 / 2, pi / 2));
    const double apart = std::min(spread / std::sqrt(std::max(squares, 1e-18)), most_apart);
    for (std::size_t i = 0; i < aside.size(); ++i) {
      const Vec3 moved = aside[i] * apart;
      const double along = std::sqrt(std::max(1 - dot(moved, moved), 0.0));
      parts.directions[i] = to_float(normalize(wanted * along + moved));
    }
    return parts;
  }

  const LightRegions& regions_;
  const capture::Image& map_;
  double texel_rad_;
  int columns_ = 0, rows_ = 0;  // of the region
  std::vector<double> energy_;  // of its texels, row by row; 0 = another's
};

}  // namespace

std::vector<RegionParts> part_regions(const LightRegions& regions,
                                      const capture::Image& map,
                                      std::span<const DirectionalLight> lights) {
  RegionCutter cut(regions, map);
  const std::vector<Box> boxes = boxes_of(regions);
  std::vector<RegionParts> parts;
  parts.reserve(regions.count);
  for (std::size_t light = 0; light < regions.count; ++light) {
    parts.push_back(cut.parts(light, lights[light], boxes[light]));
  }
  return parts;
}

}  // namespace render
