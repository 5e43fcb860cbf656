// The plate's gain, frame by frame.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "compositing/clean_plate.h"
#include "compositing/key_lanes.h"

namespace compositing {
namespace {

constexpr float least_excess = 0.004F;  // of display white: below it a plate shows no screen
constexpr float least_gain = 0.15F, most_gain = 2.5F;
constexpr float clipped_from = 0.985F;
// Of a cell's gain in its neighbourhood's light: deep shadow, and what is too dark to have a
// colour.
constexpr float deep = 0.25F, black = 0.03F;

int cells_along(int side, int step) { return (side + step - 1) / step; }

float excess_of(const float* c, ScreenColour colour) {
  return has_two_primaries(colour) ? screen_excess<true>(c[0], c[1], c[2])
                                   : screen_excess<false>(c[0], c[1], c[2]);
}

// Means over squares of `step` pixels; (rows, columns, 4), channels in the keyer's order.
std::vector<float> means_over(const CleanPlate& plate, int step) {
  const capture::Image& light = plate.light;
  const int rows = cells_along(light.height, step), columns = cells_along(light.width, step);
  const auto order = channels_of(plate.colour);
  std::vector<float> means(4 * static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      float* to = &means[4 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                              static_cast<std::size_t>(column))];
      float count = 0;
      for (int y = row * step; y < std::min(light.height, (row + 1) * step); ++y) {
        for (int x = column * step; x < std::min(light.width, (column + 1) * step); ++x) {
          for (std::size_t c = 0; c < 3; ++c) to[c] += light.at(y, x, order[c]);
          count += 1;
        }
      }
      for (std::size_t c = 0; c < 3; ++c) to[c] /= count;
    }
  }
  return means;
}

F8 lanes_below(int count) {
  F8 v{};
  for (int i = 0; i < count; ++i) v[i] = 1;
  return v;
}

}  // namespace

std::array<float, 4> plate_at(const LitPlate& plate, int y, int x) {
  const auto steps = [&](int at, int cells, int& before, int& after) {
    const float cell = (static_cast<float>(at) + 0.5F) / static_cast<float>(plate.step) - 0.5F;
    const float inside = std::clamp(cell, 0.0F, static_cast<float>(cells - 1));
    before = static_cast<int>(inside);
    after = std::min(before + 1, cells - 1);
    return inside - static_cast<float>(before);
  };
  int r0, r1, c0, c1;
  const float v = steps(y, plate.rows, r0, r1), u = steps(x, plate.columns, c0, c1);
  std::array<float, 4> p{};
  for (std::size_t i = 0; i < 4; ++i) {
    const float top = plate.cell(r0, c0)[i] + u * (plate.cell(r0, c1)[i] - plate.cell(r0, c0)[i]);
    const float low = plate.cell(r1, c0)[i] + u * (plate.cell(r1, c1)[i] - plate.cell(r1, c0)[i]);
    p[i] = top + v * (low - top);
  }
  return p;
}

PlateLight::PlateLight(CleanPlate plate, PlateUse use)
    : plate_(std::move(plate)),
      filler_(cells_along(std::max(plate_.light.height, 1), cell),
              cells_along(std::max(plate_.light.width, 1), cell),
              1) {
  if (plate_.light.empty() || plate_.light.channels != 3) {
    throw std::invalid_argument("the clean plate is empty");
  }
  for (float& value : plate_.light.pixels) {
    if (!(value > 0 && value < 1e9F)) value = 0;
  }
  bare_.height = plate_.light.height;
  bare_.width = plate_.light.width;
  bare_.use = use;
  bare_.step = use == PlateUse::screen ? 4 : 1;
  bare_.rows = cells_along(bare_.height, bare_.step);
  bare_.columns = cells_along(bare_.width, bare_.step);
  bare_.colour = plate_.colour;
  bare_.cells = means_over(plate_, bare_.step);
  double variance = 0, excess = 0, light = 0, count = 0;
  for (std::size_t i = 0; i < bare_.cells.size(); i += 4) {
    float* c = &bare_.cells[i];
    const auto noise = [&](float x) { return plate_.noise_gain * x + plate_.noise_floor; };
    const float own = excess_of(c, plate_.colour);
    if (use == PlateUse::screen) {
      c[3] = own > least_excess ? 1 / own : 0;
    } else {
      // Codes of 8 bits are not finer than this, and edges of the plate never quite the same.
      c[3] = 1 /
             std::sqrt((noise(c[0]) + noise(c[1]) + noise(c[2])) / 3 + 4e-6F + 4e-4F * c[0] * c[0]);
    }
    if (c[3] <= 0) continue;
    variance += noise(c[0]) + 0.25F * (noise(c[1]) + noise(c[2]));
    excess += own, light += c[0], count += 1;
  }
  const double deviation = std::sqrt(variance / std::max(count, 1.0));
  bare_.sigma =
      use == PlateUse::screen && count > 0 ? static_cast<float>(deviation * count / excess) : 0.05F;
  const float share = static_cast<float>(deviation * std::max(count, 1.0) / std::max(light, 1e-3));
  tolerance_ = 0.035F + 3 * share;
  spread_ = 0.025F + 1.3F * share;
  lit_ = bare_;
  raw_.resize(static_cast<std::size_t>(filler_.rows()) *
              static_cast<std::size_t>(filler_.columns()));
  gains_.assign(raw_.size(), 1.0F);
  blurred_ = gains_;
}

// The plate at eight pixels, without gain, from (y, x) on, to the nearest cell. Returns how many of
// them show a screen.
float PlateLight::cells_at(int y, int x, std::array<F8, 3>& p) const {
  const int last = bare_.columns - 1;
  if (bare_.step == 4) {
    const float* a = bare_.cell(y / 4, x / 4);
    const float* b = bare_.cell(y / 4, std::min(x / 4 + 1, last));
    for (std::size_t c = 0; c < 3; ++c) p[c] = F8{a[c], a[c], a[c], a[c], b[c], b[c], b[c], b[c]};
    return (a[3] > 0 ? 4.0F : 0.0F) + (b[3] > 0 ? 4.0F : 0.0F);
  }
  for (int lane = 0; lane < key_lanes; ++lane) {
    const float* at = bare_.cell(y, std::min(x + lane, last));
    p[0][lane] = at[0], p[1][lane] = at[1], p[2][lane] = at[2];
  }
  return key_lanes;
}

// Gain of each cell whose pixels have the plate's colour, all about equally bright.
template <class Rows>
PlateSight PlateLight::measure(const Rows& source) {
  static_assert(cell == key_lanes);
  const int rows_apart = bare_.height * bare_.width > 500000 ? 4 : 2;
  std::size_t i = 0;
  float screen = 0, seen = 0, clipped = 0, off = 0, all_known = 0;
  F8 dark{};
  for (int row = 0; row < filler_.rows(); ++row) {
    const int bottom = std::min(bare_.height, (row + 1) * cell);
    for (int column = 0; column < filler_.columns(); ++column, ++i) {
      raw_[i] = 0;
      filler_.value(row, column)[0] = 0;
      filler_.weight(row, column) = 0;
      const int count = std::min(cell, bare_.width - column * cell);
      F8 n{}, sum{}, squares{}, bright{}, apart{};
      float all = 0, known = 0;
      for (int y = row * cell + 1; y < bottom; y += rows_apart) {
        std::array<F8, 3> p;
        known += cells_at(y, column * cell, p);
        const F8 inside = count == cell ? all_of(1) : lanes_below(count);
        std::array<F8, 3> c;
        source.load(y, column * cell, count, c);
        const F8 q = c[0] / (p[0] > 0.0F ? p[0] : all_of(1));
        const F8 d1 = c[1] - p[1] * q, d2 = c[2] - p[2] * q;
        const F8 away = (d1 < 0.0F ? -d1 : d1) + (d2 < 0.0F ? -d2 : d2);
        const I8 coloured = (away < tolerance_ * c[0]) & (inside > 0.0F);
        const I8 alike = coloured & (q > least_gain) & (q < most_gain);
        dark += coloured & (q > black) & (q < deep) ? all_of(1) : F8{};
        const F8 one = alike ? all_of(1) : F8{};
        n += one, sum += one * q, squares += one * q * q;
        apart += alike ? away / c[0] : F8{};
        bright += c[0] >= clipped_from ? one : F8{};
        all += static_cast<float>(count);
      }
      if (known < 0.5F * all) continue;
      all_known += all;
      screen += 1;
      const float alike = sum_of(n);
      if (alike < 0.6F * all) continue;
      const float mean = sum_of(sum) / alike;
      const float deviation = std::sqrt(std::max(0.0F, sum_of(squares) / alike - mean * mean));
      if (deviation > 0.02F * mean + spread_) continue;
      raw_[i] = mean;
      filler_.value(row, column)[0] = mean;
      filler_.weight(row, column) = 1;
      seen += 1, clipped += sum_of(bright) / alike, off += sum_of(apart) / alike;
    }
  }
  PlateSight sight;
  sight.has_screen = screen > 0;
  sight.screen = screen > 0 ? seen / screen : 0;
  sight.clipped = seen > 0 ? clipped / seen : 0;
  sight.shadowed = all_known > 0 ? sum_of(dark) / all_known : 0;
  sight.mismatch = seen > 0 ? off / seen : 0;
  return sight;
}

void PlateLight::check_size(int height, int width) const {
  if (height == bare_.height && width == bare_.width) return;
  throw std::invalid_argument("the clean plate is " + std::to_string(bare_.width) + "x" +
                              std::to_string(bare_.height) + ", the frame " +
                              std::to_string(width) + "x" + std::to_string(height));
}

PlateSight PlateLight::update(const capture::Image& frame, bool follow) {
  check_size(frame.height, frame.width);
  if (frame.channels != 3) throw std::invalid_argument("a frame to key has three channels");
  return update_from(LightRows(frame, channels_of(plate_.colour)), follow);
}

PlateSight PlateLight::update(const CodedFrame& frame, bool follow) {
  check_size(frame.height, frame.width);
  if (frame.rgba.size() !=
      4 * static_cast<std::size_t>(frame.height) * static_cast<std::size_t>(frame.width)) {
    throw std::invalid_argument("the codes of a frame to key do not fill it");
  }
  return update_from(CodeRows(frame.rgba.data(), frame.width, channels_of(plate_.colour),
                              light_polynomial(frame.transfer)),
                     follow);
}

template <class Rows>
PlateSight PlateLight::update_from(const Rows& rows, bool follow) {
  PlateSight sight = measure(rows);
  if (filler_.fill() > 0) {
    float sum = 0;
    for (int row = 0; row < filler_.rows(); ++row) {
      for (int column = 0; column < filler_.columns(); ++column) {
        sum += filler_.value(row, column)[0];
      }
    }
    sight.gain = sum / static_cast<float>(raw_.size());
    if (follow) light_up();
  }
  if (!follow) std::copy(bare_.cells.begin(), bare_.cells.end(), lit_.cells.begin());
  return sight;
}

// Smooths the gain and puts it on the plate.
void PlateLight::light_up() {
  const int rows = filler_.rows(), columns = filler_.columns();
  const auto at = [&](int row, int column) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const float before = filler_.value(row, std::max(0, column - 1))[0];
      const float after = filler_.value(row, std::min(columns - 1, column + 1))[0];
      blurred_[at(row, column)] = 0.25F * (before + after) + 0.5F * filler_.value(row, column)[0];
    }
  }
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const float before = blurred_[at(std::max(0, row - 1), column)];
      const float after = blurred_[at(std::min(rows - 1, row + 1), column)];
      gains_[at(row, column)] = 0.25F * (before + after) + 0.5F * blurred_[at(row, column)];
    }
  }
  const float reach = static_cast<float>(cell / lit_.step);  // of a gain's cell, in plate cells
  const auto steps = [&](int at, int cells, int& before, int& after) {
    const float place = (static_cast<float>(at) + 0.5F) / reach - 0.5F;
    const float inside = std::clamp(place, 0.0F, static_cast<float>(cells - 1));
    before = static_cast<int>(inside);
    after = std::min(before + 1, cells - 1);
    return inside - static_cast<float>(before);
  };
  const bool by_excess = lit_.use == PlateUse::screen;
  for (int row = 0; row < lit_.rows; ++row) {
    int r0, r1, c0, c1;
    const float v = steps(row, rows, r0, r1);
    for (int column = 0; column < lit_.columns; ++column) {
      const float u = steps(column, columns, c0, c1);
      const float top = gains_[at(r0, c0)] + u * (gains_[at(r0, c1)] - gains_[at(r0, c0)]);
      const float low = gains_[at(r1, c0)] + u * (gains_[at(r1, c1)] - gains_[at(r1, c0)]);
      const float gain = top + v * (low - top);
      const std::size_t i =
          4 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(lit_.columns) +
               static_cast<std::size_t>(column));
      for (std::size_t c = 0; c < 3; ++c) lit_.cells[i + c] = gain * bare_.cells[i + c];
      lit_.cells[i + 3] = by_excess ? bare_.cells[i + 3] / gain : bare_.cells[i + 3];
    }
  }
}

}  // namespace compositing
