// What is hard for a whole frame: how its error grows with one circumstance after the other.
#pragma once

#include <vector>

#include "studio/chart.h"
#include "studio/console.h"

namespace studio {

// At the default effort: the car under other suns and from afar, and a sphere of more and more
// shells of glass. `from`, `to`: shares of the chart's time, for the progress bar.
std::vector<Stressor> render_stressors(bool quick, Console& console, double from, double to);

}  // namespace studio
