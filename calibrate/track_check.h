// What of a track is to be doubted.
#pragma once

#include <string>
#include <vector>

#include "calibrate/track.h"

namespace calibrate {

// What can be read, but is hardly what a camera did, each in words: stretches without keys, and
// jumps, among keys that are otherwise even; times that are of milliseconds or frames; places in
// millimetres; a camera that hangs upside down throughout. Nothing of a track with fewer than ten
// keys but the last two: it may be written by hand.
std::vector<std::string> doubts_of(const Track& track);

}  // namespace calibrate
