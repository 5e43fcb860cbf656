// Poses to start from: those of three sights each that explain the others best.
#include "calibrate/pose_seeds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "calibrate/three_points.h"

namespace calibrate {
namespace {

// Up to this many sights, all triples are tried.
constexpr std::size_t all_triples = 8;
constexpr std::size_t fewest_triples = 40;
constexpr std::size_t most_triples = 1000;
constexpr std::size_t most_seeds = 5;
constexpr double same_seed = 0.1;

// A few different poses of triples, the best first.
class BestSeeds {
 public:
  BestSeeds(std::span<const Sight> sights, Vec3 centre, double loss_px)
      : sights_(sights), centre_(centre), loss_(loss_px * loss_px) {
    const std::size_t step = (sights.size() + most_seed_sights - 1) / most_seed_sights;
    for (std::size_t i = 0; i < sights.size(); i += step) compared_.push_back(sights[i]);
  }

  void try_triple(std::size_t a, std::size_t b, std::size_t c) {
    const auto poses = solve_three_points({sights_[a].v_cam, sights_[b].v_cam, sights_[c].v_cam},
                                          {sights_[a].p_set, sights_[b].p_set, sights_[c].p_set});
    for (const Pose& pose : poses) add({pose, cost_of(pose)});
  }

  const std::vector<PoseSeed>& best() const { return best_; }

  // The share of sights that the best one explains.
  double share_explained() const {
    if (best_.empty()) return 0;
    std::size_t count = 0;
    for (const Sight& sight : compared_) {
      count += squared(residual_of(sight, best_[0].cam_from_set)) < loss_ ? 1 : 0;
    }
    return static_cast<double>(count) / static_cast<double>(compared_.size());
  }

 private:
  // The sum of Cauchy's losses is the logarithm of a product.
  double cost_of(const Pose& pose) const {
    double product = 1;
    double sum = 0;
    for (const Sight& sight : compared_) {
      const Vec3 p = pose * sight.p_set;
      const double ahead = dot(sight.v_cam, p);
      const double x = dot(sight.right, p);
      const double y = dot(sight.down, p);
      const double p2 = dot(p, p);
      // What lies behind the direction is as far off as what lies across it, at least.
      const double r2 = ahead > 0 ? (x * x + y * y) / p2 : dot(sight.right, sight.right);
      product *= 1 + r2 / loss_;
      if (product > 1e100) {
        sum += std::log(product);
        product = 1;
      }
    }
    return sum + std::log(product);
  }

  void add(const PoseSeed& seed) {
    if (!(seed.cost < std::numeric_limits<double>::infinity())) return;
    if (best_.size() == most_seeds && seed.cost >= best_.back().cost) return;
    for (PoseSeed& other : best_) {
      if (distance_between(other.cam_from_set, seed.cam_from_set, centre_) > same_seed) continue;
      if (seed.cost < other.cost) other = seed;
      std::ranges::sort(best_, {}, &PoseSeed::cost);
      return;
    }
    if (best_.size() == most_seeds) best_.pop_back();
    best_.insert(std::ranges::upper_bound(best_, seed.cost, {}, &PoseSeed::cost), seed);
  }

  std::span<const Sight> sights_;
  Vec3 centre_;
  double loss_;
  std::vector<Sight> compared_;
  std::vector<PoseSeed> best_;
};

// Triples until one in a million such searches would have met no triple of right sights.
std::size_t triples_needed(double share_right) {
  const double miss = 1 - share_right * share_right * share_right;
  if (miss <= 1e-6) return fewest_triples;
  const double count = std::log(1e-6) / std::log(miss);
  if (!(count < static_cast<double>(most_triples))) return most_triples;
  return std::max(fewest_triples, static_cast<std::size_t>(count));
}

}  // namespace

double distance_between(const Pose& a, const Pose& b, Vec3 centre) {
  const Mat3 turn = a.R * b.R.transposed();
  const double cosine = (turn.m[0] + turn.m[4] + turn.m[8] - 1) / 2;
  const double move = length(position_of(a) - position_of(b));
  const double range = std::max(length(a * centre), 1e-9);
  return std::max(std::acos(std::clamp(cosine, -1.0, 1.0)), move / range);
}

std::vector<PoseSeed> find_pose_seeds(std::span<const Sight> sights, Vec3 centre, double loss_px) {
  BestSeeds seeds(sights, centre, loss_px);
  const std::size_t n = sights.size();
  if (n <= all_triples) {
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = a + 1; b < n; ++b) {
        for (std::size_t c = b + 1; c < n; ++c) seeds.try_triple(a, b, c);
      }
    }
    return seeds.best();
  }
  std::mt19937 random(1);
  std::size_t needed = fewest_triples;
  for (std::size_t drawn = 0; drawn < needed; ++drawn) {
    const std::size_t a = random() % n;
    const std::size_t b = (a + 1 + random() % (n - 1)) % n;
    std::size_t c = random() % n;
    while (c == a || c == b) c = (c + 1) % n;
    seeds.try_triple(a, b, c);
    if (drawn + 1 == needed) needed = std::max(needed, triples_needed(seeds.share_explained()));
  }
  return seeds.best();
}

}  // namespace calibrate
