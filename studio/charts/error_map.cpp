// Pictures of error.
#include "studio/charts/error_map.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "capture/png.h"
#include "compositing/display.h"
#include "studio/svg.h"
#include "studio/svg_png.h"

namespace studio {
namespace {

using render::error_group;
using render::GroupError;

constexpr std::size_t framed_groups = 8;
constexpr int enlarged = 2;

struct ErrorClass {
  double most;
  std::string_view colour, name;
};
// From light to dark, as a printer shows it too (Brewer's YlOrRd).
constexpr std::array<ErrorClass, 6> classes{
    {{0.01, "#e8e8e8", "up to 1 %"},
     {0.02, "#fed976", "2 %"},
     {0.05, "#feb24c", "5 %"},
     {0.1, "#fc4e2a", "10 %"},
     {0.2, "#b10026", "20 %"},
     {std::numeric_limits<double>::infinity(), "#40000f", "more"}}};

void frame(std::span<std::uint8_t> rgb, int width, int height, const GroupError& group) {
  const int side = enlarged * error_group;
  const int left = enlarged * group.x - 2, top = enlarged * group.y - 2;
  for (int y = top; y < top + side + 4; ++y) {
    for (int x = left; x < left + side + 4; ++x) {
      const bool inside =
          x >= left + 2 && x < left + side + 2 && y >= top + 2 && y < top + side + 2;
      if (inside || x < 0 || y < 0 || x >= width || y >= height) continue;
      constexpr std::array<std::uint8_t, 3> colour{255, 0, 200};
      const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x);
      std::ranges::copy(colour, rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
    }
  }
}

void write_framed(const std::string& path,
                  const capture::Image& picture,
                  const std::vector<GroupError>& worst) {
  const int width = enlarged * picture.width, height = enlarged * picture.height;
  capture::Image large = capture::make_image(height, width, 4);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      std::copy_n(&picture.pixels[picture.index(y / enlarged, x / enlarged)], 4, &large.at(y, x));
    }
  }
  std::vector<std::uint8_t> codes(large.pixels.size() / 4 * 3);
  compositing::Display().to_rgb8(capture::to_half(large), codes);
  for (const GroupError& group : worst) frame(codes, width, height, group);
  capture::write_png(path, width, height, 3, codes);
}

void write_map(const std::string& path,
               const std::string& title,
               int width,
               int height,
               const std::vector<GroupError>& groups,
               const std::vector<GroupError>& worst) {
  constexpr double top = 40, bottom = 40;
  double legend = 10;
  for (const ErrorClass& c : classes) legend += 32 + text_width(c.name, 11.5);
  const double wide = std::max({double{enlarged} * width, legend, 20 + text_width(title, 14)});
  Svg svg(wide, enlarged * height + top + bottom);
  svg.rectangle(0, 0, wide, enlarged * height + top + bottom, "#ffffff");
  svg.text(10, 26, title, {14});
  const auto place = [&](const GroupError& g, auto&& draw) {
    const int columns = std::min(error_group, width - g.x);
    const int rows = std::min(error_group, height - g.y);
    draw(enlarged * g.x, top + enlarged * g.y, enlarged * columns, enlarged * rows);
  };
  svg.rectangle(0, top, enlarged * width, enlarged * height, "#ffffff");
  for (const GroupError& g : groups) {
    const auto of =
        std::ranges::find_if(classes, [&](const ErrorClass& c) { return !(g.mean > c.most); });
    place(g,
          [&](double x, double y, double w, double h) { svg.rectangle(x, y, w, h, of->colour); });
  }
  for (const GroupError& g : worst) {
    place(g, [&](double x, double y, double w, double h) {
      svg.frame(x - 1, y - 1, w + 2, h + 2, "#ff00c8");
    });
  }
  double x = 10;
  for (const ErrorClass& c : classes) {
    svg.rectangle(x, enlarged * height + top + 14, 14, 14, c.colour);
    svg.text(x + 19, enlarged * height + top + 25, c.name, {11.5});
    x += 32 + text_width(c.name, 11.5);
  }
  write_svg_as_png(svg.finish(), path, 1);
}

}  // namespace

std::vector<GroupError> worst_groups(std::vector<GroupError> groups, std::size_t most) {
  std::ranges::stable_sort(groups, std::ranges::greater{}, &GroupError::mean);
  groups.resize(std::min(groups.size(), most));
  return groups;
}

void write_error_map(const std::string& path_start,
                     const std::string& title,
                     const capture::Image& picture,
                     const std::vector<GroupError>& groups) {
  const std::vector<GroupError> worst = worst_groups(groups, framed_groups);
  write_framed(path_start + ".png", picture, worst);
  write_map(path_start + "_error.png", title, picture.width, picture.height, groups, worst);
}

}  // namespace studio
