// Where the feet stand on the floor, from picture to picture.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calibrate/angles.h"
#include "compositing/feet.h"

namespace compositing {

using calibrate::Vec2;
using calibrate::Vec3;

namespace {

constexpr double acceleration_m_s2 = 30;  // of feet that land
constexpr double stride_m = 1.2;          // between two feet, sideways in the picture
constexpr double step_m = 0.55;           // and along the view: of a foot that overtakes the other
constexpr double picture_s = 0.04;        // both within that time,
constexpr double reach_m_s = 6;           // and so much further beyond it: some run
constexpr double gate = 4;                // standard deviations
constexpr double strange_s = 0.3;         // so long a place out of reach is not believed
constexpr double strange_m = 0.6;         // apart, they are not one place
constexpr double longest_gap_s = 1;       // after it nothing is known of the speed
constexpr double worst_m = 0.5;           // standard deviation of places worth following
constexpr double away_m_s = 1;            // how fast what is held becomes uncertain
constexpr double largest_sigma_m = 100;
constexpr double furthest_m = 1e4;
// What is lowest in the picture is a foot: one that is seen from further above in 8 % of places is
// off by more than 0.2 m (billboards.md).
constexpr double steepest_rad = 45 * calibrate::degree;
constexpr double most_lean_rad = 25 * calibrate::degree;

// Where the pixel's ray meets the floor before the camera.
std::optional<Vec2> on_floor(const calibrate::Lens& lens,
                             const calibrate::Pose& set_from_cam,
                             double floor_z,
                             Vec2 q) {
  const auto v_cam = calibrate::unproject(lens, q);
  if (!v_cam) return std::nullopt;
  const Vec3 v = set_from_cam.R * *v_cam, camera = set_from_cam.t;
  const double k = (floor_z - camera.z) / v.z;
  if (!(k > 0 && k < furthest_m)) return std::nullopt;
  return Vec2{camera.x + k * v.x, camera.y + k * v.y};
}

double apart(Vec2 a, Vec2 b) { return calibrate::hypotenuse(a.x - b.x, a.y - b.y); }

}  // namespace

FeetTracker::FeetTracker(const calibrate::Lens& lens,
                         const calibrate::Pose& cam_from_set,
                         double floor_z)
    : lens_(lens), set_from_cam_(inverse(cam_from_set)), floor_z_(floor_z) {
  calibrate::check(lens);
  const bool turns =
      std::ranges::all_of(set_from_cam_.R.m, [](double v) { return std::isfinite(v); });
  if (!turns || !is_finite(set_from_cam_.t) || !std::isfinite(floor_z))
    throw std::invalid_argument("FeetTracker: pose or floor is not finite");
  constexpr std::array<Vec2, 4> down{{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};
  down_ = down[static_cast<std::size_t>(turns_to_upright(cam_from_set))];
}

bool FeetTracker::is_doubted(Vec2 q, Vec3 v_cam) const {
  const Vec3 v = set_from_cam_.R * v_cam;
  if (-v.z > std::sin(steepest_rad) * length(v)) return true;
  const Vec3 lower_cam = v_cam + set_from_cam_.R.transposed() * Vec3{0, 0, -1e-3};
  const auto lower = calibrate::project(lens_, lower_cam);
  if (!lower) return true;
  const Vec2 step{lower->x - q.x, lower->y - q.y};
  const double along = step.x * down_.x + step.y * down_.y;
  return !(along > std::cos(most_lean_rad) * calibrate::hypotenuse(step.x, step.y));
}

std::optional<FeetTracker::Seen> FeetTracker::see(const Feet& feet) const {
  if (feet.status != FeetStatus::seen) return std::nullopt;
  if (!std::isfinite(feet.q.x) || !std::isfinite(feet.q.y)) return std::nullopt;
  const double sigma_px = std::isfinite(feet.sigma_px) ? std::max(feet.sigma_px, 0.05) : 1;
  const auto at = on_floor(lens_, set_from_cam_, floor_z_, feet.q);
  const double half = 0.5 * sigma_px;
  const auto below = on_floor(lens_, set_from_cam_, floor_z_,
                              {feet.q.x + half * down_.x, feet.q.y + half * down_.y});
  const auto beside = on_floor(lens_, set_from_cam_, floor_z_,
                               {feet.q.x + half * down_.y, feet.q.y - half * down_.x});
  if (!at || !below || !beside) return std::nullopt;
  Seen seen{*at, {at->x - set_from_cam_.t.x, at->y - set_from_cam_.t.y}};
  const double ground = calibrate::hypotenuse(seen.away.x, seen.away.y);
  // Straight below the camera any direction will do.
  seen.away = ground > 1e-6 ? Vec2{seen.away.x / ground, seen.away.y / ground} : Vec2{1, 0};
  constexpr double least_m = 1e-4;
  seen.sigma_along = std::max(2 * apart(*at, *below), least_m);
  seen.sigma_across = std::max(2 * apart(*at, *beside), least_m);
  if (!(seen.sigma_along < worst_m && seen.sigma_across < worst_m)) return std::nullopt;
  seen.doubted = is_doubted(feet.q, *calibrate::unproject(lens_, feet.q));
  return seen;
}

void FeetTracker::start(const Seen& seen) {
  state_ = {seen.at.x, seen.at.y, 0, 0};
  covariance_ = {};
  const double a = seen.sigma_along * seen.sigma_along, b = seen.sigma_across * seen.sigma_across;
  const auto [x, y] = seen.away;
  covariance_[0] = a * x * x + b * y * y;
  covariance_[5] = a * y * y + b * x * x;
  covariance_[1] = covariance_[4] = (a - b) * x * y;
  covariance_[10] = covariance_[15] = 1;  // walks at about 1 m/s, or stands
  started_ = true;
  strange_.reset();
}

void FeetTracker::predict(double t) {
  state_[0] += t * state_[2];
  state_[1] += t * state_[3];
  auto& p = covariance_;
  // F P F', row by row and column by column.
  for (std::size_t j = 0; j < 8; ++j) p[j] += t * p[j + 8];
  for (std::size_t i = 0; i < 16; i += 4) {
    p[i] += t * p[i + 2];
    p[i + 1] += t * p[i + 3];
  }
  const double q = acceleration_m_s2 * acceleration_m_s2 * t * t;
  for (const std::size_t axis : {0U, 1U}) {
    p[5 * axis] += q * t * t / 4;
    p[5 * axis + 2] += q * t / 2;
    p[5 * axis + 8] += q * t / 2;
    p[5 * axis + 10] += q;
  }
}

// Whether the place was believed.
bool FeetTracker::correct(const Seen& seen, Vec2 last, double further) {
  const Vec2 along = seen.away, across{-along.y, along.x};
  const auto variance = [&](Vec2 v) {
    const auto& p = covariance_;
    return v.x * v.x * p[0] + 2 * v.x * v.y * p[1] + v.y * v.y * p[5];
  };
  const auto off = [&](Vec2 v) {
    return v.x * (seen.at.x - state_[0]) + v.y * (seen.at.y - state_[1]);
  };
  // Feet go on as they went, or have landed.
  const auto reach = [&](Vec2 v) {
    const double landed = v.x * (seen.at.x - last.x) + v.y * (seen.at.y - last.y);
    return std::min(std::abs(off(v)), std::abs(landed));
  };
  if (reach(along) > step_m + further || reach(across) > stride_m + further) return false;
  // The other foot: nobody slid there.
  for (const auto& [v, sigma] :
       {std::pair(along, seen.sigma_along), std::pair(across, seen.sigma_across)}) {
    const double step = off(v);
    if (std::abs(step) < gate * std::sqrt(variance(v) + sigma * sigma)) continue;
    state_[0] += step * v.x;
    state_[1] += step * v.y;
  }
  for (const auto& [v, sigma] :
       {std::pair(along, seen.sigma_along), std::pair(across, seen.sigma_across)}) {
    auto& p = covariance_;
    std::array<double, 4> ph{};
    for (std::size_t i = 0; i < 4; ++i) ph[i] = p[4 * i] * v.x + p[4 * i + 1] * v.y;
    const double s = ph[0] * v.x + ph[1] * v.y + sigma * sigma, e = off(v);
    for (std::size_t i = 0; i < 4; ++i) state_[i] += ph[i] / s * e;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j) p[4 * i + j] -= ph[i] * ph[j] / s;
  }
  return true;
}

Standing FeetTracker::standing(FeetStatus status) const {
  const double mean = 0.5 * (covariance_[0] + covariance_[5]);
  const double half =
      calibrate::hypotenuse(0.5 * (covariance_[0] - covariance_[5]), covariance_[1]);
  return {{state_[0], state_[1], floor_z_}, std::sqrt(std::max(mean + half, 0.0)), status, false};
}

void FeetTracker::restart() { seen_s_ = time_s_ - 2 * longest_gap_s; }

std::optional<Standing> FeetTracker::update(double time_s, const Feet& feet) {
  const bool timed = std::isfinite(time_s);
  const auto seen = timed ? see(feet) : std::nullopt;
  // Feet that were seen, but of which this camera cannot tell where on the floor they are.
  const bool unsure = feet.status == FeetStatus::seen && (!seen || seen->doubted);
  FeetStatus status = unsure ? FeetStatus::uncertain : feet.status;
  if (timed && started_ && time_s < time_s_) time_s_ = time_s, restart();
  if (!started_) {
    if (!seen) return std::nullopt;
    start(*seen);
    time_s_ = seen_s_ = looked_s_ = time_s;
    return standing(status);
  }
  if (timed) time_s_ = time_s;
  if (seen) {
    const double gap = time_s - seen_s_;
    // Beyond what can be reached from picture to picture.
    const double further = reach_m_s * std::max(0.0, time_s - looked_s_ - picture_s);
    looked_s_ = time_s;
    const FeetTracker before = *this;
    if (gap > longest_gap_s) {
      start(*seen);
      seen_s_ = time_s;
      return standing(status);
    }
    predict(gap);
    if (correct(*seen, {before.state_[0], before.state_[1]}, further)) {
      strange_.reset();
      seen_s_ = time_s;
      return standing(status);
    }
    *this = before;
    status = FeetStatus::uncertain;
    if (!strange_ || apart(*strange_, seen->at) > strange_m + further) strange_since_s_ = time_s;
    strange_ = seen->at;
    if (time_s - strange_since_s_ >= strange_s) {
      start(*seen);
      seen_s_ = time_s;
      return standing(seen->doubted ? FeetStatus::uncertain : FeetStatus::seen);
    }
  }
  Standing held = standing(status);
  held.held = true;
  held.sigma_m = std::min(calibrate::hypotenuse(held.sigma_m, away_m_s * (time_s_ - seen_s_)),
                          largest_sigma_m);
  return held;
}

}  // namespace compositing
