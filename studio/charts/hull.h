// The chart of persons from the side: error of billboards and visual hulls against the view's
// angle.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

ChartStage hull_chart();

// How far off the outline of a made walker's billboard is, in metres on the person, against the
// angle of the view from its camera's, beside what is stated (billboard_error_m).
Stressor billboard_view_stressor(bool quick, Console& console);

}  // namespace studio
