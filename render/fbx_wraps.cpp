// Textures of FBX files that do not repeat.
#include "render/fbx_wraps.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace render {
namespace {

// What follows a property's name in ascii: `", "enum", "", "",1`.
bool is_set_in_text(std::string_view rest) {
  const std::string_view line = rest.substr(0, rest.find('\n'));
  const std::size_t comma = line.rfind(',');
  if (comma == std::string_view::npos) return false;
  return line.substr(comma + 1).find_first_of("123456789") != std::string_view::npos;
}

// In binary: three texts, 'S' with 32 bits of length each, then 'I' and 32 bits.
bool is_set_in_bytes(std::string_view rest) {
  const auto take_number = [&rest](char kind, std::uint32_t& number) {
    if (rest.size() < 5 || rest[0] != kind) return false;
    std::memcpy(&number, rest.data() + 1, sizeof number);
    rest.remove_prefix(5);
    return true;
  };
  std::uint32_t length = 0, value = 0;
  for (int i = 0; i < 3; ++i) {
    if (!take_number('S', length) || length > rest.size()) return false;
    rest.remove_prefix(length);
  }
  return take_number('I', value) && value != 0;
}

}  // namespace

bool fbx_clamps(std::span<const std::byte> file_bytes) {
  const std::string_view file(reinterpret_cast<const char*>(file_bytes.data()), file_bytes.size());
  constexpr std::string_view name = "WrapMode";  // ...U and ...V
  for (std::size_t at = file.find(name); at != std::string_view::npos;
       at = file.find(name, at + name.size())) {
    const std::string_view rest = file.substr(std::min(at + name.size() + 1, file.size()));
    if (rest.starts_with('"') ? is_set_in_text(rest) : is_set_in_bytes(rest)) return true;
  }
  return false;
}

}  // namespace render
