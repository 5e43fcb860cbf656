// Latitude-longitude maps smoothed by reflection lobes, and shrunk.
#include "render/lobe_filter.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>

#include "render/environment.h"
#include "render/row_transform.h"

namespace render {
namespace {

using std::numbers::pi;
constexpr int least_height = 32;
constexpr int largest_height = 128;
// Texels per half width of the lobe, so that bilinear look-ups show no facets.
constexpr double texels_per_half_width = 4;
// Products this much smaller than the largest one change nothing that a float shows.
constexpr float negligible = 1e-8F;
// Real and imaginary part of three colours.
constexpr std::size_t parts = 6;

// Radiance that a surface of GGX's parameter alpha, seen head-on, takes from an angle off its
// normal, per steradian and not normalised: the microfacet that mirrors it stands at half the
// angle. What would go below the surface is mirrored at it.
double lobe(double alpha, double cos_angle, double texel_rad) {
  const auto density = [alpha](double cos_half_squared) {
    const double d = cos_half_squared * (alpha * alpha - 1) + 1;
    return alpha * alpha / (d * d);
  };
  // A texel on the horizon counts by the part of it that is above.
  const double above = std::clamp(0.5 + cos_angle / texel_rad, 0.0, 1.0);
  return above * (density((1 + cos_angle) / 2) + density((1 - cos_angle) / 2));
}

// The angle at which the lobe has half its height.
double half_width(double alpha) { return 2 * std::atan(alpha * std::sqrt(std::sqrt(2.0) - 1)); }

// The shares that `from` equal steps have in each of `to` equal steps over the same length.
struct Share {
  int from;
  double part;  // of the step `from`, by length
};
std::vector<std::vector<Share>> shares(int from, int to) {
  std::vector<std::vector<Share>> result(static_cast<std::size_t>(to));
  const double ratio = static_cast<double>(from) / to;
  for (int t = 0; t < to; ++t) {
    const double begin = t * ratio;
    const double end = (t + 1) * ratio;
    for (int f = static_cast<int>(begin); f < std::min(from, static_cast<int>(std::ceil(end)));
         ++f) {
      const double part = std::min(end, f + 1.0) - std::max(begin, static_cast<double>(f));
      if (part > 1e-9) result[static_cast<std::size_t>(t)].push_back({f, part});
    }
  }
  return result;
}

// Solid angle of the band between two fractions of the way from the zenith to the nadir.
double band(double begin, double end) { return std::cos(begin * pi) - std::cos(end * pi); }

}  // namespace

capture::Image area_averaged(const capture::Image& map, int height) {
  capture::Image out;
  area_average(map, height, out);
  return out;
}

void area_average(const capture::Image& map, int height, capture::Image& out) {
  const int width = 2 * height;
  out.height = height;
  out.width = width;
  out.channels = 3;
  out.pixels.resize(out.index(height, 0));
  const auto row_shares = shares(map.height, height);
  const auto column_shares = shares(map.width, width);
  std::vector<float> row(static_cast<std::size_t>(map.width) * 3);
  for (int y = 0; y < height; ++y) {
    std::ranges::fill(row, 0.0F);
    const double whole = band(static_cast<double>(y) / height, (y + 1.0) / height);
    for (const Share& share : row_shares[static_cast<std::size_t>(y)]) {
      const double begin =
          std::max(static_cast<double>(share.from) / map.height, static_cast<double>(y) / height);
      const double end = std::min((share.from + 1.0) / map.height, (y + 1.0) / height);
      const auto weight = static_cast<float>(band(begin, end) / whole);
      const float* from = &map.pixels[map.index(share.from, 0)];
      for (std::size_t i = 0; i < row.size(); ++i) row[i] += weight * counted_radiance(from[i]);
    }
    const double per_column = static_cast<double>(width) / map.width;
    for (int x = 0; x < width; ++x) {
      std::array<float, 3> sum{};
      for (const Share& share : column_shares[static_cast<std::size_t>(x)]) {
        const auto weight = static_cast<float>(share.part * per_column);
        const float* from = &row[static_cast<std::size_t>(share.from) * 3];
        for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * from[c];
      }
      std::ranges::copy(sum, &out.pixels[out.index(y, x)]);
    }
  }
}

LobeFilter::LobeFilter(double alpha) {
  const double wanted = texels_per_half_width * pi / half_width(alpha);
  height_ = least_height;
  while (height_ < wanted && height_ < largest_height) height_ *= 2;
  make_products(alpha);
}

void LobeFilter::make_products(double alpha) {
  const std::size_t n = half();
  const auto length = static_cast<std::size_t>(height_) * 2;
  const RowTransform transform(length);
  std::vector<Rows> sums(length);
  std::vector<Rows> differences(length);
  const std::size_t all_frequencies = length / 2 + 1;
  sums_.assign(all_frequencies * n * n, 0);
  differences_.assign(sums_.size(), 0);
  const auto polar = [&](std::size_t row) {
    return (static_cast<double>(row) + 0.5) / height_ * pi;
  };
  const double texel_rad = pi / height_;
  std::vector<double> cos_azimuth(length);
  for (std::size_t j = 0; j < length; ++j) {
    cos_azimuth[j] = std::cos(2 * pi * static_cast<double>(j) / static_cast<double>(length));
  }
  for (std::size_t to = 0; to < n; ++to) {
    double total = 0;
    for (std::size_t first = 0; first < n; first += rows_at_once) {
      for (std::size_t l = 0; l < rows_at_once; ++l) {
        const std::size_t from = first + l;
        const double solid_angle =
            texel_solid_angle(static_cast<int>(from), static_cast<int>(length), height_);
        const double cc = std::cos(polar(to)) * std::cos(polar(from));
        const double ss = std::sin(polar(to)) * std::sin(polar(from));
        for (std::size_t j = 0; j < length; ++j) {
          const double near = lobe(alpha, cc + ss * cos_azimuth[j], texel_rad) * solid_angle;
          const double mirrored = lobe(alpha, -cc + ss * cos_azimuth[j], texel_rad) * solid_angle;
          total += near + mirrored;
          sums[j][l] = static_cast<float>(near + mirrored);
          differences[j][l] = static_cast<float>(near - mirrored);
        }
      }
      // Both are even in j, so their transforms are real, and one complex transform does both.
      transform.forward(sums.data(), differences.data());
      for (std::size_t m = 0; m < all_frequencies; ++m) {
        for (std::size_t l = 0; l < rows_at_once; ++l) {
          const std::size_t at = (m * n + first + l) * n + to;
          sums_[at] = sums[m][l];
          differences_[at] = differences[m][l];
        }
      }
    }
    // Each direction takes exactly all of a lobe. The transforms there and back multiply by the
    // length, and splitting and joining mirrored rows by 2 each.
    const auto scale = static_cast<float>(1 / (total * 4 * static_cast<double>(length)));
    for (std::size_t at = to; at < sums_.size(); at += n) {
      sums_[at] *= scale;
      differences_[at] *= scale;
    }
  }
  const auto largest_at = [&](std::size_t m) {
    float largest = 0;
    for (std::size_t i = m * n * n; i < (m + 1) * n * n; ++i) {
      largest = std::max({largest, std::abs(sums_[i]), std::abs(differences_[i])});
    }
    return largest;
  };
  frequencies_ = all_frequencies;
  const float threshold = negligible * largest_at(0);
  while (frequencies_ > 1 && largest_at(frequencies_ - 1) < threshold) --frequencies_;
  sums_.resize(frequencies_ * n * n);
  differences_.resize(frequencies_ * n * n);
}

namespace {

// Spectra of the rows of a map: [frequency][part][row of the upper half].
struct Spectrum {
  Spectrum(std::size_t frequencies, std::size_t rows_)
      : rows(rows_), values(frequencies * parts * rows_) {}
  float* at(std::size_t frequency, std::size_t part) {
    return &values[(frequency * parts + part) * rows];
  }
  std::size_t rows;
  std::vector<float> values;
};

// Of the sums and differences of the rows from `first` on and their mirror images, one
// colour.
void transform_rows(const RowTransform& transform,
                    const capture::Image& map,
                    std::size_t first,
                    std::size_t colour,
                    std::size_t frequencies,
                    Spectrum& sums,
                    Spectrum& differences) {
  const std::size_t length = transform.length();
  std::vector<Rows> re(length);
  std::vector<Rows> im(length);
  for (std::size_t l = 0; l < rows_at_once; ++l) {
    const int row = static_cast<int>(first + l);
    const float* upper = &map.pixels[map.index(row, 0, static_cast<int>(colour))];
    const float* lower = &map.pixels[map.index(map.height - 1 - row, 0, static_cast<int>(colour))];
    for (std::size_t j = 0; j < length; ++j) {
      re[j][l] = upper[3 * j] + lower[3 * j];
      im[j][l] = upper[3 * j] - lower[3 * j];
    }
  }
  transform.forward(re.data(), im.data());
  for (std::size_t m = 0; m < frequencies; ++m) {
    const std::size_t back = m == 0 ? 0 : length - m;
    float* sum_re = sums.at(m, 2 * colour) + first;
    float* sum_im = sums.at(m, 2 * colour + 1) + first;
    float* difference_re = differences.at(m, 2 * colour) + first;
    float* difference_im = differences.at(m, 2 * colour + 1) + first;
    for (std::size_t l = 0; l < rows_at_once; ++l) {
      sum_re[l] = re[m][l] + re[back][l];
      sum_im[l] = im[m][l] - im[back][l];
      difference_re[l] = im[m][l] + im[back][l];
      difference_im[l] = re[back][l] - re[m][l];
    }
  }
}

// out[part][to] = sum over from of product[from][to] * in[part][from], for one frequency. Four rows
// at a time, so that out is loaded and stored less often than it is added to.
void multiply(const float* __restrict product,
              const float* __restrict in,
              float* __restrict out,
              std::size_t n) {
  for (std::size_t part = 0; part < parts; ++part, in += n, out += n) {
    std::fill(out, out + n, 0.0F);
    for (std::size_t from = 0; from < n; from += 4) {
      const float* row = product + from * n;
      for (std::size_t to = 0; to < n; ++to) {
        out[to] += row[to] * in[from] + row[n + to] * in[from + 1] +
                   row[2 * n + to] * in[from + 2] + row[3 * n + to] * in[from + 3];
      }
    }
  }
}

void restore_rows(const RowTransform& transform,
                  Spectrum& sums,
                  Spectrum& differences,
                  std::size_t first,
                  std::size_t colour,
                  std::size_t frequencies,
                  capture::Image& out) {
  const std::size_t length = transform.length();
  std::vector<Rows> re(length);
  std::vector<Rows> im(length);
  for (std::size_t m = 0; m < frequencies; ++m) {
    const float* sum_re = sums.at(m, 2 * colour) + first;
    const float* sum_im = sums.at(m, 2 * colour + 1) + first;
    const float* difference_re = differences.at(m, 2 * colour) + first;
    const float* difference_im = differences.at(m, 2 * colour + 1) + first;
    const std::size_t back = m == 0 ? 0 : length - m;
    for (std::size_t l = 0; l < rows_at_once; ++l) {
      re[m][l] = sum_re[l] - difference_im[l];
      im[m][l] = sum_im[l] + difference_re[l];
      re[back][l] = sum_re[l] + difference_im[l];
      im[back][l] = difference_re[l] - sum_im[l];
    }
  }
  transform.backward(re.data(), im.data());
  for (std::size_t l = 0; l < rows_at_once; ++l) {
    const int row = static_cast<int>(first + l);
    float* upper = &out.pixels[out.index(row, 0, static_cast<int>(colour))];
    float* lower = &out.pixels[out.index(out.height - 1 - row, 0, static_cast<int>(colour))];
    for (std::size_t j = 0; j < length; ++j) {
      upper[3 * j] = std::max(re[j][l] + im[j][l], 0.0F);
      lower[3 * j] = std::max(re[j][l] - im[j][l], 0.0F);
    }
  }
}

}  // namespace

void LobeFilter::apply(const capture::Image& map, capture::Image& out) const {
  const std::size_t n = half();
  const RowTransform transform(static_cast<std::size_t>(height_) * 2);
  out.height = height_;
  out.width = 2 * height_;
  out.channels = 3;
  out.pixels.resize(out.index(height_, 0));
  Spectrum sums(frequencies_, n);
  Spectrum differences(frequencies_, n);
  for (std::size_t first = 0; first < n; first += rows_at_once) {
    for (std::size_t colour = 0; colour < 3; ++colour) {
      transform_rows(transform, map, first, colour, frequencies_, sums, differences);
    }
  }
  Spectrum smooth_sums(frequencies_, n);
  Spectrum smooth_differences(frequencies_, n);
  for (std::size_t m = 0; m < frequencies_; ++m) {
    multiply(&sums_[m * n * n], sums.at(m, 0), smooth_sums.at(m, 0), n);
    multiply(&differences_[m * n * n], differences.at(m, 0), smooth_differences.at(m, 0), n);
  }
  for (std::size_t first = 0; first < n; first += rows_at_once) {
    for (std::size_t colour = 0; colour < 3; ++colour) {
      restore_rows(transform, smooth_sums, smooth_differences, first, colour, frequencies_, out);
    }
  }
}

const LobeFilter& shared_lobe_filter(float alpha) {
  static std::mutex mutex;
  static std::map<float, std::unique_ptr<const LobeFilter>> filters;
  const std::lock_guard lock(mutex);
  std::unique_ptr<const LobeFilter>& filter = filters[alpha];
  if (!filter) filter = std::make_unique<const LobeFilter>(alpha);
  return *filter;
}

}  // namespace render
