// Made boards as pictures of codes, and how far corners found in them are off.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/grey_picture.h"
#include "calibrate/lens.h"
#include "calibrate/made_board.h"
#include "calibrate/pose.h"
#include "capture/image.h"

namespace made {

struct BoardPictureOptions {
  calibrate::MadeBoardView view{.black = 20, .white = 235};  // in codes
  double noise = 3;                                          // standard deviation, codes
  std::uint32_t seed = 1;
};

using calibrate::make_board_pose;
using calibrate::true_corners;

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

// The board before a grey room, in codes.
inline calibrate::GreyPicture render_board(const calibrate::Board& board,
                                           const calibrate::Pose& cam_from_board,
                                           const calibrate::Lens& lens,
                                           const BoardPictureOptions& options = {}) {
  const calibrate::DirectionTable directions = make_direction_table(lens);
  capture::Image room = capture::make_image(lens.height, lens.width, 1);
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const std::size_t i = directions.index(y, x);
      const bool seen = directions.x[i] != 0 || directions.y[i] != 0 || directions.z[i] != 0;
      room.at(y, x) = seen ? 90 + 30 * directions.y[i] : 0;
    }
  }
  const capture::Image values =
      photograph_board(board, cam_from_board, lens, directions, room, options.view);
  std::mt19937 random(options.seed);
  std::normal_distribution<float> noise(0, static_cast<float>(options.noise));
  calibrate::GreyPicture picture{lens.width, lens.height, {}};
  for (const float value : values.pixels) {
    picture.pixels.push_back(
        static_cast<std::uint8_t>(std::clamp(std::lround(value + noise(random)), 0L, 255L)));
  }
  return picture;
}

}  // namespace made
