// 8-bit sRGB codes to linear light and back, by tables.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "calibrate/vec.h"

namespace render {

struct SrgbTables {
  std::array<float, 256> light_of_code;
  std::array<std::uint8_t, 16384> code_of_light;  // fine enough for sRGB's steepest part

  SrgbTables();
  // The code that is nearest to a light; to what is beyond 0..1 the nearest there.
  std::uint8_t code(float light) const {
    const auto top = static_cast<float>(code_of_light.size() - 1);
    const float unit = light > 0 ? std::min(light, 1.0F) : 0;
    return code_of_light[static_cast<std::size_t>(unit * top + 0.5F)];
  }
};
const SrgbTables& srgb_tables();

// The same of red, green and blue.
calibrate::Vec3f light_of_codes(const std::array<std::uint8_t, 3>& codes);
std::array<std::uint8_t, 3> codes_of_light(calibrate::Vec3f light);

}  // namespace render
