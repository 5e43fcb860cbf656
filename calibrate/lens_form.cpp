// What a lens solve chooses from: a model, and which of its parameters it may move.
#include "calibrate/lens_form.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "calibrate/mrcal_lens.h"

extern "C" {  // mrcal's headers do not say so themselves
#include <mrcal/mrcal.h>
}

namespace calibrate {
namespace {

constexpr std::string_view symmetric = "kannala_brandt";
constexpr std::string_view decentred = "decentred_kannala_brandt";
constexpr std::size_t max_terms = 4;
// Closer to the axis than this, in lengths of the point, angle and sine are alike.
constexpr double paraxial = 1e-9;

// How many parameters of a model stand before its terms.
std::size_t before_terms(const std::string& model) { return model == decentred ? 6 : 4; }

bool is_angular(const std::string& model) { return model == symmetric || model == decentred; }

std::size_t parameter_count(const LensForm& form) {
  if (is_mrcal_model(form.model)) {
    return static_cast<std::size_t>(count_mrcal_parameters(form.model));
  }
  if (!is_angular(form.model)) {
    throw std::invalid_argument("a lens of model " + form.model + " cannot be solved for");
  }
  if (form.terms > max_terms) throw std::invalid_argument("Kannala and Brandt's terms are 0 to 4");
  return before_terms(form.model) + form.terms;
}

}  // namespace

std::string name_of(const LensForm& form) {
  std::string name = form.model;
  if (is_angular(form.model)) name += " " + std::to_string(form.terms);
  if (!form.one_focal) name += " fx fy";
  return name;
}

std::size_t free_count(const LensForm& form) {
  return parameter_count(form) - (form.one_focal ? 1 : 0);
}

Lens lens_of(const LensForm& form, int width, int height, std::span<const double> free) {
  if (free.size() != free_count(form)) {
    throw std::invalid_argument("wrong number of free parameters of " + name_of(form));
  }
  Lens lens{form.model, width, height, {free.begin(), free.end()}};
  if (form.one_focal) lens.parameters.insert(lens.parameters.begin(), free[0]);
  return lens;
}

std::vector<double> free_of(const LensForm& form, const Lens& lens) {
  std::vector<double> parameters(parameter_count(form), 0.0);
  const std::vector<double>& given = lens.parameters;
  if (lens.model == form.model) {
    std::copy_n(given.begin(), std::min(given.size(), parameters.size()), parameters.begin());
  } else if (is_angular(lens.model) && is_angular(form.model)) {
    std::copy_n(given.begin(), 4, parameters.begin());
    const std::size_t from = before_terms(lens.model);
    const std::size_t to = before_terms(form.model);
    std::copy_n(given.begin() + static_cast<std::ptrdiff_t>(from),
                std::min(given.size() - from, parameters.size() - to),
                parameters.begin() + static_cast<std::ptrdiff_t>(to));
  } else {
    // mrcal's OpenCV models each begin with the parameters of the smaller ones.
    const bool nested =
        lens.model.starts_with("LENSMODEL_OPENCV") && form.model.starts_with("LENSMODEL_OPENCV");
    std::copy_n(given.begin(), nested ? std::min(given.size(), parameters.size()) : std::size_t{4},
                parameters.begin());
  }
  if (form.one_focal) {
    parameters[1] = 0.5 * (parameters[0] + parameters[1]);
    parameters.erase(parameters.begin());
  }
  return parameters;
}

LensFunction::LensFunction(const LensForm& form)
    : form_(form),
      free_count_(calibrate::free_count(form)),
      mrcal_(is_mrcal_model(form.model)),
      decentred_(form.model == decentred) {
  if (!mrcal_) return;
  mrcal_lensmodel_t model{};
  if (!mrcal_lensmodel_from_name(&model, form.model.c_str())) {
    throw std::invalid_argument("libmrcal does not know " + form.model);
  }
  sees_behind_ = mrcal_lensmodel_metadata(&model).can_project_behind_camera;
  mrcal_model_.resize(sizeof model);
  std::memcpy(mrcal_model_.data(), &model, sizeof model);
}

bool LensFunction::operator()(
    const double* free, Vec3 p_cam, Vec2& q, double* dq_dp, double* dq_dfree) const {
  return mrcal_ ? by_mrcal(free, p_cam, q, dq_dp, dq_dfree)
                : by_angle(free, p_cam, q, dq_dp, dq_dfree);
}

bool LensFunction::by_mrcal(
    const double* free, Vec3 p_cam, Vec2& q, double* dq_dp, double* dq_dfree) const {
  if (!sees_behind_ && !(p_cam.z > 0)) return false;
  mrcal_lensmodel_t model;
  std::memcpy(&model, mrcal_model_.data(), sizeof model);
  // With one focal length, the first two of mrcal's parameters are both the first free one.
  const std::size_t merged = form_.one_focal ? 1 : 0;
  const std::size_t n = free_count_ + merged;
  thread_local std::vector<double> parameters;
  thread_local std::vector<double> gradient;
  parameters.resize(n);
  parameters[0] = free[0];
  std::copy_n(free, free_count_, parameters.begin() + static_cast<std::ptrdiff_t>(merged));
  gradient.resize(2 * n);
  const mrcal_point3_t p{{p_cam.x, p_cam.y, p_cam.z}};
  mrcal_point2_t at{};
  std::array<mrcal_point3_t, 2> by_point{};
  if (!mrcal_project(&at, dq_dp == nullptr ? nullptr : by_point.data(),
                     dq_dfree == nullptr ? nullptr : gradient.data(), &p, 1, &model,
                     parameters.data())) {
    return false;
  }
  if (!std::isfinite(at.x) || !std::isfinite(at.y)) return false;
  q = {at.x, at.y};
  if (dq_dp != nullptr) {
    for (std::size_t row = 0; row < 2; ++row) std::copy_n(by_point[row].xyz, 3, dq_dp + 3 * row);
  }
  if (dq_dfree != nullptr) {
    for (std::size_t row = 0; row < 2; ++row) {
      const double* from = gradient.data() + row * n;
      double* to = dq_dfree + row * free_count_;
      std::copy_n(from + merged, free_count_, to);
      if (merged == 1) to[0] += from[0];
    }
  }
  return true;
}

// Kannala and Brandt's polynomial of the angle, then Brown's decentring; see axial_lens.h.
bool LensFunction::by_angle(
    const double* free, Vec3 p, Vec2& q, double* dq_dp, double* dq_dfree) const {
  const double fx = free[0];
  const double* rest = free + (form_.one_focal ? 1 : 2);
  const double fy = form_.one_focal ? fx : free[1];
  const double p1 = decentred_ ? rest[2] : 0;
  const double p2 = decentred_ ? rest[3] : 0;
  const double* k = rest + (decentred_ ? 4 : 2);

  const double off2 = p.x * p.x + p.y * p.y;
  const double l2 = off2 + p.z * p.z;
  if (!(l2 > 0) || !std::isfinite(l2)) return false;
  const double off = std::sqrt(off2);
  const bool on_axis = off2 <= paraxial * paraxial * l2;
  if (on_axis && p.z <= 0) return false;
  const double t = std::atan2(off, p.z);
  const double t2 = t * t;
  double radius = 1;
  double slope = 1;
  double power = 1;
  for (std::size_t j = 0; j < form_.terms; ++j) {
    power *= t2;
    radius += k[j] * power;
    slope += (2 * static_cast<double>(j) + 3) * k[j] * power;
  }
  radius *= t;

  // The symmetric picture point (u, v) = (x, y) * s, in focal lengths.
  const double s = on_axis ? 1 / p.z : radius / off;
  const double u = p.x * s;
  const double v = p.y * s;
  const double r2 = u * u + v * v;
  const double shifted_u = u + 2 * p1 * u * v + p2 * (r2 + 2 * u * u);
  const double shifted_v = v + p1 * (r2 + 2 * v * v) + 2 * p2 * u * v;
  q = {fx * shifted_u + rest[0], fy * shifted_v + rest[1]};
  if (!std::isfinite(q.x) || !std::isfinite(q.y)) return false;

  // Derivatives of the shifted point by the symmetric one.
  const double uu = 1 + 2 * p1 * v + 6 * p2 * u;
  const double uv = 2 * p1 * u + 2 * p2 * v;
  const double vv = 1 + 6 * p1 * v + 2 * p2 * u;
  if (dq_dp != nullptr) {
    Vec3 ds{0, 0, -s / p.z};
    if (!on_axis) {
      const double along = slope * p.z / (l2 * off2) - s / off2;
      ds = {along * p.x, along * p.y, -slope / l2};
    }
    const Vec3 du{s + p.x * ds.x, p.x * ds.y, p.x * ds.z};
    const Vec3 dv{p.y * ds.x, s + p.y * ds.y, p.y * ds.z};
    const Vec3 dx = fx * (uu * du + uv * dv);
    const Vec3 dy = fy * (uv * du + vv * dv);
    for (const Vec3 row : {dx, dy}) {
      *dq_dp++ = row.x;
      *dq_dp++ = row.y;
      *dq_dp++ = row.z;
    }
  }
  if (dq_dfree != nullptr) {
    double* x = dq_dfree;
    double* y = dq_dfree + free_count_;
    std::fill_n(dq_dfree, 2 * free_count_, 0.0);
    *x++ = shifted_u;
    if (!form_.one_focal) *x++ = 0, *y++ = 0;
    *y++ = shifted_v;
    *x = 1;
    y[1] = 1;
    x += 2;
    y += 2;
    if (decentred_) {
      *x++ = fx * 2 * u * v;
      *x++ = fx * (r2 + 2 * u * u);
      *y++ = fy * (r2 + 2 * v * v);
      *y++ = fy * 2 * u * v;
    }
    double scale = on_axis ? 0 : t / off;
    for (std::size_t j = 0; j < form_.terms; ++j) {
      scale *= t2;
      *x++ = fx * scale * (uu * p.x + uv * p.y);
      *y++ = fy * scale * (uv * p.x + vv * p.y);
    }
  }
  return true;
}

}  // namespace calibrate
