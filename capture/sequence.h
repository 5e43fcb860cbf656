// Numbered picture files as one camera: take/frame.%04d.exr.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera.h"
#include "capture/linearise.h"

namespace capture {

// Whether the path's file name has a place for numbers, %d or %04d, and no such file is there.
bool is_sequence(const std::string& path);

// The files in the folder that match the pattern, by their numbers; one at least. Digits: %d and
// %0Nd take numbers as printf writes them. Throws std::runtime_error with pattern, reason and what
// to do: also where more than 10,000 numbers on end are missing.
std::map<std::int64_t, std::string> numbered_files(const std::string& path);

// The pattern's file of that number, whether it is there or not.
std::string numbered_file(const std::string& path, std::int64_t number);

// Numbers between the first and the last that no file has: of each gap the first and the last.
std::vector<std::pair<std::int64_t, std::int64_t>> missing_numbers(
    const std::map<std::int64_t, std::string>& files);

// Opens all files in the folder that match the pattern, in the order of their numbers, from the
// lowest; frames count from 0 there, at options.picture_rate. Missing numbers between are lost
// frames. Throws as numbered_files.
std::unique_ptr<Camera> open_sequence(const std::string& path,
                                      const CameraOptions& options,
                                      const LightCurves& curves);

}  // namespace capture
