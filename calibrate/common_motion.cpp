// The time offset between two cameras that see one thing move in space.
#include "calibrate/common_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "calibrate/golden_section.h"
#include "calibrate/signal_search.h"

namespace calibrate {
namespace {

constexpr int terms = 5;
constexpr std::size_t blocks = 8;
// Pairs of places, for the two quadratics' ten numbers.
constexpr double fewest_pairs = 40;
// Variance, in parts of the places', below which a term is noise.
constexpr double noise_share = 1e-5;
constexpr double tolerance_s = 2e-6;
constexpr double most_off_frames = 1.5;
constexpr int steps = 10;  // to either side
// Between the first and the last of four places for a cubic; three frames if none is missing.
constexpr double most_frames = 5.2;

using Terms = Eigen::Matrix<double, terms, 1>;
using Square = Eigen::Matrix<double, terms, terms>;

// The quadratic terms of places, about their middle and by their spread.
class Quadratic {
 public:
  explicit Quadratic(std::span<const SeenPoint> points) {
    const double share = 1 / static_cast<double>(points.size());
    for (const SeenPoint& point : points) {
      middle_.x += share * point.q.x;
      middle_.y += share * point.q.y;
    }
    double variance = 0;
    for (const SeenPoint& point : points) {
      const double away = hypotenuse(point.q.x - middle_.x, point.q.y - middle_.y);
      variance += share * away * away;
    }
    scale_ = 1 / std::sqrt(variance);
  }
  Terms operator()(Vec2 q) const {
    const double x = (q.x - middle_.x) * scale_;
    const double y = (q.y - middle_.y) * scale_;
    Terms t;
    t << x, y, x * x, x * y, y * y;
    return t;
  }

 private:
  Vec2 middle_;
  double scale_ = 1;
};

// Sums over pairs of places at one time.
struct Sums {
  double n = 0;
  Terms a = Terms::Zero(), b = Terms::Zero();
  Square aa = Square::Zero(), bb = Square::Zero(), ab = Square::Zero();

  void add(const Terms& one, const Terms& other) {
    n += 1;
    a += one;
    b += other;
    aa.noalias() += one * one.transpose();
    bb.noalias() += other * other.transpose();
    ab.noalias() += one * other.transpose();
  }
};

Square whitening(const Square& covariance) {
  const double variance = covariance(0, 0) + covariance(1, 1);
  const Square noisy = covariance + noise_share * variance * Square::Identity();
  return Eigen::SelfAdjointEigenSolver<Square>(noisy).operatorInverseSqrt();
}

double canonical_correlation(const Sums& sums) {
  if (sums.n < fewest_pairs) return 0;
  const double n = sums.n;
  const Square aa = sums.aa / n - sums.a * sums.a.transpose() / (n * n);
  const Square bb = sums.bb / n - sums.b * sums.b.transpose() / (n * n);
  const Square ab = sums.ab / n - sums.a * sums.b.transpose() / (n * n);
  if (!(aa.trace() > 0) || !(bb.trace() > 0)) return 0;
  return Eigen::JacobiSVD<Square>(whitening(aa) * ab * whitening(bb)).singularValues()[0];
}

// A frame of A, the last of B's before it, and which eighth of the time they are in.
struct Pair {
  std::size_t in_a = 0;
  std::size_t in_b = 0;
  std::size_t block = 0;
};

class CommonMotion {
 public:
  CommonMotion(std::span<const SeenPoint> a, std::span<const SeenPoint> b)
      : a_(a), b_(b), of_b_(b), longest_s_(most_frames * frame_interval_s(b)) {
    const Quadratic of_a(a);
    for (const SeenPoint& point : a) terms_of_a_.push_back(of_a(point.q));
  }

  // A's places that B's can be interpolated for, at this offset and at those by `reach_s` to either
  // side: pairs that came and went with the offset would make its correlation jump.
  std::vector<Pair> pairs_near(double offset_s, double reach_s) const {
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < a_.size(); ++i) {
      const double t = a_[i].time_s + offset_s;
      const auto k = interval_at(t);
      if (!k || !interval_at(t - reach_s) || !interval_at(t + reach_s)) continue;
      pairs.push_back({i, *k, 0});
    }
    for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].block = i * blocks / pairs.size();
    return pairs;
  }

  // Without a block of the pairs, or (`blocks`) of all.
  double correlation(const std::vector<Pair>& pairs, double offset_s, std::size_t without) const {
    Sums sums;
    for (const Pair& pair : pairs) {
      if (pair.block == without) continue;
      const double t = a_[pair.in_a].time_s + offset_s;
      std::size_t k = pair.in_b;
      while (k + 3 < b_.size() && b_[k + 1].time_s <= t) ++k;
      while (k > 1 && b_[k].time_s > t) --k;
      sums.add(terms_of_a_[pair.in_a], of_b_(place_in_b(k, t)));
    }
    return canonical_correlation(sums);
  }

  // The best offset between two.
  MotionOffset best(const std::vector<Pair>& pairs,
                    double low_s,
                    double high_s,
                    std::size_t without = blocks) const {
    const auto height = [&](double offset_s) { return correlation(pairs, offset_s, without); };
    const double offset_s = maximize(low_s, high_s, tolerance_s, height);
    return {offset_s, height(offset_s)};
  }

 private:
  // That of B's places which begins with this one, if those around it are near enough for a cubic.
  std::optional<std::size_t> interval_at(double t) const {
    const auto after = std::ranges::upper_bound(b_, t, {}, &SeenPoint::time_s) - b_.begin();
    const auto k = static_cast<std::size_t>(after) - 1;
    if (after < 2 || k + 2 >= b_.size()) return std::nullopt;
    if (b_[k + 2].time_s - b_[k - 1].time_s > longest_s_) return std::nullopt;
    return k;
  }

  // Lagrange's cubic through the two places before and the two after.
  Vec2 place_in_b(std::size_t k, double t) const {
    Vec2 q;
    for (std::size_t i = k - 1; i <= k + 2; ++i) {
      double weight = 1;
      for (std::size_t j = k - 1; j <= k + 2; ++j) {
        if (j != i) weight *= (t - b_[j].time_s) / (b_[i].time_s - b_[j].time_s);
      }
      q.x += weight * b_[i].q.x;
      q.y += weight * b_[i].q.y;
    }
    return q;
  }

  std::span<const SeenPoint> a_;
  std::span<const SeenPoint> b_;
  Quadratic of_b_;
  std::vector<Terms> terms_of_a_;
  double longest_s_ = 0;  // of four places that may be interpolated between
};

}  // namespace

MotionOffset refine_motion_offset(std::span<const SeenPoint> a,
                                  std::span<const SeenPoint> b,
                                  double about_s) {
  const CommonMotion motion(a, b);
  // Directions that are linear in the places can be off by about a frame.
  const double frame_s = std::max(frame_interval_s(a), frame_interval_s(b));
  const double step_s = most_off_frames * frame_s / steps;
  MotionOffset coarse{about_s, 0};
  for (int i = -steps; i <= steps; ++i) {
    const double offset_s = about_s + i * step_s;
    const double height = motion.correlation(motion.pairs_near(offset_s, 0), offset_s, blocks);
    if (height > coarse.correlation) coarse = {offset_s, height};
  }
  return motion.best(motion.pairs_near(coarse.offset_s, step_s), coarse.offset_s - step_s,
                     coarse.offset_s + step_s);
}

double motion_sigma_s(std::span<const SeenPoint> a, std::span<const SeenPoint> b, double offset_s) {
  const CommonMotion motion(a, b);
  const double reach_s = 0.5 * std::max(frame_interval_s(a), frame_interval_s(b));
  const std::vector<Pair> pairs = motion.pairs_near(offset_s, reach_s);
  std::array<double, blocks> without{};
  double mean_s = 0;
  for (std::size_t i = 0; i < blocks; ++i) {
    const MotionOffset best = motion.best(pairs, offset_s - reach_s, offset_s + reach_s, i);
    if (best.correlation == 0) return std::numeric_limits<double>::infinity();
    without[i] = best.offset_s;
    mean_s += without[i] / blocks;
  }
  double squares = 0;
  for (const double at_s : without) squares += (at_s - mean_s) * (at_s - mean_s);
  return std::sqrt(squares * (blocks - 1) / blocks);
}

}  // namespace calibrate
