// The least-squares core of lens solves: one lens, one board's shape, many poses of it.
#include "calibrate/lens_bundle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "calibrate/keep_ceres_quiet.h"
#include "calibrate/rotation_vector.h"

namespace calibrate {
namespace {

// Rotation vector, then translation.
using PoseBlock = std::array<double, 6>;

PoseBlock block_of(const Pose& pose) {
  const Vec3 r = rotation_vector(pose.R);
  return {r.x, r.y, r.z, pose.t.x, pose.t.y, pose.t.z};
}

Pose pose_of(const PoseBlock& block) {
  return {rotation_of({block[0], block[1], block[2]}), {block[3], block[4], block[5]}};
}

// How much of the warp reaches a corner: (1 - a^2, 1 - b^2).
Vec2 warp_weights(const Board& board, std::size_t index) {
  const auto columns = static_cast<std::size_t>(board.columns);
  const double a = 2.0 * static_cast<double>(index % columns) / (board.columns - 1) - 1;
  const double b = 2.0 * static_cast<double>(index / columns) / (board.rows - 1) - 1;
  return {1 - a * a, 1 - b * b};
}

// A corner's place in the camera's frame, and how it moves with the pose.
struct PlacedCorner {
  Mat3 R;
  Vec3 turned;  // before the translation
  Vec3 p_cam;
};

PlacedCorner place(const double* pose, Vec3 p_board) {
  PlacedCorner placed;
  placed.R = rotation_of({pose[0], pose[1], pose[2]});
  placed.turned = placed.R * p_board;
  placed.p_cam = placed.turned + Vec3{pose[3], pose[4], pose[5]};
  return placed;
}

Vec3 row_of(const std::array<double, 6>& dq_dp, std::size_t row) {
  return {dq_dp[3 * row], dq_dp[3 * row + 1], dq_dp[3 * row + 2]};
}

class CornerCost : public ceres::CostFunction {
 public:
  CornerCost(const LensFunction& lens, Vec3 flat_corner, Vec2 weights, Vec2 q)
      : lens_(lens), flat_corner_(flat_corner), weights_(weights), q_(q) {
    set_num_residuals(2);
    *mutable_parameter_block_sizes() = {static_cast<int>(lens.free_count()), 2, 6};
  }

  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override {
    const double* warp = blocks[1];
    const double* pose = blocks[2];
    const Vec3 bent = flat_corner_ + Vec3{0, 0, warp[0] * weights_.x + warp[1] * weights_.y};
    const PlacedCorner placed = place(pose, bent);
    Vec2 q;
    std::array<double, 6> dq_dp{};
    double* by_lens = jacobians != nullptr ? jacobians[0] : nullptr;
    if (!lens_(blocks[0], placed.p_cam, q, jacobians != nullptr ? dq_dp.data() : nullptr,
               by_lens)) {
      return false;
    }
    residual[0] = q.x - q_.x;
    residual[1] = q.y - q_.y;
    if (jacobians == nullptr) return true;
    const Vec3 z_axis{placed.R.m[2], placed.R.m[5], placed.R.m[8]};
    const Mat3 turn_of_block = left_jacobian({pose[0], pose[1], pose[2]}).transposed();
    for (std::size_t row = 0; row < 2; ++row) {
      const Vec3 by_point = row_of(dq_dp, row);
      if (jacobians[1] != nullptr) {
        const double along = dot(by_point, z_axis);
        jacobians[1][2 * row] = along * weights_.x;
        jacobians[1][2 * row + 1] = along * weights_.y;
      }
      if (jacobians[2] != nullptr) {
        // A small turn w moves the point by w x turned; the rotation vector makes that turn by the
        // left Jacobian of rotations.
        const Vec3 by_turn = turn_of_block * cross(placed.turned, by_point);
        const std::array<double, 6> values{by_turn.x,  by_turn.y,  by_turn.z,
                                           by_point.x, by_point.y, by_point.z};
        std::copy(values.begin(), values.end(), jacobians[2] + 6 * row);
      }
    }
    return true;
  }

 private:
  const LensFunction& lens_;
  Vec3 flat_corner_;
  Vec2 weights_;
  Vec2 q_;
};

ceres::Solver::Options solver_options(const BundleOptions& options) {
  ceres::Solver::Options result;
  result.linear_solver_type = ceres::DENSE_SCHUR;
  result.max_num_iterations = options.max_iterations;
  result.function_tolerance = 1e-7;
  result.parameter_tolerance = 1e-10;
  result.gradient_tolerance = 1e-12;
  result.num_threads = 1;
  result.logging_type = ceres::SILENT;
  return result;
}

}  // namespace

Vec3 corner_of(const Board& board, Vec2 warp_m, std::size_t index) {
  const Vec2 weights = warp_weights(board, index);
  Vec3 p = corner_of(board, index);
  p.z = warp_m.x * weights.x + warp_m.y * weights.y;
  return p;
}

bool minimise(Bundle& bundle,
              const Board& board,
              std::span<const SeenCorner> corners,
              std::span<const std::uint8_t> used,
              const BundleOptions& options) {
  keep_ceres_quiet();
  const LensFunction lens(bundle.form);
  std::vector<double> free = bundle.free;
  std::array<double, 2> warp{bundle.warp_m.x, bundle.warp_m.y};
  std::vector<PoseBlock> poses;
  for (const Pose& pose : bundle.cam_from_board) poses.push_back(block_of(pose));
  std::vector<std::uint8_t> in_use(poses.size(), 0);

  std::deque<CornerCost> costs;  // which never move
  ceres::CauchyLoss cauchy(std::max(options.loss_px, 1e-6));
  ceres::LossFunction* loss = options.loss_px > 0 ? &cauchy : nullptr;
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.disable_all_safety_checks = true;
  ceres::Problem problem(ownership);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (used[i] == 0) continue;
    const SeenCorner& corner = corners[i];
    costs.emplace_back(lens, corner_of(board, corner.index), warp_weights(board, corner.index),
                       corner.q);
    problem.AddResidualBlock(&costs.back(), loss, free.data(), warp.data(),
                             poses[corner.view].data());
    in_use[corner.view] = 1;
  }
  if (costs.empty()) return false;
  if (!options.move_lens) problem.SetParameterBlockConstant(free.data());
  if (!options.move_warp) problem.SetParameterBlockConstant(warp.data());

  ceres::Solver::Options solving = solver_options(options);
  if (options.move_lens || options.move_warp) {
    auto* order = new ceres::ParameterBlockOrdering;
    for (std::size_t view = 0; view < poses.size(); ++view) {
      if (in_use[view] != 0) order->AddElementToGroup(poses[view].data(), 0);
    }
    if (options.move_lens) order->AddElementToGroup(free.data(), 1);
    if (options.move_warp) order->AddElementToGroup(warp.data(), 1);
    solving.linear_solver_ordering.reset(order);
  }
  ceres::Solver::Summary summary;
  ceres::Solve(solving, &problem, &summary);
  if (!summary.IsSolutionUsable()) return false;
  bundle.free = free;
  bundle.warp_m = {warp[0], warp[1]};
  for (std::size_t view = 0; view < poses.size(); ++view) {
    if (in_use[view] != 0) bundle.cam_from_board[view] = pose_of(poses[view]);
  }
  return summary.termination_type == ceres::CONVERGENCE;
}

std::vector<std::optional<Vec2>> residuals(const Bundle& bundle,
                                           const Board& board,
                                           std::span<const SeenCorner> corners) {
  const LensFunction lens(bundle.form);
  std::vector<std::optional<Vec2>> result(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const SeenCorner& corner = corners[i];
    const Vec3 p_cam =
        bundle.cam_from_board[corner.view] * corner_of(board, bundle.warp_m, corner.index);
    Vec2 q;
    if (lens(bundle.free.data(), p_cam, q, nullptr, nullptr)) {
      result[i] = Vec2{corner.q.x - q.x, corner.q.y - q.y};
    }
  }
  return result;
}

std::vector<double> information(const Bundle& bundle,
                                const Board& board,
                                std::span<const SeenCorner> corners,
                                std::span<const std::uint8_t> used,
                                bool warp) {
  const LensFunction lens(bundle.form);
  const auto lens_count = static_cast<Eigen::Index>(lens.free_count());
  const Eigen::Index n = lens_count + 2;
  using Pose6 = Eigen::Matrix<double, 6, 6>;
  Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(n, n);
  std::vector<Eigen::MatrixXd> between(bundle.cam_from_board.size(), Eigen::MatrixXd::Zero(n, 6));
  std::vector<Pose6> own(bundle.cam_from_board.size(), Pose6::Zero());
  std::vector<PoseBlock> poses;
  for (const Pose& pose : bundle.cam_from_board) poses.push_back(block_of(pose));

  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> J(2, n);
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> by_lens(2, lens_count);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (used[i] == 0) continue;
    const SeenCorner& corner = corners[i];
    const Vec2 weights = warp_weights(board, corner.index);
    const PlacedCorner placed =
        place(poses[corner.view].data(), corner_of(board, bundle.warp_m, corner.index));
    Vec2 q;
    std::array<double, 6> dq_dp{};
    if (!lens(bundle.free.data(), placed.p_cam, q, dq_dp.data(), by_lens.data())) continue;
    Eigen::Matrix<double, 2, 6> by_pose;
    const Vec3 z_axis{placed.R.m[2], placed.R.m[5], placed.R.m[8]};
    for (int row = 0; row < 2; ++row) {
      const Vec3 by_point = row_of(dq_dp, static_cast<std::size_t>(row));
      const Vec3 by_turn = cross(placed.turned, by_point);
      by_pose.row(row) << by_turn.x, by_turn.y, by_turn.z, by_point.x, by_point.y, by_point.z;
      const double along = warp ? dot(by_point, z_axis) : 0;
      J.row(row) << by_lens.row(row), along * weights.x, along * weights.y;
    }
    shared.noalias() += J.transpose() * J;
    between[corner.view].noalias() += J.transpose() * by_pose;
    own[corner.view].noalias() += by_pose.transpose() * by_pose;
  }
  for (std::size_t view = 0; view < own.size(); ++view) {
    if (own[view].isZero()) continue;
    // A pose that its own corners hardly tell must not end in a division by zero.
    own[view].diagonal() *= 1 + 1e-12;
    shared.noalias() -= between[view] * own[view].ldlt().solve(between[view].transpose());
  }
  std::vector<double> result(static_cast<std::size_t>(n * n));
  Eigen::Map<Eigen::MatrixXd>(result.data(), n, n) = 0.5 * (shared + shared.transpose());
  return result;
}

}  // namespace calibrate
