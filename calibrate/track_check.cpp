// What of a track is to be doubted.
#include "calibrate/track_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <span>

#include "calibrate/words.h"
#include "capture/median.h"

namespace calibrate {
namespace {

constexpr std::size_t fewest_even = 10;
// Between keys: longer than this many of the usual, and at least so long.
constexpr double longest = 6, shortest_gap_s = 0.15;
constexpr double slowest_s = 5;  // trackers have keys more often
constexpr double far_m = 500;    // as far as a camera may be from the set
// How much faster a step is than others about it; how long, and how fast, no operator is.
constexpr double jump = 8, least_jump_m = 0.02, least_jump_rad = 0.02;
constexpr double fastest_m_s = 4, fastest_rad_s = 12;
constexpr double many_jumps = 0.1;  // of the steps: the poses change more rarely than lines come

double angle_between(const Quaternion& a, const Quaternion& b) {
  const double cosine = std::abs(a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z);
  return 2 * std::acos(std::min(cosine, 1.0));
}

// How fast the camera is from each key to the next, per second. Keys that are stamped too near to
// each other came late.
struct Speeds {
  std::vector<double> metres, radians;
};
Speeds speeds_of(std::span<const TrackKey> keys, double usual_s) {
  Speeds speeds;
  for (std::size_t i = 1; i < keys.size(); ++i) {
    const double s = std::max(keys[i].time_s - keys[i - 1].time_s, usual_s);
    speeds.metres.push_back(length(keys[i].position - keys[i - 1].position) / s);
    speeds.radians.push_back(angle_between(keys[i - 1].set_from_cam, keys[i].set_from_cam) / s);
  }
  return speeds;
}

// Steps that are far longer than those two before and after: of one key that is off, both; where a
// camera sets out, none.
std::vector<std::size_t> jumps_in(std::span<const double> speeds,
                                  std::span<const double> intervals,
                                  double least,
                                  double fastest) {
  std::vector<std::size_t> found;
  for (std::size_t i = 2; i + 2 < speeds.size(); ++i) {
    const bool far = speeds[i] > jump * std::max(speeds[i - 2], speeds[i + 2]);
    if (far && speeds[i] > fastest && speeds[i] * intervals[i] > least) found.push_back(i);
  }
  return found;
}

}  // namespace

std::vector<std::string> doubts_of(const Track& track) {
  const std::span<const TrackKey> keys = track.keys;
  std::vector<std::string> doubts;
  if (std::ranges::all_of(keys, [](const TrackKey& key) { return length(key.position) > far_m; })) {
    doubts.push_back(words("no key is nearer than %.0f m: are its places in millimetres?", far_m));
  }
  // How far the picture's way down goes up in the set.
  constexpr double downwards = 0.1;
  if (std::ranges::all_of(keys, [](const TrackKey& key) {
        return rotation_of(key.set_from_cam).m[7] > downwards;
      })) {
    doubts.emplace_back(
        "the camera hangs upside down throughout: are the quaternions set_from_cam, of a set with "
        "z up and a camera with y down?");
  }
  if (keys.size() < fewest_even) return doubts;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < keys.size(); ++i) {
    intervals.push_back(keys[i].time_s - keys[i - 1].time_s);
  }
  const double usual = capture::median(intervals);
  if (std::ranges::all_of(intervals, [](double s) { return s == 1; })) {
    doubts.emplace_back("its keys are 1 s apart: do its times count frames?");
    return doubts;
  }
  if (usual > slowest_s) {
    doubts.push_back(words("its keys are %.4g s apart: are its times milliseconds?", usual));
    return doubts;
  }
  const Speeds speeds = speeds_of(keys, usual);
  // A logger may leave out keys that are as the one before.
  std::size_t gaps = 0, widest = 0;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    const double s = intervals[i];
    const bool moves =
        speeds.metres[i] * s > least_jump_m || speeds.radians[i] * s > least_jump_rad;
    if (!moves || s < std::max(longest * usual, shortest_gap_s)) continue;
    if (gaps == 0 || s > intervals[widest]) widest = i;
    ++gaps;
  }
  if (gaps > 0) {
    doubts.push_back(words("it has no key from %.3f to %.3f s, and is interpolated there",
                           keys[widest].time_s, keys[widest + 1].time_s) +
                     (gaps > 1 ? words(" (gaps of this kind: %zu)", gaps) : ""));
  }
  std::vector<std::size_t> jumps = jumps_in(speeds.metres, intervals, least_jump_m, fastest_m_s);
  std::ranges::copy(jumps_in(speeds.radians, intervals, least_jump_rad, fastest_rad_s),
                    std::back_inserter(jumps));
  std::ranges::sort(jumps);
  const auto [end, last] = std::ranges::unique(jumps);
  jumps.erase(end, last);
  if (static_cast<double>(jumps.size()) > many_jumps * static_cast<double>(intervals.size())) {
    doubts.push_back(
        words("it moves in %zu of %zu steps, and hardly between: its poses are of fewer "
              "moments than it has keys",
              jumps.size(), intervals.size()));
  } else if (!jumps.empty()) {
    const std::size_t i = jumps.front();
    doubts.push_back(
        (jumps.size() > 1 ? words("it jumps in %zu steps, first", jumps.size()) : "it jumps") +
        words(" from %.3f to %.3f s, by %.3g m and %.3g degrees", keys[i].time_s,
              keys[i + 1].time_s, length(keys[i + 1].position - keys[i].position),
              angle_between(keys[i].set_from_cam, keys[i + 1].set_from_cam) * 180 /
                  std::numbers::pi));
  }
  return doubts;
}

}  // namespace calibrate
