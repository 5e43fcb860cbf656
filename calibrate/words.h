// Sentences with numbers in them, as printf has them.
#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace calibrate {

// At most 399 characters.
template <class... T>
std::string words(const char* format, T... values) {
  std::array<char, 400> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, values...);
  return buffer.data();
}

}  // namespace calibrate
