// Which pixels of a cell see which light of the table, and the light that they get of it. Private
// to the kernel.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/soft_lights.h"

namespace render {

inline constexpr int cell_size = 16;
inline constexpr int cell_pixels = cell_size * cell_size;

// 256 flags of a cell: word = four rows, bit = row % 4 * 16 + column.
using CellMask = std::array<std::uint64_t, 4>;

inline constexpr std::uint64_t block4 = 0x000F000F000F000FULL;  // columns 0-3 of a word's four rows

inline bool none(const CellMask& mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) == 0; }
inline bool in(const CellMask& mask, std::size_t k) { return (mask[k / 64] >> (k % 64) & 1) != 0; }

// A colour at each of a cell's pixels.
struct ColourPlanes {
  alignas(64) std::array<float, cell_pixels> r, g, b;

  Vec3f at(std::size_t k) const { return {r[k], g[k], b[k]}; }
  void put(std::size_t k, Vec3f v) { r[k] = v.x, g[k] = v.y, b[k] = v.z; }
};

// Light that glass weakens on its way to a pixel's centre.
struct TintedLight {
  std::uint16_t light, centre;
  Vec3f lost_share;
};

// By light, then by centre.
inline std::uint32_t key_of(const TintedLight& tint) { return tint.light * 256U + tint.centre; }

// A pixel of soft shadow, and those of the 4x4 about it, within the cell, that show the same
// surface.
struct ShadowWindow {
  std::uint8_t centre;
  std::uint8_t first;     // top left of the 4x4
  std::uint16_t members;  // row by row
};

// What a cell's centres see of each light of the table: pixels that it shines on where no real
// thing is in the way; of these, those that no virtual object hides from it. Where lights have
// parts, a pixel tells of the part that it looked for, and windows share that, but for what is
// hidden by something near.
struct CellVisibility {
  std::vector<CellMask> lit, seen;
  std::vector<CellMask> near;  // none where there are no windows
  std::vector<TintedLight> tints;
  std::vector<ShadowWindow> windows;

  void clear();
};

// Irradiance at a cell's centres.
struct LightSums {
  alignas(64) std::array<float, cell_pixels> open_r, open_g, open_b;  // if nothing virtual blocked
  alignas(64) std::array<float, cell_pixels> lost_r, lost_g, lost_b;  // what virtual objects block

  Vec3f open(std::size_t k) const { return {open_r[k], open_g[k], open_b[k]}; }
  Vec3f lost(std::size_t k) const { return {lost_r[k], lost_g[k], lost_b[k]}; }
  // What is left. Both are sums in orders of their own: where all is lost, they are equal but for
  // rounding.
  Vec3f arriving(std::size_t k) const {
    const Vec3f left = open(k) - lost(k);
    return {left.x > 0 ? left.x : 0.0F, left.y > 0 ? left.y : 0.0F, left.z > 0 ? left.z : 0.0F};
  }
  void add_open(std::size_t k, Vec3f e) { open_r[k] += e.x, open_g[k] += e.y, open_b[k] += e.z; }
  void add_lost(std::size_t k, Vec3f e) { lost_r[k] += e.x, lost_g[k] += e.y, lost_b[k] += e.z; }
};

// Light that centres lose: of all sources; of these, of those that windows share.
struct LostLight {
  ColourPlanes all, shared;
};

// A cell's centres that receive light, and their normals: 0 where there is none.
struct LitCentres {
  const CellMask& receiving;
  const std::array<float, cell_pixels>&nx, &ny, &nz;
};

// Adds up the table's light there: of all of it that is not behind real things, and what of it
// virtual objects take. The centres of windows lose the share of the soft light that the windows
// about them lose as wholes; where none of these loses any, exactly nothing. `more`: what they lose
// besides, or null. `soft` is scratch.
void add_up_light(const LitCentres& centres,
                  std::span<const DirectionalLight> lights,
                  const CellVisibility& visibility,
                  LightSums& sums,
                  LightSums& soft,
                  const LostLight* more = nullptr);

}  // namespace render
