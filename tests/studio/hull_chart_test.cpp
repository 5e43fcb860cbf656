// The chart of persons from the side: what it must show whatever the machine.
#include "studio/charts/hull.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "studio/charts/silhouette.h"
#include "tests/studio/quick_chart.h"

namespace studio::hull_chart_test {
namespace {

TEST(HullChart, HasAHullThatErrsLessThanBillboardsFromThirtyDegreesOn) {
  const Chart chart = measure_quickly(hull_chart());
  int defaults = 0;
  for (const ChartPoint& p : chart.points) {
    EXPECT_GT(p.time_ms, 0);
    EXPECT_FALSE(p.error_p99);
    EXPECT_TRUE(std::isfinite(p.error));
    defaults += p.by_default;
  }
  EXPECT_EQ(defaults, 1);
  ASSERT_EQ(chart.stressors.size(), 3U);
  // Composite and pixels that are wrong. Beyond the last camera a hull of two is too wide.
  for (const std::size_t kind : {0U, 2U}) {
    for (const StressorSample& sample : chart.stressors[kind].samples) {
      ASSERT_TRUE(std::isfinite(sample.error));
      ASSERT_EQ(sample.figures.size(), 5U);
      for (const auto& [name, value] : sample.figures) ASSERT_TRUE(std::isfinite(value)) << name;
      if (sample.value < 30 || (kind == 2 && sample.value > 60)) continue;
      for (const std::size_t billboard : {0U, 1U}) {
        EXPECT_LT(sample.error, sample.figures[billboard].second)
            << kind << " " << sample.value << " " << billboard;
      }
    }
  }
}

TEST(PersonError, IsHowFarASquareWasMoved) {
  const capture::Image plate = capture::make_image(40, 40, 3);
  const auto square_at = [](int left) {
    capture::Image image = capture::make_image(40, 40, 4);
    for (int y = 10; y < 30; ++y) {
      for (int x = left; x < left + 20; ++x) image.at(y, x, 0) = image.at(y, x, 3) = 1;
    }
    return image;
  };
  const PersonError same = person_error(square_at(5), square_at(5), plate);
  EXPECT_EQ(same.composite, 0);
  EXPECT_EQ(same.silhouette_px, 0);
  EXPECT_EQ(same.wrong_share, 0);
  const PersonError moved = person_error(square_at(8), square_at(5), plate);
  EXPECT_NEAR(moved.wrong_share, 2 * 3 / 20.0, 1e-6);
  EXPECT_GT(moved.silhouette_px, 0.5);  // upper and lower edges did not move
  EXPECT_LT(moved.silhouette_px, 3);
  EXPECT_GT(moved.composite, 1);
  EXPECT_THROW(person_error(plate, square_at(5), plate), std::invalid_argument);
}

}  // namespace
}  // namespace studio::hull_chart_test
