// Foerstner's operator on patches of the picture, or of planes across rays.
#include "calibrate/corner_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace calibrate {
namespace {

constexpr double window_share = 0.4;         // of the distance to the nearest corner
constexpr double charuco_window_gaps = 1.7;  // of the gap between a square and its marker
constexpr double min_window_px = 2;
constexpr double max_window_px = 12;
constexpr int max_steps = 20;
constexpr int max_patches = 4;
constexpr double still_px = 1e-3;
constexpr double min_contrast = 6;  // codes, root mean square
// Of the patch with itself, turned by 180 and by 90 degrees.
constexpr double min_half_turn = 0.5;
constexpr double max_quarter_turn = 0.3;
// Where edges are blurred over more than this, those of the next corners mix in.
constexpr double max_edge_windows = 3.4;
constexpr double min_max_edge_px = 16;
constexpr double min_conditioning = 0.02;  // smaller by larger eigenvalue of the edges' directions

// A square of samples around a point, row by row.
struct Patch {
  int reach = 0;  // samples to each side of the middle
  std::vector<float> values;

  float at(int y, int x) const {
    const int side = 2 * reach + 1;
    return values[static_cast<std::size_t>((y + reach) * side + x + reach)];
  }
  // By Sobel's masks, which noise sways less than plain differences.
  Vec2 slope(int y, int x) const {
    const double left = at(y - 1, x - 1) + 2 * at(y, x - 1) + at(y + 1, x - 1);
    const double right = at(y - 1, x + 1) + 2 * at(y, x + 1) + at(y + 1, x + 1);
    const double above = at(y - 1, x - 1) + 2 * at(y - 1, x) + at(y - 1, x + 1);
    const double below = at(y + 1, x - 1) + 2 * at(y + 1, x) + at(y + 1, x + 1);
    return {(right - left) / 8, (below - above) / 8};
  }
  float between(double y, double x) const {
    const int top = std::clamp(static_cast<int>(std::floor(y)), -reach, reach - 1);
    const int left = std::clamp(static_cast<int>(std::floor(x)), -reach, reach - 1);
    const auto v = static_cast<float>(y - top);
    const auto u = static_cast<float>(x - left);
    return (1 - v) * ((1 - u) * at(top, left) + u * at(top, left + 1)) +
           v * ((1 - u) * at(top + 1, left) + u * at(top + 1, left + 1));
  }
};

bool is_inside(const GreyPicture& picture, Vec2 q) {
  return q.x >= 0 && q.y >= 0 && q.x <= picture.width - 1 && q.y <= picture.height - 1;
}

double code_range(const Patch& patch, double window) {
  const int reach = static_cast<int>(window);
  float low = HUGE_VALF;
  float high = -HUGE_VALF;
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      if (x * x + y * y > window * window) continue;
      low = std::min(low, patch.at(y, x));
      high = std::max(high, patch.at(y, x));
    }
  }
  return high - low;
}

// Over how many pixels the more blurred of two edges through the middle of a window goes from black
// to white: an even edge of that width has `energy`, the weighted sum of its squared slopes.
double edge_width(double energy, double range, double window) {
  constexpr double weighted_length = 16.0 / 15;  // of a line through a window of radius 1
  return weighted_length * window * range * range / energy;
}

// The saddle in a patch relative to its middle, or nothing.
std::optional<Vec2> find_saddle(const Patch& patch, double window) {
  const int reach = patch.reach - 1;
  const double range = code_range(patch, window);
  Vec2 q{0, 0};
  double blur_px = 0;
  for (int step = 0; step < max_steps; ++step) {
    double xx = 0, xy = 0, yy = 0, bx = 0, by = 0;
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const double share = ((x - q.x) * (x - q.x) + (y - q.y) * (y - q.y)) / (window * window);
        if (share >= 1) continue;
        const double w = (1 - share) * (1 - share);
        const auto [gx, gy] = patch.slope(y, x);
        xx += w * gx * gx;
        xy += w * gx * gy;
        yy += w * gy * gy;
        bx += w * (gx * gx * x + gx * gy * y);
        by += w * (gx * gy * x + gy * gy * y);
      }
    }
    const double determinant = xx * yy - xy * xy;
    const double trace = xx + yy;
    // Of the eigenvalues' ratio r: determinant / trace^2 = r / (1 + r)^2.
    if (!(determinant > min_conditioning * trace * trace) || trace <= 0) return std::nullopt;
    const double smaller = trace / 2 - std::sqrt(std::max(trace * trace / 4 - determinant, 0.0));
    blur_px = edge_width(smaller, range, window);
    const Vec2 next{(yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant};
    const double moved = hypotenuse(next.x - q.x, next.y - q.y);
    q = next;
    if (!(hypotenuse(q.x, q.y) <= window)) return std::nullopt;
    if (moved < still_px) break;
  }
  if (blur_px > std::max(max_edge_windows * window, min_max_edge_px)) return std::nullopt;
  return q;
}

// Whether a patch looks like a saddle around a point near its middle.
bool is_saddle(const Patch& patch, Vec2 q, double window) {
  double n = 0, sum = 0, squares = 0, half_turn = 0, quarter_turn = 0;
  const int reach = static_cast<int>(window);
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      if (x * x + y * y > window * window) continue;
      const double here = patch.between(q.y + y, q.x + x);
      n += 1;
      sum += here;
      squares += here * here;
      half_turn += here * patch.between(q.y - y, q.x - x);
      quarter_turn += here * patch.between(q.y + x, q.x - y);
    }
  }
  const double mean = sum / n;
  const double variance = squares / n - mean * mean;
  return variance > min_contrast * min_contrast &&
         half_turn / n - mean * mean > min_half_turn * variance &&
         quarter_turn / n - mean * mean < max_quarter_turn * variance;
}

// The pixels themselves as the plane that patches are cut from.
class PicturePlane {
 public:
  bool look_at(Vec2 q) {
    middle_ = q;
    return true;
  }
  std::optional<double> distance(Vec2 q) const {
    return hypotenuse(q.x - middle_.x, q.y - middle_.y);
  }
  std::vector<std::optional<Vec2>> pixels(std::span<const Vec2> points) const {
    std::vector<std::optional<Vec2>> result;
    result.reserve(points.size());
    for (const Vec2& p : points) result.push_back(Vec2{middle_.x + p.x, middle_.y + p.y});
    return result;
  }

 private:
  Vec2 middle_;
};

// The plane across a pixel's ray, in units of a pixel or, where pixels see more to one side than to
// the other, of the finer.
class RayPlane {
 public:
  explicit RayPlane(const Lens& lens) : lens_(lens) {}

  bool look_at(Vec2 q) {
    const std::array around{q, Vec2{q.x + 0.5, q.y}, Vec2{q.x - 0.5, q.y}, Vec2{q.x, q.y + 0.5},
                            Vec2{q.x, q.y - 0.5}};
    const auto rays = unproject_all(lens_, around);
    for (const auto& ray : rays) {
      if (!ray) return false;
    }
    ray_ = normalize(*rays[0]);
    across_ = *rays[1] - *rays[2];
    across_ = normalize(across_ - ray_ * dot(across_, ray_));
    down_ = cross(ray_, across_);
    // What a pixel's steps to the right and down see of the plane, as a matrix; its smaller
    // singular value is the finest detail that the picture shows.
    const Vec3 down_step = *rays[3] - *rays[4];
    const double a = dot(*rays[1] - *rays[2], across_);
    const double b = dot(down_step, across_);
    const double d = dot(down_step, down_);
    const double squares = a * a + b * b + d * d;
    const double spread = std::sqrt(std::max(squares * squares - 4 * a * a * d * d, 0.0));
    unit_ = std::sqrt((squares - spread) / 2);
    return std::isfinite(unit_) && unit_ > 0;
  }
  std::optional<double> distance(Vec2 q) const {
    const auto ray = unproject(lens_, q);
    if (!ray || !(dot(*ray, ray_) > 0)) return std::nullopt;
    return length(*ray / dot(*ray, ray_) - ray_) / unit_;
  }
  std::vector<std::optional<Vec2>> pixels(std::span<const Vec2> points) const {
    std::vector<Vec3> rays;
    rays.reserve(points.size());
    for (const Vec2& p : points) {
      rays.push_back(ray_ + (across_ * p.x + down_ * p.y) * unit_);
    }
    return project_all(lens_, rays);
  }

 private:
  const Lens& lens_;
  Vec3 ray_, across_, down_;
  double unit_ = 0;
};

// How far the saddle is looked for around a corner, in units of the plane; 0 = not at all.
template <class Plane>
double window_of(const BoardView& view,
                 const Board& board,
                 std::size_t corner,
                 const Plane& plane) {
  const int column = static_cast<int>(corner) % board.columns;
  const int row = static_cast<int>(corner) / board.columns;
  double nearest = HUGE_VAL;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const int x = column + dx;
      const int y = row + dy;
      if ((dx == 0 && dy == 0) || x < 0 || y < 0 || x >= board.columns || y >= board.rows) continue;
      const auto& other = view.corners[static_cast<std::size_t>(y * board.columns + x)];
      if (!other) continue;
      const auto distance = plane.distance(*other);
      if (distance) nearest = std::min(nearest, *distance / std::sqrt(dx * dx + dy * dy));
    }
  }
  if (!std::isfinite(nearest)) return 0;
  double share = window_share;
  if (board.kind == Board::Kind::charuco) {
    share = std::min(
        share, charuco_window_gaps * (board.square_m - board.marker_m) / (2 * board.square_m));
  }
  if (window_share * nearest < min_window_px) return 0;
  return std::clamp(share * nearest, min_window_px, max_window_px);
}

template <class Plane>
std::optional<Patch> cut(const GreyPicture& picture, const Plane& plane, int reach) {
  std::vector<Vec2> points;
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      points.push_back({static_cast<double>(x), static_cast<double>(y)});
    }
  }
  Patch patch{reach, {}};
  patch.values.reserve(points.size());
  for (const auto& q : plane.pixels(points)) {
    if (!q || !is_inside(picture, *q)) return std::nullopt;
    patch.values.push_back(value_at(picture, *q));
  }
  return patch;
}

template <class Plane>
std::optional<Vec2> refine(const GreyPicture& picture,
                           const BoardView& view,
                           const Board& board,
                           std::size_t corner,
                           Plane& plane) {
  const Vec2 start = *view.corners[corner];
  Vec2 at = start;
  for (int i = 0; i < max_patches; ++i) {
    if (!is_inside(picture, at) || !plane.look_at(at)) return std::nullopt;
    const double window = window_of(view, board, corner, plane);
    const auto away = plane.distance(start);
    if (window <= 0 || !away || *away > window) return std::nullopt;
    const int reach = static_cast<int>(std::ceil(window)) + 2;
    const std::optional<Patch> patch = cut(picture, plane, reach);
    if (!patch) return std::nullopt;
    const std::optional<Vec2> saddle = find_saddle(*patch, window);
    if (!saddle) return std::nullopt;
    const std::optional<Vec2> q = plane.pixels({&*saddle, 1}).front();
    if (!q) return std::nullopt;
    at = *q;
    // The window is round on the plane across the corner's own ray, so it must be near the middle.
    constexpr double near_px = 0.3;
    if (hypotenuse(saddle->x, saddle->y) > near_px && i + 1 < max_patches) continue;
    return is_saddle(*patch, *saddle, window) ? std::optional(at) : std::nullopt;
  }
  return std::nullopt;
}

template <class Plane>
BoardView refine_all(const GreyPicture& picture,
                     const BoardView& view,
                     const Board& board,
                     Plane plane) {
  check(picture);
  check(board);
  if (view.corners.size() != board.corner_count()) {
    throw std::invalid_argument("a view of " + std::to_string(view.corners.size()) +
                                " corners is not of a board of " +
                                std::to_string(board.corner_count()));
  }
  BoardView result{view.name, std::vector<std::optional<Vec2>>(view.corners.size())};
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    if (view.corners[i]) result.corners[i] = refine(picture, view, board, i, plane);
  }
  return result;
}

}  // namespace

BoardView refine_corners(const GreyPicture& picture, const BoardView& view, const Board& board) {
  return refine_all(picture, view, board, PicturePlane());
}

BoardView refine_corners(const GreyPicture& picture,
                         const BoardView& view,
                         const Board& board,
                         const Lens& lens) {
  check(lens);
  if (lens.width != picture.width || lens.height != picture.height) {
    throw std::invalid_argument("a lens of " + std::to_string(lens.width) + "x" +
                                std::to_string(lens.height) + " is not of a picture of " +
                                std::to_string(picture.width) + "x" +
                                std::to_string(picture.height));
  }
  return refine_all(picture, view, board, RayPlane(lens));
}

}  // namespace calibrate
