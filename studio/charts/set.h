// The chart of a whole set: error against time of effort's settings, on this machine.
#pragma once

#include <string>

#include "studio/chart.h"
#include "studio/console.h"

namespace studio {

struct SetChartSettings {
  int samples = 256;   // of the reference, at least 2
  bool quick = false;  // fewer points and frames: for tests
};

// Puts the set on air with each setting in turn, all of it but the recording of EXR frames; videos
// are recorded into a temporary directory, so that the set's own takes stay as they are. Measures
// the time from frame to frame and the error of the last one against the reference. The
// chart's stage is "NAME.chart" for a set file NAME.toml. Throws SetError as Show, and for a set
// with a live camera, be it plate, probe, a video or a person's, and std::runtime_error for a set
// whose last frame nothing virtual is in.
Chart chart_set(const std::string& set_path, const SetChartSettings& settings, Console& console);

}  // namespace studio
