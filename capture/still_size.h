// The size of a picture, from its first bytes.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace capture {

// {width, height} that the header of a PNG or JPEG file in memory claims; nothing if it is neither,
// or ends before it says. Nothing is decoded.
//
// PNG specification (ISO/IEC 15948), 11.2.2; JPEG (ITU-T T.81), B.2.2.
std::optional<std::array<std::size_t, 2>> claimed_size(std::span<const std::byte> file_bytes);

}  // namespace capture
