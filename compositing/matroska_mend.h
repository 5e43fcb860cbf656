// What a Matroska file says of itself, once its end was cut off.
#pragma once

#include <cstdint>

namespace compositing {

// Sets durations that are longer than `length_s` to it, and voids what the index, which begins at
// byte `end`, says of clusters from there on: both count what was cut off. `descriptor` can be read
// and written; a file that is none of ours stays as it is.
void mend_cut_matroska(int descriptor, std::int64_t end, double length_s) noexcept;

}  // namespace compositing
