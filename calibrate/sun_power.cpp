// A clipped sun's power by the ratio of light and shadow.
#include "calibrate/sun_power.h"

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace calibrate {
namespace {

void require_positive(double value, const char* what) {
  if (!(value > 0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string("a sun's power needs ") + what + " above 0");
  }
}

}  // namespace

SunPower solve_sun_power(const SunPatches& patches) {
  require_positive(patches.sun_cosine, "a sun above the patches' plane, its cosine");
  if (patches.sun_cosine > 1) throw std::invalid_argument("a cosine is at most 1");
  SunPower sun;
  for (std::size_t c = 0; c < 3; ++c) {
    require_positive(patches.lit[c], "a lit patch");
    require_positive(patches.shadow[c], "a patch in shadow");
    require_positive(patches.sky_at_lit[c], "irradiance of the sky");
    require_positive(patches.sky_at_shadow[c], "irradiance of the sky in the shadow");
    if (!(patches.lit_sigma[c] >= 0) || !(patches.shadow_sigma[c] >= 0)) {
      throw std::invalid_argument("a patch's deviation is 0 or more");
    }
    const double ratio = patches.lit[c] / patches.shadow[c];
    const double lit = ratio * patches.sky_at_shadow[c];  // irradiance of the lit patch
    if (!(lit > patches.sky_at_lit[c])) {
      throw std::runtime_error(
          "the lit patch is no brighter than the sky alone makes it: are lit and shadow patch the "
          "right way round, and of one material?");
    }
    sun.irradiance[c] = (lit - patches.sky_at_lit[c]) / patches.sun_cosine;
    const double relative = std::hypot(patches.lit_sigma[c] / patches.lit[c],
                                       patches.shadow_sigma[c] / patches.shadow[c]);
    sun.sigma[c] = lit * relative / patches.sun_cosine;
  }
  return sun;
}

}  // namespace calibrate
