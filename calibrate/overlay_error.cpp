// How far off a virtual object may be drawn, by what a calibration knows of its own error.
#include "calibrate/overlay_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace calibrate {
namespace {

constexpr double cells_of_diagonal = 24;
// 95 % of a normal error's length: in one direction only, and of one alike in all directions.
constexpr double line_95 = 1.9600;
constexpr double round_95 = 2.4477;

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// 95 % of the length of a normal error with this covariance. Between the two cases above the square
// is nearly linear in the ratio of the variances.
double length_95(const OverlayError::Covariance& c) {
  const double middle = 0.5 * (c.xx + c.yy);
  const double spread = std::hypot(0.5 * (c.xx - c.yy), c.xy);
  const double most = middle + spread;
  const double least = std::max(middle - spread, 0.0);
  if (!(most > 0)) return 0;
  const double ratio = least / most;
  return std::sqrt(most * (line_95 * line_95 +
                           (round_95 * round_95 - line_95 * line_95) * std::pow(ratio, 1.35)));
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

// The rotation that best turns `a` into `b`.
Mat3 best_rotation(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) {
    H += Eigen::Vector3d(b[i].x, b[i].y, b[i].z) *
         Eigen::Vector3d(a[i].x, a[i].y, a[i].z).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d R =
      svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  Mat3 result;
  for (int i = 0; i < 9; ++i) result.m[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
  return result;
}

}  // namespace

OverlayError::OverlayError(const Inputs& inputs)
    : form_(inputs.solve->bundle.form),
      lens_(inputs.solve->lens),
      free_(inputs.solve->bundle.free) {
  const LensProblem& problem = *inputs.problem;
  const LensStart& start = *inputs.start;
  const LensSolve& solve = *inputs.solve;

  // Coverage.
  cell_px_ = std::hypot(lens_.width, lens_.height) / cells_of_diagonal;
  cells_x_ = static_cast<int>(lens_.width / cell_px_) + 1;
  cells_y_ = static_cast<int>(lens_.height / cell_px_) + 1;
  covered_.assign(static_cast<std::size_t>(cells_x_ * cells_y_), 0);
  bool any = false;
  for (std::size_t i = 0; i < start.corners.size(); ++i) {
    if (solve.used[i] == 0) continue;
    const SeenCorner& corner = start.corners[i];
    const Vec3 p = solve.bundle.cam_from_board[corner.view] *
                   corner_of(problem.board, solve.bundle.warp_m, corner.index);
    max_angle_rad_ = std::max(max_angle_rad_, std::atan2(hypotenuse(p.x, p.y), p.z));
    const int x = static_cast<int>(corner.q.x / cell_px_);
    const int y = static_cast<int>(corner.q.y / cell_px_);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= cells_x_ || y + dy >= cells_y_) continue;
        covered_[static_cast<std::size_t>((y + dy) * cells_x_ + x + dx)] = 1;
      }
    }
    any = true;
  }
  if (!any) throw std::invalid_argument("no corner is in use");

  // Covariance of the free parameters.
  const auto n = static_cast<Eigen::Index>(free_.size());
  const double sigma_px = inputs.sigma_px > 0 ? inputs.sigma_px : solve.sigma_px;
  const std::vector<double> told =
      information(solve.bundle, problem.board, start.corners, solve.used, solve.warp);
  RowMatrix info = Eigen::Map<const RowMatrix>(told.data(), n + 2, n + 2) / (sigma_px * sigma_px);
  info.topLeftCorner(n, n).diagonal() += prior_information(form_, lens_, free_.size());
  // A board bends by less than its square.
  const double bend = 1 / (problem.board.square_m * problem.board.square_m);
  info.bottomRightCorner(2, 2).diagonal() += Eigen::Vector2d(bend, bend);
  // In units of the priors, so that numbers of all sizes live together.
  const Eigen::VectorXd scale = info.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * info *
                                                             scale.asDiagonal());
  const Eigen::VectorXd spread = eigen.eigenvalues().cwiseMax(1e-15).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd whole = scale.asDiagonal() * eigen.eigenvectors() * spread.asDiagonal();
  const RowMatrix root = whole.topRows(n);
  root_.assign(root.data(), root.data() + root.size());

  // The turn that goes with a change: least squares in pixels over the covered picture.
  const LensFunction function(form_);
  std::vector<Vec2> pixels;
  for (int y = 0; y < cells_y_; ++y) {
    for (int x = 0; x < cells_x_; ++x) {
      const Vec2 q{(x + 0.5) * cell_px_, (y + 0.5) * cell_px_};
      if (covered(q)) pixels.push_back(q);
    }
  }
  const auto directions = unproject_all(lens_, pixels);
  Eigen::Matrix3d turns = Eigen::Matrix3d::Identity() * 1e-9;
  RowMatrix moved = RowMatrix::Zero(3, n);
  RowMatrix by_free;
  Eigen::Matrix<double, 2, 3> by_turn;
  for (const auto& v : directions) {
    if (!v || !derivatives(function, free_, *v, by_free, by_turn)) continue;
    turns += by_turn.transpose() * by_turn;
    moved += by_turn.transpose() * by_free;
  }
  const RowMatrix turn = -turns.ldlt().solve(moved);
  turn_.assign(turn.data(), turn.data() + turn.size());

  for (const OtherLens& other : inputs.others) {
    const auto theirs = unproject_all(other.lens, pixels);
    std::vector<Vec3> a, b;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (!directions[i] || !theirs[i]) continue;
      a.push_back(*directions[i]);
      b.push_back(*theirs[i]);
    }
    if (a.size() > 2) others_.push_back({other, best_rotation(a, b)});
  }
}

std::size_t OverlayError::cell_of(Vec2 q) const {
  return static_cast<std::size_t>(static_cast<int>(q.y / cell_px_) * cells_x_ +
                                  static_cast<int>(q.x / cell_px_));
}

bool OverlayError::covered(Vec2 q) const {
  const bool inside = q.x >= 0 && q.y >= 0 && q.x <= lens_.width && q.y <= lens_.height;
  if (!inside || covered_[cell_of(q)] == 0) return false;
  const auto v = unproject(lens_, q);
  return v && std::atan2(hypotenuse(v->x, v->y), v->z) <= max_angle_rad_;
}

std::optional<OverlayError::Covariance> OverlayError::noise(Vec2 q) const {
  const auto v = unproject(lens_, q);
  if (!v) return std::nullopt;
  RowMatrix by_free;
  Eigen::Matrix<double, 2, 3> by_turn;
  if (!derivatives(LensFunction(form_), free_, *v, by_free, by_turn)) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(free_.size());
  const Eigen::Map<const RowMatrix> turn(turn_.data(), 3, n);
  const Eigen::Map<const RowMatrix> root(root_.data(), n,
                                         static_cast<Eigen::Index>(root_.size()) / n);
  const RowMatrix shown = (by_free + by_turn * turn) * root;
  const Eigen::Matrix2d c = shown * shown.transpose();
  if (!c.allFinite()) return std::nullopt;
  return Covariance{c(0, 0), c(0, 1), c(1, 1)};
}

std::optional<double> OverlayError::at(Vec2 q) const {
  if (!covered(q)) return std::nullopt;
  auto error = noise(q);
  const auto v = unproject(lens_, q);
  if (!error || !v) return std::nullopt;
  for (const auto& [other, from_ours] : others_) {
    const auto there = project(other.lens, from_ours * *v);
    if (!there) continue;
    const Vec2 away{there->x - q.x, there->y - q.y};
    error->xx += other.share * away.x * away.x;
    error->xy += other.share * away.x * away.y;
    error->yy += other.share * away.y * away.y;
  }
  return length_95(*error);
}

}  // namespace calibrate
