// Other tools' lens calibrations.
#include "studio/charts/lens_peers.h"

#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/calib3d.hpp>

#include "calibrate/lens.h"
#include "capture/sandbox.h"
#include "studio/charts/board_corners.h"
#include "studio/charts/solver_wire.h"

#include <sys/mman.h>
#include <unistd.h>

namespace studio {
namespace {

using calibrate::Lens;
using calibrate::LensProblem;
using calibrate::Vec2;
using calibrate::Vec3;

double now_ms() {
  return std::chrono::duration<double, std::milli>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void answer(LensPeerResult& result, Lens lens) {
  check(lens);
  result.parameters = lens.parameters.size();
  result.unproject = [lens = std::move(lens)](Vec2 q) { return calibrate::unproject(lens, q); };
}

void by_camera(const LensProblem& problem, bool rational, LensPeerResult& result) {
  const BoardCorners<cv::Point3f, cv::Point2f> corners(problem);
  cv::Mat K, distortion;
  std::vector<cv::Mat> turns, moves;
  const double begin = now_ms();
  cv::calibrateCamera(corners.board, corners.picture, {problem.width, problem.height}, K,
                      distortion, turns, moves, rational ? cv::CALIB_RATIONAL_MODEL : 0);
  result.time_ms = now_ms() - begin;
  Lens lens{rational ? "LENSMODEL_OPENCV8" : "LENSMODEL_OPENCV5",
            problem.width,
            problem.height,
            {K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2), K.at<double>(1, 2)}};
  for (int i = 0; i < (rational ? 8 : 5); ++i) lens.parameters.push_back(distortion.at<double>(i));
  answer(result, std::move(lens));
}

void by_fisheye(const LensProblem& problem, LensPeerResult& result) {
  const BoardCorners<cv::Point3d, cv::Point2d> corners(problem);
  cv::Mat K, distortion;
  std::vector<cv::Mat> turns, moves;
  const double begin = now_ms();
  cv::fisheye::calibrate(corners.board, corners.picture, {problem.width, problem.height}, K,
                         distortion, turns, moves,
                         cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW);
  result.time_ms = now_ms() - begin;
  Lens lens{"kannala_brandt",
            problem.width,
            problem.height,
            {K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2), K.at<double>(1, 2)}};
  for (int i = 0; i < 4; ++i) lens.parameters.push_back(distortion.at<double>(i));
  answer(result, std::move(lens));
}

// A file in memory that a child may read.
class MemoryFile {
 public:
  explicit MemoryFile(const std::vector<double>& numbers) : fd_(memfd_create("corners", 0)) {
    const std::size_t size = numbers.size() * sizeof(double);
    if (fd_ < 0 || ::write(fd_, numbers.data(), size) != static_cast<ssize_t>(size)) {
      throw std::runtime_error("no memory for the corners");
    }
    ::lseek(fd_, 0, SEEK_SET);
  }
  ~MemoryFile() { ::close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

// The parameters that one of the helpers answers with.
std::vector<double> by_solver(const char* program,
                              const SolverQuestion& question,
                              double time_limit_s,
                              LensPeerResult& result) {
  const MemoryFile file(to_doubles(question));
  capture::SandboxedChild child(
      capture::helper_path(program), file.fd(),
      std::chrono::milliseconds(static_cast<std::int64_t>(1000 * time_limit_s)));
  std::array<double, 2> head{};  // milliseconds, number of parameters
  if (!child.read(std::as_writable_bytes(std::span(head)))) {
    const std::string ending = child.ending();
    throw std::runtime_error(ending.empty() ? "no answer" : ending);
  }
  if (!(std::abs(head[1]) >= 1 && std::abs(head[1]) < 10000)) {
    throw std::runtime_error("no solution");
  }
  if (head[1] < 0) {
    std::string reason(static_cast<std::size_t>(-head[1]), ' ');
    if (!child.read(std::as_writable_bytes(std::span(reason)))) reason = "half an answer";
    throw std::runtime_error(reason);
  }
  std::vector<double> parameters(static_cast<std::size_t>(head[1]));
  if (!child.read(std::as_writable_bytes(std::span(parameters)))) {
    throw std::runtime_error("half an answer");
  }
  result.time_ms = head[0];
  return parameters;
}

void by_mrcal(const LensProblem& problem,
              bool splined,
              double time_limit_s,
              LensPeerResult& result) {
  answer(result, {splined ? mrcal_splined_model : mrcal_opencv_model, problem.width, problem.height,
                  by_solver("platelight-mrcal", {splined, problem}, time_limit_s, result)});
}

// Mei and Rives's model: onto the unit sphere, then a pinhole xi behind its centre.
void by_omnidir(const LensProblem& problem, double time_limit_s, LensPeerResult& result) {
  const std::vector<double> p = by_solver("platelight-omnidir", {0, problem}, time_limit_s, result);
  if (p.size() != 9) throw std::runtime_error("half an answer");
  result.parameters = p.size();
  const cv::Matx33d K(p[0], 0, p[2], 0, p[1], p[3], 0, 0, 1);
  const std::vector<double> distortion(p.begin() + 5, p.end());
  result.unproject = [K, distortion, x = p[4]](Vec2 q) -> std::optional<Vec3> {
    const std::vector<cv::Point2d> pixel{{q.x, q.y}};
    std::vector<cv::Point2d> ideal;
    cv::undistortPoints(pixel, ideal, K, distortion);
    const double u = ideal[0].x;
    const double v = ideal[0].y;
    const double r2 = u * u + v * v;
    const double under = 1 + (1 - x * x) * r2;
    if (!(under >= 0)) return std::nullopt;
    const double scale = (x + std::sqrt(under)) / (r2 + 1);
    return calibrate::normalize(Vec3{scale * u, scale * v, scale - x});
  };
}

// The first line, and not more than fits beside a mark.
std::string short_reason(const std::string& what) {
  std::string line = what.substr(0, what.find('\n'));
  const std::size_t error = line.find("error: ");
  if (error != std::string::npos) line.erase(0, error + 7);
  return line.substr(0, 100);
}

}  // namespace

const char* name_of(LensPeer peer) {
  switch (peer) {
    case LensPeer::opencv_camera5:
      return "cv::calibrateCamera";
    case LensPeer::opencv_camera8:
      return "cv::calibrateCamera, k1-k6";
    case LensPeer::opencv_fisheye:
      return "cv::fisheye::calibrate";
    case LensPeer::opencv_omnidir:
      return "cv::omnidir::calibrate";
    case LensPeer::mrcal_opencv5:
      return "mrcal, OPENCV5";
    case LensPeer::mrcal_splined:
      return "mrcal, splined 8x8";
  }
  return "";
}

LensPeerResult calibrate_with(LensPeer peer, const LensProblem& problem, double time_limit_s) {
  LensPeerResult result;
  try {
    switch (peer) {
      case LensPeer::opencv_camera5:
      case LensPeer::opencv_camera8:
        by_camera(problem, peer == LensPeer::opencv_camera8, result);
        break;
      case LensPeer::opencv_fisheye:
        by_fisheye(problem, result);
        break;
      case LensPeer::opencv_omnidir:
        by_omnidir(problem, time_limit_s, result);
        break;
      case LensPeer::mrcal_opencv5:
      case LensPeer::mrcal_splined:
        by_mrcal(problem, peer == LensPeer::mrcal_splined, time_limit_s, result);
        break;
    }
    result.status = "ok";
  } catch (const std::exception& error) {  // cv::Exception among them
    result.status = short_reason(error.what());
    result.unproject = nullptr;
  }
  return result;
}

}  // namespace studio
