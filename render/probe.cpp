// From the picture of a lightprobe camera to the light of the set.
#include "render/probe.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "calibrate/vignetting.h"
#include "capture/parallel_loop.h"

namespace render {
namespace {

using calibrate::Lens;
using calibrate::Pose;
using calibrate::Vec3;

using std::numbers::pi;
constexpr int least_height = 8;
constexpr int largest_height = 4096;
// One register: left to itself, the compiler gathers channels from many pixels, at twice the time.
using FourFloats = float __attribute__((vector_size(16)));

// Texels this many times as bright as the mean are sources.
constexpr float source_over_mean = 4;
constexpr int rounds_of_mean = 4;
// Rows per task of oneTBB.
constexpr int rows_per_task = 8;

// Cosine times solid angle of a texel above the horizon, of a row, on a surface that faces up.
double upward_weight(int row, int height) {
  const double top = std::sin(row * pi / height);
  const double bottom = std::sin((row + 1) * pi / height);
  return std::max(bottom * bottom - top * top, 0.0) / 2 * pi / height;
}

void check(const ProbeSettings& settings, const Lens& lens) {
  if (settings.height < least_height || settings.height > largest_height) {
    throw std::invalid_argument("an environment's height must be from 8 to 4096, not " +
                                std::to_string(settings.height));
  }
  if (!(settings.floor_albedo >= 0 && settings.floor_albedo <= 1)) {
    throw std::invalid_argument("the albedo of the floor must be from 0 to 1");
  }
  calibrate::check_vignetting(settings.vignetting, lens);
}

}  // namespace

ProbeMapper::ProbeMapper(const Lens& lens,
                         const Pose& probe_from_set,
                         const ProbeSettings& settings)
    : width_(lens.width), height_(lens.height), settings_(settings) {
  check(lens);
  check(settings, lens);
  gather_ = make_probe_gather(lens, probe_from_set, settings.height);
  if (gather_.pixel.empty()) throw std::invalid_argument("a lightprobe's lens sees nothing");
  shrunk_ = capture::make_image(gather_.height, gather_.width, 4);
  correct_vignetting(lens);
  const int width = 2 * settings.height;
  seen_.resize(gather_.first.size() - 1);
  seen_in_row_.assign(static_cast<std::size_t>(settings.height), 0);
  for (std::size_t t = 0; t < seen_.size(); ++t) {
    seen_[t] = gather_.first[t + 1] > gather_.first[t];
    seen_in_row_[t / static_cast<std::size_t>(width)] += seen_[t];
  }
  row_sums_.resize(seen_in_row_.size());
  if (settings.unseen == Unseen::mirror) find_mirrored(probe_from_set);
}

void ProbeMapper::correct_vignetting(const Lens& lens) {
  if (settings_.vignetting.empty()) return;
  std::vector<float> correction(static_cast<std::size_t>(gather_.width * gather_.height));
  const double to_middle = 0.5 * (gather_.shrink - 1);
  capture::parallel_for(tbb::blocked_range<int>(0, gather_.height), [&](const auto& rows) {
    std::vector<calibrate::Vec2> pixels(static_cast<std::size_t>(gather_.width));
    for (int y = rows.begin(); y != rows.end(); ++y) {
      for (int x = 0; x < gather_.width; ++x) {
        pixels[static_cast<std::size_t>(x)] = {x * gather_.shrink + to_middle,
                                               y * gather_.shrink + to_middle};
      }
      const auto directions = calibrate::unproject_all(lens, pixels);
      float* const row = &correction[static_cast<std::size_t>(y) * pixels.size()];
      for (std::size_t x = 0; x < pixels.size(); ++x) {
        const Vec3 v = directions[x].value_or(Vec3{0, 0, 1});
        const double angle_rad = std::atan2(calibrate::hypotenuse(v.x, v.y), v.z);
        row[x] = static_cast<float>(1 / calibrate::sensitivity(settings_.vignetting, angle_rad));
      }
    }
  });
  for (std::size_t i = 0; i < gather_.pixel.size(); ++i) {
    gather_.weight[i] *= correction[gather_.pixel[i]];
  }
}

void ProbeMapper::find_mirrored(const Pose& probe_from_set) {
  const int height = settings_.height;
  const int width = 2 * height;
  const Vec3 axis = probe_from_set.R.transposed() * Vec3{0, 0, 1};
  mirrored_.assign(seen_.size(), -1);
  for (std::size_t t = 0; t < seen_.size(); ++t) {
    if (seen_[t] != 0) continue;
    const Vec3 v = to_double(direction_of_texel(static_cast<float>(static_cast<int>(t) % width),
                                                static_cast<float>(static_cast<int>(t) / width),
                                                width, height));
    const Vec3f other = to_float(v - axis * (2 * dot(v, axis)));
    const auto [x, y] = texel_of_direction(other, width, height);
    const int column = static_cast<int>(std::lround(x)) % width;
    const int row = std::clamp(static_cast<int>(std::lround(y)), 0, height - 1);
    const int there = row * width + std::max(column, 0);
    if (seen_[static_cast<std::size_t>(there)] != 0) mirrored_[t] = there;
  }
}

int ProbeMapper::texels_below_zero() const {
  int texels = 0;
  for (const RowSum& row : row_sums_) texels += row.below_zero;
  return texels;
}

double ProbeMapper::seen_part() const {
  double sum = 0;
  for (int y = 0; y < settings_.height; ++y) {
    sum += seen_in_row_[static_cast<std::size_t>(y)] *
           texel_solid_angle(y, 2 * settings_.height, settings_.height);
  }
  return sum / (4 * pi);
}

void ProbeMapper::map(const capture::Image& probe, const ProbeFrame& frame, Environment& out) {
  if (probe.width != width_ || probe.height != height_ || probe.channels != 3) {
    throw std::invalid_argument("the lightprobe's picture is " + std::to_string(probe.width) + "x" +
                                std::to_string(probe.height) + ", but its lens is for " +
                                std::to_string(width_) + "x" + std::to_string(height_));
  }
  const int rows = settings_.height;
  out.radiance.height = rows;
  out.radiance.width = 2 * rows;
  out.radiance.channels = 3;
  out.radiance.pixels.resize(3 * seen_.size());
  out.seen = seen_;
  shrink(probe);
  const tbb::blocked_range<int> all(0, rows, rows_per_task);
  capture::parallel_for(all, [&](const auto& range) {
    for (int y = range.begin(); y != range.end(); ++y) gather_row(y, frame, out);
  });
  const Vec3f fill = settings_.unseen != Unseen::floor ? mean_without_sources(out)
                     : frame.floor_radiance            ? *frame.floor_radiance
                                                       : floor_of_light_from_above();
  capture::parallel_for(all, [&](const auto& range) {
    for (int y = range.begin(); y != range.end(); ++y) fill_row(y, fill, out);
  });
  out.unseen_share = unseen_share();
}

namespace {

// A pixel's three channels as they count, and something else. The four floats must be there.
FourFloats counted_pixel(const float* pixel) {
  FourFloats v;
  std::memcpy(&v, pixel, sizeof v);
  v = v > 0 ? v : FourFloats{};
  return v < brightest_radiance ? v : FourFloats{} + brightest_radiance;
}

}  // namespace

void ProbeMapper::shrink(const capture::Image& probe) {
  const int n = gather_.shrink;
  const float part = 1.0F / static_cast<float>(n * n);
  const float* const last_pixel = &probe.pixels[probe.pixels.size() - 3];
  const std::array<float, 4> last{last_pixel[0], last_pixel[1], last_pixel[2], 0};
  const tbb::blocked_range<int> all(0, shrunk_.height, rows_per_task);
  capture::parallel_for(all, [&](const auto& rows) {
    for (int y = rows.begin(); y != rows.end(); ++y) {
      float* to = &shrunk_.pixels[shrunk_.index(y, 0)];
      for (int x = 0; x < shrunk_.width; ++x, to += 4) {
        FourFloats sum{};
        for (int dy = 0; dy < n; ++dy) {
          const float* from = &probe.pixels[probe.index(y * n + dy, x * n)];
          for (int dx = 0; dx < n; ++dx, from += 3) {
            sum += part * counted_pixel(from == last_pixel ? last.data() : from);
          }
        }
        std::memcpy(to, &sum, sizeof sum);
      }
    }
  });
}

void ProbeMapper::gather_row(int row, const ProbeFrame& frame, Environment& out) {
  const auto width = static_cast<std::size_t>(2 * settings_.height);
  const std::size_t begin = static_cast<std::size_t>(row) * width;
  std::array<double, 3> sum{};
  int below_zero = 0;
  for (std::size_t t = begin; t < begin + width; ++t) {
    FourFloats radiance{};
    for (std::uint32_t i = gather_.first[t]; i < gather_.first[t + 1]; ++i) {
      FourFloats pixel;
      std::memcpy(&pixel, &shrunk_.pixels[4 * static_cast<std::size_t>(gather_.pixel[i])],
                  sizeof pixel);
      radiance += gather_.weight[i] * pixel;
    }
    const Recoloured texel = recolour(frame.match, {radiance[0], radiance[1], radiance[2]});
    below_zero += texel.below_zero ? 1 : 0;
    for (std::size_t c = 0; c < 3; ++c) {
      out.radiance.pixels[3 * t + c] = texel.radiance[c];
      sum[c] += texel.radiance[c];
    }
  }
  row_sums_[static_cast<std::size_t>(row)].seen = sum;
  row_sums_[static_cast<std::size_t>(row)].below_zero = below_zero;
}

Vec3f ProbeMapper::floor_of_light_from_above() const {
  const int rows = settings_.height;
  std::array<double, 3> irradiance{};
  double unseen_weight = 0;
  for (int y = 0; y < rows; ++y) {
    const auto row = static_cast<std::size_t>(y);
    const double weight = upward_weight(y, rows);
    for (std::size_t c = 0; c < 3; ++c) irradiance[c] += weight * row_sums_[row].seen[c];
    unseen_weight += weight * (2 * rows - seen_in_row_[row]);
  }
  // What is filled in above the horizon lights the floor too.
  // Between a floor that mirrors all and what it lights, hardly anything would be lost.
  constexpr double most_returned = 0.999;
  const double reflectance = settings_.floor_albedo / pi;
  const double scale = reflectance / (1 - std::min(reflectance * unseen_weight, most_returned));
  return {static_cast<float>(irradiance[0] * scale), static_cast<float>(irradiance[1] * scale),
          static_cast<float>(irradiance[2] * scale)};
}

Vec3f ProbeMapper::mean_without_sources(const Environment& env) const {
  const int rows = settings_.height;
  const int width = 2 * rows;
  Vec3f mean;
  float limit = std::numeric_limits<float>::infinity();
  // A strong sun lifts the first mean so far that its glow stays in: hence in rounds.
  for (int round = 0; round < rounds_of_mean; ++round) {
    calibrate::Vec3 sum;
    double weights = 0;
    for (int y = 0; y < rows; ++y) {
      Vec3f row_sum;
      int counted = 0;
      for (int x = 0; x < width; ++x) {
        const auto t = static_cast<std::size_t>(y * width + x);
        const float* p = &env.radiance.pixels[3 * t];
        if (seen_[t] == 0 || p[0] + p[1] + p[2] > limit) continue;
        row_sum += Vec3f{p[0], p[1], p[2]};
        ++counted;
      }
      const double weight = texel_solid_angle(y, width, rows);
      sum += to_double(row_sum) * weight;
      weights += counted * weight;
    }
    if (!(weights > 0)) return mean;
    mean = to_float(sum / weights);
    limit = source_over_mean * (mean.x + mean.y + mean.z);
  }
  return mean;
}

void ProbeMapper::fill_row(int row, Vec3f fill, Environment& out) {
  const auto width = static_cast<std::size_t>(2 * settings_.height);
  const std::size_t begin = static_cast<std::size_t>(row) * width;
  std::array<double, 3> sum{};
  for (std::size_t t = begin; t < begin + width; ++t) {
    if (seen_[t] != 0) continue;
    float* p = &out.radiance.pixels[3 * t];
    const std::int32_t from = mirrored_.empty() ? -1 : mirrored_[t];
    if (from >= 0) {
      std::copy_n(&out.radiance.pixels[3 * static_cast<std::size_t>(from)], 3, p);
    } else {
      p[0] = fill.x;
      p[1] = fill.y;
      p[2] = fill.z;
    }
    for (std::size_t c = 0; c < 3; ++c) sum[c] += p[c];
  }
  row_sums_[static_cast<std::size_t>(row)].filled = sum;
}

float ProbeMapper::unseen_share() const {
  std::array<double, 3> seen{};
  std::array<double, 3> filled{};
  for (int y = 0; y < settings_.height; ++y) {
    const double weight = upward_weight(y, settings_.height);
    const RowSum& row = row_sums_[static_cast<std::size_t>(y)];
    for (std::size_t c = 0; c < 3; ++c) {
      seen[c] += weight * row.seen[c];
      filled[c] += weight * row.filled[c];
    }
  }
  const auto luminance_of = [](const std::array<double, 3>& v) {
    return .2126 * v[0] + .7152 * v[1] + .0722 * v[2];
  };
  const double all = luminance_of(seen) + luminance_of(filled);
  return all > 0 ? static_cast<float>(luminance_of(filled) / all) : 0.0F;
}

}  // namespace render
