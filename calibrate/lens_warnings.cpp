// What an operator should know of a lens calibration, in plain words.
#include "calibrate/lens_warnings.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "calibrate/angles.h"
#include "calibrate/words.h"
#include "capture/median.h"

namespace calibrate {
namespace {

// From these on, something is said.
constexpr double scatter_px = 1;
constexpr double bend_m = 0.0005;
constexpr double outlier_share = 0.05;
constexpr std::size_t few_views = 5;
constexpr double tilt_rad = 8 * degree;
constexpr double unseen_share = 0.25;  // of the picture that the lens sees
constexpr double large_error_px = 3;
// Pictures that lie farthest off are named: so many at most, of such a deviation.
constexpr std::size_t most_named = 3;
constexpr double named_sigmas = 3;
// Fish-eyes show nothing beyond, and the picture is black there.
constexpr double image_circle_rad = 95 * degree;

void warn_of_corners(const LensProblem& problem,
                     const LensCalibration& c,
                     std::vector<std::string>& warnings) {
  std::size_t seen = 0;
  std::size_t used = 0;
  for (const ViewReport& view : c.views) {
    if (!view.rejected.empty()) {
      warnings.push_back(view.name + ": left out: " + view.rejected);
      continue;
    }
    seen += view.seen;
    used += view.used;
  }
  if (c.start.not_finite > 0) {
    warnings.push_back(words("%zu corners are no numbers or far outside of the picture; left out",
                             c.start.not_finite));
  }
  if (static_cast<double>(seen - used) > outlier_share * static_cast<double>(seen)) {
    warnings.push_back(words("%.0f %% of the corners do not fit: check how they were found",
                             100 * static_cast<double>(seen - used) / static_cast<double>(seen)));
  }
  if (c.sigma_px > scatter_px) {
    warnings.push_back(
        words("corners scatter by %.1f px: blurred or moving pictures, or a board that is not flat",
              c.sigma_px));
  }
  if (hypotenuse(c.warp_m.x, c.warp_m.y) > bend_m) {
    warnings.push_back(words("the board is bent by %.1f mm; that is taken into account",
                             1000 * hypotenuse(c.warp_m.x, c.warp_m.y)));
  }
  const double agreement = agreement_of_neighbours(problem, c.start, c.solve());
  if (agreement > suspicious_agreement) {
    warnings.push_back(
        words("residuals of neighbouring corners agree (correlation %.2f): something is not in the "
              "model, such as a rolling shutter, a moving board or one that is bent in another way",
              agreement));
  }
}

void warn_of_views(const LensCalibration& c, std::vector<std::string>& warnings) {
  std::size_t used = 0;
  double most_tilt = 0;
  for (const ViewReport& view : c.views) {
    if (!view.cam_from_board) continue;
    ++used;
    const Mat3& R = view.cam_from_board->R;
    const Vec3 normal{R.m[2], R.m[5], R.m[8]};
    // How far the boards are turned against each other, not against the line of sight: boards in
    // one plane tell nothing wherever they are.
    for (const ViewReport& other : c.views) {
      if (!other.cam_from_board) continue;
      const Mat3& S = other.cam_from_board->R;
      const Vec3 theirs{S.m[2], S.m[5], S.m[8]};
      most_tilt =
          std::max(most_tilt, std::atan2(length(cross(normal, theirs)), dot(normal, theirs)));
    }
  }
  if (used < few_views) {
    warnings.push_back(
        words("only %zu pictures could be used: take 10 or more, over the whole picture", used));
  } else if (c.places < few_views) {
    warnings.push_back(
        words("%zu pictures show the board in %zu places only, where it was held still: move it "
              "to 10 or more, over the whole picture",
              used, c.places));
  }
  if (used > 1 && most_tilt < tilt_rad) {
    warnings.push_back(
        words("all boards face the same way (within %.0f degrees): the focal length and the "
              "distance cannot be told apart; tilt the board by 30 degrees and more",
              most_tilt / degree));
  }
}

// A lens that is fitted to pictures of two has an error that no spread foretells, so it is not only
// told as larger.
void warn_of_focal_lengths(const LensCalibration& c, std::vector<std::string>& warnings) {
  if (!c.focal.disagree()) return;
  std::vector<std::size_t> order;
  for (std::size_t view = 0; view < c.views.size(); ++view) {
    if (c.focal.views[view]) order.push_back(view);
  }
  std::ranges::sort(order, std::greater{}, [&](std::size_t v) { return c.focal.deviation(v); });
  std::string named;
  for (std::size_t i = 0; i < std::min(order.size(), most_named); ++i) {
    if (i > 0 && c.focal.deviation(order[i]) < named_sigmas) break;
    const double off = c.focal.views[order[i]]->factor / c.focal.mean_factor - 1;
    named += (i > 0 ? ", " : "") + c.views[order[i]].name + words(" (%+.1f %%)", 100 * off);
  }
  warnings.push_back(
      "the pictures do not agree on one focal length (zoom or focus changed, a rolling shutter, or "
      "a board that is not flat or longer one way); farthest off: " +
      named +
      words(". The error is told %.1f times larger, but if zoom or focus changed it is larger yet "
            "and the lens not to be trusted: take them anew with one zoom and focus",
            c.focal.error_factor()));
}

// Beyond the image circle of a fish-eye there is nothing to see; such lenses fill their pictures.
bool is_perspective(const LensForm& form) {
  return form.model == "LENSMODEL_PINHOLE" || form.model.starts_with("LENSMODEL_OPENCV") ||
         form.model == "LENSMODEL_CAHVOR";
}

void warn_of_coverage(const LensProblem& problem,
                      const LensCalibration& c,
                      std::vector<std::string>& warnings) {
  constexpr int columns = 48;
  const int rows = std::max(1, columns * problem.height / problem.width);
  std::size_t seen = 0;
  std::size_t unknown = 0;
  std::size_t blind = 0;
  double farthest_rad = 0;
  std::vector<double> errors;
  // Up to where the lens shows anything; its polynomial has no say on that.
  Lens whole = c.lens;
  whole.max_angle_rad = std::numbers::pi;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const Vec2 q{(x + 0.5) * problem.width / columns, (y + 0.5) * problem.height / rows};
      const auto v = unproject(whole, q);
      if (!v) {
        if (is_perspective(c.form)) ++blind;
        continue;
      }
      const double off_rad = std::atan2(hypotenuse(v->x, v->y), v->z);
      if (off_rad > std::max(image_circle_rad, c.coverage_deg * degree)) continue;
      ++seen;
      farthest_rad = std::max(farthest_rad, off_rad);
      const auto error = c.overlay->at(q);
      if (error) errors.push_back(*error);
      if (!error) ++unknown;
    }
  }
  if (blind > 0) {
    warnings.push_back(
        words("the lens is blind in %.1f %% of the picture, for its polynomial turns back there: "
              "take pictures with the board at the rim and in the corners, or let --model name a "
              "simpler form",
              100.0 * static_cast<double>(blind) / (columns * rows)) +
        (is_perspective(c.form) ? "; or, of a wide lens, let -o name a .toml and --model be fisheye"
                                : ""));
  }
  seen += blind;
  unknown += blind;
  if (static_cast<double>(unknown) > unseen_share * static_cast<double>(seen)) {
    warnings.push_back(words("no corners in %.0f %% of the picture: the lens is a guess there",
                             100 * static_cast<double>(unknown) / static_cast<double>(seen)));
  }
  if (farthest_rad > 1.1 * c.coverage_deg * degree) {
    warnings.push_back(
        words("no corners beyond %.0f degrees off the axis: the rim is a guess", c.coverage_deg));
  }
  if (errors.empty()) return;
  const double error_px = capture::median_in_place(errors);
  if (error_px > large_error_px) {
    warnings.push_back(
        words("a virtual object may be off by %.0f px in half of the picture: take more pictures, "
              "tilted in all directions",
              error_px));
  }
}

}  // namespace

// Noise differs from corner to corner; what is left of a wrong model does not.
double agreement_of_neighbours(const LensProblem& problem,
                               const LensStart& start,
                               const LensSolve& solve) {
  const auto missed = residuals(solve.bundle, problem.board, start.corners);
  const auto columns = static_cast<std::size_t>(problem.board.columns);
  double together = 0;
  double alone = 0;
  for (std::size_t i = 0; i + 1 < missed.size(); ++i) {
    const SeenCorner& a = start.corners[i];
    const SeenCorner& b = start.corners[i + 1];
    const bool neighbours = a.view == b.view && b.index == a.index + 1 && b.index % columns != 0;
    if (!neighbours || solve.used[i] == 0 || solve.used[i + 1] == 0) continue;
    together += missed[i]->x * missed[i + 1]->x + missed[i]->y * missed[i + 1]->y;
    alone += 0.5 * (missed[i]->x * missed[i]->x + missed[i]->y * missed[i]->y +
                    missed[i + 1]->x * missed[i + 1]->x + missed[i + 1]->y * missed[i + 1]->y);
  }
  return alone > 0 ? together / alone : 0;
}

std::vector<std::string> warnings_of(const LensProblem& problem,
                                     const LensCalibration& calibration) {
  std::vector<std::string> warnings;
  if (calibration.of_fisheye) {
    // All else that is wrong with such a lens comes of it.
    warnings.emplace_back(
        "these are a fish-eye's pictures, which no perspective lens explains: let -o name a .toml, "
        "without --model or with --model fisheye");
    return warnings;
  }
  warn_of_corners(problem, calibration, warnings);
  warn_of_views(calibration, warnings);
  warn_of_focal_lengths(calibration, warnings);
  warn_of_coverage(problem, calibration, warnings);
  return warnings;
}

}  // namespace calibrate
