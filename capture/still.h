// Still pictures: PNG, JPEG, TIFF and others that libav decodes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "capture/colour.h"
#include "capture/image.h"

namespace capture {

class Lineariser;
struct LightCurves;

// (height, width, channels), row by row: 3 = RGB, 4 = RGB and unassociated alpha; the file's own
// codes 0 to 255, no colour change.
struct Still8 {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::uint8_t> texels;
};

// Decodes a PNG or JPEG file held in memory (textures of meshes). Grey becomes RGB; deeper codes
// are rounded to 8 bits; JPEG's YCbCr is read as BT.601, full range. `name` is for error messages.
// Throws std::runtime_error naming `name` and the reason if the bytes are neither, are damaged or
// truncated, or the picture is too large (see libav.h).
Still8 decode_still8(std::span<const std::byte> file_bytes, const std::string& name);

// A still as light.
struct Still {
  Image image;              // scene-linear, (height, width, 3), or 4 with alpha: see LightCurves
  std::string description;  // for people: format, colour tags and how they were read
};

// Whether the file begins as a still picture does: PNG, JPEG, TIFF, BMP, WebP, PNM, JPEG 2000, DPX,
// TGA by its name. A single file of Motion JPEG by its name is none.
bool is_still(const std::string& path);

// Reads a still file; its codes become light by `curves`, as colour.md defines it. It stays as the
// sensor saw it, whatever orientation its EXIF data tell; the description names that. Throws
// std::runtime_error with path, reason and what to do.
Still read_still(const std::string& path, const LightCurves& curves);
// The same for many, which keeps tables between them: into `image`, used again if it has the size.
// Returns the description.
std::string read_still(const std::string& path, Lineariser& lineariser, Image& image);

}  // namespace capture
