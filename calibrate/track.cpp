// Where a moving camera was: poses over time, in a file.
#include "calibrate/track.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "calibrate/text_file.h"

namespace calibrate {
namespace {

constexpr std::string_view header = "time_s,px,py,pz,qw,qx,qy,qz";
constexpr std::size_t columns = 8;
// Shorter quaternions than this have lost their direction.
constexpr double least_norm = 1e-6;
// Metres: as far as anything of a set may be from its origin.
constexpr double farthest = 1e6;

double dot(Quaternion a, Quaternion b) { return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z; }

Quaternion sum(Quaternion a, double wa, Quaternion b, double wb) {
  return {wa * a.w + wb * b.w, wa * a.x + wb * b.x, wa * a.y + wb * b.y, wa * a.z + wb * b.z};
}

Quaternion normalized(Quaternion q) { return sum(q, 1 / std::sqrt(dot(q, q)), {}, 0); }

Quaternion slerp(Quaternion a, Quaternion b, double f) {
  const double sign = dot(a, b) < 0 ? -1 : 1;
  const double angle = std::acos(std::min(std::abs(dot(a, b)), 1.0));
  if (angle < 1e-6) return normalized(sum(a, 1 - f, b, sign * f));
  const double s = std::sin(angle);
  return normalized(sum(a, std::sin((1 - f) * angle) / s, b, sign * std::sin(f * angle) / s));
}

std::string_view trimmed(std::string_view text) {
  const std::string_view space = " \t\r";
  const std::size_t begin = text.find_first_not_of(space);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(space) - begin + 1);
}

// Splits off what stands before the separator.
std::string_view take_until(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view front = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return front;
}

[[noreturn]] void fail(const std::string& path, int line, const std::string& why) {
  throw std::runtime_error(path + ":" + std::to_string(line) + ": " + why);
}

std::array<double, columns> parse_row(const std::string& path, int line, std::string_view row) {
  if (std::ranges::count(row, ',') != columns - 1) {
    fail(path, line, "a key has 8 columns (" + std::string(header) + ")");
  }
  std::array<double, columns> values{};
  for (double& value : values) {
    const std::string_view field = trimmed(take_until(row, ','));
    if (!parse_number(field, value) || !std::isfinite(value)) {
      fail(path, line, std::string(field.substr(0, 40)) + " is no finite number");
    }
  }
  return values;
}

}  // namespace

Mat3 rotation_of(Quaternion q) {
  return {
      {1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.w * q.z), 2 * (q.x * q.z + q.w * q.y),
       2 * (q.x * q.y + q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z - q.w * q.x),
       2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x), 1 - 2 * (q.x * q.x + q.y * q.y)}};
}

Quaternion quaternion_of(const Mat3& R) {
  // Each component's square from the diagonal; the largest one divides safely.
  const auto& m = R.m;
  const std::array<double, 4> squares{1 + m[0] + m[4] + m[8], 1 + m[0] - m[4] - m[8],
                                      1 - m[0] + m[4] - m[8], 1 - m[0] - m[4] + m[8]};
  const auto largest = std::ranges::max_element(squares) - squares.begin();
  Quaternion q;
  switch (largest) {
    case 0:
      q = {squares[0], m[7] - m[5], m[2] - m[6], m[3] - m[1]};
      break;
    case 1:
      q = {m[7] - m[5], squares[1], m[3] + m[1], m[2] + m[6]};
      break;
    case 2:
      q = {m[2] - m[6], m[3] + m[1], squares[2], m[7] + m[5]};
      break;
    default:
      q = {m[3] - m[1], m[2] + m[6], m[7] + m[5], squares[3]};
  }
  return normalized(q);
}

Track read_track(const std::string& path) {
  const std::string text = read_text_file(path);
  std::string_view rest = text;
  Track track;
  bool has_header = false;
  for (int line = 1; !rest.empty(); ++line) {
    const std::string_view row = trimmed(take_until(rest, '\n'));
    if (row.empty() || row.front() == '#') continue;
    if (!has_header) {
      if (row != header) fail(path, line, "the first line must be " + std::string(header));
      has_header = true;
      continue;
    }
    const auto v = parse_row(path, line, row);
    const Quaternion q{v[4], v[5], v[6], v[7]};
    if (!(dot(q, q) > least_norm * least_norm))
      fail(path, line, "a quaternion of zeros is no rotation");
    if (!std::isfinite(dot(q, q)))
      fail(path, line, "a quaternion of such length is no rotation: its squares overflow");
    constexpr double rounding = 0.1;
    if (std::abs(std::sqrt(dot(q, q)) - 1) > rounding) {
      fail(path, line,
           "a quaternion of length " + to_text(std::sqrt(dot(q, q))) +
               " is no rotation, for which it is 1: are these angles?");
    }
    for (std::size_t i = 1; i < 4; ++i) {
      if (std::abs(v[i]) <= farthest) continue;
      fail(path, line, "a place of " + to_text(v[i]) + " m is beyond 1e6 m");
    }
    if (!track.keys.empty() && v[0] <= track.keys.back().time_s) {
      fail(path, line,
           "time " + to_text(v[0]) + " does not come after " + to_text(track.keys.back().time_s));
    }
    track.keys.push_back({v[0], {v[1], v[2], v[3]}, normalized(q)});
  }
  if (track.keys.empty()) {
    throw std::runtime_error(path + ": holds no key: expected " + std::string(header) +
                             " and at least one line of numbers");
  }
  return track;
}

void write_track(const std::string& path, const Track& track) {
  std::string text = std::string(header) + "\n";
  for (const TrackKey& key : track.keys) {
    const Quaternion q = key.set_from_cam;
    const std::array<double, columns> values{
        key.time_s, key.position.x, key.position.y, key.position.z, q.w, q.x, q.y, q.z};
    for (std::size_t i = 0; i < columns; ++i) {
      text += to_text(values[i]) + (i + 1 < columns ? "," : "\n");
    }
  }
  write_text_file(path, text);
}

TrackedPose pose_at(const Track& track, double time_s) {
  if (track.keys.empty() || !std::isfinite(time_s)) {
    throw std::invalid_argument("a track needs a key, and a finite time to look up");
  }
  const auto pose = [](Vec3 position, Quaternion set_from_cam) {
    return inverse(Pose{rotation_of(set_from_cam), position});
  };
  const auto after = std::ranges::upper_bound(track.keys, time_s, {}, &TrackKey::time_s);
  if (after == track.keys.begin()) {
    return {pose(after->position, after->set_from_cam), false};
  }
  const TrackKey& a = *(after - 1);
  if (after == track.keys.end()) return {pose(a.position, a.set_from_cam), time_s == a.time_s};
  const double f = (time_s - a.time_s) / (after->time_s - a.time_s);
  return {pose(a.position * (1 - f) + after->position * f,
               slerp(a.set_from_cam, after->set_from_cam, f)),
          true};
}

}  // namespace calibrate
