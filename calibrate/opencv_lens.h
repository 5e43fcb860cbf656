// Lenses in OpenCV's files, and in those of ROS and kalibr.
#pragma once

#include <string>

#include "calibrate/lens.h"

namespace calibrate {

// Reads a .yml, .yaml or .xml (files.md): camera matrix, distortion coefficients, picture's size.
// 4, 5, 8 or 12 coefficients are LENSMODEL_OPENCV4 to 12, none a pinhole; those that the file calls
// a fish-eye's are cv::fisheye's, our kannala_brandt. Throws std::runtime_error with path, line
// where known, key and reason: also for models that Lens has not, by their name.
Lens read_opencv_lens(const std::string& path);

// Writes one that cv::FileStorage reads, with every digit; by the file's ending as XML or YAML. A
// largest angle becomes the key max_angle (degrees), which OpenCV passes over. Throws
// std::invalid_argument for a lens that OpenCV has no model for; std::runtime_error if the file
// cannot be written.
void write_opencv_lens(const std::string& path, const Lens& lens);

}  // namespace calibrate
