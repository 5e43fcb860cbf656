// Figures of a show as JSON, for scripts.
#pragma once

#include <optional>
#include <string>

#include "render/reference.h"
#include "studio/set.h"
#include "studio/show.h"

namespace studio {

// The JSON text of `run --json`: see studio/docs/figures.md.
std::string show_figures(const Set& set,
                         const ShowStatus& status,
                         const std::optional<render::PictureError>& error);

// The most memory that this process has held so far, in megabytes (2^20 bytes).
double peak_memory_mb();

}  // namespace studio
