// What a show tells of itself, in words.
#pragma once

#include <string>

namespace studio {

// A note without its numbers: those of a kind differ in them alone.
inline std::string kind_of_note(const std::string& note) {
  std::string kind;
  for (const char c : note) {
    if (c >= '0' && c <= '9') {
      if (kind.empty() || kind.back() != '#') kind += '#';
    } else {
      kind += c;
    }
  }
  return kind;
}

}  // namespace studio
