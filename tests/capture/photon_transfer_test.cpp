// Photon transfer: what made sensors are like, told from their shots, with honest deviations.
#include "capture/photon_transfer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <stdexcept>

#include "capture/camera_response.h"
#include "capture/made_sensor.h"

namespace capture::photon_transfer_test {
namespace {

// Patches over eight stops up to `brightest`, each of a slight ramp and of grain that stays.
Image patches(int width, int height, int channels, double brightest, unsigned seed) {
  constexpr int patch = 16;
  Image image = make_image(height, width, channels);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> stops(-8, 0);
  std::normal_distribution<double> grain(1, 0.02);
  std::vector<double> levels;
  for (int i = 0; i < (width / patch + 1) * (height / patch + 1) * channels; ++i) {
    levels.push_back(brightest * std::exp2(stops(random)));
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        const auto place = static_cast<std::size_t>(
            ((y / patch) * (width / patch + 1) + x / patch) * channels + c);
        const double ramp = 1 + 0.1 * (x % patch) / patch;
        image.at(y, x, c) = static_cast<float>(levels[place] * ramp * grain(random));
      }
    }
  }
  return image;
}

struct Shots {
  std::vector<MadeShot> made;
  std::vector<double> exposures_s;
  BayerPattern pattern = BayerPattern::none;

  std::vector<SensorShot> sensor_shots() const {
    std::vector<SensorShot> shots;
    for (std::size_t i = 0; i < made.size(); ++i) {
      shots.push_back({made[i].width, made[i].height, made[i].channels, pattern, made[i].codes,
                       exposures_s[i]});
    }
    return shots;
  }
};

// `repeats` shots of each exposure; 0 is a dark one.
Shots take(const MadeSensor& sensor,
           const Image& scene,
           const std::vector<double>& exposures_s,
           int repeats = 2,
           double shutter_error = 0) {
  Shots shots;
  std::mt19937 random(static_cast<unsigned>(sensor.seed));
  std::normal_distribution<double> error(0, shutter_error);
  for (const double exposure_s : exposures_s) {
    const double true_s = exposure_s * std::exp(error(random));
    for (int i = 0; i < repeats; ++i) {
      Image seen = scene;
      if (exposure_s == 0) std::fill(seen.pixels.begin(), seen.pixels.end(), 0.0F);
      shots.made.push_back(expose(sensor, seen, exposure_s == 0 ? 1 : true_s, shots.made.size()));
      shots.exposures_s.push_back(exposure_s);
    }
  }
  return shots;
}

const std::vector<double> bracket{1.0 / 64, 1.0 / 16, 1.0 / 4, 1, 2};

double true_gain(const MadeSensor& sensor) {
  return sensor.full_well_e / ((1 << sensor.bits) - 1 - sensor.pedestal);
}

// Electrons of the well at an exposure of 1 s and radiance 1.
std::vector<MadeSensor> sensors() {
  return {{.full_well_e = 20'000, .read_noise_e = 4, .bits = 12, .pedestal = 64},
          {.full_well_e = 10'000, .read_noise_e = 12, .bits = 12, .pedestal = 16},
          {.full_well_e = 60'000, .read_noise_e = 8, .bits = 14, .pedestal = 512},
          {.full_well_e = 30'000, .read_noise_e = 3, .bits = 16, .pedestal = 1024},
          {.full_well_e = 8'000, .read_noise_e = 6, .bits = 10, .pedestal = 32},
          {.full_well_e = 5'000, .read_noise_e = 25, .bits = 8, .pedestal = 8},
          {.full_well_e = 2'000, .read_noise_e = 2, .bits = 12, .pedestal = 240}};
}

// Of a value's deviations, how many lie within one.
class Coverage {
 public:
  void add(const Estimate& estimate, double truth) {
    const double deviations = std::abs(estimate.value - truth) / estimate.sigma;
    ++count_;
    if (deviations < 1) ++within_;
    worst_ = std::max(worst_, deviations);
  }
  double share() const { return static_cast<double>(within_) / count_; }
  double worst() const { return worst_; }

 private:
  int count_ = 0;
  int within_ = 0;
  double worst_ = 0;
};

TEST(MeasurePhotonTransfer, TellsEverySensorWithinItsDeviations) {
  Coverage gain;
  Coverage black;
  Coverage read;
  for (MadeSensor sensor : sensors()) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      sensor.seed = seed;
      const Shots shots = take(sensor, patches(192, 192, 1, 4, seed), bracket, 2, 0.01);
      const PhotonTransfer transfer = measure_photon_transfer(shots.sensor_shots(), sensor.bits);
      ASSERT_EQ(transfer.channels.size(), 1U);
      const ChannelTransfer& channel = transfer.channels[0];
      gain.add(channel.gain, true_gain(sensor));
      black.add(channel.black, sensor.pedestal);
      read.add(channel.read_noise_e, sensor.read_noise_e);
      EXPECT_NEAR(channel.gain.value / true_gain(sensor), 1, 0.1);
      EXPECT_NEAR(channel.black.value, sensor.pedestal, 0.002 * (1 << sensor.bits));
      EXPECT_EQ(channel.saturation, (1 << sensor.bits) - 1);
      EXPECT_TRUE(channel.saturated);
      EXPECT_LT(channel.linearity_error, 0.01);
    }
  }
  for (const auto& [name, coverage] :
       {std::pair{"gain", &gain}, {"black", &black}, {"read noise", &read}}) {
    RecordProperty(name, std::to_string(coverage->share()));
    EXPECT_GT(coverage->share(), 0.55) << name;
    EXPECT_LT(coverage->share(), 0.85) << name;
    EXPECT_LT(coverage->worst(), 5) << name;
  }
}

TEST(MeasurePhotonTransfer, GivesTheMergeItsNoiseModelAndTheResponseItsCodes) {
  const MadeSensor sensor{.full_well_e = 15'000, .read_noise_e = 6, .bits = 12, .pedestal = 100};
  const Shots shots = take(sensor, patches(320, 320, 1, 4, 3), bracket, 3);
  const PhotonTransfer transfer = measure_photon_transfer(shots.sensor_shots(), 12);
  const NoiseModel truth = noise_of(sensor);
  EXPECT_NEAR(transfer.noise().shot / truth.shot, 1, 0.02);
  EXPECT_NEAR(transfer.noise().read / truth.read, 1, 0.05);
  EXPECT_GT(transfer.noise().saturation, 0.9);
  EXPECT_LE(transfer.noise().saturation, 0.98);
  const CameraResponse response = response_of(transfer, 4095);
  EXPECT_NEAR(response.linear->black[2], 100, 0.5);
  EXPECT_EQ(response.linear->white[1], 4095);
  EXPECT_TRUE(transfer.warnings.empty());
}

TEST(MeasurePhotonTransfer, TellsTheColoursOfAMosaicApart) {
  const MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 5, .bits = 12, .pedestal = 64};
  Shots shots = take(sensor, patches(384, 384, 1, 4, 4), bracket);
  shots.pattern = BayerPattern::grbg;
  for (MadeShot& shot : shots.made) {  // red has another black level
    for (int y = 0; y < shot.height; ++y) {
      for (int x = 0; x < shot.width; ++x) {
        auto& code = shot.codes[static_cast<std::size_t>(y * shot.width + x)];
        if (colour_of_site(shots.pattern, y, x) == 0 && code < 4000) code += 30;
      }
    }
  }
  const PhotonTransfer transfer = measure_photon_transfer(shots.sensor_shots(), 12);
  ASSERT_EQ(transfer.channels.size(), 3U);
  EXPECT_NEAR(transfer.channels[0].black.value, 94, 0.5);
  EXPECT_NEAR(transfer.channels[1].black.value, 64, 0.5);
  EXPECT_NEAR(transfer.channels[2].black.value, 64, 0.5);
  EXPECT_LT(transfer.channels[1].gain.sigma, transfer.channels[2].gain.sigma);
}

TEST(MeasurePhotonTransfer, IsContentWithOneExposureAndADarkOne) {
  const MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 10, .bits = 12, .pedestal = 64};
  const Shots shots = take(sensor, patches(256, 256, 3, 0.5, 5), {0, 1});
  const PhotonTransfer transfer = measure_photon_transfer(shots.sensor_shots(), 12);
  for (const ChannelTransfer& channel : transfer.channels) {
    EXPECT_NEAR(channel.black.value, 64, 4 * channel.black.sigma);
    EXPECT_NEAR(channel.gain.value, true_gain(sensor), 4 * channel.gain.sigma);
    EXPECT_NEAR(channel.read_noise_e.value, 10, 4 * channel.read_noise_e.sigma);
    EXPECT_TRUE(std::isnan(channel.linearity_error));
    EXPECT_FALSE(channel.saturated);
  }
  EXPECT_EQ(transfer.warnings.size(), 6U);  // linearity and saturation of each colour are not known
}

TEST(MeasurePhotonTransfer, DoesNotMindFixedPattern) {
  const MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 5, .bits = 12, .pedestal = 64};
  Image scene = patches(256, 256, 1, 4, 6);
  std::mt19937 random(6);
  std::normal_distribution<double> uneven(1, 0.03);
  for (float& value : scene.pixels) value *= static_cast<float>(uneven(random));
  Shots shots = take(sensor, scene, bracket);
  std::vector<std::uint16_t> offsets;
  for (int i = 0; i < 256 * 256; ++i) offsets.push_back(static_cast<std::uint16_t>(random() % 7));
  for (MadeShot& shot : shots.made) {
    for (std::size_t i = 0; i < shot.codes.size(); ++i) {
      if (shot.codes[i] < 4000)
        shot.codes[i] = static_cast<std::uint16_t>(shot.codes[i] + offsets[i]);
    }
  }
  const ChannelTransfer channel = measure_photon_transfer(shots.sensor_shots(), 12).channels[0];
  EXPECT_NEAR(channel.black.value, 67, 4 * channel.black.sigma);
  EXPECT_NEAR(channel.gain.value, true_gain(sensor), 4 * channel.gain.sigma);
  EXPECT_NEAR(channel.read_noise_e.value, 5, 4 * channel.read_noise_e.sigma);
}

TEST(MeasurePhotonTransfer, DoesNotMindWhatMoves) {
  const MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 5, .bits = 12, .pedestal = 64};
  const Image scene = patches(256, 256, 1, 4, 7);
  Shots shots;
  for (const double exposure_s : bracket) {
    for (int i = 0; i < 2; ++i) {
      Image seen = scene;  // something textured passes: an eighth of the width, 70 px high
      const int left = 25 * static_cast<int>(shots.made.size());
      for (int y = 90; y < 160; ++y) {
        for (int x = left; x < std::min(256, left + 32); ++x) {
          seen.at(y, x) = static_cast<float>(0.2 + 0.1 * std::sin(0.7 * x) * std::cos(0.5 * y));
        }
      }
      shots.made.push_back(expose(sensor, seen, exposure_s, shots.made.size()));
      shots.exposures_s.push_back(exposure_s);
    }
  }
  const ChannelTransfer channel = measure_photon_transfer(shots.sensor_shots(), 12).channels[0];
  EXPECT_NEAR(channel.black.value, 64, 1);
  EXPECT_NEAR(channel.gain.value / true_gain(sensor), 1, 0.05);
  EXPECT_NEAR(channel.read_noise_e.value, 5, 0.3);
}

TEST(MeasurePhotonTransfer, FindsAWellThatFillsBelowTheLastCode) {
  const MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 5, .bits = 12, .pedestal = 64};
  Shots shots = take(sensor, patches(256, 256, 1, 4, 8), bracket);
  std::mt19937 random(8);
  std::normal_distribution<double> noise(3400, 2);
  for (MadeShot& shot : shots.made) {
    for (auto& code : shot.codes) {
      if (code > 3400) code = static_cast<std::uint16_t>(std::lround(noise(random)));
    }
  }
  const PhotonTransfer transfer = measure_photon_transfer(shots.sensor_shots(), 12);
  EXPECT_TRUE(transfer.channels[0].saturated);
  EXPECT_NEAR(transfer.channels[0].saturation, 3400, 1);
  EXPECT_LT(transfer.channels[0].usable, 3400);
  EXPECT_GT(transfer.channels[0].usable, 3380);
}

TEST(MeasurePhotonTransfer, TellsWhereASensorBendsBelowSaturation) {
  const MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 5, .bits = 12, .pedestal = 64};
  Shots shots = take(sensor, patches(320, 320, 1, 4, 9), {1.0 / 64, 1.0 / 16, 1.0 / 4, 0.5, 1, 2});
  const double knee = 64 + 0.9 * 4031;
  for (MadeShot& shot : shots.made) {
    for (auto& code : shot.codes) {
      if (code > knee) code = static_cast<std::uint16_t>(knee + (code - knee) / 3);
    }
  }
  const ChannelTransfer channel = measure_photon_transfer(shots.sensor_shots(), 12).channels[0];
  EXPECT_LT(channel.usable, 64 + 0.99 * 4031);
  EXPECT_LT(channel.linearity_error, 0.02);
}

TEST(MeasurePhotonTransfer, AllowsForRoundingThatIsCoarserThanTheNoise) {
  const MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 10, .bits = 8, .pedestal = 4};
  const Shots shots = take(sensor, patches(320, 320, 1, 4, 10), bracket);
  const PhotonTransfer transfer = measure_photon_transfer(shots.sensor_shots(), 8);
  const ChannelTransfer& channel = transfer.channels[0];
  EXPECT_NEAR(channel.gain.value / true_gain(sensor), 1, 0.05);
  EXPECT_NEAR(channel.gain.value, true_gain(sensor), 4 * channel.gain.sigma);
  EXPECT_NEAR(channel.black.value, 4, 0.1);
  EXPECT_LT(channel.read_noise.value, 0.3);  // 0.13 codes, of which rounding leaves little
}

TEST(VarianceBeforeRounding, UndoesRoundingOfAnyNoise) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(0, 1);
  for (const double sigma : {0.1, 0.3, 0.5, 1.0, 3.0}) {
    std::normal_distribution<double> noise(0, sigma);
    double squares = 0;
    constexpr int count = 400'000;
    for (int i = 0; i < count; ++i) {
      const double at = place(random);
      const double difference = std::round(at + noise(random)) - std::round(at + noise(random));
      squares += difference * difference / 2;
    }
    EXPECT_NEAR(variance_before_rounding(squares / count) / (sigma * sigma), 1, 0.03) << sigma;
  }
  EXPECT_EQ(variance_before_rounding(0), 0);
}

template <class Error>
std::string refusal_of(const Shots& shots, int bits) {
  try {
    measure_photon_transfer(shots.sensor_shots(), bits);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(MeasurePhotonTransfer, RefusesCamerasThatAreNotLinear) {
  for (const Transfer transfer : {Transfer::srgb, Transfer::rec1886}) {
    for (const int bits : {8, 12}) {
      const MadeSensor sensor{
          .full_well_e = 5'000, .read_noise_e = 10, .bits = bits, .transfer = transfer};
      const Shots shots = take(sensor, patches(256, 256, 1, 4, 12), bracket);
      EXPECT_NE(refusal_of<NotLinear>(shots, bits).find("response curve"), std::string::npos)
          << bits;
    }
  }
}

TEST(MeasurePhotonTransfer, SaysWhatShotsLack) {
  const MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 4, .bits = 12, .pedestal = 0};
  const Image scene = patches(128, 128, 1, 1, 13);
  const auto expect_words = [](const Shots& shots, const char* words) {
    const std::string message = refusal_of<std::runtime_error>(shots, 12);
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  expect_words(take(sensor, scene, bracket, 1), "no exposure was taken twice");
  expect_words(take(sensor, scene, {1}, 4), "all shots have one exposure");
  expect_words(take(sensor, scene, {1e4, 2e4}), "is saturated");
  expect_words(take(sensor, scene, {1e-6, 2e-6}), "is black");
  expect_words(take(sensor, patches(16, 16, 1, 1, 1), bracket), "too few unclipped sites");
  Image even = make_image(128, 128, 1);
  std::fill(even.pixels.begin(), even.pixels.end(), 0.5F);
  EXPECT_NE(refusal_of<NotLinear>(take(sensor, even, {1, 1.01}, 3), 12), "");
}

// Each place is good at one exposure at most: nothing tells black.
TEST(MeasurePhotonTransfer, RefusesExposuresThatShareNoUnclippedPlace) {
  const MadeSensor sensor{.full_well_e = 20'000, .read_noise_e = 4, .bits = 12, .pedestal = 64};
  const Image scene = patches(160, 160, 1, 0.8, 15);
  const auto refusal_beside = [&](int code, double good_s, double clipped_s) {
    Shots shots = take(sensor, scene, {1, 1});
    for (std::size_t i = 0; i < shots.made.size(); ++i) {
      const bool good = i < 2;
      shots.exposures_s[i] = good ? good_s : clipped_s;
      if (!good) std::ranges::fill(shots.made[i].codes, static_cast<std::uint16_t>(code));
    }
    return refusal_of<std::runtime_error>(shots, 12);
  };
  for (const std::string& message : {refusal_beside(4095, 0.001, 1), refusal_beside(0, 1, 0.001)}) {
    EXPECT_NE(message.find("no place is seen unclipped at two exposures"), std::string::npos)
        << message;
  }
}

TEST(MeasurePhotonTransfer, RefusesShotsThatDoNotFitTogether) {
  const MadeSensor sensor{.bits = 12};
  const Shots shots = take(sensor, patches(64, 64, 1, 1, 14), {0.5, 1});
  const auto expect_refusal = [&](auto change, int bits = 12) {
    std::vector<SensorShot> changed = shots.sensor_shots();
    change(changed);
    EXPECT_THROW(measure_photon_transfer(changed, bits), std::invalid_argument);
  };
  expect_refusal([](auto& s) { s.clear(); });
  expect_refusal([](auto&) {}, 7);
  expect_refusal([](auto&) {}, 17);
  expect_refusal([](auto& s) { s[1].width = 32; });
  expect_refusal([](auto& s) { s[1].codes = s[1].codes.subspan(1); });
  expect_refusal([](auto& s) { s[1].exposure_s = -1; });
  expect_refusal([](auto& s) { s[1].exposure_s = std::nan(""); });
  expect_refusal([](auto& s) { s[1].pattern = BayerPattern::rggb; });
  EXPECT_THROW(measure_photon_transfer(shots.sensor_shots(), 12, 0), std::invalid_argument);
}

}  // namespace
}  // namespace capture::photon_transfer_test
