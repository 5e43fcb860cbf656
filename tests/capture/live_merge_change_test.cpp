// What a live merge does where shots contradict each other: motion, lamps, labels, drift, flicker.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "capture/live_merge.h"
#include "capture/made_sensor.h"
#include "tests/capture/made_window.h"

namespace capture::live_merge_change_test {
namespace {

using namespace made_window;

// A person of four shades walks to the right through a room.
Image room(int x_of_person, double lamp) {
  Image image = make_image(72, 160);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double wall = 0.3 + 0.2 * std::sin(0.2 * x) * std::cos(0.3 * y);
      const bool person = x >= x_of_person && x < x_of_person + 24 && y >= 12;
      constexpr double shades[] = {0.05, 0.8, 0.12, 0.03};
      for (int c = 0; c < 3; ++c) {
        const double seen = person ? shades[y / 18] * (1 - 0.15 * c) : wall * (1 - 0.1 * c);
        image.at(y, x, c) = static_cast<float>(seen + (x > 120 ? lamp : lamp / 8));
      }
    }
  }
  return image;
}

// Root mean square error where light has changed in the window.
struct Ghost {
  double plain = 0, ours = 0;
  double known = 0;  // of the shots of the newest light alone: their noise
};

double squared_error(const MergedFrame& frame, std::size_t i, double truth) {
  return std::pow(static_cast<double>(frame.radiance.pixels[i]) - truth, 2);
}

// The shots that saw just what the newest one saw.
Window of_newest_light(const Window& window, const std::vector<Image>& seen) {
  Window newest;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].pixels != seen.back().pixels) continue;
    newest.taken.push_back(window.taken[i]);
    newest.exposures_s.push_back(window.exposures_s[i]);
  }
  return newest;
}

// Of a camera that goes through the exposures before a scene that changes from frame to frame.
template <class SceneOf>
Ghost ghost_of(const SceneOf& scene_of, const std::vector<double>& exposures_s, int frames) {
  const MadeSensor sensor = camera();
  Ghost squares;
  double count = 0;
  std::vector<Image> seen;
  Window window;
  for (int i = 0; i < frames; ++i) {
    const double exposure_s = exposures_s[static_cast<std::size_t>(i) % exposures_s.size()];
    seen.push_back(scene_of(i));
    window.taken.push_back(expose(sensor, seen.back(), exposure_s, static_cast<std::uint64_t>(i)));
    window.exposures_s.push_back(exposure_s);
    if (seen.size() > exposures_s.size()) {
      seen.erase(seen.begin());
      window.taken.erase(window.taken.begin());
      window.exposures_s.erase(window.exposures_s.begin());
    }
    if (seen.size() < exposures_s.size()) continue;
    const MergedFrame plain = merge(window, sensor, 0);
    const MergedFrame ours = merge(window, sensor);
    const MergedFrame known = merge(of_newest_light(window, seen), sensor, 0);
    for (std::size_t k = 0; k < plain.radiance.pixels.size(); ++k) {
      const double truth = static_cast<double>(seen.back().pixels[k]);
      const bool changed = std::ranges::any_of(
          seen, [&](const Image& image) { return image.pixels[k] != seen.back().pixels[k]; });
      if (!changed) continue;
      squares.plain += squared_error(plain, k, truth);
      squares.ours += squared_error(ours, k, truth);
      squares.known += squared_error(known, k, truth);
      ++count;
    }
  }
  const auto root = [&](double sum) { return std::sqrt(std::max(0.0, sum) / count); };
  return {root(squares.plain), root(squares.ours), root(squares.known)};
}

TEST(MergeWindow, HasAFifthOfThePlainMergesGhostOfAWalkingPerson) {
  for (const std::vector<double>& exposures_s :
       {std::vector<double>{1, 0.25, 1.0 / 16}, {1, 1.0 / 16, 0.5, 1.0 / 8, 0.25}}) {
    const Ghost ghost = ghost_of([](int i) { return room(10 + 4 * i, 0); }, exposures_s, 20);
    EXPECT_GT(ghost.plain, 0.02);
    EXPECT_LT(ghost.ours, ghost.plain / 5) << exposures_s.size();
  }
}

// All of the error is a fifth, or no more than the noise of the shots that saw the lamp.
TEST(MergeWindow, HasAFifthOfThePlainMergesGhostOfALamp) {
  for (int phase = 0; phase < 3; ++phase) {
    const Ghost ghost =
        ghost_of([&](int i) { return room(40, i > 4 + phase ? 0.4 : 0); }, {1, 0.25, 1.0 / 16}, 12);
    EXPECT_GT(ghost.plain, 0.01);
    EXPECT_LT(ghost.ours, std::max(ghost.plain / 5, 1.02 * ghost.known)) << phase;
    EXPECT_LT(ghost.ours * ghost.ours - ghost.known * ghost.known, std::pow(ghost.plain / 20, 2));
  }
}

TEST(MergeWindow, FindsAChangeThatPixelsTellOnlyTogether) {
  const MadeSensor sensor = camera();
  Window window = take(sensor, grey(0.3, 640, 4), {1, 0.25}, 3);
  const Window lit = take(sensor, grey(0.35, 640, 4), {1.0 / 16},
                          9);  // a sixth more, of 5 % noise
  window.taken.push_back(lit.taken[0]);
  window.exposures_s.push_back(lit.exposures_s[0]);
  const MergedFrame frame = merge(window, sensor);
  EXPECT_GT(frame.status_shares()[static_cast<std::size_t>(MergeStatus::inconsistent)], 0.99);
  double sum = 0;
  for (const float value : frame.radiance.pixels) sum += static_cast<double>(value);
  EXPECT_NEAR(sum / static_cast<double>(frame.radiance.pixels.size()), 0.35, 0.005);
}

// Codes of 8 bits that are rounded alike all over.
TEST(MergeWindow, TakesNoRoundingForAChange) {
  const MadeSensor sensor{.full_well_e = 20000, .read_noise_e = 4, .bits = 8, .pedestal = 4};
  for (const double level : {0.1, 0.3, 0.37, 0.9}) {
    const Window window =
        take(sensor, grey(level, 640, 4), {1.0 / 64, 1, 1.0 / 1024, 0.25, 1.0 / 256}, 3);
    const auto shares = merge(window, sensor).status_shares();
    EXPECT_LT(shares[static_cast<std::size_t>(MergeStatus::inconsistent)], 0.001) << level;
  }
}

// Light that differs from shot to shot by these factors, and what the newest one saw.
struct Judged {
  double error = 0, told = 0;  // relative, root mean squares
  MergedFrame frame;
};

Judged judge(const std::vector<double>& factors,
             double of_last_label,
             const WindowMergeSettings& settings) {
  const MadeSensor sensor = camera();
  const std::vector<double> exposures_s{1.0 / 64, 1, 1.0 / 16, 1.0 / 4, 1.0 / 32};
  Window window;
  Image slope = make_image(64, 192);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    for (std::size_t k = 0; k < slope.pixels.size(); ++k) {
      slope.pixels[k] =
          static_cast<float>(factors[i] * std::exp2(static_cast<double>(k % 576) / 72 - 6));
    }
    window.taken.push_back(expose(sensor, slope, exposures_s[i], i));
    window.exposures_s.push_back(exposures_s[i] * (i == 3 ? of_last_label : 1));
  }
  Judged judged;
  merge_window(window.shots(), codes_of(sensor, 192, 64), settings, judged.frame);
  const Image deviation = judged.frame.deviation();
  for (std::size_t k = 0; k < slope.pixels.size(); ++k) {
    const auto truth = static_cast<double>(slope.pixels[k]);
    judged.error += squared_error(judged.frame, k, truth) / (truth * truth);
    judged.told += std::pow(static_cast<double>(deviation.pixels[k]) / truth, 2);
  }
  const auto count = static_cast<double>(slope.pixels.size());
  judged.error = std::sqrt(judged.error / count);
  judged.told = std::sqrt(judged.told / count);
  return judged;
}

TEST(MergeWindow, TellsThatALabelIsWrong) {
  const WindowMergeSettings settings{.noise = noise_of(camera())};
  const Judged right = judge({1, 1, 1, 1, 1}, 1, settings);
  EXPECT_NEAR(right.told / right.error, 1, 0.1);
  for (const double gain : right.frame.gains) EXPECT_LT(std::abs(gain - 1), 0.003);
  for (const double wrong : {1.03, 1.1, 1 / 1.1}) {
    const Judged judged = judge({1, 1, 1, 1, 1}, wrong, settings);
    EXPECT_GT(judged.told, judged.error) << wrong;
    EXPECT_LT(judged.told, 3 * judged.error) << wrong;
    const auto& gains = judged.frame.gains;
    EXPECT_NEAR(gains[3] / gains[0], 1 / wrong, 0.01) << wrong;
  }
}

TEST(MergeWindow, TellsThatLightDrifts) {
  const WindowMergeSettings settings{.noise = noise_of(camera())};
  for (const double step : {1.01, 1 / 1.01, 1.02}) {
    std::vector<double> factors;
    for (int i = 0; i < 5; ++i) factors.push_back(0.9 * std::pow(step, i - 4));
    const Judged judged = judge(factors, 1, settings);
    EXPECT_GT(judged.told, judged.error) << step;
    EXPECT_LT(judged.told, 3 * judged.error) << step;
  }
}

// Lamps at 100 Hz in exposures that are far shorter than their period.
TEST(MergeWindow, LevelsFlicker) {
  for (const double modulation : {0.2, 0.5}) {
    std::vector<double> factors;
    double logs = 0;
    for (int i = 0; i < 5; ++i) {
      factors.push_back(2 *
                        (1 + modulation * std::sin(2 * std::numbers::pi * (100.0 / 60) * i + 0.3)));
      logs += std::log(factors.back());
    }
    const double mean = std::exp(logs / 5);
    const WindowMergeSettings settings{.noise = noise_of(camera()), .level_flicker = true};
    const Judged judged = judge(factors, 1, settings);
    double error = 0;
    for (std::size_t k = 0; k < judged.frame.radiance.pixels.size(); ++k) {
      const double truth = mean * std::exp2(static_cast<double>(k % 576) / 72 - 6);
      error += std::pow(static_cast<double>(judged.frame.radiance.pixels[k]) / truth - 1, 2);
    }
    error = std::sqrt(error / static_cast<double>(judged.frame.radiance.pixels.size()));
    EXPECT_LT(error, 0.03) << modulation;
    for (std::size_t i = 0; i < 5; ++i) {
      EXPECT_NEAR(judged.frame.gains[i] * mean / factors[i], 1, 0.02) << modulation << " " << i;
    }
    const auto shares = judged.frame.status_shares();
    EXPECT_LT(shares[static_cast<std::size_t>(MergeStatus::inconsistent)], 0.01) << modulation;
  }
}

}  // namespace
}  // namespace capture::live_merge_change_test
