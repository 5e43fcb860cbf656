// Merges of made brackets by what the program itself calibrated: error in stops over their range.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "capture/camera_response.h"
#include "capture/live_merge.h"
#include "capture/made_sensor.h"
#include "capture/make_hdr.h"
#include "capture/photon_transfer.h"
#include "capture/response.h"
#include "tests/capture/made_bracket.h"

namespace capture::own_response_test {
namespace {

// Patches evenly over `stops` below `brightest`, each of a slight ramp.
Image patches(int side, double brightest, double stops, unsigned seed) {
  constexpr int patch = 8;
  Image image = make_image(side, side);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> level(-stops, -0.15);
  std::uniform_real_distribution<double> tint(0, 0.15);
  for (int y0 = 0; y0 < side; y0 += patch) {
    for (int x0 = 0; x0 < side; x0 += patch) {
      const double grey = level(random);
      for (int c = 0; c < 3; ++c) {
        const double value = brightest * std::exp2(grey + tint(random));
        for (int y = y0; y < std::min(side, y0 + patch); ++y) {
          for (int x = x0; x < std::min(side, x0 + patch); ++x) {
            image.at(y, x, c) = static_cast<float>(value * (1 - 0.05 * (x - x0) / patch));
          }
        }
      }
    }
  }
  return image;
}

// RMS of log2(merged / truth) about its median: the unit of radiance is the sensor's own.
double error_stops(const Image& merged, const Image& truth) {
  std::vector<double> logs;
  for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
    logs.push_back(std::log2(std::max(1e-12, static_cast<double>(merged.pixels[i])) /
                             static_cast<double>(truth.pixels[i])));
  }
  std::vector<double> sorted = logs;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  double squares = 0;
  for (const double log : logs) squares += (log - *middle) * (log - *middle);
  return std::sqrt(squares / static_cast<double>(logs.size()));
}

TEST(OwnResponse, MergesAStillBracketOf20StopsTo3HundredthsOfAStop) {
  // 13 s to 1/5000 s in steps of two stops; the codes of a camera with a film's curve.
  const auto light_of_code = [](double z) {
    return 0.08 * z + 0.25 * z * z + 0.1 * z * z * z + 0.57 * std::pow(z, 5);
  };
  std::vector<double> exposures_s;
  for (double t = 13; t > 1.0 / 5100; t /= 4) exposures_s.push_back(t);
  exposures_s.back() = 1.0 / 5000;
  const Image truth = patches(320, 0.9 * 5000, 20.4, 1);
  const made::Scene scene{truth.width, truth.height, {truth.pixels.begin(), truth.pixels.end()}};
  std::vector<CodedShot> shots;
  for (std::size_t i = 0; i < exposures_s.size(); ++i) {
    shots.push_back(
        {made::photograph(scene, exposures_s[i], light_of_code, static_cast<unsigned>(i + 1)),
         exposures_s[i]});
  }
  const ResponseFit fit = recover_response(shots);
  MergeTables tables({response_code_table(fit.response, 0), response_code_table(fit.response, 1),
                      response_code_table(fit.response, 2)},
                     static_cast<int>(shots.size()));
  tables.set_exposures(fit.exposures_s);
  std::vector<const std::uint8_t*> codes;
  for (const CodedShot& shot : shots) codes.push_back(shot.still.texels.data());
  Image merged = make_image(truth.height, truth.width);
  tables.merge(codes, truth.width, 0, truth.height, merged.pixels.data());
  const double error = error_stops(merged, truth);
  const double stops = range_stops(merged);
  std::printf("still bracket: %s, %.1f stops, error %.4f stops\n", fit.response.name.c_str(), stops,
              error);
  EXPECT_GE(stops, 20);
  EXPECT_LE(error, 0.03);
}

TEST(OwnResponse, MergesALiveBracketOf14StopsTo3HundredthsOfAStop) {
  // 20 us to 16 ms, five exposures at 60 fps, 12 bit, calibrated from a few seconds of the same.
  MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 4, .bits = 12, .pedestal = 64};
  const double shortest_s = 20e-6;
  sensor.saturation = shortest_s;  // radiance 1 fills the well in the shortest exposure
  const Image truth = patches(320, 0.9, 14.4, 2);
  const auto codes_at = [&](double exposure_s, std::uint64_t shot) {
    return expose(sensor, truth, exposure_s, shot);
  };
  std::vector<double> exposures_s;
  for (int i = 0; i < 5; ++i) exposures_s.push_back(shortest_s * std::pow(800, i / 4.0));
  std::vector<MadeShot> calibrating;
  std::vector<SensorShot> sensor_shots;
  for (std::uint64_t i = 0; i < 15; ++i) calibrating.push_back(codes_at(exposures_s[i % 5], i));
  for (std::size_t i = 0; i < calibrating.size(); ++i) {
    sensor_shots.push_back({truth.width, truth.height, 3, BayerPattern::none, calibrating[i].codes,
                            exposures_s[i % 5]});
  }
  const PhotonTransfer transfer = measure_photon_transfer(sensor_shots, 12);
  // As a camera with this response reads its pictures, and the show merges them.
  const double full_code = 4095;
  const CameraResponse response = response_of(transfer, full_code);
  std::vector<Image> light;
  for (std::size_t i = 0; i < exposures_s.size(); ++i) {
    const MadeShot shot = codes_at(exposures_s[i], 100 + i);
    light.push_back(make_image(truth.height, truth.width));
    for (std::size_t k = 0; k < shot.codes.size(); ++k) {
      light.back().pixels[k] =
          static_cast<float>(response.light(static_cast<int>(k % 3), shot.codes[k] / full_code));
    }
  }
  std::vector<LiveShot> shots;
  for (std::size_t i = 0; i < light.size(); ++i) shots.push_back({&light[i], exposures_s[i]});
  MergedFrame frame;
  merge_window(shots, {.noise = response.linear->noise}, frame);
  const double error = error_stops(frame.radiance, truth);
  const double stops = range_stops(frame.radiance);
  std::printf("live bracket: %.1f stops, error %.4f stops\n", stops, error);
  EXPECT_GE(stops, 14);
  EXPECT_LE(error, 0.03);
  // The deviation that is told by the calibrated noise covers the truth.
  const Image deviation = frame.deviation();
  std::size_t within = 0;
  for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
    const double off = static_cast<double>(frame.radiance.pixels[i]) * shortest_s -
                       static_cast<double>(truth.pixels[i]);
    if (std::abs(off) < static_cast<double>(deviation.pixels[i]) * shortest_s) ++within;
  }
  EXPECT_NEAR(static_cast<double>(within) / static_cast<double>(truth.pixels.size()), 0.68, 0.05);
}

}  // namespace
}  // namespace capture::own_response_test
