// Vignetting by least squares over logarithms, places' light eliminated.
#include "calibrate/vignetting_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>

#include <Eigen/Dense>

#include "calibrate/vignetting.h"
#include "capture/median.h"

namespace calibrate {
namespace {

constexpr int most_terms = 4;
constexpr double least_sensitivity = 0.02;  // whose logarithm is taken
constexpr int folds = 5;

// Samples of one place follow each other; places have two or more.
struct Places {
  std::vector<VignettingSample> samples;
  std::vector<std::size_t> begins;  // of each place, and the end
};

// Without places that are seen once: their light takes up all that they tell.
Places by_place(std::span<const VignettingSample> samples) {
  std::vector<VignettingSample> sorted(samples.begin(), samples.end());
  std::ranges::stable_sort(sorted, {}, &VignettingSample::place);
  Places places;
  for (auto first = sorted.begin(); first != sorted.end();) {
    const auto last = std::find_if(first, sorted.end(),
                                   [&](const auto& other) { return other.place != first->place; });
    if (last - first > 1) {
      places.begins.push_back(places.samples.size());
      places.samples.insert(places.samples.end(), first, last);
    }
    first = last;
  }
  places.begins.push_back(places.samples.size());
  return places;
}

double log_sensitivity(std::span<const double> terms, double angle_rad) {
  return std::log(std::max(least_sensitivity, sensitivity(terms, angle_rad)));
}

// What samples tell beyond the sensitivity: the place's light, left over after its median.
std::vector<double> residuals_of(const Places& places, std::span<const double> terms) {
  std::vector<double> residuals;
  std::vector<double> logs;
  for (std::size_t p = 0; p + 1 < places.begins.size(); ++p) {
    logs.clear();
    for (std::size_t i = places.begins[p]; i < places.begins[p + 1]; ++i) {
      logs.push_back(std::log(places.samples[i].radiance) -
                     log_sensitivity(terms, places.samples[i].angle_rad));
    }
    double centre = 0;
    for (const double log : logs) centre += log / static_cast<double>(logs.size());
    if (logs.size() > 4) centre = capture::median(logs);
    for (const double log : logs) residuals.push_back(log - centre);
  }
  return residuals;
}

// In spreads: residuals from here on pull less and less.
constexpr double loss_width = 3;

// Cauchy's, of the samples in use.
double loss_of(std::span<const double> residuals, const std::vector<bool>& used, double spread) {
  const double width = loss_width * spread;
  double loss = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (used[i]) loss += std::log1p(residuals[i] * residuals[i] / (width * width));
  }
  return loss;
}

// A step of Gauss and Newton from `terms`, whose residuals are known.
Eigen::VectorXd step_from(const Places& places,
                          std::span<const double> terms,
                          const std::vector<bool>& used,
                          std::span<const double> residuals,
                          double spread) {
  const auto count = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  for (std::size_t p = 0; p + 1 < places.begins.size(); ++p) {
    // The derivatives of log sensitivity, less their weighted mean over the place.
    double weights = 0;
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(count);
    double mean_residual = 0;
    std::vector<std::pair<Eigen::VectorXd, double>> rows;
    std::vector<double> row_weights;
    for (std::size_t i = places.begins[p]; i < places.begins[p + 1]; ++i) {
      if (!used[i]) continue;
      const double angle = places.samples[i].angle_rad;
      const double s = std::max(least_sensitivity, sensitivity(terms, angle));
      Eigen::VectorXd row(count);
      double power = 1;
      for (Eigen::Index t = 0; t < count; ++t) row[t] = (power *= angle * angle) / s;
      const double width = loss_width * spread;
      const double weight = 1 / (1 + residuals[i] * residuals[i] / (width * width));
      mean += weight * row;
      mean_residual += weight * residuals[i];
      weights += weight;
      rows.emplace_back(std::move(row), residuals[i]);
      row_weights.push_back(weight);
    }
    if (rows.size() < 2) continue;
    mean /= weights;
    mean_residual /= weights;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Eigen::VectorXd row = rows[i].first - mean;
      matrix += row_weights[i] * row * row.transpose();
      right += row_weights[i] * (rows[i].second - mean_residual) * row;
    }
  }
  matrix.diagonal().array() += 1e-9 * std::max(1.0, matrix.diagonal().maxCoeff());
  return matrix.ldlt().solve(right);
}

// From the terms given, by Gauss-Newton whose steps are halved while the loss rises: where a lens
// dims to a tenth, a full one from no terms ends below zero. `used` says which samples count.
std::vector<double> solve(const Places& places,
                          std::vector<double> terms,
                          const std::vector<bool>& used) {
  constexpr int rounds = 30;
  constexpr int most_halvings = 12;
  std::vector<double> residuals = residuals_of(places, terms);
  for (int round = 0; round < rounds && !terms.empty(); ++round) {
    std::vector<double> sizes;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      if (used[i]) sizes.push_back(std::abs(residuals[i]));
    }
    if (sizes.empty()) break;
    const double spread =
        std::max(1e-6, capture::sigma_by_median * capture::median_in_place(sizes));
    const double loss = loss_of(residuals, used, spread);
    Eigen::VectorXd step = step_from(places, terms, used, residuals, spread);
    bool better = false;
    for (int halving = 0; halving < most_halvings && !better; ++halving) {
      if (halving > 0) step *= 0.5;
      std::vector<double> next = terms;
      for (std::size_t t = 0; t < next.size(); ++t) next[t] += step[static_cast<Eigen::Index>(t)];
      std::vector<double> left = residuals_of(places, next);
      better = loss_of(left, used, spread) <= loss;
      if (better) {
        terms = std::move(next);
        residuals = std::move(left);
      }
    }
    if (!better || step.cwiseAbs().maxCoeff() < 1e-7) break;
  }
  return terms;
}

// Of each count of terms from none on, each from the one before.
std::vector<std::vector<double>> solve_all(const Places& places, const std::vector<bool>& used) {
  std::vector<std::vector<double>> all{{}};
  for (int count = 1; count <= most_terms; ++count) {
    std::vector<double> start = all.back();
    start.push_back(0);
    all.push_back(solve(places, std::move(start), used));
  }
  return all;
}

// What samples that took no part miss by.
struct Heldout {
  double squares = std::numeric_limits<double>::infinity();
  double error = std::numeric_limits<double>::infinity();  // RMS
};

// Of each count of terms. Places are held out; samples, where there is one place.
std::vector<Heldout> heldout_errors(const Places& places) {
  const bool one_place = places.begins.size() == 2;
  std::vector<std::vector<double>> squares(most_terms + 1);
  for (int fold = 0; fold < folds; ++fold) {
    std::vector<bool> used(places.samples.size(), true);
    for (std::size_t i = 0; i < used.size(); ++i) {
      const std::size_t key = one_place ? i : places.samples[i].place;
      if (key * 2654435761U % 4294967296U % folds == static_cast<unsigned>(fold)) used[i] = false;
    }
    const std::vector<std::vector<double>> solved = solve_all(places, used);
    for (std::size_t count = 0; count < solved.size(); ++count) {
      const std::vector<double> residuals = residuals_of(places, solved[count]);
      for (std::size_t i = 0; i < used.size(); ++i) {
        if (!used[i]) squares[count].push_back(residuals[i] * residuals[i]);
      }
    }
  }
  std::vector<Heldout> errors;
  for (std::vector<double>& of_count : squares) {
    if (of_count.empty()) {
      errors.push_back({});
      continue;
    }
    // Without the largest hundredth: what moved.
    std::sort(of_count.begin(), of_count.end());
    of_count.resize(std::max<std::size_t>(1, of_count.size() - of_count.size() / 100));
    double sum = 0;
    for (const double square : of_count) sum += square;
    errors.push_back({sum, std::sqrt(sum / static_cast<double>(of_count.size()))});
  }
  return errors;
}

// The fewest terms that do as well as the best, but for chance: as lens_selection.h has it.
std::size_t fewest_terms(std::span<const Heldout> counts) {
  constexpr double as_good = 1.1;
  constexpr double tolerance = 9;  // variances of a sample: three standard deviations
  const Heldout best = *std::ranges::min_element(counts, {}, &Heldout::error);
  const auto chosen = std::ranges::find_if(counts, [&](const Heldout& count) {
    return count.error <= as_good * best.error &&
           count.squares - best.squares <= tolerance * best.error * best.error;
  });
  return chosen == counts.end() ? 0 : static_cast<std::size_t>(chosen - counts.begin());
}

void check(std::span<const VignettingSample> samples, const Places& places) {
  for (const VignettingSample& sample : samples) {
    if (!(sample.radiance > 0) || !std::isfinite(sample.radiance) || !(sample.angle_rad >= 0) ||
        !std::isfinite(sample.angle_rad)) {
      throw std::invalid_argument("samples of vignetting need radiance above 0 and an angle");
    }
  }
  constexpr double least_spread_rad = 0.1;
  constexpr std::size_t least_samples = 50;
  std::size_t telling = 0;
  for (std::size_t p = 0; p + 1 < places.begins.size(); ++p) {
    const auto first = places.samples.begin() + static_cast<std::ptrdiff_t>(places.begins[p]);
    const auto last = places.samples.begin() + static_cast<std::ptrdiff_t>(places.begins[p + 1]);
    const auto [low, high] = std::minmax_element(
        first, last, [](const auto& a, const auto& b) { return a.angle_rad < b.angle_rad; });
    if (high->angle_rad - low->angle_rad > least_spread_rad) {
      telling += static_cast<std::size_t>(last - first);
    }
  }
  if (telling < least_samples) {
    throw std::runtime_error(
        "too few places are seen at different angles off the axis to tell vignetting; turn the "
        "camera by tens of degrees between shots, or take an even field");
  }
}

// The mean over 3 x 3 pixels and channels, if it can be used.
std::optional<double> sample_at(const capture::Image& image, Vec2 q, double saturation) {
  const int x = static_cast<int>(std::lround(q.x));
  const int y = static_cast<int>(std::lround(q.y));
  if (x < 1 || y < 1 || x + 1 >= image.width || y + 1 >= image.height) return std::nullopt;
  double sum = 0;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      double mean = 0;
      for (int c = 0; c < image.channels; ++c) {
        const auto value = static_cast<double>(image.at(y + dy, x + dx, c));
        if (!std::isfinite(value) || value >= saturation) return std::nullopt;
        mean += value / image.channels;
      }
      low = std::min(low, mean);
      high = std::max(high, mean);
      sum += mean / 9;
    }
  }
  constexpr double uneven = 0.1;
  if (!(sum > 0) || high - low > uneven * sum) return std::nullopt;
  return sum;
}

double angle_of(Vec3 v_cam) { return std::atan2(std::hypot(v_cam.x, v_cam.y), v_cam.z); }

void check_size(const capture::Image& image, const Lens& lens) {
  if (image.width != lens.width || image.height != lens.height || image.empty()) {
    throw std::invalid_argument("shots for vignetting have the lens's size");
  }
}

}  // namespace

VignettingFit fit_vignetting(std::span<const VignettingSample> samples) {
  const Places places = by_place(samples);
  check(samples, places);
  VignettingFit fit;
  const std::vector<Heldout> counts = heldout_errors(places);
  for (const Heldout& count : counts) {
    fit.candidates.push_back({static_cast<int>(fit.candidates.size()), count.error});
  }
  const std::size_t chosen = fewest_terms(counts);
  fit.terms = solve_all(places, std::vector<bool>(places.samples.size(), true))[chosen];
  fit.heldout_error = counts[chosen].error;
  constexpr double large = 0.1;
  if (!(fit.heldout_error < large)) {
    fit.warnings.emplace_back(
        "no terms explain the shots: check that the field is even, or that poses belong to the "
        "shots and the scene stands still, and that the lens is this camera's");
  }
  for (const VignettingSample& sample : places.samples) {
    fit.max_angle_rad = std::max(fit.max_angle_rad, sample.angle_rad);
  }
  return fit;
}

std::vector<VignettingSample> turned_samples(std::span<const TurnedShot> shots,
                                             const Lens& lens,
                                             double saturation) {
  if (shots.empty()) throw std::invalid_argument("there are no shots to tell vignetting");
  for (const TurnedShot& shot : shots) check_size(*shot.radiance, lens);
  constexpr std::size_t directions = 4000;
  std::vector<VignettingSample> samples;
  for (std::size_t i = 0; i < directions; ++i) {
    // Fibonacci's spiral: evenly over the sphere.
    const double z = 1 - 2 * (static_cast<double>(i) + 0.5) / directions;
    const double turn = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    const Vec3 v_set{r * std::cos(turn), r * std::sin(turn), z};
    for (const TurnedShot& shot : shots) {
      const Vec3 v_cam = shot.cam_from_set.R * v_set;
      const std::optional<Vec2> q = project(lens, v_cam);
      if (!q) continue;
      if (const auto value = sample_at(*shot.radiance, *q, saturation)) {
        samples.push_back({i, angle_of(v_cam), *value});
      }
    }
  }
  return samples;
}

std::vector<VignettingSample> even_field_samples(const capture::Image& radiance,
                                                 const Lens& lens,
                                                 double saturation) {
  check_size(radiance, lens);
  constexpr int across = 80;
  const int step = std::max(3, std::max(lens.width, lens.height) / across);
  std::vector<VignettingSample> samples;
  for (int y = 1; y < lens.height; y += step) {
    for (int x = 1; x < lens.width; x += step) {
      const Vec2 q{static_cast<double>(x), static_cast<double>(y)};
      const std::optional<Vec3> v_cam = unproject(lens, q);
      const std::optional<double> value = sample_at(radiance, q, saturation);
      if (v_cam && value) samples.push_back({0, angle_of(*v_cam), *value});
    }
  }
  return samples;
}

}  // namespace calibrate
