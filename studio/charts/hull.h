// The chart of persons from the side: error of billboards and visual hulls against the view's
// angle.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

ChartStage hull_chart();

}  // namespace studio
