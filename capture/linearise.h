// Decoded pictures of libav to scene-linear images. For the files that wrap libav.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/coded_rows.h"
#include "capture/colour.h"
#include "capture/crop.h"
#include "capture/image.h"

struct AVFrame;

namespace capture {

// From a channel's value, 0..1 and somewhat beyond, to light.
using Curve = std::function<double(double)>;

// How a source's values become light.
struct LightCurves {
  PlateColour colour;                            // for all channels
  std::optional<std::array<Curve, 3>> response;  // instead, whatever the tags say
  bool mark_saturated = false;                   // see CameraOptions
  bool alpha = false;                            // see CameraOptions
};

// Turns pictures into light by tables, as colour.md defines it. Keeps tables and row buffers
// between pictures that are alike. Not thread-safe.
class Lineariser {
 public:
  explicit Lineariser(LightCurves curves);

  // Light of a part of the picture, into `image`: (crop.height, crop.width, 3), or 4 where alpha is
  // asked for and the format has it.
  // Throws std::runtime_error, without a file name, if format or tags are of a kind not handled.
  void linearise(const AVFrame& picture, const Crop& crop, Image& image);

  // How the last picture was read: format, matrix, range, siting, curve, alpha.
  std::string description() const;

 private:
  void make_tables();
  void premultiply(int y, const Crop& crop, float* row);

  LightCurves curves_;
  std::unique_ptr<CodedRows> rows_;
  std::array<std::vector<float>, 3> tables_;  // one, and two empty ones, if channels are alike
  std::vector<float> alphas_;                 // of its codes; empty = none
};

}  // namespace capture
