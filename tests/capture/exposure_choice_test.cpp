// The exposures of scenes: enough, and not one too many.
#include "capture/exposure_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

namespace capture::exposure_choice_test {
namespace {

constexpr ChoiceSettings camera{.noise = {.read = 1e-6, .shot = 5e-5},
                                .relative_error = 0.1,
                                .fullest = 0.7,
                                .possible = {.shortest_s = 2e-5, .longest_s = 1.0 / 60}};

double worst_error(const RadianceRange& scene,
                   const std::vector<double>& exposures_s,
                   const ChoiceSettings& settings) {
  double worst = 0;
  for (double stop = 0; std::exp2(stop) < scene.most / scene.least; stop += 0.02) {
    worst = std::max(worst, merged_error(scene.least * std::exp2(stop), exposures_s, settings.noise,
                                         settings.fullest));
  }
  return std::max(worst, merged_error(scene.most, exposures_s, settings.noise, settings.fullest));
}

// Whether any `count` exposures, from a grid of a quarter of a stop, resolve the scene.
bool some_suffice(const RadianceRange& scene,
                  const ChoiceSettings& settings,
                  std::size_t count,
                  double from_s,
                  std::vector<double>& chosen_s) {
  if (chosen_s.size() == count) {
    return worst_error(scene, chosen_s, settings) <= settings.relative_error;
  }
  for (double t = from_s; t <= settings.possible.longest_s; t *= std::exp2(0.25)) {
    chosen_s.push_back(t);
    if (some_suffice(scene, settings, count, t * std::exp2(0.25), chosen_s)) return true;
    chosen_s.pop_back();
  }
  return false;
}

TEST(ChooseExposures, ReachesTheErrorWithTheFewest) {
  std::mt19937 random(2);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::array<int, 5> of_count{};
  for (int trial = 0; trial < 40; ++trial) {
    ChoiceSettings settings = camera;
    settings.relative_error = std::exp2(uniform(-5, -2.5));
    // Within what the camera can.
    const double most =
        settings.fullest / (settings.possible.shortest_s * std::exp2(uniform(0, 6)));
    const RadianceRange scene{most / std::exp2(uniform(0, 11)), most};
    const ExposureChoice choice = choose_exposures(scene, settings);
    if (choice.too_bright || choice.too_dark) continue;
    EXPECT_LE(worst_error(scene, choice.exposures_s, settings),
              settings.relative_error * (1 + 1e-6));
    const std::size_t count = choice.exposures_s.size();
    if (count > 3) continue;  // as many tries as a test may take
    ++of_count[count];
    std::vector<double> chosen_s;
    EXPECT_FALSE(count > 1 &&
                 some_suffice(scene, settings, count - 1, settings.possible.shortest_s, chosen_s))
        << scene.least << " to " << scene.most << " error " << settings.relative_error;
  }
  EXPECT_GT(of_count[1], 0);
  EXPECT_GT(of_count[2], 0);
}

TEST(ChooseExposures, SaysWhereTheCameraEnds) {
  // The sun outdoors, at 60 frames a second.
  const ExposureChoice sun = choose_exposures({10, 1e7}, camera);
  EXPECT_TRUE(sun.too_bright);
  EXPECT_FALSE(sun.too_dark);
  EXPECT_DOUBLE_EQ(sun.exposures_s.front(), camera.possible.shortest_s);
  const ExposureChoice night = choose_exposures({1e-4, 1}, camera);
  EXPECT_TRUE(night.too_dark);
  EXPECT_DOUBLE_EQ(night.exposures_s.back(), camera.possible.longest_s);
  const ExposureChoice grey = choose_exposures({50, 60}, camera);
  EXPECT_EQ(grey.exposures_s.size(), 1U);
}

TEST(ChooseExposures, RefusesWhatMakesNoSense) {
  EXPECT_THROW(choose_exposures({0, 1}, camera), std::invalid_argument);
  EXPECT_THROW(choose_exposures({2, 1}, camera), std::invalid_argument);
  ChoiceSettings settings = camera;
  settings.relative_error = 1e-4;
  EXPECT_THROW(choose_exposures({1, 2}, settings), std::invalid_argument);
}

}  // namespace
}  // namespace capture::exposure_choice_test
