// Where a lens solve begins, with no guess from the user.
#include "calibrate/lens_seed.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "calibrate/board_pose.h"
#include "capture/median.h"

namespace calibrate {
namespace {

// Focal lengths that are tried, in picture widths: from beyond any fish-eye to a long lens.
constexpr double least_focal = 0.15;
constexpr double most_focal = 12;
constexpr double focal_step = 1.35;
constexpr double fine_step = 1.1;  // around the best of them
// Views and corners that a trial looks at.
constexpr std::size_t trial_views = 10;
constexpr std::size_t trial_corners = 20;

// First corner of each view, and the end; corners are sorted by view.
std::vector<std::size_t> begins_of(std::size_t views, std::span<const SeenCorner> corners) {
  std::vector<std::size_t> begins(views + 1, corners.size());
  for (std::size_t view = 0; view < views; ++view) {
    begins[view] = static_cast<std::size_t>(
        std::ranges::lower_bound(corners, view, {}, &SeenCorner::view) - corners.begin());
  }
  return begins;
}

// All products of powers of a and b up to an order.
Eigen::VectorXd monomials(double a, double b, int order) {
  Eigen::VectorXd m((order + 1) * (order + 2) / 2);
  Eigen::Index at = 0;
  for (int i = 0; i <= order; ++i) {
    for (int j = 0; i + j <= order; ++j) m(at++) = std::pow(a, i) * std::pow(b, j);
  }
  return m;
}

// Flags of one view's corners.
void mark_smooth(const Board& board,
                 std::span<const SeenCorner> corners,
                 std::span<std::uint8_t> smooth) {
  std::ranges::fill(smooth, std::uint8_t{1});
  const int order = corners.size() >= 30 ? 3 : corners.size() >= 15 ? 2 : 0;
  if (order == 0) return;
  const auto columns = static_cast<std::size_t>(board.columns);
  Eigen::MatrixXd A(static_cast<Eigen::Index>(corners.size()), (order + 1) * (order + 2) / 2);
  Eigen::MatrixXd q(A.rows(), 2);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    A.row(row) = monomials(
        2.0 * static_cast<double>(corners[i].index % columns) / (board.columns - 1) - 1,
        2.0 * static_cast<double>(corners[i].index / columns) / (board.rows - 1) - 1, order);
    q.row(row) << corners[i].q.x, corners[i].q.y;
  }
  // Least absolute distances by reweighting, then Cauchy's weights at their own scale.
  constexpr int rounds = 10;
  constexpr double least_px = 0.1;
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(A.rows());
  Eigen::VectorXd distance(A.rows());
  double scale = 0;
  for (int round = 0; round < rounds; ++round) {
    const Eigen::MatrixXd H = A.transpose() * weight.asDiagonal() * A;
    const Eigen::MatrixXd solved = H.ldlt().solve(A.transpose() * weight.asDiagonal() * q);
    distance = (q - A * solved).rowwise().norm();
    scale = std::max(
        capture::median(std::vector<double>(distance.begin(), distance.end())) / 1.1774, least_px);
    for (Eigen::Index i = 0; i < weight.size(); ++i) {
      const double d = distance(i);
      weight(i) =
          round < rounds / 2 ? 1 / std::max(d, least_px) : 1 / (1 + d * d / (scale * scale));
    }
  }
  // Twice as generous as noise would need: what a cubic cannot follow is not wrong.
  constexpr double limit = 8;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    smooth[i] = distance(static_cast<Eigen::Index>(i)) <= limit * scale;
  }
}

// An even choice of a view's corners.
std::vector<std::size_t> choose(std::span<const std::uint8_t> used, std::size_t most) {
  std::vector<std::size_t> all, chosen;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i] != 0) all.push_back(i);
  }
  if (all.size() <= most) return all;
  for (std::size_t i = 0; i < most; ++i) chosen.push_back(all[i * all.size() / most]);
  return chosen;
}

std::optional<BoardPose> pose_of(const Lens& lens,
                                 const Board& board,
                                 Vec2 warp_m,
                                 std::span<const SeenCorner> corners,
                                 std::span<const std::size_t> chosen,
                                 PoseEffort effort = PoseEffort::both) {
  std::vector<Vec2> pixels;
  for (const std::size_t i : chosen) pixels.push_back(corners[i].q);
  const auto directions = unproject_all(lens, pixels);
  std::vector<Vec3> bearings, points;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (!directions[i]) continue;
    bearings.push_back(*directions[i]);
    points.push_back(corner_of(board, warp_m, corners[chosen[i]].index));
  }
  return find_board_pose(bearings, points, effort);
}

Lens one_parameter_lens(const LensForm& form, int width, int height, double focal_px) {
  Lens lens{form.model == "LENSMODEL_PINHOLE" ? "pinhole" : "kannala_brandt",
            width,
            height,
            {focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0}};
  return lens;
}

}  // namespace

std::vector<std::uint8_t> smooth_corners(const Board& board,
                                         std::size_t views,
                                         std::span<const SeenCorner> corners) {
  const std::vector<std::size_t> begins = begins_of(views, corners);
  std::vector<std::uint8_t> smooth(corners.size());
  for (std::size_t view = 0; view < views; ++view) {
    const std::size_t count = begins[view + 1] - begins[view];
    mark_smooth(board, corners.subspan(begins[view], count),
                std::span(smooth).subspan(begins[view], count));
  }
  return smooth;
}

std::optional<SeededPose> seed_pose(const Lens& lens,
                                    const Board& board,
                                    Vec2 warp_m,
                                    std::span<const SeenCorner> corners_of_view,
                                    std::span<const std::uint8_t> used) {
  const auto chosen = choose(used, corners_of_view.size());
  const auto pose = pose_of(lens, board, warp_m, corners_of_view, chosen);
  if (!pose) return std::nullopt;
  double sum = 0;
  std::size_t count = 0;
  for (const std::size_t i : chosen) {
    const Vec3 p = pose->cam_from_board * corner_of(board, warp_m, corners_of_view[i].index);
    const auto q = project(lens, p);
    if (!q) continue;
    const Vec2 seen = corners_of_view[i].q;
    sum += (q->x - seen.x) * (q->x - seen.x) + (q->y - seen.y) * (q->y - seen.y);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return SeededPose{pose->cam_from_board, std::sqrt(sum / static_cast<double>(count))};
}

std::optional<LensSeed> seed_lens(const LensForm& form,
                                  const Board& board,
                                  int width,
                                  int height,
                                  std::size_t views,
                                  std::span<const SeenCorner> corners,
                                  std::span<const std::uint8_t> used) {
  const std::vector<std::size_t> begins = begins_of(views, corners);
  const std::size_t stride = std::max<std::size_t>(1, views / trial_views);
  // Median residual of some views, in pixels, at a focal length in picture widths.
  const auto trial = [&](double focal) {
    const double focal_px = focal * std::max(width, height);
    const Lens lens = one_parameter_lens(form, width, height, focal_px);
    std::vector<double> errors;
    for (std::size_t view = 0; view < views; view += stride) {
      const std::size_t count = begins[view + 1] - begins[view];
      const auto chosen = choose(used.subspan(begins[view], count), trial_corners);
      if (chosen.size() < 6) continue;
      const auto pose =
          pose_of(lens, board, {}, corners.subspan(begins[view], count), chosen, PoseEffort::rough);
      errors.push_back(pose ? pose->error_rad * focal_px : HUGE_VAL);
    }
    return errors.empty() ? HUGE_VAL : capture::median_in_place(errors);
  };
  double best_focal = 0;
  double best_error = HUGE_VAL;
  const auto consider = [&](double focal) {
    const double error = trial(focal);
    if (error < best_error) {
      best_error = error;
      best_focal = focal;
    }
  };
  for (double focal = least_focal; focal < most_focal; focal *= focal_step) consider(focal);
  if (!std::isfinite(best_error)) return std::nullopt;
  const double coarse = best_focal;
  for (const double factor : {1 / fine_step, fine_step}) consider(coarse * factor);

  LensSeed seed;
  seed.error_px = best_error;
  seed.bundle.form = form;
  const Lens lens = one_parameter_lens(form, width, height, best_focal * std::max(width, height));
  seed.bundle.free = free_of(form, lens);
  for (std::size_t view = 0; view < views; ++view) {
    const std::size_t count = begins[view + 1] - begins[view];
    const auto pose = seed_pose(lens, board, {}, corners.subspan(begins[view], count),
                                used.subspan(begins[view], count));
    seed.posed.push_back(pose.has_value());
    seed.bundle.cam_from_board.push_back(pose ? pose->cam_from_board : Pose{});
  }
  return seed;
}

}  // namespace calibrate
