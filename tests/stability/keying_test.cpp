// Keying, pushed past its edge: what leaves is always a picture, and confidence falls first.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "compositing/key_error.h"
#include "compositing/keyer.h"
#include "compositing/made_clip.h"

namespace compositing::keying_stability_test {
namespace {

using capture::Image;

constexpr int height = 135, width = 240;

CleanPlate plate_of(const MadeClip& clip) {
  std::vector<Image> shots;
  for (int i = 0; i < 4; ++i) shots.push_back(light_of(clip.plate_shot(i)));
  return average_plate(shots);
}

struct Outcome {
  KeyReport report;
  double error = 0;  // mean of the composite's
};

// Keys some frames; every value that leaves must be one of a picture.
Outcome key_frames(Keyer& keyer,
                   const MadeClip& clip,
                   const std::function<void(Image&)>& change = {},
                   int frames = 3) {
  Outcome outcome;
  KeyErrorSum errors;
  capture::HalfImage half;
  for (int i = 0; i < frames; ++i) {
    const MadeFrame made = clip.frame(i);
    Image seen = light_of(made.seen);
    if (change) change(seen);
    outcome.report = keyer.key(seen, half);
    const Image keyed = to_float(half);
    for (std::size_t p = 0; p < keyed.pixels.size(); ++p) {
      const float value = keyed.pixels[p];
      EXPECT_TRUE(value >= 0 && value <= capture::half_max) << p << ": " << value;
      EXPECT_TRUE(p % 4 != 3 || value <= 1) << p << ": " << value;
      if (!(value >= 0 && value <= capture::half_max)) return outcome;
    }
    EXPECT_TRUE(outcome.report.confidence >= 0 && outcome.report.confidence <= 1);
    errors.add(keyed, made.truth, make_new_background(keyed.height, keyed.width));
  }
  outcome.error = errors.mean().composite;
  return outcome;
}

TEST(Keying, GivesAPictureOfAnyPlateAndKnowsWhenItShowsNoScreen) {
  const MadeClip clip(made_scene("plain"), 3, height, width);
  for (const float level : {0.0F, 1e-4F, 0.5F, 1.0F, 100.0F}) {
    CleanPlate plate = plate_of(clip);
    std::fill(plate.light.pixels.begin(), plate.light.pixels.end(), level);
    Keyer keyer(plate, {});
    const Outcome outcome = key_frames(keyer, clip);
    EXPECT_EQ(outcome.report.status, KeyStatus::no_screen) << level;
    EXPECT_EQ(outcome.report.confidence, 0) << level;
  }
}

TEST(Keying, GivesAPictureOfFramesThatAreNoNumbers) {
  const MadeClip clip(made_scene("plain"), 3, height, width);
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity(), -5.0F, 1e30F, 1e-40F}) {
    for (const std::size_t every : {std::size_t{1}, std::size_t{7}, std::size_t{64}}) {
      Keyer keyer(plate_of(clip), {});
      key_frames(keyer, clip, [&](Image& seen) {
        for (std::size_t i = 0; i < seen.pixels.size(); i += every) seen.pixels[i] = bad;
      });
    }
  }
}

TEST(Keying, GivesAPictureOfPlatesAndSettingsAtTheirEnds) {
  const MadeClip clip(made_scene("studio"), 3, 61, 93);  // odd, so that chroma is cut
  for (const bool learned : {false, true}) {
    for (const float edge : {-1.0F, 1.0F}) {
      for (const KeyMethod method : {KeyMethod::screen, KeyMethod::difference}) {
        KeySettings settings;
        settings.method = method, settings.learned = learned, settings.edge = edge;
        settings.screen = 0.9F, settings.core = 0.91F, settings.smoothing = 4;
        CleanPlate plate = plate_of(clip);
        plate.light.pixels[7] = std::numeric_limits<float>::quiet_NaN();
        Keyer keyer(plate, settings);
        key_frames(keyer, clip);
      }
    }
  }
}

TEST(Keying, StandsAShiftedPlateAndALampThatFlickers) {
  MadeScene scene = made_scene("wrinkled");
  const MadeClip clip(scene, 3, height, width);
  const CleanPlate plate = plate_of(clip);
  double worst = 0;
  for (int shift = 0; shift <= 8; shift += 2) {
    CleanPlate moved = plate;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 3; ++c) {
          moved.light.at(y, x, c) = plate.light.at(y, std::min(x + shift, width - 1), c);
        }
      }
    }
    Keyer keyer(moved, {});
    worst = std::max(worst, key_frames(keyer, clip).error);
  }
  EXPECT_LT(worst, 1.0);
  for (const float gain : {0.5F, 0.8F, 1.3F}) {
    Keyer keyer(plate, {});
    const Outcome outcome = key_frames(keyer, clip, [&](Image& seen) {
      for (float& value : seen.pixels) value *= gain;
    });
    EXPECT_GT(outcome.report.confidence, 0.5F) << gain;
  }
}

TEST(Keying, LosesConfidenceBeforeThePictureAsTheScreenIsHidden) {
  const MadeClip clip(made_scene("plain"), 3, height, width);
  float before = 1;
  for (int covered = 0; covered <= 100; covered += 20) {
    Keyer keyer(plate_of(clip), {});
    const Outcome outcome = key_frames(keyer, clip, [&](Image& seen) {
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width * covered / 100; ++x) {
          for (int c = 0; c < 3; ++c) seen.at(y, x, c) = 0.3F - 0.05F * static_cast<float>(c);
        }
      }
    });
    EXPECT_LE(outcome.report.confidence, before + 0.01F) << covered;
    before = outcome.report.confidence;
  }
  EXPECT_EQ(before, 0);
  Keyer keyer(plate_of(clip), {});
  const Outcome empty =
      key_frames(keyer, clip, [&](Image& seen) { seen = light_of(clip.plate_shot(9)); });
  EXPECT_GT(empty.report.confidence, 0.9F);  // nobody there is no fault
}

// Sweeps a stressor from where it does no harm to past the edge. Confidence must have fallen where
// the error has trebled, and the key be unsure where it is five times as great, or unfit for show.
void sweep(const char* name,
           const std::vector<float>& values,
           const std::function<void(MadeScene&, float)>& set) {
  constexpr double unfit = 2;  // as KeyError::composite
  bool failed_somewhere = false;
  double unstressed = 0;
  for (const float value : values) {
    MadeScene scene = made_scene("plain");
    set(scene, value);
    const MadeClip clip(scene, 3, height, width);
    Keyer keyer(plate_of(clip), {});
    const Outcome outcome = key_frames(keyer, clip);
    testing::Test::RecordProperty(
        std::string(name) + std::to_string(value),
        std::to_string(outcome.error) + " at " + std::to_string(outcome.report.confidence));
    if (value == values.front()) unstressed = outcome.error;
    const float confidence = outcome.report.confidence;
    const std::string what = name + (" " + std::to_string(value)) + ": dE " +
                             std::to_string(outcome.error) + " at " + std::to_string(confidence);
    if (outcome.error >= 3 * unstressed) {
      EXPECT_LT(confidence, 1) << what;
    }
    if (outcome.error >= std::min(unfit, 5 * unstressed)) {
      EXPECT_TRUE(is_unsure(confidence)) << what;
    }
    // A key that is never sure is none.
    if (value == values.front()) {
      EXPECT_LT(outcome.error, unfit / 2) << name << " " << value;
      EXPECT_GT(confidence, 0.9F) << what;
    }
    failed_somewhere = failed_somewhere || outcome.error >= unfit;
  }
  EXPECT_TRUE(failed_somewhere) << name << ": the sweep must go past the edge";
}

TEST(Keying, LosesConfidenceBeforeThePictureAsNoiseGrows) {
  sweep("noise", {1e-4F, 1e-3F, 4e-3F, 0.016F, 0.064F},
        [](MadeScene& s, float v) { s.noise_gain = v; });
}

TEST(Keying, LosesConfidenceBeforeThePictureAsGreenClips) {
  sweep("light", {1, 2, 3, 5, 8, 16}, [](MadeScene& s, float v) { s.light = v; });
}

TEST(Keying, LosesConfidenceBeforeThePictureAsTheScreenFades) {
  sweep("light", {1, 0.3F, 0.1F, 0.03F, 0.01F}, [](MadeScene& s, float v) { s.light = v; });
}

TEST(Keying, LosesConfidenceBeforeThePictureAsAShadowDeepens) {
  sweep("shadow", {0, 0.4F, 0.6F, 0.8F, 0.9F, 0.95F}, [](MadeScene& s, float v) { s.shadow = v; });
}

TEST(Keying, SaysThatAShadowIsTooDeep) {
  for (const float shadow : {0.0F, 0.6F, 0.8F, 0.9F}) {
    MadeScene scene = made_scene("plain");
    scene.shadow = shadow;
    const MadeClip clip(scene, 3, height, width);
    Keyer keyer(plate_of(clip), {});
    capture::HalfImage keyed;
    const KeyReport report = keyer.key(light_of(clip.frame(5).seen), keyed);
    EXPECT_EQ(report.confidence<0.5F, shadow> 0.7F) << shadow << " " << report.confidence;
    if (shadow > 0.7F) {
      EXPECT_EQ(report.status, KeyStatus::shadowed) << shadow;
    }
  }
}

TEST(Keying, KeepsDarkHairBeforeAShadowedScreen) {
  for (const float shadow : {0.2F, 0.4F, 0.6F}) {
    MadeScene scene = made_scene("black hair");
    scene.shadow = shadow;
    const MadeClip clip(scene, 3, height, width);
    Keyer keyer(plate_of(clip), {});
    EXPECT_LT(key_frames(keyer, clip).error, 1.0) << shadow;
  }
}

TEST(Keying, KeysTwoPersonsWhoCross) {
  const MadeScene& scene = made_scene("walking");
  const MadeClip clip(scene, 3, height, width);
  Keyer keyer(plate_of(clip), {});
  capture::HalfImage half;
  for (int i = 0; i < 30; i += 3) {
    const MadeFrame a = clip.frame(i);
    Image seen = light_of(a.seen);
    // The second is the first in a mirror; where both are, the brighter stands in front.
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        if (a.truth.at(y, width - 1 - x, 3) < 0.99F) continue;
        for (int c = 0; c < 3; ++c) seen.at(y, x, c) = a.truth.at(y, width - 1 - x, c);
      }
    }
    keyer.key(seen, half);
    const Image keyed = to_float(half);
    double holes = 0, core = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        if (a.truth.at(y, x, 3) < 0.999F && a.truth.at(y, width - 1 - x, 3) < 0.999F) continue;
        holes += 1 - keyed.at(y, x, 3), core += 1;
      }
    }
    EXPECT_LT(holes / core, 0.02) << i;
  }
}

}  // namespace
}  // namespace compositing::keying_stability_test
