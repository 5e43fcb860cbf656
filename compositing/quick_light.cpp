// Gains of blocks.
#include "compositing/quick_light.h"

#include <algorithm>
#include <cmath>

#include "compositing/key_glance.h"
#include "compositing/plate_cells.h"

namespace compositing {
namespace {

constexpr int large_picture = 500000;  // pixels
constexpr float gain_kept = 0.01F;     // change of a gain that bounds do not follow

int cells_along(int side, int cell) { return (side + cell - 1) / cell; }

// (1 / first, second / first, third / first, known).
F4 ratios_of(const float* plate) {
  const float over = plate[0] > 0 ? 1 / plate[0] : 1;
  return F4{over, plate[1] * over, plate[2] * over, plate[3] > 0 ? 1.0F : 0.0F};
}

}  // namespace

QuickLight::QuickLight(const LitPlate& bare, float tolerance, float spread)
    : height_(bare.height),
      cell_(bare.height * bare.width > large_picture ? 16 : 8),
      rows_(cells_along(bare.height, key_lanes)),
      columns_(cells_along(bare.width, key_lanes)),
      order_(channels_of(bare.colour)),
      tolerance_(tolerance),
      spread_(spread),
      filler_(cells_along(bare.height, cell_), cells_along(bare.width, cell_), 1) {
  const auto at = [&](int row, int column) {
    return bare.cell(std::min(row, bare.rows - 1), std::min(column, bare.columns - 1));
  };
  const auto pair = [&](int row, int column) {
    const F4 left = load_four(at(row, column)), right = load_four(at(row, column + 1));
    return __builtin_shufflevector(left, right, 0, 1, 2, 3, 4, 5, 6, 7);
  };
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column)
      plates_.push_back({pair(2 * row, 2 * column), pair(2 * row + 1, 2 * column)});
  }
  for (int row = 0; row < filler_.rows(); ++row) {
    for (int column = 0; column < filler_.columns(); ++column) {
      std::array<Look, 2> looks;
      float all = 0, known = 0;
      const int count = cell_ > key_lanes ? 1 : 2;
      for (int i = 0; i < count; ++i) {
        Look& look = looks[static_cast<std::size_t>(i)];
        look.y = row * cell_ + (2 * i + 1) * cell_ / (2 * count);
        look.x = column * cell_ + (cell_ - key_lanes) / 2;
        look.count = look.y < bare.height ? std::clamp(bare.width - look.x, 0, key_lanes) : 0;
        if (look.count == 0) continue;
        const F4 left = ratios_of(at(look.y / bare.step, look.x / bare.step));
        const F4 right = ratios_of(at(look.y / bare.step, look.x / bare.step + 1));
        look.ratios = __builtin_shufflevector(left, right, 0, 1, 2, 3, 4, 5, 6, 7);
        all += static_cast<float>(look.count);
        known += static_cast<float>(look.count) * 0.5F * (left[3] + right[3]);
      }
      looks_.push_back(looks);
      pixels_.push_back(all > 0 && known >= 0.5F * all ? all : 0);
    }
  }
  shown_.assign(looks_.size(), 0);
  blurred_ = shown_;
  smoothed_.assign(looks_.size(), 1);
  gain_row_.resize(static_cast<std::size_t>(filler_.columns()));
  near_ = {filler_.rows(),
           filler_.columns(),
           std::vector<float>(looks_.size(), 1),
           std::vector<std::uint8_t>(looks_.size(), 1),
           {}};
  gains_.assign(plates_.size(), 1);
  block_near_.assign(plates_.size(), 1);
  bound_screen(bare, bare_);
  bare_.resize(plates_.size());
  light_ = bare_;
  light_gains_.assign(plates_.size(), 0);
  codes_.resize(plates_.size());
  code_gains_ = light_gains_;
}

template <class Rows>
PlateSight QuickLight::measure(const Rows& source) {
  const auto look_at = [&](CellSums& sums, std::size_t cell, int, int) {
    for (const Look& look : looks_[cell]) {
      if (look.count == 0) continue;
      const F8 r = look.ratios;
      std::array<F8, 3> c;
      source.load(look.y, look.x, look.count, c);
      sums.add(c,
               {__builtin_shufflevector(r, r, 0, 0, 0, 0, 4, 4, 4, 4),
                __builtin_shufflevector(r, r, 1, 1, 1, 1, 5, 5, 5, 5),
                __builtin_shufflevector(r, r, 2, 2, 2, 2, 6, 6, 6, 6)},
               look.count == key_lanes ? ~I8{} : lanes_below(look.count) > 0.0F, tolerance_);
    }
  };
  return measure_cells(filler_, pixels_, spread_, shown_, look_at);
}

template <class Rows>
PlateSight QuickLight::update(const Rows& rows, bool follow) {
  PlateSight sight = measure(rows);
  const float scale = std::max(static_cast<float>(height_) / learned_height, 1.0F) * key_lanes /
                      static_cast<float>(cell_);
  find_near(shown_, near_cells * scale, deep_cells * scale, near_);
  const int of = cell_ / key_lanes;
  for (int row = 0; row < rows_; ++row) {
    const float* const from =
        &near_.cells[static_cast<std::size_t>(row / of) * static_cast<std::size_t>(near_.columns)];
    std::uint8_t* const to =
        &block_near_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_)];
    for (int i = 0; i < near_.columns; ++i) {
      const std::uint8_t near = from[i] > 0.5F ? 1 : 0;
      to[of * i] = near;
      to[std::min(of * i + of, columns_) - 1] = near;
    }
  }
  if (filler_.fill() > 0) {
    const float* const values = filler_.value(0, 0);
    float sum = 0;
    for (std::size_t i = 0; i < shown_.size(); ++i) sum += values[i];
    sight.gain = sum / static_cast<float>(shown_.size());
    if (follow) light_up();
  }
  return sight;
}

template PlateSight QuickLight::update(const LightRows& rows, bool follow);
template PlateSight QuickLight::update(const CodeRows& rows, bool follow);

// Smooths the gain, and takes it from its cells to blocks.
void QuickLight::light_up() {
  smooth_gains(filler_, blurred_, smoothed_);
  const int columns = filler_.columns();
  const auto width = static_cast<std::size_t>(columns), across = static_cast<std::size_t>(columns_);
  if (cell_ == key_lanes) {
    std::copy(smoothed_.begin(), smoothed_.end(), gains_.begin());
    return;
  }
  // Each cell lies over two blocks, a quarter off its centre.
  for (int row = 0; row < rows_; ++row) {
    const int here = row / 2;
    const int aside = std::clamp(row % 2 == 0 ? here - 1 : here + 1, 0, filler_.rows() - 1);
    const float* const main = &smoothed_[static_cast<std::size_t>(here) * width];
    const float* const other = &smoothed_[static_cast<std::size_t>(aside) * width];
    for (std::size_t i = 0; i < width; ++i) gain_row_[i] = 0.75F * main[i] + 0.25F * other[i];
    float* const to = &gains_[static_cast<std::size_t>(row) * across];
    for (std::size_t i = 0; i + 1 < width; ++i) {
      const float left = gain_row_[i], right = gain_row_[i + 1], quarter = 0.25F * (right - left);
      to[2 * i + 1] = left + quarter, to[2 * i + 2] = right - quarter;
    }
    to[0] = gain_row_[0];
    if (across == 2 * width) to[across - 1] = gain_row_[width - 1];
  }
}

const std::vector<LightBounds>& QuickLight::light_bounds() {
  for (std::size_t i = 0; i < gains_.size(); ++i) {
    if (std::abs(gains_[i] - light_gains_[i]) <= gain_kept * gains_[i]) continue;
    light_gains_[i] = gains_[i];
    light_[i] = under(bare_[i], gains_[i]);
  }
  return light_;
}

const std::vector<CodeBounds>& QuickLight::code_bounds(capture::Transfer transfer) {
  if (transfer != transfer_) std::fill(code_gains_.begin(), code_gains_.end(), 0.0F);
  transfer_ = transfer;
  for (std::size_t i = 0; i < gains_.size(); ++i) {
    if (std::abs(gains_[i] - code_gains_[i]) <= gain_kept * gains_[i]) continue;
    code_gains_[i] = gains_[i];
    codes_[i] = codes_of(under(bare_[i], gains_[i]), transfer, order_);
  }
  return codes_;
}

}  // namespace compositing
