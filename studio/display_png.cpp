// Pictures for documents and eyes.
#include "studio/display_png.h"

#include <cstdint>
#include <vector>

#include "capture/png.h"

namespace studio {

compositing::DisplaySettings display_settings(const Set& set) {
  compositing::DisplaySettings settings;
  if (!set.display.display.empty()) settings.display = set.display.display;
  if (!set.display.view.empty()) settings.view = set.display.view;
  return settings;
}

void write_display_png(const std::string& path, const capture::Image& rgba) {
  const compositing::Display display;
  std::vector<std::uint8_t> codes(rgba.pixels.size() / 4 * 3);
  display.to_rgb8(capture::to_half(rgba), codes);
  capture::write_png(path, rgba.width, rgba.height, 3, codes);
}

}  // namespace studio
