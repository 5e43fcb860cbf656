// Vignetting of made fish-eyes, told from turned shots and even fields.
#include "calibrate/vignetting_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "calibrate/angles.h"
#include "calibrate/vignetting.h"

namespace calibrate::vignetting_fit_test {
namespace {

Lens fish_eye() { return {"equisolid", 200, 200, {70, 99.5, 99.5}, 85 * degree}; }

// A smooth scene of a factor of ten, by direction in the set.
double scene_light(Vec3 v) {
  return std::exp(1.1 * std::sin(2.3 * v.x + 0.4) * std::cos(1.7 * v.y) + 0.5 * v.z);
}

template <class Light>
capture::Image photograph(const Lens& lens,
                          const Pose& cam_from_set,
                          std::span<const double> vignetting,
                          double noise,
                          unsigned seed,
                          Light light) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(1, noise);
  capture::Image image = capture::make_image(lens.height, lens.width, 3);
  const Pose set_from_cam = inverse(cam_from_set);
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const auto v_cam = unproject(lens, {static_cast<double>(x), static_cast<double>(y)});
      if (!v_cam) continue;
      const double angle = std::atan2(std::hypot(v_cam->x, v_cam->y), v_cam->z);
      const double seen = light(set_from_cam.R * *v_cam) * sensitivity(vignetting, angle);
      for (int c = 0; c < 3; ++c) image.at(y, x, c) = static_cast<float>(seen * normal(random));
    }
  }
  return image;
}

double worst_error(std::span<const double> found, std::span<const double> truth, double to_rad) {
  double worst = 0;
  for (double angle = 0; angle < to_rad; angle += 0.02) {
    worst = std::max(worst, std::abs(sensitivity(found, angle) / sensitivity(truth, angle) - 1));
  }
  return worst;
}

struct Turned {
  std::vector<capture::Image> images;
  std::vector<Pose> poses;
  std::vector<TurnedShot> shots() const {
    std::vector<TurnedShot> shots;
    for (std::size_t i = 0; i < images.size(); ++i) shots.push_back({&images[i], poses[i]});
    return shots;
  }
};

Turned turned(std::span<const double> vignetting, double noise) {
  Turned turned;
  unsigned seed = 1;
  for (const Vec3 axis :
       {Vec3{0, 0, 1}, Vec3{0.6, 0, 0.8}, Vec3{-0.4, 0.7, 0.6}, Vec3{0.1, -0.8, 0.6}}) {
    turned.poses.push_back(pose_from_axis({}, axis, 0.3 * seed));
    turned.images.push_back(
        photograph(fish_eye(), turned.poses.back(), vignetting, noise, seed++, scene_light));
  }
  return turned;
}

const std::vector<std::vector<double>> lenses{
    {-0.15}, {0.0802, -0.1180, 0.0140}, {-0.3, 0.1, -0.02}};

TEST(FitVignetting, TellsALensFromTurnedShotsOfAnyScene) {
  for (const std::vector<double>& truth : lenses) {
    const Turned made = turned(truth, 0.02);
    const auto samples = turned_samples(made.shots(), fish_eye(), 100);
    const VignettingFit fit = fit_vignetting(samples);
    EXPECT_LE(fit.terms.size(), truth.size() + 1);
    EXPECT_LT(worst_error(fit.terms, truth, 80 * degree), 0.02);
    EXPECT_GT(fit.max_angle_rad, 75 * degree);
    EXPECT_EQ(fit.candidates.size(), 5U);
  }
}

TEST(FitVignetting, TellsALensFromAnEvenField) {
  for (const std::vector<double>& truth : lenses) {
    const capture::Image field =
        photograph(fish_eye(), Pose{}, truth, 0.02, 2, [](Vec3) { return 0.4; });
    const VignettingFit fit = fit_vignetting(even_field_samples(field, fish_eye(), 100));
    EXPECT_LT(worst_error(fit.terms, truth, 80 * degree), 0.02);
  }
}

// Samples of an even field whose light falls with the angle as told.
template <class Falloff>
std::vector<VignettingSample> field_of(double rim_rad,
                                       Falloff falloff,
                                       double noise = 0.005,
                                       unsigned seed = 3) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(1, noise);
  std::vector<VignettingSample> samples;
  for (int i = 0; i < 2000; ++i) {
    const double angle = rim_rad * std::sqrt((i + 0.5) / 2000);
    samples.push_back({0, angle, 0.5 * falloff(angle) * normal(random)});
  }
  return samples;
}

TEST(FitVignetting, TellsLensesThatDimToATenth) {
  for (const double power : {2.5, 3.0, 3.5, 4.0}) {  // of a fish-eye, to .27 and .10
    const auto falloff = [&](double angle) { return std::pow(std::cos(0.6 * angle), power); };
    const VignettingFit fit = fit_vignetting(field_of(93 * degree, falloff));
    EXPECT_LT(fit.heldout_error, 0.01) << power;
    EXPECT_TRUE(fit.warnings.empty());
    for (double angle = 0; angle < 93 * degree; angle += 0.02) {
      EXPECT_NEAR(sensitivity(fit.terms, angle) / falloff(angle), 1, 0.03) << power << " " << angle;
    }
  }
  for (const double corner_deg : {40.0, 50.0, 55.0}) {  // of a pinhole, to .11
    const auto falloff = [](double angle) { return std::pow(std::cos(angle), 4); };
    const VignettingFit fit = fit_vignetting(field_of(corner_deg * degree, falloff));
    EXPECT_LT(fit.heldout_error, 0.01) << corner_deg;
    for (double angle = 0; angle < corner_deg * degree; angle += 0.02) {
      EXPECT_NEAR(sensitivity(fit.terms, angle) / falloff(angle), 1, 0.03) << corner_deg;
    }
  }
}

TEST(FitVignetting, KeepsTermsThatNoiseHidesInTheErrorOfOneSample) {
  const std::vector<double> truth{-0.2, 0.05, -0.045};  // to a fifth at the rim
  const auto falloff = [&](double angle) { return sensitivity(truth, angle); };
  for (unsigned seed = 0; seed < 6; ++seed) {
    const VignettingFit fit = fit_vignetting(field_of(90 * degree, falloff, 0.06, seed));
    EXPECT_LT(worst_error(fit.terms, truth, 90 * degree), 0.03) << seed;
  }
}

TEST(FitVignetting, WarnsOfAFieldThatNoTermsExplain) {
  const VignettingFit fit = fit_vignetting(
      field_of(80 * degree, [](double angle) { return 0.6 + 0.5 * std::sin(40 * angle); }));
  EXPECT_EQ(fit.warnings.size(), 1U);
}

TEST(FitVignetting, GivesAnEvenLensNoTerms) {
  const Turned made = turned({}, 0.02);
  const VignettingFit fit = fit_vignetting(turned_samples(made.shots(), fish_eye(), 100));
  EXPECT_TRUE(fit.terms.empty());
  EXPECT_LT(fit.heldout_error, 0.02);
}

TEST(FitVignetting, DoesNotMindPlacesThatAreSeenOnce) {
  const std::vector<double> truth{-0.15};
  const Turned made = turned(truth, 0.02);
  std::vector<VignettingSample> samples = turned_samples(made.shots(), fish_eye(), 100);
  std::erase_if(samples, [](const auto& sample) { return sample.angle_rad > 70 * degree; });
  const VignettingFit without = fit_vignetting(samples);
  const std::size_t twice_as_many = 3 * samples.size();
  for (std::size_t place = 100000; samples.size() < twice_as_many; ++place) {
    samples.push_back({place, 80 * degree, 1});
  }
  const VignettingFit with = fit_vignetting(samples);
  EXPECT_EQ(with.terms, without.terms);
  EXPECT_EQ(with.heldout_error, without.heldout_error);
  EXPECT_LT(with.max_angle_rad, 70 * degree + 1e-9);
  EXPECT_GT(with.heldout_error, 0.003);  // of noise, not of places that explain themselves
}

TEST(FitVignetting, DoesNotMindWhatMovesOrClips) {
  const std::vector<double> truth{-0.15};
  Turned made = turned(truth, 0.01);
  for (std::size_t i = 0; i < made.images.size(); ++i) {  // a bright thing, elsewhere in each
    for (int y = 60; y < 90; ++y) {
      for (int x = 20 + 40 * static_cast<int>(i); x < 50 + 40 * static_cast<int>(i); ++x) {
        for (int c = 0; c < 3; ++c) made.images[i].at(y, x, c) = 3;
      }
    }
    for (float& value : made.images[i].pixels) value = std::min(value, 3.2F);
  }
  const VignettingFit fit = fit_vignetting(turned_samples(made.shots(), fish_eye(), 3.2));
  EXPECT_LT(worst_error(fit.terms, truth, 80 * degree), 0.03);
}

TEST(FitVignetting, RefusesWhatTellsNothing) {
  std::vector<VignettingSample> alike;
  for (std::size_t i = 0; i < 1000; ++i) alike.push_back({i / 2, 0.5, 1});
  EXPECT_THROW(fit_vignetting(alike), std::runtime_error);
  EXPECT_THROW(fit_vignetting({}), std::runtime_error);
  alike[3].radiance = -1;
  EXPECT_THROW(fit_vignetting(alike), std::invalid_argument);
  alike[3].radiance = std::nan("");
  EXPECT_THROW(fit_vignetting(alike), std::invalid_argument);
  EXPECT_THROW(turned_samples({}, fish_eye(), 1), std::invalid_argument);
  EXPECT_THROW(even_field_samples(capture::make_image(3, 3), fish_eye(), 1), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate::vignetting_fit_test
