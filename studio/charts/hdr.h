// The chart of the HDR merge: error against time.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

// A made scene of 16 stops before a made linear sensor, in brackets of two to five exposures. For
// every merge of ours: CPU time of a frame, error in stops, share of values whose truth lies within
// the reported deviation; beside them OpenCV's MergeDebevec and MergeRobertson on the same 8-bit
// codes with the true response, and the time to read and write the same memory once. Then error and
// reported deviation as light, bracket, exposures and response get worse and worse.
ChartStage hdr_chart();

}  // namespace studio
