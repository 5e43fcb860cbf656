// Where in their pixels further camera rays go: spread well, and not off to a side.
#include "render/sample_pattern.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace render::sample_pattern_test {
namespace {

using Place = std::array<float, 2>;

std::vector<Place> places(std::size_t first, std::size_t count) {
  const auto* from = sample_pattern().places.begin() + first;
  return {from, from + count};
}

// Of a pixel, what lies below the line x cos(a) + y sin(a) = d.
double cover(double angle, double d) {
  std::vector<std::array<double, 2>> below;
  const std::array<std::array<double, 2>, 4> corners{
      {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}};
  const auto height = [&](const std::array<double, 2>& p) {
    return d - p[0] * std::cos(angle) - p[1] * std::sin(angle);
  };
  for (std::size_t i = 0; i < 4; ++i) {
    const auto &a = corners[i], &b = corners[(i + 1) % 4];
    const double of_a = height(a), of_b = height(b);
    if (of_a >= 0) below.push_back(a);
    if ((of_a >= 0) == (of_b >= 0)) continue;
    const double t = of_a / (of_a - of_b);
    below.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])});
  }
  double twice = 0;
  for (std::size_t i = 0; i < below.size(); ++i) {
    const auto &a = below[i], &b = below[(i + 1) % below.size()];
    twice += a[0] * b[1] - b[0] * a[1];
  }
  return twice / 2;
}

// By how much such places err about that, in the root mean square over lines all over the pixel.
double error_of_lines(const std::vector<Place>& of) {
  constexpr int angles = 90, offsets = 50;
  double squares = 0;
  for (int i = 0; i < angles; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.3) / angles;
    const double far = 0.5 * (std::abs(std::cos(angle)) + std::abs(std::sin(angle)));
    for (int j = 0; j < offsets; ++j) {
      const double d = far * (2 * (j + 0.5) / offsets - 1);
      double below = 0;
      for (const Place& p : of) below += p[0] * std::cos(angle) + p[1] * std::sin(angle) < d;
      const double error = below / static_cast<double>(of.size()) - cover(angle, d);
      squares += error * error;
    }
  }
  return std::sqrt(squares / (angles * offsets));
}

TEST(SamplePattern, HasOnePlaceInEachPartOfThePixel) {
  for (const std::size_t count : {4U, 16U, 64U, 256U, 1024U}) {
    for (std::size_t first = 0; first < samples_max; first += count) {
      const std::vector<Place> of = places(first, count);
      for (std::size_t across = 1; across <= count; across *= 2) {
        const std::size_t down = count / across;
        std::vector<int> found(count);
        for (const auto& [x, y] : of) {
          ASSERT_TRUE(x >= -0.5F && x < 0.5F && y >= -0.5F && y < 0.5F);
          const auto column = static_cast<std::size_t>((x + 0.5F) * static_cast<float>(across));
          const auto row = static_cast<std::size_t>((y + 0.5F) * static_cast<float>(down));
          ++found[row * across + column];
        }
        ASSERT_EQ(found, std::vector<int>(count, 1))
            << count << " from " << first << ", " << across;
      }
    }
  }
}

// What is seen of a pixel is not that of one beside it.
TEST(SamplePattern, IsAboutThePixelsMiddle) {
  for (const std::size_t count : {4U, 16U, 64U, 256U, 1024U}) {
    double x = 0, y = 0;
    for (const Place& p : places(0, count)) x += p[0], y += p[1];
    const auto n = static_cast<double>(count);
    EXPECT_LT(std::abs(x / n), 0.2 / n) << count;
    EXPECT_LT(std::abs(y / n), 0.2 / n) << count;
  }
}

TEST(SamplePattern, TellsHowMuchLiesBeyondALine) {
  EXPECT_LT(error_of_lines(places(0, 4)), 0.105);
  EXPECT_LT(error_of_lines(places(0, 16)), 0.036);
  EXPECT_LT(error_of_lines(places(0, 64)), 0.0135);
  EXPECT_LT(error_of_lines(places(0, 256)), 0.0048);
  std::vector<Place> with_centre = places(0, 4);
  with_centre[static_cast<std::size_t>(sample_pattern().middle)] = {};
  EXPECT_LT(error_of_lines(with_centre), 0.106);
}

}  // namespace
}  // namespace render::sample_pattern_test
