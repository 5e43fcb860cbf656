// Environments as bytes, for jobs that travel.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "render/environment.h"

namespace render {

std::vector<std::byte> serialize(const Environment& environment);
// Throws std::runtime_error on bytes that no serialize() wrote.
Environment parse_environment(std::span<const std::byte> bytes);

}  // namespace render
