// How a camera maps directions to pixels.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calibrate/vec.h"

namespace calibrate {

// A lens as a value. `model` is one of:
//   "pinhole"          fx fy cx cy
//   "equisolid"        f cx cy                       r = 2 f sin(theta/2)
//   "kannala_brandt"   fx fy cx cy k1..k4 (0 to 4)   r = theta (1 + k1 theta^2 + k2 theta^4 + ...)
//   "decentred_kannala_brandt"  fx fy cx cy p1 p2 k1..k4: the same, then shifted by Brown's terms
//   mrcal's own names  LENSMODEL_OPENCV4, LENSMODEL_SPLINED_STEREOGRAPHIC_..., parameters as
//   mrcal's
// Pixels are mrcal's: (0, 0) is the centre of the top-left pixel.
struct Lens {
  std::string model = "pinhole";
  int width = 0;
  int height = 0;
  std::vector<double> parameters;
  // Fish-eyes see up to this angle off the axis; beyond it both directions return nothing.
  double max_angle_rad = 3.14159265358979;
  // How far off its pixels are thought to be along each axis, where it was calibrated: a smooth
  // error, alike in neighbouring pixels. RMS over the picture, 0 = unknown.
  double error_px = 0;
  friend bool operator==(const Lens&, const Lens&) = default;
};

// Throws std::invalid_argument: unknown model, wrong number of parameters, not finite, sizes < 1,
// an error that is negative or above most_error_px().
void check(const Lens& lens);

// The picture's diagonal: no lens is known to be farther off.
double most_error_px(const Lens& lens);

// The pixel of a direction in the camera's frame (any length), or nothing: behind the lens, beyond
// its angle, not finite. The pixel may lie outside the picture.
std::optional<Vec2> project(const Lens& lens, Vec3 v_cam);
// Of many.
std::vector<std::optional<Vec2>> project_all(const Lens& lens, std::span<const Vec3> v_cam);

// The unit direction of a pixel, or nothing where the model has none.
std::optional<Vec3> unproject(const Lens& lens, Vec2 q);
std::vector<std::optional<Vec3>> unproject_all(const Lens& lens, std::span<const Vec2> q);

// Lens of a part of the picture: crop = x, y, width, height in the lens's pixels.
Lens cropped(const Lens& lens, int x, int y, int width, int height);
// Lens of the same picture at another size (area-scaled: pixel edges map to pixel edges).
Lens resized(const Lens& lens, int width, int height);

// Reads mrcal's .cameramodel, our .toml lens, or OpenCV's .yml, .yaml or .xml (opencv_lens.h), by
// the file's ending. Throws std::runtime_error with path, line where known, and reason.
Lens read_lens(const std::string& path);
void write_lens(const std::string& path, const Lens& lens);

// The same as a text, that of a .toml, which takes any lens. `name` stands for it in what is
// thrown, in place of a path. Both throw as the others do.
std::string text_of_lens(const Lens& lens);
Lens lens_from_text(std::string_view text, const std::string& name);

// Unit directions in the camera's frame for every pixel, with a border of one pixel:
// entry (y, x), -1 <= y <= height, -1 <= x <= width, is at index (y + 1) * (width + 2) + x + 1.
// A zero vector marks a pixel that the lens does not see.
struct DirectionTable {
  int width = 0;
  int height = 0;
  std::vector<float> x, y, z;
  std::vector<float> sensitivity = {};  // of the lens, for each entry (vignetting.h); empty = even

  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row + 1) * static_cast<std::size_t>(width + 2) +
           static_cast<std::size_t>(column + 1);
  }
};
// Made once per camera. Throws as check().
DirectionTable make_direction_table(const Lens& lens);

}  // namespace calibrate
