// Counts as colours.
#include "render/false_colour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "capture/parallel_loop.h"

namespace render {
namespace {

constexpr float unlimited = std::numeric_limits<float>::infinity();
using Classes = std::array<ColourClass, 6>;

constexpr Classes make_classes(std::array<float, 5> most) {
  return {{{0, 0, 0, most[0]},
           {0, 0, 255, most[1]},
           {255, 0, 255, most[2]},
           {0, 255, 0, most[3]},
           {255, 255, 0, most[4]},
           {255, 0, 0, unlimited}}};
}

constexpr std::array<Classes, ray_views> all_classes{
    make_classes({0, 5, 10, 15, 20}), make_classes({0, 10, 20, 30, 40}),
    // A table's lights at one point are 64 by default, and the blocks of a smooth surface test a
    // sixteenth of them.
    make_classes({0, 16, 64, 256, 1024}),
    // Beyond Effort::aa_tolerance by default: what is red took many samples and is unsure still.
    make_classes({0, 0.01F, 0.02F, 0.05F, 0.1F})};

// Glyphs of 3x5 pixels, each row three bits, the left one first.
struct Glyph {
  char letter;
  std::array<std::uint8_t, 5> rows;
};
constexpr std::array<Glyph, 24> glyphs{{
    {'0', {7, 5, 5, 5, 7}}, {'1', {2, 6, 2, 2, 7}}, {'2', {7, 1, 7, 4, 7}}, {'3', {7, 1, 3, 1, 7}},
    {'4', {5, 5, 7, 1, 1}}, {'5', {7, 4, 7, 1, 7}}, {'6', {7, 4, 7, 5, 7}}, {'7', {7, 1, 1, 2, 2}},
    {'8', {7, 5, 7, 5, 7}}, {'9', {7, 5, 7, 1, 7}}, {'.', {0, 0, 0, 0, 2}}, {'>', {4, 2, 1, 2, 4}},
    {'a', {2, 5, 7, 5, 5}}, {'d', {6, 5, 5, 5, 6}}, {'e', {7, 4, 6, 4, 7}}, {'h', {5, 5, 7, 5, 5}},
    {'o', {7, 5, 5, 5, 7}}, {'p', {7, 5, 7, 4, 4}}, {'r', {6, 5, 6, 5, 5}}, {'s', {3, 4, 2, 1, 6}},
    {'t', {7, 2, 2, 2, 2}}, {'w', {5, 5, 5, 7, 5}}, {'y', {5, 5, 2, 2, 2}}, {'_', {0, 0, 0, 0, 0}},
}};
constexpr int glyph_step = 4;  // glyph pixels from one letter to the next
constexpr int row_step = 8;

// Draws squares of `scale` picture pixels, where there is a picture.
class Canvas {
 public:
  Canvas(int width, int height, int scale, std::span<std::uint8_t> rgb8)
      : width_(width), height_(height), scale_(scale), rgb8_(rgb8) {}

  void fill(int x, int y, int columns, int rows, std::array<std::uint8_t, 3> colour) {
    for (int py = std::max(y * scale_, 0); py < std::min((y + rows) * scale_, height_); ++py) {
      for (int px = std::max(x * scale_, 0); px < std::min((x + columns) * scale_, width_); ++px) {
        const std::size_t pixel = static_cast<std::size_t>(py) * static_cast<std::size_t>(width_) +
                                  static_cast<std::size_t>(px);
        std::ranges::copy(colour, rgb8_.begin() + static_cast<std::ptrdiff_t>(pixel * 3));
      }
    }
  }
  void write(int x, int y, std::string_view text) {
    for (const char letter : text) {
      const auto glyph = std::ranges::find(glyphs, letter, &Glyph::letter);
      for (int row = 0; glyph != glyphs.end() && row < 5; ++row) {
        for (int column = 0; column < 3; ++column) {
          if (glyph->rows[static_cast<std::size_t>(row)] >> (2 - column) & 1) {
            fill(x + column, y + row, 1, 1, {255, 255, 255});
          }
        }
      }
      x += glyph_step;
    }
  }

 private:
  int width_, height_, scale_;
  std::span<std::uint8_t> rgb8_;
};

// "5", "0.05", or for the last class "> 20".
std::string limit_of(std::span<const ColourClass, 6> classes, std::size_t i) {
  const auto text = [](float value) {
    const long hundredths = std::lround(value * 100);
    std::string digits = std::to_string(hundredths / 100);
    if (hundredths % 100 == 0) return digits;
    digits += '.';
    digits += static_cast<char>('0' + hundredths / 10 % 10);
    if (hundredths % 10 != 0) digits += static_cast<char>('0' + hundredths % 10);
    return digits;
  };
  return i + 1 < classes.size() ? text(classes[i].most) : ">" + text(classes[i - 1].most);
}

void require_size(int width, int height, std::size_t codes) {
  if (width < 0 || height < 0 ||
      codes != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3) {
    throw std::invalid_argument("a picture of " + std::to_string(width) + "x" +
                                std::to_string(height) + " pixels has not " +
                                std::to_string(codes) + " codes");
  }
}

}  // namespace

const std::vector<std::string>& ray_view_names() {
  static const std::vector<std::string> names{"depth", "rays", "shadow_rays", "error"};
  return names;
}

std::optional<RayView> ray_view_named(std::string_view name) {
  const auto found = std::ranges::find(ray_view_names(), name);
  if (found == ray_view_names().end()) return std::nullopt;
  return static_cast<RayView>(found - ray_view_names().begin());
}

std::span<const ColourClass, 6> classes_of(RayView view) {
  return all_classes[static_cast<std::size_t>(view)];
}

float value_of(const RayCount& pixel, RayView view) {
  switch (view) {
    case RayView::depth:
      return static_cast<float>(pixel.depth);
    case RayView::rays:
      return static_cast<float>(pixel.rays);
    case RayView::shadow_rays:
      return static_cast<float>(pixel.shadow_rays);
    case RayView::error:
      return pixel.error;
  }
  return 0;
}

const ColourClass& class_of(float value, RayView view) {
  const std::span<const ColourClass, 6> classes = classes_of(view);
  std::size_t i = 0;
  while (i + 1 < classes.size() && !(value <= classes[i].most)) ++i;
  return classes[i];
}

void draw_false_colour(const RayCounts& counts, RayView view, std::span<std::uint8_t> rgb8) {
  require_size(counts.width, counts.height, rgb8.size());
  if (counts.pixels.size() * 3 != rgb8.size()) {
    throw std::invalid_argument("the counts are not those of the picture's pixels");
  }
  capture::parallel_for(tbb::blocked_range<std::size_t>(0, counts.pixels.size(), 8192),
                        [&](const tbb::blocked_range<std::size_t>& pixels) {
                          for (std::size_t i = pixels.begin(); i != pixels.end(); ++i) {
                            const ColourClass& c = class_of(value_of(counts.pixels[i], view), view);
                            rgb8[i * 3] = c.red, rgb8[i * 3 + 1] = c.green,
                                     rgb8[i * 3 + 2] = c.blue;
                          }
                        });
}

void draw_legend(RayView view, int width, int height, std::span<std::uint8_t> rgb8) {
  require_size(width, height, rgb8.size());
  const int scale = std::max(1, height / 240);
  Canvas canvas(width, height, scale, rgb8);
  const std::string& name = ray_view_names()[static_cast<std::size_t>(view)];
  const std::span<const ColourClass, 6> classes = classes_of(view);
  const int rows = static_cast<int>(classes.size()) + 1;
  const int columns = std::max(static_cast<int>(name.size()), 7) * glyph_step + 5;
  const int top = height / scale - rows * row_step - 3;
  canvas.fill(0, top, columns, rows * row_step + 3 + 1, {64, 64, 64});
  canvas.write(3, top + 3, name);
  for (std::size_t i = 0; i < classes.size(); ++i) {
    const int y = top + 3 + (static_cast<int>(i) + 1) * row_step;
    canvas.fill(3, y - 1, 7, 7, {classes[i].red, classes[i].green, classes[i].blue});
    canvas.write(12, y, limit_of(classes, i));
  }
}

std::array<RayViewFigures, ray_views> figures_of(const RayCounts& counts) {
  std::uint64_t depths = 0, rays = 0, shadow_rays = 0;
  double errors = 0;
  RayCount most;
  for (const RayCount& pixel : counts.pixels) {
    depths += pixel.depth, rays += pixel.rays, shadow_rays += pixel.shadow_rays;
    errors += pixel.error;
    most.depth = std::max(most.depth, pixel.depth);
    most.rays = std::max(most.rays, pixel.rays);
    most.shadow_rays = std::max(most.shadow_rays, pixel.shadow_rays);
    most.error = std::max(most.error, pixel.error);
  }
  const double share = 1 / std::max(static_cast<double>(counts.pixels.size()), 1.0);
  return {{{static_cast<double>(depths) * share, static_cast<double>(most.depth)},
           {static_cast<double>(rays) * share, static_cast<double>(most.rays)},
           {static_cast<double>(shadow_rays) * share, static_cast<double>(most.shadow_rays)},
           {errors * share, most.error}}};
}

}  // namespace render
