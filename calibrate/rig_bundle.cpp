// The least-squares core of a rig: poses of cameras, poses of boards, lenses held.
#include "calibrate/rig_bundle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "calibrate/keep_ceres_quiet.h"
#include "calibrate/rotation_vector.h"

namespace calibrate {
namespace {

// A pose near another: a turn and a translation instead of its own.
using Block = std::array<double, 6>;

Block block_of(const Pose& pose) {
  const Vec3 r = rotation_vector(pose.R);
  return {r.x, r.y, r.z, pose.t.x, pose.t.y, pose.t.z};
}

Pose pose_of(const Block& b) { return {rotation_of({b[0], b[1], b[2]}), {b[3], b[4], b[5]}}; }

struct CornerCost {
  const Sight* sight;
  template <class T>
  bool operator()(const T* cam_from_rig, const T* rig_from_board, T* residual) const {
    const std::array<T, 3> p_board{T(sight->p_set.x), T(sight->p_set.y), T(sight->p_set.z)};
    std::array<T, 3> p_rig, p_cam;
    ceres::AngleAxisRotatePoint(rig_from_board, p_board.data(), p_rig.data());
    for (std::size_t i = 0; i < 3; ++i) p_rig[i] += rig_from_board[3 + i];
    ceres::AngleAxisRotatePoint(cam_from_rig, p_rig.data(), p_cam.data());
    for (std::size_t i = 0; i < 3; ++i) p_cam[i] += cam_from_rig[3 + i];
    using std::atan2;
    using std::sqrt;
    const T size = sqrt(p_cam[0] * p_cam[0] + p_cam[1] * p_cam[1] + p_cam[2] * p_cam[2]);
    if (!(size > T(1e-9))) return false;
    const std::array<double, 3> v{sight->v_cam.x, sight->v_cam.y, sight->v_cam.z};
    T cosine = T(0);
    for (std::size_t i = 0; i < 3; ++i) cosine += p_cam[i] * v[i] / size;
    std::array<T, 3> across;
    T sine2 = T(0);
    for (std::size_t i = 0; i < 3; ++i) {
      across[i] = p_cam[i] / size - v[i] * cosine;
      sine2 += across[i] * across[i];
    }
    T arc = T(1);  // over the sine
    if (sine2 > T(1e-12)) {
      const T sine = sqrt(sine2);
      arc = atan2(sine, cosine) / sine;
    }
    const Vec3 right = sight->right, down = sight->down;
    residual[0] = arc * (right.x * across[0] + right.y * across[1] + right.z * across[2]);
    residual[1] = arc * (down.x * across[0] + down.y * across[1] + down.z * across[2]);
    return true;
  }
};

using Cost = ceres::AutoDiffCostFunction<CornerCost, 2, 6, 6>;

// The derivatives of one corner's residual by turn and move of its camera, and by the board's pose
// in any coordinates.
struct Derivatives {
  Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_camera, by_board;
  Eigen::Vector2d residual;
};

std::optional<Derivatives> derivatives(const RigCorner& corner, const RigBundle& bundle) {
  const Pose& cam = bundle.cam_from_rig[corner.camera];
  const Block camera = block_of(cam);
  const Block board = block_of(bundle.rig_from_board[corner.board]);
  const Cost cost(new CornerCost{&corner.sight});
  Derivatives d;
  Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_block;
  const std::array<const double*, 2> at{camera.data(), board.data()};
  std::array<double*, 2> jacobians{by_block.data(), d.by_board.data()};
  if (!cost.Evaluate(at.data(), d.residual.data(), jacobians.data())) return std::nullopt;
  // The block's rotation vector turns the camera by the left Jacobian; a turn about the camera's
  // own place, and a move of that, change the translation: t = -R p.
  const Mat3 L = left_jacobian({camera[0], camera[1], camera[2]});
  Eigen::Matrix3d turn_by_vector, R, t_cross;
  for (int i = 0; i < 9; ++i) {
    turn_by_vector(i / 3, i % 3) = L.m[static_cast<std::size_t>(i)];
    R(i / 3, i % 3) = cam.R.m[static_cast<std::size_t>(i)];
  }
  t_cross << 0, -cam.t.z, cam.t.y, cam.t.z, 0, -cam.t.x, -cam.t.y, cam.t.x, 0;
  const Eigen::Matrix<double, 2, 3> by_translation = by_block.rightCols<3>();
  // dt = turn x t - R move.
  d.by_camera.leftCols<3>() =
      by_block.leftCols<3>() * turn_by_vector.inverse() - by_translation * t_cross;
  d.by_camera.rightCols<3>() = -by_translation * R;
  return d;
}

using PullSlopes = Eigen::Matrix<double, 2, Eigen::Dynamic>;

// What one lens's error does to all cameras' poses. Corners that lie close in its picture are
// shifted alike, and summed up.
class LensPull {
 public:
  LensPull(const LensError& error, Eigen::Index n) : error_(error), n_(n), scaled_(n) {
    scaled_.setZero();
  }

  void add(const Sight& sight, const PullSlopes& slopes) {
    if (!(error_.sigma_px > 0)) return;
    constexpr double alike = 0.97;
    auto cell = std::ranges::find_if(
        cells_, [&](const Cell& one) { return likeness(error_, one.v_cam, sight.v_cam) > alike; });
    if (cell == cells_.end()) {
      cell = cells_.insert(cell, {sight.v_cam, PullSlopes::Zero(2, n_)});
    }
    cell->slopes += slopes;
    const Vec2 away = scale_shift(sight);
    scaled_ += slopes.transpose() * Eigen::Vector2d(away.x, away.y);
  }

  // J^T C J, as lens_part()'s.
  Eigen::MatrixXd part() const {
    const double variance = error_.sigma_px * error_.sigma_px;
    Eigen::MatrixXd sum = scale_variance(error_) * scaled_ * scaled_.transpose();
    for (const Cell& a : cells_) {
      for (const Cell& b : cells_) {
        sum += variance * likeness(error_, a.v_cam, b.v_cam) * a.slopes.transpose() * b.slopes;
      }
    }
    return sum;
  }

  // The trace of a matrix times part().
  double trace_with(const Eigen::MatrixXd& matrix) const {
    const double variance = error_.sigma_px * error_.sigma_px;
    double sum = scale_variance(error_) * scaled_.dot(matrix * scaled_);
    for (const Cell& a : cells_) {
      const PullSlopes times = a.slopes * matrix;
      for (const Cell& b : cells_) {
        sum += variance * likeness(error_, a.v_cam, b.v_cam) * times.cwiseProduct(b.slopes).sum();
      }
    }
    return sum;
  }

 private:
  struct Cell {
    Vec3 v_cam;
    PullSlopes slopes;
  };
  LensError error_;
  Eigen::Index n_;
  Eigen::VectorXd scaled_;
  std::vector<Cell> cells_;
};

// One board's corners alone, its pose eliminated.
class LoneBoard {
 public:
  LoneBoard(std::span<const LensError> errors, Eigen::Index n)
      : information_(Eigen::MatrixXd::Zero(n, n)),
        gradient_(Eigen::VectorXd::Zero(n)),
        sees_(errors.size(), 0) {
    for (const LensError& error : errors) pulls_.emplace_back(error, n);
  }

  void add(const RigCorner& corner, const PullSlopes& slopes, const Eigen::Vector2d& residual) {
    information_.noalias() += slopes.transpose() * slopes;
    gradient_.noalias() += slopes.transpose() * residual;
    pulls_[corner.camera].add(corner.sight, slopes);
    sees_[corner.camera] = 1;
  }

  BoardPull pull() const {
    constexpr double open = 1e-11;
    const Eigen::VectorXd scale =
        information_.diagonal()
            .unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0; })
            .eval();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(scale.asDiagonal() * information_ *
                                                              scale.asDiagonal());
    // It tells how its cameras stand to each other.
    const auto most = 6 * (std::ranges::count(sees_, std::uint8_t{1}) - 1);
    BoardPull result;
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(gradient_.size(), gradient_.size());
    for (Eigen::Index i = gradient_.size();
         i-- > 0 && result.freedoms < static_cast<double>(most);) {
      if (!(axes.eigenvalues()[i] > open * axes.eigenvalues()[gradient_.size() - 1])) break;
      const Eigen::VectorXd axis = scale.asDiagonal() * axes.eigenvectors().col(i);
      inverse.noalias() += axis * axis.transpose() / axes.eigenvalues()[i];
      ++result.freedoms;
    }
    result.squares = gradient_.dot(inverse * gradient_);
    for (const LensPull& pull : pulls_) result.of_lenses += pull.trace_with(inverse);
    return result;
  }

 private:
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
  std::vector<std::uint8_t> sees_;
  std::vector<LensPull> pulls_;
};

}  // namespace

bool minimise(RigBundle& bundle,
              std::span<const RigCorner> corners,
              std::span<const std::uint8_t> used,
              double loss_px) {
  keep_ceres_quiet();
  std::vector<Block> cameras, boards;
  for (const Pose& pose : bundle.cam_from_rig) cameras.push_back(block_of(pose));
  for (const Pose& pose : bundle.rig_from_board) boards.push_back(block_of(pose));
  std::vector<std::uint8_t> has_camera(cameras.size(), 0), has_board(boards.size(), 0);
  ceres::Problem problem;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (used[i] == 0) continue;
    const RigCorner& corner = corners[i];
    problem.AddResidualBlock(new Cost(new CornerCost{&corner.sight}),
                             loss_px > 0 ? new ceres::CauchyLoss(loss_px) : nullptr,
                             cameras[corner.camera].data(), boards[corner.board].data());
    has_camera[corner.camera] = 1;
    has_board[corner.board] = 1;
  }
  if (problem.NumResidualBlocks() == 0) return false;
  ceres::Solver::Options solving;
  auto* order = new ceres::ParameterBlockOrdering;
  for (std::size_t i = 0; i < boards.size(); ++i) {
    if (has_board[i] != 0) order->AddElementToGroup(boards[i].data(), 0);
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (has_camera[i] != 0) order->AddElementToGroup(cameras[i].data(), 1);
  }
  if (has_camera[0] != 0) problem.SetParameterBlockConstant(cameras[0].data());
  solving.linear_solver_ordering.reset(order);
  solving.linear_solver_type = ceres::DENSE_SCHUR;
  solving.max_num_iterations = 50;
  solving.function_tolerance = 1e-9;
  solving.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solving, &problem, &summary);
  if (!summary.IsSolutionUsable()) return false;
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    if (has_camera[i] != 0) bundle.cam_from_rig[i] = pose_of(cameras[i]);
  }
  for (std::size_t i = 0; i < boards.size(); ++i) {
    if (has_board[i] != 0) bundle.rig_from_board[i] = pose_of(boards[i]);
  }
  return true;
}

RigCovariance covariance(const RigBundle& bundle,
                         std::span<const RigCorner> corners,
                         std::span<const std::uint8_t> used,
                         std::span<const LensError> errors) {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  const auto n = static_cast<Eigen::Index>(6 * (bundle.cam_from_rig.size() - 1));
  Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(n, n);
  std::vector<Eigen::MatrixXd> between(bundle.rig_from_board.size(), Eigen::MatrixXd::Zero(n, 6));
  std::vector<Matrix6> own(bundle.rig_from_board.size(), Matrix6::Zero());
  std::vector<std::optional<Derivatives>> slopes(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (used[i] == 0) continue;
    const RigCorner& corner = corners[i];
    const auto& d = slopes[i] = derivatives(corner, bundle);
    if (!d) continue;
    own[corner.board].noalias() += d->by_board.transpose() * d->by_board;
    if (corner.camera == 0) continue;
    const auto at = static_cast<Eigen::Index>(6 * (corner.camera - 1));
    shared.block<6, 6>(at, at).noalias() += d->by_camera.transpose() * d->by_camera;
    between[corner.board].middleRows<6>(at).noalias() += d->by_camera.transpose() * d->by_board;
  }
  // How the boards' poses follow the cameras'.
  std::vector<Eigen::MatrixXd> follow(own.size(), Eigen::MatrixXd::Zero(6, n));
  for (std::size_t board = 0; board < own.size(); ++board) {
    if (own[board].isZero()) continue;
    own[board].diagonal() *= 1 + 1e-12;
    follow[board] = own[board].ldlt().solve(between[board].transpose());
    shared.noalias() -= between[board] * follow[board];
  }
  const Eigen::MatrixXd symmetric = 0.5 * (shared + shared.transpose());
  const Eigen::LLT<Eigen::MatrixXd> solver(symmetric);
  if (solver.info() != Eigen::Success) return {};
  const Eigen::MatrixXd inverse = solver.solve(Eigen::MatrixXd::Identity(n, n));

  std::vector<LensPull> pulls;
  for (const LensError& error : errors) pulls.emplace_back(error, n);
  std::vector<LoneBoard> alone(own.size(), LoneBoard(errors, n));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!slopes[i]) continue;
    const RigCorner& corner = corners[i];
    PullSlopes by_cameras = -(slopes[i]->by_board * follow[corner.board]);
    if (corner.camera > 0) {
      by_cameras.middleCols<6>(static_cast<Eigen::Index>(6 * (corner.camera - 1))) +=
          slopes[i]->by_camera;
    }
    pulls[corner.camera].add(corner.sight, by_cameras);
    alone[corner.board].add(corner, by_cameras, slopes[i]->residual);
  }
  Eigen::MatrixXd part = Eigen::MatrixXd::Zero(n, n);
  for (const LensPull& pull : pulls) part += pull.part();
  RigCovariance result;
  result.of_noise.resize(static_cast<std::size_t>(n * n));
  result.of_lenses.resize(result.of_noise.size());
  Eigen::Map<Eigen::MatrixXd>(result.of_noise.data(), n, n) = inverse;
  Eigen::Map<Eigen::MatrixXd>(result.of_lenses.data(), n, n) = inverse * part * inverse;
  for (const LoneBoard& board : alone) result.boards.push_back(board.pull());
  return result;
}

}  // namespace calibrate
