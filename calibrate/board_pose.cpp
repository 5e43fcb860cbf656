// Where a board is, from the bearings of its corners.
#include "calibrate/board_pose.h"

#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "calibrate/homography.h"

namespace calibrate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t corners_for_a_pose = 6;
// Bearings this far off their mean (by cosine) say little on the plane perpendicular to it.
constexpr double least_cosine = 0.15;
constexpr int refinement_steps = 5;
constexpr int rough_steps = 2;

Vector3d eigen(Vec3 v) { return {v.x, v.y, v.z}; }

Pose pose_of(const Matrix3d& R, const Vector3d& t) {
  Pose pose;
  for (int i = 0; i < 9; ++i) pose.R.m[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
  pose.t = {t.x(), t.y(), t.z()};
  return pose;
}

// RMS angle; steps the pose towards less of it if `steps` is above 0.
double refine(std::span<const Vec3> bearings,
              std::span<const Vec3> p_board,
              Matrix3d& R,
              Vector3d& t,
              int steps) {
  double before = HUGE_VAL;
  Matrix3d best_R = R;
  Vector3d best_t = t;
  for (int step = 0; step <= steps; ++step) {
    Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> g = Eigen::Matrix<double, 6, 1>::Zero();
    double sum = 0;
    for (std::size_t i = 0; i < bearings.size(); ++i) {
      const Vector3d turned = R * eigen(p_board[i]);
      const Vector3d p = turned + t;
      const double l = p.norm();
      const Vector3d u = p / l;
      const Vector3d miss = u - eigen(bearings[i]);
      sum += miss.squaredNorm();
      // Of the unit direction by the point, and of the point by a small turn and move.
      const Matrix3d by_point = (Matrix3d::Identity() - u * u.transpose()) / l;
      Eigen::Matrix<double, 3, 6> J;
      J.col(0) = by_point * Vector3d(0, -turned.z(), turned.y());
      J.col(1) = by_point * Vector3d(turned.z(), 0, -turned.x());
      J.col(2) = by_point * Vector3d(-turned.y(), turned.x(), 0);
      J.rightCols<3>() = by_point;
      H.noalias() += J.transpose() * J;
      g.noalias() += J.transpose() * miss;
    }
    if (!(sum < before)) break;
    before = sum;
    best_R = R;
    best_t = t;
    if (step == steps) break;
    H.diagonal() *= 1 + 1e-9;
    const Eigen::Matrix<double, 6, 1> move = H.ldlt().solve(-g);
    const double angle = move.head<3>().norm();
    if (!std::isfinite(angle)) break;
    if (angle > 0) R = Eigen::AngleAxisd(angle, move.head<3>() / angle).matrix() * R;
    t += move.tail<3>();
  }
  R = best_R;
  t = best_t;
  return std::sqrt(before / static_cast<double>(bearings.size()));
}

}  // namespace

std::optional<BoardPose> find_board_pose(std::span<const Vec3> bearings,
                                         std::span<const Vec3> p_board,
                                         PoseEffort effort) {
  if (bearings.size() != p_board.size()) return std::nullopt;
  Vector3d mean = Vector3d::Zero();
  for (const Vec3 b : bearings) mean += eigen(b);
  if (!(mean.norm() > 1e-3 * static_cast<double>(bearings.size()))) return std::nullopt;
  const Matrix3d plane_from_cam =
      Eigen::Quaterniond::FromTwoVectors(mean, Vector3d::UnitZ()).toRotationMatrix();
  std::vector<Vec2> board, plane;
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    const Vector3d b = plane_from_cam * eigen(bearings[i]);
    if (!(b.z() > least_cosine)) continue;
    board.push_back({p_board[i].x, p_board[i].y});
    plane.push_back({b.x() / b.z(), b.y() / b.z()});
  }
  if (board.size() < corners_for_a_pose) return std::nullopt;
  const auto plane_from_board = find_homography(board, plane);
  if (!plane_from_board) return std::nullopt;
  Matrix3d H =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(plane_from_board->m.data());
  if (!H.allFinite()) return std::nullopt;

  // Columns: the board's x and y axes, and its origin, all in one unknown scale.
  const double scale = 0.5 * (H.col(0).norm() + H.col(1).norm());
  if (!(scale > 0)) return std::nullopt;
  H /= H(2, 2) < 0 ? -scale : scale;
  Matrix3d axes;
  axes << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  const Eigen::JacobiSVD<Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d R = plane_from_cam.transpose() * svd.matrixU() * svd.matrixV().transpose();
  Vector3d t = plane_from_cam.transpose() * H.col(2);
  if (!R.allFinite() || !t.allFinite() || R.determinant() < 0) return std::nullopt;
  const bool rough = effort == PoseEffort::rough;
  double error_rad = refine(bearings, p_board, R, t, rough ? rough_steps : refinement_steps);
  if (rough) return BoardPose{pose_of(R, t), error_rad};

  // The other pose of nearly the same picture: its normal mirrored at the line of sight, turned
  // about the board's middle.
  Vector3d middle = Vector3d::Zero();
  for (const Vec3 p : p_board) middle += eigen(p) / static_cast<double>(p_board.size());
  const Vector3d sight = (R * middle + t).normalized();
  const Vector3d normal = R.col(2);
  const Vector3d mirrored = 2 * normal.dot(sight) * sight - normal;
  Matrix3d other_R = Eigen::Quaterniond::FromTwoVectors(normal, mirrored).toRotationMatrix() * R;
  Vector3d other_t = R * middle + t - other_R * middle;
  const double other_rad = refine(bearings, p_board, other_R, other_t, refinement_steps);
  if (other_rad < error_rad) {
    R = other_R;
    t = other_t;
    error_rad = other_rad;
  }
  if (!std::isfinite(error_rad)) return std::nullopt;
  return BoardPose{pose_of(R, t), error_rad};
}

}  // namespace calibrate
