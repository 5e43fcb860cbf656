// The gain from the lightprobe's units to the plate's, from what both tell of the same things.
#include "calibrate/light_gain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <unordered_map>
#include <unordered_set>

#include <Eigen/Dense>

#include "calibrate/words.h"
#include "capture/median.h"

namespace calibrate {
namespace {

constexpr int rounds = 30;
constexpr std::size_t folds = 5;
constexpr std::size_t fewest_for_folds = 5;
// Nine numbers want this many colours.
constexpr std::size_t fewest_for_matrix = 12;
// Width of Cauchy's loss, in standard deviations, and where a pair counts as left out.
constexpr double loss_width = 2.385;
constexpr double left_out_beyond = 4;
// Relative errors are not known better than this.
constexpr double least_spread = 1e-5;

using Used = std::vector<bool>;

void check(std::span<const LightPair> pairs) {
  for (const LightPair& pair : pairs) {
    for (std::size_t c = 0; c < 3; ++c) {
      if (!(pair.probe[c] > 0) || !(pair.plate[c] > 0) || !std::isfinite(pair.probe[c]) ||
          !std::isfinite(pair.plate[c])) {
        throw std::invalid_argument("pairs of light are finite and above 0");
      }
    }
  }
  if (pairs.empty()) {
    throw std::runtime_error(
        "there is nothing that the probe and the plate both tell the light of: state a grey card, "
        "or turn the cameras so that they see things in common");
  }
}

// Robust standard deviation about 0.
double spread_of(std::span<const double> errors) {
  std::vector<double> sizes;
  for (const double e : errors) sizes.push_back(std::abs(e));
  return sizes.empty()
             ? least_spread
             : std::max(least_spread, capture::sigma_by_median * capture::median_in_place(sizes));
}

double weight_of(double error, double spread) {
  const double r = error / (loss_width * spread);
  return 1 / (1 + r * r);
}

// Each pair's thing, counted from 0 by first appearance, and how many there are.
struct Things {
  std::vector<std::size_t> of_pair;
  std::size_t count = 0;
};

Things things_of(std::span<const LightPair> pairs) {
  Things things;
  std::unordered_map<std::size_t, std::size_t> known;
  for (const LightPair& pair : pairs) {
    const bool own = pair.thing == LightPair::of_its_own;
    const auto at = own ? known.end() : known.try_emplace(pair.thing, things.count).first;
    things.of_pair.push_back(own ? things.count : at->second);
    things.count = std::max(things.count, things.of_pair.back() + 1);
  }
  return things;
}

// Logarithms of the gains and of every frame's exposure.
struct Logs {
  std::array<double, 3> gain{};
  std::vector<double> exposure;
};

double log_ratio(const LightPair& pair, std::size_t c) {
  return std::log(pair.plate[c] / pair.probe[c]);
}

double error_of(const LightPair& pair, std::size_t c, const Logs& logs) {
  return log_ratio(pair, c) - logs.gain[c] - logs.exposure[pair.frame];
}

// Of the things in use about the gains. Of two, neither is to be doubted for the other.
double spread_of(std::span<const LightPair> pairs,
                 const Things& things,
                 const Logs& logs,
                 const Used& used) {
  std::vector<double> errors;
  std::unordered_set<std::size_t> different;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!used[i]) continue;
    different.insert(things.of_pair[i]);
    for (std::size_t c = 0; c < 3; ++c) errors.push_back(error_of(pairs[i], c, logs));
  }
  const auto n = static_cast<double>(different.size());
  if (n == 2) return std::numeric_limits<double>::infinity();
  return spread_of(errors) * (n > 2 ? std::sqrt(n / (n - 1)) : 1);
}

// Gains and exposures in turn, each the weighted mean of what the other leaves. Medians first.
Logs solve_gains(std::span<const LightPair> pairs, const Things& things, const Used& used) {
  std::size_t frames = 0;
  for (const LightPair& pair : pairs) frames = std::max(frames, pair.frame + 1);
  Logs logs{{}, std::vector<double>(frames, 0.0)};
  std::vector<std::vector<double>> by_frame(frames);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (std::size_t c = 0; used[i] && c < 3; ++c) {
      by_frame[pairs[i].frame].push_back(log_ratio(pairs[i], c));
    }
  }
  for (std::size_t f = 0; f < frames; ++f) {
    if (!by_frame[f].empty()) logs.exposure[f] = capture::median_in_place(by_frame[f]);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> rest;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (used[i]) rest.push_back(error_of(pairs[i], c, logs));
    }
    logs.gain[c] = capture::median_in_place(rest);
  }
  for (int round = 0; round < rounds; ++round) {
    const double spread = spread_of(pairs, things, logs, used);
    const Logs before = logs;
    std::array<double, 3> sum{};
    std::array<double, 3> weights{};
    std::vector<double> frame_sum(frames, 0.0);
    std::vector<double> frame_weights(frames, 0.0);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      for (std::size_t c = 0; used[i] && c < 3; ++c) {
        const double error = error_of(pairs[i], c, before);
        const double weight = weight_of(error, spread);
        sum[c] += weight * error;
        weights[c] += weight;
      }
    }
    for (std::size_t c = 0; c < 3; ++c) logs.gain[c] += sum[c] / weights[c];
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      for (std::size_t c = 0; used[i] && c < 3; ++c) {
        const double error = error_of(pairs[i], c, logs);
        const double weight = weight_of(error, spread);
        frame_sum[pairs[i].frame] += weight * error;
        frame_weights[pairs[i].frame] += weight;
      }
    }
    for (std::size_t f = 0; f < frames; ++f) {
      if (frame_weights[f] > 0) logs.exposure[f] += frame_sum[f] / frame_weights[f];
    }
  }
  return logs;
}

// plate / exposure = matrix * probe, by relative errors.
std::optional<Eigen::Matrix3d> solve_matrix(std::span<const LightPair> pairs,
                                            const Logs& logs,
                                            const Used& used) {
  Eigen::Matrix3d matrix =
      Eigen::Vector3d(std::exp(logs.gain[0]), std::exp(logs.gain[1]), std::exp(logs.gain[2]))
          .asDiagonal();
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto row = static_cast<Eigen::Index>(c);
      const auto error = [&](const LightPair& pair) {
        const Eigen::Map<const Eigen::Vector3d> probe(pair.probe.data());
        return matrix.row(row).dot(probe) * std::exp(logs.exposure[pair.frame]) / pair.plate[c] - 1;
      };
      std::vector<double> errors;
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        if (used[i]) errors.push_back(error(pairs[i]));
      }
      const double spread = spread_of(errors);
      Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        if (!used[i]) continue;
        const Eigen::Map<const Eigen::Vector3d> probe(pairs[i].probe.data());
        const Eigen::Vector3d relative =
            probe * std::exp(logs.exposure[pairs[i].frame]) / pairs[i].plate[c];
        const double weight = weight_of(error(pairs[i]), spread);
        normal += weight * relative * relative.transpose();
        right += weight * relative;
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(normal);
      constexpr double open = 1e-10;  // colours all alike leave the matrix open
      if (!(axes.eigenvalues()[0] > open * axes.eigenvalues()[2])) return std::nullopt;
      matrix.row(row) = normal.ldlt().solve(right).transpose();
    }
  }
  return matrix;
}

// RMS without the worst tenth: what moved, or was in another light. Of none, not a number.
double error_without_worst(std::vector<double> errors) {
  if (errors.empty()) return std::numeric_limits<double>::quiet_NaN();
  for (double& e : errors) e = std::abs(e);
  std::ranges::sort(errors);
  errors.resize(std::max<std::size_t>(1, errors.size() - errors.size() / 10));
  double sum = 0;
  for (const double e : errors) sum += e * e;
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

struct HeldOut {
  double gains = 0;
  std::optional<double> matrix;
};

HeldOut hold_out(std::span<const LightPair> pairs, const Things& things, bool try_matrix) {
  std::vector<double> by_gains;
  std::vector<double> by_matrix;
  bool solved = try_matrix;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    Used used(pairs.size(), true);
    for (std::size_t i = 0; i < used.size(); ++i) used[i] = things.of_pair[i] % folds != fold;
    const Logs logs = solve_gains(pairs, things, used);
    const auto matrix = solved ? solve_matrix(pairs, logs, used) : std::nullopt;
    solved = solved && matrix.has_value();
    // A frame without any pair left has no exposure to judge by.
    std::vector<bool> known(logs.exposure.size(), false);
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (used[i]) known[pairs[i].frame] = true;
    }
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (used[i] || !known[pairs[i].frame]) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        by_gains.push_back(std::expm1(-error_of(pairs[i], c, logs)));
        if (!solved) continue;
        const Eigen::Map<const Eigen::Vector3d> probe(pairs[i].probe.data());
        by_matrix.push_back(matrix->row(static_cast<Eigen::Index>(c)).dot(probe) *
                                std::exp(logs.exposure[pairs[i].frame]) / pairs[i].plate[c] -
                            1);
      }
    }
  }
  HeldOut result{error_without_worst(by_gains), std::nullopt};
  if (solved && !by_matrix.empty()) result.matrix = error_without_worst(by_matrix);
  return result;
}

// By how much the probe's colours differ from each other, in logarithms.
double colour_spread(std::span<const LightPair> pairs) {
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t c : {std::size_t{0}, std::size_t{2}}) {
    std::vector<double> tints;
    for (const LightPair& pair : pairs) tints.push_back(std::log(pair.probe[c] / pair.probe[1]));
    const double middle = capture::median(tints);
    for (double& tint : tints) tint -= middle;
    least = std::min(least, spread_of(tints));
  }
  return least;
}

// Exposures relative to the first frame that has one; the gains take up its own.
void set_exposures(std::span<const LightPair> pairs, const Logs& logs, LightGain& fit) {
  std::vector<bool> seen(logs.exposure.size(), false);
  for (const LightPair& pair : pairs) seen[pair.frame] = true;
  const auto first = static_cast<std::size_t>(std::ranges::find(seen, true) - seen.begin());
  for (std::size_t f = 0; f < seen.size(); ++f) {
    fit.exposures.push_back(seen[f] ? std::exp(logs.exposure[f] - logs.exposure[first]) : 0);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    fit.gain[c] = std::exp(logs.gain[c] + logs.exposure[first]);
  }
}

// What a standard deviation by so few freedoms is to be multiplied by to hold 68 %: Student's t.
double student(double freedoms) {
  constexpr std::array few{1.837, 1.321, 1.197, 1.142, 1.111};
  const auto at = static_cast<std::size_t>(freedoms) - 1;
  return at < few.size() ? few[at] : 1 + 0.56 / freedoms;
}

// Of the gains at the first frame's exposure: what each thing's errors do to them together, the
// other frames' exposures eliminated.
void set_sigmas(std::span<const LightPair> pairs,
                const Things& things,
                const Logs& logs,
                LightGain& fit) {
  const Used all(pairs.size(), true);
  const double spread = spread_of(pairs, things, logs, all);
  std::size_t first = logs.exposure.size();
  for (const LightPair& pair : pairs) {
    first = std::min(first, pair.frame);
    double worst = 0;
    for (std::size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(error_of(pair, c, logs)));
    fit.left_out += worst > left_out_beyond * spread ? 1 : 0;
  }
  fit.sigma.fill(1);
  std::unordered_set<std::size_t> in_first;
  std::vector<Eigen::Vector3d> slopes(logs.exposure.size(), Eigen::Vector3d::Zero());
  const auto index = [](std::size_t c) { return static_cast<Eigen::Index>(c); };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].frame == first) in_first.insert(things.of_pair[i]);
    for (std::size_t c = 0; c < 3; ++c) {
      const double r = error_of(pairs[i], c, logs) / (loss_width * spread);
      const double weight = 1 / (1 + r * r);
      slopes[pairs[i].frame][index(c)] += weight * weight * (1 - r * r);
    }
  }
  if (in_first.size() < 2) return;  // the scale rests on a single thing
  Eigen::Matrix3d matrix = slopes[first].asDiagonal();
  // How a frame's errors shift its exposure; a frame of outliers tells nothing.
  const auto told = [&](std::size_t f) { return slopes[f].minCoeff() > 0; };
  for (std::size_t f = 0; f < slopes.size(); ++f) {
    if (f == first || !told(f)) continue;
    matrix += Eigen::Matrix3d(slopes[f].asDiagonal());
    matrix -= slopes[f] * slopes[f].transpose() / slopes[f].sum();
  }
  std::vector<Eigen::Vector3d> pulls(things.count, Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::size_t f = pairs[i].frame;
    if (f != first && !told(f)) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double error = error_of(pairs[i], c, logs);
      const double pull = weight_of(error, spread) * error;
      pulls[things.of_pair[i]][index(c)] += pull;
      if (f != first) pulls[things.of_pair[i]] -= pull / slopes[f].sum() * slopes[f];
    }
  }
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& pull : pulls) squares += pull * pull.transpose();
  const Eigen::LLT<Eigen::Matrix3d> solver(matrix);
  if (!told(first) || solver.info() != Eigen::Success) return;
  const Eigen::Matrix3d inverse = solver.solve(Eigen::Matrix3d::Identity());
  const auto n = static_cast<double>(in_first.size());
  const Eigen::Matrix3d covariance = n / (n - 1) * inverse * squares * inverse;
  // The spread of a few things in one channel may be small by chance.
  constexpr double few = 5;
  const double pooled = covariance.trace() / 3;
  for (std::size_t c = 0; c < 3; ++c) {
    const double variance = covariance(index(c), index(c));
    fit.sigma[c] = student(n - 1) * std::sqrt(n < few ? pooled : variance);
  }
}

// Between the pairs that the gains make most too bright and most too dark.
double largest_factor(std::span<const LightPair> pairs, const Logs& logs) {
  double low = 0, high = 0;
  for (const LightPair& pair : pairs) {
    double off = -logs.exposure[pair.frame];
    for (std::size_t c = 0; c < 3; ++c) {
      off += (std::log(pair.plate[c] / pair.probe[c]) - logs.gain[c]) / 3;
    }
    low = std::min(low, off), high = std::max(high, off);
  }
  return std::exp(high - low);
}

}  // namespace

LightGain fit_light_gain(std::span<const LightPair> pairs, const LightGainOptions& options) {
  check(pairs);
  const Used all(pairs.size(), true);
  const Things things = things_of(pairs);
  const Logs logs = solve_gains(pairs, things, all);
  LightGain fit;
  set_exposures(pairs, logs, fit);
  set_sigmas(pairs, things, logs, fit);
  if (things.count < fewest_for_folds) {
    fit.warnings.push_back("the gains rest on " + std::to_string(things.count) +
                           (things.count == 1 ? " thing" : " things") +
                           " only, and nothing is left to check them by");
    fit.heldout_error = std::numeric_limits<double>::quiet_NaN();
    const double factor = largest_factor(pairs, logs);
    constexpr double much = 1.3;
    if (factor > much) {
      fit.warnings.push_back(
          words("these differ by a factor of %.1f: is an albedo or a normal wrong?", factor));
    }
    return fit;
  }
  const HeldOut held_out = hold_out(pairs, things, things.count >= fewest_for_matrix);
  fit.heldout_error = held_out.gains;
  fit.matrix_heldout_error = held_out.matrix;
  if (std::isnan(held_out.gains)) {
    fit.warnings.emplace_back(
        "every frame shows a single thing, and nothing is left to check the gains by");
  }
  // Of greys, a matrix would only average the channels' noise.
  constexpr double colours_over_noise = 5;
  if (held_out.matrix && held_out.gains > options.good_enough &&
      colour_spread(pairs) > colours_over_noise * *held_out.matrix &&
      *held_out.matrix < (1 - options.matrix_improves) * held_out.gains) {
    if (const auto matrix = solve_matrix(pairs, logs, all)) {
      const double first =
          std::exp(logs.exposure[pairs.front().frame]) / fit.exposures[pairs.front().frame];
      fit.matrix.emplace();
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(fit.matrix->data()) =
          first * *matrix;
    }
  }
  if (held_out.gains > doubtful_heldout_error) {
    fit.warnings.emplace_back(
        "the pairs disagree widely: things may be near, poses wrong, or the plate not linear");
  }
  return fit;
}

std::array<double, 3> predict(const LightGain& fit, const std::array<double, 3>& probe) {
  std::array<double, 3> plate{};
  for (std::size_t c = 0; c < 3; ++c) {
    plate[c] = fit.gain[c] * probe[c];
    if (!fit.matrix) continue;
    plate[c] = 0;
    for (std::size_t k = 0; k < 3; ++k) plate[c] += (*fit.matrix)[3 * c + k] * probe[k];
  }
  return plate;
}

double follow_exposure(const LightGain& fit, std::span<const LightPair> pairs) {
  check(pairs);
  std::vector<double> logs;
  for (const LightPair& pair : pairs) {
    const std::array<double, 3> expected = predict(fit, pair.probe);
    for (std::size_t c = 0; c < 3; ++c) {
      if (expected[c] > 0) logs.push_back(std::log(pair.plate[c] / expected[c]));
    }
  }
  if (logs.empty()) throw std::runtime_error("no pair of light can be predicted");
  double level = capture::median(logs);
  for (int round = 0; round < rounds; ++round) {
    std::vector<double> errors;
    for (const double log : logs) errors.push_back(log - level);
    const double spread = spread_of(errors);
    double sum = 0;
    double weights = 0;
    for (const double e : errors) {
      sum += weight_of(e, spread) * e;
      weights += weight_of(e, spread);
    }
    level += sum / weights;
  }
  return std::exp(level);
}

}  // namespace calibrate
