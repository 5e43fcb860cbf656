// Light between surfaces: how many lamps it needs.
#pragma once

#include "studio/chart.h"

namespace studio {

// Adds the points of the papers' TV room, all in grey, lit by its lamp and the sky, with no lamps
// of bounced light to 256, against the reference that follows light between surfaces. Times are of
// placing the lamps and one frame that keeps nothing.
void add_bounce_lamps(bool quick, Chart& chart);

}  // namespace studio
