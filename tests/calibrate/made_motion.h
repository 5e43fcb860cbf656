// A board moved by hand before two cameras.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "calibrate/rotation_vector.h"
#include "tests/calibrate/made_markers.h"

namespace made {

// What the hand keeps to, but for how it turns the board.
enum class Path { line, plane, space, circle };

// set_from_board by time of a board that faces -y, its origin about a metre above that of the set:
// swings of up to 2 Hz over some decimetres, now and then nearly a halt, and turns of some ten
// degrees.
inline std::function<calibrate::Pose(double)> hand_motion(Path path, Random& random) {
  struct Swing {
    double rate, phase;
    calibrate::Vec3 size_m, turn;
  };
  const auto any = [&] {
    return calibrate::Vec3{random.normal(), random.normal(), random.normal()};
  };
  const calibrate::Vec3 along = random.direction();
  const calibrate::Vec3 across = normalize(cross(along, random.direction()));
  const calibrate::Vec3 normal = cross(along, across);
  std::vector<Swing> swings;
  for (int i = 0; i < 10; ++i) {
    const double hz = random.uniform(0.15, 2);
    calibrate::Vec3 way = any();
    if (path == Path::line) way = along * random.normal();
    if (path == Path::plane) way = way - normal * dot(way, normal);
    if (path == Path::circle) way = way * 0.2;
    swings.push_back({2 * std::numbers::pi * hz, random.uniform(0, 6),
                      way * (0.06 / std::max(hz, 0.5)), any() * 0.06});
  }
  const double pause = random.uniform(0, 6);
  const double pace = random.uniform(0, 6);
  return [=](double t) {
    const double s = t + 0.35 * std::sin(0.8 * std::numbers::pi * t + pause);
    calibrate::Vec3 p{0, 0, 1};
    calibrate::Vec3 turn{0.1, 0.05, 0};
    for (const Swing& swing : swings) {
      p += swing.size_m * std::sin(swing.rate * s + swing.phase);
      turn += swing.turn * std::sin(0.7 * swing.rate * s + swing.phase);
    }
    if (path == Path::circle) {
      const double angle = 2 * std::numbers::pi * (0.7 * s + 0.25 * std::sin(0.9 * s + pace));
      p += (along * std::cos(angle) + across * std::sin(angle)) * 0.2;
    }
    const calibrate::Mat3 facing{{1, 0, 0, 0, 0, 1, 0, -1, 0}};
    return calibrate::Pose{calibrate::rotation_of(turn) * facing, p};
  };
}

// Two metres from the board, so far around it.
inline calibrate::Pose camera_around(double angle_rad) {
  return calibrate::look_at({2 * std::sin(angle_rad), -2 * std::cos(angle_rad), 1.2}, {0, 0, 1}, 0);
}

}  // namespace made
