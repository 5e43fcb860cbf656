// Classes at their borders, and what is drawn of them.
#include "render/false_colour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace render::false_colour_test {
namespace {

using Rgb = std::array<int, 3>;
constexpr Rgb black{0, 0, 0}, blue{0, 0, 255}, magenta{255, 0, 255}, green{0, 255, 0},
    yellow{255, 255, 0}, red{255, 0, 0};

Rgb colour_of(float value, RayView view) {
  const ColourClass& c = class_of(value, view);
  return {c.red, c.green, c.blue};
}

TEST(ClassOf, ColoursDepthAsThePaperDoes) {
  const auto colour = [](float depth) { return colour_of(depth, RayView::depth); };
  EXPECT_EQ(colour(0), black);
  EXPECT_EQ(colour(1), blue);
  EXPECT_EQ(colour(5), blue);
  EXPECT_EQ(colour(6), magenta);
  EXPECT_EQ(colour(10), magenta);
  EXPECT_EQ(colour(11), green);
  EXPECT_EQ(colour(15), green);
  EXPECT_EQ(colour(16), yellow);
  EXPECT_EQ(colour(20), yellow);
  EXPECT_EQ(colour(21), red);
  EXPECT_EQ(colour(64), red);
}

TEST(ClassOf, ColoursRaysAsThePaperDoes) {
  const auto colour = [](float rays) { return colour_of(rays, RayView::rays); };
  EXPECT_EQ(colour(0), black);
  EXPECT_EQ(colour(1), blue);
  EXPECT_EQ(colour(10), blue);
  EXPECT_EQ(colour(11), magenta);
  EXPECT_EQ(colour(20), magenta);
  EXPECT_EQ(colour(21), green);
  EXPECT_EQ(colour(30), green);
  EXPECT_EQ(colour(31), yellow);
  EXPECT_EQ(colour(40), yellow);
  EXPECT_EQ(colour(41), red);
  EXPECT_EQ(colour(1e6F), red);
}

TEST(ClassOf, EndsEachClassWithItsLimitInAllViews) {
  for (const std::string& name : ray_view_names()) {
    const RayView view = *ray_view_named(name);
    const auto classes = classes_of(view);
    EXPECT_EQ(classes[0].most, 0) << name;
    EXPECT_EQ(classes[5].most, HUGE_VALF) << name;
    for (std::size_t i = 0; i + 1 < classes.size(); ++i) {
      EXPECT_EQ(&class_of(classes[i].most, view), &classes[i]) << name;
      EXPECT_EQ(&class_of(std::nextafter(classes[i].most, HUGE_VALF), view), &classes[i + 1])
          << name;
    }
    EXPECT_EQ(colour_of(NAN, view), red) << name;
  }
}

TEST(DrawFalseColour, ColoursEachPixelByItsOwnCount) {
  RayCounts counts{2, 2, {{.rays = 1}, {.rays = 12, .depth = 21}, {}, {.error = 0.2F}}};
  std::array<std::uint8_t, 12> rgb8{};
  draw_false_colour(counts, RayView::rays, rgb8);
  EXPECT_EQ(rgb8, (std::array<std::uint8_t, 12>{0, 0, 255, 255, 0, 255, 0, 0, 0, 0, 0, 0}));
  draw_false_colour(counts, RayView::depth, rgb8);
  EXPECT_EQ(rgb8, (std::array<std::uint8_t, 12>{0, 0, 0, 255, 0, 0, 0, 0, 0, 0, 0, 0}));
  draw_false_colour(counts, RayView::error, rgb8);
  EXPECT_EQ(rgb8, (std::array<std::uint8_t, 12>{0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 0, 0}));
}

TEST(DrawFalseColour, RefusesAnotherSize) {
  std::array<std::uint8_t, 12> rgb8{};
  EXPECT_THROW(draw_false_colour({2, 1, {{}, {}}}, RayView::rays, rgb8), std::invalid_argument);
  EXPECT_THROW(draw_false_colour({2, 2, {{}, {}}}, RayView::rays, rgb8), std::invalid_argument);
  EXPECT_THROW(draw_legend(RayView::rays, 3, 2, rgb8), std::invalid_argument);
}

TEST(DrawLegend, ShowsEveryClassAndStaysInItsCorner) {
  for (const std::string& name : ray_view_names()) {
    constexpr int width = 200, height = 150;
    std::vector<std::uint8_t> rgb8(width * height * 3, 17);
    draw_legend(*ray_view_named(name), width, height, rgb8);
    for (const ColourClass& c : classes_of(*ray_view_named(name))) {
      const std::array<std::uint8_t, 3> colour{c.red, c.green, c.blue};
      bool found = false;
      for (std::size_t i = 0; i < rgb8.size(); i += 3) {
        found = found || std::equal(colour.begin(), colour.end(),
                                    rgb8.begin() + static_cast<std::ptrdiff_t>(i));
      }
      EXPECT_TRUE(found) << name;
    }
    for (std::size_t i = 0; i < rgb8.size(); ++i) {
      const std::size_t x = i / 3 % width, y = i / 3 / width;
      if (x >= width / 3 || y < height / 2) {
        ASSERT_EQ(rgb8[i], 17) << name << " " << x << "," << y;
      }
    }
  }
}

TEST(DrawLegend, DrawsWhatFitsIntoASmallPicture) {
  for (int size = 0; size < 40; ++size) {
    std::vector<std::uint8_t> rgb8(static_cast<std::size_t>(size * size * 3));
    EXPECT_NO_THROW(draw_legend(RayView::shadow_rays, size, size, rgb8));
  }
}

TEST(FiguresOf, TellsMeanAndMaximum) {
  const RayCounts counts{
      2, 1, {{.rays = 1, .shadow_rays = 7, .error = 0.5F}, {.rays = 4, .depth = 2}}};
  const auto [depth, rays, shadow_rays, error] = figures_of(counts);
  EXPECT_EQ(rays.mean, 2.5);
  EXPECT_EQ(rays.max, 4);
  EXPECT_EQ(shadow_rays.mean, 3.5);
  EXPECT_EQ(shadow_rays.max, 7);
  EXPECT_EQ(depth.max, 2);
  EXPECT_EQ(error.mean, 0.25);
  EXPECT_EQ(figures_of({})[1].mean, 0);
}

TEST(RayViewNamed, KnowsItsNamesOnly) {
  EXPECT_EQ(ray_view_named("shadow_rays"), RayView::shadow_rays);
  EXPECT_EQ(ray_view_named("Rays"), std::nullopt);
}

}  // namespace
}  // namespace render::false_colour_test
