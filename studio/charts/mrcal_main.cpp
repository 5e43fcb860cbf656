// platelight-mrcal: mrcal's own solver on corners from standard input, for the chart of lenses. It
// aborts on some input, so it is a program of its own.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "calibrate/lens_seed.h"
#include "calibrate/lens_solve.h"
#include "calibrate/rotation_vector.h"
#include "studio/charts/solver_wire.h"

extern "C" {  // mrcal's headers do not say so themselves
#include <mrcal/mrcal.h>
}

namespace {

// One camera at the origin, boards before it.
struct MrcalProblem {
  mrcal_lensmodel_t model{};
  std::vector<double> intrinsics;
  std::vector<mrcal_pose_t> poses;
  std::vector<mrcal_point3_t> corners;  // weight below 0: not seen
  std::vector<mrcal_observation_board_t> views;
  const calibrate::LensProblem* problem = nullptr;
};

struct Moves {
  bool core = false, distortions = false, bend = false;
};

// mrcal's RMS, or below 0 and NaN if it fails.
double optimise(MrcalProblem& p, const Moves& moves) {
  mrcal_problem_selections_t selections{};
  selections.do_optimize_intrinsics_core = moves.core;
  selections.do_optimize_intrinsics_distortions = moves.distortions;
  selections.do_optimize_extrinsics = true;
  selections.do_optimize_frames = true;
  selections.do_optimize_calobject_warp = moves.bend;
  selections.do_apply_regularization = moves.distortions;
  selections.do_apply_outlier_rejection = moves.distortions;
  const int n = static_cast<int>(p.poses.size());
  const calibrate::Board& board = p.problem->board;
  const int state = mrcal_num_states(1, 0, n, 0, 0, n, selections, &p.model);
  const int measurements =
      mrcal_num_measurements(n, 0, board.columns, board.rows, 1, 0, n, 0, 0, selections, &p.model);
  std::vector<double> packed(static_cast<std::size_t>(state));
  std::vector<double> x(static_cast<std::size_t>(measurements));
  mrcal_calobject_warp_t bend{};
  int size[2] = {p.problem->width, p.problem->height};
  mrcal_problem_constants_t constants{};
  const mrcal_stats_t stats =
      mrcal_optimize(packed.data(), state * static_cast<int>(sizeof(double)), x.data(),
                     measurements * static_cast<int>(sizeof(double)), p.intrinsics.data(), nullptr,
                     p.poses.data(), nullptr, moves.bend ? &bend : nullptr, 1, 0, n, 0, 0,
                     p.views.data(), nullptr, n, 0, p.corners.data(), &p.model, size, selections,
                     &constants, board.square_m, board.columns, board.rows, false, false);
  return stats.rms_reproj_error__pixels;
}

// mrcal's own way of several stages; its seed is in Python only, so it begins where ours does.
std::vector<double> solve(const studio::SolverQuestion& question) {
  const bool splined = question.model == 1;
  const calibrate::LensStarts starts = calibrate::start_lens(question.problem);
  const calibrate::LensStart& start = splined ? starts.equidistant : starts.pinhole;
  MrcalProblem p;
  p.problem = &question.problem;
  for (std::size_t view = 0; view < question.problem.views.size(); ++view) {
    const calibrate::Pose& pose = start.bundle.cam_from_board[view];
    const calibrate::Vec3 r = calibrate::rotation_vector(pose.R);
    p.poses.push_back({{{r.x, r.y, r.z}}, {{pose.t.x, pose.t.y, pose.t.z}}});
    p.views.push_back({{0, -1}, static_cast<int>(view)});
    for (const auto& q : question.problem.views[view].corners) {
      p.corners.push_back({{q ? q->x : 0, q ? q->y : 0, q ? 1.0 : -1.0}});
    }
  }
  const double focal = start.bundle.free[0];
  p.intrinsics = {focal, focal, start.bundle.free[1], start.bundle.free[2]};
  mrcal_lensmodel_from_name(&p.model, splined ? "LENSMODEL_STEREOGRAPHIC" : "LENSMODEL_PINHOLE");
  if (!(optimise(p, {}) >= 0) || !(optimise(p, {.core = true}) >= 0)) return {};
  mrcal_lensmodel_from_name(&p.model,
                            splined ? studio::mrcal_splined_model : studio::mrcal_opencv_model);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> tiny(-1e-6, 1e-6);
  p.intrinsics.resize(static_cast<std::size_t>(mrcal_lensmodel_num_params(&p.model)));
  for (std::size_t i = 4; i < p.intrinsics.size(); ++i) p.intrinsics[i] = tiny(random);
  const bool core = !splined;
  if (!(optimise(p, {.core = core, .distortions = true}) >= 0)) return {};
  if (!(optimise(p, {.core = core, .distortions = true, .bend = true}) >= 0)) return {};
  return p.intrinsics;
}

}  // namespace

int main() {
  const auto question = studio::read_question(stdin);
  if (!question) return 1;
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<double> parameters = solve(*question);
  const double time_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  studio::write_answer(stdout, time_ms, parameters);
  return 0;
}
