// Which pixels of a cell see which light, with few rays. Private to the kernel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "render/light_gather.h"

namespace render {

// A cell's 2x2 blocks: bit = row * 8 + column.
using Quads = std::uint64_t;

// Those that have any of some pixels.
inline Quads quads_of(const CellMask& pixels) {
  Quads all = 0;
  for (std::size_t word = 0; word < 4; ++word) {
    std::uint64_t q = pixels[word] | pixels[word] >> 16;  // of two rows
    q = (q | q >> 1) & 0x0000555500005555ULL;             // of two columns
    q = (q | q >> 1) & 0x0000333300003333ULL;
    q = (q | q >> 2) & 0x00000F0F00000F0FULL;
    q = (q | q >> 4) & 0x000000FF000000FFULL;
    all |= (q & 0xFF) << (16 * word) | (q >> 32) << (16 * word + 8);
  }
  return all;
}

inline CellMask pixels_of(Quads quads) {
  CellMask all;
  for (std::size_t word = 0; word < 4; ++word) {
    std::uint64_t q = quads >> (16 * word);
    q = (q & 0xFF) | (q & 0xFF00) << 24;
    q = (q | q << 4) & 0x00000F0F00000F0FULL;
    q = (q | q << 2) & 0x0000333300003333ULL;
    q = (q | q << 1) & 0x0000555500005555ULL;
    q |= q << 1;
    all[word] = q | q << 16;
  }
  return all;
}

// And those about them.
inline Quads grown(Quads quads) {
  constexpr Quads first_column = 0x0101010101010101ULL;
  const Quads rows = quads | quads << 8 | quads >> 8;
  return rows | (rows & ~(first_column << 7)) << 1 | (rows & ~first_column) >> 1;
}

// The column and row of the pixel that stands for a 2x2 block: another one for each light. Of a
// light that is looked for in parts, those of any four blocks together are to look into all four
// quarters of its region, and pixels two apart look into opposite ones (SoftLights::part_of_pixel):
// in blocks of odd rows it is the one above or below.
inline std::array<int, 2> pixel_of_quad(std::uint32_t light, std::uint32_t row_of_quads) {
  return {static_cast<int>(light & 1), static_cast<int>((light >> 1 ^ row_of_quads) & 1)};
}

// Pixels of one light, or lamp, whose visibility must be tested: see gather_cell. Of one group of
// lights of a cell whose smooth blocks are found.
class VisibilityFinder {
 public:
  // `ray_mask`: what blocks; 0 = what each receiver's mask says. `lamps`: the table's lamps instead
  // of its lights.
  VisibilityFinder(const LightContext& context,
                   const Receivers& r,
                   GatherWorkspace& w,
                   RenderStatistics& statistics,
                   unsigned ray_mask,
                   bool lamps = false);

  // Fills w.seen for the lights from `first` on from w.lit, and w.near; tints what glass weakens.
  // `skip` is of each of them, at most a group: whether nothing can block it here.
  void find(std::uint32_t first, std::span<const bool> skip);

 private:
  using Region = GatherWorkspace::Region;
  // What was tested of a light, any bits of it.
  struct Answers {
    std::uint64_t seen = 0, hidden = 0, tinted = 0;
    bool disagree() const { return (hidden != 0 && seen != 0) || tinted != 0; }
  };

  std::span<const Region> regions() const;
  bool has_parts(std::uint32_t first, std::size_t i) const;
  unsigned mask_of_ray(std::size_t point, std::uint32_t light) const;
  int first_of_block(std::uint32_t light, const Region& region) const;
  bool asks_twice(bool compact, const Region& region) const;
  Answers answers(std::size_t i) const;

  void test(std::uint32_t first, std::size_t i, int word, int k);
  void test_part(std::uint32_t first, std::size_t i, const Region& region, std::uint64_t pixels);
  void test_quads(std::uint32_t first, std::size_t i, const Region& region);
  void test_pixels(std::uint32_t first, std::size_t i, int word, std::uint64_t pixels);
  void test_first(std::uint32_t first, std::size_t i);
  void test_near(std::uint32_t first, std::size_t i);
  void shoot_rest(std::uint32_t first);
  void shoot_near(std::uint32_t first);
  void refine(std::uint32_t first, std::size_t i);
  void refine_quads(std::uint32_t first, std::size_t i);
  void spread(std::size_t i);

  const LightContext& context_;
  const Receivers& r_;
  GatherWorkspace& w_;
  RenderStatistics& statistics_;
  unsigned ray_mask_;
  bool lamps_;
  int block_ = context_.effort->interleave;
  bool coarse_ = context_.effort->adaptive_visibility || block_ == 4;
  // Where no light is looked for in parts, as while things move, 4x4 pixels are looked at more
  // closely by one of each 2x2 first.
  bool quick_ = context_.parts == nullptr && block_ < 4;
  std::array<CellMask, GatherWorkspace::group> tinted_{};
  std::array<CellMask, GatherWorkspace::group> by_quads_{};  // pixels of which each 2x2 is tested
};

}  // namespace render
