// From the kernel's scene-linear halves to the codes of a display, by tables made once.
#include "compositing/display.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "capture/parallel_loop.h"
#include "compositing/view_transform.h"

namespace compositing {
namespace {

constexpr std::size_t half_count = 65536;
constexpr std::uint32_t half_magnitude = 0x7fff;
constexpr std::uint32_t half_infinity = 0x7c00;
constexpr int rows_per_task = 16;

bool is_nan(capture::Half bits) { return (bits & half_magnitude) > half_infinity; }

// NaN as 0 and infinities as the largest half: what the view is asked about.
float finite_value(capture::Half bits) {
  if (is_nan(bits)) return 0.0F;
  return std::clamp(capture::float_from_half(bits), -capture::half_max, capture::half_max);
}

std::int64_t count_pixels_with_nan(std::span<const capture::Half> rgba) {
  std::int64_t count = 0;
  for (std::size_t i = 0; i + 3 < rgba.size(); i += 4) {
    const bool any = is_nan(rgba[i]) | is_nan(rgba[i + 1]) | is_nan(rgba[i + 2]);
    count += any ? 1 : 0;
  }
  return count;
}

void require_finite(std::span<const float> values, const DisplaySettings& settings) {
  if (std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); })) return;
  throw std::runtime_error("view \"" + settings.view + "\" of display \"" + settings.display +
                           "\" gives values that are not finite; use another view or config");
}

void require_size(std::size_t pixels, std::size_t values, std::size_t values_per_pixel) {
  if (values != pixels * values_per_pixel) {
    throw std::invalid_argument("the codes need room for " +
                                std::to_string(pixels * values_per_pixel) + " values, not " +
                                std::to_string(values));
  }
}

// The grey from which on the view no longer changes, a power of two.
float find_brightest_grey(const ViewTransform& view) {
  constexpr float negligible = 1.0F / 1024.0F;
  std::vector<float> greys;
  for (float value = 1.0F; value <= capture::half_max; value *= 2.0F) {
    greys.insert(greys.end(), 3, value);
  }
  view.apply(greys);
  std::size_t brightest = greys.size() / 3 - 1;
  const float white = std::clamp(greys.back(), 0.0F, 1.0F);
  while (brightest > 0 &&
         std::abs(std::clamp(greys[brightest * 3 - 1], 0.0F, 1.0F) - white) <= negligible) {
    --brightest;
  }
  return std::exp2(static_cast<float>(brightest));
}

// Places on an axis of a baked table: about logarithmic, straight near 0. Three nodes in sixteen
// lie below 0, for colours outside the gamut.
class Shaper {
 public:
  Shaper(int size, double darkest, double brightest)
      : below_((size - 1) * 3 / 16),
        above_(size - 1 - below_),
        darkest_(darkest),
        brightest_(brightest) {}

  double place_of(double value) const {
    if (value < 0) return below_ - below_ * fraction(std::min(-value, darkest_), darkest_);
    return below_ + above_ * fraction(std::min(value, brightest_), brightest_);
  }
  double value_at(int place) const {
    if (place < below_) return -value(static_cast<double>(below_ - place) / below_, darkest_);
    return value(static_cast<double>(place - below_) / above_, brightest_);
  }

 private:
  // Where the straight piece ends; of 1/64 to 1/2048 the best for the ACES views.
  static constexpr double toe = 1.0 / 512;
  static double fraction(double value, double largest) {
    return std::log1p(value / toe) / std::log1p(largest / toe);
  }
  static double value(double fraction, double largest) {
    return toe * std::expm1(fraction * std::log1p(largest / toe));
  }

  int below_;
  int above_;
  double darkest_;  // its magnitude
  double brightest_;
};

// Tetrahedral interpolation in a table of (size, size, size, 4).
// Kasson, Plouffe and Nin, "Tetrahedral interpolation technique for color space conversion",
// Proceedings of SPIE 1909, 1993.
//
// Works on blocks of pixels in passes, so that the choice of the tetrahedron, which is different
// for every pixel, vectorises instead of branching.
class Tetrahedra {
 public:
  static constexpr std::size_t block = 64;

  Tetrahedra(const std::vector<float>& nodes, int size) : nodes_(nodes.data()), size_(size) {}

  // Places 0..size - 1 on each axis; fill in before interpolate().
  std::array<std::array<float, block>, 3> places;

  // Calls take(i, value) with the 4 values at the places of pixels 0..count - 1, at most a block.
  template <typename Take>
  void interpolate(std::size_t count, Take take) {
    choose();
    for (std::size_t i = 0; i < count; ++i) {
      const float* const corner = nodes_ + corner_[i];
      const float* const first = corner + along_largest_[i];
      const float* const second = corner + along_two_[i];
      const float* const opposite = corner + (size_ * size_ + size_ + 1) * 4;
      std::array<float, 4> value;
      for (std::size_t c = 0; c < 4; ++c) {
        value[c] = corner[c] * weights_[0][i] + first[c] * weights_[1][i] +
                   second[c] * weights_[2][i] + opposite[c] * weights_[3][i];
      }
      take(i, value);
    }
  }

 private:
  // From the corner below all three places along the axis of the largest part first, of the
  // smallest last.
  void choose() {
    const int r_stride = size_ * size_ * 4;
    const int g_stride = size_ * 4;
    const int b_stride = 4;
    const int all = r_stride + g_stride + b_stride;
    const int last = size_ - 2;
    for (std::size_t i = 0; i < block; ++i) {
      const int r_node = std::min(static_cast<int>(places[0][i]), last);
      const int g_node = std::min(static_cast<int>(places[1][i]), last);
      const int b_node = std::min(static_cast<int>(places[2][i]), last);
      const float r = places[0][i] - static_cast<float>(r_node);
      const float g = places[1][i] - static_cast<float>(g_node);
      const float b = places[2][i] - static_cast<float>(b_node);
      const float largest = std::max(std::max(r, g), b);
      const float smallest = std::min(std::min(r, g), b);
      const float middle = std::max(std::min(r, g), std::min(std::max(r, g), b));
      const int larger_of_gb = g >= b ? g_stride : b_stride;
      const int smaller_of_rg = r >= g ? g_stride : r_stride;
      corner_[i] = r_node * r_stride + g_node * g_stride + b_node * b_stride;
      along_largest_[i] = r == largest ? r_stride : larger_of_gb;
      along_two_[i] = all - (b == smallest ? b_stride : smaller_of_rg);
      weights_[0][i] = 1.0F - largest;
      weights_[1][i] = largest - middle;
      weights_[2][i] = middle - smallest;
      weights_[3][i] = smallest;
    }
  }

  const float* nodes_;
  int size_;
  std::array<int, block> corner_;
  std::array<int, block> along_largest_;
  std::array<int, block> along_two_;
  std::array<std::array<float, block>, 4> weights_;
};

// Calls emit(pixel, r, g, b) with codes of 0..the largest Code for every pixel of the run.
template <typename Code, typename Emit>
void emit_exact(std::span<const capture::Half> rgba, const std::vector<Code>& table, Emit emit) {
  const Code* r = table.data();
  const Code* g = r + half_count;
  const Code* b = g + half_count;
  for (std::size_t i = 0; i < rgba.size() / 4; ++i) {
    emit(i, r[rgba[i * 4]], g[rgba[i * 4 + 1]], b[rgba[i * 4 + 2]]);
  }
}

template <typename Code, typename Emit>
void emit_baked(std::span<const capture::Half> rgba,
                const std::vector<float>& positions,
                const std::vector<float>& nodes,
                int table_size,
                Emit emit) {
  constexpr auto top = static_cast<float>(std::numeric_limits<Code>::max());
  Tetrahedra table(nodes, table_size);
  table.places = {};
  const std::size_t pixels = rgba.size() / 4;
  for (std::size_t first = 0; first < pixels; first += Tetrahedra::block) {
    const std::size_t count = std::min(Tetrahedra::block, pixels - first);
    const capture::Half* const source = rgba.data() + first * 4;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t c = 0; c < 3; ++c) table.places[c][i] = positions[source[i * 4 + c]];
    }
    table.interpolate(count, [&](std::size_t i, const std::array<float, 4>& value) {
      emit(first + i, static_cast<Code>(value[0] * top + 0.5F),
           static_cast<Code>(value[1] * top + 0.5F), static_cast<Code>(value[2] * top + 0.5F));
    });
  }
}

template <typename Code>
auto emit_triples(std::span<Code> rgb) {
  return [rgb](std::size_t i, Code r, Code g, Code b) {
    rgb[i * 3] = r;
    rgb[i * 3 + 1] = g;
    rgb[i * 3 + 2] = b;
  };
}

}  // namespace

Display::Display(const DisplaySettings& settings) : table_size_(settings.table_size) {
  const ViewTransform view(settings);
  if (table_size_ < 2 || table_size_ > 129) {
    throw std::invalid_argument("a display table has 2 to 129 nodes per axis, not " +
                                std::to_string(table_size_));
  }
  if (view.mixes_channels()) {
    bake(view);
    require_finite(nodes_, settings);
  } else {
    make_exact_tables(view, settings);
  }
}

void Display::make_exact_tables(const ViewTransform& view, const DisplaySettings& settings) {
  std::vector<float> greys(half_count * 3);
  for (std::size_t bits = 0; bits < half_count; ++bits) {
    std::fill_n(greys.begin() + static_cast<std::ptrdiff_t>(bits * 3), 3,
                finite_value(static_cast<capture::Half>(bits)));
  }
  view.apply(greys);
  require_finite(greys, settings);
  codes_.resize(half_count * 3);
  bytes_.resize(half_count * 3);
  for (std::size_t bits = 0; bits < half_count; ++bits) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float value = std::clamp(greys[bits * 3 + c], 0.0F, 1.0F);
      codes_[c * half_count + bits] = static_cast<std::uint16_t>(value * 65535.0F + 0.5F);
      bytes_[c * half_count + bits] = static_cast<std::uint8_t>(value * 255.0F + 0.5F);
    }
  }
}

void Display::bake(const ViewTransform& view) {
  // A saturated colour goes on changing for some two stops after the greys are white.
  const double white = find_brightest_grey(view);
  const Shaper shaper(table_size_, white / 4, white * 4);
  positions_.resize(half_count);
  for (std::size_t bits = 0; bits < half_count; ++bits) {
    positions_[bits] =
        static_cast<float>(shaper.place_of(finite_value(static_cast<capture::Half>(bits))));
  }
  std::vector<float> axis;
  for (int place = 0; place < table_size_; ++place) {
    axis.push_back(static_cast<float>(shaper.value_at(place)));
  }
  std::vector<float> rgb;
  rgb.reserve(axis.size() * axis.size() * axis.size() * 3);
  for (const float r : axis) {
    for (const float g : axis) {
      for (const float b : axis) rgb.insert(rgb.end(), {r, g, b});
    }
  }
  view.apply(rgb);
  nodes_.assign(rgb.size() / 3 * 4, 0.0F);
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    const float value = rgb[i];
    nodes_[i / 3 * 4 + i % 3] = std::isfinite(value) ? std::clamp(value, 0.0F, 1.0F) : value;
  }
}

template <typename Code, typename Emit>
void Display::emit_codes(std::span<const capture::Half> rgba,
                         const std::vector<Code>& table,
                         Emit emit) const {
  if (separable()) {
    emit_exact(rgba, table, emit);
  } else {
    emit_baked<Code>(rgba, positions_, nodes_, table_size_, emit);
  }
}

template <typename Code, typename Emit>
std::int64_t Display::convert(std::span<const capture::Half> rgba,
                              const std::vector<Code>& table,
                              const ToneCurve& tone,
                              Emit emit) const {
  if (!tone.is_on()) {
    emit_codes(rgba, table, emit);
    return count_pixels_with_nan(rgba);
  }
  std::array<capture::Half, 4 * Tetrahedra::block> toned;
  for (std::size_t first = 0; first < rgba.size(); first += toned.size()) {
    const auto run = rgba.subspan(first, std::min(toned.size(), rgba.size() - first));
    apply_tone(tone, run, toned);
    emit_codes(std::span<const capture::Half>(toned).first(run.size()), table,
               [&](std::size_t i, Code r, Code g, Code b) { emit(first / 4 + i, r, g, b); });
  }
  return count_pixels_with_nan(rgba);
}

std::int64_t Display::to_rgb8(std::span<const capture::Half> rgba,
                              std::span<std::uint8_t> rgb,
                              const ToneCurve& tone) const {
  require_size(rgba.size() / 4, rgb.size(), 3);
  return convert(rgba, bytes_, tone, emit_triples(rgb));
}

std::int64_t Display::to_rgb16(std::span<const capture::Half> rgba,
                               std::span<std::uint16_t> rgb,
                               const ToneCurve& tone) const {
  require_size(rgba.size() / 4, rgb.size(), 3);
  return convert(rgba, codes_, tone, emit_triples(rgb));
}

std::int64_t Display::to_rgb32(std::span<const capture::Half> rgba,
                               std::span<std::uint32_t> words,
                               const ToneCurve& tone) const {
  require_size(rgba.size() / 4, words.size(), 1);
  return convert(rgba, bytes_, tone,
                 [words](std::size_t i, std::uint8_t r, std::uint8_t g, std::uint8_t b) {
                   words[i] = 0xff000000U | std::uint32_t{r} << 16U | std::uint32_t{g} << 8U | b;
                 });
}

template <typename Value, typename Run>
std::int64_t Display::convert_image(const capture::HalfImage& rgba,
                                    std::span<Value> values,
                                    std::size_t values_per_pixel,
                                    Run run) const {
  if (rgba.channels != 4) {
    throw std::invalid_argument("a display converts images of 4 channels, not " +
                                std::to_string(rgba.channels));
  }
  require_size(rgba.pixels.size() / 4, values.size(), values_per_pixel);
  const auto width = static_cast<std::size_t>(rgba.width);
  const std::span<const capture::Half> pixels(rgba.pixels);
  return capture::parallel_reduce(
      tbb::blocked_range<int>(0, rgba.height, rows_per_task), std::int64_t{0},
      [&](const tbb::blocked_range<int>& rows, std::int64_t count) {
        const std::size_t first = static_cast<std::size_t>(rows.begin()) * width;
        const std::size_t length = rows.size() * width;
        return count + run(pixels.subspan(first * 4, length * 4),
                           values.subspan(first * values_per_pixel, length * values_per_pixel));
      },
      std::plus<>());
}

std::int64_t Display::to_rgb8(const capture::HalfImage& rgba,
                              std::span<std::uint8_t> rgb,
                              const ToneCurve& tone) const {
  return convert_image(rgba, rgb, 3, [&](auto in, auto out) { return to_rgb8(in, out, tone); });
}

std::int64_t Display::to_rgb16(const capture::HalfImage& rgba,
                               std::span<std::uint16_t> rgb,
                               const ToneCurve& tone) const {
  return convert_image(rgba, rgb, 3, [&](auto in, auto out) { return to_rgb16(in, out, tone); });
}

std::int64_t Display::to_rgb32(const capture::HalfImage& rgba,
                               std::span<std::uint32_t> words,
                               const ToneCurve& tone) const {
  return convert_image(rgba, words, 1, [&](auto in, auto out) { return to_rgb32(in, out, tone); });
}

}  // namespace compositing
