// One lens of a given form from pictures of a board.
#include "calibrate/lens_solve.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calibrate/lens_seed.h"
#include "capture/median.h"

namespace calibrate {
namespace {

// A corner further off than this many standard deviations is no noise.
constexpr double outlier_sigmas = 4.5;
// Finer than any finder of corners.
constexpr double least_sigma_px = 0.005;
constexpr int rejection_rounds = 6;
// The median of a Rayleigh distribution over its scale.
constexpr double rayleigh_median = 1.1774;

struct Scale {
  double sigma_px = 0;
  std::vector<double> distance_px;  // per corner; infinite where the lens does not see it
};

Scale scale_of(const Bundle& bundle,
               const Board& board,
               const LensStart& start,
               std::span<const std::uint8_t> used) {
  const auto missed = residuals(bundle, board, start.corners);
  Scale scale;
  std::vector<double> in_use;
  for (std::size_t i = 0; i < missed.size(); ++i) {
    const double distance = missed[i] ? hypotenuse(missed[i]->x, missed[i]->y) : HUGE_VAL;
    scale.distance_px.push_back(distance);
    if (used[i] != 0) in_use.push_back(distance);
  }
  if (in_use.empty()) return scale;
  scale.sigma_px = std::max(capture::median_in_place(in_use) / rayleigh_median, least_sigma_px);
  return scale;
}

// Equations less unknowns.
double freedoms(const LensSolve& solve, const LensStart& start) {
  std::vector<std::uint8_t> views(solve.bundle.cam_from_board.size(), 0);
  for (std::size_t i = 0; i < solve.used.size(); ++i) {
    if (solve.used[i] != 0) views[start.corners[i].view] = 1;
  }
  return 2 * static_cast<double>(count_used(solve.used)) -
         static_cast<double>(solve.bundle.free.size() + (solve.warp ? 2 : 0) +
                             6 * count_used(views));
}

std::vector<SeenCorner> corners_of(const LensProblem& problem, std::size_t& not_finite) {
  std::vector<SeenCorner> corners;
  for (std::size_t view = 0; view < problem.views.size(); ++view) {
    const BoardView& seen = problem.views[view];
    for (std::size_t index = 0; index < seen.corners.size(); ++index) {
      if (!seen.corners[index]) continue;
      const Vec2 q = *seen.corners[index];
      const bool inside = std::abs(q.x - 0.5 * problem.width) < problem.width &&
                          std::abs(q.y - 0.5 * problem.height) < problem.height;
      if (inside) {
        corners.push_back({view, index, q});
      } else {
        ++not_finite;
      }
    }
  }
  return corners;
}

LensStart start_with(const LensProblem& problem, LensStart start, const LensForm& form) {
  const auto seed = seed_lens(form, problem.board, problem.width, problem.height,
                              problem.views.size(), start.corners, start.used);
  if (!seed) {
    throw std::runtime_error(
        "no picture shows enough of the board to begin with: 6 corners that "
        "do not lie in one line");
  }
  start.bundle = seed->bundle;
  start.posed = seed->posed;
  start.error_px = seed->error_px;
  for (std::size_t i = 0; i < start.corners.size(); ++i) {
    if (start.posed[start.corners[i].view] == 0) start.used[i] = 0;
  }
  return start;
}

// The corners, and which of them can be right.
LensStart smooth_start(const LensProblem& problem) {
  check(problem);
  LensStart start;
  start.corners = corners_of(problem, start.not_finite);
  start.used = smooth_corners(problem.board, problem.views.size(), start.corners);
  return start;
}

}  // namespace

void check(const LensProblem& problem) {
  check(problem.board);
  if (problem.width < 1 || problem.height < 1) {
    throw std::invalid_argument("the size of the pictures must be above 0");
  }
  for (const BoardView& view : problem.views) {
    if (view.corners.size() == problem.board.corner_count()) continue;
    throw std::invalid_argument(view.name + ": has " + std::to_string(view.corners.size()) +
                                " corners, but the board has " +
                                std::to_string(problem.board.corner_count()));
  }
}

LensForm one_parameter_form(const LensForm& form) {
  if (form.model.starts_with("LENSMODEL_OPENCV") || form.model == "LENSMODEL_PINHOLE") {
    return {"LENSMODEL_PINHOLE", 0, true};
  }
  return {"kannala_brandt", 0, true};
}

LensStarts start_lens(const LensProblem& problem) {
  const LensStart start = smooth_start(problem);
  return {start_with(problem, start, {"kannala_brandt", 0, true}),
          start_with(problem, start, {"LENSMODEL_PINHOLE", 0, true})};
}

LensStart start_lens(const LensProblem& problem, const LensForm& one_parameter) {
  return start_with(problem, smooth_start(problem), one_parameter);
}

std::optional<LensSolve> solve_lens(const LensProblem& problem,
                                    const LensForm& form,
                                    const LensStart& start,
                                    const SolveOptions& options) {
  LensSolve solve;
  solve.warp = options.warp;
  solve.bundle = start.bundle;
  solve.bundle.form = form;
  solve.bundle.free =
      free_of(form, lens_of(start.bundle.form, problem.width, problem.height, start.bundle.free));
  if (!options.warp) solve.bundle.warp_m = {};
  solve.used = start.used;
  const auto behind = [&](const Scale& scale) {  // what this form's lens cannot see
    bool any = false;
    for (std::size_t i = 0; i < solve.used.size(); ++i) {
      if (solve.used[i] == 0 || std::isfinite(scale.distance_px[i])) continue;
      solve.used[i] = 0;
      any = true;
    }
    return any;
  };
  Scale scale = scale_of(solve.bundle, problem.board, start, solve.used);
  if (options.keep_used && behind(scale)) return std::nullopt;
  behind(scale);
  if (freedoms(solve, start) < 1) return std::nullopt;
  if (!options.keep_used) {
    // From afar: the loss follows the residuals down.
    for (int round = 0; round < 2; ++round) {
      minimise(solve.bundle, problem.board, start.corners, solve.used,
               {true, options.warp && round > 0, 2 * scale.sigma_px, 12});
      scale = scale_of(solve.bundle, problem.board, start, solve.used);
    }
  }
  for (int round = 0; round < rejection_rounds; ++round) {
    if (!options.keep_used) {
      std::vector<std::uint8_t> within(solve.used.size(), 0);
      for (std::size_t i = 0; i < within.size(); ++i) {
        within[i] = start.posed[start.corners[i].view] != 0 &&
                    scale.distance_px[i] < outlier_sigmas * scale.sigma_px;
      }
      if (round > 0 && within == solve.used) break;
      solve.used = std::move(within);
      if (freedoms(solve, start) < 1) return std::nullopt;
    }
    solve.converged = minimise(solve.bundle, problem.board, start.corners, solve.used,
                               {true, options.warp, 0, options.keep_used ? 15 : 50});
    scale = scale_of(solve.bundle, problem.board, start, solve.used);
    if (options.keep_used) break;
  }
  double sum = 0;
  for (std::size_t i = 0; i < solve.used.size(); ++i) {
    if (solve.used[i] != 0) sum += scale.distance_px[i] * scale.distance_px[i];
  }
  if (!std::isfinite(sum)) return std::nullopt;
  solve.sigma_px = std::sqrt(sum / freedoms(solve, start));
  solve.rms_px = std::sqrt(sum / static_cast<double>(count_used(solve.used)));
  solve.lens = lens_of(form, problem.width, problem.height, solve.bundle.free);
  try {
    check(solve.lens);
  } catch (const std::invalid_argument&) {
    return std::nullopt;  // a focal length below 0
  }
  return solve;
}

double farthest_angle(const LensProblem& problem, const LensStart& start, const LensSolve& solve) {
  double farthest_rad = 0;
  for (std::size_t i = 0; i < start.corners.size(); ++i) {
    if (solve.used[i] == 0) continue;
    const SeenCorner& corner = start.corners[i];
    const Vec3 p = solve.bundle.cam_from_board[corner.view] *
                   corner_of(problem.board, solve.bundle.warp_m, corner.index);
    farthest_rad = std::max(farthest_rad, std::atan2(hypotenuse(p.x, p.y), p.z));
  }
  return farthest_rad;
}

std::size_t count_used(std::span<const std::uint8_t> used) {
  return static_cast<std::size_t>(std::ranges::count_if(used, [](auto flag) { return flag != 0; }));
}

LensStart start_of(const LensStart& before, const LensSolve& solve) {
  LensStart start = before;
  start.bundle = solve.bundle;
  start.used = solve.used;
  start.error_px = solve.rms_px;
  return start;
}

}  // namespace calibrate
