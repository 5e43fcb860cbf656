// What rough lobes at a cell's pixels see of the sky, as the table's lights tell. Private to the
// kernel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "calibrate/vec.h"
#include "render/cell_visibility.h"

namespace render {

struct LightRows;

// A lobe of what the centre of a pixel met.
struct RoughLobe {
  calibrate::Vec3f normal, geometric_normal, view;  // unit
  float roughness = 0;
};

// The share of a lobe's light that nothing hides, and of how many lights that is known; 0: nothing
// is known. A ray in the middle of the lobe tells as much as a few lights.
struct OpenLobe {
  float share = 1, lights = 0;

  float by_ray() const { return 4 / (lights + 4); }
  float by_lights() const { return share * (1 - by_ray()); }
};

// As ratios, by which what lobes see of the environment is multiplied: after Heitz, Hill and
// McGuire, "Combining Analytic Direct Illumination and Stochastic Shadows", I3D 2018.
class OpenLobes {
 public:
  // Of another cell.
  void clear() { rough_ = found_ = {}; }
  // Of a pixel's lobes the roughest stands for all.
  void note(std::size_t pixel, const RoughLobe& lobe);
  // By what pixels that receive light see of the lights, compact ones aside: those of 4x4 that show
  // one surface (a number each) share it, and between such blocks it is interpolated.
  void find(const CellVisibility& visibility,
            const CellMask& receiving,
            const LightRows& lights,
            std::span<const std::uint32_t, cell_pixels> surfaces);
  OpenLobe at(std::size_t pixel) const { return in(found_, pixel) ? open_[pixel] : OpenLobe{}; }

 private:
  static constexpr std::size_t side = 4, in_row = cell_size / side;  // of blocks

  // Of pixels of a block that show one surface.
  struct OfSurface {
    std::uint32_t surface;
    OpenLobe lobe;
  };
  struct Block {
    std::array<OfSurface, side * side> surfaces;
    std::size_t count = 0;
  };

  static std::size_t block_of(std::size_t pixel) {
    return pixel / cell_size / side * in_row + pixel % cell_size / side;
  }
  void sum_tints(const CellVisibility& visibility);
  OpenLobe seen_by(const RoughLobe& lobe,
                   std::size_t word,
                   std::uint64_t members,
                   const CellVisibility& visibility,
                   const CellMask& receiving,
                   const LightRows& lights) const;
  OpenLobe between(std::span<const Block, in_row * in_row> blocks,
                   std::size_t pixel,
                   std::uint32_t surface) const;

  CellMask rough_{}, found_{};
  std::array<RoughLobe, cell_pixels> lobes_;
  std::array<OpenLobe, cell_pixels> open_;
  std::vector<float> tinted_;  // (light, block): what glass takes, in pixels
};

}  // namespace render
