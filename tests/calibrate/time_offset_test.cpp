// Two made cameras that see one lamp or one motion, each on its own clock.
#include "calibrate/time_offset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "calibrate/signal_edges.h"
#include "tests/calibrate/made_markers.h"

namespace calibrate {
namespace {

using testing::HasSubstr;

constexpr double frame_s = 0.04;

struct Clocks {
  double begin_s = 0;   // the first frame, on the true clock
  double offset_s = 0;  // of the camera's own
  double frame_s = calibrate::frame_s;
  double exposure_s = 0.02;
};

// What a camera tells of light whose integral over time is given.
std::vector<SignalSample> record(const std::function<double(double)>& integral,
                                 const Clocks& clocks,
                                 double length_s,
                                 double noise,
                                 made::Random& random) {
  std::vector<SignalSample> signal;
  for (int i = 0; i * clocks.frame_s < length_s; ++i) {
    const double t = clocks.begin_s + i * clocks.frame_s;
    const double e = clocks.exposure_s;
    const double light = (integral(t + e / 2) - integral(t - e / 2)) / e;
    signal.push_back({t + clocks.offset_s, 0.3 + 0.5 * light + noise * random.normal(), e});
  }
  return signal;
}

// A lamp switched at random, on average every `dwell_s`.
std::function<double(double)> random_lamp(double dwell_s, made::Random& random) {
  std::vector<double> switched{-10};
  while (switched.back() < 60) {
    switched.push_back(switched.back() - dwell_s * std::log(random.uniform(0, 1)));
  }
  return [switched](double t) {
    double on_s = 0;
    for (std::size_t k = 0; k + 1 < switched.size() && switched[k] < t; k += 2) {
      on_s += std::min(t, switched[k + 1]) - switched[k];
    }
    return on_s;
  };
}

// Motion of many frequencies up to 2.5 Hz.
std::function<double(double)> random_motion(made::Random& random) {
  struct Swing {
    double rate, phase, size;
  };
  std::vector<Swing> swings;
  for (int i = 0; i < 12; ++i) {
    swings.push_back({2 * std::numbers::pi * random.uniform(0.1, 2.5), random.uniform(0, 6),
                      0.3 * random.normal()});
  }
  return [swings](double t) {
    double sum = 0;
    for (const Swing& s : swings) sum -= s.size / s.rate * std::cos(s.rate * t + s.phase);
    return sum;
  };
}

struct Errors {
  double rms_s = 0;
  double chi_square = 0;  // mean of the squared error over its variance
};

Errors errors_of(int cases,
                 const std::function<std::pair<TimeOffset, double>(made::Random&)>& run) {
  Errors errors;
  for (int i = 0; i < cases; ++i) {
    made::Random random(static_cast<unsigned>(100 + i));
    const auto [found, truth] = run(random);
    const double error = found.offset_s - truth;
    errors.rms_s += error * error / cases;
    errors.chi_square += error * error / (found.sigma_s * found.sigma_s) / cases;
  }
  errors.rms_s = std::sqrt(errors.rms_s);
  return errors;
}

TEST(FindTimeOffset, IsRightToAMillisecondForALampAtTwentyFiveFrames) {
  for (const double exposure_s : {0.02, 0.039}) {
    const Errors errors = errors_of(12, [&](made::Random& random) {
      const auto lamp = random_lamp(0.3, random);
      const double offset_s = random.uniform(-2, 2);
      const Clocks a{random.uniform(0, frame_s), 0, frame_s, exposure_s};
      const Clocks b{random.uniform(0, frame_s), offset_s, frame_s, 0.7 * exposure_s};
      return std::pair(
          find_time_offset(record(lamp, a, 20, 0.005, random), record(lamp, b, 20, 0.005, random)),
          offset_s);
    });
    EXPECT_LT(errors.rms_s, 0.5e-3) << exposure_s;
    EXPECT_LT(errors.chi_square, 2) << exposure_s;
    EXPECT_GT(errors.chi_square, 0.1) << exposure_s;
  }
}

TEST(FindTimeOffset, KnowsWhatShortExposuresTell) {
  const Errors errors = errors_of(8, [](made::Random& random) {
    const auto lamp = random_lamp(0.3, random);
    const auto found = find_time_offset(
        record(lamp, {random.uniform(0, frame_s), 0, frame_s, 0.004}, 20, 0.005, random),
        record(lamp, {random.uniform(0, frame_s), 1, frame_s, 0.003}, 20, 0.005, random));
    return std::pair(found, 1.0);
  });
  EXPECT_LT(errors.rms_s, 5e-3);
  EXPECT_LT(errors.chi_square, 3);
}

TEST(FindTimeOffset, IsRightToAMillisecondForSmoothMotionAtTwoRates) {
  const Errors errors = errors_of(10, [](made::Random& random) {
    const auto motion = random_motion(random);
    const double offset_s = random.uniform(-2, 2);
    const Clocks a{random.uniform(0, 0.04), 0, 0.04, 0.01};
    const Clocks b{random.uniform(0, 0.03), offset_s, 1001.0 / 30000, 0.016};
    auto mirrored = record(motion, b, 10, 0.003, random);
    for (SignalSample& sample : mirrored) sample.value *= -40;  // another unit, the other way
    return std::pair(
        find_time_offset(record(motion, a, 10, 0.003, random), mirrored, {.any_sign = true}),
        offset_s);
  });
  EXPECT_LT(errors.rms_s, 0.5e-3);
  EXPECT_LT(errors.chi_square, 3.5);
}

// Frames of equal rates lie in step all the time: only the course of the light is evidence.
TEST(FindTimeOffset, NeedsNoExposureToBeTold) {
  made::Random random(3);
  constexpr int cases = 12;
  double squares = 0;
  double chi_square = 0;
  for (int i = 0; i < cases; ++i) {
    const auto lamp = random_lamp(0.3, random);
    auto a = record(lamp, {random.uniform(0, frame_s), 0}, 15, 0.002, random);
    auto b = record(lamp, {random.uniform(0, frame_s), 0.2}, 15, 0.002, random);
    for (SignalSample& sample : a) sample.exposure_s = 0;
    for (SignalSample& sample : b) sample.exposure_s = 0;
    const TimeOffset found = find_time_offset(a, b);
    EXPECT_EQ(found.edges, 0U);
    const double error = found.offset_s - 0.2;
    squares += error * error / cases;
    chi_square += error * error / (found.sigma_s * found.sigma_s) / cases;
  }
  EXPECT_LT(std::sqrt(squares), 3e-3);
  EXPECT_LT(chi_square, 6);  // sigma_s is half of what it should be, for the exposures are guessed
}

TEST(FindTimeOffset, DoesNotMindLostFrames) {
  made::Random random(4);
  const auto lamp = random_lamp(0.3, random);
  auto a = record(lamp, {0.01, 0}, 20, 0.005, random);
  const auto b = record(lamp, {0.023, -0.7}, 20, 0.005, random);
  std::erase_if(a, [&](const SignalSample&) { return random.uniform(0, 1) < 0.1; });
  const TimeOffset found = find_time_offset(a, b);
  EXPECT_LT(std::abs(found.offset_s + 0.7), 2e-3);
}

TEST(FindTimeOffset, TellsAMovingBoardFromItsPlacesInBothPictures) {
  made::Random random(5);
  const auto motion = random_motion(random);
  const auto seen = [&](double begin_s, double offset_s, Vec2 way) {
    std::vector<SeenPoint> points;
    for (int i = 0; i < 250; ++i) {
      const double t = begin_s + i * frame_s;
      const double x = (motion(t + 1e-4) - motion(t - 1e-4)) / 2e-4;
      points.push_back(
          {t + offset_s,
           {500 + x * way.x + 0.2 * random.normal(), 300 + x * way.y + 0.2 * random.normal()},
           0.005});
    }
    return points;
  };
  const auto a = along_main_axis(seen(0.005, 0, {120, 10}));
  const auto b = along_main_axis(seen(0.022, 0.4, {-60, 50}));
  const TimeOffset found = find_time_offset(a, b, {.any_sign = true});
  EXPECT_NEAR(found.offset_s, 0.4, 1e-3);
  EXPECT_TRUE(along_main_axis({}).empty());
}

TEST(FindEdges, TellsTheMomentFromTheShareOfAFrame) {
  const std::vector<SignalSample> signal{{0.00, 1, 0.02}, {0.04, 1, 0.02}, {0.08, 1.5, 0.02},
                                         {0.12, 3, 0.02}, {0.16, 3, 0.02}, {0.20, 3, 0.02},
                                         {0.24, 1, 0.02}, {0.28, 1, 0.02}, {0.32, 1, 0.02}};
  const std::vector<SignalEdge> edges = find_edges(signal);
  ASSERT_EQ(edges.size(), 2U);
  EXPECT_TRUE(edges[0].rising);
  EXPECT_NEAR(edges[0].low_s, 0.085, 1e-9);  // a quarter of the exposure is left
  EXPECT_EQ(edges[0].low_s, edges[0].high_s);
  EXPECT_FALSE(edges[1].rising);
  EXPECT_NEAR(edges[1].low_s, 0.21, 1e-4);
  EXPECT_NEAR(edges[1].high_s, 0.23, 1e-4);
}

std::string refusal(std::span<const SignalSample> a,
                    std::span<const SignalSample> b,
                    const TimeOffsetOptions& options = {}) {
  try {
    find_time_offset(a, b, options);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(FindTimeOffset, RefusesWhatTellsNothing) {
  made::Random random(6);
  const auto lamp = random_lamp(0.3, random);
  const auto other = random_lamp(0.3, random);
  const auto a = record(lamp, {}, 10, 0.005, random);
  const auto dark = record([](double) { return 0.0; }, {}, 10, 0, random);
  const auto noise = record([](double) { return 0.0; }, {}, 10, 0.01, random);
  EXPECT_THAT(refusal(a, dark), HasSubstr("nothing changes in what camera B saw"));
  EXPECT_THAT(refusal(dark, a), HasSubstr("nothing changes in what camera A saw"));
  EXPECT_THAT(refusal(a, noise), HasSubstr("do not show the same change"));
  EXPECT_THAT(refusal(a, record(other, {}, 10, 0.005, random)),
              HasSubstr("do not show the same change"));
  EXPECT_THAT(refusal(a, std::span(a).first(10)), HasSubstr("only 10 frames"));
}

TEST(FindTimeOffset, RefusesALampThatFlashesRegularly) {
  made::Random random(7);
  const auto regular = [](double t) {
    const double cycles = std::floor(t / 0.5);
    return cycles * 0.2 + std::min(t - cycles * 0.5, 0.2);
  };
  const auto a = record(regular, {0.01, 0}, 10, 0.005, random);
  const auto b = record(regular, {0.03, 0.1}, 10, 0.005, random);
  EXPECT_THAT(refusal(a, b), HasSubstr("repeats itself every"));
  const TimeOffset near = find_time_offset(a, b, {.largest_s = 0.2});
  EXPECT_NEAR(near.offset_s, 0.1, 5e-3);
}

TEST(FindTimeOffset, RefusesNumbersThatAreNone) {
  made::Random random(8);
  const auto a = record(random_lamp(0.3, random), {}, 10, 0.005, random);
  auto b = a;
  b[3].value = std::nan("");
  EXPECT_THROW(find_time_offset(a, b), std::invalid_argument);
  b = a;
  b[3].time_s = b[2].time_s;
  EXPECT_THROW(find_time_offset(a, b), std::invalid_argument);
  EXPECT_THROW(find_time_offset(a, a, {.largest_s = -1}), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate
