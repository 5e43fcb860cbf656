// The chart of the light table: error against time.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

// For every number of lights, method and way of testing visibility: time of the table and the
// frame, error against the reference (every light of the whole map), flicker from frame to frame
// under noise. Beside it per-pixel importance sampling, the plain alternative.
ChartStage lights_chart();

}  // namespace studio
