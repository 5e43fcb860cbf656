// Candidates of lens solves, and their derivatives.
#include "calibrate/lens_form.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace calibrate::lens_form_test {
namespace {

struct Sample {
  LensForm form;
  std::vector<double> free;
  double max_angle_rad;
};

std::vector<Sample> samples() {
  std::vector<double> splined(4 + 2 * 8 * 8 - 1, 0.0);
  splined[0] = 260;
  splined[1] = splined[2] = 500;
  for (std::size_t i = 3; i < splined.size(); ++i) {
    splined[i] = 0.01 * std::sin(static_cast<double>(i));
  }
  return {
      {{"kannala_brandt", 0, true}, {331, 513, 509}, 1.6},
      {{"kannala_brandt", 2, true}, {331, 513, 509, -.02, .003}, 1.6},
      {{"kannala_brandt", 4, false}, {331, 333, 513, 509, -.02, .003, 1e-4, -1e-5}, 1.6},
      {{"decentred_kannala_brandt", 1, true}, {331, 513, 509, 1e-3, -2e-3, -.02}, 1.6},
      {{"decentred_kannala_brandt", 4, false},
       {331, 333, 513, 509, 1e-3, -2e-3, -.02, .003, 1e-4, -1e-5},
       1.6},
      {{"LENSMODEL_PINHOLE", 0, true}, {1100, 640, 360}, .6},
      {{"LENSMODEL_OPENCV5", 0, false}, {1100, 1101, 640, 360, -.1, .05, 1e-3, -1e-3, .01}, .6},
      {{"LENSMODEL_OPENCV8", 0, true},
       {1100, 640, 360, -.1, .05, 1e-3, -1e-3, .01, .1, -.02, .01},
       .6},
      {{"LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=8_fov_x_deg=190", 0, true}, splined, 1.5},
  };
}

Vec3 random_point(std::mt19937& random, double max_angle_rad) {
  std::uniform_real_distribution<double> uniform;
  const double off = max_angle_rad * uniform(random);
  const double around = 6.283 * uniform(random);
  return Vec3{std::sin(off) * std::cos(around), std::sin(off) * std::sin(around), std::cos(off)} *
         (0.2 + uniform(random));
}

TEST(LensFunction, ProjectsAsTheLensOfItsParametersDoes) {
  std::mt19937 random(1);
  for (const auto& [form, free, max_angle_rad] : samples()) {
    SCOPED_TRACE(name_of(form));
    const LensFunction function(form);
    const Lens lens = lens_of(form, 1024, 1024, free);
    for (int i = 0; i < 50; ++i) {
      const Vec3 p = random_point(random, max_angle_rad);
      Vec2 q;
      ASSERT_TRUE(function(free.data(), p, q, nullptr, nullptr));
      const auto expected = project(lens, p);
      ASSERT_TRUE(expected);
      EXPECT_NEAR(q.x, expected->x, 1e-9);
      EXPECT_NEAR(q.y, expected->y, 1e-9);
    }
  }
}

TEST(LensFunction, HasTheDerivativesThatDifferencesShow) {
  std::mt19937 random(2);
  for (const auto& [form, free, max_angle_rad] : samples()) {
    SCOPED_TRACE(name_of(form));
    const LensFunction function(form);
    const std::size_t n = function.free_count();
    ASSERT_EQ(n, free.size());
    for (int i = 0; i < 20; ++i) {
      // The first lies on the axis, where angle and radius are both zero.
      const Vec3 p = i == 0 ? Vec3{0, 0, .7} : random_point(random, max_angle_rad);
      Vec2 q;
      std::vector<double> by_point(6), by_free(2 * n);
      ASSERT_TRUE(function(free.data(), p, q, by_point.data(), by_free.data()));
      const auto expect_alike = [](Vec2 above, Vec2 below, double step, double dx, double dy) {
        EXPECT_NEAR(dx, (above.x - below.x) / (2 * step), 1e-4 * (1 + std::abs(dx)));
        EXPECT_NEAR(dy, (above.y - below.y) / (2 * step), 1e-4 * (1 + std::abs(dy)));
      };
      Vec2 above, below;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double step = 1e-6;
        const Vec3 d{axis == 0 ? step : 0, axis == 1 ? step : 0, axis == 2 ? step : 0};
        ASSERT_TRUE(function(free.data(), p + d, above, nullptr, nullptr));
        ASSERT_TRUE(function(free.data(), p - d, below, nullptr, nullptr));
        expect_alike(above, below, step, by_point[axis], by_point[3 + axis]);
      }
      for (std::size_t j = 0; j < n; ++j) {
        const double step = 1e-6 * std::max(1.0, std::abs(free[j]));
        std::vector<double> moved = free;
        moved[j] += step;
        ASSERT_TRUE(function(moved.data(), p, above, nullptr, nullptr));
        moved[j] -= 2 * step;
        ASSERT_TRUE(function(moved.data(), p, below, nullptr, nullptr));
        expect_alike(above, below, step, by_free[j], by_free[n + j]);
      }
    }
  }
}

TEST(FreeOf, IsUndoneByLensOf) {
  for (const auto& [form, free, max_angle_rad] : samples()) {
    EXPECT_EQ(free_of(form, lens_of(form, 1024, 768, free)), free) << name_of(form);
  }
}

TEST(FreeOf, KeepsWhatTwoModelsShare) {
  const Lens small =
      lens_of({"kannala_brandt", 2, true}, 640, 480, std::vector{331., 1., 2., .1, .2});
  EXPECT_EQ(free_of({"decentred_kannala_brandt", 3, false}, small),
            (std::vector{331., 331., 1., 2., 0., 0., .1, .2, 0.}));
  EXPECT_EQ(free_of({"LENSMODEL_OPENCV4", 0, true}, small),
            (std::vector{331., 1., 2., 0., 0., 0., 0.}));
}

TEST(FreeCount, RefusesModelsThatCannotBeSolvedFor) {
  EXPECT_EQ(free_count({"kannala_brandt", 2, true}), 5u);
  EXPECT_EQ(free_count({"LENSMODEL_OPENCV4", 0, false}), 8u);
  EXPECT_THROW(free_count({"equisolid", 0, true}), std::invalid_argument);
  EXPECT_THROW(free_count({"kannala_brandt", 5, true}), std::invalid_argument);
  EXPECT_THROW(free_count({"LENSMODEL_CAHVORE_linearity=0.34", 0, true}), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate::lens_form_test
