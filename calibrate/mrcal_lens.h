// mrcal's lens models, through libmrcal.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "calibrate/lens.h"

namespace calibrate {

// Whether a model's name is meant for mrcal: it begins with LENSMODEL_.
bool is_mrcal_model(std::string_view model);

// The number of parameters of one of mrcal's models. Throws std::invalid_argument for models that
// do not exist, that libmrcal would abort the program for (CAHVORE), and for splines that it cannot
// use.
int count_mrcal_parameters(std::string_view model);

// `lens` passes check(). One result per input, in order; nothing where the model has none, where
// its distortion has folded back over itself, or beyond the knots of a spline.
std::vector<std::optional<Vec2>> project_by_mrcal(const Lens& lens, std::span<const Vec3> v_cam);
std::vector<std::optional<Vec3>> unproject_by_mrcal(const Lens& lens, std::span<const Vec2> q);

}  // namespace calibrate
