// The chart of glass: rays that are followed until they no longer matter.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

ChartStage glass_chart();

}  // namespace studio
