// The chart of the composite against the photograph: the error of it all, and what it is made of.
#pragma once

#include "studio/chart_stages.h"

namespace studio {

// The composite of a made set against the photograph of the same world with the car really there;
// then with one part of it replaced by the truth, for every part; then with one after the other,
// down to what the program's model of the world leaves out. Without a set, the made court. With
// one, it must be of `platelight demo`.
ChartStage photograph_chart();

}  // namespace studio
