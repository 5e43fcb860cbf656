// platelight-omnidir: OpenCV's calibration after Mei and Rives on corners from standard input, for
// the chart of lenses. Its library brings 80 others along, which take a tenth of a second to load:
// they are not to burden the program itself.
#include <chrono>
#include <cstdio>
#include <optional>
#include <vector>

#include <opencv2/ccalib/omnidir.hpp>

#include "studio/charts/board_corners.h"
#include "studio/charts/solver_wire.h"

int main() {
  const std::optional<studio::SolverQuestion> question = studio::read_question(stdin);
  if (!question) return 1;
  const calibrate::LensProblem& problem = question->problem;
  const studio::BoardCorners<cv::Point3d, cv::Point2d> corners(problem);
  cv::Mat K, xi, distortion, turns, moves, used;
  const auto begin = std::chrono::steady_clock::now();
  try {
    cv::omnidir::calibrate(corners.board, corners.picture, {problem.width, problem.height}, K, xi,
                           distortion, turns, moves, cv::omnidir::CALIB_FIX_SKEW,
                           cv::TermCriteria(3, 200, 1e-8), used);
  } catch (const cv::Exception& error) {
    studio::write_refusal(stdout, error.what());
    return 0;
  }
  const double time_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  std::vector<double> parameters{K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2),
                                 K.at<double>(1, 2), xi.at<double>(0)};
  for (int i = 0; i < 4; ++i) parameters.push_back(distortion.at<double>(i));
  studio::write_answer(stdout, time_ms, parameters);
  return 0;
}
