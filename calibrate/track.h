// Where a moving camera was: poses over time, in a file.
#pragma once

#include <string>
#include <vector>

#include "calibrate/pose.h"

namespace calibrate {

// A rotation as a unit quaternion w + xi + yj + zk.
struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;
  friend bool operator==(const Quaternion&, const Quaternion&) = default;
};

Mat3 rotation_of(Quaternion unit);
Quaternion quaternion_of(const Mat3& rotation);

// The camera at one instant.
struct TrackKey {
  double time_s = 0;
  Vec3 position;            // of the camera, in the set, metres
  Quaternion set_from_cam;  // its axes: x right, y down, z forward
};

// Times rise strictly; at least one key.
struct Track {
  std::vector<TrackKey> keys;
};

// Reads a track: comma-separated text, whose first line is
//   time_s,px,py,pz,qw,qx,qy,qz
// and every other line one key: seconds, position in the set in metres, quaternion set_from_cam,
// which is normalised. Empty lines and lines that begin with # are passed over.
// Throws std::runtime_error with path, line and reason: another header, a missing or extra column,
// no number, a quaternion of zeros, times that do not rise, no key at all.
Track read_track(const std::string& path);
void write_track(const std::string& path, const Track& track);

// A pose of the track, and whether the track says so.
struct TrackedPose {
  Pose cam_from_set;
  bool inside = true;  // false: before the first or after the last key, whose pose this is
};

// The pose at a time: positions are interpolated linearly, rotations at constant angular speed on
// the shorter way (Shoemake, "Animating Rotation with Quaternion Curves", SIGGRAPH 1985). Throws
// std::invalid_argument if the track has no key or time_s is not finite.
TrackedPose pose_at(const Track& track, double time_s);

}  // namespace calibrate
