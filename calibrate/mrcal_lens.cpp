// mrcal's lens models, through libmrcal.
#include "calibrate/mrcal_lens.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

extern "C" {  // mrcal's headers do not say so themselves
#include <mrcal/mrcal.h>
}

namespace calibrate {
namespace {

constexpr std::string_view prefix = "LENSMODEL_";
constexpr std::string_view splined = "LENSMODEL_SPLINED_STEREOGRAPHIC";

struct FixedModel {
  std::string_view name;
  int parameters;
};
constexpr std::array fixed_models{
    FixedModel{"LENSMODEL_PINHOLE", 4},   FixedModel{"LENSMODEL_STEREOGRAPHIC", 4},
    FixedModel{"LENSMODEL_LONLAT", 4},    FixedModel{"LENSMODEL_OPENCV4", 8},
    FixedModel{"LENSMODEL_OPENCV5", 9},   FixedModel{"LENSMODEL_OPENCV8", 12},
    FixedModel{"LENSMODEL_OPENCV12", 16}, FixedModel{"LENSMODEL_CAHVOR", 9},
};

// Splines that libmrcal evaluates without harm: smaller grids abort it, or give NaN.
constexpr int min_knots = 5;
constexpr int max_knots = 1000;

// A pixel must come back to itself this closely.
constexpr double round_trip_px = 1e-3;
// Newton's steps on libmrcal's answer, which it leaves up to about 1e-4 px off.
constexpr int polish_steps = 4;

[[noreturn]] void refuse(std::string_view model, const std::string& why) {
  throw std::invalid_argument("lens model " + std::string(model) + ": " + why);
}

// Takes `key` and a whole number from the front of `text`.
std::optional<int> take_number(std::string_view& text, std::string_view key) {
  if (!text.starts_with(key)) return std::nullopt;
  text.remove_prefix(key.size());
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

struct Spline {
  int order, columns, rows, fov_deg;
};

Spline spline_of(std::string_view model) {
  std::string_view rest = model.substr(splined.size());
  const auto order = take_number(rest, "_order=");
  const auto columns = take_number(rest, "_Nx=");
  const auto rows = take_number(rest, "_Ny=");
  const auto fov_deg = take_number(rest, "_fov_x_deg=");
  if (!order || !columns || !rows || !fov_deg || !rest.empty()) {
    refuse(model, "its name must end in _order=O_Nx=N_Ny=N_fov_x_deg=D");
  }
  if (*order != 2 && *order != 3) refuse(model, "order must be 2 or 3");
  if (std::min(*columns, *rows) < min_knots || std::max(*columns, *rows) > max_knots) {
    refuse(model, "Nx and Ny must be from 5 to 1000");
  }
  if (*fov_deg < 1 || *fov_deg >= 360) refuse(model, "fov_x_deg must be from 1 to 359");
  return {*order, *columns, *rows, *fov_deg};
}

int count_spline_parameters(std::string_view model) {
  const Spline spline = spline_of(model);
  return 4 + 2 * spline.columns * spline.rows;
}

mrcal_lensmodel_t parsed(const std::string& model) {
  mrcal_lensmodel_t result{};
  if (!mrcal_lensmodel_from_name(&result, model.c_str())) {
    refuse(model, "libmrcal does not know it");
  }
  return result;
}

bool finite(const mrcal_point2_t& q) { return std::isfinite(q.x) && std::isfinite(q.y); }

Vec3 from_mrcal(const mrcal_point3_t& v) { return {v.x, v.y, v.z}; }

// Where the radius in the picture of one of OpenCV's lenses, or of CAHVOR, first stops growing with
// the angle. Farther out it may grow again, and would show what is not there; or pass zero, from
// where on the picture is turned by half, and looks right.
class RadialFold {
 public:
  // Without its decentring and prism, which hardly move the fold. Other models have none here.
  explicit RadialFold(const Lens& lens) {
    const bool cahvor = lens.model == "LENSMODEL_CAHVOR";
    if (!cahvor && !lens.model.starts_with("LENSMODEL_OPENCV")) return;  // all zero: nowhere
    const auto k = [&](std::size_t i) {
      return 4 + i < lens.parameters.size() ? lens.parameters[4 + i] : 0;
    };
    // In u, the squared tangent of the angle: radius^2 = u (above / below)^2.
    std::array above{1.0, k(0), k(1), k(4)};
    below_ = {1, k(5), k(6), k(7)};
    if (cahvor) {
      // alpha, beta, r0, r1, r2, about an axis of its own. A constant factor has no fold.
      axis_ = {std::sin(k(0)) * std::cos(k(1)), std::sin(k(1)), std::cos(k(0)) * std::cos(k(1))};
      const double middle = 1 + k(2);
      if (!(middle > 0)) return;  // turned by half everywhere
      above = {1.0, k(3) / middle, k(4) / middle, 0.0};
      below_ = {1, 0, 0, 0};
    }
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        const double power = 2 * static_cast<double>(i) + 1 - 2 * static_cast<double>(j);
        slope_[i + j] += power * above[i] * below_[j];
      }
    }
  }

  // Whether a direction with z above 0 lies beyond it.
  bool lies_before(Vec3 v) {
    if (slope_[0] == 0) return false;
    const double along = dot(v, axis_);
    if (!(along > 0)) return true;
    const Vec3 across = cross(v, axis_);
    const double u = dot(across, across) / (along * along);
    // So far in that no term can turn it.
    if (least_within(slope_, u) > 0 && least_within(below_, u) > 0) return false;
    if (!first_) first_ = find();
    return u > *first_;
  }

 private:
  template <std::size_t n>
  static double value(const std::array<double, n>& polynomial, double u) {
    double sum = 0;
    for (std::size_t i = n; i > 0; --i) sum = sum * u + polynomial[i - 1];
    return sum;
  }

  // A bound of 1 + ... from 0 to u.
  template <std::size_t n>
  static double least_within(const std::array<double, n>& polynomial, double u) {
    double sum = 0;
    for (std::size_t i = n - 1; i > 0; --i) sum = (sum + std::abs(polynomial[i])) * u;
    return 1 - sum;
  }

  // To half a degree, not too near: up to there the picture itself tells that it is mirrored.
  double find() const {
    constexpr int steps = 180;
    for (int i = 1; i < steps; ++i) {
      const double tangent = std::tan(0.5 * std::numbers::pi * i / steps);
      const double u = tangent * tangent;
      if (!(value(slope_, u) > 0) || !(value(below_, u) > 0)) return u;
    }
    return std::numeric_limits<double>::infinity();
  }

  Vec3 axis_{0, 0, 1};
  std::array<double, 7> slope_{};  // of the radius, times below^2
  std::array<double, 4> below_{};
  std::optional<double> first_;
};

// Where a spline shows what is there: inside the knots that it is made of, for libmrcal goes on
// beyond with the last piece's polynomial, which soon turns back into the picture, and before the
// first fold on the way out from the axis. Everywhere for other models.
class SplineSight {
 public:
  // As libmrcal lays them out: intervals of one size, from edge to edge of fov_x_deg, of which
  // cubic splines need a whole one more at either side and quadratic ones half of one.
  SplineSight(const Lens& lens, const mrcal_lensmodel_t& model)
      : model_(model), parameters_(lens.parameters.data()) {
    if (!lens.model.starts_with(splined)) return;
    const Spline spline = spline_of(lens.model);
    most_x_ = 2 * std::tan(spline.fov_deg * std::numbers::pi / 720);
    const int more = spline.order - 1;
    const int intervals = spline.columns - 1 - more;
    most_y_ = most_x_ * (spline.rows - 1 - more) / intervals;
    step_ = most_x_ / (2 * intervals);
  }

  // Whether a unit vector is seen.
  bool holds(Vec3 v) {
    if (most_x_ == 0) return true;
    const double scale = 2 / (1 + v.z);
    const Vec2 u{v.x * scale, v.y * scale};
    if (!(std::abs(u.x) <= most_x_ && std::abs(u.y) <= most_y_)) return false;
    // A way is walked sooner than all of them, unless there are many to walk.
    constexpr int many = 64;
    if (clear_.empty() && ++walked_ > many) find_clear();
    const double radius = hypotenuse(u.x, u.y);
    if (!clear_.empty() && radius <= clear_around(std::atan2(u.y, u.x))) return true;
    return !(first_fold(u.x / radius, u.y / radius, radius) < radius);
  }

 private:
  // Of the picture on the way from the axis, in stereographic radii, up to a step behind `radius`;
  // infinite = none.
  double first_fold(double x, double y, double radius) const {
    for (double r = 0.5 * step_; r < radius; r += step_) {
      const double angle = 2 * std::atan(r / 2);
      const Vec3 v{x * std::sin(angle), y * std::sin(angle), std::cos(angle)};
      const mrcal_point3_t p{{v.x, v.y, v.z}};
      mrcal_point2_t q{};
      std::array<mrcal_point3_t, 2> gradient{};
      if (!mrcal_project(&q, gradient.data(), nullptr, &p, 1, &model_, parameters_) ||
          !(dot(v, cross(from_mrcal(gradient[0]), from_mrcal(gradient[1]))) > 0)) {
        return r;
      }
    }
    return std::numeric_limits<double>::infinity();
  }

  // The radii up to which ways all around meet no fold.
  void find_clear() {
    clear_.resize(ways);
    for (int i = 0; i < ways; ++i) {
      const double x = std::cos(2 * std::numbers::pi * i / ways);
      const double y = std::sin(2 * std::numbers::pi * i / ways);
      const double edge = std::min(most_x_ / std::abs(x), most_y_ / std::abs(y));
      clear_[static_cast<std::size_t>(i)] = first_fold(x, y, edge + step_) - 2 * step_;
    }
  }

  double clear_around(double angle_rad) const {
    const int way = static_cast<int>(std::floor(angle_rad / (2 * std::numbers::pi) * ways));
    const auto at = [&](int i) { return clear_[static_cast<std::size_t>((i + ways) % ways)]; };
    return std::min(at(way), at(way + 1));
  }

  static constexpr int ways = 180;
  mrcal_lensmodel_t model_;
  const double* parameters_;
  double most_x_ = 0;
  double most_y_ = 0;
  double step_ = 0;  // a quarter of an interval
  int walked_ = 0;
  std::vector<double> clear_;  // of each way
};

// A direction's pixel and its change with the direction.
struct Projection {
  Vec2 q;
  Vec3 dqx, dqy;
};

class Projector {
 public:
  explicit Projector(const Lens& lens)
      : model_(parsed(lens.model)),
        parameters_(lens.parameters.data()),
        max_angle_rad_(lens.max_angle_rad),
        behind_(mrcal_lensmodel_metadata(&model_).can_project_behind_camera),
        sight_(lens, model_),
        fold_(lens) {}

  // Nothing where the lens sees nothing. Past the angle where distortion turns back, the picture is
  // mirrored there: seen from the camera, a turn from x to y is no longer one in the picture.
  std::optional<Projection> operator()(Vec3 direction) const {
    const double l = length(direction);
    if (!std::isfinite(l) || l == 0) return std::nullopt;
    const Vec3 v = direction / l;
    if (!behind_ && v.z <= 0) return std::nullopt;
    if (std::atan2(hypotenuse(v.x, v.y), v.z) > max_angle_rad_) return std::nullopt;
    if (!sight_.holds(v) || fold_.lies_before(v)) return std::nullopt;
    const mrcal_point3_t p{{v.x, v.y, v.z}};
    mrcal_point2_t q{};
    std::array<mrcal_point3_t, 2> gradient{};
    if (!mrcal_project(&q, gradient.data(), nullptr, &p, 1, &model_, parameters_)) {
      return std::nullopt;
    }
    const Projection result{{q.x, q.y}, from_mrcal(gradient[0]), from_mrcal(gradient[1])};
    if (!finite(q) || !(dot(v, cross(result.dqx, result.dqy)) > 0)) return std::nullopt;
    return result;
  }

  // The direction of a pixel near a first guess, by Newton's method on the sphere.
  std::optional<Vec3> polish(Vec3 guess, Vec2 wanted) const {
    Vec3 v = normalize(guess);
    for (int step = 0; step <= polish_steps; ++step) {
      const std::optional<Projection> at = (*this)(v);
      if (!at) return std::nullopt;
      const Vec2 miss{wanted.x - at->q.x, wanted.y - at->q.y};
      const double miss_px = hypotenuse(miss.x, miss.y);
      if (step == polish_steps || miss_px < 1e-9) {
        return miss_px <= round_trip_px ? std::optional(v) : std::nullopt;
      }
      // The change of v across itself that moves the pixel by `miss`.
      const double determinant = dot(v, cross(at->dqx, at->dqy));
      const Vec3 move = (cross(at->dqy, v) * miss.x + cross(v, at->dqx) * miss.y) / determinant;
      v = normalize(v + move);
    }
    return std::nullopt;
  }

  const mrcal_lensmodel_t& model() const { return model_; }

 private:
  mrcal_lensmodel_t model_;
  const double* parameters_;
  double max_angle_rad_;
  bool behind_;
  mutable SplineSight sight_;
  mutable RadialFold fold_;
};

}  // namespace

bool is_mrcal_model(std::string_view model) { return model.starts_with(prefix); }

int count_mrcal_parameters(std::string_view model) {
  for (const FixedModel& fixed : fixed_models) {
    if (model == fixed.name) return fixed.parameters;
  }
  if (model.starts_with(splined)) return count_spline_parameters(model);
  std::string known;
  for (const FixedModel& fixed : fixed_models) known += std::string(fixed.name) + ", ";
  refuse(model, "not supported; known are " + known + std::string(splined) + "_...");
}

std::vector<std::optional<Vec2>> project_by_mrcal(const Lens& lens, std::span<const Vec3> v_cam) {
  const Projector projector(lens);
  std::vector<std::optional<Vec2>> result(v_cam.size());
  for (std::size_t i = 0; i < v_cam.size(); ++i) {
    if (const auto at = projector(v_cam[i])) result[i] = at->q;
  }
  return result;
}

std::vector<std::optional<Vec3>> unproject_by_mrcal(const Lens& lens, std::span<const Vec2> q) {
  const Projector projector(lens);
  std::vector<std::optional<Vec3>> result(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) {
    const mrcal_point2_t pixel{{q[i].x, q[i].y}};
    if (!finite(pixel)) continue;
    // The pixels before it are mostly its neighbours, and going on from them is a better first
    // guess than libmrcal's own search.
    if (i > 0 && result[i - 1]) {
      const Vec3 last = *result[i - 1];
      const Vec3 guess = i > 1 && result[i - 2] ? last * 2 - *result[i - 2] : last;
      result[i] = projector.polish(guess, q[i]);
    }
    if (result[i]) continue;
    mrcal_point3_t v{};
    if (mrcal_unproject(&v, &pixel, 1, &projector.model(), lens.parameters.data())) {
      result[i] = projector.polish(from_mrcal(v), q[i]);
    }
  }
  return result;
}

}  // namespace calibrate
