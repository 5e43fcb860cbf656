// Noise over light, robustly.
#include "compositing/plate_noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/half.h"
#include "capture/median.h"
#include "compositing/clean_plate.h"

namespace compositing {
namespace {

using capture::HalfImage;

constexpr int run = 16;    // pixels of a row whose variance is taken together
constexpr int beside = 4;  // of a run: somebody's edge is no nearer
// Of those that many show the plate.
constexpr double least_showing = 0.9;
// Of runs with 15 or 16 degrees of freedom, the median of variances over their mean.
constexpr double median_of_variance = 0.957;
constexpr std::size_t enough_runs = 200000, most_groups = 48, runs_of_group = 20, least_groups = 3;
constexpr int reach = 2;  // of what surrounds a pixel

struct Run {
  float light, variance;
};

bool tells_noise(float light) { return light > 0 && light < clipped_light; }

// Rows, so many of one frame after the other, that hold enough runs.
std::size_t row_step(std::size_t rows, int width) {
  const std::size_t of_row = 3 * std::max<std::size_t>(1, static_cast<std::size_t>(width / run));
  return std::max<std::size_t>(1, rows * of_row / enough_runs);
}

std::vector<float> row_of(const HalfImage& frame, int y) {
  std::vector<float> light(static_cast<std::size_t>(frame.width) * 3);
  capture::floats_from_halves({&frame.pixels[frame.index(y, 0)], light.size()}, light.data());
  return light;
}

// Runs of a row of differences of noise alone: `share` is their variance over that of a pixel, and
// `centred` takes the run's own mean off. `light` is what they are of.
void add_runs(const std::vector<float>& light,
              const std::vector<float>& off,
              const std::vector<std::uint8_t>& shows,
              double share,
              bool centred,
              std::vector<Run>& runs) {
  const auto width = static_cast<int>(shows.size());
  for (int first = 0; first + run <= width; first += run) {
    const auto from = shows.begin() + std::max(0, first - beside);
    const auto to = shows.begin() + std::min(width, first + run + beside);
    if (static_cast<double>(std::count(from, to, 1)) <
        least_showing * static_cast<double>(to - from))
      continue;
    for (int c = 0; c < 3; ++c) {
      double sum = 0, squares = 0, lights = 0;
      bool whole = true;
      for (int x = first; x < first + run; ++x) {
        const auto i = static_cast<std::size_t>(3 * x + c);
        whole = whole && tells_noise(light[i]);
        sum += off[i], squares += double{off[i]} * off[i], lights += light[i];
      }
      if (!whole) continue;
      const double variance = centred ? (squares - sum * sum / run) / (run - 1) : squares / run;
      runs.push_back({static_cast<float>(lights / run), static_cast<float>(variance / share)});
    }
  }
}

// The slope that is the middle one of those between any two, as each is weighed by how far they are
// apart. Sen, "Estimates of the Regression Coefficient Based on Kendall's Tau", JASA 1968, with
// weights.
double middle_slope(const std::vector<Run>& points) {
  struct Slope {
    double slope, weight;
  };
  std::vector<Slope> slopes;
  double all = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      const double apart = points[j].light - points[i].light;
      if (!(apart > 0)) continue;
      slopes.push_back({(points[j].variance - points[i].variance) / apart, apart});
      all += apart;
    }
  }
  std::ranges::sort(slopes, {}, &Slope::slope);
  double so_far = 0;
  for (const Slope& slope : slopes) {
    if ((so_far += slope.weight) >= all / 2) return slope.slope;
  }
  return 0;
}

// The line through the medians of runs that are about equally bright.
std::optional<PlateNoise> line_through(std::vector<Run>& runs, float reaches) {
  std::ranges::sort(runs, {}, &Run::light);
  const std::size_t count = std::min(most_groups, runs.size() / runs_of_group);
  if (count < least_groups) return std::nullopt;
  std::vector<Run> groups;
  std::vector<float> variances, floors;
  for (std::size_t g = 0; g < count; ++g) {
    double light = 0;
    variances.clear();
    for (std::size_t i = runs.size() * g / count; i < runs.size() * (g + 1) / count; ++i) {
      light += runs[i].light;
      variances.push_back(runs[i].variance);
    }
    light /= static_cast<double>(variances.size());
    const double middle = capture::median_in_place(variances) / median_of_variance;
    groups.push_back({static_cast<float>(light), static_cast<float>(middle)});
  }
  if (groups.back().light < reaches) return std::nullopt;
  const auto gain = static_cast<float>(std::max(0.0, middle_slope(groups)));
  for (const Run& group : groups) floors.push_back(group.variance - gain * group.light);
  const float floor = std::max(capture::median_in_place(floors), least_noise_floor);
  const float brightest = gain * groups.back().light + floor;
  if (brightest <= 2 * least_noise_floor) return std::nullopt;  // it holds still
  return PlateNoise{gain, floor};
}

}  // namespace

std::optional<PlateNoise> NoiseSums::line(double least_count) const {
  const double spread = n_ * sxx_ - sx_ * sx_;
  if (n_ < least_count || !(spread > 0)) return std::nullopt;
  const double gain = std::max(0.0, (n_ * sxy_ - sx_ * sy_) / spread);
  return PlateNoise{static_cast<float>(gain),
                    std::max(least_noise_floor, static_cast<float>((sy_ - gain * sx_) / n_))};
}

std::vector<float> smoothed_along(std::span<const float> row) {
  std::vector<float> smooth(row.size());
  const int width = static_cast<int>(row.size() / 3);
  for (int x = 0; x < width; ++x) {
    const int from = std::max(0, x - reach), to = std::min(width, x + reach + 1);
    for (int c = 0; c < 3; ++c) {
      float sum = 0;
      for (int xx = from; xx < to; ++xx) sum += row[static_cast<std::size_t>(3 * xx + c)];
      smooth[static_cast<std::size_t>(3 * x + c)] = sum / static_cast<float>(to - from);
    }
  }
  return smooth;
}

std::optional<PlateNoise> noise_of_steps(std::span<const HalfImage> frames,
                                         const ShowsPlate& shows,
                                         float reaches) {
  if (frames.size() < 2) return std::nullopt;
  const int width = frames.front().width;
  const auto height = static_cast<std::size_t>(frames.front().height);
  const std::size_t rows = height * (frames.size() - 1);
  std::vector<Run> runs;
  std::vector<std::uint8_t> shown(static_cast<std::size_t>(width)), shown_next = shown;
  for (std::size_t i = 0; i < rows; i += row_step(rows, width)) {
    const std::size_t f = i / height;
    const auto y = static_cast<int>(i % height);
    std::vector<float> light = row_of(frames[f], y);
    const std::vector<float> next = row_of(frames[f + 1], y);
    shows(f, y, smoothed_along(light).data(), shown.data());
    shows(f + 1, y, smoothed_along(next).data(), shown_next.data());
    for (std::size_t x = 0; x < shown.size(); ++x) shown[x] &= shown_next[x];
    std::vector<float> off(light.size());
    for (std::size_t k = 0; k < off.size(); ++k) {
      off[k] = next[k] - light[k];
      if (!tells_noise(next[k])) light[k] = next[k];
    }
    add_runs(light, off, shown, 2, true, runs);
  }
  return line_through(runs, reaches);
}

std::optional<PlateNoise> noise_of_grain(std::span<const HalfImage> frames,
                                         const ShowsPlate& shows,
                                         float reaches) {
  constexpr int side = 2 * reach + 1;
  constexpr double share = 1 - 1.0 / (side * side);  // the pixel is one of its surroundings
  if (frames.empty() || frames.front().height < side) return std::nullopt;
  const int width = frames.front().width;
  const auto inner = static_cast<std::size_t>(frames.front().height - 2 * reach);
  const std::size_t rows = inner * frames.size();
  std::vector<Run> runs;
  std::vector<std::uint8_t> shown(static_cast<std::size_t>(width)), all_shown = shown;
  for (std::size_t i = 0; i < rows; i += row_step(rows, width)) {
    const std::size_t f = i / inner;
    const int y = static_cast<int>(i % inner) + reach;
    const std::vector<float> light = row_of(frames[f], y);
    std::vector<float> off = light;
    std::ranges::fill(all_shown, std::uint8_t{1});
    for (int yy = y - reach; yy <= y + reach; ++yy) {
      const std::vector<float> smooth = smoothed_along(row_of(frames[f], yy));
      shows(f, yy, smooth.data(), shown.data());
      for (std::size_t x = 0; x < shown.size(); ++x) all_shown[x] &= shown[x];
      for (std::size_t k = 0; k < off.size(); ++k) off[k] -= smooth[k] / side;
    }
    add_runs(light, off, all_shown, share, false, runs);
  }
  return line_through(runs, reaches);
}

}  // namespace compositing
