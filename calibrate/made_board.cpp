// Made boards: rays to a drawn one, then the blur of lens and motion.
#include "calibrate/made_board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "calibrate/board_drawing.h"
#include "calibrate/grey_picture.h"

namespace calibrate {
namespace {

constexpr int square_px = 48;  // of the drawn board
constexpr int border_px = square_px;

Mat3 turn(double angle, int a, int b) {
  Mat3 R;
  R.m[static_cast<std::size_t>(4 * a)] = R.m[static_cast<std::size_t>(4 * b)] = std::cos(angle);
  R.m[static_cast<std::size_t>(3 * a + b)] = -std::sin(angle);
  R.m[static_cast<std::size_t>(3 * b + a)] = std::sin(angle);
  return R;
}

// The pixels, from first to last, that the board with its border may cover.
struct Box {
  int x0 = 0, y0 = 0, x1 = -1, y1 = -1;
};

Box box_of(const Board& board, const Pose& cam_from_board, const Lens& lens) {
  constexpr int beside = 3;  // squares
  Box box{lens.width, lens.height, -1, -1};
  for (int row = -beside; row < board.rows + beside; ++row) {
    for (int column = -beside; column < board.columns + beside; ++column) {
      const auto q =
          project(lens, cam_from_board * Vec3{column * board.square_m, row * board.square_m, 0});
      if (!q) continue;
      const double x = std::clamp(q->x, -1.0, static_cast<double>(lens.width));
      const double y = std::clamp(q->y, -1.0, static_cast<double>(lens.height));
      box.x0 = std::clamp(static_cast<int>(x), 0, box.x0);
      box.y0 = std::clamp(static_cast<int>(y), 0, box.y0);
      box.x1 = std::min(std::max(static_cast<int>(std::ceil(x)), box.x1), lens.width - 1);
      box.y1 = std::min(std::max(static_cast<int>(std::ceil(y)), box.y1), lens.height - 1);
    }
  }
  return box;
}

// By so many pixels, within the picture.
Box grown(const Box& box, int reach, const Lens& lens) {
  return {std::max(box.x0 - reach, 0), std::max(box.y0 - reach, 0),
          std::min(box.x1 + reach, lens.width - 1), std::min(box.y1 + reach, lens.height - 1)};
}

// What is in the box, by a row of taps along a direction: a Gaussian, or with sigma < 0 an even one
// -sigma pixels long.
void smear(capture::Image& image, const Box& box, double sigma, double angle_rad) {
  std::vector<std::pair<Vec2, double>> taps;
  const double reach = sigma > 0 ? 3 * sigma : -sigma / 2;
  double sum = 0;
  for (double t = -reach; t <= reach + 1e-9; t += reach / std::ceil(2 * reach + 1)) {
    const double weight = sigma > 0 ? std::exp(-t * t / (2 * sigma * sigma)) : 1;
    taps.push_back({{t * std::cos(angle_rad), t * std::sin(angle_rad)}, weight});
    sum += weight;
  }
  const capture::Image from = image;
  const auto at = [&](int y, int x, int c) {
    return from.at(std::clamp(y, 0, from.height - 1), std::clamp(x, 0, from.width - 1), c);
  };
  for (int y = box.y0; y <= box.y1; ++y) {
    for (int x = box.x0; x <= box.x1; ++x) {
      for (int c = 0; c < image.channels; ++c) {
        double total = 0;
        for (const auto& [step, weight] : taps) {
          const double px = x + step.x;
          const double py = y + step.y;
          const int left = static_cast<int>(std::floor(px));
          const int top = static_cast<int>(std::floor(py));
          const double u = px - left;
          const double v = py - top;
          total += weight * ((1 - v) * ((1 - u) * at(top, left, c) + u * at(top, left + 1, c)) +
                             v * ((1 - u) * at(top + 1, left, c) + u * at(top + 1, left + 1, c)));
        }
        image.at(y, x, c) = static_cast<float>(total / sum);
      }
    }
  }
}

// The directions within one pixel, to first order: what is left out is below 1e-3 pixels.
struct PixelDirections {
  Vec3 middle, per_x, per_y;
};

std::optional<PixelDirections> directions_in(const DirectionTable& table, int y, int x) {
  const auto at = [&](int row, int column) {
    const std::size_t i = table.index(row, column);
    return Vec3{table.x[i], table.y[i], table.z[i]};
  };
  const std::array<Vec3, 5> v{at(y, x), at(y, x - 1), at(y, x + 1), at(y - 1, x), at(y + 1, x)};
  // The lens sees nothing there, or the picture ends within the pixel.
  if (std::ranges::any_of(v, [](Vec3 d) { return dot(d, d) == 0; })) return std::nullopt;
  return PixelDirections{v[0], (v[2] - v[1]) * 0.5, (v[4] - v[3]) * 0.5};
}

}  // namespace

Pose make_board_pose(const Board& board,
                     Vec3 direction,
                     double distance_m,
                     double tilt_rad,
                     double spin_rad,
                     std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vec3 z = normalize(direction);
  const Vec3 x = normalize(cross(Vec3{0, 1, 0}, z));
  const Vec3 y = cross(z, x);
  const Mat3 facing{{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}};
  const double spin = spin_rad * uniform(random);
  const double along = tilt_rad * uniform(random);
  const double across = tilt_rad * uniform(random);
  const Mat3 R = facing * turn(across, 0, 2) * turn(along, 1, 2) * turn(spin, 0, 1);
  const Vec3 middle{(board.columns - 1) * board.square_m / 2, (board.rows - 1) * board.square_m / 2,
                    0};
  return {R, z * distance_m - R * middle};
}

std::vector<std::optional<Vec2>> true_corners(const Board& board,
                                              const Pose& cam_from_board,
                                              const Lens& lens) {
  std::vector<std::optional<Vec2>> corners;
  for (std::size_t i = 0; i < board.corner_count(); ++i) {
    auto q = project(lens, cam_from_board * corner_of(board, i));
    if (q && (q->x < 0 || q->y < 0 || q->x > lens.width - 1 || q->y > lens.height - 1)) q.reset();
    corners.push_back(q);
  }
  return corners;
}

capture::Image photograph_board(const Board& board,
                                const Pose& cam_from_board,
                                const Lens& lens,
                                const DirectionTable& directions,
                                const capture::Image& room,
                                const MadeBoardView& view) {
  if (room.width != lens.width || room.height != lens.height || directions.width != lens.width ||
      directions.height != lens.height) {
    throw std::invalid_argument("a made board needs lens, directions and room of one size");
  }
  constexpr int fine = 3;
  const GreyPicture drawn = draw_board(board, square_px, border_px);
  const Pose board_from_cam = inverse(cam_from_board);
  const auto value_of = [&](Vec3 ray) -> std::optional<double> {
    const Vec3 v = board_from_cam.R * ray;
    const double along = -board_from_cam.t.z / v.z;
    const Vec3 p = board_from_cam.t + v * along;
    const double tx = (p.x / board.square_m + 1) * square_px + border_px;
    const double ty = (p.y / board.square_m + 1) * square_px + border_px;
    if (!(along > 0 && tx >= 0 && ty >= 0 && tx < drawn.width && ty < drawn.height)) {
      return std::nullopt;
    }
    const double share = drawn.at(static_cast<int>(ty), static_cast<int>(tx)) / 255.0;
    return view.black + (view.white - view.black) * share;
  };
  // Of each pixel the board's light and its share, blurred together; the room is as it is.
  capture::Image layer = capture::make_image(lens.height, lens.width, 2);
  const int reach = static_cast<int>(std::ceil(3 * view.blur_px + view.motion_px));
  const Box box = grown(box_of(board, cam_from_board, lens), reach, lens);
  for (int y = box.y0; y <= box.y1; ++y) {
    for (int x = box.x0; x <= box.x1; ++x) {
      const auto pixel = directions_in(directions, y, x);
      if (!pixel) continue;
      double light = 0;
      int hits = 0;
      for (int s = 0; s < fine * fine; ++s) {
        const double right = (s % fine + 0.5) / fine - 0.5;
        const double down = (s / fine + 0.5) / fine - 0.5;
        const auto value = value_of(pixel->middle + pixel->per_x * right + pixel->per_y * down);
        if (!value) continue;
        light += *value;
        ++hits;
      }
      layer.at(y, x, 0) = static_cast<float>(light / (fine * fine));
      layer.at(y, x, 1) = static_cast<float>(hits) / (fine * fine);
    }
  }
  if (view.blur_px > 0) {
    smear(layer, box, view.blur_px, 0);
    smear(layer, box, view.blur_px, std::numbers::pi / 2);
  }
  if (view.motion_px > 0) smear(layer, box, -view.motion_px, view.motion_rad);
  capture::Image picture = room;
  for (int y = box.y0; y <= box.y1; ++y) {
    for (int x = box.x0; x <= box.x1; ++x) {
      for (int c = 0; c < picture.channels; ++c) {
        float& value = picture.at(y, x, c);
        value = layer.at(y, x, 0) + (1 - layer.at(y, x, 1)) * value;
      }
    }
  }
  return picture;
}

}  // namespace calibrate
