// Pictures as the operator's display shows them, as PNG.
#pragma once

#include <string>

#include "capture/image.h"
#include "compositing/display.h"
#include "studio/set.h"

namespace studio {

// Of a set's [display].
compositing::DisplaySettings display_settings(const Set& set);

// `rgba` (scene-linear, 4 channels) through the display transform. Throws std::runtime_error if the
// file cannot be written.
void write_display_png(const std::string& path, const capture::Image& rgba);

}  // namespace studio
