// Bounds of the screen's light and codes.
#include "compositing/key_glance.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace compositing {
namespace {

// The least code that is at least as bright, of light 0..1.
constexpr int codes = 4096;
const std::array<std::uint8_t, codes>& least_codes(capture::Transfer transfer) {
  static const auto all = [] {
    std::array<std::array<std::uint8_t, codes>, 4> tables{};
    for (std::size_t t = 0; t < tables.size(); ++t) {
      for (std::size_t i = 0; i < tables[t].size(); ++i) {
        const double light = static_cast<double>(i) / static_cast<double>(tables[t].size() - 1);
        const double code = 255 * capture::encode(static_cast<capture::Transfer>(t), light);
        tables[t][i] = static_cast<std::uint8_t>(std::clamp(std::ceil(code), 0.0, 255.0));
      }
    }
    return tables;
  }();
  return all[static_cast<std::size_t>(transfer)];
}

// First to third at most, first at least.
CodeBounds codes_of(F4 bounds,
                    const std::array<std::uint8_t, codes>& table,
                    const std::array<int, 3>& order) {
  using I4 = std::int32_t __attribute__((vector_size(16)));
  const F4 zero{}, one = zero + 1.0F;
  bounds = bounds > zero ? bounds : zero;
  bounds = bounds < one ? bounds : one;
  const I4 at = __builtin_convertvector(bounds * static_cast<float>(codes - 1), I4);
  const auto code = [&](int i) {
    return static_cast<std::uint32_t>(table[static_cast<std::size_t>(at[i])]);
  };
  return {0xFF000000U | code(0) << (8 * order[0]) | code(1) << (8 * order[1]) |
              code(2) << (8 * order[2]),
          code(3) << (8 * order[0])};
}

// Calls add(bounds) for each block: the greatest light of the three channels and the least of the
// first; 0, 0, 0 and 1 where there is no screen.
template <class Add>
void for_each_block(const LitPlate& lit, const Add& add) {
  constexpr float darkest = 0.955F, brightest = 1.15F, more = 0.03F;
  constexpr F4 none{0, 0, 0, 1};
  const int blocks = (lit.width + 7) / 8;
  for (int row = 0; row < lit.rows; row += 2) {
    const float* const above = lit.cell(row, 0);
    const float* const below = lit.cell(std::min(row + 1, lit.rows - 1), 0);
    for (int block = 0; block < blocks; ++block) {
      const int left = 4 * std::min(2 * block, lit.columns - 1);
      const int right = 4 * std::min(2 * block + 1, lit.columns - 1);
      F4 low = load_four(above + left), high = low;
      for (const float* from : {above + right, below + left, below + right}) {
        const F4 cell = load_four(from);
        low = cell < low ? cell : low;
        high = cell > high ? cell : high;
      }
      const float slack = more / high[3];
      const F4 bounds{low[0] * brightest, low[1] + slack, low[2] + slack, high[0] * darkest};
      add(low[3] > 0 ? bounds : none);
    }
  }
}

}  // namespace

void bound_screen(const LitPlate& lit, std::vector<LightBounds>& bounds) {
  bounds.clear();
  for_each_block(lit, [&](F4 b) { bounds.push_back({{b[0], b[1], b[2]}, b[3]}); });
}

void bound_screen(const LitPlate& lit,
                  capture::Transfer transfer,
                  const std::array<int, 3>& order,
                  std::vector<CodeBounds>& bounds) {
  const auto& table = least_codes(transfer);
  bounds.clear();
  for_each_block(lit, [&](F4 b) { bounds.push_back(codes_of(b, table, order)); });
}

LightBounds under(const LightBounds& bounds, float gain) {
  const auto& [first, second, third] = bounds.most;
  return {{first * gain, second * gain, third * gain}, bounds.least * gain};
}

CodeBounds codes_of(const LightBounds& bounds,
                    capture::Transfer transfer,
                    const std::array<int, 3>& order) {
  return codes_of(F4{bounds.most[0], bounds.most[1], bounds.most[2], bounds.least},
                  least_codes(transfer), order);
}

}  // namespace compositing
