// Whether the pictures of a lens calibration agree on one focal length.
#include "calibrate/focal_agreement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <span>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "calibrate/rotation_vector.h"
#include "calibrate/view_groups.h"

namespace calibrate {
namespace {

// A picture tells its focal length from so many corners on.
constexpr std::size_t least_corners = 12;
// Beyond, a step no longer follows the slopes: boards that face the camera do not tell.
constexpr double largest_sigma = 0.1;
constexpr double largest_log = 0.5;
constexpr std::size_t least_views = 3;
// Of noise alone, chi squared stays below with this many standard deviations; and small
// disagreements of many pictures, of no account for the error, are let pass.
constexpr double noise_sigmas = 3;
constexpr double least_doubt = 2;

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

// A picture's pose and focal length: turn, shift, logarithm of the factor.
struct Estimate {
  Pose cam_from_board;
  double log_factor = 0;
};

struct Normal {
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
  double squares = 0;
};

class ViewFit {
 public:
  ViewFit(const LensProblem& problem,
          const LensSolve& solve,
          std::span<const SeenCorner> corners,
          std::span<const std::uint8_t> used)
      : problem_(problem),
        solve_(solve),
        corners_(corners),
        used_(used),
        function_(solve.bundle.form),
        by_free_(2 * function_.free_count()) {}

  // Nothing if the lens does not see a corner.
  std::optional<Normal> normal(const Estimate& at) {
    std::vector<double> free = solve_.bundle.free;
    const std::size_t focals = solve_.bundle.form.one_focal ? 1 : 2;
    for (std::size_t i = 0; i < focals; ++i) free[i] *= std::exp(at.log_factor);
    Normal sum;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (used_[i] == 0) continue;
      const Vec3 turned =
          at.cam_from_board.R * corner_of(problem_.board, solve_.bundle.warp_m, corners_[i].index);
      Vec2 q;
      std::array<double, 6> by_point{};
      if (!function_(free.data(), turned + at.cam_from_board.t, q, by_point.data(),
                     by_free_.data())) {
        return std::nullopt;
      }
      const std::array<double, 2> missed{corners_[i].q.x - q.x, corners_[i].q.y - q.y};
      for (std::size_t row = 0; row < 2; ++row) {
        const Vec3 slope{by_point[3 * row], by_point[3 * row + 1], by_point[3 * row + 2]};
        const Vec3 by_turn = cross(turned, slope);
        double by_log = 0;
        for (std::size_t j = 0; j < focals; ++j) {
          by_log += by_free_[row * function_.free_count() + j] * free[j];
        }
        Vector7 J;
        J << by_turn.x, by_turn.y, by_turn.z, slope.x, slope.y, slope.z, by_log;
        sum.information.noalias() += J * J.transpose();
        sum.gradient += J * missed[row];
        sum.squares += missed[row] * missed[row];
      }
    }
    return sum;
  }

 private:
  const LensProblem& problem_;
  const LensSolve& solve_;
  std::span<const SeenCorner> corners_;
  std::span<const std::uint8_t> used_;
  LensFunction function_;
  std::vector<double> by_free_;
};

Estimate moved(const Estimate& from, const Vector7& by) {
  return {{rotation_of({by(0), by(1), by(2)}) * from.cam_from_board.R,
           from.cam_from_board.t + Vec3{by(3), by(4), by(5)}},
          from.log_factor + by(6)};
}

// A picture's factor, its variance for residuals of 1 px, and its squared residuals.
struct Told {
  double factor = 1;
  double variance = 0;
  double squares = 0;
};

// Gauss and Newton's steps, halved where they do not lower the squares.
std::optional<Told> fit(ViewFit& view, const Pose& start) {
  Estimate at{start};
  auto normal = view.normal(at);
  for (int step = 0; step < 20 && normal; ++step) {
    const Vector7 scale = normal->information.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
    const Matrix7 scaled = scale.asDiagonal() * normal->information * scale.asDiagonal();
    const Vector7 by =
        scale.asDiagonal() * scaled.ldlt().solve(scale.asDiagonal() * normal->gradient);
    if (!by.allFinite()) return std::nullopt;
    const double gain = by.dot(normal->gradient);
    if (gain <= 1e-8 * normal->squares) {
      Vector7 last = Vector7::Zero();
      last(6) = scale(6);
      const double variance = scale(6) * scaled.ldlt().solve(last)(6);
      if (!(variance > 0)) return std::nullopt;
      return Told{std::exp(at.log_factor), variance, normal->squares};
    }
    double share = 1;
    for (; share > 1e-3; share *= 0.5) {
      const Estimate next = moved(at, share * by);
      if (std::abs(next.log_factor) > largest_log) continue;
      const auto there = view.normal(next);
      if (!there || there->squares >= normal->squares) continue;
      at = next;
      normal = there;
      break;
    }
    if (share <= 1e-3) return std::nullopt;
  }
  return std::nullopt;
}

// What chi squared over its freedoms stays below: Wilson and Hilferty, "The Distribution of
// Chi-Square", PNAS 17, 1931.
double most_of_noise(double freedoms) {
  const double variance = 2 / (9 * freedoms);
  return std::max(least_doubt, std::pow(1 - variance + noise_sigmas * std::sqrt(variance), 3));
}

}  // namespace

double FocalAgreement::error_factor() const { return disagree() ? std::sqrt(*chi_squared) : 1; }

double FocalAgreement::deviation(std::size_t view) const {
  if (!views[view]) return 0;
  return std::abs(views[view]->factor - mean_factor) / views[view]->sigma;
}

FocalAgreement focal_agreement(const LensProblem& problem,
                               const LensStart& start,
                               const LensSolve& solve) {
  FocalAgreement result;
  result.views.resize(problem.views.size());
  std::vector<std::optional<Told>> told(problem.views.size());
  double squares = 0;
  double freedoms = 0;
  for (std::size_t begin = 0; begin < start.corners.size();) {
    const std::size_t view = start.corners[begin].view;
    std::size_t end = begin;
    while (end < start.corners.size() && start.corners[end].view == view) ++end;
    const auto used = std::span(solve.used).subspan(begin, end - begin);
    const std::size_t count = count_used(used);
    if (count >= least_corners) {
      ViewFit fitted(problem, solve, std::span(start.corners).subspan(begin, end - begin), used);
      told[view] = fit(fitted, solve.bundle.cam_from_board[view]);
      if (told[view]) {
        squares += told[view]->squares;
        freedoms += 2 * static_cast<double>(count) - 7;
      }
    }
    begin = end;
  }
  if (!(squares > 0)) return result;
  double weights = 0;
  double sum = 0;
  for (std::size_t view = 0; view < told.size(); ++view) {
    if (!told[view]) continue;
    const double sigma = told[view]->factor * std::sqrt(told[view]->variance * squares / freedoms);
    if (sigma > largest_sigma) continue;
    result.views[view] = ViewFocal{told[view]->factor, sigma};
    ++result.told;
    weights += 1 / (sigma * sigma);
    sum += told[view]->factor / (sigma * sigma);
  }
  const std::vector<std::size_t> groups = view_groups(problem.board, problem.views);
  std::set<std::size_t> places;
  for (std::size_t view = 0; view < told.size(); ++view) {
    if (result.views[view]) places.insert(groups[view]);
  }
  if (places.size() < least_views) return result;
  result.mean_factor = sum / weights;
  double spread = 0;
  for (std::size_t view = 0; view < told.size(); ++view) {
    spread += result.deviation(view) * result.deviation(view);
  }
  const auto freedoms_of_spread = static_cast<double>(result.told - 1);
  result.chi_squared = spread / freedoms_of_spread;
  // Views of a board that was held still differ from the mean together.
  result.most = most_of_noise(static_cast<double>(places.size() - 1));
  return result;
}

}  // namespace calibrate
