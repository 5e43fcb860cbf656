// Light through glass: how many photons it needs.
#pragma once

#include "studio/chart.h"

namespace studio {

// Adds the points of a ball of glass over a grey floor, under the daylight of the papers' scenes,
// with light that goes straight through it and with up to 256k photons, against the reference in
// which all light is bent. Times are of finding the caustics and one frame that keeps nothing.
void add_caustics(bool quick, Chart& chart);

}  // namespace studio
