// Runs of real files: a sequence of stills, an object, a sky.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/png.h"
#include "tests/studio/command_line.h"
#include "tests/studio/made_show.h"

namespace studio {

class Runs : public CommandLine {
 protected:
  std::string write_set() const {
    const std::vector<std::uint8_t> grey(64 * 48 * 3, 120);
    for (int i = 0; i < 3; ++i) {
      capture::write_png(dir_ / ("plate_" + std::to_string(i) + ".png"), 64, 48, 3, grey);
    }
    return write_made_set(dir_, "file:plate_%d.png");
  }
};

}  // namespace studio
