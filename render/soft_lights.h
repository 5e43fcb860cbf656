// Directions all over the regions that lights of the table stand for. Private to the kernel.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/light_table.h"

namespace render {

// Directions, coordinate by coordinate.
struct DirectionRange {
  Vec3f lower, upper;
};

// A light stands for a region of the sky. Looked for in its middle alone it is hidden as a whole or
// not at all, and shadows end in steps; looked for all over the region, in another part from pixel
// to pixel, neighbours together see how much of it is hidden (cell_visibility.h).
//
// After Keller and Heidrich, "Interleaved Sampling", EGWR 2001.
class SoftLights {
 public:
  static constexpr std::size_t side = RegionParts::side;
  static constexpr std::size_t count = RegionParts::count;
  static constexpr std::uint8_t middle = count;  // no part, but the middle of the region

  // Lights of compact sources have no parts: sources have lights enough of their own, and the
  // shadows that they cast end sharply.
  static bool has_parts(const DirectionalLight& light) {
    return light.compact == 0 && light.spread > 0;
  }

  SoftLights() = default;
  // If `in_parts` is not set, no light has parts.
  explicit SoftLights(const LightTable& table, bool in_parts = true);

  bool has(std::size_t light) const { return light < regions_.size() && regions_[light].has; }
  // The part that a pixel looks for: those of any 4x4 pixels are all of them, and pixels that are
  // two columns or two rows apart look into opposite quarters of the region. In each row and each
  // column of the 4x4, both coordinates of the parts are all four (they are orthogonal Latin
  // squares, of the field of four elements): so what 4x4 pixels see together is right to first
  // order where a shadow grows from pixel to pixel. Of the 32 ways to lay such squares over the
  // pixels, each suits some shadows by luck; this one keeps all that tests ask for.
  static std::uint8_t part_of_pixel(std::size_t x, std::size_t y) {
    constexpr std::array<std::size_t, side> twice{0, 2, 3, 1};  // in that field
    x = x % side ^ 1, y %= side;
    return static_cast<std::uint8_t>((twice[x] ^ y) * side + (x ^ twice[y]));
  }
  // The part for one of many samples of the same pixel: the first four, and all sixteen, are spread
  // evenly.
  static std::uint8_t part_of_sample(std::uint32_t sample);
  // Unit. Only of a light that has parts.
  Vec3f direction(std::size_t light, std::uint8_t part) const {
    return regions_[light].directions[part];
  }

  // Within which all directions of a light lie in which it is looked for, in parts or not.
  DirectionRange range(std::size_t light) const { return regions_[light].range; }

 private:
  struct Region {
    bool has = false;
    std::array<Vec3f, count> directions;
    DirectionRange range;
  };
  std::vector<Region> regions_;
};

// The lights that are not compact, in an order in which neighbours in the sky follow each other:
// any few in a row stand for one piece of it.
std::vector<std::uint16_t> order_by_place(std::span<const DirectionalLight> lights);

}  // namespace render
