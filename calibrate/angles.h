// Angles.
#pragma once

#include <numbers>

namespace calibrate {

inline constexpr float pi_f = std::numbers::pi_v<float>;
inline constexpr double degree = std::numbers::pi / 180;  // rad

}  // namespace calibrate
