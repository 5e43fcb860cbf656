// What the program and platelight-detect tell each other. Both ends are of one build.
#pragma once

#include <cstdint>

namespace calibrate::wire {

// Which of OpenCV's finders. The names are theirs.
enum class Finder : std::uint32_t {
  chessboard = 1,  // findChessboardCorners, which gives up quickly
  sector_based,    // findChessboardCornersSB
  sector_based_exhaustively,
  markers,  // aruco::detectMarkers
};

// On standard input first; `pictures` times a Picture with its pixels follows.
struct Request {
  Finder finder{};
  std::int32_t columns = 0;
  std::int32_t rows = 0;
  std::int32_t dictionary = 0;  // OpenCV's number
  std::uint32_t pictures = 0;
};

// Before width * height bytes of grey.
struct Picture {
  std::int32_t width = 0;
  std::int32_t height = 0;
};

// One for every picture, in order, each sent as soon as it is known. `points` pairs of doubles
// follow: the corners of a chessboard, none or all; or four of every marker. After those of markers
// follow their numbers, std::int32_t.
struct Reply {
  std::uint32_t points = 0;
};

inline constexpr std::uint32_t max_points = 1U << 16;

}  // namespace calibrate::wire
