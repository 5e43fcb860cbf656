// How a lightprobe is turned, from bright sources that the scene camera sees too.
#include "calibrate/source_match.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

namespace calibrate {
namespace {

// Two sources nearer together than this tell a rotation badly.
constexpr double least_apart_rad = 0.05;
// Rotations that are looked at closely, and how far apart they are at least, in tolerances.
constexpr std::size_t most_rotations = 20;
constexpr double other_rotation = 3;
// A source that the other camera should see as well, and does not, counts against a rotation.
constexpr double missing_cost = 0.5;
// By this much the best rotation must be better, in sources or likeness.
constexpr double clearly_better = 0.3;
constexpr std::size_t compared_directions = 4000;
constexpr std::size_t fewest_compared = 40;

double angle_between(Vec3 a, Vec3 b) { return std::atan2(length(cross(a, b)), dot(a, b)); }

double angle_between(const Mat3& a, const Mat3& b) {
  const Mat3 turn = a * b.transposed();
  return std::acos(std::clamp((turn.m[0] + turn.m[4] + turn.m[8] - 1) / 2, -1.0, 1.0));
}

std::optional<Vec2> pixel_inside(const Lens& lens, Vec3 v_cam) {
  const auto q = project(lens, v_cam);
  if (!q || q->x < 1 || q->y < 1 || q->x > lens.width - 2 || q->y > lens.height - 2) {
    return std::nullopt;
  }
  return q;
}

// Indices of a source of the camera, and of the probe.
struct Pair {
  std::size_t camera = 0;
  std::size_t probe = 0;
};

struct Candidate {
  Mat3 probe_from_set;
  std::vector<Pair> pairs;
  double score = 0;
  int missing = 0;  // sources that the other picture should show, too
};

// Everything that rotations are judged by.
struct Matcher {
  LensedPicture camera;
  LensedPicture probe;
  Mat3 cam_from_set;
  double tolerance_rad;
  std::vector<BrightSource> camera_sources;
  std::vector<BrightSource> probe_sources;
  std::vector<Vec3> v_set;  // of the camera's sources

  Candidate judge(const Mat3& probe_from_set) const;
  double likeness(const Mat3& probe_from_set) const;
  std::vector<Candidate> candidates() const;
  RotationFit refine(const Candidate& candidate) const;
};

Candidate Matcher::judge(const Mat3& probe_from_set) const {
  Candidate candidate{probe_from_set, {}, 0};
  std::vector<bool> used(probe_sources.size(), false);
  for (std::size_t i = 0; i < v_set.size(); ++i) {
    const Vec3 expected = probe_from_set * v_set[i];
    std::optional<std::size_t> nearest;
    double least = tolerance_rad;
    for (std::size_t k = 0; k < probe_sources.size(); ++k) {
      const double off = angle_between(expected, probe_sources[k].v_cam);
      if (used[k] || off > least) continue;
      least = off;
      nearest = k;
    }
    if (nearest) {
      used[*nearest] = true;
      candidate.pairs.push_back({i, *nearest});
      // The nearer, the better: of like sets of pairs, the tightest.
      candidate.score += 1 - 0.2 * least / tolerance_rad;
    } else if (pixel_inside(*probe.lens, expected)) {
      ++candidate.missing;
    }
  }
  const Mat3 cam_from_probe = cam_from_set * probe_from_set.transposed();
  for (std::size_t k = 0; k < probe_sources.size(); ++k) {
    if (!used[k] && pixel_inside(*camera.lens, cam_from_probe * probe_sources[k].v_cam)) {
      ++candidate.missing;
    }
  }
  candidate.score -= missing_cost * candidate.missing;
  return candidate;
}

// The mean of the channels over 3 x 3 pixels.
double light_at(const capture::Image& image, Vec2 q) {
  const int x = static_cast<int>(std::lround(q.x));
  const int y = static_cast<int>(std::lround(q.y));
  double sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int c = 0; c < image.channels; ++c) sum += image.at(y + dy, x + dx, c);
    }
  }
  return sum / (9 * image.channels);
}

double Matcher::likeness(const Mat3& probe_from_set) const {
  double n = 0, sx = 0, sy = 0, sxx = 0, syy = 0, sxy = 0;
  for (std::size_t i = 0; i < compared_directions; ++i) {
    // Fibonacci's spiral: evenly over the sphere.
    const double z = 1 - 2 * (static_cast<double>(i) + 0.5) / compared_directions;
    const double turn = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    const Vec3 v{r * std::cos(turn), r * std::sin(turn), z};
    const auto q_camera = pixel_inside(*camera.lens, cam_from_set * v);
    if (!q_camera) continue;
    const auto q_probe = pixel_inside(*probe.lens, probe_from_set * v);
    if (!q_probe) continue;
    const double x = std::log(light_at(*camera.radiance, *q_camera));
    const double y = std::log(light_at(*probe.radiance, *q_probe));
    if (!std::isfinite(x) || !std::isfinite(y)) continue;
    n += 1;
    sx += x;
    sy += y;
    sxx += x * x;
    syy += y * y;
    sxy += x * y;
  }
  const double variance = (n * sxx - sx * sx) * (n * syy - sy * sy);
  if (n < static_cast<double>(fewest_compared) || !(variance > 0)) return 0;
  return (n * sxy - sx * sy) / std::sqrt(variance);
}

// The rotation of two directions; not to be asked for directions on one axis.
Mat3 rotation_of_two(Vec3 a, Vec3 b, Vec3 to_a, Vec3 to_b) {
  const auto frame = [](Vec3 p, Vec3 q) {
    const Vec3 x = normalize(p + q);
    const Vec3 z = normalize(cross(p, q));
    const Vec3 y = cross(z, x);
    return Mat3{{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}};
  };
  return frame(to_a, to_b) * frame(a, b).transposed();
}

std::vector<Candidate> Matcher::candidates() const {
  std::vector<Candidate> best;
  const auto add = [&](const Mat3& R) {
    Candidate candidate = judge(R);
    if (candidate.pairs.size() < 2) return;
    for (Candidate& other : best) {
      if (angle_between(other.probe_from_set, R) > other_rotation * tolerance_rad) continue;
      if (candidate.score > other.score) other = std::move(candidate);
      return;
    }
    best.push_back(std::move(candidate));
  };
  for (std::size_t i = 0; i < v_set.size(); ++i) {
    for (std::size_t j = i + 1; j < v_set.size(); ++j) {
      const double apart = angle_between(v_set[i], v_set[j]);
      if (apart < least_apart_rad || apart > std::numbers::pi - least_apart_rad) continue;
      for (std::size_t k = 0; k < probe_sources.size(); ++k) {
        for (std::size_t l = 0; l < probe_sources.size(); ++l) {
          const Vec3 a = probe_sources[k].v_cam;
          const Vec3 b = probe_sources[l].v_cam;
          if (k == l || std::abs(angle_between(a, b) - apart) > tolerance_rad) continue;
          add(rotation_of_two(v_set[i], v_set[j], a, b));
        }
      }
    }
  }
  std::ranges::stable_sort(best, std::ranges::greater{}, &Candidate::score);
  if (best.size() > most_rotations) best.resize(most_rotations);
  for (Candidate& candidate : best) candidate.score += likeness(candidate.probe_from_set);
  std::ranges::stable_sort(best, std::ranges::greater{}, &Candidate::score);
  return best;
}

RotationFit Matcher::refine(const Candidate& candidate) const {
  std::vector<SeenDirection> directions;
  for (const Pair& pair : candidate.pairs) {
    directions.push_back(
        {probe_sources[pair.probe].v_cam, v_set[pair.camera],
         std::hypot(probe_sources[pair.probe].sigma_rad, camera_sources[pair.camera].sigma_rad)});
  }
  return fit_rotation(directions);
}

std::string counted(std::size_t camera, std::size_t probe) {
  return std::to_string(camera) + " bright source" + (camera == 1 ? "" : "s") +
         " in the camera's picture and " + std::to_string(probe) + " in the probe's";
}

}  // namespace

SourceMatch match_sources(const LensedPicture& camera,
                          const Mat3& cam_from_set,
                          const LensedPicture& probe,
                          double tolerance_rad) {
  if (!(tolerance_rad > 0 && tolerance_rad < 1)) {
    throw std::invalid_argument("the tolerance of sources' directions must be above 0 and below 1");
  }
  Matcher matcher{camera, probe, cam_from_set, tolerance_rad, {}, {}, {}};
  matcher.camera_sources = find_bright_sources(*camera.radiance, *camera.lens);
  matcher.probe_sources = find_bright_sources(*probe.radiance, *probe.lens);
  for (const BrightSource& source : matcher.camera_sources) {
    matcher.v_set.push_back(cam_from_set.transposed() * source.v_cam);
  }
  const std::string found = counted(matcher.camera_sources.size(), matcher.probe_sources.size());
  const std::vector<Candidate> candidates = matcher.candidates();
  if (candidates.empty()) {
    throw std::runtime_error(
        "there are " + found +
        ", but no two of them at equal angles to each other: with a single source in common, the "
        "probe could be turned about it; light a second lamp that both see, or use markers");
  }
  const Candidate& best = candidates.front();
  if (candidates.size() > 1 && candidates[1].score > best.score - clearly_better) {
    throw std::runtime_error(
        "there are " + found +
        ", but the probe could be turned in two ways to match them: light another lamp that both "
        "see, off the line of the others, or use markers");
  }
  SourceMatch match;
  match.fit = matcher.refine(best);
  for (const Pair& pair : best.pairs) {
    match.camera_sources.push_back(matcher.camera_sources[pair.camera]);
    match.probe_sources.push_back(matcher.probe_sources[pair.probe]);
  }
  match.likeness = matcher.likeness(match.fit.cam_from_set);
  constexpr double unlike = 0.3;
  if (match.likeness < unlike) {
    match.warnings.emplace_back(
        "beyond their bright sources the pictures are hardly alike: see whether the probe's light "
        "falls where it should");
  }
  if (best.pairs.size() == 2) {
    match.warnings.emplace_back("only two sources are in common: a third would confirm them");
  }
  if (best.missing > 0) {
    match.warnings.push_back(
        std::to_string(best.missing) +
        (best.missing == 1 ? " bright source is" : " bright sources are") +
        " not where the other camera should see it too: is one hidden or too faint there, is a "
        "picture mirrored, or the lens another's?");
  }
  return match;
}

}  // namespace calibrate
