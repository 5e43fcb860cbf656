// How far off a virtual object may be drawn, by what a calibration knows of its own error.
#include "calibrate/overlay_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "calibrate/rotation_fit.h"

namespace calibrate {
namespace {

constexpr double cells_of_diagonal = 32;
// The farthest point of the ellipse that holds 95 % of a normal error, in standard deviations of
// its worst direction.
constexpr double ellipse_95 = 2.4477;

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

double farthest_of_95(const OverlayError::Covariance& c) {
  const double most = 0.5 * (c.xx + c.yy) + std::hypot(0.5 * (c.xx - c.yy), c.xy);
  return ellipse_95 * std::sqrt(std::max(most, 0.0));
}

// A change of the free parameters as it shows at a direction: 2 x n, and 2 x 3 for a turn.
bool derivatives(const LensFunction& function,
                 std::span<const double> free,
                 Vec3 v,
                 RowMatrix& by_free,
                 Eigen::Matrix<double, 2, 3>& by_turn) {
  Vec2 q;
  std::array<double, 6> by_point{};
  by_free.resize(2, static_cast<Eigen::Index>(free.size()));
  if (!function(free.data(), v, q, by_point.data(), by_free.data())) return false;
  for (int row = 0; row < 2; ++row) {
    const auto i = static_cast<std::size_t>(3 * row);
    const Vec3 turned = cross(v, {by_point[i], by_point[i + 1], by_point[i + 2]});
    by_turn.row(row) << turned.x, turned.y, turned.z;
  }
  return by_free.allFinite() && by_turn.allFinite();
}

// Standard deviations that nothing observed overrules: a focal length by itself, the centre by the
// picture's size, all others by 1. Numbers only; what the corners tell is far below.
Eigen::VectorXd prior_information(const LensForm& form, const Lens& lens, std::size_t n) {
  Eigen::VectorXd prior = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(n));
  const Eigen::Index focals = form.one_focal ? 1 : 2;
  const double focal = lens.parameters[0];
  for (Eigen::Index i = 0; i < focals; ++i) prior(i) = 1 / (focal * focal);
  for (Eigen::Index i = focals; i < focals + 2; ++i) {
    prior(i) = 1 / (static_cast<double>(lens.width) * lens.width);
  }
  return prior;
}

// A square root of the covariance of a solve's free parameters.
RowMatrix root_of(const LensProblem& problem,
                  const LensStart& start,
                  const LensSolve& solve,
                  double sigma_px) {
  const auto n = static_cast<Eigen::Index>(solve.bundle.free.size());
  const std::vector<double> told =
      information(solve.bundle, problem.board, start.corners, solve.used, solve.warp);
  RowMatrix info = Eigen::Map<const RowMatrix>(told.data(), n + 2, n + 2) / (sigma_px * sigma_px);
  info.topLeftCorner(n, n).diagonal() +=
      prior_information(solve.bundle.form, solve.lens, solve.bundle.free.size());
  // A board bends by less than its square.
  const double bend = 1 / (problem.board.square_m * problem.board.square_m);
  info.bottomRightCorner(2, 2).diagonal() += Eigen::Vector2d(bend, bend);
  // Scaled to ones on the diagonal, so that numbers of all sizes live together.
  const Eigen::VectorXd scale = info.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * info *
                                                             scale.asDiagonal());
  const Eigen::VectorXd spread = eigen.eigenvalues().cwiseMax(1e-15).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd whole = scale.asDiagonal() * eigen.eigenvectors() * spread.asDiagonal();
  return whole.topRows(n);
}

// The turn of the camera that goes with a change of a solve's free parameters (3 x n): least
// squares in pixels over some directions.
RowMatrix turn_of(const LensSolve& solve, std::span<const std::optional<Vec3>> directions) {
  const LensFunction function(solve.bundle.form);
  Eigen::Matrix3d turns = Eigen::Matrix3d::Identity() * 1e-9;
  RowMatrix moved = RowMatrix::Zero(3, static_cast<Eigen::Index>(solve.bundle.free.size()));
  RowMatrix by_free;
  Eigen::Matrix<double, 2, 3> by_turn;
  for (const auto& v : directions) {
    if (!v || !derivatives(function, solve.bundle.free, *v, by_free, by_turn)) continue;
    turns += by_turn.transpose() * by_turn;
    moved += by_turn.transpose() * by_free;
  }
  return -turns.ldlt().solve(moved);
}

}  // namespace

void OverlayError::cover(const LensProblem& problem,
                         const LensStart& start,
                         const LensSolve& solve) {
  cell_px_ = std::hypot(problem.width, problem.height) / cells_of_diagonal;
  cells_x_ = static_cast<int>(problem.width / cell_px_) + 1;
  cells_y_ = static_cast<int>(problem.height / cell_px_) + 1;
  covered_.assign(static_cast<std::size_t>(cells_x_ * cells_y_), 0);
  max_angle_rad_ = farthest_angle(problem, start, solve);
  for (std::size_t i = 0; i < start.corners.size(); ++i) {
    if (solve.used[i] == 0) continue;
    const SeenCorner& corner = start.corners[i];
    const int x = static_cast<int>(corner.q.x / cell_px_);
    const int y = static_cast<int>(corner.q.y / cell_px_);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= cells_x_ || y + dy >= cells_y_) continue;
        covered_[static_cast<std::size_t>((y + dy) * cells_x_ + x + dx)] = 1;
      }
    }
  }
}

OverlayError::OverlayError(const LensProblem& problem,
                           const LensStart& start,
                           std::span<const BelievedSolve> solves,
                           double sigma_px) {
  if (solves.empty()) throw std::invalid_argument("there is no solve to predict the error of");
  cover(problem, start, *solves.front().solve);
  if (!(max_angle_rad_ > 0)) throw std::invalid_argument("no corner is in use");
  std::vector<Vec2> pixels;
  for (int y = 0; y < cells_y_; ++y) {
    for (int x = 0; x < cells_x_; ++x) {
      const Vec2 q{(x + 0.5) * cell_px_, (y + 0.5) * cell_px_};
      if (covered_[cell_of(q)] != 0) pixels.push_back(q);
    }
  }
  const auto ours = unproject_all(solves.front().solve->lens, pixels);
  for (const auto& [solve, share] : solves) {
    Member member{solve->bundle.form, solve->lens, solve->bundle.free, {}, {}, share, {}};
    const RowMatrix root = root_of(problem, start, *solve, sigma_px);
    member.root.assign(root.data(), root.data() + root.size());
    const auto theirs = unproject_all(member.lens, pixels);
    const RowMatrix turn = turn_of(*solve, theirs);
    member.turn.assign(turn.data(), turn.data() + turn.size());
    std::vector<Vec3> a, b;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (!ours[i] || !theirs[i]) continue;
      a.push_back(*ours[i]);
      b.push_back(*theirs[i]);
    }
    member.from_ours = best_rotation(a, b);
    members_.push_back(std::move(member));
  }
}

std::size_t OverlayError::cell_of(Vec2 q) const {
  return static_cast<std::size_t>(static_cast<int>(q.y / cell_px_) * cells_x_ +
                                  static_cast<int>(q.x / cell_px_));
}

bool OverlayError::covered(Vec2 q) const {
  const Lens& lens = members_.front().lens;
  const bool inside = q.x >= 0 && q.y >= 0 && q.x <= lens.width && q.y <= lens.height;
  if (!inside || covered_[cell_of(q)] == 0) return false;
  const auto v = unproject(lens, q);
  return v && std::atan2(hypotenuse(v->x, v->y), v->z) <= max_angle_rad_;
}

std::optional<OverlayError::Covariance> OverlayError::noise_of(const Member& member, Vec3 v) {
  RowMatrix by_free;
  Eigen::Matrix<double, 2, 3> by_turn;
  if (!derivatives(LensFunction(member.form), member.free, v, by_free, by_turn)) {
    return std::nullopt;
  }
  const auto n = static_cast<Eigen::Index>(member.free.size());
  const Eigen::Map<const RowMatrix> turn(member.turn.data(), 3, n);
  const Eigen::Map<const RowMatrix> root(member.root.data(), n,
                                         static_cast<Eigen::Index>(member.root.size()) / n);
  const RowMatrix shown = (by_free + by_turn * turn) * root;
  const Eigen::Matrix2d c = shown * shown.transpose();
  if (!c.allFinite()) return std::nullopt;
  return Covariance{c(0, 0), c(0, 1), c(1, 1)};
}

std::optional<OverlayError::Covariance> OverlayError::noise(Vec2 q) const {
  const auto v = unproject(members_.front().lens, q);
  return v ? noise_of(members_.front(), *v) : std::nullopt;
}

double OverlayError::rms_px() const {
  double squares = 0, count = 0;
  for (int y = 0; y < cells_y_; ++y) {
    for (int x = 0; x < cells_x_; ++x) {
      const auto error = at({(x + 0.5) * cell_px_, (y + 0.5) * cell_px_});
      if (!error) continue;
      squares += *error * *error / (ellipse_95 * ellipse_95);
      ++count;
    }
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

std::optional<double> OverlayError::at(Vec2 q) const {
  if (!covered(q)) return std::nullopt;
  const auto v = unproject(members_.front().lens, q);
  if (!v) return std::nullopt;
  const auto ours = noise_of(members_.front(), *v);
  if (!ours) return std::nullopt;
  Covariance sum;
  double shares = 0;
  for (const Member& member : members_) {
    const Vec3 theirs = member.from_ours * *v;
    const auto there = project(member.lens, theirs);
    const auto own = noise_of(member, theirs);
    if (!there || !own) continue;
    // What a form with more parameters may be off by is both its own noise and its distance from
    // ours; one would count twice.
    const Vec2 away{there->x - q.x, there->y - q.y};
    const Covariance apart{ours->xx + away.x * away.x, ours->xy + away.x * away.y,
                           ours->yy + away.y * away.y};
    const Covariance& larger = apart.xx + apart.yy > own->xx + own->yy ? apart : *own;
    sum.xx += member.share * larger.xx;
    sum.xy += member.share * larger.xy;
    sum.yy += member.share * larger.yy;
    shares += member.share;
  }
  if (!(shares > 0)) return std::nullopt;
  return farthest_of_95({sum.xx / shares, sum.xy / shares, sum.yy / shares});
}

}  // namespace calibrate
