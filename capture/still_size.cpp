// The size of a picture, from its first bytes.
#include "capture/still_size.h"

#include <cstdint>
#include <string_view>

namespace capture {
namespace {

using namespace std::string_view_literals;

std::size_t big_endian(std::span<const std::byte> bytes) {
  std::size_t value = 0;
  for (const std::byte byte : bytes) value = value << 8U | std::to_integer<std::size_t>(byte);
  return value;
}

// Whether a marker begins a frame: all SOFs, but not DHT, JPG, DAC among them.
bool begins_frame(unsigned marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

}  // namespace

std::optional<std::array<std::size_t, 2>> claimed_size(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\x89PNG\r\n\x1a\n"sv)) {
    if (bytes.size() < 24) return std::nullopt;
    return std::array{big_endian(bytes.subspan(16, 4)), big_endian(bytes.subspan(20, 4))};
  }
  if (!text.starts_with("\xff\xd8"sv)) return std::nullopt;
  std::size_t at = 2;
  while (at + 9 <= bytes.size()) {
    if (bytes[at] != std::byte{0xFF}) return std::nullopt;
    const auto marker = std::to_integer<unsigned>(bytes[at + 1]);
    if (marker == 0xFF) {  // padding
      ++at;
      continue;
    }
    if (begins_frame(marker)) {
      return std::array{big_endian(bytes.subspan(at + 7, 2)), big_endian(bytes.subspan(at + 5, 2))};
    }
    at += 2 + big_endian(bytes.subspan(at + 2, 2));
  }
  return std::nullopt;
}

}  // namespace capture
