// Sound laid by its times: whole tracks, holes, overlaps, damaged times.
#include "compositing/sound_track.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <stdexcept>

namespace compositing::sound_track_test {
namespace {

using std::chrono::milliseconds;

constexpr int rate = 48000;
constexpr capture::Time far_ahead = std::chrono::hours(1);

// A chunk of a ramp: sample n of the source has value n.
capture::Sound ramp(std::int64_t first, std::int64_t count, int channels = 1) {
  capture::Sound sound{capture::time_of_frame(first, {rate, 1}), channels, rate, {}};
  for (std::int64_t n = first; n < first + count; ++n) {
    sound.samples.insert(sound.samples.end(), static_cast<std::size_t>(channels),
                         static_cast<float>(n));
  }
  return sound;
}

void append(std::vector<float>& track, const std::optional<LaidSound>& laid, int channels = 1) {
  ASSERT_TRUE(laid.has_value());
  track.insert(track.end(), static_cast<std::size_t>(laid->silence * channels), 0.0F);
  track.insert(track.end(), laid->samples.begin(), laid->samples.end());
}

TEST(SoundTrack, LaysChunksOfAnySizeWithoutSeams) {
  std::mt19937 random(5);
  std::uniform_int_distribution<std::int64_t> size(0, 3000);
  SoundTrack sound(2, rate);
  std::vector<float> track;
  for (std::int64_t first = 0; first < 100000;) {
    const std::int64_t count = size(random);
    append(track, sound.lay(ramp(first, count, 2), milliseconds(0), far_ahead), 2);
    first += count;
  }
  ASSERT_EQ(static_cast<std::int64_t>(track.size()), sound.length() * 2);
  for (std::size_t n = 0; n < track.size(); ++n) ASSERT_EQ(track[n], static_cast<float>(n / 2));
}

TEST(SoundTrack, FillsHolesWithSilenceAndLeavesOutWhatWasThere) {
  SoundTrack sound(1, rate);
  std::vector<float> track;
  append(track, sound.lay(ramp(4800, 4800), milliseconds(0), far_ahead));
  append(track, sound.lay(ramp(4800, 4800), milliseconds(0), far_ahead));   // again
  append(track, sound.lay(ramp(7200, 4800), milliseconds(0), far_ahead));   // half new
  append(track, sound.lay(ramp(24000, 4800), milliseconds(0), far_ahead));  // after a hole
  ASSERT_EQ(track.size(), 28800U);
  for (std::size_t n = 0; n < track.size(); ++n) {
    const bool silent = n < 4800 || (n >= 12000 && n < 24000);
    ASSERT_EQ(track[n], silent ? 0.0F : static_cast<float>(n)) << n;
  }
}

TEST(SoundTrack, LeavesOutWhatLiesBeforeTheStart) {
  SoundTrack sound(1, rate);
  std::vector<float> track;
  const capture::Time start = milliseconds(150);  // sample 7200
  append(track, sound.lay(ramp(0, 4800), start, far_ahead));
  append(track, sound.lay(ramp(4800, 4800), start, far_ahead));
  ASSERT_EQ(track.size(), 2400U);
  EXPECT_EQ(track.front(), 7200.0F);
}

TEST(SoundTrack, TakesSmallShiftsForRounding) {
  SoundTrack sound(1, rate);
  std::vector<float> track;
  append(track, sound.lay(ramp(0, 4800), milliseconds(0), far_ahead));
  capture::Sound late = ramp(4800, 4800);
  late.time += milliseconds(4);
  append(track, sound.lay(late, milliseconds(0), far_ahead));
  ASSERT_EQ(track.size(), 9600U);
  EXPECT_EQ(track[4800], 4800.0F);
}

TEST(SoundTrack, LeavesOutChunksOfAnotherFormOrADamagedTime) {
  SoundTrack sound(1, rate);
  capture::Sound chunk = ramp(0, 10, 2);
  EXPECT_FALSE(sound.lay(chunk, milliseconds(0), far_ahead));
  chunk = ramp(0, 10);
  chunk.rate = 44100;
  EXPECT_FALSE(sound.lay(chunk, milliseconds(0), far_ahead));
  chunk = ramp(0, 10);
  chunk.time = capture::Time::max();
  EXPECT_FALSE(sound.lay(chunk, milliseconds(0), far_ahead));
  chunk.time = capture::Time::min();
  const std::optional<LaidSound> laid = sound.lay(chunk, capture::Time::max(), far_ahead);
  ASSERT_TRUE(laid);
  EXPECT_TRUE(laid->samples.empty());
  EXPECT_EQ(sound.length(), 0);
}

TEST(SoundTrack, RefusesNoChannelsAndNoRate) {
  EXPECT_THROW(SoundTrack(0, rate), std::invalid_argument);
  EXPECT_THROW(SoundTrack(1, 0), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::sound_track_test
