// The chart of the keyer: error against time for its settings and other tools' formulas.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

ChartStage key_chart();

}  // namespace studio
