// Light of decoded pictures.
#include "capture/linearise.h"

#include <cstddef>
#include <cstdint>
#include <utility>

namespace capture {
namespace {

std::vector<float> make_table(const ValueGrid& grid, const Curve& curve) {
  std::vector<float> table(static_cast<std::size_t>(grid.size));
  for (int index = 0; index < grid.size; ++index) {
    table[static_cast<std::size_t>(index)] = static_cast<float>(curve(grid.value(index)));
  }
  return table;
}

std::vector<float> alphas_of(int most) {
  std::vector<float> alphas;
  for (int code = 0; code <= most; ++code) {
    alphas.push_back(static_cast<float>(code) / static_cast<float>(most));
  }
  return alphas;
}

// Light of bytes R, G, B, R, G, B, ...
void look_up(const std::uint8_t* __restrict codes,
             std::ptrdiff_t pixels,
             const std::array<const float*, 3>& tables,
             float* __restrict light) {
  const auto [red, green, blue] = tables;
  for (std::ptrdiff_t i = 0; i < 3 * pixels; i += 3) {
    light[i] = red[codes[i]];
    light[i + 1] = green[codes[i + 1]];
    light[i + 2] = blue[codes[i + 2]];
  }
}

// Light of indices of the tables' grid.
void look_up(const CodedRow& row,
             std::ptrdiff_t first,
             std::ptrdiff_t pixels,
             const std::array<const float*, 3>& tables,
             float* __restrict light) {
  const auto [red, green, blue] = tables;
  const std::int32_t* const r = row[0] + first;
  const std::int32_t* const g = row[1] + first;
  const std::int32_t* const b = row[2] + first;
  for (std::ptrdiff_t x = 0; x < pixels; ++x) {
    light[3 * x] = red[r[x]];
    light[3 * x + 1] = green[g[x]];
    light[3 * x + 2] = blue[b[x]];
  }
}

}  // namespace

Lineariser::Lineariser(LightCurves curves) : curves_(std::move(curves)) {}

void Lineariser::make_tables() {
  alphas_.clear();
  if (curves_.alpha && rows_->has_alpha()) alphas_ = alphas_of(rows_->max_alpha());
  const ValueGrid& grid = rows_->grid();
  if (curves_.response) {
    for (std::size_t c = 0; c < 3; ++c) {
      tables_[c] = make_table(grid, (*curves_.response)[c]);
    }
    return;
  }
  const Transfer transfer =
      rows_->transfer_tag() == TransferTag::linear ? Transfer::linear : curves_.colour.transfer;
  tables_ = {};
  tables_[0] = make_table(grid, [&](double value) { return decode(transfer, value); });
}

// The row's light in three channels becomes four.
void Lineariser::premultiply(int y, const Crop& crop, float* row) {
  const std::int32_t* const codes = rows_->read_alpha(y) + crop.x;
  for (std::ptrdiff_t x = crop.width - 1; x >= 0; --x) {
    const float alpha = alphas_[static_cast<std::size_t>(codes[x])];
    const std::array light{row[3 * x], row[3 * x + 1], row[3 * x + 2]};
    for (std::ptrdiff_t c = 0; c < 3; ++c) {
      row[4 * x + c] = alpha * light[static_cast<std::size_t>(c)];
    }
    row[4 * x + 3] = alpha;
  }
}

void Lineariser::linearise(const AVFrame& picture, const Crop& crop, Image& image) {
  if (!rows_ || !rows_->fits(picture)) {
    rows_ = std::make_unique<CodedRows>(picture);
    make_tables();
  }
  image.height = crop.height;
  image.width = crop.width;
  image.channels = alphas_.empty() ? 3 : 4;
  image.pixels.resize(static_cast<std::size_t>(crop.height) * static_cast<std::size_t>(crop.width) *
                      static_cast<std::size_t>(image.channels));
  const float* const red = tables_[0].data();
  const float* const green = tables_[1].empty() ? red : tables_[1].data();
  const float* const blue = tables_[2].empty() ? red : tables_[2].data();
  rows_->begin(picture);
  for (int y = 0; y < crop.height; ++y) {
    float* const to = image.pixels.data() + image.index(y, 0);
    if (const std::uint8_t* packed = rows_->packed_rgb(crop.y + y)) {
      look_up(packed + 3 * static_cast<std::ptrdiff_t>(crop.x), crop.width, {red, green, blue}, to);
      continue;
    }
    look_up(rows_->read(crop.y + y), crop.x, crop.width, {red, green, blue}, to);
    if (!alphas_.empty()) premultiply(crop.y + y, crop, to);
  }
}

std::string Lineariser::description() const {
  if (!rows_) {
    return {};
  }
  std::string words = rows_->description() + ", ";
  if (curves_.response) {
    words += "by its response";
  } else if (rows_->transfer_tag() == TransferTag::linear) {
    words += "linear (tagged)";
  } else {
    words += name_of(curves_.colour.transfer);
  }
  return alphas_.empty() ? words : words + ", alpha";
}

}  // namespace capture
