// A chart as `platelight chart STAGE --quick` measures it.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

inline Chart measure_quickly(const ChartStage& stage) {
  ChartRequest request;
  request.quick = true;
  Console console(true, "");
  return stage.measure(request, console);
}

}  // namespace studio
