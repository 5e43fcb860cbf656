// The table of charts.
#include "studio/chart_stages.h"

#include <vector>

#include "studio/charts/glass.h"
#include "studio/charts/hdr.h"
#include "studio/charts/hull.h"
#include "studio/charts/key.h"
#include "studio/charts/lens.h"
#include "studio/charts/lights.h"
#include "studio/charts/photograph.h"
#include "studio/charts/render.h"

namespace studio {

std::span<const ChartStage> chart_stages() {
  static const std::vector<ChartStage> all{glass_chart(),      hdr_chart(),   hull_chart(),
                                           key_chart(),        lens_chart(),  lights_chart(),
                                           photograph_chart(), render_chart()};
  return all;
}

}  // namespace studio
