// The chart of lens calibration.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

// Ray error of every lens form and of other tools against time, on a made fish-eye and a made
// normal lens; and the error, with what is told of it, while corners and pictures get worse.
ChartStage lens_chart();

}  // namespace studio
