// Where a key holds, from pictures that somebody drew.
#pragma once

#include <string>

#include "compositing/keyer.h"
#include "studio/clean_plates.h"

namespace studio {

// Paths; "" = none.
struct KeyMaskFiles {
  std::string garbage;  // white is never the person
  std::string core;     // white is always the person

  bool empty() const { return garbage.empty() && core.empty(); }
  friend bool operator==(const KeyMaskFiles&, const KeyMaskFiles&) = default;
};

// For videos of that size, also of the whole pictures that they are part of. Throws
// std::runtime_error if a file cannot be read, std::invalid_argument naming file and sizes, or the
// pixel that is no number, if it is no mask for them.
compositing::KeyMasks read_key_masks(const KeyMaskFiles& files,
                                     int width,
                                     int height,
                                     const ShownPart& shown = {});

}  // namespace studio
