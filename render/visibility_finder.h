// Which pixels of a cell see which light, with few rays. Private to the kernel.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "render/light_gather.h"
#include "render/shadow_stream.h"

namespace render {

inline constexpr std::uint64_t block2 = 0x0000000000030003ULL;  // columns 0-1 of its first two rows

// Lights of the table that are no farther apart than so many times both their radii are side by
// side.
inline constexpr float touching = 1.2F;

inline int bit_of(int x, int y) { return (y & 3) * 16 + x; }
inline int point_of(int word, int bit) { return word * 64 + bit; }

// Whether two pixels show the same surface, and it is nearly flat between them.
bool is_one_surface(const Receivers& r, std::size_t a, std::size_t b);

// Sides of a block.
inline constexpr unsigned ends_left = 1, ends_right = 2, ends_above = 4, ends_below = 8;
inline constexpr unsigned both_ends = ends_left | ends_right;

// Marks the blocks of a cell that are one smooth surface, and where that ends.
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
    if (coarse_ && block_ < 4 && !lamps_) look_beside(first, count);
    for (std::size_t i = 0; i < count; ++i) {
      if (!skip_[i]) refine(first, i);
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
  int first_of_block(std::uint32_t light, int word, int bx) const {
    auto any = static_cast<int>((light * 7 + light / 16) & 15);
    // Of lights that have parts, another one for each block: blocks side by side, of different
    // quarters, but where they end.
    if (!lamps_ && context_.has_parts(light)) {
      any ^= (bx / 4 & 1) * 2 + (word & 1) * 8 + bx / 8 + (word & 2) * 2;
    }
    if (block_ == 4) return bit_of(bx + (any & 3), any >> 2);
    return bit_of(bx + at_end(ends_across(word, bx), any & 3),
                  at_end(ends_down(word, bx), any >> 2));
  }
  // Of four pixels in a row, or a column, the one at the end; the first, if both are.
  static int at_end(unsigned ends, int any) {
    return (ends & ends_left) != 0 ? 0 : (ends & ends_right) != 0 ? 3 : any;
  }
  unsigned ends_across(int word, int bx) const {
    return w_.ends[static_cast<std::size_t>(word * 4 + bx / 4)] & both_ends;
  }
  // As if the column were a row.
  unsigned ends_down(int word, int bx) const {
    return w_.ends[static_cast<std::size_t>(word * 4 + bx / 4)] / ends_above;
  }
  // The same block's pixel towards the middle of the cell, for thin shadows of bright light slip
  // through where blocks' pixels are far apart; or the one at the other end.
  int second_of_block(std::uint32_t light, int word, int bx) const {
    const auto any = static_cast<int>((light * 7 + light / 16) & 15);
    const int x = ends_across(word, bx) == both_ends ? 3 : outermost(3 - bx / 4, any & 3);
    const int y = ends_down(word, bx) == both_ends ? 3 : outermost(3 - word, any >> 2);
    return bit_of(bx + x, y);
  }
  bool asks_twice(bool compact, int word, int bx) const {
    const bool narrow = ends_across(word, bx) == both_ends || ends_down(word, bx) == both_ends;
    return block_ < 4 && (compact || narrow);
  }
  // Of four pixels, in the first to last of four blocks.
  static int outermost(int block, int any) { return block == 0 ? 0 : block == 3 ? 3 : any; }
  static int offset2(std::uint32_t light) {
    return bit_of(static_cast<int>(light & 1), static_cast<int>((light >> 1) & 1));
  }

  void test_first(std::uint32_t first, std::size_t i) {
    const std::uint32_t light = first + static_cast<std::uint32_t>(i);
    const bool compact = !lamps_ && context_.table->lights[light].compact != 0;
    for (int word = 0; word < 4; ++word) {
      const auto wi = static_cast<std::size_t>(word);
      const std::uint64_t lit = w_.lit[i][wi];
      std::uint64_t rest = lit;
      if (coarse_ && !(compact && r_.mirrored)) {
        for (int bx = 0; bx < cell_size; bx += 4) {
          const std::uint64_t bits = block4 << bx;
          if ((lit & w_.same4[wi] & bits) != bits) continue;
          test(first, i, word, first_of_block(light, word, bx));
          if (asks_twice(compact, word, bx)) {
            test(first, i, word, second_of_block(light, word, bx));
          }
          rest &= ~bits;
        }
      }
      test_pixels(first, i, word, rest);
    }
  }

  // Whether blocks' pixels disagree.
  bool is_mixed(std::size_t i) const {
    std::uint64_t hidden = 0, seen = 0, tinted = 0;
    for (std::size_t wi = 0; wi < 4; ++wi) {
      hidden |= w_.tested[i][wi] & ~w_.seen[i][wi];
      seen |= w_.tested[i][wi] & w_.seen[i][wi];
      tinted |= tinted_[i][wi];
    }
    return (hidden != 0 && seen != 0) || tinted != 0;
  }

  // What hides a part of a light may hide a little of the one beside it in the sky, or all but a
  // little, which one pixel a block misses: there another one of each is tested. Lights of other
  // groups than this are not looked at.
  void look_beside(std::uint32_t first, std::size_t count) {
    std::array<std::uint8_t, GatherWorkspace::group> mixed;
    std::size_t any = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!skip_[i] && has_parts(first, i) && is_mixed(i)) {
        mixed[any++] = static_cast<std::uint8_t>(i);
      }
    }
    if (any == 0) return;
    const auto& lights = context_.table->lights;
    for (std::size_t i = 0; i < count; ++i) {
      if (skip_[i] || !has_parts(first, i) || is_mixed(i)) continue;
      const DirectionalLight& light = lights[first + i];
      const bool beside = std::any_of(mixed.begin(), mixed.begin() + any, [&](std::uint8_t j) {
        const DirectionalLight& other = lights[first + j];
        const float reach = touching * (light.spread + other.spread);
        return dot(light.direction, other.direction) > 1 - 0.5F * reach * reach;
      });
      if (!beside) continue;
      const std::uint32_t light_number = first + static_cast<std::uint32_t>(i);
      for (int word = 0; word < 4; ++word) {
        const auto wi = static_cast<std::size_t>(word);
        for (int bx = 0; bx < cell_size; bx += 4) {
          const std::uint64_t bits = block4 << bx;
          if ((w_.lit[i][wi] & w_.same4[wi] & bits) != bits) continue;
          test(first, i, word, opposite(first_of_block(light_number, word, bx), bx));
        }
      }
    }
    shoot_rest(first);
  }
  // Of a block's pixels, the one two columns and two rows away.
  static int opposite(int pixel, int bx) {
    return bit_of(bx + ((pixel % cell_size - bx) ^ 2), (pixel / cell_size) ^ 2);
  }

  // Tests pixels one by one, or one of each smooth 2x2 block.
  void test_pixels(std::uint32_t first, std::size_t i, int word, std::uint64_t pixels) {
    const auto wi = static_cast<std::size_t>(word);
    const std::uint32_t light = first + static_cast<std::uint32_t>(i);
    if (block_ >= 2) {
      const std::uint64_t smooth = w_.lit[i][wi] & w_.same2[wi];
      for (std::uint64_t left = pixels; left != 0;) {
        const int k = std::countr_zero(left);
        const int corner = (k / 32) * 32 + (k % 16) / 2 * 2;
        const std::uint64_t bits = block2 << corner;
        left &= ~bits;
        if ((smooth & bits) != bits) continue;
        test(first, i, word, corner + offset2(light));
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

  // Where what was tested of a block disagrees in itself or with the blocks around it, looks
  // closer.
  void refine(std::uint32_t first, std::size_t i) {
    if (!coarse_) return;
    // 4 x 4 flags of blocks: bit by * 4 + bx.
    unsigned whole = 0, sees = 0, hidden = 0, tinted = 0;
    for (int by = 0; by < 4; ++by) {
      const auto wi = static_cast<std::size_t>(by);
      for (int bx = 0; bx < 4; ++bx) {
        const std::uint64_t bits = block4 << (4 * bx);
        if ((w_.lit[i][wi] & w_.same4[wi] & bits) == bits) whole |= 1U << (by * 4 + bx);
        const std::uint64_t tested = w_.tested[i][wi] & bits;
        if (w_.seen[i][wi] & tested) sees |= 1U << (by * 4 + bx);
        if (~w_.seen[i][wi] & tested) hidden |= 1U << (by * 4 + bx);
        if (tinted_[i][wi] & tested) tinted |= 1U << (by * 4 + bx);
      }
    }
    const auto grown = [](unsigned f) {
      const unsigned rows = f | (f << 4) | (f >> 4);
      return (rows | ((rows & 0x7777U) << 1) | ((rows & 0xEEEEU) >> 1)) & 0xFFFFU;
    };
    unsigned differ = (grown(hidden) & sees) | (grown(sees) & hidden) | grown(tinted);
    // Penumbrae of a light that has parts are broad, and what little of them a block's one pixel
    // misses would show beside a block that is looked at more closely.
    if (has_parts(first, i) && hidden != 0 && sees != 0) differ = 0xFFFF;
    for (int by = 0; by < 4; ++by) {
      const auto wi = static_cast<std::size_t>(by);
      for (int bx = 0; bx < 4; ++bx) {
        const unsigned flag = 1U << (by * 4 + bx);
        if (!(whole & flag)) continue;
        const std::uint64_t bits = block4 << (4 * bx);
        if (!(differ & flag) || block_ == 4) {
          if (!(sees & flag)) w_.seen[i][wi] &= ~bits;
          continue;
        }
        test_pixels(first, i, by, bits);
      }
    }
  }

  // Tells what is hidden, or tinted, by something near, where not all of the cell agrees.
  void test_near(std::uint32_t first, std::size_t i) {
    CellMask dimmed{};
    std::uint64_t any_dimmed = 0, any_seen = 0, any_tinted = 0;
    for (std::size_t wi = 0; wi < 4; ++wi) {
      dimmed[wi] = w_.tested[i][wi] & (~w_.seen[i][wi] | tinted_[i][wi]);
      any_dimmed |= dimmed[wi];
      any_seen |= w_.tested[i][wi] & w_.seen[i][wi];
      any_tinted |= tinted_[i][wi];
    }
    if (any_dimmed == 0 || (any_seen | any_tinted) == 0) return;
    const std::uint32_t light = first + static_cast<std::uint32_t>(i);
    const float radius = context_.table->lights[light].spread;
    for (std::size_t wi = 0; wi < 4; ++wi) {
      for (std::uint64_t left = dimmed[wi]; left != 0; left &= left - 1) {
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
    if (block_ < 2) return;
    for (std::size_t wi = 0; wi < 4; ++wi) {
      const std::uint64_t smooth = w_.lit[i][wi] & w_.same2[wi];
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
  std::array<CellMask, GatherWorkspace::group> tinted_{};
};

}  // namespace render
