// Responses and exposure ratios from matched codes: robust Gauss-Newton with damping.
#include "capture/response_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Dense>

#include "capture/median.h"

namespace capture {
namespace {

constexpr double white = Response::codes - 1;
constexpr double exposure_prior = 0.05;  // shutters are off by several percent
constexpr double judged_from = 25;       // codes by which curves are judged
constexpr double judged_to = 235;
constexpr double changed_from = 5;  // deviations; what is beyond them is no error of a curve
constexpr int channels = CurveFamily::channels;

using Parameters = Eigen::VectorXd;  // of all channels, then a logarithm per exposure

struct Problem {
  const CurveFamily& family;
  std::span<const CodeMatch> matches;
  std::vector<double> claimed;  // logarithms of the exposures

  Eigen::Index exposure_index(int shot) const { return channels * family.parameters() + shot; }
  Eigen::Index size() const { return exposure_index(static_cast<int>(claimed.size())); }

  Parameters start() const {
    Parameters p = Parameters::Zero(size());
    for (int c = 0; c < channels; ++c) {
      // A power of 2.2, or z^2: both near what cameras do.
      if (family.kind == CurveFamily::Kind::power) p[c] = 2.2;
      if (family.kind == CurveFamily::Kind::polynomial) p[c * family.parameters()] = -1;
    }
    for (std::size_t i = 0; i < claimed.size(); ++i)
      p[exposure_index(static_cast<int>(i))] = claimed[i];
    return p;
  }
};

// One match's disagreement in units of its standard deviation, with what is needed to lessen it.
struct Residual {
  double value = 0;
  LogLight a;
  LogLight b;
  double scale = 0;  // 1 / standard deviation
};

Residual residual_of(const Problem& problem, const Parameters& p, const CodeMatch& match) {
  const double* channel = p.data() + match.channel * problem.family.parameters();
  Residual r;
  r.a = problem.family.log_light(match.channel, channel, match.code_a / white);
  r.b = problem.family.log_light(match.channel, channel, match.code_b / white);
  const double ratio = p[problem.exposure_index(match.a)] - p[problem.exposure_index(match.b)];
  // Errors of codes become errors of light by a slope that cameras have about (light = code^2), not
  // by the fitted one: else a curve could lessen its residuals by growing steep.
  constexpr double typical_power = 2;
  constexpr double model_sigma = 0.005;  // no curve of few parameters does better
  r.scale =
      1 / (typical_power * std::hypot(match.sigma_a / match.code_a, match.sigma_b / match.code_b) +
           model_sigma);
  r.value = (r.a.value - r.b.value - ratio) * r.scale;
  return r;
}

// Cauchy's loss: a match that is off by many standard deviations hardly pulls.
constexpr double cauchy_squared = 9;  // its width, 3 standard deviations
double loss(double r) { return cauchy_squared * std::log1p(r * r / cauchy_squared); }
double loss_weight(double r) { return 1 / (1 + r * r / cauchy_squared); }

// How much wider than their standard deviations the residuals spread: at least 1, more for curves
// that do not fit, all of whose matches would otherwise count as outliers.
double spread_of(const Problem& problem, const Parameters& p) {
  std::vector<double> sizes;
  for (const CodeMatch& match : problem.matches) {
    sizes.push_back(std::abs(residual_of(problem, p, match).value));
  }
  return std::max(1.0, sigma_by_median * median_in_place(sizes));
}

struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
  double cost = 0;

  explicit NormalEquations(Eigen::Index size)
      : matrix(Eigen::MatrixXd::Zero(size, size)), gradient(Eigen::VectorXd::Zero(size)) {}

  // A row of few entries: (index, derivative).
  void add(std::span<const std::pair<Eigen::Index, double>> row, double residual, double weight) {
    for (const auto& [i, di] : row) {
      gradient[i] += weight * di * residual;
      for (const auto& [j, dj] : row) matrix(i, j) += weight * di * dj;
    }
  }
};

void add_matches(const Problem& problem,
                 const Parameters& p,
                 double spread,
                 NormalEquations& equations) {
  std::vector<std::pair<Eigen::Index, double>> row;
  for (const CodeMatch& match : problem.matches) {
    Residual r = residual_of(problem, p, match);
    r.value /= spread;
    r.scale /= spread;
    row.clear();
    const Eigen::Index first = match.channel * problem.family.parameters();
    for (int i = 0; i < problem.family.parameters(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      row.emplace_back(first + i, (r.a.gradient[k] - r.b.gradient[k]) * r.scale);
    }
    row.emplace_back(problem.exposure_index(match.a), -r.scale);
    row.emplace_back(problem.exposure_index(match.b), r.scale);
    equations.add(row, r.value, loss_weight(r.value));
    equations.cost += loss(r.value);
  }
}

// The shots that have matches enough to be solved.
std::vector<bool> solved_shots(const Problem& problem) {
  std::vector<std::size_t> counts(problem.claimed.size(), 0);
  for (const CodeMatch& match : problem.matches) {
    ++counts[static_cast<std::size_t>(match.a)];
    ++counts[static_cast<std::size_t>(match.b)];
  }
  // A shot that is mostly clipped has few, and those may well be what moved.
  constexpr std::size_t least_share = 10;
  const std::size_t most = *std::max_element(counts.begin(), counts.end());
  std::vector<bool> solved;
  for (const std::size_t count : counts) solved.push_back(least_share * count >= most);
  return solved;
}

// Shutters keep near what they claim, each with its own error; but all of them together, from the
// shortest to the longest, are right: otherwise the response could be any power of itself with
// exposures to match.
void add_claims(const Problem& problem, const Parameters& p, NormalEquations& equations) {
  constexpr double exact = 1e-5;
  const std::vector<bool> solved = solved_shots(problem);
  const auto count = static_cast<double>(std::count(solved.begin(), solved.end(), true));
  double mean = 0;
  for (std::size_t i = 0; i < solved.size(); ++i) {
    if (solved[i]) mean += problem.claimed[i] / count;
  }
  double together = 0;
  std::vector<std::pair<Eigen::Index, double>> lever;
  for (std::size_t i = 0; i < solved.size(); ++i) {
    const Eigen::Index index = problem.exposure_index(static_cast<int>(i));
    const double error = p[index] - problem.claimed[i];
    const double sigma = solved[i] ? exposure_prior : exact;
    const std::array row{std::pair{index, 1 / sigma}};
    equations.add(row, error / sigma, 1);
    equations.cost += error * error / (sigma * sigma);
    if (!solved[i]) continue;
    const double arm = (problem.claimed[i] - mean) / exact;
    together += error * arm;
    lever.emplace_back(index, arm);
  }
  equations.add(lever, together, 1);
  equations.cost += together * together;
}

// Pushes polynomials up where they would fall.
void add_rising(const Problem& problem, const Parameters& p, NormalEquations& equations) {
  constexpr int grid = 64;
  constexpr double least_slope = 0.01;
  constexpr double stiffness = 1e3;
  const int count = problem.family.parameters();
  std::vector<std::pair<Eigen::Index, double>> row;
  for (int c = 0; c < channels; ++c) {
    for (int g = 0; g <= grid; ++g) {
      const double z = static_cast<double>(g) / grid;
      double slope = 1;
      row.clear();
      for (int i = 0; i < count; ++i) {
        // d/dz of z^(i+1) - z^(i+2)
        const double basis = (i + 1) * std::pow(z, i) - (i + 2) * std::pow(z, i + 1);
        slope += p[c * count + i] * basis;
        row.emplace_back(c * count + i, -basis * stiffness);
      }
      if (slope >= least_slope) continue;
      const double r = (least_slope - slope) * stiffness;
      equations.add(row, r, 1);
      equations.cost += r * r;
    }
  }
}

// The same for free curves, which are also held smooth, and near z^2 where nothing is known.
void add_smooth(const Problem& problem, const Parameters& p, NormalEquations& equations) {
  constexpr int count = CurveFamily::free_parameters;
  constexpr double bend_sigma = 0.1;  // of second differences, in logarithms of light
  constexpr double far_sigma = 3;
  std::vector<std::pair<Eigen::Index, double>> row;
  const auto add = [&](double residual) {
    equations.add(row, residual, 1);
    equations.cost += residual * residual;
  };
  for (int c = 0; c < channels; ++c) {
    const Eigen::Index first = c * count;
    for (Eigen::Index i = first; i < first + count; ++i) {
      row = {{i, 1 / far_sigma}};
      add(p[i] / far_sigma);
    }
    for (Eigen::Index i = first; i + 2 < first + count; ++i) {
      row = {{i, 1 / bend_sigma}, {i + 1, -2 / bend_sigma}, {i + 2, 1 / bend_sigma}};
      add((p[i] - 2 * p[i + 1] + p[i + 2]) / bend_sigma);
    }
    constexpr int grid = 64;
    constexpr double least_rise = 1e-3;
    constexpr double stiffness = 1e3;
    LogLight below = problem.family.log_light(c, p.data() + first, 1.0 / grid);
    for (int g = 2; g <= grid; ++g) {
      const LogLight above =
          problem.family.log_light(c, p.data() + first, static_cast<double>(g) / grid);
      const double lacking = least_rise - (above.value - below.value);
      if (lacking > 0) {
        row.clear();
        for (int i = 0; i < count; ++i) {
          const auto k = static_cast<std::size_t>(i);
          row.emplace_back(first + i, -(above.gradient[k] - below.gradient[k]) * stiffness);
        }
        add(lacking * stiffness);
      }
      below = above;
    }
  }
}

NormalEquations equations_at(const Problem& problem, const Parameters& p, double spread) {
  NormalEquations equations(problem.size());
  add_matches(problem, p, spread, equations);
  add_claims(problem, p, equations);
  if (problem.family.kind == CurveFamily::Kind::polynomial) add_rising(problem, p, equations);
  if (problem.family.kind == CurveFamily::Kind::free) add_smooth(problem, p, equations);
  return equations;
}

constexpr int steps_from_afar = 60;
constexpr int steps_from_near = 4;  // where a few matches more or less are all that differs

struct Step {
  Parameters p;
  double cost = 0;
};

// The next parameters of lesser cost, by Levenberg and Marquardt's damping, which is raised until
// there are any; nothing if there are none.
std::optional<Step> next_step(const Problem& problem,
                              const Parameters& p,
                              double spread,
                              const NormalEquations& now,
                              double& damping) {
  constexpr double hopeless = 1e9;
  for (; damping < hopeless; damping *= 10) {
    Eigen::MatrixXd damped = now.matrix;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-12;  // parameters that nothing depends on
    Step step{p - damped.ldlt().solve(now.gradient), 0};
    step.cost = equations_at(problem, step.p, spread).cost;
    if (step.cost < now.cost) return step;
  }
  return std::nullopt;
}

// The spread is renewed as the fit gets better.
Parameters solve(const Problem& problem, Parameters p, int most_steps) {
  constexpr double converged = 1e-4;
  double damping = 1e-3;
  for (int i = 0; i < most_steps; ++i) {
    const double spread = spread_of(problem, p);
    const NormalEquations now = equations_at(problem, p, spread);
    std::optional<Step> step = next_step(problem, p, spread, now, damping);
    if (!step) break;
    p = std::move(step->p);
    if (now.cost - step->cost < converged * now.cost) break;
    damping /= 10;
  }
  return p;
}

// Errors with their weights.
struct Judgement {
  std::vector<std::pair<double, double>> errors;
  void add(double error, double weight) { errors.emplace_back(error, weight); }
  double largest() const {
    std::vector<double> sizes;
    for (const auto& [error, weight] : errors) sizes.push_back(std::abs(error));
    return sizes.empty() ? 0 : changed_from * sigma_by_median * median_in_place(sizes);
  }
  double root_mean_square(double limit = std::numeric_limits<double>::infinity()) const {
    double squares = 0;
    double sum = 0;
    for (const auto& [error, weight] : errors) {
      if (std::abs(error) > limit) continue;
      squares += weight * error * error;
      sum += weight;
    }
    return sum > 0 ? std::sqrt(squares / sum) : std::numeric_limits<double>::infinity();
  }
  double share_above(double limit) const {
    double above = 0;
    double sum = 0;
    for (const auto& [error, weight] : errors) {
      if (std::abs(error) > limit) above += weight;
      sum += weight;
    }
    return sum > 0 ? above / sum : 0;
  }
};

std::vector<double> exposures_of(const Problem& problem, const Parameters& p) {
  double drift = 0;
  const auto count = static_cast<double>(problem.claimed.size());
  for (std::size_t i = 0; i < problem.claimed.size(); ++i) {
    drift += (p[problem.exposure_index(static_cast<int>(i))] - problem.claimed[i]) / count;
  }
  std::vector<double> exposures;
  for (std::size_t i = 0; i < problem.claimed.size(); ++i) {
    exposures.push_back(std::exp(p[problem.exposure_index(static_cast<int>(i))] - drift));
  }
  return exposures;
}

}  // namespace

HeldoutError heldout_error(const CurveFamily& family,
                           std::span<const CodeMatch> matches,
                           const std::vector<double>& claimed) {
  const Problem problem_of_all{family, matches, claimed};
  const Parameters all = solve(problem_of_all, problem_of_all.start(), steps_from_afar);
  Judgement by_code;
  Judgement by_pixel;
  const auto judged = [](double code) { return code >= judged_from && code <= judged_to; };
  for (int held = 0; held < static_cast<int>(claimed.size()); ++held) {
    std::vector<CodeMatch> others;
    std::vector<CodeMatch> about_held;
    for (const CodeMatch& match : matches) {
      const bool about = match.a == held || match.b == held;
      if (!about) {
        others.push_back(match);
      } else if (judged(match.code_a) && judged(match.code_b)) {
        about_held.push_back(match);
      }
    }
    if (others.empty() || about_held.empty()) continue;
    const Problem problem{family, others, claimed};
    Parameters p = solve(problem, all, steps_from_near);
    std::vector<double> offsets;
    p[problem.exposure_index(held)] = 0;
    for (const CodeMatch& match : about_held) {
      const Residual r = residual_of(problem, p, match);
      offsets.push_back(match.a == held ? r.value / r.scale : -r.value / r.scale);
    }
    const double centre = median(offsets);
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      by_code.add(offsets[i] - centre, 1);
      by_pixel.add(offsets[i] - centre, about_held[i].pixels);
    }
  }
  const double limit = by_pixel.largest();
  return {by_code.root_mean_square(), by_pixel.root_mean_square(limit),
          by_pixel.share_above(limit)};
}

CurveFit fit_curve(const CurveFamily& family,
                   std::span<const CodeMatch> matches,
                   const std::vector<double>& claimed) {
  const Problem problem{family, matches, claimed};
  const Parameters p = solve(problem, problem.start(), steps_from_afar);
  return {{p.data(), p.data() + channels * family.parameters()}, exposures_of(problem, p)};
}

}  // namespace capture
