// The chart of the light table: error against time.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

// On the bench car in matte grey, through its pixels' centres, where nothing but the light errs.
// For every number of lights, method and way of testing shadows: time of table and frame, error
// against the whole map, its 99th percentile, flicker from frame to frame under noise, with the
// table made anew and with the light followed as in a show. Beside it per-pixel importance
// sampling, the plain alternative. Then error and the table's own estimate of it as sun and number
// of lights change, and the error of the whole picture, with its floor of edges and mirrors.
ChartStage lights_chart();

}  // namespace studio
