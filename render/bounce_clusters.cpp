// Points cut into clusters, and lamps of them.
#include "render/bounce_clusters.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>

namespace render {
namespace {

// Facing the other way counts as being apart by so much of the set's size.
constexpr float size_of_turn = 0.5F;

// Where a point lies and faces, in lengths of the set's size.
using Whereabouts = std::array<float, 6>;

// Points that are to be one lamp, as a part of a list of their numbers.
struct Cluster {
  std::size_t first = 0, end = 0;
  double spread = 0;  // what its light that stays is apart by
  std::size_t axis = 0;
};

// Cuts points into clusters, always the one whose light lies farthest apart, across its widest
// direction at the middle of its light.
class Clusters {
 public:
  explicit Clusters(const std::vector<SurfacePoint>& points) : points_(points) {
    Vec3f lower{1e30F, 1e30F, 1e30F}, upper = -lower;
    for (const SurfacePoint& p : points) {
      const Vec3f at = p.hit.position;
      lower = {std::min(lower.x, at.x), std::min(lower.y, at.y), std::min(lower.z, at.z)};
      upper = {std::max(upper.x, at.x), std::max(upper.y, at.y), std::max(upper.z, at.z)};
    }
    const float per_size = 1 / std::max(length(upper - lower), 1e-6F);
    for (const SurfacePoint& p : points) {
      const Vec3f at = (p.hit.position - lower) * per_size, n = p.hit.normal * (size_of_turn / 2);
      where_.push_back({at.x, at.y, at.z, n.x, n.y, n.z});
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (mean(points[i].sent) > 0) order_.push_back(i);
    }
  }

  std::vector<Cluster> cut(std::size_t most) {
    std::vector<Cluster> clusters;
    if (!order_.empty() && most > 0) clusters.push_back(measured({0, order_.size()}));
    while (clusters.size() < most && !clusters.empty()) {
      const auto widest = std::ranges::max_element(clusters, {}, &Cluster::spread);
      if (!(widest->spread > 0)) break;
      const auto [a, b] = halves(*widest);
      *widest = a;
      clusters.push_back(b);
    }
    return clusters;
  }

  std::span<const std::size_t> of(const Cluster& c) const {
    return std::span(order_).subspan(c.first, c.end - c.first);
  }

 private:
  double weight(std::size_t i) const { return mean(points_[i].sent) * points_[i].stays; }

  Cluster measured(Cluster c) const {
    double sum = 0;
    std::array<double, 6> first{}, second{};
    for (const std::size_t i : of(c)) {
      const double w = weight(i);
      sum += w;
      for (std::size_t k = 0; k < first.size(); ++k) {
        const double at = where_[i][k];
        first[k] += w * at, second[k] += w * at * at;
      }
    }
    for (std::size_t k = 0; k < first.size() && sum > 0 && c.end - c.first > 1; ++k) {
      const double apart = second[k] - first[k] * first[k] / sum;
      if (apart > c.spread) c.spread = apart, c.axis = k;
    }
    return c;
  }

  std::array<Cluster, 2> halves(const Cluster& c) {
    const auto all = std::span(order_).subspan(c.first, c.end - c.first);
    std::ranges::sort(all, [&](std::size_t a, std::size_t b) {
      const float x = where_[a][c.axis], y = where_[b][c.axis];
      return x != y ? x < y : a < b;
    });
    const double sum = std::accumulate(all.begin(), all.end(), 0.0,
                                       [&](double s, std::size_t i) { return s + weight(i); });
    double passed = 0;
    std::size_t cut = 0;
    while (cut < all.size() && passed + weight(all[cut]) <= sum / 2) passed += weight(all[cut++]);
    const std::size_t middle = c.first + std::clamp<std::size_t>(cut, 1, all.size() - 1);
    return {measured({c.first, middle}), measured({middle, c.end})};
  }

  const std::vector<SurfacePoint>& points_;
  std::vector<Whereabouts> where_;
  std::vector<std::size_t> order_;
};

// A lamp where the light of these points has its middle, of as much surface as they light evenly.
LocalLight lamp_of(const std::vector<SurfacePoint>& points, std::span<const std::size_t> of) {
  Vec3f position, normal, sent;
  double sum = 0, uneven = 0;
  for (const std::size_t i : of) {
    const SurfacePoint& p = points[i];
    const float light = mean(p.sent);
    position += p.hit.position * light;
    normal += p.hit.normal * light;
    sent += p.sent;
    sum += light;
    uneven += static_cast<double>(light) * light / p.area_m2;
  }
  const Vec3f middle = position / static_cast<float>(sum);
  const std::size_t nearest = *std::ranges::min_element(of, {}, [&](std::size_t i) {
    const Vec3f away = points[i].hit.position - middle;
    return dot(away, away);
  });
  LocalLight lamp;
  lamp.position = points[nearest].hit.position;
  lamp.normal = normalize(normal);
  if (!(dot(lamp.normal, points[nearest].hit.geometric_normal) > 0)) {
    lamp.normal = points[nearest].hit.geometric_normal;
  }
  lamp.intensity = lamp.planned = sent;
  lamp.area_m2 = static_cast<float>(sum * sum / uneven);
  lamp.bounced = 1;
  return lamp;
}

}  // namespace

Lamps stand_lamps(const std::vector<SurfacePoint>& points, int most) {
  Lamps result;
  Clusters clusters(points);
  for (const Cluster& cluster : clusters.cut(static_cast<std::size_t>(most))) {
    const auto of = clusters.of(cluster);
    result.lamps.push_back(lamp_of(points, of));
    result.points.emplace_back(of.begin(), of.end());
  }
  return result;
}

}  // namespace render
