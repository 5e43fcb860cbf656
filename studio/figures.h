// Figures of a show as JSON, for scripts.
#pragma once

#include <optional>
#include <string>

#include "render/reference.h"
#include "studio/set.h"
#include "studio/show.h"

namespace studio {

// What `still --reference` took.
struct ReferenceFigures {
  int paths = 0;  // per pixel
  double seconds = 0;
};

// The JSON text of `run --json`: what ShowStatus has, in its units, with the effort, what was
// recorded, memory, and the error and the reference if there is one.
std::string show_figures(const Set& set,
                         const ShowStatus& status,
                         const std::optional<render::PictureError>& error,
                         const std::optional<ReferenceFigures>& reference = {});

// The most memory that this process has held so far, in megabytes (2^20 bytes).
double peak_memory_mb();

}  // namespace studio
