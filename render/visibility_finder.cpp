// Which pixels of a cell see which light, with few rays.
#include "render/visibility_finder.h"

#include <algorithm>
#include <bit>

#include "render/shadow_stream.h"
#include "render/smooth_blocks.h"

namespace render {
namespace {

constexpr int few_pixels = 2;                            // are tested one by one
constexpr std::uint64_t block2 = 0x0000000000030003ULL;  // columns 0-1 of its first two rows

std::uint64_t flag(int bit) { return std::uint64_t{1} << bit; }
int bit_of(int x, int y) { return (y & 3) * 16 + x; }
int point_of(int word, int bit) { return word * 64 + bit; }
std::uint64_t quad_about(int bit) { return block2 << ((bit / 32) * 32 + (bit % 16) / 2 * 2); }

bool meet(const CellMask& a, const CellMask& b) {
  return ((a[0] & b[0]) | (a[1] & b[1]) | (a[2] & b[2]) | (a[3] & b[3])) != 0;
}

// Of a block's 16 pixels.
int any_of(std::uint32_t light) { return static_cast<int>((light * 7 + light / 16) & 15); }
// Of four pixels in a row, or a column, the one at the end; the first, if both are.
int at_end(unsigned ends, int any) {
  return (ends & ends_left) != 0 ? 0 : (ends & ends_right) != 0 ? 3 : any;
}
unsigned ends_across(const GatherWorkspace::Region& region) { return region.ends & both_ends; }
// As if the column were a row.
unsigned ends_down(const GatherWorkspace::Region& region) { return region.ends / ends_above; }
// Of four pixels, in the first to last of four blocks.
int outermost(int block, int any) { return block == 0 ? 0 : block == 3 ? 3 : any; }

// The same block's pixel towards the middle of the cell, for thin shadows of bright light slip
// through where blocks' pixels are far apart; or the one at the other end.
int second_of_block(std::uint32_t light, const GatherWorkspace::Region& region) {
  const int any = any_of(light), word = region.word, bx = region.column;
  const int x = ends_across(region) == both_ends ? 3 : outermost(3 - bx / 4, any & 3);
  const int y = ends_down(region) == both_ends ? 3 : outermost(3 - word, any >> 2);
  return bit_of(bx + x, y);
}
// The block's pixel that looks into the quarter of a light opposite to that of another one: what
// hides a little of it, or all but a little, is not missed all over a cell.
int other_quarter(int pixel, const GatherWorkspace::Region& region) {
  return bit_of(region.column + ((pixel % cell_size - region.column) ^ 2), pixel / cell_size);
}
int offset2(std::uint32_t light, int row_of_quads = 0) {
  const auto [x, y] = pixel_of_quad(light, static_cast<std::uint32_t>(row_of_quads));
  return bit_of(x, y);
}
// The nth of some pixels, counted round.
int nth_of(std::uint64_t pixels, int n) {
  for (n %= std::popcount(pixels); n > 0; --n) pixels &= pixels - 1;
  return std::countr_zero(pixels);
}
// Of pixels, the first or the last: the farther.
int far_from(int pixel, std::uint64_t pixels) {
  const int first = std::countr_zero(pixels), last = 63 - std::countl_zero(pixels);
  return pixel - first > last - pixel ? first : last;
}

}  // namespace

VisibilityFinder::VisibilityFinder(const LightContext& context,
                                   const Receivers& r,
                                   GatherWorkspace& w,
                                   RenderStatistics& statistics,
                                   unsigned ray_mask,
                                   bool lamps)
    : context_(context),
      r_(r),
      w_(w),
      statistics_(statistics),
      ray_mask_(ray_mask),
      lamps_(lamps) {}

void VisibilityFinder::find(std::uint32_t first, std::span<const bool> skip) {
  const std::size_t count = skip.size();
  for (std::size_t i = 0; i < count; ++i) {
    w_.seen[i] = w_.lit[i];
    w_.tested[i] = {};
    if (skip[i]) continue;
    test_first(first, i);
  }
  shoot_rest(first);
  for (std::size_t i = 0; i < count; ++i) {
    if (!skip[i]) refine(first, i);
  }
  shoot_rest(first);
  for (std::size_t i = 0; i < count; ++i) {
    if (!skip[i]) refine_quads(first, i);
  }
  shoot_rest(first);
  w_.notes.go_on(ShadowRays::near_to_lights);
  for (std::size_t i = 0; i < count; ++i) {
    w_.near[i] = {};
    if (!skip[i] && ray_mask_ == 0 && has_parts(first, i)) test_near(first, i);
  }
  shoot_near(first);
  w_.notes.go_on(lamps_ ? ShadowRays::to_lamps : ShadowRays::to_lights);
  for (std::size_t i = 0; i < count; ++i) {
    if (!skip[i]) spread(i);
  }
}

std::span<const GatherWorkspace::Region> VisibilityFinder::regions() const {
  return std::span(w_.regions).first(w_.region_count);
}
bool VisibilityFinder::has_parts(std::uint32_t first, std::size_t i) const {
  return !lamps_ && context_.has_parts(first + i);
}

unsigned VisibilityFinder::mask_of_ray(std::size_t point, std::uint32_t light) const {
  if (ray_mask_ != 0) return ray_mask_;
  return r_.mask[point] | (in(r_.by_caustics, point) ? context_.mask_to(light) : 0U);
}

void VisibilityFinder::test(std::uint32_t first, std::size_t i, int word, int k) {
  const auto wi = static_cast<std::size_t>(word);
  if (w_.tested[i][wi] & flag(k)) return;
  w_.tested[i][wi] |= flag(k);
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

void VisibilityFinder::shoot_rest(std::uint32_t first) {
  flush_dimmed(*context_.scene, w_, statistics_,
               [&](std::uint32_t point, std::uint32_t light, bool blocked, Vec3f share) {
                 const std::size_t i = light - first;
                 if (blocked) {
                   w_.seen[i][point / 64] &= ~flag(static_cast<int>(point % 64));
                 } else if (w_.tints.size() < w_.tints.capacity()) {
                   w_.tints.push_back({light, point, Vec3f{1, 1, 1} - share});
                   tinted_[i][point / 64] |= flag(static_cast<int>(point % 64));
                 }
               });
}

// The pixel that stands for a block: another one for each light. Where blocks are looked at more
// closely, it is an outermost one where the surface ends beside the block, for things that touch
// cast narrow shadows, and at the border of the cell, so that no shadow comes in unseen from the
// cell beside, and the two cells agree where they meet.
int VisibilityFinder::first_of_block(std::uint32_t light, const Region& region) const {
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

bool VisibilityFinder::asks_twice(bool compact, const Region& region) const {
  const bool narrow = ends_across(region) == both_ends || ends_down(region) == both_ends;
  return block_ < 4 && (compact || narrow);
}

// The pixels that stand for those of a part of a block on which a light shines: one where the
// surface ends, another one for each light, and one far from that.
void VisibilityFinder::test_part(std::uint32_t first,
                                 std::size_t i,
                                 const Region& region,
                                 std::uint64_t pixels) {
  const std::uint32_t light = first + static_cast<std::uint32_t>(i);
  const std::uint64_t outer = pixels & region.outermost;
  const int one = nth_of(outer != 0 ? outer : pixels, any_of(light));
  test(first, i, region.word, one);
  test(first, i, region.word, far_from(one, pixels));
}

// One pixel of each 2x2 of a whole block, unless one is tested.
void VisibilityFinder::test_quads(std::uint32_t first, std::size_t i, const Region& region) {
  const int offset = offset2(first + static_cast<std::uint32_t>(i));
  for (const int corner : {bit_of(0, 0), bit_of(2, 0), bit_of(0, 2), bit_of(2, 2)}) {
    const int quad = region.column + corner;
    if ((w_.tested[i][region.word] & block2 << quad) == 0) {
      test(first, i, region.word, quad + offset);
    }
  }
  by_quads_[i][region.word] |= region.pixels;
}

void VisibilityFinder::test_first(std::uint32_t first, std::size_t i) {
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
      } else if (!compact && !has_parts(first, i) && std::popcount(pixels) > few_pixels) {
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

VisibilityFinder::Answers VisibilityFinder::answers(std::size_t i) const {
  Answers all;
  for (std::size_t wi = 0; wi < 4; ++wi) {
    all.seen |= w_.tested[i][wi] & w_.seen[i][wi];
    all.hidden |= w_.tested[i][wi] & ~w_.seen[i][wi];
    all.tinted |= tinted_[i][wi];
  }
  return all;
}

// Tests pixels one by one, or one of each smooth 2x2 block.
void VisibilityFinder::test_pixels(std::uint32_t first,
                                   std::size_t i,
                                   int word,
                                   std::uint64_t pixels) {
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
void VisibilityFinder::refine(std::uint32_t first, std::size_t i) {
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
void VisibilityFinder::refine_quads(std::uint32_t first, std::size_t i) {
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

// Tells what is hidden, or tinted, by something near, where not all of the cell agrees.
void VisibilityFinder::test_near(std::uint32_t first, std::size_t i) {
  if (!answers(i).disagree()) return;
  const std::uint32_t light = first + static_cast<std::uint32_t>(i);
  const float radius = context_.table->lights[light].spread;
  for (std::size_t wi = 0; wi < 4; ++wi) {
    std::uint64_t left = w_.tested[i][wi] & (~w_.seen[i][wi] | tinted_[i][wi]);
    for (; left != 0; left &= left - 1) {
      const auto point = wi * 64 + static_cast<std::size_t>(std::countr_zero(left));
      add_ray(w_, r_, point, light, context_.direction(r_, point, light), mask_of_ray(point, light),
              w_.sharp_m[point] / radius);
      if (w_.rays == stream_rays) shoot_near(first);
    }
  }
}

void VisibilityFinder::shoot_near(std::uint32_t first) {
  flush_dimmed(*context_.scene, w_, statistics_,
               [&](std::uint32_t point, std::uint32_t light, bool, Vec3f) {
                 w_.near[light - first][point / 64] |= flag(static_cast<int>(point % 64));
               });
}

// Gives a 2x2 block's answer to its four pixels.
void VisibilityFinder::spread(std::size_t i) {
  if (block_ < 2 && none(by_quads_[i])) return;
  for (std::size_t wi = 0; wi < 4; ++wi) {
    const std::uint64_t smooth = block_ < 2 ? by_quads_[i][wi] : w_.lit[i][wi] & w_.same2[wi];
    std::uint64_t left = smooth & w_.tested[i][wi] & ~w_.seen[i][wi];
    for (; left != 0; left &= left - 1) {
      const int k = std::countr_zero(left);
      const std::uint64_t bits = quad_about(k);
      if ((smooth & bits) != bits) continue;
      const std::uint64_t others = bits & ~w_.tested[i][wi];
      w_.seen[i][wi] &= ~others;
      if (w_.near[i][wi] & flag(k)) w_.near[i][wi] |= others;
    }
  }
}

}  // namespace render
