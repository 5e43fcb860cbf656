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
#include "tests/calibrate/made_motion.h"

namespace calibrate::time_offset_test {
namespace {

using testing::HasSubstr;

constexpr double frame_s = 0.04;

struct Clocks {
  double begin_s = 0;   // the first frame, on the true clock
  double offset_s = 0;  // of the camera's own
  double frame_s = time_offset_test::frame_s;
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

// A lamp switched at random, on average every `dwell_s`; not at once, but when a clock next beats
// that does so every `beat_s`, if that is above 0.
std::function<double(double)> random_lamp(double dwell_s, made::Random& random, double beat_s = 0) {
  std::vector<double> switched{-10};
  while (switched.back() < 60) {
    double next = switched.back() - dwell_s * std::log(random.uniform(0, 1));
    if (beat_s > 0) next = std::ceil(next / beat_s) * beat_s;
    switched.push_back(next);
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
    auto other = record(motion, b, 10, 0.003, random);
    for (SignalSample& sample : other) sample.value *= 40;  // another unit
    return std::pair(find_time_offset(record(motion, a, 10, 0.003, random), other), offset_s);
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
  EXPECT_LT(chi_square, 2);
  EXPECT_GT(chi_square, 0.2);
}

// Where frames do not lie in step, a wrong guess of the exposures makes the likelihood too sure.
TEST(FindTimeOffset, DoubtsItsGuessOfExposuresAtTwoRates) {
  const Errors errors = errors_of(5, [](made::Random& random) {
    const auto lamp = random_lamp(0.3, random);
    const double offset_s = random.uniform(-0.3, 0.3);
    auto a = record(lamp, {random.uniform(0, 0.04), 0, 0.04, 0.001}, 12, 0.002, random);
    auto b = record(lamp, {random.uniform(0, 0.03), offset_s, 1 / 30.0, 0.001}, 12, 0.002, random);
    for (SignalSample& sample : a) sample.exposure_s = 0;
    for (SignalSample& sample : b) sample.exposure_s = 0;
    return std::pair(find_time_offset(a, b), offset_s);
  });
  EXPECT_LT(errors.rms_s, 0.015);
  EXPECT_LT(errors.chi_square, 1.7);  // a deviation of 1.3
  EXPECT_GT(errors.chi_square, 0.1);
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

// What two cameras see of the middle of a board that is moved by hand.
struct Filmed {
  double rate_b = 30;
  double apart_rad = 60 * made::degree;
  double length_s = 20;
  double missed = 0;  // share of the frames in which it is not found, and of seconds in a row
  double noise_px = 0.05;
  bool fisheye_b = false;
};

std::vector<SeenPoint> film(const std::function<Pose(double)>& set_from_board,
                            const Pose& cam_from_set,
                            const Lens& lens,
                            const Clocks& clocks,
                            const Filmed& filmed,
                            made::Random& random) {
  constexpr Vec3 middle{0.14, 0.08, 0};
  constexpr int moments = 5;  // of an exposure
  std::vector<SeenPoint> points;
  double hidden_until_s = -1;
  for (int i = 0; i * clocks.frame_s < filmed.length_s; ++i) {
    const double t = clocks.begin_s + i * clocks.frame_s;
    Vec2 q{filmed.noise_px * random.normal(), filmed.noise_px * random.normal()};
    for (int k = 0; k < moments; ++k) {
      const double at_s = t + clocks.exposure_s * ((k + 0.5) / moments - 0.5);
      const Vec2 seen = project(lens, cam_from_set * set_from_board(at_s) * middle).value();
      q.x += seen.x / moments;
      q.y += seen.y / moments;
    }
    if (random.uniform(0, 1) < filmed.missed / 30) hidden_until_s = t + random.uniform(0.3, 1);
    if (t < hidden_until_s || random.uniform(0, 1) < filmed.missed) continue;
    points.push_back({t + clocks.offset_s, q});
  }
  return points;
}

Errors errors_of_board(int cases, made::Path path, const Filmed& filmed) {
  const Lens lens{"pinhole", 1000, 562, {900, 900, 499.5, 280.5}};
  const Lens fisheye{"kannala_brandt", 1024, 1024, {331, 331, 513.3, 509.1, -.02, .003}};
  return errors_of(cases, [&](made::Random& random) {
    const auto motion = made::hand_motion(path, random);
    const double offset_s = random.uniform(-2, 2);
    const Clocks a{random.uniform(0, frame_s), 0, frame_s, 0.01};
    const Clocks b{random.uniform(0, frame_s), offset_s, 1 / filmed.rate_b, 0.016};
    return std::pair(find_time_offset(film(motion, made::camera_around(-filmed.apart_rad / 2), lens,
                                           a, filmed, random),
                                      film(motion, made::camera_around(filmed.apart_rad / 2),
                                           filmed.fisheye_b ? fisheye : lens, b, filmed, random)),
                     offset_s);
  });
}

constexpr int board_cases = PLATELIGHT_FULL_TESTS ? 100 : 8;
// What so few cases may have by chance.
constexpr double most_chi_square = PLATELIGHT_FULL_TESTS ? 2.5 : 5;

TEST(FindTimeOffset, IsRightToAFractionOfAMillisecondForABoardThatIsMovedInAnyWay) {
  for (const auto path :
       {made::Path::line, made::Path::plane, made::Path::space, made::Path::circle}) {
    const Errors errors = errors_of_board(board_cases, path, {});
    RecordProperty("rms_us_" + std::to_string(static_cast<int>(path)),
                   static_cast<int>(1e6 * errors.rms_s));
    EXPECT_LT(errors.rms_s, 1.5e-4) << static_cast<int>(path);
    EXPECT_LT(errors.chi_square, most_chi_square) << static_cast<int>(path);
    EXPECT_GT(errors.chi_square, 0.1) << static_cast<int>(path);
  }
}

TEST(FindTimeOffset, IsRightToHalfAMillisecondForABoardWhateverTheCameras) {
  const std::vector<Filmed> all{{.rate_b = 25},
                                {.missed = 0.3},
                                {.rate_b = 25, .missed = 0.3},
                                {.length_s = 10, .missed = 0.1},
                                {.noise_px = 0.5},
                                {.fisheye_b = true},
                                {.apart_rad = 90 * made::degree, .missed = 0.1, .fisheye_b = true}};
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const auto path : {made::Path::line, made::Path::space, made::Path::circle}) {
      const Errors errors = errors_of_board(board_cases, path, all[i]);
      EXPECT_LT(errors.rms_s, 5e-4) << i << ' ' << static_cast<int>(path);
      EXPECT_LT(errors.chi_square, most_chi_square) << i << ' ' << static_cast<int>(path);
    }
  }
}

TEST(FindTimeOffset, IsRightToAMillisecondForCamerasThatFaceEachOther) {
  const Errors errors =
      errors_of_board(board_cases, made::Path::space, {.apart_rad = 150 * made::degree});
  EXPECT_LT(errors.rms_s, 1e-3);
  EXPECT_LT(errors.chi_square, most_chi_square);
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

// An LED wall on the cameras' genlock.
TEST(FindTimeOffset, TellsOfALampInStepWithTheFrames) {
  for (const bool in_step : {false, true}) {
    made::Random random(9);
    const auto lamp = random_lamp(0.3, random, in_step ? frame_s : 0);
    const Clocks a{0.003, 0, frame_s, 0.02}, b{0.016, 0.5, frame_s, 0.036};
    const TimeOffset found =
        find_time_offset(record(lamp, a, 20, 0.005, random), record(lamp, b, 20, 0.005, random));
    EXPECT_EQ(found.in_step, in_step);
    EXPECT_GT(found.edges, 10U);
    EXPECT_NEAR(found.offset_s, 0.5, 1e-3);
  }
  // Of a dim lamp only moments in the middle of an exposure are told.
  for (unsigned seed = 0; seed < 20; ++seed) {
    made::Random random(seed);
    const auto dim = record(random_lamp(0.3, random), {0.003, 0, frame_s, 0.036}, 20, 0.04, random);
    EXPECT_FALSE(are_in_step(find_edges(dim))) << seed;
  }
}

template <class Seen>
std::string refusal(const Seen& a, const Seen& b, const TimeOffsetOptions& options = {}) {
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
  EXPECT_THAT(refusal(a, {a.begin(), a.begin() + 10}), HasSubstr("only 10 frames"));
}

TEST(FindTimeOffset, RefusesMotionsThatAreNotOneOrRepeatThemselves) {
  const Lens lens{"pinhole", 1000, 562, {900, 900, 499.5, 280.5}};
  const auto seen = [&](const std::function<Pose(double)>& motion, double angle_rad,
                        made::Random& random) {
    return film(motion, made::camera_around(angle_rad), lens, {random.uniform(0, frame_s)}, {},
                random);
  };
  for (unsigned seed = 0; seed < 8; ++seed) {
    made::Random random(seed);
    const auto one = made::hand_motion(made::Path::space, random);
    const auto other = made::hand_motion(made::Path::space, random);
    EXPECT_NE(refusal(seen(one, -0.5, random), seen(other, 0.5, random)), "accepted") << seed;
  }
  made::Random random(9);
  const auto swing = [](double t) {
    return Pose{{{1, 0, 0, 0, 0, 1, 0, -1, 0}},
                {0.3 * std::sin(5 * t), 0, 1 + 0.1 * std::cos(5 * t)}};
  };
  EXPECT_THAT(refusal(seen(swing, -0.5, random), seen(swing, 0.5, random)),
              HasSubstr("repeats itself every"));
  const auto still = [](double) { return Pose{{{1, 0, 0, 0, 0, 1, 0, -1, 0}}, {0, 0, 1}}; };
  EXPECT_THAT(refusal(seen(still, -0.5, random), seen(still, 0.5, random)),
              HasSubstr("do not show the same motion"));
}

TEST(FindTimeOffset, DoubtsALampThatIsSwitchedAFewTimes) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    made::Random random(seed);
    std::vector<double> switched;
    for (int i = 0; i < 6; ++i) switched.push_back(0.5 + 14 * (i + random.uniform(0.15, 0.85)) / 6);
    const auto lamp = [&](double t) {
      double on_s = 0;
      for (std::size_t k = 0; k < switched.size(); k += 2) {
        on_s += std::clamp(t, switched[k], switched[k + 1]) - switched[k];
      }
      return on_s;
    };
    const auto a = record(lamp, {random.uniform(0, frame_s), 0}, 15, 0.003, random);
    const auto b = record(lamp, {random.uniform(0, frame_s), 0.0137}, 15, 0.003, random);
    try {
      const TimeOffset found = find_time_offset(a, b, {.largest_s = 2});
      EXPECT_GE(found.sigma_s, frame_s / 6 - 1e-9) << seed;
      EXPECT_LT(std::abs(found.offset_s - 0.0137), 4 * found.sigma_s) << seed;
    } catch (const std::runtime_error&) {  // as well
    }
  }
}

TEST(FindTimeOffset, RefusesWhatHasFewFramesInCommon) {
  made::Random random(2);
  const auto lamp = random_lamp(0.15, random);
  const auto a = record(lamp, {0, 0}, 1, 0.002, random);
  const auto b = record(lamp, {0.4, 0}, 1, 0.002, random);  // 15 of 25 frames
  EXPECT_NE(refusal(a, b, {.largest_s = 0.1}), "accepted");
}

TEST(FindTimeOffset, RefusesAnOffsetBeyondTheLargest) {
  made::Random random(10);
  const auto lamp = random_lamp(0.3, random);
  const auto a = record(lamp, {0, 0}, 10, 0.002, random);
  const auto b = record(lamp, {0, 0.06}, 10, 0.002, random);
  EXPECT_NEAR(find_time_offset(a, b, {.largest_s = 0.1}).offset_s, 0.06, 0.005);
  EXPECT_NE(refusal(a, b, {.largest_s = 0.03}), "accepted");
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

TEST(FindTimeOffset, RefusesATimeThatIsFarFromAllOthers) {
  made::Random random(9);
  const auto a = record(random_lamp(0.3, random), {}, 10, 0.005, random);
  auto b = a;
  b.back().time_s = 1e12;
  EXPECT_THAT(refusal(a, b), HasSubstr("more than an hour"));
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
}  // namespace calibrate::time_offset_test
