// The chart of whole frames: the papers' scenes at all efforts, against their references.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

ChartStage render_chart();

}  // namespace studio
