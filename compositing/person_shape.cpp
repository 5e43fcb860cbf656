// What a person is shown as.
#include "compositing/person_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "compositing/billboard_place.h"

namespace compositing {
namespace {

using std::numbers::pi;
constexpr double most_m = 1;
// What is chosen counts as so much better than it is.
constexpr double loyalty = 0.85;

// Between two directions, 0..pi.
double between(double a, double b) { return std::abs(std::remainder(a - b, 2 * pi)); }

}  // namespace

double billboard_error_m(double view_angle_rad, double off_plane_m) {
  return parallax_m(off_plane_m, std::min(std::abs(view_angle_rad), pi / 2));
}

double hull_error_m(std::span<const double> cameras_rad, double view_rad) {
  if (cameras_rad.size() < 2) return most_m;
  // The lines that are next to the view's, on either side; a line comes again after half a turn.
  double left = pi, right = pi, nearest = pi;
  for (const double camera : cameras_rad) {
    const double turned = std::remainder(camera - view_rad, pi);
    const double ahead = turned < 0 ? turned + pi : turned;
    left = std::min(left, ahead);
    right = std::min(right, pi - ahead);
    nearest = std::min(nearest, between(camera, view_rad));
  }
  if (!std::isfinite(left + right + nearest)) return most_m;
  const double half_gap = (left + right) / 2, off = std::min(left, right);
  constexpr double line = 1e-6;
  double error = 0;
  if (off > line) {
    const double corner = std::cos(half_gap - off) / std::max(std::cos(half_gap), line);
    error = std::min(half_width_m * (corner - 1), most_m);
  }
  return nearest > pi / 2 + line ? std::max(error, off_foot_m) : error;
}

ShapeChoice choose_shape(const ShapeQuestion& question, const std::optional<ShapeChoice>& before) {
  const auto& cameras = question.cameras;
  if (cameras.empty()) throw std::invalid_argument("a person needs a camera");
  const bool any_good = std::ranges::any_of(cameras, &ShapeCamera::is_good);
  const auto off = [&](std::size_t i) {
    return between(cameras[i].azimuth_rad, question.view_rad);
  };
  const auto error_of = [&](std::size_t i) {
    return billboard_error_m(off(i), question.off_plane_m);
  };
  const auto may_show = [&](std::size_t i) { return cameras[i].is_good || !any_good; };
  std::vector<double> good;
  std::optional<std::size_t> nearest;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i].is_good) good.push_back(cameras[i].azimuth_rad);
    if (may_show(i) && (!nearest || off(i) < off(*nearest))) nearest = i;
  }
  const double asked = question.error_m;
  if (before && before->camera < cameras.size() && may_show(before->camera)) {
    const bool alone_holds = error_of(*nearest) <= asked && error_of(before->camera) > asked;
    if (!alone_holds && loyalty * off(before->camera) <= off(*nearest)) nearest = before->camera;
  }
  ShapeChoice choice;
  choice.camera = *nearest;
  choice.view_rad = off(*nearest);
  const double billboard = error_of(*nearest), hull = hull_error_m(good, question.view_rad);
  choice.hull_error_m = hull;
  const bool was_hull = before && before->hull;
  if (question.wanted != PersonShape::billboard && good.size() >= 2 && question.hull_is_there) {
    const bool holds = hull <= asked;
    if (question.wanted == PersonShape::hull) {
      choice.hull = true;
    } else if (billboard > (was_hull && holds ? loyalty * asked : asked)) {
      choice.hull = holds || (was_hull ? loyalty * hull < billboard : hull < loyalty * billboard);
    }
  }
  choice.error_m = choice.hull ? hull : billboard;
  choice.holds = choice.error_m <= asked;
  return choice;
}

}  // namespace compositing
