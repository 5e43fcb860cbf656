// Video as light: how many lamps a screen needs.
#pragma once

#include "studio/chart.h"

namespace studio {

// Adds the points of two scenes with a screen of 1x1 to 9x9 lamps: over a bare floor, against the
// closed form of its light, and in the papers' TV room, all in grey, whose furniture casts shadows,
// against 33x33 lamps. One camera ray a pixel, so that nothing but the lamps errs.
void add_screen_lamps(bool quick, Chart& chart);

}  // namespace studio
