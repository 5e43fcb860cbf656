// The plate's gain, frame by frame.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

#include "compositing/background_subtraction.h"
#include "compositing/clean_plate.h"
#include "compositing/key_lanes.h"
#include "compositing/plate_cells.h"

namespace compositing {
namespace {

constexpr float least_excess = 0.004F;  // of display white: below it a plate shows no screen
int cells_along(int side, int step) { return (side + step - 1) / step; }

// The first row that is looked at of a row of the gain's cells: their second, if they have one.
int first_row(int row, int height) { return std::min(row * PlateLight::cell + 1, height - 1); }

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

// Between neighbours across, then down.
void smooth_gains(const GapFiller& filler, std::vector<float>& blurred, std::vector<float>& gains) {
  const int rows = filler.rows(), columns = filler.columns();
  const auto width = static_cast<std::size_t>(columns);
  for (int row = 0; row < rows; ++row) {
    const float* from = filler.value(row, 0);
    float* to = &blurred[static_cast<std::size_t>(row) * width];
    if (columns == 1) {
      to[0] = from[0];
      continue;
    }
    to[0] = 0.75F * from[0] + 0.25F * from[1];
    for (int i = 1; i + 1 < columns; ++i)
      to[i] = 0.25F * (from[i - 1] + from[i + 1]) + 0.5F * from[i];
    to[columns - 1] = 0.75F * from[columns - 1] + 0.25F * from[columns - 2];
  }
  for (int row = 0; row < rows; ++row) {
    const auto at = [&](int r) {
      return &blurred[static_cast<std::size_t>(std::clamp(r, 0, rows - 1)) * width];
    };
    const float *above = at(row - 1), *here = at(row), *below = at(row + 1);
    float* to = &gains[static_cast<std::size_t>(row) * width];
    for (int i = 0; i < columns; ++i) to[i] = 0.25F * (above[i] + below[i]) + 0.5F * here[i];
  }
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
  if (use == PlateUse::screen) {
    blur_screen(plate_.light);
  } else {
    // Light is followed in the first channel: most of the picture must have it.
    plate_.colour = mean_colour(plate_.light);
  }
  bare_.height = plate_.light.height;
  bare_.width = plate_.light.width;
  bare_.use = use;
  bare_.step = use == PlateUse::screen ? 4 : 1;
  bare_.rows = cells_along(bare_.height, bare_.step);
  bare_.columns = cells_along(bare_.width, bare_.step);
  bare_.colour = plate_.colour;
  bare_.cells = means_over(plate_, bare_.step);
  double variance = 0, noisy_light = 0, excess = 0, light = 0, count = 0;
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
    noisy_light += c[0] + 0.25F * (c[1] + c[2]);
    excess += own, light += c[0], count += 1;
  }
  const double deviation = std::sqrt(variance / std::max(count, 1.0));
  bare_.sigma =
      use == PlateUse::screen && count > 0 ? static_cast<float>(deviation * count / excess) : 0.05F;
  noisy_light_ = static_cast<float>(noisy_light / std::max(count, 1.0));
  excess_ = static_cast<float>(excess / std::max(count, 1.0));
  const float share = static_cast<float>(deviation * std::max(count, 1.0) / std::max(light, 1e-3));
  tolerance_ = 0.035F + 3 * share;
  spread_ = 0.025F + 1.3F * share;
  gains_.assign(
      static_cast<std::size_t>(filler_.rows()) * static_cast<std::size_t>(filler_.columns()), 1.0F);
  blurred_ = shown_ = gains_;
  bare_.near = {
      filler_.rows(), filler_.columns(), gains_, std::vector<std::uint8_t>(gains_.size(), 1), {}};
  lit_ = plates_.lend();
  *lit_ = bare_;
  prepare();
}

// What does not change from frame to frame.
void PlateLight::prepare() {
  ratios_ = bare_.cells;
  for (std::size_t i = 0; i < ratios_.size(); i += 4) {
    const bool known = bare_.use == PlateUse::difference || ratios_[i + 3] > 0;
    const float over = ratios_[i] > 0 ? 1 / ratios_[i] : 1;
    ratios_[i] = over;
    ratios_[i + 1] *= over, ratios_[i + 2] *= over;
    ratios_[i + 3] = known ? 1.0F : 0.0F;
  }
  rows_apart_ = bare_.height * bare_.width > 500000 ? 4 : 2;
  pixels_.resize(gains_.size());
  std::size_t i = 0;
  for (int row = 0; row < filler_.rows(); ++row) {
    for (int column = 0; column < filler_.columns(); ++column, ++i) {
      const int count = std::min(cell, bare_.width - column * cell);
      float all = 0, known = 0;
      for (int y = first_row(row, bare_.height); y < std::min(bare_.height, (row + 1) * cell);
           y += rows_apart_) {
        all += static_cast<float>(count);
        for (int x = column * cell; x < column * cell + count; ++x) {
          known += ratios_[4 * (static_cast<std::size_t>(y / bare_.step) *
                                    static_cast<std::size_t>(bare_.columns) +
                                static_cast<std::size_t>(x / bare_.step)) +
                           3];
        }
      }
      pixels_[i] = all > 0 && known >= 0.5F * all ? all : 0;
    }
  }
  const float reach = static_cast<float>(cell / bare_.step);
  for (int column = 0; column < bare_.columns; ++column) {
    const float place = std::clamp((static_cast<float>(column) + 0.5F) / reach - 0.5F, 0.0F,
                                   static_cast<float>(filler_.columns() - 1));
    const auto before = static_cast<int>(place);
    across_.push_back(
        {before, std::min(before + 1, filler_.columns() - 1), place - static_cast<float>(before)});
  }
  gain_row_.resize(static_cast<std::size_t>(filler_.columns()));
  cell_gains_.resize(across_.size());
  over_gains_.assign(across_.size(), 1);
}

// The ratios at eight pixels from (y, x) on, to the nearest cell: 1 / first, and the others over
// it.
inline std::array<F8, 3> PlateLight::ratios_at(int y, int x) const {
  const float* row = &ratios_[4 * static_cast<std::size_t>(y / bare_.step) *
                              static_cast<std::size_t>(bare_.columns)];
  const auto cell_at = [&](int column) {
    return load_four(row + 4 * std::min(column, bare_.columns - 1));
  };
  std::array<F8, 3> ratios;
  if (bare_.step == 4) {
    F8 two;
    if (x / 4 + 1 < bare_.columns) {
      two = load_lanes(row + x);
    } else {
      const F4 last = cell_at(x / 4);
      two = __builtin_shufflevector(last, last, 0, 1, 2, 3, 4, 5, 6, 7);
    }
    ratios = {__builtin_shufflevector(two, two, 0, 0, 0, 0, 4, 4, 4, 4),
              __builtin_shufflevector(two, two, 1, 1, 1, 1, 5, 5, 5, 5),
              __builtin_shufflevector(two, two, 2, 2, 2, 2, 6, 6, 6, 6)};
    return ratios;
  }
  const auto low = transposed(cell_at(x), cell_at(x + 1), cell_at(x + 2), cell_at(x + 3));
  const auto high = transposed(cell_at(x + 4), cell_at(x + 5), cell_at(x + 6), cell_at(x + 7));
  for (std::size_t c = 0; c < 3; ++c)
    ratios[c] = __builtin_shufflevector(low[c], high[c], 0, 1, 2, 3, 4, 5, 6, 7);
  return ratios;
}

template <class Rows>
[[gnu::always_inline]] inline CellSums PlateLight::look_at(const Rows& source,
                                                           int row,
                                                           int column) const {
  static_assert(cell == key_lanes);
  const int bottom = std::min(bare_.height, (row + 1) * cell);
  const int count = std::min(cell, bare_.width - column * cell);
  const I8 inside = count == cell ? ~I8{} : lanes_below(count) > 0.0F;
  CellSums sums;
  for (int y = first_row(row, bare_.height); y < bottom; y += rows_apart_) {
    std::array<F8, 3> c;
    source.load(y, column * cell, count, c);
    sums.add(c, ratios_at(y, column * cell), inside, tolerance_);
  }
  return sums;
}

template <class Rows>
PlateSight PlateLight::measure(const Rows& source) {
  return measure_cells(filler_, pixels_, spread_, shown_,
                       [&](CellSums& sums, std::size_t, int row, int column) {
                         sums = look_at(source, row, column);
                       });
}

void PlateLight::check_size(int height, int width) const {
  if (height == bare_.height && width == bare_.width) return;
  throw std::invalid_argument("the clean plate is " + std::to_string(bare_.width) + "x" +
                              std::to_string(bare_.height) + ", the frame " +
                              std::to_string(width) + "x" + std::to_string(height));
}

void PlateLight::check(const capture::Image& frame) const {
  check_size(frame.height, frame.width);
  if (frame.channels != 3) throw std::invalid_argument("a frame to key has three channels");
}

PlateSight PlateLight::update(const capture::Image& frame, bool follow) {
  check(frame);
  return update_from(LightRows(frame, channels_of(plate_.colour)), follow);
}

void PlateLight::check(const CodedFrame& frame) const {
  check_size(frame.height, frame.width);
  if (frame.rgba.size() !=
      4 * static_cast<std::size_t>(frame.height) * static_cast<std::size_t>(frame.width)) {
    throw std::invalid_argument("the codes of a frame to key do not fill it");
  }
}

PlateSight PlateLight::update(const CodedFrame& frame, bool follow) {
  check(frame);
  return update_from(CodeRows(frame.rgba.data(), frame.width, channels_of(plate_.colour),
                              light_polynomial(frame.transfer)),
                     follow);
}

float PlateLight::sigma_under(float gain) const {
  const float lit = gain * excess_;
  if (bare_.use != PlateUse::screen || !(lit > 0)) return bare_.sigma;
  constexpr float floors = 1.5F;  // of the three channels together
  return std::sqrt(plate_.noise_gain * gain * noisy_light_ + floors * plate_.noise_floor) / lit;
}

// A grey suit before a grey wall has the wall's colour in another light. A background's own light
// changes from frame to frame, or all at once: cells that differ from it by more than shadows and
// gleams do are not taken for it. Returns the share of cells that stay.
float PlateLight::know_background_alone() {
  constexpr float most_gleam = 1.5F, least_kept = 0.4F;
  const auto cells = shown_.size();
  float* const gains = filler_.value(0, 0);
  float* const known = &filler_.weight(0, 0);
  known_gains_.clear();
  for (std::size_t i = 0; i < cells; ++i) {
    if (known[i] > 0) known_gains_.push_back(gains[i]);
  }
  if (known_gains_.empty()) return 1;
  const auto middle = [&](auto end) {
    const auto at = known_gains_.begin() + (end - known_gains_.begin()) / 2;
    std::nth_element(known_gains_.begin(), at, end);
    return *at;
  };
  const auto is_near = [&](float gain) {
    return gain >= darkest_shadow * usual_gain_ && gain <= most_gleam * usual_gain_;
  };
  const auto all = static_cast<float>(known_gains_.size());
  auto end = std::partition(known_gains_.begin(), known_gains_.end(), is_near);
  if (static_cast<float>(end - known_gains_.begin()) < least_kept * all) {
    usual_gain_ = middle(known_gains_.end());
    end = std::partition(known_gains_.begin(), known_gains_.end(), is_near);
  }
  const float kept = static_cast<float>(end - known_gains_.begin()) / all;
  for (std::size_t i = 0; i < cells; ++i) {
    if (known[i] > 0 && !is_near(gains[i])) gains[i] = known[i] = shown_[i] = 0;
  }
  if (kept > 0) usual_gain_ = middle(end);
  return kept;
}

template <class Rows>
PlateSight PlateLight::update_from(const Rows& rows, bool follow) {
  PlateSight sight = measure(rows);
  if (bare_.use == PlateUse::difference) sight.screen *= know_background_alone();
  const std::shared_ptr<LitPlate> before = renew();
  if (bare_.use == PlateUse::screen) {
    const float scale = std::max(static_cast<float>(bare_.height) / learned_height, 1.0F);
    find_near(shown_, near_cells * scale, deep_cells * scale, lit_->near);
  }
  if (filler_.fill() > 0) {
    float sum = 0;
    for (int row = 0; row < filler_.rows(); ++row) {
      for (int column = 0; column < filler_.columns(); ++column) {
        sum += filler_.value(row, column)[0];
      }
    }
    sight.gain = sum / static_cast<float>(gains_.size());
    if (follow) light_up();
    lit_->sigma = sigma_under(follow ? sight.gain : 1);
  } else if (before) {
    lit_->cells = before->cells;
    lit_->sigma = before->sigma;
  }
  if (!follow && (gained_ || before)) {
    std::copy(bare_.cells.begin(), bare_.cells.end(), lit_->cells.begin());
    gained_ = false;
  }
  return sight;
}

// Takes a plate that may be written, if the one at hand is somebody's; then returns that.
std::shared_ptr<LitPlate> PlateLight::renew() {
  if (lit_.use_count() == 1) return nullptr;
  std::shared_ptr<LitPlate> before = std::exchange(lit_, plates_.lend());
  if (lit_->cells.size() != bare_.cells.size()) *lit_ = bare_;
  return before;
}

// Puts the smoothed gain on the plate.
void PlateLight::light_up() {
  gained_ = true;
  smooth_gains(filler_, blurred_, gains_);
  const int rows = filler_.rows();
  const auto width = static_cast<std::size_t>(filler_.columns());
  const float reach = static_cast<float>(cell / bare_.step);  // of a gain's cell, in plate cells
  const bool by_excess = bare_.use == PlateUse::screen;
  for (int row = 0; row < bare_.rows; ++row) {
    const float place = std::clamp((static_cast<float>(row) + 0.5F) / reach - 0.5F, 0.0F,
                                   static_cast<float>(rows - 1));
    const auto before = static_cast<int>(place);
    const float down = place - static_cast<float>(before);
    const float* top = &gains_[static_cast<std::size_t>(before) * width];
    const float* low = &gains_[static_cast<std::size_t>(std::min(before + 1, rows - 1)) * width];
    for (std::size_t i = 0; i < width; ++i) gain_row_[i] = top[i] + down * (low[i] - top[i]);
    const std::size_t cells = across_.size();
    if (reach == 2) {
      // Each cell of the gain lies over two of the plate, a quarter off its centre.
      for (std::size_t i = 0; i + 1 < width; ++i) {
        const float left = gain_row_[i], right = gain_row_[i + 1], quarter = 0.25F * (right - left);
        cell_gains_[2 * i + 1] = left + quarter, cell_gains_[2 * i + 2] = right - quarter;
      }
      cell_gains_[0] = gain_row_[0];
      if (cells == 2 * width) cell_gains_[cells - 1] = gain_row_[width - 1];
    } else {
      for (std::size_t i = 0; i < cells; ++i) {
        const float left = gain_row_[static_cast<std::size_t>(across_[i].left)];
        const float right = gain_row_[static_cast<std::size_t>(across_[i].right)];
        cell_gains_[i] = left + across_[i].share * (right - left);
      }
    }
    if (by_excess) {
      for (std::size_t i = 0; i < cells; ++i) over_gains_[i] = 1 / cell_gains_[i];
    }
    const float* from = bare_.cell(row, 0);
    float* to = &lit_->cells[static_cast<std::size_t>(from - bare_.cells.data())];
    std::size_t i = 0;
    for (; i + 2 <= cells; i += 2, from += 8, to += 8) {
      const float a = cell_gains_[i], b = cell_gains_[i + 1];
      store_lanes(to, load_lanes(from) * F8{a, a, a, over_gains_[i], b, b, b, over_gains_[i + 1]});
    }
    if (i < cells) {
      const float a = cell_gains_[i];
      const F4 lit = load_four(from) * F4{a, a, a, over_gains_[i]};
      std::memcpy(to, &lit, sizeof lit);
    }
  }
}

}  // namespace compositing
