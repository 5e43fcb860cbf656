// How a camera maps directions to pixels.
#include "calibrate/lens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calibrate/axial_lens.h"
#include "calibrate/mrcal_lens.h"

namespace calibrate {
namespace {

constexpr int max_picture_px = 1 << 16;

struct Range {
  std::size_t least, most;
};

// How many parameters a model takes.
Range parameter_counts(const std::string& model) {
  if (is_mrcal_model(model)) {
    const auto n = static_cast<std::size_t>(count_mrcal_parameters(model));
    return {n, n};
  }
  const auto kind = AxialLens::kind_of(model);
  if (!kind) {
    throw std::invalid_argument("unknown lens model \"" + model +
                                "\"; known are pinhole, equisolid, kannala_brandt, "
                                "decentred_kannala_brandt and mrcal's "
                                "LENSMODEL_...");
  }
  switch (*kind) {
    case AxialLens::Kind::pinhole:
      return {4, 4};
    case AxialLens::Kind::equisolid:
      return {3, 3};
    case AxialLens::Kind::decentred_kannala_brandt:
      return {6, 10};
    case AxialLens::Kind::kannala_brandt:
      break;
  }
  return {4, 8};
}

bool has_one_focal_length(const Lens& lens) { return lens.model == "equisolid"; }

}  // namespace

void check(const Lens& lens) {
  const auto [least, most] = parameter_counts(lens.model);
  const std::size_t n = lens.parameters.size();
  if (n < least || n > most) {
    throw std::invalid_argument("lens model " + lens.model + " takes " + std::to_string(least) +
                                (most > least ? " to " + std::to_string(most) : "") +
                                " parameters, not " + std::to_string(n));
  }
  if (lens.width < 1 || lens.height < 1 || lens.width > max_picture_px ||
      lens.height > max_picture_px) {
    throw std::invalid_argument("a lens's picture must be from 1x1 to 65536x65536 pixels, not " +
                                std::to_string(lens.width) + "x" + std::to_string(lens.height));
  }
  if (!std::ranges::all_of(lens.parameters, [](double p) { return std::isfinite(p); })) {
    throw std::invalid_argument("a lens's parameters must be finite");
  }
  const std::size_t focal_lengths = has_one_focal_length(lens) ? 1 : 2;
  for (std::size_t i = 0; i < focal_lengths; ++i) {
    if (!(lens.parameters[i] > 0)) throw std::invalid_argument("a focal length must be above 0");
  }
  if (!(lens.max_angle_rad > 0 && lens.max_angle_rad <= std::numbers::pi)) {
    throw std::invalid_argument("a lens's largest angle must be above 0 and at most 180 degrees");
  }
  if (!(lens.error_px >= 0 && lens.error_px <= most_error_px(lens))) {
    throw std::invalid_argument(
        "a lens's error must be 0 or above, and at most its picture's diagonal");
  }
}

double most_error_px(const Lens& lens) { return std::hypot(lens.width, lens.height); }

std::optional<Vec2> project(const Lens& lens, Vec3 v_cam) {
  check(lens);
  if (is_mrcal_model(lens.model)) return project_by_mrcal(lens, {&v_cam, 1}).front();
  return AxialLens(lens).project(v_cam);
}

std::vector<std::optional<Vec2>> project_all(const Lens& lens, std::span<const Vec3> v_cam) {
  check(lens);
  if (is_mrcal_model(lens.model)) return project_by_mrcal(lens, v_cam);
  const AxialLens axial(lens);
  std::vector<std::optional<Vec2>> pixels;
  pixels.reserve(v_cam.size());
  for (const Vec3& v : v_cam) pixels.push_back(axial.project(v));
  return pixels;
}

std::optional<Vec3> unproject(const Lens& lens, Vec2 q) {
  check(lens);
  if (is_mrcal_model(lens.model)) return unproject_by_mrcal(lens, {&q, 1}).front();
  return AxialLens(lens).unproject(q);
}

std::vector<std::optional<Vec3>> unproject_all(const Lens& lens, std::span<const Vec2> q) {
  check(lens);
  if (is_mrcal_model(lens.model)) return unproject_by_mrcal(lens, q);
  const AxialLens axial(lens);
  std::vector<std::optional<Vec3>> directions;
  directions.reserve(q.size());
  for (const Vec2& pixel : q) directions.push_back(axial.unproject(pixel));
  return directions;
}

Lens cropped(const Lens& lens, int x, int y, int width, int height) {
  Lens part = lens;
  part.width = width;
  part.height = height;
  const std::size_t centre = has_one_focal_length(lens) ? 1 : 2;
  part.parameters.at(centre) -= x;
  part.parameters.at(centre + 1) -= y;
  part.error_px = std::min(part.error_px, most_error_px(part));
  check(part);
  return part;
}

Lens resized(const Lens& lens, int width, int height) {
  check(lens);
  Lens result = lens;
  result.width = width;
  result.height = height;
  const double sx = static_cast<double>(width) / lens.width;
  const double sy = static_cast<double>(height) / lens.height;
  std::vector<double>& p = result.parameters;
  std::size_t centre = 2;
  if (has_one_focal_length(lens)) {
    // The one focal length can follow rounded sizes, but no squeezed picture.
    if (std::abs(sx / sy - 1) * std::min(width, height) > 1) {
      throw std::invalid_argument(
          "an equisolid lens cannot be squeezed: its picture must keep its "
          "aspect; use kannala_brandt");
    }
    p[0] *= std::sqrt(sx * sy);
    centre = 1;
  } else {
    p[0] *= sx;
    p[1] *= sy;
  }
  p[centre] = (p[centre] + 0.5) * sx - 0.5;
  p[centre + 1] = (p[centre + 1] + 0.5) * sy - 0.5;
  result.error_px = std::min(result.error_px * std::sqrt(sx * sy), most_error_px(result));
  check(result);
  return result;
}

}  // namespace calibrate
