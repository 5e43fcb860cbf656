// How the keyer's table is learned.
#pragma once

#include <cstdint>
#include <span>

#include "compositing/key_table.h"

namespace compositing {

// For places near the screen and deep within persons: the mean true alpha, and the mean share of
// the plate in what is not the person, of all pixels of made clips that lie at each place of the
// table: the least squares of both. Every other seed's persons have colours of any hue, and count
// less; further ones wear clothes with some green, and teach the second part alone. Where hardly
// any pixel lies, the plain ratio pulls, or, where that would take something brighter than white to
// shine through, that it does not.
TableCodes train_key_table(std::span<const std::uint32_t> seeds);

// The seeds of the table that ships; tests judge others.
inline constexpr std::uint32_t training_seeds[] = {31, 32, 33, 34, 35, 36};

}  // namespace compositing
