// Pictures of boards through any lens, by casting rays, with the truth about their corners.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/board_drawing.h"
#include "calibrate/grey_picture.h"
#include "calibrate/lens.h"
#include "calibrate/pose.h"

namespace made {

struct BoardPictureOptions {
  double blur_px = 0.7;  // standard deviation of the optics' blur
  double motion_px = 0;  // length of a smear along motion_rad
  double motion_rad = 0.5;
  double noise = 3;  // standard deviation, codes
  std::uint32_t seed = 1;
  double black = 20;
  double white = 235;
};

// A board tilted by up to `tilt_rad` and turned by up to `spin_rad`, whose middle is at this
// distance in this direction from the camera.
inline calibrate::Pose make_board_pose(const calibrate::Board& board,
                                       calibrate::Vec3 direction,
                                       double distance_m,
                                       double tilt_rad,
                                       double spin_rad,
                                       std::mt19937& random) {
  using calibrate::Mat3;
  using calibrate::Vec3;
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vec3 z = normalize(direction);
  const Vec3 x = normalize(cross(Vec3{0, 1, 0}, z));
  const Vec3 y = cross(z, x);
  const Mat3 facing{{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}};
  const auto turn = [](double angle, int a, int b) {
    Mat3 R;
    R.m[static_cast<std::size_t>(4 * a)] = R.m[static_cast<std::size_t>(4 * b)] = std::cos(angle);
    R.m[static_cast<std::size_t>(3 * a + b)] = -std::sin(angle);
    R.m[static_cast<std::size_t>(3 * b + a)] = std::sin(angle);
    return R;
  };
  const Mat3 R = facing * turn(tilt_rad * uniform(random), 0, 2) *
                 turn(tilt_rad * uniform(random), 1, 2) * turn(spin_rad * uniform(random), 0, 1);
  const Vec3 middle{(board.columns - 1) * board.square_m / 2, (board.rows - 1) * board.square_m / 2,
                    0};
  return {R, z * distance_m - R * middle};
}

// Where the corners really are; nothing where the lens does not show them.
inline std::vector<std::optional<calibrate::Vec2>> true_corners(
    const calibrate::Board& board,
    const calibrate::Pose& cam_from_board,
    const calibrate::Lens& lens) {
  std::vector<std::optional<calibrate::Vec2>> corners;
  for (std::size_t i = 0; i < board.corner_count(); ++i) {
    auto q = project(lens, cam_from_board * corner_of(board, i));
    if (q && (q->x < 0 || q->y < 0 || q->x > lens.width - 1 || q->y > lens.height - 1)) q.reset();
    corners.push_back(q);
  }
  return corners;
}

// How far corners are from the truth.
struct CornerErrors {
  std::size_t count = 0;
  double rms_px = 0;
  double max_px = 0;  // infinite if one was found where none can be seen
};

inline CornerErrors corner_errors(const calibrate::BoardView& view,
                                  const std::vector<std::optional<calibrate::Vec2>>& truth) {
  CornerErrors errors;
  double squares = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto& q = view.corners.at(i);
    if (!q) continue;
    const double error =
        truth[i] ? calibrate::hypotenuse(q->x - truth[i]->x, q->y - truth[i]->y) : HUGE_VAL;
    ++errors.count;
    squares += error * error;
    errors.max_px = std::max(errors.max_px, error);
  }
  errors.rms_px = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, errors.count)));
  return errors;
}

inline void smear(
    std::vector<float>& values, int width, int height, double sigma, double angle_rad) {
  // A row of taps along a direction: a Gaussian, or with sigma < 0 a box of -sigma pixels.
  std::vector<std::pair<calibrate::Vec2, double>> taps;
  const double reach = sigma > 0 ? 3 * sigma : -sigma / 2;
  double sum = 0;
  for (double t = -reach; t <= reach + 1e-9; t += reach / std::ceil(2 * reach + 1)) {
    const double weight = sigma > 0 ? std::exp(-t * t / (2 * sigma * sigma)) : 1;
    taps.push_back({{t * std::cos(angle_rad), t * std::sin(angle_rad)}, weight});
    sum += weight;
  }
  const std::vector<float> from = values;
  const auto at = [&](int y, int x) {
    return from[static_cast<std::size_t>(std::clamp(y, 0, height - 1) * width +
                                         std::clamp(x, 0, width - 1))];
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double total = 0;
      for (const auto& [step, weight] : taps) {
        const double px = x + step.x;
        const double py = y + step.y;
        const int left = static_cast<int>(std::floor(px));
        const int top = static_cast<int>(std::floor(py));
        const double u = px - left;
        const double v = py - top;
        total += weight * ((1 - v) * ((1 - u) * at(top, left) + u * at(top, left + 1)) +
                           v * ((1 - u) * at(top + 1, left) + u * at(top + 1, left + 1)));
      }
      values[static_cast<std::size_t>(y * width + x)] = static_cast<float>(total / sum);
    }
  }
}

// The board before a grey room, 3x3 rays a pixel.
inline calibrate::GreyPicture render_board(const calibrate::Board& board,
                                           const calibrate::Pose& cam_from_board,
                                           const calibrate::Lens& lens,
                                           const BoardPictureOptions& options = {}) {
  using calibrate::Vec2;
  using calibrate::Vec3;
  constexpr int fine = 3;
  constexpr int square_px = 48;
  constexpr int border_px = 48;
  const calibrate::GreyPicture drawn = draw_board(board, square_px, border_px);
  const calibrate::Pose board_from_cam = inverse(cam_from_board);
  // The room is even enough for one ray a pixel; the board is where its outline is, about.
  const auto code_of = [&](const std::optional<Vec3>& ray) {
    if (!ray) return 0.0;
    const Vec3 v = board_from_cam.R * *ray;
    const double along = -board_from_cam.t.z / v.z;
    const Vec3 p = board_from_cam.t + v * along;
    const double tx = (p.x / board.square_m + 1) * square_px + border_px;
    const double ty = (p.y / board.square_m + 1) * square_px + border_px;
    if (!(along > 0 && tx >= 0 && ty >= 0 && tx < drawn.width && ty < drawn.height)) {
      return 90 + 30 * ray->y;
    }
    const double share = drawn.at(static_cast<int>(ty), static_cast<int>(tx)) / 255.0;
    return options.black + (options.white - options.black) * share;
  };
  double left = lens.width, right = 0, top = lens.height, bottom = 0;
  for (int row = -3; row <= board.rows + 2; ++row) {
    for (int column = -3; column <= board.columns + 2; ++column) {
      const auto q =
          project(lens, cam_from_board * Vec3{column * board.square_m, row * board.square_m, 0});
      if (!q) continue;
      left = std::min(left, q->x);
      right = std::max(right, q->x);
      top = std::min(top, q->y);
      bottom = std::max(bottom, q->y);
    }
  }
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height));
  std::vector<Vec2> points;
  for (int y = 0; y < lens.height; ++y) {
    const auto is_near = [&](int x) { return y >= top && y <= bottom && x >= left && x <= right; };
    points.clear();
    for (int x = 0; x < lens.width; ++x) {
      for (int s = 0; s < (is_near(x) ? fine * fine : 1); ++s) {
        const Vec2 step{(s % fine + 0.5) / fine - 0.5, (s / fine + 0.5) / fine - 0.5};
        points.push_back(is_near(x) ? Vec2{x + step.x, y + step.y}
                                    : Vec2{static_cast<double>(x), static_cast<double>(y)});
      }
    }
    const auto rays = unproject_all(lens, points);
    auto ray = rays.begin();
    for (int x = 0; x < lens.width; ++x) {
      const int count = is_near(x) ? fine * fine : 1;
      double sum = 0;
      for (int s = 0; s < count; ++s) sum += code_of(*ray++);
      values.push_back(static_cast<float>(sum / count));
    }
  }
  if (options.blur_px > 0) {
    smear(values, lens.width, lens.height, options.blur_px, 0);
    smear(values, lens.width, lens.height, options.blur_px, std::numbers::pi / 2);
  }
  if (options.motion_px > 0) {
    smear(values, lens.width, lens.height, -options.motion_px, options.motion_rad);
  }
  std::mt19937 random(options.seed);
  std::normal_distribution<float> noise(0, static_cast<float>(options.noise));
  calibrate::GreyPicture picture{lens.width, lens.height, {}};
  for (const float value : values) {
    picture.pixels.push_back(
        static_cast<std::uint8_t>(std::clamp(std::lround(value + noise(random)), 0L, 255L)));
  }
  return picture;
}

}  // namespace made
