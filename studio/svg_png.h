// Pictures from SVG.
#pragma once

#include <string>

namespace studio {

// Draws an SVG text on white into a PNG file, `scale` times as large as its own pixels. Throws
// std::runtime_error with path and reason.
void write_svg_as_png(const std::string& svg, const std::string& path, double scale);

}  // namespace studio
