// The live merge: radiance with a deviation that is true, and the newest light where shots
// disagree.
#include "capture/live_merge.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "capture/made_sensor.h"
#include "tests/capture/made_bracket.h"
#include "tests/capture/made_window.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

// Counted in all threads, to show that a merge needs no new memory; sanitizers want their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Not inlined, so that the compiler does not see malloc behind new.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#endif

namespace capture::live_merge_test {
namespace {

using namespace made_window;

const std::vector<std::vector<double>> brackets{{1, 1.0 / 4, 1.0 / 16, 1.0 / 64, 1.0 / 256},
                                                {1.0 / 8, 1, 1.0 / 2, 1.0 / 16, 1.0 / 4},
                                                {1.0 / 64, 1.0 / 8, 1},
                                                {1, 1, 1}};

TEST(MergeWindow, RecoversRadianceWhateverTheBracket) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> stops(-8, 8);
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<double> exposures_s;
    for (std::size_t i = 0; i <= random() % 6; ++i) exposures_s.push_back(std::exp2(stops(random)));
    const double shortest = *std::ranges::min_element(exposures_s);
    Image radiance = make_image(5, 31);  // a whole stretch and a rest
    for (float& value : radiance.pixels) {
      value = static_cast<float>(std::exp2(stops(random) - 8) * 0.97 / shortest);
    }
    std::vector<Shot> shots;
    for (const double exposure_s : exposures_s) {
      Shot shot{radiance, exposure_s};
      for (float& value : shot.linear.pixels) {
        value = std::min(1.0F, value * static_cast<float>(exposure_s));
      }
      shots.push_back(std::move(shot));
    }
    MergedFrame frame;
    merge_window(live_shots(shots), {}, frame);
    for (std::size_t i = 0; i < radiance.pixels.size(); ++i) {
      ASSERT_NEAR(frame.radiance.pixels[i] / radiance.pixels[i], 1, 1e-5);
    }
  }
}

TEST(MergeWindow, ComesWithin15PercentOfTheCramerRaoBound) {
  const MadeSensor sensor = camera();
  const NoiseModel noise = noise_of(sensor);
  for (const std::vector<double>& exposures_s : brackets) {
    const double shortest = *std::ranges::min_element(exposures_s);
    double squares_over_bound = 0;
    int levels = 0;
    for (double stop = -9; std::exp2(stop) * shortest < 0.9; stop += 0.25, ++levels) {
      const Image radiance = grey(std::exp2(stop), 32, 24);
      double information = 0;
      for (const double exposure_s : exposures_s) {
        information += made::information(std::exp2(stop), exposure_s, noise);
      }
      const auto seed = static_cast<std::uint64_t>(1000 * (stop + 20));
      const MergedFrame frame = merge(take(sensor, radiance, exposures_s, seed), sensor);
      double squares = 0;
      for (const float value : frame.radiance.pixels) {
        squares += std::pow(static_cast<double>(value) - std::exp2(stop), 2);
      }
      squares_over_bound +=
          squares / static_cast<double>(frame.radiance.pixels.size()) * information;
    }
    EXPECT_LT(std::sqrt(squares_over_bound / levels), 1.15) << exposures_s[0];
  }
}

TEST(MergeWindow, TellsADeviationThatHoldsTheTruthIn68PercentOfAllValues) {
  const MadeSensor sensor = camera();
  for (const std::vector<double>& exposures_s : brackets) {
    const double shortest = *std::ranges::min_element(exposures_s);
    for (double stop = -9; std::exp2(stop) * shortest < 0.9; stop += 1) {
      const double truth = std::exp2(stop);
      const auto seed = static_cast<std::uint64_t>(1000 * (stop + 20));
      const MergedFrame frame = merge(take(sensor, grey(truth, 64, 48), exposures_s, seed), sensor);
      const Image deviation = frame.deviation();
      int within = 0;
      for (std::size_t i = 0; i < frame.radiance.pixels.size(); ++i) {
        const double error = static_cast<double>(frame.radiance.pixels[i]) - truth;
        if (std::abs(error) <= static_cast<double>(deviation.pixels[i])) ++within;
      }
      EXPECT_NEAR(within / static_cast<double>(frame.radiance.pixels.size()), 0.683, 0.05)
          << "radiance 2^" << stop << ", first exposure " << exposures_s[0];
    }
  }
}

TEST(MergeWindow, IsUnbiasedNearBlack) {
  const MadeSensor sensor = camera();
  constexpr double truth = 2e-4;  // 4 electrons in the longest exposure
  const MergedFrame frame = merge(take(sensor, grey(truth, 128, 96), {0.25, 1}, 5), sensor);
  double sum = 0;
  for (const float value : frame.radiance.pixels) sum += static_cast<double>(value);
  const auto count = static_cast<double>(frame.radiance.pixels.size());
  EXPECT_NEAR(sum / count, truth, 4 * 3e-4 / std::sqrt(count));
}

TEST(MergeWindow, FindsNoMotionWhereThereIsNone) {
  const MadeSensor sensor = camera();
  const made::Scene scene = made::patches(128, 96, 6);
  Image radiance = make_image(scene.height, scene.width);
  for (std::size_t i = 0; i < radiance.pixels.size(); ++i) {
    radiance.pixels[i] = static_cast<float>(scene.radiance[i]);
  }
  for (const std::vector<double>& exposures_s : brackets) {
    const MergedFrame frame = merge(take(sensor, radiance, exposures_s, 9), sensor);
    const double inconsistent =
        frame.status_shares()[static_cast<std::size_t>(MergeStatus::inconsistent)];
    EXPECT_LT(inconsistent, 1e-3);
  }
}

TEST(MergeWindow, TellsBoundsFromValues) {
  const float infinity = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  // Pixels: saturated in both, in one channel, dark, missing, plain, plain beside what is no value.
  const std::vector<Shot> shots{
      {Image{1,
             6,
             {1, 1, 1, 1, .2F, .2F, 0, 0, 0, nan, nan, nan, .5F, .5F, .5F, .5F, .5F, -infinity}},
       1},
      {Image{1,
             6,
             {1, 1, 1, 1, .02F, .02F, 0, 0, 0, nan, nan, -infinity, .05F, .05F, .05F, .05F, nan,
              .05F}},
       0.1}};
  MergedFrame frame;
  merge_window(live_shots(shots), {}, frame);
  using enum MergeStatus;
  EXPECT_EQ(frame.status,
            (std::vector<MergeStatus>{lower_bound, lower_bound, dark, missing, good, good}));
  EXPECT_FLOAT_EQ(frame.radiance.at(0, 0, 0), 10);
  EXPECT_FLOAT_EQ(frame.radiance.at(0, 1, 0), 10);
  EXPECT_FLOAT_EQ(frame.radiance.at(0, 1, 1), 0.2F);
  EXPECT_EQ(frame.radiance.at(0, 3, 2), 0);
  for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(frame.radiance.at(0, 5, c), 0.5F);
  const Image deviation = frame.deviation();
  EXPECT_EQ(deviation.at(0, 0, 0), infinity);
  EXPECT_EQ(deviation.at(0, 1, 0), infinity);
  EXPECT_LT(deviation.at(0, 1, 1), 0.01F);
  EXPECT_EQ(deviation.at(0, 3, 2), infinity);
  EXPECT_EQ(frame.counted[3 * 3], 0);
  EXPECT_EQ(frame.counted[3 * 4], 3);
}

TEST(MergeWindow, TakesTheNewestLightWhereALampWasSwitched) {
  // Radiance 0.01 becomes 0.3, or the other way; the newest exposure is the long or the short one.
  for (const std::vector<double>& exposures_s : {std::vector<double>{0.1, 0.5, 1}, {1, 0.1, 0.5}}) {
    for (const bool on : {true, false}) {
      std::vector<Shot> shots;
      for (const double& exposure_s : exposures_s) {
        const bool newest = &exposure_s == &exposures_s.back();
        const double radiance = newest == on ? 0.3 : 0.01;
        shots.push_back({grey(radiance * exposure_s, 40, 3), exposure_s});
      }
      MergedFrame frame;
      merge_window(live_shots(shots), {}, frame);
      for (const float value : frame.radiance.pixels) ASSERT_FLOAT_EQ(value, on ? 0.3F : 0.01F);
      EXPECT_EQ(frame.status_shares()[static_cast<std::size_t>(MergeStatus::inconsistent)], 1);
    }
  }
}

TEST(MergeWindow, BelievesASaturatedNewestShotThatThereIsMoreLight) {
  // A lamp of radiance 5 is on since the newest, long shot.
  const std::vector<Shot> shots{
      {grey(0.001, 40, 3), 0.1}, {grey(0.01, 40, 3), 1}, {grey(1, 40, 3), 1}};
  MergedFrame frame;
  merge_window(live_shots(shots), {}, frame);
  for (const float value : frame.radiance.pixels) ASSERT_FLOAT_EQ(value, 1);
  EXPECT_EQ(frame.status_shares()[static_cast<std::size_t>(MergeStatus::lower_bound)], 1);
}

TEST(MergeWindow, LeavesOutAPixelWholeIfOneChannelMoved) {
  const std::vector<Shot> shots{{Image{1, 1, {.2F, .2F, .3F}}, 1},
                                {Image{1, 1, {.201F, .201F, .1F}}, 1}};
  MergedFrame frame;
  merge_window(live_shots(shots), {}, frame);
  EXPECT_FLOAT_EQ(frame.radiance.at(0, 0, 0), 0.201F);
  EXPECT_FLOAT_EQ(frame.radiance.at(0, 0, 2), 0.1F);
}

// How pixels are merged together must not show.
TEST(MergeWindow, GivesAPixelTheSameBitsWhateverItsNeighbours) {
  const MadeSensor sensor = camera();
  for (const double level : {0.02, 0.3, 1.5, 20.0}) {
    for (const std::vector<double>& exposures_s : brackets) {
      Window window = take(sensor, grey(level, 64, 8), exposures_s, 3);
      const MergedFrame calm = merge(window, sensor);
      for (std::size_t i = 0; i < window.taken.size(); ++i) {
        for (std::size_t p = 0; p < 64 * 8; p += 5) {  // saturated here, and black there
          for (std::size_t c = 0; c < 3; ++c) {
            window.taken[i].codes[3 * p + c] = (p + i) % 2 == 0 ? 4095 : 64;
          }
        }
      }
      const MergedFrame mixed = merge(window, sensor);
      for (std::size_t p = 0; p < 64 * 8; ++p) {
        if (p % 5 == 0) continue;
        ASSERT_EQ(mixed.status[p], calm.status[p]);
        for (std::size_t i = 3 * p; i < 3 * p + 3; ++i) {
          ASSERT_EQ(mixed.radiance.pixels[i], calm.radiance.pixels[i]) << level;
          ASSERT_EQ(mixed.counted[i], calm.counted[i]) << level;
        }
      }
    }
  }
}

TEST(MergeWindow, GivesTheSameBitsInOneThread) {
  const MadeSensor sensor = camera();
  const Window window = take(sensor, grey(0.3, 301, 67), brackets[0], 3);
  const MergedFrame frame = merge(window, sensor);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const MergedFrame alone = merge(window, sensor);
  EXPECT_EQ(alone.radiance.pixels, frame.radiance.pixels);
  EXPECT_EQ(alone.counted, frame.counted);
}

// As beside saturated sites of a mosaic.
TEST(MergeWindow, LeavesOutWhatIsNoValue) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  const std::vector<double> exposures_s{0.25, 1, 0.0625};
  for (std::size_t mask = 0; mask < 8; ++mask) {
    std::vector<Shot> shots, left;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto value =
          static_cast<float>(0.3 * exposures_s[i] * (1 + 0.002 * static_cast<double>(mask + i)));
      shots.push_back({Image{1, 1, {value, value, value}}, exposures_s[i]});
      if ((mask >> i & 1) != 0) {
        left.push_back(shots.back());
      } else {
        shots.back().linear.pixels[1] = none;
      }
    }
    MergedFrame frame;
    merge_window(live_shots(shots), {}, frame);
    EXPECT_EQ(frame.counted[1], mask);
    if (mask == 0) {
      EXPECT_EQ(frame.status[0], MergeStatus::missing);
      EXPECT_EQ(frame.radiance.pixels[1], 0);
      EXPECT_TRUE(std::isinf(frame.deviation().pixels[1]));
      continue;
    }
    MergedFrame of_left;
    merge_window(live_shots(left), {}, of_left);
    EXPECT_EQ(frame.status[0], MergeStatus::good);
    EXPECT_NEAR(frame.radiance.pixels[1], of_left.radiance.pixels[1], 1e-6) << mask;
    EXPECT_NEAR(frame.deviation().pixels[1], of_left.deviation().pixels[1], 1e-6) << mask;
  }
}

// Whatever a register holds: 37 shades from black to saturated, and a lamp that is switched.
TEST(MergeWindow, GivesTheSameBitsWithTheWidestRegisters) {
  const MadeSensor sensor = camera();
  Image radiance = make_image(67, 301);
  for (std::size_t i = 0; i < radiance.pixels.size(); ++i) {
    radiance.pixels[i] = std::exp2(static_cast<float>(i / 700 % 37) * 0.5F - 12);
  }
  for (const std::vector<double>& exposures_s : brackets) {
    Window window = take(sensor, radiance, exposures_s, 3);
    for (const bool lamp : {false, true}) {
      if (lamp) window.taken.back() = expose(sensor, grey(0.05, 301, 67), exposures_s.back(), 9);
      WindowMergeSettings settings{.noise = noise_of(sensor)};
      MergedFrame wide, built;
      merge_window(window.shots(), codes_of(sensor, 301, 67), settings, wide);
      settings.widest_registers = false;
      merge_window(window.shots(), codes_of(sensor, 301, 67), settings, built);
      EXPECT_EQ(wide.radiance.pixels, built.radiance.pixels);
      EXPECT_EQ(wide.counted, built.counted);
      EXPECT_EQ(wide.status, built.status);
    }
  }
}

TEST(MergeWindow, AllocatesNothingOnceItHasMergedAFrameOfThatSize) {
  const MadeSensor sensor = camera();
  Window window = take(sensor, grey(0.3, 301, 67), brackets[0], 3);
  window.taken.back() = expose(sensor, grey(0.4, 301, 67), brackets[0].back(), 9);  // a lamp
  const std::vector<CodedShot16> shots = window.shots();
  const LinearCodes codes = codes_of(sensor, 301, 67);
  const WindowMergeSettings settings{.noise = noise_of(sensor)};
  MergedFrame frame;
  merge_window(shots, codes, settings, frame);
  Image deviation = frame.deviation();
  const long before = allocations;
  for (int i = 0; i < 10; ++i) {
    merge_window(shots, codes, settings, frame);
    frame.fill_deviation(deviation);
  }
  EXPECT_EQ(allocations, before);
}

TEST(MergeWindow, ReadsCodesOf8And16BitsAndFloatsAlike) {
  const MadeSensor sensor{.full_well_e = 20000, .read_noise_e = 4, .bits = 8, .pedestal = 4};
  const Window window = take(sensor, grey(0.4, 70, 9), {1, 0.25, 1.0 / 16}, 3);
  const MergedFrame wide = merge(window, sensor);
  std::vector<std::vector<std::uint8_t>> bytes;
  std::vector<Shot> linear;
  for (const MadeShot& shot : window.taken) {
    bytes.emplace_back(shot.codes.begin(), shot.codes.end());
    linear.push_back({make_image(9, 70), window.exposures_s[linear.size()]});
    for (std::size_t i = 0; i < shot.codes.size(); ++i) {
      linear.back().linear.pixels[i] = static_cast<float>((shot.codes[i] - 4) / 251.0);
    }
  }
  std::vector<CodedShot8> narrow;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    narrow.push_back({bytes[i], window.exposures_s[i]});
  MergedFrame eight, floats;
  merge_window(narrow, codes_of(sensor, 70, 9), {.noise = noise_of(sensor)}, eight);
  merge_window(live_shots(linear), {.noise = noise_of(sensor)}, floats);
  EXPECT_EQ(eight.radiance.pixels, wide.radiance.pixels);
  EXPECT_EQ(eight.counted, wide.counted);
  for (std::size_t i = 0; i < wide.radiance.pixels.size(); ++i) {
    ASSERT_NEAR(floats.radiance.pixels[i], wide.radiance.pixels[i], 1e-5);
  }
}

TEST(MergeWindow, HasBlackAndWhiteForEachChannel) {
  const std::vector<std::uint8_t> codes{60, 120, 250};
  MergedFrame frame;
  merge_window(std::vector<CodedShot8>{{codes, 0.5}},
               LinearCodes{1, 1, {10, 20, 0}, {110, 220, 250}}, {}, frame);
  EXPECT_FLOAT_EQ(frame.radiance.at(0, 0, 0), 1);
  EXPECT_FLOAT_EQ(frame.radiance.at(0, 0, 1), 1);
  EXPECT_FLOAT_EQ(frame.radiance.at(0, 0, 2), 2);
  EXPECT_EQ(frame.status[0], MergeStatus::lower_bound);
  EXPECT_TRUE(std::isfinite(frame.deviation().at(0, 0, 1)));
}

TEST(MergeWindow, RefusesWhatDoesNotFit) {
  MergedFrame frame;
  EXPECT_THROW(merge_window(std::span<const LiveShot>(), {}, frame), std::invalid_argument);
  const std::vector<Shot> sizes{{grey(0, 2, 2), 1}, {grey(0, 2, 3), 1}};
  EXPECT_THROW(merge_window(live_shots(sizes), {}, frame), std::invalid_argument);
  const std::vector<Shot> alpha{{make_image(2, 2, 4), 1}};
  EXPECT_THROW(merge_window(live_shots(alpha), {}, frame), std::invalid_argument);
  const std::vector<LiveShot> none{{nullptr, 1}};
  EXPECT_THROW(merge_window(none, {}, frame), std::invalid_argument);
  const std::vector<Shot> many(17, {grey(0, 1, 1), 1});
  EXPECT_THROW(merge_window(live_shots(many), {}, frame), std::invalid_argument);
  for (const double wrong : {0.0, -1.0, 1e-30, std::nan("")}) {
    const std::vector<Shot> no_time{{grey(0, 1, 1), wrong}};
    EXPECT_THROW(merge_window(live_shots(no_time), {}, frame), std::invalid_argument);
  }
  const std::vector<Shot> one{{grey(0, 1, 1), 1}};
  EXPECT_THROW(merge_window(live_shots(one), {.noise = {.read = 0}}, frame), std::invalid_argument);
  EXPECT_THROW(merge_window(live_shots(one), {.noise = {}, .consistency = -1}, frame),
               std::invalid_argument);
  const std::vector<std::uint8_t> codes{1, 2, 3};
  const std::vector<CodedShot8> coded{{codes, 1}};
  EXPECT_THROW(merge_window(coded, LinearCodes{2, 1}, {}, frame), std::invalid_argument);
  EXPECT_THROW(merge_window(coded, LinearCodes{1, 1, {9, 9, 9}, {9, 9, 9}}, {}, frame),
               std::invalid_argument);
}

}  // namespace
}  // namespace capture::live_merge_test
