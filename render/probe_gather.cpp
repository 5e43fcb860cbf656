// Which pixels of a lightprobe's picture each texel of an environment takes, and how much of each.
#include "render/probe_gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>

#include "capture/parallel_loop.h"
#include "render/environment.h"

namespace render {
namespace {

using calibrate::DirectionTable;
using calibrate::Lens;
using calibrate::Pose;
using calibrate::Vec2;
using calibrate::Vec3;

using std::numbers::pi;
// Shrunk pixels per texel, along each side, at least.
constexpr double pixels_per_texel = 2;
// Directions per shrunk pixel, along each side, that a texel is sampled by.
constexpr double samples_per_pixel = 1.5;
constexpr int most_samples = 8;
// Pixels with less of a texel than this are left out; balancing makes up for it.
constexpr float least_part = 0.01F;
// Rounds of balancing, and how far a pixel's light may be off before them. Rims lose more for good.
constexpr int balance_rounds = 4;
constexpr float largest_correction = 1.5F;

Vec3f direction(const DirectionTable& table, int row, int column) {
  const std::size_t i = table.index(row, column);
  return {table.x[i], table.y[i], table.z[i]};
}

// Solid angle of a pixel, from the directions of its neighbours; 0 if one of them is not seen.
double pixel_solid_angle(const DirectionTable& table, int row, int column) {
  const std::array around{direction(table, row, column - 1), direction(table, row, column + 1),
                          direction(table, row - 1, column), direction(table, row + 1, column)};
  for (const Vec3f& v : around) {
    if (dot(v, v) == 0) return 0;
  }
  return length(cross(around[1] - around[0], around[3] - around[2])) / 4;
}

// Angle of a typical pixel's side; 0 if nothing is seen. Every eighth row and column will do.
double pixel_angle_rad(const DirectionTable& table) {
  constexpr int step = 8;
  double total = 0;
  int seen = 0;
  for (int y = table.height / 2 % step; y < table.height; y += step) {
    for (int x = table.width / 2 % step; x < table.width; x += step) {
      const double solid_angle = pixel_solid_angle(table, y, x);
      total += solid_angle;
      seen += solid_angle > 0;
    }
  }
  return seen > 0 ? std::sqrt(total / seen) : 0;
}

// The probe's picture, shrunk: what of it is seen.
struct ShrunkProbe {
  int shrink = 1;
  int width = 0, height = 0;
  double angle_rad = 0;             // of a typical pixel's side; 0 = nothing is seen
  std::vector<double> solid_angle;  // per shrunk pixel; 0 = not wholly seen
};

double solid_angle_of(const DirectionTable& table, int shrink, int row, int column) {
  double sum = 0;
  for (int i = 0; i < shrink * shrink; ++i) {
    const double part =
        pixel_solid_angle(table, row * shrink + i / shrink, column * shrink + i % shrink);
    if (!(part > 0)) return 0;
    sum += part;
  }
  return sum;
}

ShrunkProbe shrink_probe(const DirectionTable& table, double texel_rad) {
  const double angle_rad = pixel_angle_rad(table);
  const int shrink =
      angle_rad > 0 ? std::max(1, static_cast<int>(texel_rad / (pixels_per_texel * angle_rad))) : 1;
  ShrunkProbe probe{shrink, table.width / shrink, table.height / shrink, shrink * angle_rad, {}};
  const auto width = static_cast<std::size_t>(probe.width);
  probe.solid_angle.resize(static_cast<std::size_t>(probe.height) * width);
  capture::parallel_for(tbb::blocked_range<int>(0, probe.height), [&](const auto& rows) {
    for (int y = rows.begin(); y != rows.end(); ++y) {
      for (int x = 0; x < probe.width; ++x) {
        probe.solid_angle[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] =
            solid_angle_of(table, shrink, y, x);
      }
    }
  });
  return probe;
}

struct Entry {
  std::uint32_t pixel;
  float weight;
};

// Samples one row of texels after the other.
class TexelSampler {
 public:
  TexelSampler(const Lens& lens, const Pose& probe_from_set, const ShrunkProbe& probe, int height)
      : lens_(lens), probe_from_set_(probe_from_set), probe_(probe), height_(height) {}

  // The pixels of each texel and their weights; none if it is seen by less than half.
  void sample_row(int row, std::span<std::vector<Entry>> texels) const {
    const double texel_rad = pi / height_;
    const double wanted = samples_per_pixel * texel_rad / probe_.angle_rad;
    const double narrowing = std::sin((row + 0.5) * texel_rad);
    const int down = std::clamp(static_cast<int>(std::ceil(wanted)), 2, most_samples);
    const int across = std::clamp(static_cast<int>(std::ceil(wanted * narrowing)), 2, most_samples);
    const auto each = static_cast<std::size_t>(down * across);
    const std::vector<std::optional<Vec2>> pixels =
        project_all(lens_, directions_in(row, down, across));
    std::vector<Entry> entries;
    for (std::size_t x = 0; x < texels.size(); ++x) {
      entries.clear();
      std::size_t seen = 0;
      for (const auto& q : std::span(pixels).subspan(x * each, each)) {
        seen += q && add_sample(*q, entries);
      }
      if (2 * seen >= each) texels[x] = largest(entries);
    }
  }

 private:
  // Evenly over each texel's area, in the probe's frame: in steps of height above the equator, not
  // of angle.
  std::vector<Vec3> directions_in(int row, int down, int across) const {
    const double top = std::cos(row * pi / height_);
    const double bottom = std::cos((row + 1) * pi / height_);
    std::vector<Vec3> directions;
    directions.reserve(static_cast<std::size_t>(2 * height_ * down * across));
    std::vector<Vec2> azimuth(static_cast<std::size_t>(across));  // cosine and sine
    for (int column = 0; column < 2 * height_; ++column) {
      for (int i = 0; i < across; ++i) {
        const double azimuth_rad = pi - (column + (i + 0.5) / across) * pi / height_;
        azimuth[static_cast<std::size_t>(i)] = {std::cos(azimuth_rad), std::sin(azimuth_rad)};
      }
      for (int j = 0; j < down; ++j) {
        const double z = top + (bottom - top) * (j + 0.5) / down;
        const double sine = std::sqrt(std::max(1 - z * z, 0.0));
        for (const Vec2& a : azimuth) {
          directions.push_back(probe_from_set_.R * Vec3{sine * a.x, sine * a.y, z});
        }
      }
    }
    return directions;
  }

  // The four pixels about a place, as far as they are seen; whether most of it is.
  bool add_sample(Vec2 q, std::vector<Entry>& entries) const {
    const double x = (q.x - 0.5 * (probe_.shrink - 1)) / probe_.shrink;
    const double y = (q.y - 0.5 * (probe_.shrink - 1)) / probe_.shrink;
    if (!(x > -1 && x < probe_.width && y > -1 && y < probe_.height)) return false;
    const int x0 = static_cast<int>(std::floor(x));
    const int y0 = static_cast<int>(std::floor(y));
    double seen = 0;
    for (int i = 0; i < 4; ++i) {
      const int px = x0 + i % 2;
      const int py = y0 + i / 2;
      if (px < 0 || px >= probe_.width || py < 0 || py >= probe_.height) continue;
      const auto pixel = static_cast<std::uint32_t>(py * probe_.width + px);
      if (!(probe_.solid_angle[pixel] > 0)) continue;
      const double weight = (1 - std::abs(x - px)) * (1 - std::abs(y - py));
      add({pixel, static_cast<float>(weight)}, entries);
      seen += weight;
    }
    return seen > 0.5;
  }

  // One entry per pixel. A texel has few, and most samples fall where one before fell.
  static void add(const Entry& entry, std::vector<Entry>& entries) {
    const auto same = std::ranges::find(entries, entry.pixel, &Entry::pixel);
    if (same == entries.end()) {
      entries.push_back(entry);
    } else {
      same->weight += entry.weight;
    }
  }

  // The largest ones that make up nearly all, in the picture's order.
  static std::vector<Entry> largest(const std::vector<Entry>& all) {
    const auto sum_of = [](const std::vector<Entry>& of) {
      float sum = 0;
      for (const Entry& entry : of) sum += entry.weight;
      return sum;
    };
    const float least = least_part * sum_of(all);
    std::vector<Entry> entries;
    entries.reserve(all.size());
    std::ranges::copy_if(all, std::back_inserter(entries),
                         [&](const Entry& entry) { return entry.weight >= least; });
    std::ranges::sort(entries, {}, &Entry::pixel);
    const float sum = sum_of(entries);
    for (Entry& entry : entries) entry.weight /= sum;
    return entries;
  }

  const Lens& lens_;
  const Pose& probe_from_set_;
  const ShrunkProbe& probe_;
  int height_;
};

// Makes each pixel give as much light as it has solid angle, and then each texel's weights add up
// to 1 again, in turns (Sinkhorn and Knopp, "Concerning Nonnegative Matrices and Doubly Stochastic
// Matrices", Pacific J. Math. 21, 1967).
void balance(const ShrunkProbe& probe, int environment_height, ProbeGather& gather) {
  const int width = 2 * environment_height;
  for (int round = 0; round < balance_rounds; ++round) {
    std::vector<double> given(probe.solid_angle.size());
    for (std::size_t t = 0; t + 1 < gather.first.size(); ++t) {
      const double solid_angle =
          texel_solid_angle(static_cast<int>(t) / width, width, environment_height);
      for (std::uint32_t i = gather.first[t]; i < gather.first[t + 1]; ++i) {
        given[gather.pixel[i]] += gather.weight[i] * solid_angle;
      }
    }
    for (std::size_t t = 0; t + 1 < gather.first.size(); ++t) {
      float sum = 0;
      for (std::uint32_t i = gather.first[t]; i < gather.first[t + 1]; ++i) {
        const std::uint32_t pixel = gather.pixel[i];
        gather.weight[i] *= std::clamp(static_cast<float>(probe.solid_angle[pixel] / given[pixel]),
                                       1 / largest_correction, largest_correction);
        sum += gather.weight[i];
      }
      for (std::uint32_t i = gather.first[t]; i < gather.first[t + 1]; ++i) gather.weight[i] /= sum;
    }
  }
}

}  // namespace

ProbeGather make_probe_gather(const Lens& lens,
                              const Pose& probe_from_set,
                              int environment_height) {
  const DirectionTable table = make_direction_table(lens);
  const ShrunkProbe probe = shrink_probe(table, pi / environment_height);
  ProbeGather gather{probe.shrink, probe.width, probe.height, {}, {}, {}};
  const int width = 2 * environment_height;
  std::vector<std::vector<Entry>> texels(static_cast<std::size_t>(environment_height * width));
  if (probe.angle_rad > 0) {
    const TexelSampler sampler(lens, probe_from_set, probe, environment_height);
    capture::parallel_for(tbb::blocked_range<int>(0, environment_height), [&](const auto& rows) {
      for (int y = rows.begin(); y != rows.end(); ++y) {
        sampler.sample_row(y, std::span(texels).subspan(static_cast<std::size_t>(y * width),
                                                        static_cast<std::size_t>(width)));
      }
    });
  }
  gather.first.push_back(0);
  for (const std::vector<Entry>& entries : texels) {
    for (const Entry& entry : entries) {
      gather.pixel.push_back(entry.pixel);
      gather.weight.push_back(entry.weight);
    }
    gather.first.push_back(static_cast<std::uint32_t>(gather.pixel.size()));
  }
  balance(probe, environment_height, gather);
  return gather;
}

}  // namespace render
