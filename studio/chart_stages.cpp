// The table of charts.
#include "studio/chart_stages.h"

#include <vector>

#include "studio/charts/lights.h"
#include "studio/charts/photograph.h"

namespace studio {

std::span<const ChartStage> chart_stages() {
  static const std::vector<ChartStage> all{lights_chart(), photograph_chart()};
  return all;
}

}  // namespace studio
