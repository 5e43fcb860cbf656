// Which pixels of a lightprobe's picture each texel of an environment takes, and how much of each.
#include "render/probe_gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "render/environment.h"

namespace render {
namespace {

using calibrate::DirectionTable;
using calibrate::Lens;
using calibrate::Pose;
using calibrate::Vec2;
using calibrate::Vec3;

constexpr double pi = std::numbers::pi;
// Shrunk pixels per texel, along each side, at least.
constexpr double pixels_per_texel = 2;
// Directions per shrunk pixel, along each side, that a texel is sampled by.
constexpr double samples_per_pixel = 2;
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

// The probe's picture, shrunk: what of it is seen.
struct ShrunkProbe {
  int shrink = 1;
  int width = 0, height = 0;
  std::vector<double> solid_angle;  // per shrunk pixel; 0 = not wholly seen

  double angle_rad = 0;  // of a typical pixel's side; 0 = nothing is seen
};

ShrunkProbe shrink_probe(const DirectionTable& table, int shrink) {
  ShrunkProbe probe{shrink, table.width / shrink, table.height / shrink, {}, 0};
  double total = 0;
  int seen = 0;
  probe.solid_angle.reserve(static_cast<std::size_t>(probe.width) *
                            static_cast<std::size_t>(probe.height));
  for (int y = 0; y < probe.height; ++y) {
    for (int x = 0; x < probe.width; ++x) {
      double sum = 0;
      bool whole = true;
      for (int i = 0; i < shrink * shrink && whole; ++i) {
        const double part =
            pixel_solid_angle(table, y * shrink + i / shrink, x * shrink + i % shrink);
        whole = part > 0;
        sum += part;
      }
      probe.solid_angle.push_back(whole ? sum : 0);
      total += probe.solid_angle.back();
      seen += whole;
    }
  }
  if (seen > 0) probe.angle_rad = std::sqrt(total / seen);
  return probe;
}

struct Entry {
  std::uint32_t pixel;
  float weight;
};

// Samples one texel after the other.
class TexelSampler {
 public:
  TexelSampler(const Lens& lens, const Pose& probe_from_set, const ShrunkProbe& probe, int height)
      : lens_(lens), probe_from_set_(probe_from_set), probe_(probe), height_(height) {}

  // The pixels of a texel and their weights; none if it is seen by less than half.
  std::vector<Entry> sample(int row, int column) const {
    const double texel_rad = pi / height_;
    const double wanted = samples_per_pixel * texel_rad / probe_.angle_rad;
    const double narrowing = std::sin((row + 0.5) * texel_rad);
    const int down = std::clamp(static_cast<int>(std::ceil(wanted)), 2, most_samples);
    const int across = std::clamp(static_cast<int>(std::ceil(wanted * narrowing)), 2, most_samples);
    std::vector<Entry> entries;
    int seen = 0;
    // Evenly over the texel's area: in steps of height above the equator, not of angle.
    const double top = std::cos(row * texel_rad);
    const double bottom = std::cos((row + 1) * texel_rad);
    for (int i = 0; i < down * across; ++i) {
      const double z = top + (bottom - top) * (i / across + 0.5) / down;
      const double u = (column + (i % across + 0.5) / across) / (2 * height_);
      const double azimuth_rad = (0.5 - u) * 2 * pi;
      const double sine = std::sqrt(std::max(1 - z * z, 0.0));
      seen += add_sample({sine * std::cos(azimuth_rad), sine * std::sin(azimuth_rad), z}, entries);
    }
    if (2 * seen < down * across) return {};
    return merged(entries);
  }

 private:
  // The four pixels about a direction, as far as they are seen; whether most of it is.
  bool add_sample(Vec3 v_set, std::vector<Entry>& entries) const {
    const auto q = calibrate::project(lens_, probe_from_set_.R * v_set);
    if (!q) return false;
    const double x = (q->x - 0.5 * (probe_.shrink - 1)) / probe_.shrink;
    const double y = (q->y - 0.5 * (probe_.shrink - 1)) / probe_.shrink;
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
      entries.push_back({pixel, static_cast<float>(weight)});
      seen += weight;
    }
    return seen > 0.5;
  }

  // One entry per pixel, the largest ones that make up nearly all.
  static std::vector<Entry> merged(std::vector<Entry>& entries) {
    std::ranges::sort(entries, {}, &Entry::pixel);
    std::vector<Entry> result;
    float sum = 0;
    for (const Entry& entry : entries) {
      if (result.empty() || result.back().pixel != entry.pixel) result.push_back({entry.pixel, 0});
      result.back().weight += entry.weight;
      sum += entry.weight;
    }
    std::erase_if(result, [sum](const Entry& entry) { return entry.weight < least_part * sum; });
    sum = 0;
    for (const Entry& entry : result) sum += entry.weight;
    for (Entry& entry : result) entry.weight /= sum;
    return result;
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
  ShrunkProbe probe = shrink_probe(table, 1);
  const double texel_rad = pi / environment_height;
  if (probe.angle_rad > 0) {
    const int shrink = static_cast<int>(texel_rad / (pixels_per_texel * probe.angle_rad));
    if (shrink > 1) probe = shrink_probe(table, shrink);
  }
  ProbeGather gather{probe.shrink, probe.width, probe.height, {}, {}, {}};
  const int width = 2 * environment_height;
  std::vector<std::vector<Entry>> texels(static_cast<std::size_t>(environment_height * width));
  if (probe.angle_rad > 0) {
    const TexelSampler sampler(lens, probe_from_set, probe, environment_height);
    tbb::parallel_for(tbb::blocked_range<int>(0, environment_height), [&](const auto& rows) {
      for (int y = rows.begin(); y != rows.end(); ++y) {
        for (int x = 0; x < width; ++x) {
          texels[static_cast<std::size_t>(y * width + x)] = sampler.sample(y, x);
        }
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
