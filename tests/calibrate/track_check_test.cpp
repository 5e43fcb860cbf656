// What is hardly what a camera did is told, and nothing of what it may well have done.
#include "calibrate/track_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <random>

#include "calibrate/pose.h"

namespace calibrate::track_check_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double rate = 50;

// A camera that stands, sets out after two seconds, and pans while it goes on.
Track walk(int keys) {
  Track track;
  for (int i = 0; i < keys; ++i) {
    const double t = i / rate, on = std::max(t - 2, 0.0);
    const Vec3 at{1.5 * on, -8, 1.7 + 0.02 * std::sin(9 * t)};
    const Pose pose = look_at(at, at + Vec3{std::sin(0.8 * on), std::cos(0.8 * on), 0}, 0);
    track.keys.push_back({t, at, quaternion_of(pose.R.transposed())});
  }
  return track;
}

TEST(TrackDoubts, AreNoneOfACameraThatSetsOutAndPans) {
  EXPECT_THAT(doubts_of(walk(300)), IsEmpty());
  EXPECT_THAT(doubts_of(walk(1)), IsEmpty());
  Track by_hand{
      {{0, {0, -8, 2}, {0.7071, -0.7071, 0, 0}}, {9, {4, -8, 2}, {0.7071, -0.7071, 0, 0}}}};
  EXPECT_THAT(doubts_of(by_hand), IsEmpty());
}

// Stamps by arrival, and one packet in fifty late.
TEST(TrackDoubts, AreNoneOfStampsThatComeUnevenly) {
  Track track = walk(500);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> jitter(-0.45 / rate, 0.45 / rate);
  for (TrackKey& key : track.keys) key.time_s += jitter(random);
  for (std::size_t i = 150; i < 500; i += 50) {
    track.keys[i].time_s = track.keys[i + 1].time_s - 0.02 / rate;
  }
  EXPECT_THAT(doubts_of(track), IsEmpty());
}

TEST(TrackDoubts, TellPosesThatAreRepeated) {
  Track track = walk(500);
  for (std::size_t i = 0; i < 500; ++i) track.keys[i].position = track.keys[i / 6 * 6].position;
  for (std::size_t i = 0; i < 500; ++i) track.keys[i].position.x *= 4;
  EXPECT_THAT(doubts_of(track), ElementsAre(HasSubstr("of fewer moments than it has keys")));
}

TEST(TrackDoubts, TellStretchesWithoutKeys) {
  Track track = walk(300);
  track.keys.erase(track.keys.begin() + 150, track.keys.begin() + 200);
  track.keys.erase(track.keys.begin() + 20, track.keys.begin() + 60);  // where it stands
  EXPECT_THAT(doubts_of(track),
              ElementsAre(HasSubstr("no key from 2.980 to 4.000 s, and is interpolated there")));
}

TEST(TrackDoubts, TellJumpsOfPlaceAndOfDirection) {
  Track one_off = walk(300);
  one_off.keys[120].position.y += 0.4;
  EXPECT_THAT(doubts_of(one_off),
              ElementsAre(AllOf(HasSubstr("it jumps in 2 steps, first from 2.380 to 2.400 s"),
                                HasSubstr("by 0.401 m"))));
  Track elsewhere = walk(300);
  for (std::size_t i = 60; i < 300; ++i) elsewhere.keys[i].position.x += 0.5;
  EXPECT_THAT(doubts_of(elsewhere), ElementsAre(HasSubstr("it jumps from 1.180 to 1.200 s")));
  Track turned = walk(300);
  for (std::size_t i = 60; i < 300; ++i) {
    const Pose other = look_at({}, {0.4, 1, 0}, 0);
    turned.keys[i].set_from_cam = quaternion_of(other.R.transposed());
  }
  EXPECT_THAT(doubts_of(turned), ElementsAre(HasSubstr("and 21.8 degrees")));
}

TEST(TrackDoubts, TellOtherUnitsAndAxes) {
  Track milliseconds = walk(300), frames = walk(300), millimetres = walk(300), y_up = walk(300);
  for (TrackKey& key : milliseconds.keys) key.time_s *= 1000;
  for (std::size_t i = 0; i < 300; ++i) frames.keys[i].time_s = static_cast<double>(i);
  for (TrackKey& key : millimetres.keys) key.position = key.position * 1000.0;
  // As a camera whose y is up, which looks along -z, has it.
  for (TrackKey& key : y_up.keys) {
    const Quaternion q = key.set_from_cam;
    key.set_from_cam = {-q.x, q.w, q.z, -q.y};  // times i, half a turn about x
  }
  EXPECT_THAT(doubts_of(milliseconds), ElementsAre(HasSubstr("are its times milliseconds?")));
  EXPECT_THAT(doubts_of(frames), ElementsAre(HasSubstr("do its times count frames?")));
  EXPECT_THAT(doubts_of(millimetres), Contains(HasSubstr("are its places in millimetres?")));
  EXPECT_THAT(doubts_of(y_up), ElementsAre(HasSubstr("upside down throughout")));
}

}  // namespace
}  // namespace calibrate::track_check_test
