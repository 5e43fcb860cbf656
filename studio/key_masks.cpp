// Masks of keys.
#include "studio/key_masks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

namespace studio {
namespace {

std::vector<std::uint8_t> read_mask(
    const char* kind, const std::string& path, int width, int height, const ShownPart& shown) {
  if (path.empty()) return {};
  const capture::Image mask = read_picture(path, capture::Transfer::linear, shown);
  if (mask.width != width || mask.height != height) {
    throw std::invalid_argument(
        fmt::format("the {} mask {} is {}x{}, but the video is {}x{}: draw it in that size", kind,
                    path, mask.width, mask.height, width, height));
  }
  std::vector<std::uint8_t> codes;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      const float white = mask.at(y, x);
      if (!std::isfinite(white)) {
        throw std::invalid_argument(
            fmt::format("the {} mask {} holds no number at column {}, row {}: draw it from 0 to 1",
                        kind, path, x, y));
      }
      codes.push_back(static_cast<std::uint8_t>(std::clamp(white * 255 + 0.5F, 0.0F, 255.0F)));
    }
  }
  return codes;
}

}  // namespace

compositing::KeyMasks read_key_masks(const KeyMaskFiles& files,
                                     int width,
                                     int height,
                                     const ShownPart& shown) {
  return {read_mask("garbage", files.garbage, width, height, shown),
          read_mask("core", files.core, width, height, shown)};
}

}  // namespace studio
