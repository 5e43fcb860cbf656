// Tracks of a moving camera.
#include "calibrate/track.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "tests/made_files.h"

namespace calibrate::track_test {
namespace {

using std::numbers::pi;

// About the set's z by an angle.
Quaternion turn(double angle_rad) {
  return {std::cos(angle_rad / 2), 0, 0, std::sin(angle_rad / 2)};
}

Track made_track() { return {{{1, {0, 0, 1}, turn(0)}, {3, {4, 0, 1}, turn(1)}}}; }

Quaternion random_quaternion(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Quaternion q{normal(random), normal(random), normal(random), normal(random)};
  const double l = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w / l, q.x / l, q.y / l, q.z / l};
}

TEST(QuaternionOf, IsUndoneByRotationOf) {
  std::mt19937 random(1);
  std::vector<Quaternion> quaternions{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  for (int i = 0; i < 200; ++i) quaternions.push_back(random_quaternion(random));
  for (const Quaternion q : quaternions) {
    const Mat3 R = rotation_of(q);
    const Mat3 again = rotation_of(quaternion_of(R));
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(again.m[i], R.m[i], 1e-12);
  }
}

TEST(PoseAt, GivesEachKeyAtItsTime) {
  const Track track = made_track();
  for (const TrackKey& key : track.keys) {
    const TrackedPose at = pose_at(track, key.time_s);
    EXPECT_TRUE(at.inside);
    EXPECT_LE(length(position_of(at.cam_from_set) - key.position), 1e-12);
    const Mat3 R = rotation_of(key.set_from_cam);
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_NEAR(at.cam_from_set.R.transposed().m[i], R.m[i], 1e-12);
    }
  }
}

TEST(PoseAt, MovesAndTurnsAtConstantSpeedBetweenKeys) {
  for (double f = 0; f <= 1; f += 0.125) {
    const TrackedPose at = pose_at(made_track(), 1 + 2 * f);
    EXPECT_LE(length(position_of(at.cam_from_set) - Vec3{4 * f, 0, 1}), 1e-12);
    const Vec3 x_set = at.cam_from_set.R.transposed() * Vec3{1, 0, 0};
    EXPECT_NEAR(std::atan2(x_set.y, x_set.x), f, 1e-12);
  }
}

TEST(PoseAt, TurnsTheShorterWayWhateverTheQuaternionsSign) {
  const Quaternion q = turn(1);
  const Track track{{{0, {}, turn(0)}, {1, {}, {-q.w, -q.x, -q.y, -q.z}}}};
  const Vec3 x_set = pose_at(track, 0.5).cam_from_set.R.transposed() * Vec3{1, 0, 0};
  EXPECT_NEAR(std::atan2(x_set.y, x_set.x), 0.5, 1e-12);
}

TEST(PoseAt, StaysAtTheEndsAndSaysSo) {
  const TrackedPose before = pose_at(made_track(), 0);
  EXPECT_FALSE(before.inside);
  EXPECT_LE(length(position_of(before.cam_from_set) - Vec3{0, 0, 1}), 1e-12);
  const TrackedPose after = pose_at(made_track(), 4);
  EXPECT_FALSE(after.inside);
  EXPECT_LE(length(position_of(after.cam_from_set) - Vec3{4, 0, 1}), 1e-12);
}

TEST(PoseAt, RefusesEmptyTracksAndTimesThatAreNone) {
  EXPECT_THROW(pose_at({}, 0), std::invalid_argument);
  EXPECT_THROW(pose_at(made_track(), std::numeric_limits<double>::quiet_NaN()),
               std::invalid_argument);
}

TEST(WriteTrack, IsUndoneByReadTrack) {
  std::mt19937 random(2);
  Track track;
  for (int i = 0; i < 20; ++i) {
    track.keys.push_back({i / 3.0, {i * 0.1, 1.0 / 7, -2}, random_quaternion(random)});
  }
  const std::string path = made::make_temporary_directory() / "track.csv";
  write_track(path, track);
  const Track read = read_track(path);
  ASSERT_EQ(read.keys.size(), track.keys.size());
  for (std::size_t i = 0; i < track.keys.size(); ++i) {
    EXPECT_EQ(read.keys[i].time_s, track.keys[i].time_s);
    EXPECT_EQ(read.keys[i].position, track.keys[i].position);
    EXPECT_NEAR(read.keys[i].set_from_cam.y, track.keys[i].set_from_cam.y, 1e-15);
  }
}

TEST(ReadTrack, TakesASpreadsheetsByteOrderMark) {
  const std::string path = testing::TempDir() + "marked_track.csv";
  std::ofstream(path) << "\xEF\xBB\xBFtime_s,px,py,pz,qw,qx,qy,qz\r\n0,1,2,3,1,0,0,0\r\n";
  EXPECT_EQ(read_track(path).keys.size(), 1U);
}

TEST(ReadTrack, PassesOverCommentsSpacesAndCarriageReturns) {
  const std::string path = made::make_temporary_directory() / "track.csv";
  std::ofstream(path) << "# from the tracker\r\ntime_s,px,py,pz,qw,qx,qy,qz\r\n\r\n"
                         "0, 1, 2, 3, 1.02, 0, 0, 0\r\n1,1,2,3,+1,0,0,0";
  const Track track = read_track(path);
  ASSERT_EQ(track.keys.size(), 2U);
  EXPECT_EQ(track.keys[0].position, (Vec3{1, 2, 3}));
  EXPECT_EQ(track.keys[0].set_from_cam, (Quaternion{1, 0, 0, 0}));
}

TEST(ReadTrack, RefusesEveryBadFileWithLineAndReason) {
  made::expect_refusals("track_", ".csv",
                        {{"track_empty.csv", ": holds no key"},
                         {"track_header_only.csv", ": holds no key"},
                         {"track_no_header.csv", ":1: the first line must be time_s,px"},
                         {"track_missing_column.csv", ":2: a key has 8 columns"},
                         {"track_extra_column.csv", ":2: a key has 8 columns"},
                         {"track_word.csv", ":2: high is no finite number"},
                         {"track_nan.csv", ":2: nan is no finite number"},
                         {"track_zero_quaternion.csv", ":2: a quaternion of zeros"},
                         {"track_far_away.csv", ":3: a place of -1e+300 m is beyond 1e6 m"},
                         {"track_huge_quaternion.csv", ":2: a quaternion of such length"},
                         {"track_of_angles.csv", ":3: a quaternion of length 80.8"},
                         {"track_time_stands_still.csv", ":3: time 0 does not come after 0"}},
                        read_track);
}

}  // namespace
}  // namespace calibrate::track_test
