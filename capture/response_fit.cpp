// Responses and exposure ratios from matched codes: robust Gauss-Newton with damping.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <future>
#include <limits>
#include <optional>
#include <stdexcept>

#include <Eigen/Dense>

#include "capture/comparagram.h"
#include "capture/curve_family.h"
#include "capture/response.h"

namespace capture {
namespace {

constexpr double white = Response::codes - 1;
constexpr double exposure_prior = 0.05;  // shutters are off by several percent
constexpr double judged_from = 25;       // codes by which curves are judged
constexpr double judged_to = 235;
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

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// How much wider than their standard deviations the residuals spread: at least 1, more for curves
// that do not fit, all of whose matches would otherwise count as outliers.
double spread_of(const Problem& problem, const Parameters& p) {
  constexpr double sigma_by_median = 1.4826;
  std::vector<double> sizes;
  for (const CodeMatch& match : problem.matches) {
    sizes.push_back(std::abs(residual_of(problem, p, match).value));
  }
  return std::max(1.0, sigma_by_median * median(std::move(sizes)));
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
  if (problem.family.kind != CurveFamily::Kind::polynomial) return;
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

NormalEquations equations_at(const Problem& problem, const Parameters& p, double spread) {
  NormalEquations equations(problem.size());
  add_matches(problem, p, spread, equations);
  add_claims(problem, p, equations);
  add_rising(problem, p, equations);
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

struct Judgement {
  double squares = 0;
  std::size_t count = 0;
  double error() const {
    return count == 0 ? std::numeric_limits<double>::infinity()
                      : std::sqrt(squares / static_cast<double>(count));
  }
};

// Each shot in turn is left out of the fit. What is then free is its exposure, taken from its
// matches' median; the disagreement that stays is the curve's.
double heldout_error(const CurveFamily& family,
                     std::span<const CodeMatch> matches,
                     const std::vector<double>& claimed) {
  const Problem problem_of_all{family, matches, claimed};
  const Parameters all = solve(problem_of_all, problem_of_all.start(), steps_from_afar);
  Judgement judgement;
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
    for (const double offset : offsets) judgement.squares += (offset - centre) * (offset - centre);
    judgement.count += offsets.size();
  }
  return judgement.error();
}

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

std::vector<double> claimed_exposures(std::span<const CodedShot> shots) {
  if (shots.size() < 3) throw std::invalid_argument("a response needs three shots or more");
  std::vector<double> claimed;
  for (const CodedShot& shot : shots) {
    if (!(shot.exposure_s > 0) || !std::isfinite(shot.exposure_s)) {
      throw std::invalid_argument("an exposure time is above 0");
    }
    if (shot.still.width != shots[0].still.width || shot.still.height != shots[0].still.height ||
        shot.still.channels < 3) {
      throw std::invalid_argument("the shots of a bracket need one size");
    }
    claimed.push_back(std::log(shot.exposure_s));
  }
  return claimed;
}

std::runtime_error too_little_shared() {
  return std::runtime_error(
      "the shots share too few flat, unclipped places at different exposures to tell the response; "
      "state it instead (a .rsp file, or sRGB)");
}

std::vector<CodeMatch> enough_matches(std::span<const CodedShot> shots,
                                      const std::vector<double>& claimed) {
  std::vector<CodeMatch> matches = match_codes(shots);
  // Two shots of one exposure tell nothing about the curve.
  constexpr double different = 0.3;
  const auto useful = std::count_if(matches.begin(), matches.end(), [&](const CodeMatch& match) {
    return claimed[static_cast<std::size_t>(match.a)] - claimed[static_cast<std::size_t>(match.b)] >
           different;
  });
  constexpr std::ptrdiff_t least = 100;
  if (useful < least) throw too_little_shared();
  return matches;
}

std::vector<CurveFamily> candidate_families() {
  std::vector<CurveFamily> families;
  families.push_back({CurveFamily::Kind::fixed, 0, srgb_response()});
  families.push_back({CurveFamily::Kind::power, 0, {}});
  for (int degree = 2; degree <= 6; ++degree) {
    families.push_back({CurveFamily::Kind::polynomial, degree, {}});
  }
  return families;
}

}  // namespace

ResponseFit recover_response(std::span<const CodedShot> shots) {
  const std::vector<double> claimed = claimed_exposures(shots);
  const std::vector<CodeMatch> matches = enough_matches(shots, claimed);
  const std::vector<CurveFamily> families = candidate_families();
  std::vector<std::future<double>> errors;
  for (const CurveFamily& family : families) {
    errors.push_back(std::async(std::launch::async, [&family, &matches, &claimed] {
      return heldout_error(family, matches, claimed);
    }));
  }
  ResponseFit fit;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < families.size(); ++i) {
    const double error = errors[i].get();
    fit.candidates.push_back({families[i].name(), channels * families[i].parameters(), error});
    best = std::min(best, error);
  }
  if (!std::isfinite(best)) throw too_little_shared();
  constexpr double as_good = 1.1;
  const auto chosen = std::find_if(fit.candidates.begin(), fit.candidates.end(),
                                   [&](const ResponseCandidate& candidate) {
                                     return candidate.heldout_error <= as_good * best;
                                   });
  const CurveFamily& family = families[static_cast<std::size_t>(chosen - fit.candidates.begin())];
  const Problem problem{family, matches, claimed};
  const Parameters p = solve(problem, problem.start(), steps_from_afar);
  fit.response = family.response(p.data());
  fit.exposures_s = exposures_of(problem, p);
  fit.heldout_error = chosen->heldout_error;
  return fit;
}

ResponseCheck check_response(const Response& response, std::span<const CodedShot> shots) {
  const std::vector<double> claimed = claimed_exposures(shots);
  const std::vector<CodeMatch> matches = enough_matches(shots, claimed);
  const CurveFamily family{CurveFamily::Kind::fixed, 0, response};
  const Problem problem{family, matches, claimed};
  return {heldout_error(family, matches, claimed),
          exposures_of(problem, solve(problem, problem.start(), steps_from_afar))};
}

}  // namespace capture
