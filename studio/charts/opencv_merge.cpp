// OpenCV's HDR merges.
#include "studio/charts/opencv_merge.h"

#include <opencv2/photo.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace studio {
namespace {

cv::Mat response_of(std::span<const float> light_of_code) {
  constexpr int codes = 256;
  if (light_of_code.size() != codes) throw std::invalid_argument("8-bit codes are 256");
  cv::Mat response(codes, 1, CV_32FC3);
  for (int code = 0; code < codes; ++code) {
    response.at<cv::Vec3f>(code) = cv::Vec3f::all(light_of_code[static_cast<std::size_t>(code)]);
  }
  return response;
}

}  // namespace

void merge_with_opencv(OpenCvMerge method,
                       std::span<const OpenCvShot> shots,
                       int width,
                       int height,
                       std::span<const float> light_of_code,
                       capture::Image& radiance) {
  std::vector<cv::Mat> pictures;
  std::vector<float> exposures_s;
  for (const OpenCvShot& shot : shots) {
    pictures.emplace_back(height, width, CV_8UC3, const_cast<std::uint8_t*>(shot.codes));
    exposures_s.push_back(static_cast<float>(shot.exposure_s));
  }
  radiance.width = width;
  radiance.height = height;
  radiance.channels = 3;
  radiance.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  cv::Mat merged(height, width, CV_32FC3, radiance.pixels.data());
  try {
    const cv::Mat response = response_of(light_of_code);
    if (method == OpenCvMerge::debevec) {
      cv::createMergeDebevec()->process(pictures, merged, exposures_s, response);
    } else {
      cv::createMergeRobertson()->process(pictures, merged, exposures_s, response);
    }
  } catch (const cv::Exception& error) {
    throw std::runtime_error(std::string("OpenCV cannot merge the shots: ") + error.what());
  }
  if (merged.data != reinterpret_cast<const std::uint8_t*>(radiance.pixels.data())) {
    cv::Mat(merged).copyTo(cv::Mat(height, width, CV_32FC3, radiance.pixels.data()));
  }
  for (float& value : radiance.pixels) {
    if (!std::isfinite(value)) value = 0;
  }
}

}  // namespace studio
