// Which pixels of a cell see which light, with few rays. Private to the kernel.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "render/light_gather.h"
#include "render/shadow_stream.h"

namespace render {

inline constexpr std::uint64_t block2 = 0x0000000000030003ULL;  // columns 0-1 of its first two rows

inline int bit_of(int x, int y) { return (y & 3) * 16 + x; }
inline int point_of(int word, int bit) { return word * 64 + bit; }

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

// Whether two pixels show the same surface, and it is nearly flat between them.
bool is_one_surface(const Receivers& r, std::size_t a, std::size_t b);

// Sides of a block.
inline constexpr unsigned ends_left = 1, ends_right = 2, ends_above = 4, ends_below = 8;
inline constexpr unsigned both_ends = ends_left | ends_right;

// Finds the smooth surfaces of a cell's 4x4 blocks, where they end, and which 2x2 blocks are one.
void find_smooth_blocks(const Receivers& r, GatherWorkspace& w);

// Pixels of one light, or lamp, whose visibility must be tested: see gather_cell.
class VisibilityFinder {
 public:
  VisibilityFinder(const LightContext& context,
                   const Receivers& r,
                   GatherWorkspace& w,
                   RenderStatistics& statistics,
                   unsigned ray_mask,
                   bool lamps = false)
      : context_(context),
        r_(r),
        w_(w),
        statistics_(statistics),
        ray_mask_(ray_mask),
        lamps_(lamps) {}

  // Fills w.seen for lights first .. first + count - 1 from w.lit, and w.near; tints what glass
  // weakens.
  void find(std::uint32_t first, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      w_.seen[i] = w_.lit[i];
      w_.tested[i] = {};
      if (skip_[i]) continue;
      test_first(first, i);
    }
    shoot_rest(first);
    for (std::size_t i = 0; i < count; ++i) {
      if (!skip_[i]) refine(first, i);
    }
    shoot_rest(first);
    for (std::size_t i = 0; i < count; ++i) {
      if (!skip_[i]) refine_quads(first, i);
    }
    shoot_rest(first);
    for (std::size_t i = 0; i < count; ++i) {
      w_.near[i] = {};
      if (!skip_[i] && ray_mask_ == 0 && has_parts(first, i)) test_near(first, i);
    }
    shoot_near(first);
    for (std::size_t i = 0; i < count; ++i) {
      if (!skip_[i]) spread(i);
    }
  }

  std::array<bool, GatherWorkspace::group> skip_{};  // lights that nothing can block here

 private:
  using Region = GatherWorkspace::Region;
  static constexpr int few = 2;  // pixels are tested one by one

  std::span<const Region> regions() const { return std::span(w_.regions).first(w_.region_count); }
  static std::uint64_t bit(int k) { return std::uint64_t{1} << k; }
  bool has_parts(std::uint32_t first, std::size_t i) const {
    return !lamps_ && context_.has_parts(first + i);
  }

  unsigned mask_of_ray(std::size_t point, std::uint32_t light) const {
    if (ray_mask_ != 0) return ray_mask_;
    return r_.mask[point] | (in(r_.by_caustics, point) ? context_.mask_to(light) : 0U);
  }

  void test(std::uint32_t first, std::size_t i, int word, int k) {
    const auto wi = static_cast<std::size_t>(word);
    if (w_.tested[i][wi] & bit(k)) return;
    w_.tested[i][wi] |= bit(k);
    const auto point = static_cast<std::size_t>(point_of(word, k));
    const auto light = first + static_cast<std::uint32_t>(i);
    const unsigned mask = mask_of_ray(point, light);
    if (lamps_) {
      const Vec3f origin{r_.px[point], r_.py[point], r_.pz[point]};
      const WayTo<float> way = way_to(origin, context_.table->lamps[light].position);
      add_ray(w_, r_, point, light, way.direction, mask, way.distance_m * before_lamp);
    } else {
      add_ray(w_, r_, point, light, context_.direction(r_, point, light), mask);
    }
    if (w_.rays == stream_rays) shoot_rest(first);
  }

  void shoot_rest(std::uint32_t first) {
    flush_dimmed(*context_.scene, w_, statistics_,
                 [&](std::uint32_t point, std::uint32_t light, bool blocked, Vec3f share) {
                   const std::size_t i = light - first;
                   if (blocked) {
                     w_.seen[i][point / 64] &= ~bit(static_cast<int>(point % 64));
                   } else if (w_.tints.size() < w_.tints.capacity()) {
                     w_.tints.push_back({light, point, Vec3f{1, 1, 1} - share});
                     tinted_[i][point / 64] |= bit(static_cast<int>(point % 64));
                   }
                 });
  }

  // The pixel that stands for a block: another one for each light. Where blocks are looked at more
  // closely, it is an outermost one where the surface ends beside the block, for things that touch
  // cast narrow shadows, and at the border of the cell, so that no shadow comes in unseen from the
  // cell beside, and the two cells agree where they meet.
  int first_of_block(std::uint32_t light, const Region& region) const {
    const int word = region.word, bx = region.column;
    int any = any_of(light);
    // Of lights that have parts, another one for each block: blocks side by side, of different
    // quarters, but where they end.
    if (!lamps_ && context_.has_parts(light)) {
      any ^= (bx / 4 & 1) * 2 + (word & 1) * 8 + bx / 8 + (word & 2) * 2;
    }
    if (block_ == 4) return bit_of(bx + (any & 3), any >> 2);
    return bit_of(bx + at_end(ends_across(region), any & 3), at_end(ends_down(region), any >> 2));
  }
  static int any_of(std::uint32_t light) { return static_cast<int>((light * 7 + light / 16) & 15); }
  // Of four pixels in a row, or a column, the one at the end; the first, if both are.
  static int at_end(unsigned ends, int any) {
    return (ends & ends_left) != 0 ? 0 : (ends & ends_right) != 0 ? 3 : any;
  }
  static unsigned ends_across(const Region& region) { return region.ends & both_ends; }
  // As if the column were a row.
  static unsigned ends_down(const Region& region) { return region.ends / ends_above; }
  // The same block's pixel towards the middle of the cell, for thin shadows of bright light slip
  // through where blocks' pixels are far apart; or the one at the other end.
  static int second_of_block(std::uint32_t light, const Region& region) {
    const int any = any_of(light), word = region.word, bx = region.column;
    const int x = ends_across(region) == both_ends ? 3 : outermost(3 - bx / 4, any & 3);
    const int y = ends_down(region) == both_ends ? 3 : outermost(3 - word, any >> 2);
    return bit_of(bx + x, y);
  }
  // The block's pixel that looks into the quarter of a light opposite to that of another one: what
  // hides a little of it, or all but a little, is not missed all over a cell.
  static int other_quarter(int pixel, const Region& region) {
    return bit_of(region.column + ((pixel % cell_size - region.column) ^ 2), pixel / cell_size);
  }
  bool asks_twice(bool compact, const Region& region) const {
    const bool narrow = ends_across(region) == both_ends || ends_down(region) == both_ends;
    return block_ < 4 && (compact || narrow);
  }
  // Of four pixels, in the first to last of four blocks.
  static int outermost(int block, int any) { return block == 0 ? 0 : block == 3 ? 3 : any; }
  static int offset2(std::uint32_t light, int row_of_quads = 0) {
    const auto [x, y] = pixel_of_quad(light, static_cast<std::uint32_t>(row_of_quads));
    return bit_of(x, y);
  }
  // The nth of some pixels, counted round.
  static int nth_of(std::uint64_t pixels, int n) {
    for (n %= std::popcount(pixels); n > 0; --n) pixels &= pixels - 1;
    return std::countr_zero(pixels);
  }
  // Of pixels, the first or the last: the farther.
  static int far_from(int pixel, std::uint64_t pixels) {
    const int first = std::countr_zero(pixels), last = 63 - std::countl_zero(pixels);
    return pixel - first > last - pixel ? first : last;
  }

  // The pixels that stand for those of a part of a block on which a light shines: one where the
  // surface ends, another one for each light, and one far from that.
  void test_part(std::uint32_t first, std::size_t i, const Region& region, std::uint64_t pixels) {
    const std::uint32_t light = first + static_cast<std::uint32_t>(i);
    const std::uint64_t at_end = pixels & region.outermost;
    const int one = nth_of(at_end != 0 ? at_end : pixels, any_of(light));
    test(first, i, region.word, one);
    test(first, i, region.word, far_from(one, pixels));
  }

  // One pixel of each 2x2 of a whole block, unless one is tested.
  void test_quads(std::uint32_t first, std::size_t i, const Region& region) {
    const int offset = offset2(first + static_cast<std::uint32_t>(i));
    for (const int corner : {bit_of(0, 0), bit_of(2, 0), bit_of(0, 2), bit_of(2, 2)}) {
      const int quad = region.column + corner;
      if ((w_.tested[i][region.word] & block2 << quad) == 0) {
        test(first, i, region.word, quad + offset);
      }
    }
    by_quads_[i][region.word] |= region.pixels;
  }

  void test_first(std::uint32_t first, std::size_t i) {
    const std::uint32_t light = first + static_cast<std::uint32_t>(i);
    const bool compact = !lamps_ && context_.table->lights[light].compact != 0;
    CellMask rest = w_.lit[i];
    if (coarse_) {
      for (const Region& region : regions()) {
        const std::uint64_t pixels = rest[region.word] & region.pixels;
        const bool whole = region.whole && pixels == region.pixels;
        const bool all = compact && r_.mirrored;
        if (whole && all && quick_) {
          test_quads(first, i, region);
        } else if (whole && !all) {
          const int one = first_of_block(light, region);
          test(first, i, region.word, one);
          if (has_parts(first, i) && block_ < 4) {
            test(first, i, region.word, other_quarter(one, region));
          }
          if (asks_twice(compact, region)) {
            test(first, i, region.word, second_of_block(light, region));
          }
        } else if (!compact && !has_parts(first, i) && std::popcount(pixels) > few) {
          test_part(first, i, region, pixels);
        } else {
          continue;
        }
        rest[region.word] &= ~pixels;
      }
    }
    for (int word = 0; word < 4; ++word) {
      test_pixels(first, i, word, rest[static_cast<std::size_t>(word)]);
    }
  }

  // What was tested of a light, any bits of it.
  struct Answers {
    std::uint64_t seen = 0, hidden = 0, tinted = 0;
    bool disagree() const { return (hidden != 0 && seen != 0) || tinted != 0; }
  };
  Answers answers(std::size_t i) const {
    Answers all;
    for (std::size_t wi = 0; wi < 4; ++wi) {
      all.seen |= w_.tested[i][wi] & w_.seen[i][wi];
      all.hidden |= w_.tested[i][wi] & ~w_.seen[i][wi];
      all.tinted |= tinted_[i][wi];
    }
    return all;
  }

  // Tests pixels one by one, or one of each smooth 2x2 block.
  void test_pixels(std::uint32_t first, std::size_t i, int word, std::uint64_t pixels) {
    const auto wi = static_cast<std::size_t>(word);
    const std::uint32_t light = first + static_cast<std::uint32_t>(i);
    if (block_ >= 2) {
      const std::uint64_t smooth = w_.lit[i][wi] & w_.same2[wi];
      const bool in_parts = has_parts(first, i);
      for (std::uint64_t left = pixels; left != 0;) {
        const int k = std::countr_zero(left);
        const int corner = (k / 32) * 32 + (k % 16) / 2 * 2;
        const std::uint64_t bits = block2 << corner;
        left &= ~bits;
        if ((smooth & bits) != bits) continue;
        test(first, i, word, corner + offset2(light, in_parts ? corner / 32 : 0));
        pixels &= ~bits;
      }
    }
    if (lamps_ || ray_mask_ != 0 || has_parts(first, i) || context_.mask_to(light) != 0) {
      for (; pixels != 0; pixels &= pixels - 1) test(first, i, word, std::countr_zero(pixels));
      return;
    }
    pixels &= ~w_.tested[i][wi];
    w_.tested[i][wi] |= pixels;
    for (int k = 0; k < 64 && pixels >> k != 0; k += 8) {
      const auto eight = static_cast<unsigned>(pixels >> k & 0xFF);
      if (eight == 0) continue;
      if (w_.rays + 8 > stream_rays) shoot_rest(first);
      add_rays(w_, r_, static_cast<std::size_t>(point_of(word, k)), eight, light,
               context_.table->lights[light].direction);
    }
    if (w_.rays == stream_rays) shoot_rest(first);
  }

  // Where what was tested of a region disagrees in itself or with those of its surface around it,
  // looks closer.
  void refine(std::uint32_t first, std::size_t i) {
    if (!coarse_) return;
    const Answers any = answers(i);
    if (any.hidden == 0 && any.tinted == 0) return;
    if (any.seen == 0) {
      w_.seen[i] = {};
      return;
    }
    CellMask sees{}, hidden{}, tinted{};  // by the numbers of regions
    const std::span<const Region> all = regions();
    for (std::size_t n = 0; n < all.size(); ++n) {
      const std::uint64_t tested = w_.tested[i][all[n].word] & all[n].pixels;
      const std::uint64_t seen = w_.seen[i][all[n].word] & tested;
      sees[n / 64] |= std::uint64_t{seen != 0} << (n % 64);
      hidden[n / 64] |= std::uint64_t{seen != tested} << (n % 64);
      tinted[n / 64] |= std::uint64_t{(tinted_[i][all[n].word] & tested) != 0} << (n % 64);
    }
    // Penumbrae of a light that has parts are broad, and what little of them a block's one pixel
    // misses would show beside a block that is looked at more closely.
    const bool broad = has_parts(first, i);
    for (std::size_t n = 0; n < all.size(); ++n) {
      const Region& region = all[n];
      const std::uint64_t pixels = w_.lit[i][region.word] & region.pixels;
      if ((pixels & ~w_.tested[i][region.word]) == 0) continue;
      const CellMask& about = broad ? region.alike : region.beside;
      const bool differs = (in(sees, n) && meet(hidden, about)) ||
                           (in(hidden, n) && meet(sees, about)) || meet(tinted, region.beside);
      const bool whole = region.whole && pixels == region.pixels;
      if (by_quads_[i][region.word] & pixels) continue;
      if (differs && whole && quick_) {
        test_quads(first, i, region);
      } else if (differs && !(whole && block_ == 4)) {
        test_pixels(first, i, region.word, pixels);
      } else if (!in(sees, n)) {
        w_.seen[i][region.word] &= ~pixels;
      }
    }
  }

  // The same for 2x2 pixels of which one is tested.
  void refine_quads(std::uint32_t first, std::size_t i) {
    if (block_ >= 2 || none(by_quads_[i])) return;
    CellMask seen, hidden;
    for (std::size_t wi = 0; wi < 4; ++wi) {
      seen[wi] = w_.tested[i][wi] & w_.seen[i][wi];
      hidden[wi] = w_.tested[i][wi] & ~w_.seen[i][wi];
    }
    const Quads sees = quads_of(seen), hides = quads_of(hidden), dims = quads_of(tinted_[i]);
    const Quads differ = (grown(hides) & sees) | (grown(sees) & hides) | grown(dims);
    if (differ == 0) return;
    const CellMask closer = pixels_of(differ);
    for (int word = 0; word < 4; ++word) {
      const auto wi = static_cast<std::size_t>(word);
      test_pixels(first, i, word, closer[wi] & by_quads_[i][wi]);
    }
  }
  static bool meet(const CellMask& a, const CellMask& b) {
    return ((a[0] & b[0]) | (a[1] & b[1]) | (a[2] & b[2]) | (a[3] & b[3])) != 0;
  }

  // Tells what is hidden, or tinted, by something near, where not all of the cell agrees.
  void test_near(std::uint32_t first, std::size_t i) {
    if (!answers(i).disagree()) return;
    const std::uint32_t light = first + static_cast<std::uint32_t>(i);
    const float radius = context_.table->lights[light].spread;
    for (std::size_t wi = 0; wi < 4; ++wi) {
      std::uint64_t left = w_.tested[i][wi] & (~w_.seen[i][wi] | tinted_[i][wi]);
      for (; left != 0; left &= left - 1) {
        const auto point = wi * 64 + static_cast<std::size_t>(std::countr_zero(left));
        add_ray(w_, r_, point, light, context_.direction(r_, point, light),
                mask_of_ray(point, light), w_.sharp_m[point] / radius);
        if (w_.rays == stream_rays) shoot_near(first);
      }
    }
  }

  void shoot_near(std::uint32_t first) {
    flush_dimmed(*context_.scene, w_, statistics_,
                 [&](std::uint32_t point, std::uint32_t light, bool, Vec3f) {
                   w_.near[light - first][point / 64] |= bit(static_cast<int>(point % 64));
                 });
  }

  // Gives a 2x2 block's answer to its four pixels.
  void spread(std::size_t i) {
    if (block_ < 2 && none(by_quads_[i])) return;
    for (std::size_t wi = 0; wi < 4; ++wi) {
      const std::uint64_t smooth = block_ < 2 ? by_quads_[i][wi] : w_.lit[i][wi] & w_.same2[wi];
      std::uint64_t left = smooth & w_.tested[i][wi] & ~w_.seen[i][wi];
      for (; left != 0; left &= left - 1) {
        const int k = std::countr_zero(left);
        const std::uint64_t bits = block2 << ((k / 32) * 32 + (k % 16) / 2 * 2);
        if ((smooth & bits) != bits) continue;
        const std::uint64_t others = bits & ~w_.tested[i][wi];
        w_.seen[i][wi] &= ~others;
        if (w_.near[i][wi] & bit(k)) w_.near[i][wi] |= others;
      }
    }
  }

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
