// What can be charted. Each stage measures itself in a file of its own under studio/charts and is
// listed once, in chart_stages.cpp.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "studio/chart.h"
#include "studio/console.h"

namespace studio {

// What a stage may be asked for beside its name.
struct ChartRequest {
  std::string set;     // set file to measure with; "" = the stage's own made scene
  bool quick = false;  // fewer points and repeats: for tests
  std::string out{};   // directory for pictures beside the chart; "" = none are wanted
};

struct ChartStage {
  std::string_view name;     // "lights"
  std::string_view summary;  // one line
  // Measures. Says how far it is through the console. Its points need not be marked.
  std::function<Chart(const ChartRequest&, Console&)> measure;
  bool takes_set = false;  // whether it looks at the request's set file
};

std::span<const ChartStage> chart_stages();

}  // namespace studio
