// Rigs of several cameras before a board.
#include "calibrate/rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/calibrate/made_markers.h"

namespace calibrate::rig_test {
namespace {

using made::degree;
using testing::HasSubstr;

Board made_board() { return {Board::Kind::chessboard, 9, 6, .05, 0, ""}; }

Lens normal_lens() {
  return {"LENSMODEL_OPENCV4", 1280, 720, {900, 900, 640, 360, -.1, .02, 0, 0}};
}

struct MadeRig {
  RigProblem problem;
  std::vector<Pose> cam_from_rig;
};

// A plate camera, a second one beside it and rolled, and a fish-eye that looks up between them. The
// board moves before them; each sees it if it is in its picture.
MadeRig made_rig(std::size_t instants,
                 double noise_px,
                 unsigned seed,
                 const Board& of_rig = made_board()) {
  made::Random random(seed);
  MadeRig rig;
  rig.problem.board = of_rig;
  rig.problem.cameras = {
      {"plate", normal_lens(), {}}, {"side", normal_lens(), {}}, {"probe", made::fish_eye(), {}}};
  const Pose first = look_at({0, 0, 1.5}, {0, 3, 1.2}, 0.02);
  const std::vector<Pose> cam_from_set{first, look_at({0.8, 0.1, 1.4}, {0, 2, 1.2}, 2.6),
                                       pose_from_axis({0.3, 0.6, 1.0}, {0.1, 0.3, 1}, 0.7)};
  for (const Pose& pose : cam_from_set) rig.cam_from_rig.push_back(pose * inverse(first));
  const Board& board = rig.problem.board;
  const Vec3 middle = corner_of(board, board.corner_count() - 1) * 0.5;
  for (std::size_t i = 0; i < instants; ++i) {
    const Vec3 at{random.uniform(-0.5, 0.7), random.uniform(1.4, 2.6), random.uniform(0.9, 1.8)};
    const Pose facing = look_at(at, {random.uniform(-0.5, 1), 0, random.uniform(0.8, 2)},
                                random.uniform(-0.5, 0.5));
    // The board's z points away from who sees it: turn it to face the cameras.
    Pose set_from_board = inverse(facing);
    set_from_board = set_from_board * Pose{{{-1, 0, 0, 0, 1, 0, 0, 0, -1}}, {}};
    set_from_board.t = at - set_from_board.R * middle;
    for (std::size_t c = 0; c < cam_from_set.size(); ++c) {
      RigCamera& camera = rig.problem.cameras[c];
      BoardView view{"instant " + std::to_string(i), {}};
      for (std::size_t k = 0; k < board.corner_count(); ++k) {
        const auto q =
            project(camera.lens, cam_from_set[c] * (set_from_board * corner_of(board, k)));
        const bool inside = q && q->x > 0 && q->y > 0 && q->x < camera.lens.width - 1 &&
                            q->y < camera.lens.height - 1;
        view.corners.push_back(inside ? std::optional(Vec2{q->x + noise_px * random.normal(),
                                                           q->y + noise_px * random.normal()})
                                      : std::nullopt);
      }
      camera.views.push_back(view);
    }
  }
  return rig;
}

// As of cameras that are not in step: the second one sees each board moved, by so much along each
// axis.
void move_boards(MadeRig& rig, double by_m, double noise_px, unsigned seed) {
  made::Random random(seed);
  RigCamera& first = rig.problem.cameras[0];
  RigCamera& second = rig.problem.cameras[1];
  const Board& board = rig.problem.board;
  const RigFit truth = fit_rig(rig.problem);
  for (std::size_t i = 0; i < second.views.size(); ++i) {
    const auto& rig_from_board = truth.rig_from_board[i];
    if (!rig_from_board) continue;
    Pose moved = *rig_from_board;
    moved.t += Vec3{by_m * random.normal(), by_m * random.normal(), by_m * random.normal()};
    for (std::size_t k = 0; k < board.corner_count(); ++k) {
      for (RigCamera* camera : {&first, &second}) {
        auto& corner = camera->views[i].corners[k];
        const Pose& pose = camera == &first ? *rig_from_board : moved;
        const Pose& cam = rig.cam_from_rig[camera == &first ? 0 : 1];
        const auto q = project(camera->lens, cam * (pose * corner_of(board, k)));
        if (corner && q) {
          corner = Vec2{q->x + noise_px * random.normal(), q->y + noise_px * random.normal()};
        }
      }
    }
  }
}

constexpr const char* disagreement = "the instants do not agree on how the cameras stand";

std::string reason_of(const RigProblem& problem) {
  try {
    fit_rig(problem);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "accepted";
}

TEST(FitRig, FindsTheCamerasWithinTheirUncertainty) {
  double squares = 0;
  int count = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    const MadeRig rig = made_rig(15, 0.3, seed);
    const RigFit fit = fit_rig(rig.problem);
    EXPECT_EQ(fit.cameras[0].cam_from_rig, Pose{});
    EXPECT_EQ(fit.cameras[0].turn_sigma_rad, 0);
    for (std::size_t c = 1; c < 3; ++c) {
      const RigCameraFit& camera = fit.cameras[c];
      const made::PoseError error = made::error_of(camera.cam_from_rig, rig.cam_from_rig[c]);
      EXPECT_LT(error.turn_rad, 0.1 * degree) << seed << " " << c;
      EXPECT_LT(error.position_m, 0.003) << seed << " " << c;
      EXPECT_LT(camera.turn_sigma_rad, 0.06 * degree);
      EXPECT_LT(camera.position_sigma_m, 0.002);
      EXPECT_NEAR(camera.rms_px, 0.3 * std::sqrt(2.0), 0.1);
      EXPECT_EQ(camera.left_out, 0U);
      Registration of_camera;
      of_camera.cam_from_set = camera.cam_from_rig;
      of_camera.covariance = camera.covariance;
      squares += made::chi_square(of_camera, rig.cam_from_rig[c]);
      count += 6;
    }
  }
  EXPECT_GT(squares / count, 0.5);
  EXPECT_LT(squares / count, 1.7);
}

TEST(FitRig, KnowsThatInstantsDifferByMoreThanNoise) {
  // The median of the error over what is told: of cameras in step and not.
  for (const double by_m : {0.0, 0.001, 0.003}) {
    std::vector<double> shares;
    int warned = 0;
    constexpr unsigned seeds = 8;
    for (unsigned seed = 0; seed < seeds; ++seed) {
      MadeRig rig = made_rig(20, 0.3, seed);
      rig.problem.cameras.pop_back();
      move_boards(rig, by_m, 0.3, seed + 100);
      const RigFit fit = fit_rig(rig.problem);
      const made::PoseError error =
          made::error_of(fit.cameras[1].cam_from_rig, rig.cam_from_rig[1]);
      shares.push_back(error.position_m / fit.cameras[1].position_sigma_m);
      const bool told = std::ranges::any_of(fit.warnings, [](const std::string& warning) {
        return warning.find(disagreement) != std::string::npos;
      });
      EXPECT_EQ(told, fit.chi_squared.value() > 2) << by_m << " " << seed;
      warned += told ? 1 : 0;
    }
    std::ranges::sort(shares);
    EXPECT_LT(shares[seeds / 2], 1.8) << by_m;
    EXPECT_GT(shares[seeds / 2], 0.3) << by_m;
    EXPECT_EQ(warned, by_m > 0 ? static_cast<int>(seeds) : 0) << by_m;
  }
}

TEST(FitRig, PassesOverWrongCornersAndMissingViews) {
  MadeRig rig = made_rig(15, 0.2, 3);
  made::Random random(5);
  std::size_t wrong = 0;
  for (RigCamera& camera : rig.problem.cameras) {
    for (BoardView& view : camera.views) {
      if (random.uniform(0, 1) < 0.2) view.corners.clear();
      for (auto& q : view.corners) {
        if (!q || random.uniform(0, 1) > 0.05) continue;
        q->x += random.uniform(5, 25);
        ++wrong;
      }
    }
  }
  const RigFit fit = fit_rig(rig.problem);
  std::size_t left_out = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    left_out += fit.cameras[c].left_out;
    if (c == 0) continue;
    const made::PoseError error = made::error_of(fit.cameras[c].cam_from_rig, rig.cam_from_rig[c]);
    EXPECT_LT(error.turn_rad, 5 * fit.cameras[c].turn_sigma_rad);
    EXPECT_LT(error.position_m, 5 * fit.cameras[c].position_sigma_m);
    EXPECT_LT(fit.cameras[c].position_sigma_m, 0.003);
  }
  EXPECT_GT(left_out, wrong / 3);
  EXPECT_LE(left_out, wrong);
}

TEST(FitRig, FindsOutFromWhichEndAChessboardWasCounted) {
  MadeRig rig = made_rig(12, 0.2, 4);
  for (std::size_t i = 0; i < 12; i += 2)
    std::ranges::reverse(rig.problem.cameras[1].views[i].corners);
  const RigFit fit = fit_rig(rig.problem);
  const made::PoseError error = made::error_of(fit.cameras[1].cam_from_rig, rig.cam_from_rig[1]);
  EXPECT_LT(error.turn_rad, 0.1 * degree);
  EXPECT_LT(error.position_m, 0.003);
}

TEST(FitRig, FindsOutFromWhichCornerASquareBoardWasCounted) {
  MadeRig rig = made_rig(12, 0.2, 4, {Board::Kind::chessboard, 8, 8, .04, 0, ""});
  for (std::size_t i = 0; i < 12; ++i) {
    auto& corners = rig.problem.cameras[1].views[i].corners;
    const std::size_t quarters = i % 4;
    for (std::size_t turn = 0; turn < quarters; ++turn) {
      const auto before = corners;
      for (std::size_t k = 0; k < 64; ++k) corners[k] = before[8 * (k % 8) + 7 - k / 8];
    }
  }
  const RigFit fit = fit_rig(rig.problem);
  const made::PoseError error = made::error_of(fit.cameras[1].cam_from_rig, rig.cam_from_rig[1]);
  EXPECT_LT(error.turn_rad, 0.1 * degree);
  EXPECT_LT(error.position_m, 0.003);
  EXPECT_EQ(fit.cameras[1].left_out, 0U);
}

TEST(FitRig, WarnsWhereNothingTellsFromWhichEndABoardWasCounted) {
  const Board alike{Board::Kind::chessboard, 8, 6, .05, 0, ""};
  const auto of_still = [](const Board& board) {
    MadeRig rig = made_rig(12, 0.2, 4, board);
    rig.problem.cameras.pop_back();
    const auto sees_all = [](const RigCamera& camera, std::size_t i) {
      return count_corners(camera.views[i]) == camera.views[i].corners.size();
    };
    std::size_t shown = 0;
    while (!sees_all(rig.problem.cameras[0], shown) || !sees_all(rig.problem.cameras[1], shown)) {
      if (++shown == 12) throw std::runtime_error("no board is seen whole by both");
    }
    for (RigCamera& camera : rig.problem.cameras) camera.views = {camera.views[shown]};
    return fit_rig(rig.problem).warnings;
  };
  EXPECT_THAT(of_still(alike), testing::ElementsAre(HasSubstr("side: the board looks alike")));
  EXPECT_TRUE(of_still(made_board()).empty());
  EXPECT_TRUE(fit_rig(made_rig(12, 0.2, 4, alike).problem).warnings.empty());
}

TEST(FitRig, ChainsCamerasThatNeverSeeTheSame) {
  // The first and the last share no instant, but both share some with the one between.
  MadeRig rig = made_rig(24, 0.2, 6);
  for (std::size_t i = 0; i < 24; ++i) {
    rig.problem.cameras[i < 12 ? 2 : 0].views[i].corners.clear();
  }
  const RigFit fit = fit_rig(rig.problem);
  for (std::size_t c = 1; c < 3; ++c) {
    const made::PoseError error = made::error_of(fit.cameras[c].cam_from_rig, rig.cam_from_rig[c]);
    EXPECT_LT(error.turn_rad, 4 * fit.cameras[c].turn_sigma_rad);
    EXPECT_LT(error.position_m, 4 * fit.cameras[c].position_sigma_m);
  }
  EXPECT_GT(fit.cameras[2].position_sigma_m, fit.cameras[1].position_sigma_m);
}

TEST(FitRig, RaisesItsUncertaintyIfALensIsWrong) {
  MadeRig rig = made_rig(15, 0.2, 7);
  const double before = fit_rig(rig.problem).cameras[1].position_sigma_m;
  rig.problem.cameras[1].lens.parameters[0] *= 1.03;
  rig.problem.cameras[1].lens.parameters[1] *= 0.99;
  const RigFit fit = fit_rig(rig.problem);
  EXPECT_GT(fit.cameras[1].position_sigma_m, 1.5 * before);
}

TEST(FitRig, TellsWhatItsLensesAreOffBy) {
  made::Random random(11);
  std::vector<double> shares;
  for (unsigned seed = 0; seed < 8; ++seed) {
    MadeRig rig = made_rig(10, 0.05, seed);
    rig.problem.cameras.pop_back();
    const double unaware = fit_rig(rig.problem).cameras[1].position_sigma_m;
    for (RigCamera& camera : rig.problem.cameras) {
      Lens& lens = camera.lens;
      const Lens truth = lens;
      const double scale = 1 + 0.002 * random.normal();
      lens.parameters[0] *= scale;
      lens.parameters[1] *= scale;
      lens.parameters[4] += 0.005 * random.normal();
      double squares = 0;
      for (int i = 0; i < 81; ++i) {
        const Vec2 q{160.0 * (i % 9), 90.0 * (i / 9)};
        const Vec2 seen = project(lens, *unproject(truth, q)).value();
        squares += squared(Vec2{seen.x - q.x, seen.y - q.y}) / (2 * 81);
      }
      lens.error_px = std::sqrt(squares);
    }
    const RigFit fit = fit_rig(rig.problem);
    const made::PoseError error = made::error_of(fit.cameras[1].cam_from_rig, rig.cam_from_rig[1]);
    EXPECT_GT(fit.cameras[1].position_sigma_m, 3 * unaware);
    shares.push_back(error.position_m / fit.cameras[1].position_sigma_m);
  }
  std::ranges::sort(shares);
  EXPECT_LT(shares[6], 2.5);
  EXPECT_GT(shares[4], 0.15);  // not by telling just anything
}

TEST(FitRig, RefusesACameraWhosePicturesAreOfOtherInstants) {
  MadeRig rig = made_rig(12, 0.1, 4);
  auto& views = rig.problem.cameras[1].views;
  std::ranges::rotate(views, views.begin() + 1);
  for (std::size_t i = 0; i < 12; ++i) views[i].name = "instant " + std::to_string(i);
  EXPECT_THAT(reason_of(rig.problem), HasSubstr("the boards of camera side do not agree"));
  rig.problem.cameras.pop_back();
  EXPECT_THAT(reason_of(rig.problem), HasSubstr("the boards of camera side do not agree"));
  EXPECT_THAT(reason_of(rig.problem), HasSubstr("instant"));
}

TEST(FitRig, NamesInstantsThatDoNotBelongTogether) {
  MadeRig rig = made_rig(12, 0.1, 4);
  EXPECT_TRUE(fit_rig(rig.problem).warnings.empty());
  auto& views = rig.problem.cameras[1].views;
  std::swap(views[2].corners, views[7].corners);
  const RigFit fit = fit_rig(rig.problem);
  EXPECT_THAT(fit.warnings, testing::Contains(testing::AllOf(HasSubstr("side: "),
                                                             HasSubstr("instant 2, instant 7"))));
  const made::PoseError error = made::error_of(fit.cameras[1].cam_from_rig, rig.cam_from_rig[1]);
  EXPECT_LT(error.position_m, 0.003);
}

TEST(FitRig, CountsABoardThatNeverMovesAsItIs) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    MadeRig rig = made_rig(1, 0.1, seed);
    for (RigCamera& camera : rig.problem.cameras) {
      camera.views.resize(5, camera.views[0]);
    }
    const RigFit fit = fit_rig(rig.problem);
    for (std::size_t c = 1; c < 3; ++c) {
      const made::PoseError error =
          made::error_of(fit.cameras[c].cam_from_rig, rig.cam_from_rig[c]);
      EXPECT_LT(error.position_m, 0.05);
    }
  }
}

TEST(FitRig, NamesCamerasThatShareNoView) {
  MadeRig rig = made_rig(12, 0.2, 8);
  for (BoardView& view : rig.problem.cameras[2].views) view.corners.clear();
  EXPECT_THAT(reason_of(rig.problem), HasSubstr("these: probe;"));
  for (BoardView& view : rig.problem.cameras[1].views) view.corners.clear();
  EXPECT_THAT(reason_of(rig.problem), HasSubstr("these: side, probe;"));
}

TEST(FitRig, RefusesWhatIsNoRig) {
  const MadeRig rig = made_rig(3, 0.2, 9);
  RigProblem problem = rig.problem;
  problem.cameras.resize(1);
  EXPECT_THROW(fit_rig(problem), std::invalid_argument);
  problem = rig.problem;
  problem.cameras[1].name = "plate";
  EXPECT_THROW(fit_rig(problem), std::invalid_argument);
  problem = rig.problem;
  problem.cameras[1].views.pop_back();
  EXPECT_THROW(fit_rig(problem), std::invalid_argument);
  problem = rig.problem;
  problem.cameras[1].views[0].corners.resize(5);
  EXPECT_THROW(fit_rig(problem), std::invalid_argument);
  EXPECT_THROW(fit_rig(rig.problem, {.noise_px = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace calibrate::rig_test
