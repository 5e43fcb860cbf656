// Which board: options that several commands share.
#pragma once

#include <optional>
#include <string>

#include "calibrate/board.h"
#include "studio/arguments.h"

namespace studio {

struct BoardOptions {
  std::string corners = "10x7";
  std::optional<double> square_m;
  bool charuco = false;
  std::optional<double> marker_m;
  std::string dictionary;
};

// --board, --square, --charuco, --marker and --dictionary.
void declare(Arguments& arguments, BoardOptions& options);

// Throws UsageError for what is no board, or a dictionary that is unknown or has too few markers.
calibrate::Board board_of(const BoardOptions& options);

}  // namespace studio
