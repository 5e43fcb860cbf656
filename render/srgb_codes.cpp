// 8-bit sRGB codes to linear light and back, by tables.
#include "render/srgb_codes.h"

#include <cmath>

#include "capture/colour.h"

namespace render {

SrgbTables::SrgbTables() {
  for (std::size_t i = 0; i < 256; ++i) {
    const double value = static_cast<double>(i) / 255;
    light_of_code[i] = static_cast<float>(capture::decode(capture::Transfer::srgb, value));
  }
  for (std::size_t i = 0; i < code_of_light.size(); ++i) {
    const double light = static_cast<double>(i) / static_cast<double>(code_of_light.size() - 1);
    const double value = capture::encode(capture::Transfer::srgb, light);
    code_of_light[i] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
  }
}

const SrgbTables& srgb_tables() {
  static const SrgbTables tables;
  return tables;
}

calibrate::Vec3f light_of_codes(const std::array<std::uint8_t, 3>& codes) {
  const auto& light = srgb_tables().light_of_code;
  return {light[codes[0]], light[codes[1]], light[codes[2]]};
}

std::array<std::uint8_t, 3> codes_of_light(calibrate::Vec3f light) {
  const SrgbTables& tables = srgb_tables();
  return {tables.code(light.x), tables.code(light.y), tables.code(light.z)};
}

}  // namespace render
