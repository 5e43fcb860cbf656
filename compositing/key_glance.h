// What is bare screen at a glance.
#pragma once

#include <array>
#include <vector>

#include "capture/colour.h"
#include "compositing/clean_plate.h"
#include "compositing/key_lanes.h"

namespace compositing {

// Bounds within which eight pixels of a row are screen, for each 8x8 pixels, row by row: the
// primary from 4.5 % below the plate to 15 % above, the others no brighter than it by more than
// noise. A thing that covers less than a twentieth of each of eight pixels is given up. `bounds`
// keeps its memory.
void bound_screen(const LitPlate& lit, std::vector<LightBounds>& bounds);

// The same of codes; `order` as of channels_of().
void bound_screen(const LitPlate& lit,
                  capture::Transfer transfer,
                  const std::array<int, 3>& order,
                  std::vector<CodeBounds>& bounds);

// Bounds of the same under so many times the light.
LightBounds under(const LightBounds& bounds, float gain);
// As codes.
CodeBounds codes_of(const LightBounds& bounds,
                    capture::Transfer transfer,
                    const std::array<int, 3>& order);

}  // namespace compositing
