// platelight-detect: looks for boards in the pictures on standard input, confined, and writes their
// corners to standard output (detect_wire.h). Its finders cannot be interrupted and may crash or
// never end: that is why they are here.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <span>
#include <vector>

#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "calibrate/detect_wire.h"
#include "capture/helper_io.h"
#include "capture/sandbox.h"

namespace {

namespace wire = calibrate::wire;

void send(const std::vector<cv::Point2f>& points) {
  capture::write_value(wire::Reply{static_cast<std::uint32_t>(points.size())});
  for (const cv::Point2f& p : points) capture::write_value(std::array<double, 2>{p.x, p.y});
}

void send_chessboard(const cv::Mat& picture, const wire::Request& request) {
  const cv::Size size(request.columns, request.rows);
  std::vector<cv::Point2f> corners;
  bool found = false;
  if (request.finder == wire::Finder::chessboard) {
    found = cv::findChessboardCorners(
        picture, size, corners,
        cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK);
  } else {
    const bool exhaustively = request.finder == wire::Finder::sector_based_exhaustively;
    found = cv::findChessboardCornersSB(
        picture, size, corners,
        exhaustively ? cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_NORMALIZE_IMAGE : 0);
  }
  if (!found || corners.size() != static_cast<std::size_t>(size.area())) corners.clear();
  send(corners);
}

void send_markers(const cv::Mat& picture, const wire::Request& request) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(request.dictionary);
  const auto parameters = cv::aruco::DetectorParameters::create();
  // Down to about two pixels a cell, however large the picture is.
  constexpr double cell_px = 2;
  const double side_px = cell_px * (dictionary->markerSize + 2);
  parameters->minMarkerPerimeterRate =
      std::min(0.03, 4 * side_px / std::max(picture.cols, picture.rows));
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> ids;
  cv::aruco::detectMarkers(picture, dictionary, markers, ids, parameters);
  std::vector<cv::Point2f> points;
  for (const auto& marker : markers) points.insert(points.end(), marker.begin(), marker.end());
  send(points);
  for (const int id : ids) capture::write_value(std::int32_t{id});
}

void detect() {
  const auto request = capture::read_value<wire::Request>();
  for (std::uint32_t i = 0; i < request.pictures; ++i) {
    const auto size = capture::read_value<wire::Picture>();
    cv::Mat picture(size.height, size.width, CV_8U);
    capture::read_all(std::as_writable_bytes(std::span(picture.data, picture.total())));
    if (request.finder == wire::Finder::markers) {
      send_markers(picture, request);
    } else {
      send_chessboard(picture, request);
    }
  }
}

}  // namespace

int main() {
  try {
    setenv("OPENCV_OPENCL_RUNTIME", "disabled", 1);
    constexpr std::size_t memory_bytes = std::size_t{4} << 30;
    constexpr std::chrono::seconds processor_time{600};  // whoever waits has its own limit
    capture::confine_this_process({memory_bytes, processor_time});
    cv::setNumThreads(1);
    detect();
    return 0;
  } catch (const std::exception&) {
    return 1;
  }
}
