// Marker dictionaries from OpenCV.
#include "calibrate/marker_bits.h"

#include <stdexcept>
#include <utility>

#include <opencv2/aruco/dictionary.hpp>
#include <opencv2/core.hpp>

namespace calibrate {
namespace {

constexpr std::pair<const char*, int> dictionaries[]{
    {"DICT_4X4_50", cv::aruco::DICT_4X4_50},
    {"DICT_4X4_100", cv::aruco::DICT_4X4_100},
    {"DICT_4X4_250", cv::aruco::DICT_4X4_250},
    {"DICT_4X4_1000", cv::aruco::DICT_4X4_1000},
    {"DICT_5X5_50", cv::aruco::DICT_5X5_50},
    {"DICT_5X5_100", cv::aruco::DICT_5X5_100},
    {"DICT_5X5_250", cv::aruco::DICT_5X5_250},
    {"DICT_5X5_1000", cv::aruco::DICT_5X5_1000},
    {"DICT_6X6_50", cv::aruco::DICT_6X6_50},
    {"DICT_6X6_100", cv::aruco::DICT_6X6_100},
    {"DICT_6X6_250", cv::aruco::DICT_6X6_250},
    {"DICT_6X6_1000", cv::aruco::DICT_6X6_1000},
    {"DICT_7X7_50", cv::aruco::DICT_7X7_50},
    {"DICT_7X7_100", cv::aruco::DICT_7X7_100},
    {"DICT_7X7_250", cv::aruco::DICT_7X7_250},
    {"DICT_7X7_1000", cv::aruco::DICT_7X7_1000},
    {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"DICT_APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"DICT_APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"DICT_APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"DICT_APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11},
};

}  // namespace

std::optional<int> dictionary_number(const std::string& name) {
  for (const auto& [known, number] : dictionaries) {
    if (name == known) return number;
  }
  return std::nullopt;
}

std::vector<MarkerBits> marker_bits(const std::string& dictionary, int count) {
  const std::optional<int> number = dictionary_number(dictionary);
  if (!number) {
    throw std::invalid_argument("there is no dictionary of markers \"" + dictionary +
                                "\"; known are OpenCV's, such as DICT_5X5_100");
  }
  const auto markers = cv::aruco::getPredefinedDictionary(*number);
  if (count > markers->bytesList.rows) {
    throw std::invalid_argument("the board needs " + std::to_string(count) + " markers, but " +
                                dictionary + " has " + std::to_string(markers->bytesList.rows));
  }
  std::vector<MarkerBits> result;
  for (int id = 0; id < count; ++id) {
    constexpr int border = 1;
    MarkerBits bits{markers->markerSize + 2 * border, {}};
    cv::Mat drawn;
    markers->drawMarker(id, bits.side, drawn, border);
    for (int row = 0; row < bits.side; ++row) {
      for (int column = 0; column < bits.side; ++column) {
        bits.white.push_back(drawn.at<unsigned char>(row, column) != 0);
      }
    }
    result.push_back(std::move(bits));
  }
  return result;
}

}  // namespace calibrate
