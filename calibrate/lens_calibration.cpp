// A camera's lens from pictures of a board: the whole way, with what it knows of its own error.
#include "calibrate/lens_calibration.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

#include <Eigen/Core>
#include <Eigen/LU>

#include "calibrate/angles.h"
#include "calibrate/lens_seed.h"
#include "calibrate/lens_warnings.h"
#include "calibrate/mrcal_lens.h"
#include "calibrate/view_groups.h"

namespace calibrate {
namespace {

// Two pictures whose corners differ by less than this are one.
constexpr double same_picture_px = 0.1;
// A view is left out if fewer of its corners fit.
constexpr double least_share = 0.5;
// A bend of the board counts from here, in standard deviations.
constexpr double bend_sigmas = 4;
// Corners that miss by this share of the picture's width are not those of the board.
constexpr double hopeless = 0.01;
// Lenses by angle see no farther beyond the farthest corner: there their polynomial is a guess.
constexpr double guess_rad = 10 * degree;

// Whether a view shows the board from behind, as a mirror does: the picture turns the other way
// round than the board.
bool is_mirrored(const Board& board, const BoardView& view) {
  const auto columns = static_cast<std::size_t>(board.columns);
  int turns = 0;
  for (std::size_t i = 0; i + columns + 1 < view.corners.size(); ++i) {
    if (i % columns + 1 == columns) continue;
    const auto& a = view.corners[i];
    const auto& b = view.corners[i + 1];
    const auto& c = view.corners[i + columns];
    if (!a || !b || !c) continue;
    const double area = (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
    turns += area > 0 ? 1 : -1;
  }
  return turns < 0;
}

bool is_same(const BoardView& a, const BoardView& b) {
  std::size_t shared = 0;
  double sum = 0;
  for (std::size_t i = 0; i < a.corners.size(); ++i) {
    if (a.corners[i].has_value() != b.corners[i].has_value()) return false;
    if (!a.corners[i]) continue;
    sum += hypotenuse(a.corners[i]->x - b.corners[i]->x, a.corners[i]->y - b.corners[i]->y);
    ++shared;
  }
  return shared > 0 && sum <= same_picture_px * static_cast<double>(shared);
}

// Empties the views that tell nothing, and says why.
void leave_out(LensProblem& problem, std::vector<ViewReport>& reports) {
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    BoardView& view = problem.views[i];
    ViewReport report{view.name, count_corners(view), 0, 0, "", {}};
    for (std::size_t j = 0; j < i && report.rejected.empty(); ++j) {
      if (is_same(view, problem.views[j])) {
        report.rejected = "shows the board where " + problem.views[j].name + " does";
      }
    }
    if (report.seen == 0) report.rejected = "shows no corner";
    if (report.rejected.empty() && is_mirrored(problem.board, view)) {
      report.rejected = "shows the board mirrored";
    }
    if (!report.rejected.empty()) view.corners.assign(view.corners.size(), std::nullopt);
    reports.push_back(std::move(report));
  }
}

// A robust solve that begins with few parameters and ends with many, so that no outlier is taken
// for the lens, and nothing of the lens for an outlier.
struct Robust {
  LensStart start;
  LensSolve solve;
};
std::optional<Robust> solve_robustly(const LensProblem& problem,
                                     const LensStart& start,
                                     std::span<const LensForm> steps) {
  std::optional<Robust> result;
  for (const LensForm& form : steps) {
    const LensStart& from = result ? result->start : start;
    auto solve = solve_lens(problem, form, from, {.warp = true});
    if (!solve) continue;
    const bool worse = result && (static_cast<double>(count_used(solve->used)) <
                                      0.9 * static_cast<double>(count_used(from.used)) ||
                                  solve->sigma_px > 1.05 * result->solve.sigma_px);
    if (worse) continue;
    LensStart next = start_of(from, *solve);
    result = Robust{std::move(next), std::move(*solve)};
  }
  return result;
}

std::optional<Robust> solve_angular(const LensProblem& problem, const LensStart& start) {
  const std::vector<LensForm> steps{{"kannala_brandt", 1, true},
                                    {"kannala_brandt", 2, true},
                                    {"decentred_kannala_brandt", 4, false}};
  return solve_robustly(problem, start, steps);
}

std::optional<Robust> solve_perspective(const LensProblem& problem, const LensStart& start) {
  const std::vector<LensForm> steps{{"LENSMODEL_OPENCV4", 0, true},
                                    {"LENSMODEL_OPENCV5", 0, false}};
  return solve_robustly(problem, start, steps);
}

// Poses the views again through a solved lens: those that began badly are given another chance.
void pose_again(const LensProblem& problem, Robust& robust) {
  const LensStart& start = robust.start;
  for (std::size_t view = 0; view < problem.views.size(); ++view) {
    const auto begin = static_cast<std::size_t>(
        std::ranges::lower_bound(start.corners, view, {}, &SeenCorner::view) -
        start.corners.begin());
    std::size_t end = begin;
    std::size_t used = 0;
    while (end < start.corners.size() && start.corners[end].view == view) used += start.used[end++];
    if (begin == end || 2 * used >= end - begin) continue;
    const std::span<const SeenCorner> corners =
        std::span(start.corners).subspan(begin, end - begin);
    const std::vector<std::uint8_t> all(corners.size(), 1);
    const auto pose =
        seed_pose(robust.solve.lens, problem.board, robust.solve.bundle.warp_m, corners, all);
    if (!pose) continue;
    robust.start.posed[view] = 1;
    robust.start.bundle.cam_from_board[view] = pose->cam_from_board;
    for (std::size_t i = begin; i < end; ++i) robust.start.used[i] = 1;
  }
}

// Leaves out the views most of whose corners do not fit. Returns whether there were any.
bool leave_out_wrong_views(const LensProblem& problem,
                           LensStart& start,
                           std::vector<ViewReport>& reports) {
  std::vector<std::size_t> seen(reports.size(), 0), used(reports.size(), 0);
  for (std::size_t i = 0; i < start.corners.size(); ++i) {
    ++seen[start.corners[i].view];
    used[start.corners[i].view] += start.used[i];
  }
  bool any = false;
  for (std::size_t view = 0; view < problem.views.size(); ++view) {
    if (!reports[view].rejected.empty()) continue;
    if (start.posed[view] == 0) {
      reports[view].rejected = "shows too little of the board to tell where it is";
    } else if (static_cast<double>(used[view]) < least_share * static_cast<double>(seen[view])) {
      reports[view].rejected =
          std::to_string(seen[view] - used[view]) + " of " + std::to_string(seen[view]) +
          " corners do not fit the others: board moved, blurred, or wrongly found";
    } else {
      continue;
    }
    any = true;
    start.posed[view] = 0;
    for (std::size_t i = 0; i < start.corners.size(); ++i) {
      if (start.corners[i].view == view) start.used[i] = 0;
    }
  }
  return any;
}

// Whether the solve tells that the board is bent.
bool is_bent(const LensProblem& problem, const Robust& robust) {
  const auto n = static_cast<Eigen::Index>(robust.solve.bundle.free.size()) + 2;
  const std::vector<double> told = information(robust.solve.bundle, problem.board,
                                               robust.start.corners, robust.solve.used, true);
  Eigen::MatrixXd info = Eigen::Map<const Eigen::MatrixXd>(told.data(), n, n);
  const Eigen::VectorXd scale = info.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  info = scale.asDiagonal() * info * scale.asDiagonal();
  info.diagonal().array() += 1e-12;
  const Eigen::Matrix2d covariance =
      (scale.asDiagonal() * info.inverse() * scale.asDiagonal()).bottomRightCorner<2, 2>();
  const Eigen::Vector2d bend(robust.solve.bundle.warp_m.x, robust.solve.bundle.warp_m.y);
  const double sigmas = std::sqrt(bend.dot(covariance.inverse() * bend)) / robust.solve.sigma_px;
  return sigmas > bend_sigmas;
}

// The chosen form first, then the others, with their shares of belief by Akaike's weights:
// exp(-AIC / 2), where the noise is that of the form that fits best.
std::vector<BelievedSolve> believed(const LensSelection& selection) {
  const LensCandidate* finest = nullptr;
  for (const LensCandidate& c : selection.candidates) {
    if (c.solve && (finest == nullptr || c.solve->sigma_px < finest->solve->sigma_px)) finest = &c;
  }
  const double variance = selection.twins * finest->solve->sigma_px * finest->solve->sigma_px;
  std::vector<double> criterion;
  for (const LensCandidate& c : selection.candidates) {
    if (!c.solve) {
      criterion.push_back(HUGE_VAL);
      continue;
    }
    const double squares =
        c.solve->rms_px * c.solve->rms_px * static_cast<double>(count_used(c.solve->used));
    criterion.push_back(squares / variance + 2 * static_cast<double>(c.parameters));
  }
  const double least = *std::ranges::min_element(criterion);
  double sum = 0;
  for (const double c : criterion) sum += std::exp(0.5 * (least - c));
  std::vector<BelievedSolve> solves{{&*selection.candidates[selection.chosen].solve,
                                     std::exp(0.5 * (least - criterion[selection.chosen])) / sum}};
  for (std::size_t i = 0; i < criterion.size(); ++i) {
    const double share = std::exp(0.5 * (least - criterion[i])) / sum;
    constexpr double negligible = 1e-3;
    if (i == selection.chosen || !(share > negligible)) continue;
    solves.push_back({&*selection.candidates[i].solve, share});
  }
  return solves;
}

// A spline, if the forms leave something that is not noise and the corners suffice for so many
// parameters. It takes seconds, so it is not tried without need.
void try_spline(const LensProblem& problem, bool warp, LensCalibration& result) {
  const LensSolve& best = *result.selection.candidates[result.selection.best].solve;
  if (agreement_of_neighbours(problem, result.start, best) < suspicious_agreement) return;
  constexpr int knots = 8;
  constexpr std::size_t corners_per_parameter = 40;
  const double farthest_rad = farthest_angle(problem, result.start, best);
  const int field_deg = std::min(2 * static_cast<int>(farthest_rad / degree) + 15, 340);
  const LensForm spline{"LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=" + std::to_string(knots) +
                            "_Ny=" + std::to_string(knots) +
                            "_fov_x_deg=" + std::to_string(field_deg),
                        0, true};
  if (count_used(result.start.used) < corners_per_parameter * free_count(spline)) return;
  try {
    LensSelection more = select_lens(problem, start_of(result.start, best), {&spline, 1}, warp);
    result.selection.add(std::move(more.candidates.front()));
  } catch (const std::runtime_error&) {
    // It cannot be solved, and is not needed.
  }
}

void fill_reports(const LensProblem& problem, LensCalibration& result) {
  const LensSolve& solve = result.solve();
  const auto missed = residuals(solve.bundle, problem.board, result.start.corners);
  for (std::size_t i = 0; i < missed.size(); ++i) {
    if (solve.used[i] == 0) continue;
    ViewReport& view = result.views[result.start.corners[i].view];
    view.rms_px += missed[i]->x * missed[i]->x + missed[i]->y * missed[i]->y;
    ++view.used;
  }
  for (std::size_t i = 0; i < result.views.size(); ++i) {
    ViewReport& view = result.views[i];
    if (view.used == 0) continue;
    view.rms_px = std::sqrt(view.rms_px / static_cast<double>(view.used));
    view.cam_from_board = solve.bundle.cam_from_board[i];
  }
}

// The better of both projections; what it sees decides which forms are tried. Also says whether
// perspective forms were asked for, but the pictures are clearly a fish-eye's.
Robust solve_first(const LensProblem& problem,
                   LensCalibrationOptions::Models models,
                   std::vector<LensForm>& forms,
                   bool& of_fisheye) {
  using Models = LensCalibrationOptions::Models;
  const LensStarts starts = start_lens(problem);
  std::optional<Robust> angular, perspective;
  // A start that is several times worse than the other is of the wrong projection.
  constexpr double far_worse = 3;
  const double angular_px = starts.equidistant.error_px;
  const double perspective_px = starts.pinhole.error_px;
  if (models == Models::angular ||
      (models == Models::any && angular_px < far_worse * perspective_px)) {
    angular = solve_angular(problem, starts.equidistant);
  }
  if (models == Models::perspective ||
      (models == Models::any && perspective_px < far_worse * angular_px)) {
    perspective = solve_perspective(problem, starts.pinhole);
  }
  if (!angular && !perspective) {
    throw std::runtime_error(
        "no lens model can be fitted to these corners: too few were found, or the board has other "
        "numbers of corners");
  }
  const auto worth = [](const Robust& r) {  // corners explained, and how well
    return static_cast<double>(count_used(r.solve.used)) / std::max(r.solve.sigma_px, 0.05);
  };
  if (models == Models::perspective && perspective && far_worse * angular_px < perspective_px) {
    constexpr double clearly = 2;
    const auto other = solve_angular(problem, starts.equidistant);
    of_fisheye = other && worth(*other) > clearly * worth(*perspective);
  }
  const bool by_angle = angular && (!perspective || worth(*angular) > 1.02 * worth(*perspective));
  forms = by_angle ? angular_forms() : perspective_forms();
  if (!by_angle && angular) {
    const std::vector<LensForm> more = angular_forms();
    forms.insert(forms.end(), more.begin(), more.end());
  }
  return by_angle ? std::move(*angular) : std::move(*perspective);
}

}  // namespace

LensCalibration calibrate_lens(const LensProblem& given, const LensCalibrationOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  LensProblem problem = given;
  LensCalibration result;
  check(problem);
  leave_out(problem, result.views);
  std::vector<LensForm> forms;
  Robust robust = solve_first(problem, options.models, forms, result.of_fisheye);
  if (!(robust.solve.sigma_px < hopeless * problem.width)) {
    throw std::runtime_error(
        "the corners miss the best lens by " + std::to_string(std::lround(robust.solve.sigma_px)) +
        " px: they are not corners of this board (is the number of inner corners right?)");
  }
  const LensForm richest = robust.solve.bundle.form;
  const auto solve_again = [&] {
    auto again = solve_lens(problem, richest, robust.start, {.warp = true});
    if (!again) throw std::runtime_error("the solve fails without the pictures that do not fit");
    robust.start = start_of(robust.start, *again);
    robust.solve = std::move(*again);
  };
  pose_again(problem, robust);
  solve_again();
  if (leave_out_wrong_views(problem, robust.start, result.views)) solve_again();

  result.start = robust.start;
  const bool warp = is_bent(problem, robust);
  if (options.form) forms = {*options.form};
  result.selection = select_lens(problem, result.start, forms, warp);
  if (!options.form && options.splines) try_spline(problem, warp, result);
  const LensCandidate& chosen = result.selection.candidates[result.selection.chosen];
  result.form = chosen.form;
  result.warp_m = chosen.solve->bundle.warp_m;
  result.train_rms_px = chosen.solve->rms_px;
  result.heldout_rms_px = chosen.heldout_rms_px;
  // Corners that took no part show all that the solve's own residuals hide.
  result.sigma_px = chosen.solve->sigma_px;
  if (std::isfinite(chosen.heldout_rms_px)) {
    result.sigma_px = std::max(result.sigma_px, chosen.heldout_rms_px / std::numbers::sqrt2);
  }
  // A few views show less of what differs from view to view than there is.
  const std::vector<std::size_t> groups = view_groups(problem.board, problem.views);
  std::set<std::size_t> places;
  for (std::size_t i = 0; i < result.views.size(); ++i) {
    if (result.views[i].rejected.empty()) places.insert(groups[i]);
  }
  result.places = places.size();
  const auto n = static_cast<double>(result.places);
  result.sigma_px *= std::sqrt(n > 1 ? n / (n - 1) : 4.0);
  result.twin_factor = std::sqrt(twin_variance(
      groups, problem.board.corner_count(), result.start.corners,
      residuals(chosen.solve->bundle, problem.board, result.start.corners), chosen.solve->used));
  result.focal = focal_agreement(problem, result.start, *chosen.solve);
  result.overlay.emplace(problem, result.start, believed(result.selection),
                         result.sigma_px * result.focal.error_factor() * result.twin_factor);
  result.coverage_deg = result.overlay->max_angle_rad() / degree;
  result.lens = chosen.solve->lens;
  if (!is_mrcal_model(result.lens.model)) {
    result.lens.max_angle_rad =
        std::min(result.overlay->max_angle_rad() + guess_rad, std::numbers::pi);
  }
  result.lens.error_px = std::min(result.overlay->rms_px(), most_error_px(result.lens));
  fill_reports(problem, result);
  result.warnings = warnings_of(problem, result);
  result.time_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace calibrate
