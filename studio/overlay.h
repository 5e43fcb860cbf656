// Lines over a picture that show where things of the set are.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "studio/show.h"

namespace studio {

// "grid": the set's ground, z = 0, in steps that fit what is seen, with whole metres bright.
// "axes": the set's axes, x red, y green, z blue, as long as a grid step.
// "stand_in": edges of the stand-ins.
// "coverage": tints what virtual objects cover and what they change.
// "light": where the lights of the table stand in the picture, as large as they are strong.
const std::vector<std::string>& overlay_names();

// Draws overlays into display codes (height, width, 3), through the camera's lens. Names that are
// not known throw std::invalid_argument.
void draw_overlays(const Set& set,
                   const ShownFrame& shown,
                   const std::vector<std::string>& names,
                   std::vector<std::uint8_t>& rgb8);

}  // namespace studio
