// Where the cameras of a rig stand to each other, from boards that several of them see.
#include "calibrate/rig.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>

#include "calibrate/board_pose.h"
#include "calibrate/rig_bundle.h"
#include "calibrate/words.h"
#include "capture/median.h"

namespace calibrate {
namespace {

constexpr std::size_t least_corners = 6;  // of a view
constexpr double most_wrong_px = 20;      // of a view's residual, in comparing starts

// A board before one camera.
struct Seen {
  std::vector<Sight> sights;
  Pose cam_from_board;
};

// Per camera, per instant.
using AllSeen = std::vector<std::vector<std::optional<Seen>>>;

void check(const RigProblem& problem, const RigOptions& options) {
  check(problem.board);
  if (!(options.noise_px > 0)) throw std::invalid_argument("expected noise must be above 0");
  if (problem.cameras.size() < 2) throw std::invalid_argument("a rig has two cameras or more");
  for (const RigCamera& camera : problem.cameras) {
    check(camera.lens);
    if (camera.name.empty() ||
        std::ranges::count(problem.cameras, camera.name, &RigCamera::name) > 1) {
      throw std::invalid_argument("each camera of a rig has a name of its own, not \"" +
                                  camera.name + "\"");
    }
    if (camera.views.size() != problem.cameras[0].views.size()) {
      throw std::invalid_argument("camera " + camera.name + " has not as many views as " +
                                  problem.cameras[0].name);
    }
    for (const BoardView& view : camera.views) {
      if (!view.corners.empty() && view.corners.size() != problem.board.corner_count()) {
        throw std::invalid_argument("a view of camera " + camera.name +
                                    " has not as many corners as the board");
      }
    }
  }
}

std::optional<Seen> seen_by(const RigCamera& camera, const BoardView& view, const Board& board) {
  Seen seen;
  std::vector<Vec3> bearings, p_board;
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    if (!view.corners[i]) continue;
    const auto sight = sight_of(camera.lens, *view.corners[i], corner_of(board, i));
    if (!sight) continue;
    seen.sights.push_back(*sight);
    bearings.push_back(sight->v_cam);
    p_board.push_back(sight->p_set);
  }
  if (seen.sights.size() < least_corners) return std::nullopt;
  const auto pose = find_board_pose(bearings, p_board);
  if (!pose) return std::nullopt;
  constexpr double loss_px = 1;
  seen.cam_from_board = refine_pose(seen.sights, pose->cam_from_board, loss_px, 20).cam_from_set;
  return seen;
}

double rms_px(std::span<const Sight> sights, const Pose& cam_from_board) {
  double sum = 0;
  for (const Sight& sight : sights) {
    const Vec2 r = residual_of(sight, cam_from_board);
    sum += r.x * r.x + r.y * r.y;
  }
  return std::sqrt(sum / static_cast<double>(sights.size()));
}

// How a view may be counted, as places of the board in its own frame: as it is and, for
// chessboards, from the other end; from all four corners of those that a quarter turn leaves alike.
std::vector<Pose> countings(const Board& board) {
  std::vector<Pose> result{Pose{}};
  if (board.kind != Board::Kind::chessboard) return result;
  const Vec3 last = corner_of(board, board.corner_count() - 1);
  result.push_back({{{-1, 0, 0, 0, -1, 0, 0, 0, 1}}, last});
  if (quarters_alike(board) == 1) {
    result.push_back({{{0, -1, 0, 1, 0, 0, 0, 0, 1}}, {last.x, 0, 0}});
    result.push_back({{{0, 1, 0, -1, 0, 0, 0, 0, 1}}, {0, last.y, 0}});
  }
  return result;
}

struct Best {
  Pose pose;
  double error_px = HUGE_VAL;
  bool told = true;  // from the other ways to count
};

// b_from_a that explains best what camera b saw at all instants, from one of them. Of a board that
// never moves all countings explain as much: it is counted as it is.
Best relation(const std::vector<std::optional<Seen>>& a,
              const std::vector<std::optional<Seen>>& b,
              const std::vector<Pose>& countings) {
  constexpr double clearly = 0.8;
  Best best;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!a[i] || !b[i]) continue;
    Best of_instant;
    std::vector<double> errors;
    for (const Pose& counting : countings) {
      const Pose b_from_a = b[i]->cam_from_board * counting * inverse(a[i]->cam_from_board);
      double error = 0;
      for (std::size_t k = 0; k < a.size(); ++k) {
        if (!a[k] || !b[k]) continue;
        double least = most_wrong_px;
        for (const Pose& other : countings) {
          least = std::min(least, rms_px(b[k]->sights, b_from_a * a[k]->cam_from_board * other));
        }
        error += least;
      }
      if (error < clearly * of_instant.error_px) of_instant = {b_from_a, error};
      errors.push_back(error);
    }
    of_instant.told = std::ranges::count_if(errors, [&](double error) {
                        return !(of_instant.error_px < clearly * error);
                      }) == 1;
    if (of_instant.error_px < best.error_px) best = of_instant;
  }
  return best;
}

std::size_t shared_views(const std::vector<std::optional<Seen>>& a,
                         const std::vector<std::optional<Seen>>& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += a[i] && b[i] ? 1 : 0;
  return count;
}

struct PlacedCameras {
  std::vector<Pose> cam_from_rig;
  std::vector<std::size_t> untold;  // placed as one of several ways to count has it
};

// Camera by camera, the next one that shares the most views with one that is placed.
PlacedCameras start_cameras(const RigProblem& problem,
                            const AllSeen& seen,
                            const std::vector<Pose>& countings) {
  const std::size_t count = problem.cameras.size();
  std::vector<std::optional<Pose>> cam_from_rig(count);
  cam_from_rig[0] = Pose{};
  PlacedCameras placed;
  for (;;) {
    std::size_t most = 0, from = 0, to = 0;
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = 0; b < count; ++b) {
        if (!cam_from_rig[a] || cam_from_rig[b]) continue;
        const std::size_t shared = shared_views(seen[a], seen[b]);
        if (shared > most) {
          most = shared;
          from = a;
          to = b;
        }
      }
    }
    if (most == 0) break;
    const Best found = relation(seen[from], seen[to], countings);
    cam_from_rig[to] = found.pose * *cam_from_rig[from];
    if (!found.told) placed.untold.push_back(to);
  }
  std::string lost;
  for (std::size_t i = 0; i < count; ++i) {
    if (!cam_from_rig[i]) lost += (lost.empty() ? "" : ", ") + problem.cameras[i].name;
    placed.cam_from_rig.push_back(cam_from_rig[i].value_or(Pose{}));
  }
  if (!lost.empty()) {
    throw std::runtime_error("no board is seen at one instant by " + problem.cameras[0].name +
                             "'s group of cameras and by these: " + lost +
                             "; take pictures of the board where their views overlap");
  }
  return placed;
}

// The corners of all boards that two cameras or more see, counted from the same end.
struct Start {
  RigBundle bundle;
  std::vector<RigCorner> corners;
  std::vector<std::size_t> instants;  // of the bundle's boards
  std::vector<std::size_t> untold;    // cameras, of PlacedCameras
};

Start start_rig(const RigProblem& problem, const AllSeen& seen) {
  const std::vector<Pose> ways = countings(problem.board);
  Start start;
  PlacedCameras placed = start_cameras(problem, seen, ways);
  start.bundle.cam_from_rig = std::move(placed.cam_from_rig);
  start.untold = std::move(placed.untold);
  for (std::size_t instant = 0; instant < problem.cameras[0].views.size(); ++instant) {
    std::vector<std::size_t> who;
    for (std::size_t c = 0; c < seen.size(); ++c) {
      if (seen[c][instant]) who.push_back(c);
    }
    if (who.size() < 2) continue;
    const std::size_t first = *std::ranges::max_element(
        who, {}, [&](std::size_t c) { return seen[c][instant]->sights.size(); });
    const Pose rig_from_board =
        inverse(start.bundle.cam_from_rig[first]) * seen[first][instant]->cam_from_board;
    for (const std::size_t c : who) {
      const Pose cam_from_board = start.bundle.cam_from_rig[c] * rig_from_board;
      const Pose way = *std::ranges::min_element(ways, {}, [&](const Pose& counting) {
        return rms_px(seen[c][instant]->sights, cam_from_board * counting);
      });
      for (Sight sight : seen[c][instant]->sights) {
        sight.p_set = way * sight.p_set;
        start.corners.push_back({c, start.instants.size(), sight});
      }
    }
    start.bundle.rig_from_board.push_back(rig_from_board);
    start.instants.push_back(instant);
  }
  return start;
}

double length_px(const RigCorner& corner, const RigBundle& bundle) {
  const Vec2 r = residual_of(
      corner.sight, bundle.cam_from_rig[corner.camera] * bundle.rig_from_board[corner.board]);
  return std::hypot(r.x, r.y);
}

// Of each coordinate, by the median length of residuals.
double robust_sigma(const Start& start) {
  std::vector<double> lengths;
  for (const RigCorner& corner : start.corners) lengths.push_back(length_px(corner, start.bundle));
  constexpr double median_of_rayleigh = 1.17741;
  return capture::median_in_place(lengths) / median_of_rayleigh;
}

// Solves, and says which corners are in use.
std::vector<std::uint8_t> solve(Start& start, double noise_px) {
  constexpr double most_sigmas = 4.5;
  std::vector<std::uint8_t> used(start.corners.size(), 1);
  bool solved = true;
  for (int round = 0; round < 3; ++round) {
    const double sigma = std::max(robust_sigma(start), noise_px / 4);
    solved = solved && minimise(start.bundle, start.corners, used, 2 * sigma);
  }
  for (int round = 0; round < 5; ++round) {
    const double most = most_sigmas * std::max(robust_sigma(start), noise_px / 4);
    const std::vector<std::uint8_t> before = used;
    for (std::size_t i = 0; i < used.size(); ++i) {
      used[i] = length_px(start.corners[i], start.bundle) <= most ? 1 : 0;
    }
    solved = solved && minimise(start.bundle, start.corners, used, 0);
    if (used == before && round > 0) break;
  }
  if (!solved) {
    throw std::runtime_error(
        "the cameras' boards do not agree on a rig: check that pictures belong to the same "
        "instants, and that each lens is its camera's");
  }
  return used;
}

// Corners of one camera at one instant.
struct Share {
  std::size_t used = 0;
  std::size_t all = 0;
};

std::string instant_name(const RigProblem& problem, std::size_t instant) {
  const std::string& name = problem.cameras[0].views[instant].name;
  return name.empty() ? "number " + std::to_string(instant) : name;
}

std::string words_of(const std::vector<std::string>& instants) {
  constexpr std::size_t most = 5;
  std::string words;
  for (std::size_t i = 0; i < std::min(most, instants.size()); ++i) {
    words += (i == 0 ? "" : ", ") + instants[i];
  }
  if (instants.size() > most) words += " and " + std::to_string(instants.size() - most) + " more";
  return words;
}

// Counts corners and boards in use. Throws if most of a camera's are not, warns if many are not.
void judge(RigFit& fit,
           const RigProblem& problem,
           const Start& start,
           std::span<const std::uint8_t> used) {
  constexpr double many = 0.1;
  const std::size_t boards = start.instants.size();
  std::vector<Share> shares(problem.cameras.size() * boards);
  for (std::size_t i = 0; i < used.size(); ++i) {
    const RigCorner& corner = start.corners[i];
    Share& share = shares[corner.camera * boards + corner.board];
    share.used += used[i];
    ++share.all;
  }
  std::string worst;
  double least = 1;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    RigCameraFit& camera = fit.cameras[c];
    std::vector<std::string> wrong;
    for (std::size_t b = 0; b < boards; ++b) {
      const Share& share = shares[c * boards + b];
      if (share.all == 0) continue;
      ++camera.views;
      camera.corners += share.used;
      camera.left_out += share.all - share.used;
      if (2 * share.used >= share.all) {
        ++camera.boards;
      } else {
        wrong.push_back(instant_name(problem, start.instants[b]));
      }
    }
    const std::size_t all = camera.corners + camera.left_out;
    if (all == 0) continue;
    const double kept = static_cast<double>(camera.corners) / static_cast<double>(all);
    const std::string left_out =
        std::to_string(camera.left_out) + " of " + std::to_string(all) + " corners";
    if (2 * camera.corners < all || 2 * camera.boards < camera.views ||
        (camera.boards < 2 && camera.views > 1)) {
      if (worst.empty() || kept < least) {
        least = kept;
        worst = "the boards of camera " + problem.cameras[c].name +
                " do not agree with the others' (" + left_out + " are far off" +
                (wrong.empty() ? "" : "; the instants " + words_of(wrong)) +
                "): check that pictures belong to the same instants, and that each lens is its "
                "camera's";
      }
    } else if (!wrong.empty()) {
      fit.warnings.push_back(problem.cameras[c].name +
                             ": most of the board does not agree with the other cameras', and is "
                             "left out, at these instants: " +
                             words_of(wrong));
    } else if (1 - kept > many) {
      fit.warnings.push_back(problem.cameras[c].name + ": " + left_out +
                             " do not agree with the other cameras' and are left out");
    }
  }
  if (!worst.empty()) throw std::runtime_error(worst);
}

// Of boards that pictures do not tell the turn of.
void warn_of_countings(RigFit& fit, const RigProblem& problem, const Start& start) {
  const int quarters = quarters_alike(problem.board);
  if (quarters == 0) return;
  for (const std::size_t camera : start.untold) {
    fit.warnings.push_back(problem.cameras[camera].name + ": the board looks alike after " +
                           (quarters == 1 ? "a quarter of a turn" : "half a turn") +
                           ", and no instant tells from which corner this camera's was counted: "
                           "its pose may be wrong; tilt the board and move it about, or take one "
                           "of an odd and an even number of corners");
  }
}

// What boards' own relations of the cameras differ by.
struct InstantSpread {
  double squares = 0;    // px^2
  double freedoms = 0;   // more than the cameras have
  double of_lenses = 0;  // px^2
  double variance = 0;   // px^2, of a coordinate, by each board's own residuals

  // What of it noise of the corners has to explain.
  double excess() const { return std::max(squares - of_lenses, 0.0) / freedoms; }
};

std::optional<InstantSpread> spread_of(std::span<const BoardPull> boards,
                                       double squares,
                                       double freedoms,
                                       std::size_t cameras) {
  InstantSpread spread;
  for (const BoardPull& board : boards) {
    spread.squares += board.squares;
    spread.freedoms += board.freedoms;
    spread.of_lenses += board.of_lenses;
  }
  spread.freedoms -= 6.0 * static_cast<double>(cameras - 1);
  if (!(spread.freedoms > 0)) return std::nullopt;
  spread.variance = (squares - spread.squares) / std::max(freedoms - spread.freedoms, 1.0);
  return spread;
}

// Warns of instants that differ by more than chance lets them.
void judge_spread(RigFit& fit,
                  const RigProblem& problem,
                  const Start& start,
                  const InstantSpread& spread,
                  std::span<const BoardPull> boards,
                  double noise_px) {
  constexpr double chance_sigmas = 3;
  constexpr double least_doubt = 2;
  const double variance = std::max(spread.variance, noise_px * noise_px);
  fit.chi_squared = spread.squares / (variance * spread.freedoms + spread.of_lenses);
  // Wilson and Hilferty, "The Distribution of Chi-Square", PNAS 17, 1931.
  const double v = 2 / (9 * spread.freedoms);
  const double most = std::max(least_doubt, std::pow(1 - v + chance_sigmas * std::sqrt(v), 3));
  if (*fit.chi_squared <= most) return;
  std::vector<std::size_t> order;
  for (std::size_t b = 0; b < boards.size(); ++b) {
    if (boards[b].squares > most * (variance * boards[b].freedoms + boards[b].of_lenses)) {
      order.push_back(b);
    }
  }
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [&](std::size_t b) { return boards[b].squares; });
  constexpr std::size_t most_named = 3;
  order.resize(std::min(order.size(), most_named));
  std::string farthest;
  for (const std::size_t b : order) {
    farthest +=
        (farthest.empty() ? "; farthest off: " : ", ") + instant_name(problem, start.instants[b]);
  }
  fit.warnings.push_back(
      words("the instants do not agree on how the cameras stand, by %.1f times what noise lets "
            "them: did the board move before cameras that are not in step, is it longer one way or "
            "bent, or a lens off? The uncertainty told is as much larger",
            std::sqrt(*fit.chi_squared)) +
      farthest);
}

// The camera's own part of everything's covariance.
void tell_uncertainty(RigCameraFit& fit,
                      const RigCovariance& all,
                      std::size_t index,
                      std::size_t count,
                      double sigma_px) {
  const std::size_t n = 6 * (count - 1);
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      const std::size_t at = n * (6 * (index - 1) + i) + 6 * (index - 1) + j;
      fit.covariance[6 * i + j] = sigma_px * sigma_px * all.of_noise[at] + all.of_lenses[at];
    }
  }
  if (!std::ranges::all_of(fit.covariance, [](double value) { return std::isfinite(value); })) {
    throw std::runtime_error("the rig's uncertainty cannot be told: the numbers are too large");
  }
  const auto& m = fit.covariance;
  fit.turn_sigma_rad = std::sqrt(m[0] + m[7] + m[14]);
  fit.position_sigma_m = std::sqrt(m[21] + m[28] + m[35]);
}

}  // namespace

RigFit fit_rig(const RigProblem& problem, const RigOptions& options) {
  check(problem, options);
  AllSeen seen;
  for (const RigCamera& camera : problem.cameras) {
    seen.emplace_back();
    for (const BoardView& view : camera.views) {
      seen.back().push_back(seen_by(camera, view, problem.board));
    }
  }
  Start start = start_rig(problem, seen);
  const std::vector<std::uint8_t> used = solve(start, options.noise_px);

  RigFit fit;
  fit.cameras.resize(problem.cameras.size());
  fit.rig_from_board.resize(problem.cameras[0].views.size());
  for (std::size_t b = 0; b < start.instants.size(); ++b) {
    fit.rig_from_board[start.instants[b]] = start.bundle.rig_from_board[b];
  }
  judge(fit, problem, start, used);
  warn_of_countings(fit, problem, start);
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    RigCameraFit& camera = fit.cameras[start.corners[i].camera];
    if (used[i] == 0) continue;
    const double r = length_px(start.corners[i], start.bundle);
    camera.rms_px += r * r;
    squares += r * r;
    ++count;
  }
  fit.rms_px = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(count, 1)));
  const double freedoms =
      2.0 * static_cast<double>(count) -
      6.0 * static_cast<double>(start.instants.size() + problem.cameras.size() - 1);
  double sigma_px = std::max(options.noise_px, std::sqrt(squares / std::max(freedoms, 1.0)));
  std::vector<LensError> errors;
  for (const RigCamera& camera : problem.cameras) errors.push_back(error_of(camera.lens));
  const RigCovariance all = covariance(start.bundle, start.corners, used, errors);
  if (all.of_noise.empty()) {
    throw std::runtime_error("the boards leave a camera's pose open: take more pictures of them");
  }
  if (const auto spread = spread_of(all.boards, squares, freedoms, problem.cameras.size())) {
    judge_spread(fit, problem, start, *spread, all.boards, options.noise_px);
    sigma_px = std::max(sigma_px, std::sqrt(spread->excess()));
  }
  for (std::size_t c = 0; c < fit.cameras.size(); ++c) {
    RigCameraFit& camera = fit.cameras[c];
    camera.cam_from_rig = start.bundle.cam_from_rig[c];
    camera.rms_px =
        std::sqrt(camera.rms_px / static_cast<double>(std::max<std::size_t>(camera.corners, 1)));
    if (c > 0) tell_uncertainty(camera, all, c, fit.cameras.size(), sigma_px);
  }
  return fit;
}

}  // namespace calibrate
