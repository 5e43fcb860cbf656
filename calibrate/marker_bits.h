// The markers of ChArUco boards.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace calibrate {

// OpenCV's number of a dictionary by its name (DICT_4X4_50 to DICT_7X7_1000, DICT_ARUCO_ORIGINAL,
// DICT_APRILTAG_16h5 to 36h11), or nothing.
std::optional<int> dictionary_number(const std::string& name);

// A marker's cells row by row from its top left, its black border included: true = white.
struct MarkerBits {
  int side = 0;  // cells
  std::vector<bool> white;

  bool is_white(int row, int column) const {
    return white[static_cast<std::size_t>(row * side + column)];
  }
};

// The first `count` markers of a dictionary. Throws std::invalid_argument if it is unknown or
// smaller.
std::vector<MarkerBits> marker_bits(const std::string& dictionary, int count);

}  // namespace calibrate
