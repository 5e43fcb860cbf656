// Boards before made cameras, with known truth.
#include "calibrate/made_boards.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "calibrate/angles.h"
#include "calibrate/rotation_fit.h"
#include "calibrate/rotation_vector.h"

namespace calibrate {
namespace {

// The shortest one.
Mat3 turn_between(Vec3 from, Vec3 to) {
  const Vec3 axis = cross(normalize(from), normalize(to));
  const double sine = length(axis);
  const double angle = std::atan2(sine, dot(normalize(from), normalize(to)));
  return sine > 0 ? rotation_of(axis * (angle / sine)) : Mat3{};
}

}  // namespace

Vec2 MadeLens::project(Vec3 v) const {
  const double off = hypotenuse(v.x, v.y);
  const double angle = std::atan2(off, v.z);
  const double around = std::atan2(v.y, v.x);
  const double sine = std::sin(angle);
  const double shown = angle + ripple_rad * std::sin(5 * angle);
  const double bent = around + bend_rad * sine * sine * std::sin(3 * around);
  const double s = std::sin(shown);
  return calibrate::project(lens, {s * std::cos(bent), s * std::sin(bent), std::cos(shown)})
      .value();
}

std::optional<Vec3> MadeLens::unproject(Vec2 q) const {
  const auto v = calibrate::unproject(lens, q);
  if (!v) return std::nullopt;
  const double shown = std::atan2(hypotenuse(v->x, v->y), v->z);
  const double bent = std::atan2(v->y, v->x);
  double angle = shown;
  double around = bent;
  for (int i = 0; i < 50; ++i) {
    angle = shown - ripple_rad * std::sin(5 * angle);
    const double sine = std::sin(angle);
    around = bent - bend_rad * sine * sine * std::sin(3 * around);
  }
  const double s = std::sin(angle);
  return Vec3{s * std::cos(around), s * std::sin(around), std::cos(angle)};
}

MadeLens made_fisheye(double ripple_rad) {
  // Sees a little beyond 90 degrees, as such lenses do.
  return {
      {"decentred_kannala_brandt", 1024, 1024,
       ripple_rad == 0 ? std::vector<double>{331, 331, 513.3, 509.1, 0, 0, -.02, .003}
                       : std::vector<double>{331.3, 331, 513.3, 509.1, 2e-4, -3e-4, -.02, .003}},
      ripple_rad,
      90 * degree};
}

MadeLens made_normal() {
  return {{"LENSMODEL_OPENCV5",
           1280,
           720,
           {1108.5, 1108.5, 641.7, 357.2, -.12, .05, 5e-4, -3e-4, -.01}},
          0,
          60 * degree};
}

MadeBoards normal_boards() {
  MadeBoards boards;
  boards.centre_deg = 18;
  boards.least_m = 0.5;
  boards.most_m = 1.1;
  return boards;
}

Board made_board() { return {Board::Kind::chessboard, 10, 10, .04, 0, ""}; }

LensProblem make_board_views(const MadeLens& truth, const MadeBoards& options) {
  LensProblem problem{made_board(), truth.lens.width, truth.lens.height, {}};
  const Board& board = problem.board;
  std::mt19937 random(options.seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  const double sees = std::min(truth.sees_rad, options.sees_deg * degree);
  for (int attempt = 0; attempt < 100000 && problem.views.size() < options.views; ++attempt) {
    const double share = (static_cast<double>(problem.views.size()) + uniform(random)) /
                         static_cast<double>(options.views);
    const double off = options.centre_deg * degree * std::sqrt(share);
    const double around =
        2 * std::numbers::pi *
        (0.618034 * static_cast<double>(problem.views.size()) + 0.05 * uniform(random));
    const double distance = options.least_m + (options.most_m - options.least_m) * uniform(random);
    const Vec3 towards{std::sin(off) * std::cos(around), std::sin(off) * std::sin(around),
                       std::cos(off)};
    const double tilt = options.tilt_deg * degree * uniform(random);
    const double tilt_around = 2 * std::numbers::pi * uniform(random);
    const double roll = (uniform(random) - 0.5) * std::numbers::pi;
    Pose pose;
    const Vec3 middle{0.5 * board.square_m * (board.columns - 1),
                      0.5 * board.square_m * (board.rows - 1), 0};
    if (options.fronto) {
      pose.t = towards * (distance / std::max(towards.z, 0.3)) - middle;
    } else {
      pose.R = turn_between({0, 0, 1}, towards) *
               rotation_of({tilt * std::cos(tilt_around), tilt * std::sin(tilt_around), 0}) *
               rotation_of({0, 0, roll});
      pose.t = towards * distance - pose.R * middle;
    }
    BoardView view{"view" + std::to_string(problem.views.size()), {}};
    for (std::size_t i = 0; i < board.corner_count(); ++i) {
      const Vec3 p = pose * corner_of(board, options.warp_m, i);
      view.corners.emplace_back();
      if (std::atan2(hypotenuse(p.x, p.y), p.z) >= sees) continue;
      const Vec2 q = truth.project(p);
      if (q.x < 1 || q.y < 1 || q.x > problem.width - 2 || q.y > problem.height - 2) continue;
      view.corners.back() =
          Vec2{q.x + options.noise_px * normal(random), q.y + options.noise_px * normal(random)};
      if (uniform(random) < options.outliers) {
        const double size = 5 + 15 * uniform(random);
        const double way = 2 * std::numbers::pi * uniform(random);
        view.corners.back()->x += size * std::cos(way);
        view.corners.back()->y += size * std::sin(way);
      }
    }
    if (count_corners(view) * 2 >= board.corner_count()) problem.views.push_back(view);
  }
  return problem;
}

std::vector<MadeRay> even_rays(const MadeLens& truth, double max_deg) {
  std::vector<MadeRay> rays;
  for (double off = 1; off <= max_deg; off += 2) {
    const int around = std::max(6, static_cast<int>(60 * std::sin(off * degree)));
    for (int i = 0; i < around; ++i) {
      const double a = 2 * std::numbers::pi * (i + 0.5) / around;
      const Vec3 v{std::sin(off * degree) * std::cos(a), std::sin(off * degree) * std::sin(a),
                   std::cos(off * degree)};
      const Vec2 q = truth.project(v);
      if (q.x < 0 || q.y < 0 || q.x > truth.lens.width - 1 || q.y > truth.lens.height - 1) continue;
      rays.push_back({v, q});
    }
  }
  return rays;
}

double ray_error_mrad(const MadeLens& truth, const Lens& solved, double max_deg) {
  return ray_error_mrad(
      truth, [&](Vec2 q) { return unproject(solved, q); }, max_deg);
}

double ray_error_mrad(const MadeLens& truth,
                      const std::function<std::optional<Vec3>(Vec2)>& solved,
                      double max_deg) {
  std::vector<Vec3> expected, found;
  for (const auto& [v, q] : even_rays(truth, max_deg)) {
    const auto u = solved(q);
    if (!u) return HUGE_VAL;
    expected.push_back(v);
    found.push_back(*u);
  }
  const Mat3 turn = best_rotation(found, expected);
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Vec3 turned = turn * found[i];
    const double angle = std::atan2(length(cross(turned, expected[i])), dot(turned, expected[i]));
    sum += angle * angle;
  }
  return 1000 * std::sqrt(sum / static_cast<double>(found.size()));
}

}  // namespace calibrate
