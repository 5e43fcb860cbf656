// The smallest lens form that suffices, by corners that took no part in its solve.
#include "calibrate/lens_selection.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "calibrate/view_groups.h"
#include "capture/parallel_loop.h"

namespace calibrate {
namespace {

constexpr std::size_t most_folds = 5;
constexpr double most_worse = 1.05;  // whatever chance may explain
// Sum of squares that chance may explain, in variances of a coordinate: three standard deviations.
constexpr double tolerance = 9;

double sum_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

// Which corners are left out together.
struct Folds {
  std::size_t count = 0;
  bool whole_views = true;         // else a part of each view
  std::vector<std::size_t> group;  // per corner
};

// Whole views, those of a board held still together, dealt in an order that does not follow theirs;
// quarters of the board where there are too few of them to do without one.
Folds deal(const LensProblem& problem, const LensStart& start) {
  const std::vector<std::size_t> groups = view_groups(problem.board, problem.views);
  std::vector<std::uint8_t> in_use(start.posed.size(), 0);
  for (std::size_t i = 0; i < start.corners.size(); ++i) {
    if (start.used[i] != 0) in_use[groups[start.corners[i].view]] = 1;
  }
  std::vector<std::size_t> views;  // the first of each group
  for (std::size_t view = 0; view < in_use.size(); ++view) {
    if (in_use[view] != 0) views.push_back(view);
  }
  Folds folds;
  folds.whole_views = views.size() >= most_folds;
  folds.count = folds.whole_views ? most_folds : 4;
  const auto scattered = [](std::size_t view) { return (view * 2654435761U + 12345U) & 0xffffU; };
  std::ranges::stable_sort(views, {}, scattered);
  std::vector<std::size_t> group_of_view(in_use.size(), 0);
  for (std::size_t i = 0; i < views.size(); ++i) group_of_view[views[i]] = i % folds.count;
  const auto columns = static_cast<std::size_t>(problem.board.columns);
  for (const SeenCorner& corner : start.corners) {
    const bool right = 2 * (corner.index % columns) >= columns;
    const bool low = 2 * corner.index >= problem.board.corner_count();
    folds.group.push_back(folds.whole_views ? group_of_view[groups[corner.view]]
                                            : (right ? 1U : 0U) + (low ? 2U : 0U));
  }
  return folds;
}

// Adds the squared distances of one group's corners to `squares`, whose solve they took no part in.
// Returns false if the solve fails without them.
bool judge_group(const LensProblem& problem,
                 const LensStart& start,
                 const LensSolve& whole,
                 const Folds& folds,
                 std::size_t fold,
                 std::vector<double>& squares) {
  LensStart others = start_of(start, whole);
  std::vector<std::uint8_t> ours = others.used;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    (folds.group[i] == fold ? others.used : ours)[i] = 0;
  }
  const auto solve =
      solve_lens(problem, whole.bundle.form, others, {.warp = whole.warp, .keep_used = true});
  if (!solve) return false;
  const auto add = [&](const Bundle& bundle, std::span<const std::uint8_t> took_part) {
    const auto missed = residuals(bundle, problem.board, start.corners);
    for (std::size_t i = 0; i < missed.size(); ++i) {
      if (ours[i] == 0 || took_part[i] != 0) continue;
      if (!missed[i]) return false;
      squares[start.corners[i].view] += missed[i]->x * missed[i]->x + missed[i]->y * missed[i]->y;
    }
    return true;
  };
  if (!folds.whole_views) return add(solve->bundle, others.used);
  const auto columns = static_cast<std::size_t>(problem.board.columns);
  for (std::size_t parity = 0; parity < 2; ++parity) {
    std::vector<std::uint8_t> posing = ours;
    for (std::size_t i = 0; i < posing.size(); ++i) {
      const std::size_t index = start.corners[i].index;
      if ((index % columns + index / columns) % 2 == parity) posing[i] = 0;
    }
    Bundle bundle = solve->bundle;
    minimise(bundle, problem.board, start.corners, posing,
             {.move_lens = false, .move_warp = false, .loss_px = 0, .max_iterations = 20});
    if (!add(bundle, posing)) return false;
  }
  return true;
}

LensCandidate judge(const LensProblem& problem,
                    const LensStart& start,
                    const LensForm& form,
                    bool warp,
                    const Folds& folds) {
  const auto begin = std::chrono::steady_clock::now();
  LensCandidate candidate{form, free_count(form), {}, HUGE_VAL, {}, 0};
  candidate.heldout_squares.assign(problem.views.size(), 0.0);
  candidate.solve = solve_lens(problem, form, start, {.warp = warp, .keep_used = true});
  bool judged = candidate.solve.has_value();
  for (std::size_t fold = 0; judged && fold < folds.count; ++fold) {
    judged = judge_group(problem, start, *candidate.solve, folds, fold, candidate.heldout_squares);
  }
  if (judged) {
    const double sum = sum_of(candidate.heldout_squares);
    const auto corners = static_cast<double>(std::ranges::count(start.used, std::uint8_t{1}));
    candidate.heldout_rms_px = std::sqrt(sum / corners);
    if (!std::isfinite(sum)) candidate.heldout_rms_px = HUGE_VAL;
  }
  candidate.time_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return candidate;
}

// Against the best one, whose corners miss by noise alone, `twins` of them alike.
bool suffices(const LensCandidate& candidate, const LensCandidate& best, double twins) {
  if (!(candidate.heldout_rms_px <= most_worse * best.heldout_rms_px)) return false;
  // Of a coordinate.
  const double variance = twins * 0.5 * best.heldout_rms_px * best.heldout_rms_px;
  return sum_of(candidate.heldout_squares) - sum_of(best.heldout_squares) <= tolerance * variance;
}

// The best and the smallest that suffices.
void choose(LensSelection& selection) {
  std::ranges::stable_sort(selection.candidates, {}, &LensCandidate::parameters);
  const auto& all = selection.candidates;
  // Without held-out views, the smallest form that can be solved at all.
  const auto error_of = [](const LensCandidate& c) {
    return c.solve ? c.heldout_rms_px : std::nan("");
  };
  bool any = false;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].solve) continue;
    if (!any || error_of(all[i]) < error_of(all[selection.best])) selection.best = i;
    any = true;
  }
  if (!any) {
    throw std::runtime_error(
        "no lens model can be fitted to these corners: they are too few, or "
        "are not corners of this board");
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i != selection.best &&
        !(all[i].solve && suffices(all[i], all[selection.best], selection.twins)))
      continue;
    selection.chosen = i;
    break;
  }
}

}  // namespace

std::vector<LensForm> angular_forms() {
  std::vector<LensForm> forms;
  for (const bool one_focal : {true, false}) {
    for (std::size_t terms = 0; terms <= 4; ++terms) {
      forms.push_back({"kannala_brandt", terms, one_focal});
      if (terms > 0) forms.push_back({"decentred_kannala_brandt", terms, one_focal});
    }
  }
  return forms;
}

std::vector<LensForm> perspective_forms() {
  std::vector<LensForm> forms;
  for (const bool one_focal : {true, false}) {
    for (const char* model :
         {"LENSMODEL_PINHOLE", "LENSMODEL_OPENCV4", "LENSMODEL_OPENCV5", "LENSMODEL_OPENCV8"}) {
      forms.push_back({model, 0, one_focal});
    }
  }
  return forms;
}

LensSelection select_lens(const LensProblem& problem,
                          const LensStart& start,
                          std::span<const LensForm> forms,
                          bool warp) {
  if (forms.empty()) throw std::invalid_argument("there is no lens form to choose from");
  LensSelection selection;
  const Folds folds = deal(problem, start);
  selection.folds = folds.count;
  selection.candidates.resize(forms.size());
  capture::parallel_for(std::size_t{0}, forms.size(), [&](std::size_t i) {
    selection.candidates[i] = judge(problem, start, forms[i], warp, folds);
  });
  choose(selection);
  const LensSolve& best = *selection.candidates[selection.best].solve;
  selection.twins =
      twin_variance(view_groups(problem.board, problem.views), problem.board.corner_count(),
                    start.corners, residuals(best.bundle, problem.board, start.corners), best.used);
  if (selection.twins > 1) choose(selection);
  return selection;
}

void LensSelection::add(LensCandidate candidate) {
  candidates.push_back(std::move(candidate));
  choose(*this);
}

}  // namespace calibrate
