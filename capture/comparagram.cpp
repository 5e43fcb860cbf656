// Joint histograms of codes over flat places, reduced to robust means.
#include "capture/comparagram.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numeric>

namespace capture {
namespace {

constexpr int codes = Response::codes;
constexpr int flat_difference = 3;       // codes between neighbours
constexpr int least_count = 25;          // pixels behind a mean
constexpr int mode_radius = 8;           // codes around the median that count into a mean
constexpr double least_majority = 0.75;  // of a code's pixels that must be near the median
constexpr int lowest = 3;                // codes beyond these bounds are bent by clipping
constexpr int highest = 247;
constexpr int code_step = 5;         // between codes that give a match: curves are smooth
constexpr double systematic = 0.25;  // codes: what rounding and compression leave in any mean
constexpr std::int64_t enough_pixels = 1'200'000;

using Histogram = std::vector<std::uint32_t>;  // (codes of a, codes of b)

struct Grid {
  int width = 0;
  int height = 0;
  int step = 1;  // between the pixels that are looked at
};

// 1 where a pixel's four neighbours are close to it in every channel, for the pixels of the grid.
std::vector<std::uint8_t> flat_places(const Still8& still, const Grid& grid) {
  std::vector<std::uint8_t> flat;
  const auto at = [&](int y, int x, int c) {
    return static_cast<int>(
        still.texels[(static_cast<std::size_t>(y) * static_cast<std::size_t>(still.width) +
                      static_cast<std::size_t>(x)) *
                         static_cast<std::size_t>(still.channels) +
                     static_cast<std::size_t>(c)]);
  };
  for (int y = 1; y < grid.height - 1; y += grid.step) {
    for (int x = 1; x < grid.width - 1; x += grid.step) {
      bool close = true;
      for (int c = 0; c < 3 && close; ++c) {
        const int centre = at(y, x, c);
        close = std::abs(at(y, x - 1, c) - centre) <= flat_difference &&
                std::abs(at(y, x + 1, c) - centre) <= flat_difference &&
                std::abs(at(y - 1, x, c) - centre) <= flat_difference &&
                std::abs(at(y + 1, x, c) - centre) <= flat_difference;
      }
      flat.push_back(close ? 1 : 0);
    }
  }
  return flat;
}

// Mean, its uncertainty and count of the codes around the median of one row of a histogram.
struct Mode {
  double mean = 0;
  double sigma = 0;
  std::uint64_t count = 0;
};

Mode mode_of(std::span<const std::uint32_t> counts, std::size_t stride) {
  std::uint64_t total = 0;
  for (std::size_t z = 0; z < codes; ++z) total += counts[z * stride];
  if (total < least_count) return {};
  int median = 0;
  for (std::uint64_t below = 0; median < codes - 1; ++median) {
    below += counts[static_cast<std::size_t>(median) * stride];
    if (2 * below >= total) break;
  }
  double sum = 0;
  double squares = 0;
  Mode mode;
  for (int z = std::max(0, median - mode_radius); z <= std::min(codes - 1, median + mode_radius);
       ++z) {
    const auto count = counts[static_cast<std::size_t>(z) * stride];
    mode.count += count;
    sum += static_cast<double>(count) * z;
    squares += static_cast<double>(count) * z * z;
  }
  if (mode.count < least_count ||
      static_cast<double>(mode.count) < least_majority * static_cast<double>(total)) {
    return {};
  }
  const auto n = static_cast<double>(mode.count);
  mode.mean = sum / n;
  const double variance = std::max(0.0, squares / n - mode.mean * mode.mean);
  mode.sigma = std::sqrt(variance / n + systematic * systematic);
  return mode;
}

void append_matches(const Histogram& histogram, CodeMatch pair, std::vector<CodeMatch>& matches) {
  const std::span<const std::uint32_t> all(histogram);
  const auto inside = [](double code) { return code >= lowest && code <= highest; };
  for (int z = lowest; z <= highest; z += code_step) {
    const Mode of_b = mode_of(all.subspan(static_cast<std::size_t>(z) * codes), 1);
    if (of_b.count > 0 && inside(of_b.mean)) {
      pair.code_a = z;
      pair.sigma_a = systematic;
      pair.code_b = of_b.mean;
      pair.sigma_b = of_b.sigma;
      pair.pixels = static_cast<double>(of_b.count);
      matches.push_back(pair);
    }
    const Mode of_a = mode_of(all.subspan(static_cast<std::size_t>(z)), codes);
    if (of_a.count > 0 && inside(of_a.mean)) {
      pair.code_a = of_a.mean;
      pair.sigma_a = of_a.sigma;
      pair.code_b = z;
      pair.sigma_b = systematic;
      pair.pixels = static_cast<double>(of_a.count);
      matches.push_back(pair);
    }
  }
}

// The deepest fall of the longer shot's codes while the shorter one's rise: beyond what the means'
// errors and one code of rounding make.
void find_fall(const Histogram& histogram, int channel, std::vector<CodeFall>& falls) {
  constexpr double least_fall = 1.5;
  constexpr double surely = 5;
  const std::span<const std::uint32_t> all(histogram);
  Mode top;
  CodeFall fall{channel, 0, 0};
  for (int z = lowest; z <= highest; ++z) {
    const Mode mode = mode_of(all.subspan(static_cast<std::size_t>(z)), codes);
    if (mode.count == 0 || mode.mean > highest) continue;
    if (top.count > 0 &&
        top.mean - mode.mean > least_fall + surely * std::hypot(top.sigma, mode.sigma) &&
        top.mean - mode.mean > fall.from - fall.to) {
      fall.from = top.mean;
      fall.to = mode.mean;
    }
    if (top.count == 0 || mode.mean > top.mean) top = mode;
  }
  if (fall.from == 0) return;
  const auto known = std::find_if(falls.begin(), falls.end(),
                                  [&](const CodeFall& other) { return other.channel == channel; });
  if (known == falls.end()) {
    falls.push_back(fall);
  } else if (fall.from - fall.to > known->from - known->to) {
    *known = fall;
  }
}

void count_codes(const Still8& a,
                 const Still8& b,
                 std::span<const std::uint8_t> flat_a,
                 std::span<const std::uint8_t> flat_b,
                 const Grid& grid,
                 std::array<Histogram, 3>& histograms) {
  for (Histogram& histogram : histograms) histogram.assign(codes * codes, 0);
  std::size_t place = 0;
  for (int y = 1; y < grid.height - 1; y += grid.step) {
    const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width);
    for (int x = 1; x < grid.width - 1; x += grid.step, ++place) {
      if (flat_a[place] == 0 || flat_b[place] == 0) continue;
      const auto pixel = row + static_cast<std::size_t>(x);
      const std::uint8_t* za = &a.texels[pixel * static_cast<std::size_t>(a.channels)];
      const std::uint8_t* zb = &b.texels[pixel * static_cast<std::size_t>(b.channels)];
      for (std::size_t c = 0; c < 3; ++c) ++histograms[c][std::size_t{za[c]} * codes + zb[c]];
    }
  }
}

}  // namespace

CodeComparison match_codes(std::span<const CodedShot> shots) {
  Grid grid{shots[0].still.width, shots[0].still.height, 1};
  while (std::int64_t{grid.width / grid.step} * (grid.height / grid.step) > enough_pixels) {
    ++grid.step;
  }
  std::vector<std::vector<std::uint8_t>> flat;
  for (const CodedShot& shot : shots) flat.push_back(flat_places(shot.still, grid));

  std::vector<std::size_t> by_exposure(shots.size());
  std::iota(by_exposure.begin(), by_exposure.end(), std::size_t{0});
  std::sort(by_exposure.begin(), by_exposure.end(), [&](std::size_t i, std::size_t j) {
    return shots[i].exposure_s > shots[j].exposure_s;
  });

  CodeComparison comparison;
  std::array<Histogram, 3> histograms;
  constexpr std::size_t reach = 2;
  constexpr double different = 1.3;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    for (std::size_t j = i + 1; j < std::min(i + 1 + reach, shots.size()); ++j) {
      const std::size_t a = by_exposure[i];
      const std::size_t b = by_exposure[j];
      count_codes(shots[a].still, shots[b].still, flat[a], flat[b], grid, histograms);
      for (std::size_t c = 0; c < 3; ++c) {
        append_matches(histograms[c],
                       {.a = static_cast<int>(a),
                        .b = static_cast<int>(b),
                        .channel = static_cast<int>(c),
                        .code_a = 0,
                        .code_b = 0,
                        .sigma_a = 0,
                        .sigma_b = 0,
                        .pixels = 0},
                       comparison.matches);
        if (shots[a].exposure_s > different * shots[b].exposure_s) {
          find_fall(histograms[c], static_cast<int>(c), comparison.falls);
        }
      }
    }
  }
  return comparison;
}

}  // namespace capture
